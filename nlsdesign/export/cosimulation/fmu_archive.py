"""Archives of FMUs and systems, unpacked under rules: whatever they hold, nothing is written elsewhere."""

from __future__ import annotations

import shutil
import stat
import zipfile
from pathlib import Path, PurePosixPath

from ...foundation.errors import ExportError
from ..files import BROKEN_ARCHIVE
from .foreign_text import fit_to_show

MOST_ENTRIES = 10_000
"""Entries of an archive; assumed: fifty times those of an FMU with sources and documentation."""
MOST_BYTES = 2**30
"""Bytes of all unpacked entries; assumed: more than any FMU seen, less than a usual disk has left."""


def unpack(what: str, archive: Path, folder: Path, *, needs: str) -> None:
    """Unpack an archive into a folder.

    ``folder``: new; its owner removes it.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            entries = opened.infolist()
            _judge(what, entries, needs)
            for entry in entries:
                _write(opened, entry, folder)
    except OSError as error:
        raise ExportError(what, f"cannot be read ({error.strerror or error})") from error
    except BROKEN_ARCHIVE as error:
        raise ExportError(
            what,
            f"is not a valid archive, or damaged: {fit_to_show(error)}",
            next_step="get or export it again",
        ) from error


def _judge(what: str, entries: list[zipfile.ZipInfo], needs: str) -> None:
    if len(entries) > MOST_ENTRIES:
        raise ExportError(what, f"has {len(entries)} entries, at most {MOST_ENTRIES} are unpacked")
    size = sum(entry.file_size for entry in entries)
    if size > MOST_BYTES:
        raise ExportError(
            what, f"would unpack to {size / 2**20:.0f} MiB, at most {MOST_BYTES // 2**20} MiB are taken"
        )
    names: set[str] = set()
    for entry in entries:
        objection = _objection(entry, names)
        if objection:
            raise ExportError(f"{what}, entry '{fit_to_show(entry.filename)}'", objection)
        names.add(entry.filename)
    if needs not in names:
        raise ExportError(what, f"has no {needs}")


def _objection(entry: zipfile.ZipInfo, names: set[str]) -> str | None:
    path = PurePosixPath(entry.filename)
    if path.is_absolute() or ".." in path.parts or ":" in entry.filename or "\\" in entry.filename:
        return "leads out of the folder into which it is unpacked"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "is a link"
    if entry.filename in names:
        return "appears twice"
    if not entry.filename or not entry.filename.isprintable():
        return "has a name that cannot be written"
    return None


def _write(opened: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path) -> None:
    target = folder / entry.filename
    if entry.is_dir():
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    # The library reads no more than the stated size, and checks it and the check sum at the end.
    with opened.open(entry) as source, target.open("wb") as written:
        shutil.copyfileobj(source, written)
