"""Effects of the drivetrain beside friction: ripple, backlash, a constant force."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...components import (
    Assembly,
    Backlash,
    ConstantLoad,
    GearedMotor,
    Inertia,
    Inertial,
    Rounded,
    Tie,
    TorqueRipple,
)
from ..fitting.strategies import Continuation
from .candidate import Unknown, wrapped
from .effect import Edit, Effect, Form
from .friction import is_spring, number, tied
from .places import sliding_bodies, turning_bodies, turning_ties, typical_torque, wrapping

_ORDERS = tuple(float(n) for n in range(4, 121, 2))
"""Periods per turn where fits begin: cogging and teeth have even numbers of them."""


def _ripple(assembly: Assembly, body: str) -> Iterator[Edit]:
    law = TorqueRipple(sine=number(0.0, "N*m"), cosine=number(0.0, "N*m"), order=number(1.0, "1"))
    edited, part = tied(assembly, "ripple", body, law)
    torque = typical_torque(assembly, body)
    unknowns = (
        Unknown(f"{part}.sine", (0.0,), -2.0, 2.0, torque),
        Unknown(f"{part}.cosine", (0.0,), -2.0, 2.0, torque),
        Unknown(f"{part}.order", _ORDERS, 2.0, 150.0, null=None),
    )
    yield Edit(edited, unknowns)


def _drivers(assembly: Assembly, name: str) -> list[str]:
    part = assembly[name]
    ends = part.between if isinstance(part, Tie) else ()
    return [end for end in ends if isinstance(assembly[end], GearedMotor | Inertia)]


def _driven_springs(assembly: Assembly) -> list[str]:
    return [name for name in turning_ties(assembly, is_spring) if _drivers(assembly, name)]


def _backlash(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Put part of the inertia behind backlash.

    Where the body's inertia is declared as a whole, a tenth of it is put behind at first, and its spread
    allows for any share up to a third.
    """
    driver = _drivers(assembly, name)[0]
    whole = assembly.quantities()[f"{driver}.inertia"]
    own = replace(whole.with_value(0.9 * whole.number, whole.source), spread=max(whole.spread, 0.15))
    gap = number(0.01, "rad")
    behind = Inertial(inertia=number(0.1 * whole.number, "kg*m^2"))
    inertial = wrapping(Backlash, gap=gap, contact=behind)
    edited = wrapped(assembly, name, "behind_backlash", inertial).with_values({f"{driver}.inertia": own})
    unknowns = (
        Unknown(f"{name}.gap", (0.01, 0.05), 5e-4, 0.3),
        Unknown(f"{name}.inertia", (0.1 * whole.number,), 1e-3 * whole.number, whole.number, null=None),
    )
    # In slow motion the inertia behind the backlash hardly shows.
    rounded = Rounded(width=number(5e-4, "rad"))
    massless = wrapped(assembly, name, "behind_backlash", wrapping(Backlash, gap=gap, contact=rounded))
    yield Edit(edited, unknowns, {"strategy": Continuation(through=massless)})


def _constant(assembly: Assembly, body: str) -> Iterator[Edit]:
    edited, part = tied(assembly, "offset", body, ConstantLoad(load=number(0.0, "N")))
    yield Edit(edited, (Unknown(f"{part}.load", (0.0,), -1e3, 1e3),))


torque_ripple = Effect(
    "torque_ripple",
    "A torque locked to the angle of a freely turning body, such as cogging; there may be several orders.",
    50,
    (
        Form(
            turning_bodies,
            _ripple,
            "a torque that repeats over the angle, the same forward and backward, at any speed",
            "Hanselman 2003",
        ),
    ),
)
backlash = Effect(
    "backlash",
    "Backlash between a freely turning body and a spring tied to it, part of the inertia behind it.",
    60,
    (
        Form(
            _driven_springs,
            _backlash,
            "a dead angle around zero, on both sides alike, and shocks where the load changes sign",
            "Nordin and Gutman 2002",
            "backlash",
        ),
    ),
)
constant_force = Effect(
    "constant_force",
    "A force that never changes on a freely sliding body: an offset of the drive, a weight.",
    260,
    (
        Form(
            sliding_bodies,
            _constant,
            "a force that is the same forward and backward, at any speed and place",
            "Janot et al. 2019",
            "constant load",
        ),
    ),
)
