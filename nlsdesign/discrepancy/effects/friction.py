"""Effects of friction: dry, falling with speed, growing with load, drag."""

from __future__ import annotations

from collections.abc import Iterator

from ...components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CoulombFriction,
    Element,
    LoadFriction,
    Part,
    QuadraticDrag,
    Spring,
    StribeckFriction,
    Through,
    tie,
)
from ...quantity import Quantity
from .candidate import SOURCE, Unknown, free_name, wrapped
from .effect import Edit, Effect, Form
from .places import sliding_bodies, turning_bodies, turning_ties, typical_torque


def number(value: float, unit: str) -> Quantity:
    """Return a number that a fit is going to change.

    Parameters
    ----------
    value
        In SI.
    unit
        SI unit.
    """
    return Quantity(value, unit, SOURCE)


def tied(assembly: Assembly, name: str, body: str, element: Element) -> tuple[Assembly, str]:
    """Return the assembly with one more element on a body, and the element's name.

    Parameters
    ----------
    assembly
        To be edited.
    name
        The name wanted.
    body
        Name of the body.
    element
        Between the body and the resting frame.
    """
    part = free_name(assembly, name)
    return assembly.with_part(part, tie(element, body)), part


def is_spring(part: Part) -> bool:
    """Tell whether a part makes a tie a spring: a cam with what it stretches, or a spring itself.

    Parameters
    ----------
    part
        Law of a part in the tie.
    """
    return isinstance(part, Through | Spring)


def _springs(assembly: Assembly) -> list[str]:
    return turning_ties(assembly, is_spring)


def _coulomb_turning(assembly: Assembly, body: str) -> Iterator[Edit]:
    friction = CoulombFriction(sliding_effort=number(0.01, "N*m"), domain=ROTATION).smooth()
    edited, part = tied(assembly, "dry_friction", body, friction)
    torque = typical_torque(assembly, body)
    yield Edit(edited, (Unknown(f"{part}.sliding_effort", (0.05,), 1e-4, 2.0, torque),))


def _coulomb_sliding(assembly: Assembly, body: str) -> Iterator[Edit]:
    friction = CoulombFriction(sliding_effort=number(1.0, "N"), domain=TRANSLATION).smooth()
    edited, part = tied(assembly, "dry_friction", body, friction)
    yield Edit(edited, (Unknown(f"{part}.sliding_effort", (10.0,), 1e-3, 1e4),))


def _stribeck(assembly: Assembly, body: str) -> Iterator[Edit]:
    friction = StribeckFriction(
        sliding_effort=number(0.01, "N*m"),
        breakaway=number(0.01, "N*m"),
        stribeck_speed=number(0.2, "rad/s"),
    ).smooth()
    edited, part = tied(assembly, "dry_friction", body, friction)
    torque = typical_torque(assembly, body)
    unknowns = (
        Unknown(f"{part}.sliding_effort", (0.05,), 1e-4, 2.0, torque),
        Unknown(f"{part}.breakaway", (0.05,), 1e-4, 2.0, torque),
        Unknown(f"{part}.stribeck_speed", (0.1, 0.5), 0.02, 5.0, null=None),
    )
    yield Edit(edited, unknowns, {"simpler": ("coulomb_friction",)})


def _loaded(assembly: Assembly, name: str) -> Iterator[Edit]:
    def around(inner: str, element: Element) -> Element:
        return LoadFriction(members=((inner, element),), ratio=number(0.01, "1")).smooth()

    yield Edit(wrapped(assembly, name, "driven", around), (Unknown(f"{name}.ratio", (0.05,), 1e-4, 0.9),))


def _drag(assembly: Assembly, body: str) -> Iterator[Edit]:
    edited, part = tied(assembly, "drag", body, QuadraticDrag(drag=number(1e-3, "N*m*s^2/rad^2")))
    yield Edit(edited, (Unknown(f"{part}.drag", (1e-3,), 1e-7, 10.0),))


coulomb_friction = Effect(
    "coulomb_friction",
    "Dry friction on a freely turning or sliding body.",
    10,
    (
        Form(
            turning_bodies,
            _coulomb_turning,
            "a constant torque against the motion, that jumps where the speed changes sign",
            "Coulomb 1785; Armstrong-Hélouvry 1991",
            "dry friction",
        ),
        Form(
            sliding_bodies,
            _coulomb_sliding,
            "a constant force against the motion, that jumps where the speed changes sign",
            "Coulomb 1785; Armstrong-Hélouvry 1991",
            "dry friction",
        ),
    ),
)
stribeck_friction = Effect(
    "stribeck_friction",
    "Dry friction that falls with speed, on a freely turning body.",
    20,
    (
        Form(
            turning_bodies,
            _stribeck,
            "a torque against the motion that is largest just off standstill",
            "Stribeck 1902; Armstrong-Hélouvry 1991",
            "dry friction",
        ),
    ),
)
load_dependent_friction = Effect(
    "load_dependent_friction",
    "Friction in proportion to the torque that a spring puts on its drive.",
    30,
    (
        Form(
            _springs,
            _loaded,
            "a torque against the motion in proportion to the load",
            "Coulomb 1785; Niemann and Winter 2003 (efficiency of gears)",
            "load friction",
        ),
    ),
)
quadratic_drag = Effect(
    "quadratic_drag",
    "Drag that grows with the square of the speed, on a freely turning body.",
    40,
    (
        Form(
            turning_bodies,
            _drag,
            "a torque against the motion that grows with the square of the speed",
            "Newton 1687, book II; Batchelor 1967",
            "drag",
        ),
    ),
)
