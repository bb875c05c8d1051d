"""Reading of text files that somebody names: a folder, a device or other bytes are one clear error."""

from __future__ import annotations

from pathlib import Path

from .errors import NlsError

MOST_BYTES = 2**26
"""Largest text file: 64 MiB, a thousand times a large deck. Records have a bound of their own."""


def is_there(path: Path) -> bool:
    """Tell whether something of that name exists; a name that no file can have does not."""
    try:
        return path.exists()
    except (OSError, ValueError):  # longer than a name may be, or with a zero byte
        return False


def text_of(path: Path, kind: type[NlsError], *, next_step: str = "give a text file in UTF-8") -> str:
    """Return the text of a file, without the byte order mark that an editor may have put in front."""
    try:
        if is_there(path) and not path.is_file():
            raise kind(str(path), "cannot be read: it is a folder or a device", next_step=next_step)
        size = path.stat().st_size
        if size > MOST_BYTES:
            rule = f"has {size / 2**20:.0f} MiB, at most {MOST_BYTES // 2**20} MiB are read"
            raise kind(str(path), rule, next_step=next_step)
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        rule = f"cannot be read: it is no text in UTF-8, {error.reason} at byte {error.start}"
        raise kind(str(path), rule, next_step=next_step) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise kind(str(path), f"cannot be read: {reason}", next_step=next_step) from None
