"""Gears, racks and screws, rigid between two bodies: together the bodies have one motion and one speed."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError, NlsError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, smooth_sign
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part import Part, parameter
from .bodies import Body, Free


@dataclass(frozen=True, kw_only=True)
class Transmission(Part):
    """Base of what joins two bodies rigidly: x₁ = n·x₂ and, without loss, e₂ = n·e₁.

    e₁ is the effort that the first body gives, e₂ that which the second gets. The two bodies are one state
    pair, that of the body which is written first.

    Parameters
    ----------
    between
        Names of the two bodies, the motor's side first.

    Raises
    ------
    ArrangementError
        If there are not two ends.
    """

    joins: ClassVar[tuple[Domain, Domain]] = (ROTATION, ROTATION)
    """Domains of the two bodies."""

    between: tuple[str, str]

    def __post_init__(self) -> None:
        super().__post_init__()
        kind = type(self).__name__.lower()
        if len(self.between) != 2:
            raise ArrangementError(
                kind, f"has {len(self.between)} ends; a {kind} has two", next_step="name two bodies"
            )

    @abstractmethod
    def turns(self, scope: Scope) -> Expression:
        """Return n, the motion of the first body per motion of the second.

        Parameters
        ----------
        scope
            Gives parameters.
        """

    def share(self, scope: Scope, effort: Expression, rate: Expression) -> Expression:
        """Return e₂/(n·e₁), the share of the effort that passes.

        Parameters
        ----------
        scope
            Gives parameters.
        effort
            e₁, or anything of its sign.
        rate
            Of the first body.
        """
        return ca.SX(1)


@dataclass(frozen=True, kw_only=True)
class Gear(Transmission):
    """Rigid gear without loss: θ₁ = n·θ₂, T₂ = n·T₁.

    A rigid shaft is a gear of n = 1. A negative n turns the sense.
    Source: Uicker et al. 2017.

    Raises
    ------
    ValueRangeError
        If the ratio is zero.

    Examples
    --------
    >>> Gear(between=("motor", "drum"), ratio=4.0).title()
    'Gear(ratio = 4)'
    """

    ratio: Quantity = parameter(
        "1", "turns of the first body per turn of the second", minimum=-1e4, maximum=1e4
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.ratio.number) < 1e-6:
            raise ValueRangeError(f"ratio = {self.ratio}", "a gear of ratio zero moves nothing")

    def turns(self, scope: Scope) -> Expression:
        """Return n."""
        return scope.parameter("ratio")


@dataclass(frozen=True, kw_only=True)
class Rack(Transmission):
    """Pinion and rack, or pulley and belt, rigid and without loss: x₂ = r·θ₁, F₂ = T₁/r.

    The first body turns, the second moves along a line. A negative r turns the sense. Valid as long as teeth
    and belt are stiff beside what else gives; a belt that stretches is a spring behind it.
    Source: Uicker et al. 2017.

    Raises
    ------
    ValueRangeError
        If the radius is zero.

    Examples
    --------
    >>> Rack(between=("motor", "carriage"), radius=0.012).title()
    'Rack(radius = 0.012 m)'
    """

    joins: ClassVar[tuple[Domain, Domain]] = (ROTATION, TRANSLATION)

    radius: Quantity = parameter("m", "pitch radius: travel per angle", minimum=-10.0, maximum=10.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.radius.number) < 1e-7:
            raise ValueRangeError(f"radius = {self.radius}", "a pinion of radius zero moves nothing")

    def turns(self, scope: Scope) -> Expression:
        """Return 1/r."""
        return 1 / scope.parameter("radius")


@dataclass(frozen=True, kw_only=True)
class Screw(Transmission):
    """Screw and nut, rigid and without loss: x₂ = (l/2π)·θ₁, F₂ = (2π/l)·T₁.

    The first body turns, the second moves along the axis. A left-handed thread has a negative lead. Its
    friction stands beside it, as a part on the screw or on the nut. Source: Uicker et al. 2017.

    Raises
    ------
    ValueRangeError
        If the lead is zero.

    Examples
    --------
    >>> Screw(between=("motor", "carriage"), lead=0.005).title()
    'Screw(lead = 0.005 m)'
    """

    joins: ClassVar[tuple[Domain, Domain]] = (ROTATION, TRANSLATION)

    lead: Quantity = parameter("m", "travel of the nut in one turn", minimum=-10.0, maximum=10.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.lead.number) < 1e-7:
            raise ValueRangeError(f"lead = {self.lead}", "a screw of lead zero moves nothing")

    def turns(self, scope: Scope) -> Expression:
        """Return 2π/l."""
        return 2.0 * math.pi / scope.parameter("lead")


@dataclass(frozen=True, kw_only=True)
class LossyGear(Gear):
    """Rigid gear whose loss grows with the load: T₂ = n·T₁·s.

    Driven forward (T₁·ω₁ > 0) s = 1 − (1 − η)·|tanh(ω₁/ω_s)|, so the share η of the power comes out at the
    second body. Driven backward s = 1 + (1/η_b − 1)·|tanh(ω₁/ω_s)|, so the share η_b comes out at the first.
    The loss |T₁·ω₁|·|1 − s| is never negative: no power is created, whatever the sizes of the inertias.
    T₁ follows from the accelerations of both bodies, so it is solved from them, exactly, as a monotone
    piecewise linear equation. Continuous, with corners at zero load and at rest, elsewhere C∞; at rest the
    gear does not stick. Source: Coulomb 1785 with the load as normal force; Niemann and
    Winter 2003.

    Examples
    --------
    >>> worm = LossyGear(between=("motor", "drum"), ratio=40.0, efficiency=0.6, back_efficiency=0.33)
    >>> worm.efficiency.number
    0.6
    """

    efficiency: Quantity = parameter(
        "1", "power out per power in, from the first body to the second", minimum=0.01, maximum=1.0
    )
    back_efficiency: Quantity = parameter(
        "1", "power out per power in, from the second body to the first", minimum=0.01, maximum=1.0
    )
    creep_speed: Quantity = parameter(
        "rad/s", "speed of the first body at which 76 % of the loss acts",
        minimum=1e-6, maximum=10.0, default=0.02,
    )  # fmt: skip

    def share(self, scope: Scope, effort: Expression, rate: Expression) -> Expression:
        """Return s."""
        sliding = ca.fabs(smooth_sign(rate, scope.parameter("creep_speed")))
        forward = 1 - (1 - scope.parameter("efficiency")) * sliding
        backward = 1 + (1 / scope.parameter("back_efficiency") - 1) * sliding
        return ca.if_else(effort * rate > 0, forward, backward)


def transmission_problems(
    parts: Sequence[tuple[str, Part]], unsure: Sequence[str] = ()
) -> Iterator[tuple[str, NlsError]]:
    """Yield what is wrong with the transmissions between bodies, with the name of the transmission."""
    bodies = {name: part for name, part in parts if isinstance(part, Body)}
    train = {name: name for name in bodies}
    for name, transmission in parts:
        if not isinstance(transmission, Transmission) or set(unsure) & set(transmission.between):
            continue
        problems = list(_end_problems(name, transmission, bodies))
        yield from ((name, error) for error in problems)
        if problems:
            continue
        one, other = (train[end] for end in transmission.between)
        if one == other:
            first, second = transmission.between
            rule = f"'{first}' and '{second}' are geared to each other already: over-constrained"
            yield name, ArrangementError(_named(name, transmission), rule, next_step="take one of them out")
        train = {end: (one if root == other else root) for end, root in train.items()}


def _named(name: str, transmission: Transmission) -> str:
    """Return the kind and the name of a transmission, as errors begin."""
    kind = Gear if isinstance(transmission, Gear) else type(transmission)
    return f"{kind.__name__.lower()} '{name}'"


def _end_problems(name: str, transmission: Transmission, bodies: Mapping[str, Body]) -> Iterator[NlsError]:
    missing = [end for end in transmission.between if end not in bodies]
    if missing:
        yield from (unknown_name(f"'{name}': body", end, bodies) for end in missing)
        return
    stiff = [end for end in transmission.between if not isinstance(bodies[end], Free)]
    if len(stiff) == 2:
        yield ArrangementError(
            _named(name, transmission),
            f"the motions of '{stiff[0]}' and '{stiff[1]}' are both prescribed, so it is over-constrained",
            next_step="let one of them move freely, or put a spring between them",
        )
    elif stiff:
        other = next(end for end in transmission.between if end != stiff[0])
        yield ArrangementError(
            _named(name, transmission),
            f"the motion of '{stiff[0]}' is prescribed, so nothing is left to move '{other}'",
            next_step=f"prescribe '{other}' itself, or put a spring between them",
        )
    domains = tuple(bodies[end].domain for end in transmission.between)
    if domains == transmission.joins:
        return
    fitting = [kind for kind in (Gear, Rack, Screw) if kind.joins == domains]
    wanted = " and ".join(_MOTIONS[domain] for domain in transmission.joins)
    given = " and ".join(
        f"'{end}' has {_MOTIONS[d]}" for end, d in zip(transmission.between, domains, strict=True)
    )
    if domains == transmission.joins[::-1]:
        step = f'write between = ["{transmission.between[1]}", "{transmission.between[0]}"]'
    elif fitting:
        step = f"take {' or '.join(kind.__name__ for kind in fitting)}"
    else:
        step = "tie the two with a spring"
    yield ArrangementError(_named(name, transmission), f"joins {wanted}; {given}", next_step=step)


_MOTIONS = {ROTATION: "an angle", TRANSLATION: "a position"}
