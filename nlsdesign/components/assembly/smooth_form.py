"""The smooth form of an assembly, for optimisation, C and FMU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...foundation.errors import unknown_name
from ..core.contacts import Regularised, Rounded, Sharp, WithCorners, WithFriction
from ..core.element import Element
from ..core.part import Part
from ..core.tie import Tie
from .named_parts import Assembly


def smoothed(assembly: Assembly, widths: Mapping[str, float] | None = None) -> Assembly:
    """Return an assembly in which every law that is not smooth has its smooth form.

    Dry friction creeps with a hyperbolic tangent instead of sticking, stops, backlash, slack and knots are
    rounded; each law says by how much it then differs.

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
    >>> from nlsdesign.components import CoulombFriction, Inertia, assembly, tie
    >>> rub = tie(CoulombFriction(sliding_effort=0.05), "wheel")
    >>> rubbing = assembly("a", wheel=Inertia(inertia=1e-3), rub=rub)
    >>> smoothed(rubbing, {"rub": 0.01}).element("rub").title()
    'CoulombFriction(sliding_effort = 0.05 N·m, creep_speed = 0.01 rad/s)'
    """
    asked = dict(widths or {})
    sharp = {path: part for path, part in assembly.walk() if not _smooth(_law(part))}
    for name in asked:
        if name not in sharp:
            raise unknown_name("element that is not smooth", name, sharp)
    # Innermost parts first: the smooth form of a wrapper keeps the parts inside it.
    for path in sorted(sharp, key=lambda p: -p.count(".")):
        law = _law(assembly[path])
        if isinstance(law, Element):
            assembly = assembly.with_part(path, law.smooth(asked.get(path)))
    return assembly


def sharpened(assembly: Assembly) -> Assembly:
    """Return the assembly with every law that was declared rounded in its sharp form.

    Dry friction sticks, corners are corners; simulation locates where they change.

    Examples
    --------
    >>> from nlsdesign.components import CoulombFriction, Inertia, Regularised, assembly, tie
    >>> smooth = Regularised(creep_speed=0.01)
    >>> rub = tie(CoulombFriction(sliding_effort=0.05, contact=smooth), "wheel")
    >>> sharpened(assembly("a", wheel=Inertia(inertia=1e-3), rub=rub)).element("rub").title()
    'CoulombFriction(sliding_effort = 0.05 N·m)'
    """
    # Innermost parts first: a wrapper that is read anew keeps the parts inside it.
    for path, _ in sorted(assembly.walk(), key=lambda each: -each[0].count(".")):
        law = _law(assembly[path])
        if isinstance(law, (WithCorners, WithFriction)) and isinstance(law.contact, (Regularised, Rounded)):
            assembly = assembly.with_part(path, replace(law, contact=Sharp()))
    return assembly


def _law(part: Part) -> Part:
    return part.element if isinstance(part, Tie) else part


def _smooth(law: Part) -> bool:
    return not isinstance(law, Element) or law.is_smooth
