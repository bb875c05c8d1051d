"""Symbolic design workbench for series elastic actuators whose spring is a cam that stretches rubber.

``import nlsdesign as nls`` gives every public name of the rooms: parts and their algebra, ``flatten``,
``simulate``, ``design_cam``, ``over_angle``, ``design_observer``, ``export_c``, ``export_fmu``,
``cosimulate``, ``load_records``, ``diagnose``, ``write_report`` and what belongs to them. A room is imported
when one of its names is first asked for, so the command line starts at once.
"""

from __future__ import annotations

import importlib
from typing import Any

from .errors import unknown_name
from .locations import bundled, version
from .quantity import quantity  # the function, before a room's import puts the module in its place

__version__ = version()
__all__ = ["ROOMS", "WHOLE", "__version__", "quantity"]

ROOMS = (
    "quantity",
    "deck",
    "components",
    "components.assembly.deck_writer",
    "model",
    "model.equations",
    "model.linear",
    "model.transform",
    "simulation",
    "design",
    "analysis",
    "observer",
    "control",
    "identification",
    "discrepancy",
    "export",
    "report",
)
"""Where names are looked for, in this order."""

WHOLE = ("effects", "errors", "figures", "models", "progress", "report")
"""Modules that are given whole, as ``nls.figures``."""


def __getattr__(name: str) -> Any:
    """Return a public name of the first room that has it.

    Parameters
    ----------
    name
        For instance ``"flatten"``.

    Raises
    ------
    AttributeError
        If no room has it; the nearest name is given.
    """
    if name.startswith("_"):
        raise AttributeError(name)
    found = _whole(name) if name in WHOLE else _from_rooms(name)
    globals()[name] = found
    return found


def _whole(name: str) -> Any:
    if name == "models":
        return bundled("models")
    return importlib.import_module("." + ("discrepancy.effects" if name == "effects" else name), __name__)


def _from_rooms(name: str) -> Any:
    for room in ROOMS:
        module = importlib.import_module("." + room, __name__)
        if name in _public(module):
            return getattr(module, name)
    message = str(unknown_name("nlsdesign has no name", name, __dir__()))
    raise AttributeError(message)


def _public(module: Any) -> list[str]:
    listed = getattr(module, "__all__", None)
    if listed is not None:
        return list(listed)
    return [
        n
        for n, v in vars(module).items()
        if getattr(v, "__module__", None) == module.__name__ and n[0] != "_"
    ]


def __dir__() -> list[str]:
    names = {n for room in ROOMS for n in _public(importlib.import_module("." + room, __name__))}
    return sorted(names | set(WHOLE) | {"__version__"})
