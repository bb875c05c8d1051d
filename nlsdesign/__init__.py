"""Symbolic design workbench for series elastic actuators whose spring is a cam that stretches rubber.

``import nlsdesign as nls`` gives the names that a design study needs: ``flatten``, ``simulate``,
``design_cam``, ``over_angle``, ``design_observer``, ``export_c``, ``load_records``, ``diagnose`` and what
belongs to them; everything else through its room, as ``nls.components.Yeoh``. ``__init__.pyi`` lists the
names for type checkers and for the import at run time: a room is imported when one of its names is first
asked for.
"""

from __future__ import annotations

import functools
import importlib
from pathlib import Path
from types import ModuleType

from .foundation.errors import nearest
from .foundation.locations import bundled, version
from .foundation.quantity import (
    quantity as quantity,  # the function; a later import of the module leaves it in place
)


def __getattr__(name: str) -> object:
    """Return a public name from its module."""
    if name == "__version__":
        return version()
    if name.startswith("_"):
        raise AttributeError(name)
    if name not in _homes():
        raise AttributeError(_advice(name))
    home, inner = _homes()[name]
    value: object = bundled("models") if home == "models" else _value(home, inner)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_homes(), "__version__"})


@functools.cache
def _homes() -> dict[str, tuple[str, str]]:
    """Return the module of each public name, relative to this package, and the name that it has there."""
    import ast

    stub = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    homes = {a.name: (a.name, "") for node in stub.body if isinstance(node, ast.Import) for a in node.names}
    for node in stub.body:
        if isinstance(node, ast.ImportFrom):
            homes |= {a.asname or a.name: (f".{node.module or ''}", a.name) for a in node.names}
    return homes


def _value(home: str, inner: str) -> object:
    """Return what a module calls by that name: what it defines or imports, else a room in it."""
    value = None if home == "." else getattr(importlib.import_module(home, __name__), inner, None)
    return importlib.import_module(f"{home.rstrip('.')}.{inner}", __name__) if value is None else value


def _advice(name: str) -> str:
    """Return the message for a name that is not public here."""
    homes = _homes()
    text = f"nlsdesign has no name '{name}'"
    for home, inner in (place for place in homes.values() if place[0] != "models"):
        value = _value(home, inner)
        module = value if isinstance(value, ModuleType) else importlib.import_module(home, __name__)
        own = [n for n, v in vars(module).items() if getattr(v, "__module__", None) == module.__name__]
        if name in getattr(module, "__all__", [n for n in own if not n.startswith("_")]):
            return f"{text}; it is {module.__name__}.{name}"
    from .components.assembly.part_text import renamed  # here, as components take time to load

    old = renamed(name)
    if old is not None:
        return f"{text}; {old}"
    near = nearest(name, homes)
    return f"{text}; did you mean '{near}'?" if near else f"{text}; dir(nlsdesign) lists the public names"
