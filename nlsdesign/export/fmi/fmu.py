"""Functional mock-up units for co-simulation, FMI 3.0 and 2.0, of any flat model.

A continuous model contains its own integrator, a discrete one the same C code as the controller.
Archives are deterministic: the same model and date give the same bytes. The instantiation token is a hash of
the content without the date. Binaries are compiled once: they are kept under a hash of all that they are
made from.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import math
import os
import struct
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path

from ...foundation.errors import ExportError, ValueRangeError, nearest
from ...foundation.text_files import write_bytes
from ...model.flat import FlatModel
from ..c.c_text import identifier
from ..compilation import cross_compiler
from ..compilation.cross_compiler import (
    ALL_PLATFORMS,
    Platform,
    cache_folder,
    chosen_platforms,
    compile_library,
    flags_of_environment,
)
from ..files import template, write_archive
from .fmu_documentation import Authorship, icon, page, with_origin
from .fmu_sources import fmu_sources, main_source
from .fmu_variables import layout, terminals
from .model_description import build_description, model_description, terminals_and_icons

MOST_KEPT = 200
"""Number of binaries that are kept; the oldest go first. One has 20 to 60 kB."""
_DIGEST = hashlib.sha256().digest_size


def fmi_headers() -> Path:
    """Return the folder of the headers of the FMI standard, which come with fmpy."""
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"


def compiled_binaries(
    sources: Mapping[str, bytes], main: str, folder: Path, *, name: str, platforms: Sequence[Platform]
) -> dict[str, bytes]:
    """Return the shared library of an FMU for each platform, from the cache where nothing changed.

    ``main``: the one to compile; it includes the others.
    """

    def binary(platform: Platform) -> bytes:
        kept = cache_folder() / "fmu" / _key(sources, main, name, platform)
        earlier = _read(kept)
        if earlier is not None:
            return earlier
        place = folder / platform.name
        place.mkdir(parents=True)
        for file, content in sources.items():
            (place / file).write_bytes(content)
        target = place / f"{name}{platform.extension}"
        flags = ("-std=c99", *flags_of_environment())
        compile_library([place / main], target, platform=platform, include=[fmi_headers()], flags=flags)
        content = target.read_bytes()
        _keep(kept, content)
        return content

    with ThreadPoolExecutor(max_workers=max(1, min(len(platforms), os.cpu_count() or 1))) as pool:
        return dict(zip((p.name for p in platforms), pool.map(binary, platforms), strict=True))


def _key(sources: Mapping[str, bytes], main: str, name: str, platform: Platform) -> str:
    digest = hashlib.sha256(_compiler())
    for text in (main, name, platform.target, platform.extension, *flags_of_environment()):
        digest.update(f"{text}\0".encode())
    for file, content in sorted(sources.items()):
        digest.update(f"{file}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _compiler() -> bytes:
    """Return what stands for compiler, flags and headers; nothing where the compiler is missing."""
    try:
        version = importlib.metadata.version("ziglang")
    except importlib.metadata.PackageNotFoundError:
        version = ""  # the compiler itself says that it is missing, where it is needed
    digest = hashlib.sha256(f"{version}\0".encode())
    digest.update(Path(cross_compiler.__file__).read_bytes() + template("windows.c").encode())
    for header in sorted(fmi_headers().glob("*.h")):
        digest.update(header.read_bytes())
    return digest.digest()


def _read(kept: Path) -> bytes | None:
    """Return a binary that was kept, ``None`` where there is none or it is damaged."""
    try:
        content = kept.read_bytes()
    except OSError:
        return None  # never compiled, or not readable: it is compiled now
    digest, binary = content[:_DIGEST], content[_DIGEST:]
    return binary if hashlib.sha256(binary).digest() == digest else None


def _keep(kept: Path, binary: bytes) -> None:
    try:
        write_bytes(kept, hashlib.sha256(binary).digest() + binary)
        every = sorted(kept.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in every[:-MOST_KEPT]:
            old.unlink(missing_ok=True)
    except (ExportError, OSError):
        return  # without a cache the next export takes longer, that is all


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
    if platforms is None:
        listed = os.environ.get("NLSDESIGN_PLATFORMS", "").split(",")
        named = [name.strip() for name in listed if name.strip()]
        platforms = (ALL_PLATFORMS if "all" in named else named) or None
    chosen = chosen_platforms(platforms)
    contents = fmu_texts(model, version=version, step=length, authorship=(authorship or Authorship()).dated())
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix="nlsdesign-fmu-") as folder:
        binaries = _binaries(contents, Path(folder), identifier(model.name), version, chosen)
    parts = with_origin(model, contents | binaries)
    # The description first, the rest in alphabetical order.
    order = sorted(parts, key=lambda name: (name != "modelDescription.xml", name))
    write_archive(target, {name: parts[name] for name in order})
    return target


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
    # A token that identifies this content, a hash of it.
    content = sources | {"modelDescription.xml": description(_TOKEN, about.undated())}
    digest = hashlib.sha256()
    for name, text in sorted(content.items()):
        digest.update(f"{name}\0{text}\0".encode())
    hashed = digest.hexdigest()
    token = f"{{{hashed[:8]}-{hashed[8:12]}-{hashed[12:16]}-{hashed[16:20]}-{hashed[20:32]}}}"
    texts = {path: text.replace(_TOKEN, token) for path, text in sources.items()}
    texts["modelDescription.xml"] = description(token, about)
    texts["documentation/index.html"] = page(variables, about)
    texts["documentation/licenses/license.txt"] = template("license.txt")
    if version == "3.0":
        texts["sources/buildDescription.xml"] = build_description(variables)
        texts["terminalsAndIcons/terminalsAndIcons.xml"] = terminals_and_icons(variables)
    pictures = {"model.png": icon()}
    if version == "3.0":
        attached = sorted({each.picture for each in terminals(variables.model)})
        pictures = {f"terminalsAndIcons/{name}.png": icon(name) for name in ("icon", *attached)}
    return {path: text.encode() for path, text in texts.items()} | pictures


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
