"""Effects of the drivetrain beside friction: ripple, backlash, a shaft that twists, a constant force."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ....components import (
    ROTATION,
    Assembly,
    Backlash,
    ConstantLoad,
    Dashpot,
    Element,
    GravityLoad,
    HorizontalTorque,
    Inertia,
    Inertial,
    Mass,
    Rounded,
    Spring,
    Tie,
    TorqueRipple,
    parallel,
    tie,
)
from ....components.mechanics.bodies import Free
from ....foundation.quantity import Quantity
from ....foundation.spread import RelativeSpread
from ..fitting import Continuation, Strategy
from .drive import drives
from .effect import SOURCE, Edit, Effect, Form, Unknown, free_name, number, wrapped
from .friction import tied
from .places import (
    beside,
    domain_of,
    effort_over_motion,
    laws,
    moving_bodies,
    restoring_ties,
    sliding_bodies,
    ties_between_bodies,
    turning_bodies,
    turns_per_turn,
    wrapping,
)
from .sizes import QUICKEST, efforts_on

_ORDERS = (*range(1, 37), *range(38, 121, 2))
"""Periods per turn where fits begin; a start between two of them is reached from either."""
_OF_A_MOTOR = (1, 2, 6, 7, 12, 14, 21, 24, 28, 42)
"""Periods per turn of a motor: of its pole pairs, slots and what they have in common."""
_PHASES = tuple(2.0 * k for k in range(1, 61))
"""Radians of a ripple at the furthest place of a line where fits begin: from the nearest start at most 1 rad
is missing anywhere. The shortest period is a nineteenth of the furthest place."""
_SHARPER = 0.04
"""Share of the usual rounding of a contact that a dead zone has: encoders on both sides would see more."""
_SHARE_BEHIND = 0.35
"""Part of an inertia that is put behind a shaft at first: within three times of a tenth and of the whole."""
_NATURAL = tuple(2.0 ** (k / 2.0) for k in range(-6, 7))
"""Natural frequencies at which a second inertia swings at first, as multiples of that of the quickest motion.

A fit reaches the true one from within a fifth of it. Below an eighth the inertia moves as if it were held,
beyond eight times as if it were rigid.
"""
_CATCHING = (5.0, 12.0, 28.0)
"""The same of a load between the flanks of a gear: beyond, these are as if rigid."""


def _ripple(assembly: Assembly, body: str) -> Iterator[Edit]:
    shafts = (turns for turns in turns_per_turn(assembly, body) if turns != 1.0)
    orders = sorted({float(n) for n in _ORDERS} | {turns * n for turns in shafts for n in _OF_A_MOTOR})
    yield _rippling(assembly, body, orders, max(150.0, 1.2 * orders[-1]))


def driven_along_a_line(assembly: Assembly) -> list[str]:
    """Return the sliding bodies that a drive moves: what else slides has no magnets and no lead."""
    return [body for body in drives(assembly) if body in sliding_bodies(assembly)]


def _ripple_of_a_line(assembly: Assembly, body: str) -> Iterator[Edit]:
    place, _ = assembly[body].motion_names  # type: ignore[attr-defined]
    yield _rippling(assembly, body, _PHASES, 1.2 * _PHASES[-1], f"1 / {body}.{place}")


def _rippling(assembly: Assembly, body: str, orders: Sequence[float], most: float, of: str = "") -> Edit:
    """Return the edit that ties a ripple to a body; fits begin at some orders, perhaps counted in a size."""
    kind = domain_of(assembly, body)
    none, turn = number(0.0, kind.effort_unit), number(1.0, f"rad/{kind.motion_unit}")
    law = TorqueRipple(sine=none, cosine=none, order=turn, domain=kind)
    edited, part = tied(assembly, "ripple", body, law)
    effort = efforts_on(body)
    unknowns = (
        Unknown(f"{part}.sine", (0.0,), -2.0, 2.0, effort),
        Unknown(f"{part}.cosine", (0.0,), -2.0, 2.0, effort),
        Unknown(f"{part}.order", tuple(orders), 0.5 * orders[0], most, of, null=None),
    )
    return Edit(edited, unknowns)


def _drivers(assembly: Assembly, name: str) -> list[str]:
    """Return the bodies that turn freely at the ends of a tie, in the order in which it names them."""
    part = assembly[name]
    ends = part.between if isinstance(part, Tie) else ()
    return [end for end in ends if isinstance(assembly[end], Free) and domain_of(assembly, end) == ROTATION]


def _driven_springs(assembly: Assembly) -> list[str]:
    return [name for name in restoring_ties(assembly) if _drivers(assembly, name)]


def _inertia_of(assembly: Assembly, body: str) -> str:
    """Return the name of the inertia or mass of a body."""
    part = assembly[body]
    assert isinstance(part, Free)
    return f"{body}.{part.inertia_name}"


def _without_shaft(assembly: Assembly) -> list[str]:
    """Return the moving bodies, unless an effect has put one of them behind a shaft already."""
    bodies, numbers = moving_bodies(assembly), assembly.quantities()
    return [] if any(numbers[_inertia_of(assembly, body)].source == SOURCE for body in bodies) else bodies


def _rigidly_driven_springs(assembly: Assembly) -> list[str]:
    bodies = _without_shaft(assembly)
    return [name for name in _driven_springs(assembly) if _drivers(assembly, name)[0] in bodies]


def _undamped_springs(assembly: Assembly) -> list[str]:
    """Return the springs between two moving bodies with no dashpot inside or between the same bodies."""
    damped = {
        assembly[name].between  # type: ignore[attr-defined]
        for name in (path.partition(".")[0] for path, part in laws(assembly) if isinstance(part, Dashpot))
        if isinstance(assembly[name], Tie)
    }
    pairs = ties_between_bodies(assembly)
    return [name for name, ends in pairs.items() if ends not in damped and ends[::-1] not in damped]


def _damping(assembly: Assembly, name: str) -> Iterator[Edit]:
    domain, (effort, motion) = assembly.element(name).domain, effort_over_motion(assembly, name)
    law = Dashpot(damping=number(1e-3, domain.unit("{effort}*s/{motion}")), domain=domain)
    edited, path = beside(assembly, name, "damping", law)
    size = f"{effort} * {QUICKEST} / {motion}"
    yield Edit(edited, (Unknown(f"{path}.damping", (0.05,), 1e-5, 10.0, size),))


def _backlash(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Put part of the inertia behind backlash.

    Where the body's inertia is declared as a whole, a tenth of it is put behind at first, and its spread
    allows for any share up to a third.
    """
    driver = _drivers(assembly, name)[0]
    whole = assembly.quantities()[f"{driver}.inertia"]
    own = _reduced(whole, 0.9, 0.15)
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


def _dead_zone(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Put a spring behind a gap, with what else is tied to the same two bodies: nothing acts within it.

    No inertia lies between gap and spring, as where a coupling or a belt has the play.
    """
    spring = assembly[name]
    assert isinstance(spring, Tie)
    beside = {
        other: part.element
        for other, part in assembly.parts
        if other != name and isinstance(part, Tie) and part.between == spring.between
    }
    domain, way = spring.element.domain, effort_over_motion(assembly, name)[1]
    sharp, edited = _SHARPER * Backlash.rounding[domain], assembly
    for other in beside:
        edited = edited.without_part(other)

    def behind(inner: str, element: Element) -> Element:
        gap, width = (number(value, domain.motion_unit) for value in (1e-2, sharp))
        return Backlash(gap=gap, contact=Rounded(width=width), members=((inner, element), *beside.items()))

    edited = wrapped(edited, name, "behind_backlash", behind)
    yield Edit(edited, (Unknown(f"{name}.gap", (0.1, 0.4), 2e-3, 1.8, way),))


def _constant(assembly: Assembly, body: str) -> Iterator[Edit]:
    domain = domain_of(assembly, body)
    load = ConstantLoad(load=number(0.0, domain.effort_unit), domain=domain)
    edited, part = tied(assembly, "offset", body, load)
    yield Edit(edited, (Unknown(f"{part}.load", (0.0,), -2.0, 2.0, efforts_on(body)),))


def _gravity(assembly: Assembly, body: str) -> Iterator[Edit]:
    weight = HorizontalTorque(horizontal_torque=number(0.01, "N*m"))
    load = GravityLoad(weight=weight, hanging_angle=number(0.0, "rad"))
    edited, part = tied(assembly, "weight", body, load)
    unknowns = (
        # A torque of either sign with two directions begins near any; the bounds overlap.
        Unknown(f"{part}.horizontal_torque", (0.1,), -3.0, 3.0, efforts_on(body)),
        Unknown(f"{part}.hanging_angle", (0.0, math.pi / 2.0), -5.0, 5.0, null=None),
    )
    yield Edit(edited, unknowns)


def _reduced(whole: Quantity, share: float, spread: float) -> Quantity:
    """Return what is left of an inertia of which a part is put elsewhere, with at least a spread."""
    least = RelativeSpread(spread)
    wider = whole.spread if whole.spread.share(whole.number) > spread else least
    return replace(whole.with_value(share * whole.number, whole.source), spread=wider)


def _shaft(
    assembly: Assembly, behind: str, frequencies: tuple[float, ...]
) -> tuple[Assembly, str, tuple[Unknown, ...]]:
    """Return the assembly with a second inertia behind a shaft that twists, its name, and what is open.

    Fits begin at natural frequencies that are given as multiples of that of the quickest motion.
    """
    name, domain = _inertia_of(assembly, behind), domain_of(assembly, behind)
    inertia = assembly.quantities()[name]
    second = _SHARE_BEHIND * inertia.number
    hidden = number(second, domain.inertia_unit)
    body = free_name(assembly, "second_inertia")
    kind = Inertia(inertia=hidden) if domain == ROTATION else Mass(mass=hidden)
    edited = assembly.with_part(body, kind)
    shaft = free_name(edited, "shaft")
    stiffness, loss = (domain.unit(unit) for unit in ("{effort}/{motion}", "{effort}*s/{motion}"))
    twist = parallel(
        stiffness=Spring(stiffness=number(1.0, stiffness), domain=domain),
        loss=Dashpot(damping=number(1e-3, loss), domain=domain),
    )
    edited = edited.with_part(shaft, tie(twist, behind, body))
    left = _reduced(inertia, 1.0 - _SHARE_BEHIND, 0.3)
    edited = edited.with_values({name: left})
    unknowns = (
        Unknown(_inertia_of(edited, body), (second,), 1e-3 * second, 2.8 * second, null=None),
        Unknown(
            f"{shaft}.stiffness.stiffness",
            tuple(second * omega**2 for omega in frequencies),
            second * 1e-3,
            second * 1e4,
            f"1 / {QUICKEST} / {QUICKEST}",
            null=math.inf,
        ),
        Unknown(
            f"{shaft}.loss.damping",
            (0.2 * second,),
            1e-5 * second,
            50.0 * second,
            f"1 / {QUICKEST}",
            null=None,
        ),
    )
    return edited, body, unknowns


def _absorber(assembly: Assembly, body: str) -> Iterator[Edit]:
    """Let a part of the inertia hang on a shaft; what acts on the body goes on acting on it."""
    edited, _, unknowns = _shaft(assembly, body, _NATURAL)
    yield Edit(edited, unknowns)


def _two_masses(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Put a shaft between a body and its load: the spring pulls at the second inertia from now on."""
    part, driver = assembly[name], _drivers(assembly, name)[0]
    assert isinstance(part, Tie)
    edited, body, unknowns = _shaft(assembly, driver, (4.0,))
    ends = tuple(body if end == driver else end for end in part.between)
    yield Edit(
        edited.with_part(name, replace(part, between=ends)), unknowns, {"strategy": Strategy(takes_long=True)}
    )


def _unsprung(assembly: Assembly) -> list[str]:
    """Return the moving bodies on which no spring acts: their load is one with them in the model."""
    springs = [assembly[name] for name in restoring_ties(assembly)]
    ends = {end for spring in springs if isinstance(spring, Tie) for end in spring.between}
    return [body for body in _without_shaft(assembly) if body not in ends]


def _gear_with_play(assembly: Assembly, body: str) -> Iterator[Edit]:
    """Put a part of the inertia and all weights of a body behind a gap between flanks that give way.

    A load that hangs on nothing else flies freely through the gap; how stiff and how lossy the flanks are
    decides how it is caught, and the drive feels both.
    """
    edited, load, (inertia, stiffness, loss) = _shaft(assembly, body, _CATCHING)
    shaft, domain = stiffness.name.partition(".")[0], domain_of(assembly, body)
    width = number(_SHARPER * Backlash.rounding[domain], domain.motion_unit)
    gap = number(1e-2, domain.motion_unit)
    flanks = wrapping(Backlash, gap=gap, contact=Rounded(width=width))
    edited = wrapped(edited, shaft, "flanks", flanks)
    for name, part in assembly.parts:
        if isinstance(part, Tie) and part.between == (body,) and "gravity" in part.element.phenomena:
            edited = edited.with_part(name, replace(part, between=(load,)))
    way, _ = assembly[body].motion_names  # type: ignore[attr-defined]
    unknowns = (
        Unknown(f"{shaft}.gap", (0.002, 0.005, 0.012), 1e-4, 0.2, f"{body}.{way}"),
        inertia,
        replace(stiffness, name=f"{shaft}.flanks.stiffness.stiffness", null=None),
        replace(loss, name=f"{shaft}.flanks.loss.damping", starts=(2.5 * inertia.starts[0],)),
    )
    yield Edit(edited, unknowns, {"strategy": Strategy(takes_long=True)})


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
        Form(
            driven_along_a_line,
            _ripple_of_a_line,
            "a force that repeats over the way, the same forward and backward, at any speed",
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
        Form(
            ties_between_bodies,
            _dead_zone,
            "no effort at all over a dead way around zero, the same at any speed",
            "Nordin and Gutman 2002",
            "backlash",
        ),
        Form(
            _unsprung,
            _gear_with_play,
            "a part of the inertia that is missing for a moment after each reversal, and then comes at once",
            "Nordin and Gutman 2002",
        ),
    ),
)
drivetrain_resonance = Effect(
    "drivetrain_resonance",
    "A second inertia behind a shaft that twists, between a body and its load or beside it.",
    175,
    (
        Form(
            _rigidly_driven_springs,
            _two_masses,
            "an oscillation of its own frequency after each jolt, between drive and load",
            "Hooke 1678; Leonhard 2001 (drives with an elastic shaft)",
        ),
        Form(
            _without_shaft,
            _absorber,
            "an oscillation of its own frequency after each jolt of the drive",
            "Hooke 1678; Leonhard 2001 (drives with an elastic shaft)",
        ),
    ),
)
spring_damping = Effect(
    "spring_damping",
    "A spring between two moving bodies that takes power as a dashpot beside it does.",
    65,
    (
        Form(
            _undamped_springs,
            _damping,
            "an effort between both bodies in proportion to the rate at which they move apart",
            "Kelvin 1865; Voigt 1892",
        ),
    ),
)
constant_force = Effect(
    "constant_force",
    "A constant force on a freely sliding body: a weight, an offset of the drive or of what reads it.",
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
constant_torque = Effect(
    "constant_torque",
    "A constant torque on a freely turning body: a preloaded seal, an offset of the drive or of its reading.",
    75,
    (
        Form(
            turning_bodies,
            _constant,
            "a torque that is the same forward and backward, at any speed and angle",
            "Janot et al. 2019",
            "constant load",
        ),
    ),
)
gravity_load = Effect(
    "gravity_load",
    "The weight of an arm on a body that turns in a vertical plane.",
    77,
    (
        Form(
            turning_bodies,
            _gravity,
            "a torque as the sine of the angle, once per turn, forward and backward alike",
            "Newton 1687",
            "gravity",
        ),
    ),
)
