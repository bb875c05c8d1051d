"""Steady cycles of a design with its rubber relaxing: what the torque is on the way up and on the way down.

The cam turns as a sine, θ = A·sin(2πft) where the cable passes through the centre, which stretches the rubber
twice a cycle, else θ = A·(1 − cos(2πft))/2. Up and down run over the same nodes of the contour, so the
instants follow from the angles. From node to node the states are stepped by the collocation of Lobatto
(IIIA, order 4), which for a law that is affine in its states is a linear map; the composition of all steps
of a cycle maps the states onto themselves, a linear equation for the first of them.
Source: Hairer and Wanner 1996 (Lobatto IIIA).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import with_unit
from ...foundation.symbolic import Expression, depends
from ..statics.equilibrium import RelaxingLaw
from .design_point import DesignPoint

_ROUNDED = 1e-4
"""Phase in rad within which the reversal is rounded where it lies between nodes."""
_SHORTEST = 0.25
"""Amplitude relative to the last angle below which too few nodes of the contour take part."""
_SIMPSON = (1.0, 4.0, 1.0)

Affine = tuple[Expression, Expression]


class _Place(NamedTuple):
    """Where the cam stands: angle, its derivative to the phase, lever arm, extension."""

    angle: Expression
    progress: Expression
    lever_arm: Expression
    extension: Expression


class Forces(NamedTuple):
    """Force of one element in equilibrium, and what is added to it on the way up and on the way down."""

    static: Expression
    up: Expression
    down: Expression


class _Interval(NamedTuple):
    """Phase of one interval, and the cam at its begin, middle and end."""

    phase: Expression
    places: tuple[_Place, _Place, _Place]


@dataclass(frozen=True, eq=False)
class SteadyCycle:
    """One steady cycle; each sum over intervals is Simpson's rule over the phase."""

    design: DesignPoint  # the design in symbols
    amplitude: float  # a in rad
    intervals: tuple[_Interval, ...]  # from angle zero to the amplitude
    # static: force of one element in equilibrium at begin, middle and end of each interval
    static: tuple[Expression, ...]
    # up, down: what is added to it on the way up and on the way down
    up: tuple[Expression, ...]
    down: tuple[Expression, ...]

    def over_angle(self, of: Callable[[_Place, Forces], Expression]) -> Expression:
        """Return the integral over the angle from zero to the amplitude."""
        total = ca.SX(0)
        for k, interval in enumerate(self.intervals):
            for i, place in enumerate(interval.places):
                weight = _SIMPSON[i] / 6.0 * interval.phase * place.progress
                total += weight * of(place, Forces(self.static[k][i], self.up[k][i], self.down[k][i]))
        return total

    @property
    def mean_square_error(self) -> Expression:
        """Mean over angle and both strokes of the squared difference from the target, in (N·m)²."""
        design = self.design

        def squared(place: _Place, force: Forces) -> Expression:
            # ((m + d)² + (m − d)²)/2 with the mean m of both strokes and half their difference d
            arm, mean = design.elements * place.lever_arm, force.static + (force.up + force.down) / 2.0
            half = arm * (force.up - force.down) / 2.0
            return (arm * mean - design.target.torque_law(place.angle)) ** 2 + half**2

        return self.over_angle(squared) / self.amplitude

    @property
    def lost(self) -> Expression:
        """Energy that all elements turn into heat each time they are stretched and let go, in J."""
        return self.design.elements * self.over_angle(
            lambda at, force: at.lever_arm * (force.up - force.down)
        )

    @property
    def stored(self) -> Expression:
        """Energy that all elements store up to the amplitude in equilibrium, in J."""
        return self.design.elements * self.over_angle(lambda at, force: at.lever_arm * force.static)


def steady_cycle(design: DesignPoint, frequency: float, amplitude: float | None = None) -> SteadyCycle:
    """Return the steady cycle of a design.

    ``amplitude``: largest angle in rad; the last angle of the target for ``None``.
    """
    last, law = design.target.last_angle, design.relaxing
    if amplitude is not None and not _SHORTEST * last <= amplitude <= last * (1 + 1e-9):
        ends = with_unit(f"[{_SHORTEST * last:.4g}, {last:.4g}]", "rad")
        raise ValueRangeError(
            f"amplitude = {with_unit(f'{amplitude:g}', 'rad')}",
            f"must lie in {ends}, a quarter of the target to all of it",
            next_step="leave it out for all of the target, or take a target that ends nearer to it",
        )
    largest = last if amplitude is None else amplitude
    intervals = _intervals(design, largest)
    up, down = _forces(law, intervals, ca.vertcat(*design.parameters.values()), 2.0 * np.pi * frequency)
    static = tuple(_static(design, intervals, k, largest >= last) for k in range(len(intervals)))
    return SteadyCycle(design, largest, intervals, static, up, down)


def _static(design: DesignPoint, intervals: Sequence[_Interval], k: int, whole: bool) -> Expression:
    _, middle, end = (place.extension for place in intervals[k].places)
    last = design.forces[k + 1] if whole else design.element(end).force
    return ca.vertcat(design.forces[k], design.element(middle).force, last)


def _intervals(design: DesignPoint, amplitude: float) -> tuple[_Interval, ...]:
    angles, count = design.angles, design.angles.shape[0]
    whole = amplitude >= design.target.last_angle * (1 - 1e-9)
    # On the way to a solution the last node may lie elsewhere than at the last angle.
    reach = ca.SX(angles[-1]) if whole else ca.SX(amplitude)
    shares = [ca.SX(angles[k] / reach) for k in range(count)]
    phases = [_phase(design.through_centre, share) for share in shares]
    phases[0] = ca.SX(0)
    if whole:
        phases[-1] = ca.SX(np.pi / 2 if design.through_centre else np.pi)
    intervals = []
    for k in range(count - 1):
        step = phases[k + 1] - phases[k]
        middle, both = phases[k] + step / 2, (phases[k], phases[k + 1])
        places = [_place(design, k, phase, reach) for phase in (both[0], middle, both[1])]
        intervals.append(_Interval(step, (places[0], places[1], places[2])))
    return tuple(intervals)


def _phase(through_centre: bool, share: Expression) -> Expression:
    """Return the phase at which an angle, relative to the amplitude, is reached; that of the end beyond."""
    if through_centre:
        rest = ca.fmax(1.0 - share**2, 0.0) + _ROUNDED**2
        return ca.atan2(ca.fmin(share, 1.0), ca.sqrt(rest))
    share = ca.fmin(ca.fmax(share, 0.0), 1.0)
    return ca.acos(1.0 - 2.0 * share)


def _place(design: DesignPoint, k: int, phase: Expression, reach: Expression) -> _Place:
    """Return where the cam stands at a phase within an interval, by cubic interpolation."""
    if design.through_centre:
        angle, progress = reach * ca.sin(phase), reach * ca.cos(phase)
    else:
        angle, progress = reach * (1.0 - ca.cos(phase)) / 2.0, reach * ca.sin(phase) / 2.0
    width = design.angles[k + 1] - design.angles[k]
    share = (angle - design.angles[k]) / width
    arms, slopes = design.lever_arms, design.lever_arm_slopes
    return _Place(
        angle,
        progress,
        _cubic(share, width, (arms[k], arms[k + 1]), (slopes[k], slopes[k + 1])),
        _cubic(share, width, (design.extensions[k], design.extensions[k + 1]), (arms[k], arms[k + 1])),
    )


def _cubic(
    u: Expression, width: Expression, ends: Sequence[Expression], slopes: Sequence[Expression]
) -> Expression:
    """Return Hermite's cubic between two ends with given slopes."""
    rise = ends[1] - ends[0]
    first, last = width * slopes[0] - rise, rise - width * slopes[1]
    return ends[0] + u * (rise + (1 - u) * ((1 - u) * first + u * last))


def _forces(
    law: RelaxingLaw, intervals: Sequence[_Interval], parameters: Expression, speed: float
) -> tuple[tuple[Expression, ...], tuple[Expression, ...]]:
    """Return the forces on the way up and on the way down, at begin, middle and end of each interval."""
    affine, of_rate = _affine(law)

    def of(direction: float) -> list[list[Affine]]:
        return [
            [
                affine(at.extension, direction * speed * at.progress * at.lever_arm, parameters)
                for at in each.places
            ]
            for each in intervals
        ]

    rising = of(1.0)
    falling = of(-1.0) if of_rate else rising
    times = [each.phase / speed for each in intervals]
    count = len(intervals)
    up = [_step(rising[k], times[k]) for k in range(count)]
    down = [_step(falling[k][::-1], times[k]) for k in reversed(range(count))]
    states = _periodic([*up, *down], len(law.states))

    def force(
        k: int, direction: float, ends: tuple[Expression, Expression], laws: list[Affine]
    ) -> Expression:
        first, last = ends
        slopes = [ca.mtimes(a, x) + b for (a, b), x in ((laws[0], first), (laws[2], last))]
        middle = (first + last) / 2 + direction * times[k] / 8 * (slopes[0] - slopes[1])
        places = zip(intervals[k].places, (first, middle, last), strict=True)
        arguments = [
            [at.extension, direction * speed * at.progress * at.lever_arm, x, parameters] for at, x in places
        ]
        return ca.vertcat(*[law.function.call(each)[0] for each in arguments])

    total = 2 * count
    return (
        tuple(force(k, 1.0, (states[k], states[k + 1]), rising[k]) for k in range(count)),
        tuple(force(k, -1.0, (states[total - k], states[total - k - 1]), falling[k]) for k in range(count)),
    )


def _affine(law: RelaxingLaw) -> tuple[Callable[[Expression, Expression, Expression], Affine], bool]:
    """Return matrix and constant of the derivatives of the states, and whether they depend on the rate."""
    symbols = [ca.SX.sym(f"v{i}", law.function.size1_in(i)) for i in range(4)]
    extension, rate, states, parameters = symbols
    derivatives = law.function.call(symbols)[1]
    matrix = ca.SX(ca.jacobian(derivatives, states))
    constant = ca.SX(ca.substitute(derivatives, states, ca.SX.zeros(states.shape)))
    function = ca.Function("affine", [extension, rate, parameters], [matrix, constant])

    def at(e: Expression, r: Expression, p: Expression) -> Affine:
        matrix_there, constant_there = function.call([e, r, p])
        return matrix_there, constant_there

    return at, depends(ca.vertcat(ca.vec(matrix), constant), rate)


def _step(laws: Sequence[Affine], time: Expression) -> Affine:
    """Return matrix and constant of the map from the states at the begin to those at the end."""
    (a0, b0), (am, bm), (a1, b1) = laws
    one, h = ca.SX.eye(a0.shape[0]), time / 6.0
    ahead = one - h * (2 * am + a1 - time / 2 * ca.mtimes(am, a1))
    behind = one + h * (2 * am + a0 + time / 2 * ca.mtimes(am, a0))
    given = h * (b0 + 4 * bm + b1 + time / 2 * ca.mtimes(am, b0 - b1))
    return ca.solve(ahead, behind), ca.solve(ahead, given)


def _periodic(steps: Sequence[Affine], count: int) -> list[Expression]:
    """Return the states at all ends of the steps, such that the last are the first."""
    matrix, constant = ca.SX.eye(count), ca.SX.zeros(count)
    for a, b in steps:
        matrix, constant = ca.mtimes(a, matrix), ca.mtimes(a, constant) + b
    states = [ca.solve(ca.SX.eye(count) - matrix, constant) if count else constant]
    for a, b in steps:
        states.append(ca.mtimes(a, states[-1]) + b)
    return states
