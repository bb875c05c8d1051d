"""What the files of an export say of themselves: deck, digest, and whether they are as they were written.

Files may come from anywhere: sizes are bounded, nothing is unpacked or executed, and whatever cannot be read
is an error with its reason.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
import tomllib
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..components.assembly.deck_writer import deck_digest, declare
from ..foundation.deck import read_deck
from ..foundation.errors import ExportError, NlsError
from ..model.origin import digits_in_name
from .c.c_text import SHORT, stamp_of
from .files import BROKEN_ARCHIVE
from .fmi.fmu_documentation import ORIGIN_FILE, ORIGIN_FORMAT

MEGABYTE = 1 << 20
LARGEST_TEXT, LARGEST_ARCHIVE = 32 * MEGABYTE, 512 * MEGABYTE
"""Bytes of a text, and of an archive when unpacked, beyond which a file is refused."""
_MOST_FILES = 10_000
_GENERATED = re.compile(r"^   Written by nlsdesign \S+ with CasADi ", re.MULTILINE)
_DECK_LINE = re.compile(r"^   Deck (.*), ([0-9a-f]{12}) \(SHA-256 of its parts\)\.$", re.MULTILINE)
_DIGEST = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True)
class ExportedFile:
    """One file and what it says."""

    path: Path
    kind: str  # "C", "Modelica", "FMU" or "deck"
    # deck, digest: of the deck that it is from, or is; the digest with 64 or, where the file has no more, 12
    # digits. Both empty where it names none.
    deck: str = ""
    digest: str = ""
    parent: str = ""  # digest of the deck before that one; empty where there is none
    edited: str = ""  # why it is not as it was written; empty where it is

    @property
    def short(self) -> str:
        """The digits of the digest that every kind of file has."""
        return self.digest[:SHORT]


@dataclass(frozen=True)
class ExportedFolder:
    """The exported files and decks of a folder, and whether they belong together."""

    folder: Path  # that was looked through
    files: tuple[ExportedFile, ...]  # files that this package wrote
    problems: tuple[ExportError, ...]  # of files that could not be read
    # reference: digest of the deck that they are to belong to; empty if they are only to belong together
    reference: str = ""

    @property
    def apart(self) -> tuple[str, ...]:
        """Why each file does not belong, empty where it does."""
        decks = {file.short for file in self.files}
        wanted = self.reference or (self.files[0].digest if len(decks) == 1 else "")
        return tuple(
            (file.edited and f"edited: {file.edited}") or _foreign(file, wanted) for file in self.files
        )

    @property
    def together(self) -> bool:
        """Whether all files could be read, belong, and are as they were written."""
        return not self.problems and not any(self.apart)

    def findings(self) -> list[str]:
        """Return what is to be said of the folder, in sentences."""
        names = {file.short: file.deck for file in self.files if file.deck}
        made = {(file.short, file.parent[:SHORT]) for file in self.files if file.parent[:SHORT] in names}
        relations = [f"{names.get(new, new)} was made from {names[old]}." for new, old in sorted(made)]
        return [*map(str, self.problems), *relations, self._verdict()]

    def _verdict(self) -> str:
        count, decks = len(self.files), len({file.short for file in self.files})
        if not self.files:
            return "Nothing could be read."
        if not any(self.apart):
            which = (
                f"the deck {self.reference[:SHORT]}" if self.reference else f"one deck, {self.files[0].short}"
            )
            readable = " that can be read" if self.problems else ""
            return f"All {count} files{readable} belong to {which}."
        where = f"to the deck {self.reference[:SHORT]}" if self.reference else "together"
        several = f"; they are of {decks} decks" if decks > 1 else ""
        return f"Not all of {count} files belong {where}{several}."


def _foreign(file: ExportedFile, wanted: str) -> str:
    if not file.digest:
        return "names no deck"
    if not wanted:
        return "one of several decks"
    # Some files have the first digits of a digest only.
    same = wanted.startswith(file.digest) or file.digest.startswith(wanted)
    return "" if same else "another deck"


def read_exports(folder: str | Path, *, reference: str = "") -> ExportedFolder:
    """Return the exported files and decks in a folder and below it, and whether they belong together.

    Files that this package did not write are passed over; links are not followed.

    Examples
    --------
    >>> read_exports("out/fmu").findings()  # doctest: +SKIP
    """
    files: list[ExportedFile] = []
    problems: list[ExportError] = []
    for path in _paths(Path(folder)):
        try:
            file = exported_file(path)
        except ExportError as error:
            problems.append(error)
        else:
            files += [file] if file else []
    if not files and not problems:
        raise ExportError(str(folder), "holds no C file, Modelica text, FMU or deck of this package")
    return ExportedFolder(Path(folder), tuple(files), tuple(problems), reference)


def _paths(folder: Path) -> Iterator[Path]:
    if not folder.is_dir():
        raise ExportError(str(folder), "is no folder", next_step="name the folder with the C files and FMUs")

    def refuse(error: OSError) -> None:
        raise ExportError(str(error.filename), f"cannot be listed: {error.strerror}") from None

    count = 0
    for place, folders, names in os.walk(folder, onerror=refuse):
        folders.sort()
        for name in sorted(names):
            if Path(name).suffix.lower() in _READERS:
                count += 1
                if count > _MOST_FILES:
                    step = "name a smaller folder"
                    raise ExportError(str(folder), f"holds more than {_MOST_FILES} files", next_step=step)
                yield Path(place) / name


def exported_file(path: Path) -> ExportedFile | None:
    """Return what a file says of itself, ``None`` where this package did not write it."""
    try:
        status = path.lstat()
        if not stat.S_ISREG(status.st_mode):
            return None
        return _READERS[path.suffix.lower()](path, status.st_size)
    except OSError as error:
        raise ExportError(str(path), f"cannot be read: {error.strerror or error}") from None
    except RecursionError:
        raise ExportError(str(path), "is nested too deeply to be a file of this package") from None


def _text(path: Path, size: int) -> str:
    if size > LARGEST_TEXT:
        raise ExportError(str(path), f"is larger than {LARGEST_TEXT // MEGABYTE} MB, no text of an export is")
    try:
        # A checkout on another system may have changed the ends of lines.
        return path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise ExportError(str(path), f"is no text in UTF-8: {error.reason} at byte {error.start}") from None


def _commented(path: Path, size: int, kind: str) -> ExportedFile | None:
    """Return what the comments of a text say; C and Modelica have the same comments."""
    text = _text(path, size)
    stamp, line, whole = stamp_of(text), _DECK_LINE.search(text), _macro(text, "DECK_DIGEST")
    if stamp is None and not _GENERATED.search(text):
        return None
    edited = ""
    if stamp is None:
        edited = "its last comment, with the SHA-256 of the text, is missing"
    elif stamp.stated != stamp.actual:
        edited = "its text is not the one that was written"
    decks = {each for each in (line and line[2], whole[:SHORT], stamp and stamp.deck) if each}
    if len(decks) > 1:
        edited = edited or f"it names {len(decks)} decks: {', '.join(sorted(decks))}"
    digest = whole or (line[2] if line else "") or (stamp.deck if stamp else "")
    return ExportedFile(path, kind, line[1] if line else "", digest, _macro(text, "PARENT_DIGEST"), edited)


def _macro(text: str, ending: str) -> str:
    match = re.search(rf'^#define \w+_{ending} "([0-9a-f]{{64}})"$', text, re.MULTILINE)
    return match[1] if match else ""


def _fmu(path: Path, size: int) -> ExportedFile | None:
    if size > LARGEST_ARCHIVE:
        raise _too_large(path)
    try:
        with zipfile.ZipFile(path) as archive:
            entries = {entry.filename: entry for entry in archive.infolist() if not entry.is_dir()}
            if (
                len(entries) > _MOST_FILES
                or sum(entry.file_size for entry in entries.values()) > LARGEST_ARCHIVE
            ):
                raise _too_large(path)
            if "modelDescription.xml" not in entries:
                raise ExportError(str(path), "is no FMU: it has no modelDescription.xml")
            if ORIGIN_FILE not in entries:
                own = b"nlsdesign" in archive.read("modelDescription.xml")[:4096]
                return ExportedFile(path, "FMU", edited=f"it has no {ORIGIN_FILE}") if own else None
            record = _record(path, archive.read(ORIGIN_FILE))
            digests = {}
            for name, entry in entries.items():
                if name != ORIGIN_FILE:
                    with archive.open(entry) as stream:
                        digests[name] = hashlib.file_digest(stream, "sha256").hexdigest()  # type: ignore[arg-type]
            deck = record["deck"] or {"name": "", "sha256": "", "parent": None}
            parent = deck["parent"]["sha256"] if deck["parent"] else ""
            stated = record["files"]
            changed = [name for name in stated if name in digests and stated[name] != digests[name]]
            missing, added = sorted(stated.keys() - digests.keys()), sorted(digests.keys() - stated.keys())
            parts = {"changed": changed, "missing": missing, "added": added}
            difference = "; ".join(f"{what}: {', '.join(names)}" for what, names in parts.items() if names)
            return ExportedFile(path, "FMU", deck["name"], deck["sha256"], parent, difference)
    except (RuntimeError, NotImplementedError) as error:
        # Encrypted, or packed in a way that the library does not know.
        raise ExportError(str(path), f"cannot be unpacked: {error}") from None
    except BROKEN_ARCHIVE as error:
        raise ExportError(str(path), f"is a damaged archive: {error}") from None


def _too_large(path: Path) -> ExportError:
    return ExportError(
        str(path), f"unpacks to more than {LARGEST_ARCHIVE // MEGABYTE} MB or {_MOST_FILES} files"
    )


def _record(path: Path, content: bytes) -> dict[str, Any]:
    """Return the record of an FMU if it has the form of one."""
    try:
        record = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ExportError(str(path), f"{ORIGIN_FILE} is no JSON: {error}") from None
    if not isinstance(record, dict) or record.get("format") != ORIGIN_FORMAT:
        raise ExportError(str(path), f"{ORIGIN_FILE} is not of the format '{ORIGIN_FORMAT}'")
    files, deck = record.get("files"), record.get("deck")
    sound = isinstance(files, dict) and (deck is None or _is_deck(deck))
    if not sound:
        raise ExportError(str(path), f"{ORIGIN_FILE} lacks the deck or the files, or gives them wrongly")
    return record


def _is_deck(raw: object) -> bool:
    if not isinstance(raw, dict) or not isinstance(raw.get("name"), str):
        return False
    if not isinstance(raw.get("sha256"), str) or not _DIGEST.fullmatch(raw["sha256"]):
        return False
    return raw.setdefault("parent", None) is None or _is_deck(raw["parent"])


def _deck(path: Path, size: int) -> ExportedFile | None:
    text = _text(path, size)
    try:
        if not isinstance(tomllib.loads(text).get("deck"), dict):
            return None  # some other TOML, such as the mapping of records
        assembly = declare(read_deck(text, path))
    except (NlsError, tomllib.TOMLDecodeError) as error:
        raise ExportError(str(path), f"cannot be read as a deck: {error}") from None
    digest = deck_digest(assembly)
    stated, edited = digits_in_name(assembly), ""
    if not digest.startswith(stated):
        edited = f"its name says {stated}, its parts have {digest[: len(stated)]}"
    parent = assembly.parent.digest if assembly.parent else ""
    return ExportedFile(path, "deck", assembly.name, digest, parent, edited)


_C = partial(_commented, kind="C")
_READERS: Mapping[str, Callable[[Path, int], ExportedFile | None]] = {
    ".c": _C,
    ".h": _C,
    ".mo": partial(_commented, kind="Modelica"),
    ".fmu": _fmu,
    ".toml": _deck,
}
