"""Functional mock-up units for co-simulation, FMI 3.0 and 2.0, of any flat model.

A continuous model contains its own integrator, a discrete one the same C code as the controller.
Archives are deterministic: the same model and date give the same bytes. The instantiation token is a hash of
the content without the date.
"""

from __future__ import annotations

import hashlib
import math
import os
import struct
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...foundation.errors import ExportError, ValueRangeError, nearest
from ...foundation.writing import draft
from ...model.flat import FlatModel
from ..c.c_text import identifier
from ..compilation.cross_compiler import ALL_PLATFORMS, Platform, chosen_platforms
from ..files import shell
from .authorship import Authorship
from .compiled_binaries import compiled_binaries
from .compiled_binaries import fmi_headers as fmi_headers
from .fmu_documentation import icon, page
from .fmu_origin import with_origin
from .fmu_sources import fmu_sources, main_source
from .fmu_variables import layout
from .model_description import build_description, model_description, terminals_and_icons
from .terminals import terminals

_EPOCH = (1980, 1, 1, 0, 0, 0)
_TOKEN = "{token-of-this-content}"


def export_fmu(
    model: FlatModel,
    path: str | Path,
    *,
    version: str = "3.0",
    platforms: Sequence[str] | None = None,
    step: float | None = None,
    authorship: Authorship | None = None,
) -> Path:
    """Write a co-simulation FMU with sources, documentation and compiled binaries.

    Parameters
    ----------
    model
        Continuous (plant) or discrete (observer, controller).
    path
        The file; it is not written if an error occurs.
    version
        ``"3.0"`` or ``"2.0"``.
    platforms
        Names from :data:`~nlsdesign.export.compilation.cross_compiler.PLATFORMS`. By default those that the
        environment variable ``NLSDESIGN_PLATFORMS`` names, separated by commas or as ``all``; without it that
        of the machine this runs on.
    step
        Communication step of the default experiment in s; 1 ms or the sample time by default.
    authorship
        Author, licence and date of the export; the date is the present time by default, or that of
        ``SOURCE_DATE_EPOCH``.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    ExportError
        If the version is unknown, a name clashes, the compiler is missing or the file cannot be written.
    UnknownNameError
        If a platform is unknown.
    ValueRangeError
        If the step is not a positive number.

    Examples
    --------
    >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
    >>> from nlsdesign.model import flatten
    >>> wheel, spring = Inertia(inertia=1e-3), tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    >>> swing = assembly("swing", wheel=wheel, spring=spring)
    >>> export_fmu(flatten(swing), "out/swing.fmu").name  # doctest: +SKIP
    'swing.fmu'
    """
    if version not in ("2.0", "3.0"):
        raise ExportError(
            f"version='{version}'", "must be '2.0' or '3.0'", did_you_mean=nearest(version, ["2.0", "3.0"])
        )
    length = step if step is not None else (model.sample_time or 1e-3)
    if not (math.isfinite(length) and length > 0.0):
        raise ValueRangeError(f"step={length}", "must be a positive number of seconds")
    chosen = chosen_platforms(platforms if platforms is not None else _platforms_of_environment())
    contents = fmu_texts(model, version=version, step=length, authorship=(authorship or Authorship()).dated())
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix="nlsdesign-fmu-") as folder:
        binaries = _binaries(contents, Path(folder), identifier(model.name), version, chosen)
    with draft(target) as file:
        _write_archive(file, with_origin(model, contents | binaries))
    return target


def _platforms_of_environment() -> Sequence[str] | None:
    named = [name.strip() for name in os.environ.get("NLSDESIGN_PLATFORMS", "").split(",") if name.strip()]
    return (ALL_PLATFORMS if "all" in named else named) or None


def fmu_texts(
    model: FlatModel, *, version: str, step: float, authorship: Authorship | None = None
) -> dict[str, bytes]:
    """Return everything in an FMU but the binaries.

    ``authorship``: author, licence and date. The date has no part in the token.
    """
    variables, about = layout(model), authorship or Authorship()

    def description(token: str, shown: Authorship) -> str:
        return model_description(variables, version=version, token=token, step=step, authorship=shown)

    sources = {f"sources/{name}": text for name, text in fmu_sources(variables, version, _TOKEN).items()}
    token = _token(sources | {"modelDescription.xml": description(_TOKEN, about.undated())})
    texts = {path: text.replace(_TOKEN, token) for path, text in sources.items()}
    texts["modelDescription.xml"] = description(token, about)
    texts["documentation/index.html"] = page(variables, about)
    texts["documentation/licenses/license.txt"] = shell("license.txt")
    if version == "3.0":
        texts["sources/buildDescription.xml"] = build_description(variables)
        texts["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(variables)
    return {path: text.encode() for path, text in texts.items()} | _pictures(variables.model, version)


def _pictures(model: FlatModel, version: str) -> dict[str, bytes]:
    """Return the pictures of the model, and in FMI 3.0 of its terminals."""
    if version == "2.0":
        return {"model.png": icon()}
    attached = {each.picture for each in terminals(model)}
    return {f"terminalsAndIcons/{name}.png": icon(name) for name in ("icon", *sorted(attached))}


def _token(texts: Mapping[str, str]) -> str:
    """Return a token that identifies this content, a hash of it."""
    digest = hashlib.sha256()
    for name, text in sorted(texts.items()):
        digest.update(f"{name}\0{text}\0".encode())
    text = digest.hexdigest()
    return f"{{{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:32]}}}"


def _binaries(
    contents: Mapping[str, bytes], folder: Path, name: str, version: str, platforms: Sequence[Platform]
) -> dict[str, bytes]:
    prefix = "sources/"
    sources = {
        path.removeprefix(prefix): content for path, content in contents.items() if path.startswith(prefix)
    }
    sources.pop("buildDescription.xml", None)
    libraries = compiled_binaries(sources, main_source(version), folder, name=name, platforms=platforms)
    built: dict[str, dict[str, bytes]] = {}
    for each in platforms:
        where = each.name if version == "3.0" else each.fmi2
        built.setdefault(f"binaries/{where}/{name}{each.extension}", {})[each.name] = libraries[each.name]
    return {
        path: next(iter(parts.values())) if len(parts) == 1 else universal_binary(parts)
        for path, parts in built.items()
    }


def universal_binary(parts: Mapping[str, bytes]) -> bytes:
    """Return one macOS library for several processors, which FMI 2.0 has only one folder for."""
    # (processor type, subtype) as in <mach/machine.h>; the header is big-endian, slices start on 16 KiB.
    processors = {"x86_64-darwin": (0x01000007, 3), "aarch64-darwin": (0x0100000C, 0)}
    align = 14
    header = struct.pack(">II", 0xCAFEBABE, len(parts))
    offset, body = 1 << align, b""
    for name in sorted(parts):
        body += bytes(offset - (1 << align) - len(body)) + parts[name]
        header += struct.pack(">IIIII", *processors[name], offset, len(parts[name]), align)
        offset = -(-(offset + len(parts[name])) // (1 << align)) * (1 << align)
    return header + bytes((1 << align) - len(header)) + body


def _write_archive(file: Path, contents: Mapping[str, bytes]) -> None:
    # The description first, the rest in alphabetical order; no time stamps and no local permissions.
    names = sorted(contents, key=lambda name: (name != "modelDescription.xml", name))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names:
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, contents[name])
