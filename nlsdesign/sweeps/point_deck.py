"""The deck behind a point of a sweep, as text."""

from __future__ import annotations

from ..components.assembly.deck_writer import deck_text
from .sweep_table import SweepTable


def point_deck_text(table: SweepTable, point: int) -> str:
    """Return the deck behind a point: the deck that was swept with the numbers and materials of the point.

    Axes that belong to the question and not to the machine, such as a target or a seed, stand above it as
    comments.

    Parameters
    ----------
    table
        Of the sweep.
    point
        Number of the point, from 0.

    Raises
    ------
    UnknownNameError
        If there is no such point.
    MeasurementError
        If the deck that was swept does not stand beside the table.
    NlsError
        If a part refuses a number of the point, which is then why the point failed.
    """
    row = table.row_of(point)
    text = deck_text(table.assembly_at(point))
    lines = [f"Point {point} of a sweep of {table.about.get('deck', 'a deck')}; its axes, in SI:"]
    lines += [f"{axis.name} = {table.values[axis.name][row]} {axis.unit}".rstrip() for axis in table.axes]
    head = "".join(f"# {' '.join(_printable(line).split())}\n" for line in lines)
    return head + text


def _printable(text: str) -> str:
    """Return a text without control characters, which a comment of TOML may not hold."""
    return "".join(each if each.isprintable() else " " for each in text)
