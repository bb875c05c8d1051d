"""Binaries of FMUs, compiled once: kept under a hash of all that they are made from."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path

from ...foundation.errors import ExportError
from ...foundation.writing import write_bytes
from ..compilation import cross_compiler
from ..compilation.cross_compiler import Platform, cache_folder, compile_library
from ..files import shell

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
        compile_library([place / main], target, platform=platform, include=[fmi_headers()])
        content = target.read_bytes()
        _keep(kept, content)
        return content

    with ThreadPoolExecutor(max_workers=max(1, min(len(platforms), os.cpu_count() or 1))) as pool:
        return dict(zip((p.name for p in platforms), pool.map(binary, platforms), strict=True))


def _key(sources: Mapping[str, bytes], main: str, name: str, platform: Platform) -> str:
    digest = hashlib.sha256(_compiler())
    for text in (main, name, platform.target, platform.extension):
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
    digest.update(Path(cross_compiler.__file__).read_bytes() + shell("windows.c").encode())
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
