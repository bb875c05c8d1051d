"""What an FMU says about itself, as plain data, and how its archive is unpacked.

Archives of FMUs and systems come from anywhere: whatever they hold, nothing is written outside the folder
that they are unpacked into, and foreign text is made fit for a message.
"""

from __future__ import annotations

import math
import shutil
import stat
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import fmpy

from ...foundation.errors import ExportError
from ..files import BROKEN_ARCHIVE

_LONGEST = 300


def fit_to_show(text: object) -> str:
    """Return text in one line of printable characters, cut where it is long."""
    whole = str(text)
    line = " ".join("".join(c if c.isprintable() else " " for c in whole[: 4 * _LONGEST]).split())
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ..."


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
            if len(entries) > MOST_ENTRIES:
                raise ExportError(what, f"has {len(entries)} entries, at most {MOST_ENTRIES} are unpacked")
            size = sum(item.file_size for item in entries)
            if size > MOST_BYTES:
                raise ExportError(
                    what,
                    f"would unpack to {size / 2**20:.0f} MiB, at most {MOST_BYTES // 2**20} MiB are taken",
                )
            names: set[str] = set()
            for item in entries:
                objection = _objection(item, names)
                if objection:
                    raise ExportError(f"{what}, entry '{fit_to_show(item.filename)}'", objection)
                names.add(item.filename)
            if needs not in names:
                raise ExportError(what, f"has no {needs}")
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


DESCRIPTION_FILE = "modelDescription.xml"
_KINDS = {"Real": "real", "Float64": "real", "Integer": "integer", "Int32": "integer"}


@dataclass(frozen=True)
class FmuScalar:
    """A scalar variable of an FMU."""

    name: str  # as the FMU states it
    reference: int  # value reference
    causality: str
    variability: str
    kind: str  # "real" or "integer"
    unit: str | None  # none if the FMU gives none
    start: float | None  # none if the FMU gives none


@dataclass(frozen=True)
class FmuDescription:
    """A co-simulation FMU that was unpacked."""

    instance: str  # name of the instance
    folder: Path  # where its files are
    version: str  # "2.0" or "3.0"
    # identifier, token: name of the library, and what it is instantiated with
    identifier: str
    token: str
    rolls_back: bool  # whether its state can be kept and restored
    variables: Mapping[str, FmuScalar]  # real and integer scalars by name

    @property
    def sample_time(self) -> float | None:
        """Sample time in s that the FMU states, ``None`` for a continuous one."""
        period = self.variables.get("sample.time")
        return period.start if period is not None and period.variability == "constant" else None

    @property
    def shown(self) -> tuple[FmuScalar, ...]:
        """Outputs and inner signals, reals first."""
        chosen = [v for v in self.variables.values() if v.causality in ("output", "local")]
        return tuple(sorted(chosen, key=lambda v: v.kind != "real"))

    @property
    def library(self) -> Path:
        """The binary for this machine."""
        where = fmpy.platform if self.version == "2.0" else fmpy.platform_tuple
        return self.folder / "binaries" / str(where) / f"{self.identifier}{fmpy.sharedLibraryExtension}"


def read_description(instance: str, archive: Path, folder: Path) -> FmuDescription:
    """Read the description of an FMU that was unpacked."""
    what = f"instance '{instance}' ({archive})"
    try:
        read = fmpy.read_model_description(str(folder))
        variables = {
            v.name: _variable(v)
            for v in read.modelVariables
            if v.type in _KINDS and not getattr(v, "dimensions", None)
        }
    except Exception as error:
        # Whatever a damaged description makes the XML and FMI libraries raise.
        # What Python raises where something is missing names only that.
        named = isinstance(error, LookupError) or not str(error).strip()
        reason = fit_to_show(f"{type(error).__name__} {error}" if named else error)
        raise ExportError(what, f"is not a valid FMU: {reason}") from error
    offered = read.coSimulation
    if offered is None or read.fmiVersion == "1.0":
        raise ExportError(what, "is not a co-simulation FMU of FMI 2.0 or 3.0")
    if not str(offered.modelIdentifier).isidentifier():
        raise ExportError(
            what, f"is not a valid FMU: '{fit_to_show(offered.modelIdentifier)}' is no model identifier"
        )
    version = "2.0" if read.fmiVersion == "2.0" else "3.0"
    rolls_back = bool(offered.canGetAndSetFMUstate)
    description = FmuDescription(
        instance, folder, version, offered.modelIdentifier, read.guid, rolls_back, variables
    )
    period = description.variables.get("sample.time")
    if (
        period is not None
        and period.variability == "constant"
        and (period.start is None or not 0.0 < period.start < math.inf)
    ):
        raise ExportError(what, f"states a sample time of {period.start} s, which is not possible")
    return description


def check_library(description: FmuDescription) -> None:
    """Check that there is a binary for this machine."""
    if not description.library.is_file():
        place = description.library.parent.relative_to(description.folder).as_posix()
        raise ExportError(
            f"instance '{description.instance}'",
            f"the FMU has no binary for this machine ({place})",
            next_step="export it with platforms=None on this machine, or name the platform",
        )


def _variable(read: Any) -> FmuScalar:
    unit = read.unit or (read.declaredType.unit if read.declaredType else None)
    start = None if read.start is None else float(read.start)
    return FmuScalar(
        read.name, int(read.valueReference), read.causality, read.variability, _KINDS[read.type], unit, start
    )
