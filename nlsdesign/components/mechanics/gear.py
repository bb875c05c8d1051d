"""Rigid gears between two bodies: together the bodies have one angle and one speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ...foundation.errors import ArrangementError, NlsError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, smooth_sign
from ..core.element import ROTATION, Scope
from ..core.part import Part, parameter
from .bodies import Body, Free


@dataclass(frozen=True, kw_only=True)
class Gear(Part):
    """Rigid gear without loss: θ₁ = n·θ₂, T₂ = n·T₁.

    T₁ is what the first body gives, T₂ what the second gets. The two bodies are one state pair, that of the
    body which is written first; a rigid shaft is a gear of n = 1. A negative n turns the sense.
    Source: Uicker et al. 2017.

    Parameters
    ----------
    between
        Names of the two bodies, the motor's side first.

    Raises
    ------
    ArrangementError
        If there are not two ends.
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
    between: tuple[str, str]

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(self.ratio.number) < 1e-6:
            raise ValueRangeError(f"ratio = {self.ratio}", "a gear of ratio zero moves nothing")
        if len(self.between) != 2:
            raise ArrangementError(
                "gear", f"has {len(self.between)} ends; a gear has two", next_step="name two bodies"
            )

    def share(self, scope: Scope, torque: Expression, speed: Expression) -> Expression:
        """Return T₂/(n·T₁), the share of the torque that passes.

        Parameters
        ----------
        scope
            Gives parameters.
        torque
            T₁, or anything of its sign.
        speed
            Of the first body.
        """
        return ca.SX(1)


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

    def share(self, scope: Scope, torque: Expression, speed: Expression) -> Expression:
        """Return s."""
        sliding = ca.fabs(smooth_sign(speed, scope.parameter("creep_speed")))
        forward = 1 - (1 - scope.parameter("efficiency")) * sliding
        backward = 1 + (1 / scope.parameter("back_efficiency") - 1) * sliding
        return ca.if_else(torque * speed > 0, forward, backward)


def gear_problems(
    parts: Sequence[tuple[str, Part]], unsure: Sequence[str] = ()
) -> Iterator[tuple[str, NlsError]]:
    """Yield what is wrong with the gears between bodies, with the name of the gear."""
    bodies = {name: part for name, part in parts if isinstance(part, Body)}
    train = {name: name for name in bodies}
    for name, gear in parts:
        if not isinstance(gear, Gear) or set(unsure) & set(gear.between):
            continue
        problems = list(_end_problems(name, gear, bodies))
        yield from ((name, error) for error in problems)
        if problems:
            continue
        one, other = (train[end] for end in gear.between)
        if one == other:
            first, second = gear.between
            rule = f"'{first}' and '{second}' are geared to each other already: over-constrained"
            yield name, ArrangementError(f"gear '{name}'", rule, next_step="take one of the gears out")
        train = {end: (one if root == other else root) for end, root in train.items()}


def _end_problems(name: str, gear: Gear, bodies: Mapping[str, Body]) -> Iterator[NlsError]:
    missing = [end for end in gear.between if end not in bodies]
    if missing:
        yield from (unknown_name(f"'{name}': body", end, bodies) for end in missing)
        return
    stiff = [end for end in gear.between if not isinstance(bodies[end], Free)]
    if len(stiff) == 2:
        yield ArrangementError(
            f"gear '{name}'",
            f"the motions of '{stiff[0]}' and '{stiff[1]}' are both prescribed, so it is over-constrained",
            next_step="let one of them move freely, or put a spring between them",
        )
    elif stiff:
        other = next(end for end in gear.between if end != stiff[0])
        yield ArrangementError(
            f"gear '{name}'",
            f"the motion of '{stiff[0]}' is prescribed, so nothing is left to move '{other}'",
            next_step=f"prescribe '{other}' itself, or put a spring between them",
        )
    for end in gear.between:
        if bodies[end].domain != ROTATION:
            yield ArrangementError(f"gear '{name}'", f"turns angles, '{end}' has a position")
