"""Changed copies of an assembly: its load moved from outside, its laws smooth or sharp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...foundation.errors import ArrangementError, unknown_name
from ..core.contacts import Regularised, Rounded, Sharp, WithCorners, WithFriction
from ..core.element import Element, Tie
from ..core.part import Part
from ..mechanics.bodies import Driven, Fixed
from ..sensing.sensors import Encoder
from .named_parts import Assembly


def with_moved_load(actuator: Assembly) -> Assembly:
    """Return a copy in which the fixed load is moved, with an encoder like that of the motor.

    Where an encoder reads another body, one with the same count reads the load. An assembly whose load is
    moved already comes back as it is.
    """
    parts = dict(actuator.parts)
    if any(isinstance(part, Driven) for part in parts.values()):
        return actuator
    ends = [end for part in parts.values() if isinstance(part, Tie) for end in part.between]
    fixed = [n for n, p in parts.items() if isinstance(p, Fixed) and n in ends]
    if len(fixed) != 1:
        result = ", ".join(f"'{name}'" for name in fixed) or "none"
        raise ArrangementError(
            f"assembly '{actuator.name}'", f"needs one fixed load to be moved, but there is {result}",
            next_step="declare the load as Fixed() and tie the spring to it",
        )  # fmt: skip
    (name,) = fixed
    driven = Driven(domain=next(p.domain for n, p in parts.items() if n == name and isinstance(p, Fixed)))
    moved = {**parts, name: driven}
    encoders = [p for p in parts.values() if isinstance(p, Encoder)]
    if encoders:
        own = next(f"{name}_encoder{i or ''}" for i in range(99) if f"{name}_encoder{i or ''}" not in parts)
        moved[own] = Encoder(of=f"{name}.{driven.motion_names[0]}",
                             quantum=encoders[0].quantum)  # fmt: skip
    return Assembly(actuator.name, tuple(moved.items()))


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
    sharp = {
        path: part
        for path, part in assembly.walk()
        if isinstance(law := law_of_part(part), Element) and not law.is_smooth
    }
    for name in asked:
        if name not in sharp:
            raise unknown_name("element that is not smooth", name, sharp)
    # Innermost parts first: the smooth form of a wrapper keeps the parts inside it.
    for path in sorted(sharp, key=lambda p: -p.count(".")):
        law = law_of_part(assembly[path])
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
        law = law_of_part(assembly[path])
        if isinstance(law, (WithCorners, WithFriction)) and isinstance(law.contact, (Regularised, Rounded)):
            assembly = assembly.with_part(path, replace(law, contact=Sharp()))
    return assembly


def law_of_part(part: Part) -> Part:
    """Return the law of a tie, and any other part itself."""
    return part.element if isinstance(part, Tie) else part
