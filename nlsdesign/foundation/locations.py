"""Location of the folders that are distributed with the package, and its version.

The rule: in a wheel the top-level folders ``models``, ``studies`` and ``docs`` are packed into
``nlsdesign/_bundled/``, so that they do not spread over site-packages. In a checkout (also an editable
install) there is no ``_bundled``; they stand next to the package, beside ``pyproject.toml``. That file is
checked too, because a folder named ``models`` next to an *installed* package belongs to another project.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import tomllib
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Final, Literal

from .errors import UnknownNameError

_PACKAGE: Final = Path(__file__).resolve().parents[1]


def folder(name: Literal["models", "studies", "docs"], *, package: Path = _PACKAGE) -> Path:
    """Return the folder of that name that is distributed with the package.

    ``package``: folder of the package ``nlsdesign``; another one only in tests.
    """
    bundled = package / "_bundled" / name
    if bundled.is_dir():
        return bundled
    beside = package.parent / name
    if _checkout_version(package) is not None and beside.is_dir():
        return beside
    raise UnknownNameError(
        f"folder '{name}'",
        f"it is distributed with nlsdesign, but is neither {bundled} nor, in a checkout, {beside}",
        next_step="install nlsdesign again, or run it from a complete checkout",
    )


def bundled(name: Literal["models", "studies"], module: str = "") -> ModuleType:
    """Return a distributed folder as a Python package, or one module in it.

    Its name is ``nlsdesign_models`` or ``nlsdesign_studies`` both in a checkout and in a wheel, which never
    collides with a package ``models`` of another project.

    ``module``: module inside; the package itself where none is given.
    """
    alias = f"nlsdesign_{name}"
    if alias not in sys.modules:
        start = folder(name) / "__init__.py"
        spec = importlib.util.spec_from_file_location(
            alias, start, submodule_search_locations=[str(folder(name))]
        )
        if spec is None or spec.loader is None:
            raise UnknownNameError(str(start), "cannot be loaded as Python")
        sys.modules[alias] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[alias])
    return importlib.import_module(f"{alias}.{module}") if module else sys.modules[alias]


def version(*, package: Path = _PACKAGE) -> str:
    """Return the version, which is written down in ``pyproject.toml`` and nowhere else.

    ``package``: folder of the package ``nlsdesign``; another one only in tests.
    """
    checkout = _checkout_version(package)
    if checkout is not None:
        return checkout
    import importlib.metadata  # takes longer than the start of the command line, so only where it is needed

    return importlib.metadata.version("nlsdesign")


@cache
def _checkout_version(package: Path) -> str | None:
    """Return the version in the checkout's ``pyproject.toml``, ``None`` when there is no checkout."""
    try:
        project = tomllib.loads((package.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    except (OSError, KeyError):
        return None
    return str(project["version"]) if project.get("name") == "nlsdesign" else None
