"""Text files that are read and written: whole or not at all, with clear errors, known by their digests.

Every file of the package is written here. What was written into a folder is known by its digest, so that
nothing is replaced that somebody has changed or brought.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import json
import os
import re
import secrets
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from .errors import ExportError, NlsError

MOST_BYTES = 2**26
"""Largest text file: 64 MiB, a thousand times a large deck. Records have a bound of their own."""

STAMP = "/* Exported by nlsdesign "
"""Begin of the last comment of generated C."""

_STAMPED = re.compile(rf"{re.escape(STAMP)}[^*]*\*/\s*\Z")
"""That comment and nothing behind it: code that a forger adds there stays in the text."""


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


LIST_NAME: Final = ".nlsdesign.json"
"""Name of the list in each folder."""
_FORMAT = "nlsdesign written files 1"
_LARGEST = 1 << 24
FileState = Literal["new", "as written", "changed", "foreign", "of another command"]
WORDS: Final[dict[FileState, str]] = {
    "new": "is new",
    "as written": "is as nlsdesign wrote it",
    "changed": "was changed since nlsdesign wrote it",
    "foreign": "was not written by nlsdesign",
    "of another command": "was written by another command",
}


@dataclass
class Keeping:
    """What a command may replace in one folder and below, and what it wrote beside instead."""

    folder: Path  # where it writes; other places are not looked at
    force: bool = False  # whether everything may be replaced
    command: str = ""  # name of the command, which the list holds beside the files that it wrote
    # beside: where the new file stands, by the file that was kept
    beside: dict[Path, Path] = field(default_factory=dict)

    def covers(self, path: Path) -> bool:
        """Tell whether a file lies in the folder or below."""
        return path.absolute().is_relative_to(self.folder.absolute())


_now: ContextVar[Keeping | None] = ContextVar("keeping", default=None)


@contextmanager
def keeping(folder: Path, *, force: bool = False, command: str = "") -> Iterator[Keeping]:
    """Keep what is not as it was written in a folder and below, and list what is written.

    ``force``: whether everything may be replaced; what is written is listed all the same.
    """
    kept = Keeping(folder, force, command)
    token = _now.set(kept)
    try:
        yield kept
    finally:
        _now.reset(token)


def file_state(path: Path, *, command: str = "") -> FileState:
    """Return whether a file is new, as it was written, changed since, or was never written here."""
    # What stands in the way as a folder is refused by whoever writes.
    if not os.path.lexists(path) or path.is_dir():
        return "new"
    stated = _listed(path.parent).get(path.name)
    if stated is None:
        return "foreign"
    if stated != _digest(path):
        return "changed"
    other = command and _writers(path.parent).get(path.name, command) != command
    return "of another command" if other else "as written"


def without_stamp(text: str) -> str:
    """Return a generated file without its last comment, which tells the time of the export."""
    return _STAMPED.sub("", text)


def listed_files(folder: Path) -> list[Path]:
    """Return the files that were written into a folder and below, those that still exist, sorted."""
    lists = sorted(folder.rglob(LIST_NAME)) if folder.is_dir() else []
    return sorted(place for each in lists for name in _listed(each.parent)
                  if (place := each.parent / name).exists())  # fmt: skip


def refuse_to_lose(paths: Iterable[Path], *, command: str = "") -> None:
    """Refuse to begin where a file that would be replaced was changed or brought by somebody."""
    states = {path: file_state(path, command=command) for path in paths}
    lost = {path: state for path, state in states.items() if state not in ("new", "as written")}
    if not lost:
        return
    first, *others = lost
    more = f", and {len(others)} more: {', '.join(each.name for each in others[:5])}" if others else ""
    raise ExportError(
        str(first),
        f"{WORDS[lost[first]]}{more}",
        next_step="nothing was done; name another --out, add --force to replace, or --dry-run to list",
    )


def place_for(target: Path, draft: Path) -> Path:
    """Return where a finished draft is to go: its target, or a place beside a file that must be kept."""
    kept = _now.get()
    if kept is None or kept.force or not kept.covers(target):
        return target
    if file_state(target) in ("new", "as written") or _digest(target) == _digest(draft):
        return target
    for number in range(1, 1000):
        place = target.with_name(f"{target.stem}.new{number if number > 1 else ''}{target.suffix}")
        if file_state(place) in ("new", "as written"):
            kept.beside[target] = place
            return place
    raise ExportError(str(target), "was changed, and there is no free name beside it", next_step="tidy up")


def discard(path: Path) -> None:
    """Remove what an earlier run has left, unless a command keeps it because somebody changed or brought it.

    ``path``: of the file; need not exist.
    """
    kept = _now.get()
    guarded = kept is not None and kept.covers(path)
    if kept is not None and guarded and not kept.force and file_state(path) in ("changed", "foreign"):
        return
    path.unlink(missing_ok=True)
    names = _listed(path.parent) if guarded else {}
    if names.pop(path.name, None) is not None:
        _write_list(path.parent, names, _writers(path.parent))


def _digest(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ""  # a folder of that name, or a file that must not be read: never as it was written


def _listed(folder: Path) -> dict[str, str]:
    """Return the list of a folder; a damaged one counts as none, so that nothing is replaced unasked."""
    return _texts(folder, "files")


def _writers(folder: Path) -> dict[str, str]:
    """Return the commands that wrote the files of a folder, where they are known."""
    return _texts(folder, "commands")


def _texts(folder: Path, key: str) -> dict[str, str]:
    path = folder / LIST_NAME
    try:
        if path.stat().st_size > _LARGEST:
            return {}
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        return {}
    files = content.get(key)
    if not isinstance(files, dict):
        return {}
    return {n: d for n, d in files.items() if isinstance(d, str) and d and Path(n).name == n}


def _write_list(folder: Path, names: dict[str, str], writers: dict[str, str]) -> None:
    """Write the list whole or not at all; without it the next run asks, so its failure loses nothing."""
    known = {name: command for name, command in sorted(writers.items()) if command and name in names}
    content = {"format": _FORMAT, "files": dict(sorted(names.items())), "commands": known}
    text = json.dumps(content, indent=1) + "\n"
    try:
        handle, name = tempfile.mkstemp(prefix=f"{LIST_NAME}.", dir=folder)
    except OSError:
        return
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        os.chmod(name, 0o644)
        os.replace(name, folder / LIST_NAME)
    except OSError:
        Path(name).unlink(missing_ok=True)


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
        # Write the name and digest of a written file into the list of its folder, while a command keeps one.
        kept = _now.get()
        if kept is not None and kept.covers(place):
            writers = {**_writers(place.parent), place.name: kept.command}
            _write_list(place.parent, {**_listed(place.parent), place.name: _digest(place)}, writers)
    except OSError as error:
        rule = f"cannot be written ({error.strerror or error})"
        raise ExportError(str(target), rule, next_step="name another file or folder") from error
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
