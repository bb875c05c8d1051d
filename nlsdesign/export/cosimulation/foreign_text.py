"""Text from foreign files and libraries, made fit for a message."""

from __future__ import annotations

_LONGEST = 300


def fit_to_show(text: object) -> str:
    """Return text in one line of printable characters, cut where it is long."""
    whole = str(text)
    line = " ".join("".join(c if c.isprintable() else " " for c in whole[: 4 * _LONGEST]).split())
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ..."
