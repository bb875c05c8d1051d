"""Which code answers: the version of the package and a digest of every file that an answer can depend on."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ..locations import folder, version

_PACKAGE: Final = Path(__file__).resolve().parents[2]
_SHOWING: Final = ("cli", "presentation", "live", "_bundled", "__pycache__")
"""Rooms that show results. No room that computes may import them, so no answer depends on them."""
_SUFFIXES: Final = (".py", ".toml", ".csv", ".json")
_SHOWN_DIGITS: Final = 12


@dataclass(frozen=True)
class CodeIdentity:
    """Version and digest of the code that computes.

    Parameters
    ----------
    version
        Of the package.
    digest
        SHA-256 of its files.
    files
        Digest of each file by its place.
    """

    version: str
    digest: str
    files: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    def __str__(self) -> str:
        return f"nlsdesign {self.version} (code {self.digest[:_SHOWN_DIGITS]})"

    def without_files(self) -> CodeIdentity:
        """Return the same identity without the list of files, for workers."""
        return CodeIdentity(self.version, self.digest)


@functools.cache
def code_identity(package: Path = _PACKAGE) -> CodeIdentity:
    """Return the identity of the package as it stands on disk, read once in each process.

    Parameters
    ----------
    package
        Folder of the package; another one only in tests.
    """
    files = dict(_digests(package))
    text = "\n".join(f"{name} {digest}" for name, digest in sorted(files.items()))
    return CodeIdentity(version(package=package), hashlib.sha256(text.encode()).hexdigest(), files)


def own_identity() -> CodeIdentity:
    """Return the identity of this process without its list of files, as a worker is asked for it."""
    return code_identity().without_files()


def _digests(package: Path) -> Iterator[tuple[str, str]]:
    models = folder("models", package=package)
    for top, prefix in ((package, "nlsdesign"), (models, "models")):
        for path in sorted(top.rglob("*")):
            inside = path.relative_to(top)
            if path.suffix not in _SUFFIXES or set(inside.parts) & set(_SHOWING):
                continue
            # Decks are part of what is asked; they have a digest of their own.
            if prefix == "models" and inside.parts[0] in ("decks", "templates"):
                continue
            yield f"{prefix}/{inside.as_posix()}", hashlib.sha256(path.read_bytes()).hexdigest()
