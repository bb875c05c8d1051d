"""Atomic writing: a file appears whole or not at all. Every file of the package is written here."""

from __future__ import annotations

import contextlib
import csv
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from .errors import ExportError
from .written_files import note_written, place_for

_drafts: set[Path] = set()


@contextmanager
def draft(target: Path) -> Iterator[Path]:
    """Yield a temporary file in the same folder; it replaces the target if no error occurs.

    While a command keeps what others have changed, it goes beside such a target instead.

    ``target``: final path; its folder is made if it is missing.
    """
    # The name is noted before the file exists, so that an interrupt at any moment leaves none behind.
    name = target.parent / f".{target.name}.{secrets.token_hex(6)}"
    _drafts.add(name)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        yield name
        # A temporary file can be read by its owner only.
        os.chmod(name, 0o644)
        place = place_for(target, Path(name))
        os.replace(name, place)
        note_written(place)
    except OSError as error:
        raise _not_writable(target, error) from error
    finally:
        with contextlib.suppress(OSError):  # where its folder could not be made
            name.unlink(missing_ok=True)
        _drafts.discard(name)


def remove_drafts() -> None:
    """Remove the drafts that an interrupt has left, in the moment before they are removed or after it."""
    for name in list(_drafts):
        with contextlib.suppress(OSError):
            name.unlink(missing_ok=True)


def make_folder(folder: Path) -> None:
    """Make a folder, with those above it, where it does not exist."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ExportError(
            str(folder), f"cannot be made ({error.strerror or error})", next_step="name another folder"
        ) from None


def write_text(path: Path, text: str) -> None:
    r"""Write a text file whole or not at all, with line ends as they stand.

    What is no character, as in the name of a file that is no UTF-8, is written as in JSON: ``\udcff``.

    ``path``: file; its folder is made if needed.
    """
    with draft(path) as name:
        name.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a binary file whole or not at all.

    ``path``: file; its folder is made if needed.
    """
    with draft(path) as name:
        name.write_bytes(content)


def write_table(path: Path, rows: Iterable[Sequence[str]]) -> None:
    """Write a table of comma-separated values whole or not at all.

    ``path``: file; its folder is made if needed.
    """
    with draft(path) as name, name.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows(rows)


def _not_writable(target: Path, error: OSError) -> ExportError:
    return ExportError(
        str(target), f"cannot be written ({error.strerror or error})", next_step="name another file or folder"
    )
