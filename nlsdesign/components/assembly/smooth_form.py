"""The smooth form of an assembly, for optimisation, C and FMU."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from ...errors import unknown_name
from ..core.element import Element
from ..core.part import Part
from ..core.tie import Tie
from .named_parts import Assembly


@runtime_checkable
class Sharp(Protocol):
    """A law that is not smooth and has a smooth form."""

    def smooth(self, width: float = ...) -> Element:
        """Return the smooth form; its description states the width and the largest difference."""
        ...


def smoothed(assembly: Assembly, widths: Mapping[str, float] | None = None) -> Assembly:
    """Return an assembly in which every law that is not smooth has its smooth form.

    Dry friction becomes a hyperbolic tangent, which creeps instead of sticking; stops, backlash, slack and
    breakpoints are rounded. Each law states by how much its smooth form differs.

    Parameters
    ----------
    assembly
        Parts.
    widths
        By the full name of the element: speed, angle, extension, strain or force over which it is rounded.
        Others use the default width of their law.

    Raises
    ------
    UnknownNameError
        If there is no such element, or it is smooth already.

    Examples
    --------
    >>> from nlsdesign.components import DryFriction, Inertia, assembly, tie
    >>> rub = tie(DryFriction(sliding_torque=0.05), "wheel")
    >>> rubbing = assembly("a", wheel=Inertia(inertia=1e-3), rub=rub)
    >>> smoothed(rubbing, {"rub": 0.01}).element("rub").title()
    'CoulombFriction(sliding_torque = 0.05 N·m, creep_speed = 0.01 rad/s)'
    """
    widths = dict(widths or {})
    sharp = {path: part for path, part in assembly.walk() if isinstance(_law(part), Sharp)}
    for name in widths:
        if name not in sharp:
            raise unknown_name("element that is not smooth", name, sharp)
    # Innermost parts first: the smooth form of a wrapper keeps the parts inside it.
    for path in sorted(sharp, key=lambda p: -p.count(".")):
        law = _law(assembly[path])
        if isinstance(law, Sharp):
            smooth = law.smooth(widths[path]) if path in widths else law.smooth()
            assembly = assembly.with_part(path, smooth)
    return assembly


def _law(part: Part) -> Part:
    return part.element if isinstance(part, Tie) else part
