"""What a controller knows of the drive, by the plant's names: numbers, supply, friction, largest torque."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.symbolic import Expression, depends
from ....model import FlatModel
from ....model.flat import Symbols
from ....model.linear import rest_state
from ....model.roles import contour_ends, motor_of, series_spring
from ....model.structure import MotorNames, MovingBody
from ....model.transform import cut, named
from ....simulation.buffered import Buffered
from ...analysis.rest import unmoved_states
from .law_writer import LawWriter, LoopNames, loop_names


@dataclass(frozen=True, eq=False)
class KnownDrive:
    """The drive of a plant as a controller knows it: J·ω̇ = k·I − r·T − friction(ω), φ̇ = r·ω.

    ω is the speed of the motor, φ the angle and T the torque of the series spring, r the turns of the spring
    per turn of the motor. All are expressions in the parameters of the plant, read off its equations, so a
    motor with its gear declared in it and one in a gear train are the same.
    """

    plant: FlatModel  # continuous; its motor is driven by a current

    def __post_init__(self) -> None:
        if self.plant.sample_time is not None:
            raise ArrangementError(
                f"model '{self.plant.name}'", "is discrete; a controller is designed on a continuous plant"
            )
        body = self.body
        if f"{body.name}.drive_torque" not in {v.name for v in self.plant.signals}:
            raise ArrangementError(
                f"motor '{body.name}'", "does not say what torque its current makes",
                next_step="declare it as a GearedMotor or a CurrentDrivenMotor",
            )  # fmt: skip
        if self.spring_turns_value == 0.0:
            spring = series_spring(self.plant)
            raise ArrangementError(
                f"spring '{spring.name}'", f"is not turned by the motor '{body.name}'",
                next_step="tie it between the driven side of the gear and the load",
            )  # fmt: skip

    @property
    def names(self) -> LoopNames:
        """Names by which the loop is wired."""
        return loop_names(self.plant)

    @property
    def body(self) -> MovingBody:
        """The body of the motor."""
        return motor_of(self.plant)[0]

    @property
    def motor(self) -> MotorNames:
        """The names around the motor."""
        return motor_of(self.plant)[1]

    @property
    def spring_turns_value(self) -> float:
        """Turns of the spring per turn of the motor at the declared numbers, 1."""
        known, s = self.named
        slope = ca.jacobian(known[series_spring(self.plant).motion], known[self.body.motion])
        point = ca.Function("turns", [s.time, s.state, s.input, s.parameter], [slope])
        plant = self.plant
        return float(
            point(0.0, plant.start(plant.states), plant.start(plant.inputs), plant.start(plant.parameters))
        )

    @property
    def spring_seen_at_the_motor(self) -> bool:
        """Whether the angle of the motor alone tells that of the spring, as with a fixed load."""
        known, s = self.named
        motion = known[series_spring(self.plant).motion]
        own = known[self.body.motion]
        others = [each for each in ca.vertsplit(s.state) if not ca.is_equal(each, own)]
        return not depends(motion, ca.vertcat(*others, s.input))

    def inertia(self, writer: LawWriter) -> Expression:
        """Return J in kg·m²: of all that turns with the motor, seen from it.

        ``writer``: of the controller; it is given the parameters of the plant that enter.
        """
        return self.written(writer, self.named[0][self.body.inertia or ""])

    def torque_per_current(self, writer: LawWriter) -> Expression:
        """Return k in N·m/A, at the shaft whose angle is measured."""
        motor = self.motor
        constant = writer.number(self.plant.variable(motor.torque_constant))
        if motor.gear_ratio is None:
            return constant
        return writer.number(self.plant.variable(motor.gear_ratio)) * constant

    def spring_turns(self, writer: LawWriter) -> Expression:
        """Return r, 1."""
        known, _ = self.named
        return self.written(
            writer, ca.jacobian(known[series_spring(self.plant).motion], known[self.body.motion])
        )

    def current_limit(self, writer: LawWriter) -> Expression:
        """Return the largest current in A; while it runs it can only be lowered."""
        declared = self.plant.variable(self.motor.current_limit)
        return writer.number(replace(declared, maximum=declared.start))

    @cached_property
    def named(self) -> tuple[dict[str, Expression], Symbols]:
        """Expressions of everything in the plant by name, and the symbols in them."""
        s = self.plant.symbols()
        return named(self.plant, s), s

    def written(self, writer: LawWriter, expression: Expression) -> Expression:
        """Return an expression in the plant's parameters with those of the controller.

        ``writer``: of the controller; it is given the parameters that enter.
        """
        _, s = self.named
        used = [
            (v, symbol)
            for v, symbol in zip(self.plant.parameters, ca.vertsplit(s.parameter), strict=True)
            if depends(expression, symbol)
        ]
        if not used:
            return expression
        limit = self.motor.current_limit
        new = ca.vertcat(
            *(self.current_limit(writer) if v.name == limit else writer.number(v) for v, _ in used)
        )
        return ca.SX(ca.substitute(expression, ca.vertcat(*(symbol for _, symbol in used)), new))


def voltage_is_limited(drive: KnownDrive) -> bool:
    """Tell whether the plant's motor declares a resistance and a largest voltage."""
    declared = {v.name for v in drive.plant.parameters}
    return {f"{drive.body.name}.resistance", f"{drive.body.name}.voltage_limit"} <= declared


def currents_of_supply(
    drive: KnownDrive, writer: LawWriter, speed: Expression
) -> tuple[Expression, Expression] | None:
    """Return the least and the largest current that the supply can push at a speed, (∓U_max − k·ω)/R.

    ``None`` where the motor declares no resistance: then no voltage is limited.

    ``writer``: of the controller; it is given the parameters that enter.
    """
    if not voltage_is_limited(drive):
        return None
    resistance, supply = (
        writer.number(drive.plant.variable(f"{drive.body.name}.{own}"))
        for own in ("resistance", "voltage_limit")
    )
    induced = drive.torque_per_current(writer) * speed
    return (-supply - induced) / resistance, (supply - induced) / resistance


STEEPEST = 0.1
"""Steepest change of sign of a friction that grows with the load, over the gain of the velocity loop.

More of it would close a loop of its own through the estimated torque, and hunt.
"""


def known_load(
    drive: KnownDrive, writer: LawWriter, width: Expression, gain: Expression
) -> Callable[[Expression, Expression, Expression], Expression]:
    """Return what the plant declares to resist its motor beside its spring, R(θ, ω, T), in N·m.

    It is read off the equations, R = −J·ω̇ − r·T without a drive: friction, also that of a place or of a
    load, ripple, weights and constant loads. What else it depends on is taken as it starts. Its change of
    sign is spread over ±w: R(s)·(1 + ω/s)/2 + R(−s)·(1 − ω/s)/2 with s = √(ω² + w²), because a command that
    passes zero would otherwise make the current jump. w is the width, or more where friction grows with the
    load, see :data:`STEEPEST`.

    ``writer``: of the controller; it is given the parameters of the plant that enter. ``gain``: of the
    velocity loop, in N·m·s/rad. The function takes the angle of the motor, its speed and the torque of the
    spring.
    """
    plant, spring, body = drive.plant, series_spring(drive.plant), drive.body
    carried = carried_torque(drive)
    opened = cut(plant, [carried, f"{body.name}.drive_torque", *end_stops(drive)])
    s, (before, declared) = opened.symbols(), drive.named
    known = named(opened, s)
    given = ca.vertcat(
        known[body.motion], known[body.rate], s.input[[v.name for v in opened.inputs].index(carried)]
    )
    acceleration = s.derivative[[v.name for v in opened.states].index(body.rate)]
    resisting = -_at_start(opened, s, known[body.inertia or ""] * acceleration, given)
    turns = ca.jacobian(before[spring.motion], before[body.motion])
    resisting = ca.substitute(resisting, s.parameter, declared.parameter) - turns * given[2]
    # −J·ω̇ holds r·T, which the difference takes out by its value, not from the expression.
    slope = ca.Function("slope", [given, declared.parameter], [ca.jacobian(resisting, given[2])])
    points = [ca.DM([0.1, speed, load]) for speed in (-1.0, 1.0) for load in (-0.5, 0.5)]
    grows = any(abs(float(slope(at, plant.start(plant.parameters)))) > _NOTHING for at in points)
    resisting = drive.written(writer, resisting if grows else ca.substitute(resisting, given[2], 0))

    def smooth(angle: Expression, speed: Expression, torque: Expression) -> Expression:
        def at(speed: Expression, load: Expression = torque) -> Expression:
            return ca.SX(ca.substitute(resisting, given, ca.vertcat(angle, speed, load)))

        widest = width
        if grows:
            grown = at(width) - at(-width) - at(width, ca.SX(0)) + at(-width, ca.SX(0))
            widest = ca.fmax(width, grown / (2 * STEEPEST * gain))
        size = ca.sqrt(speed * speed + widest * widest)
        share = speed / size
        return (at(size) * (1 + share) + at(-size) * (1 - share)) / 2

    return smooth


def carried_torque(drive: KnownDrive) -> str:
    """Return the signal of the spring's torque that can be estimated: without what its load rubs in its tie.

    Such friction, T = T_in·(1 + µ·sgn ω), stands around what the spring was; neither a sensor in the spring
    nor an observer over its angle has it.
    """
    plant, spring, known = drive.plant, series_spring(drive.plant), drive.named[0]
    path, _, ending = spring.effort.rpartition(".")
    for name in (v.name for v in plant.signals):
        part = name.removeprefix(f"{path}.").removesuffix(f".{ending}")
        if name != f"{path}.{part}.{ending}" or "." in part or known[name].is_leaf():
            continue
        opened = cut(plant, [name])
        s = opened.symbols()
        inside, signals = s.input[[v.name for v in opened.inputs].index(name)], named(opened, s)
        given = ca.vertcat(inside, signals[drive.body.rate])
        beyond = ca.Function(
            "beyond", [given, s.parameter], [_at_start(opened, s, signals[spring.effort] - inside, given)]
        )
        unloaded, still, rubbing = (
            abs(float(beyond(ca.DM(at), plant.start(plant.parameters)))) > _NOTHING
            for at in ((0.0, SLOW), (1.0, 0.0), (1.0, SLOW))
        )
        if rubbing and not (unloaded or still):
            return name
    return spring.effort


def _at_start(model: FlatModel, s: Symbols, expression: Expression, free: Expression) -> Expression:
    """Return an expression with the states and inputs of a model as they start, but for the free ones."""
    states, inputs = model.start(model.states), model.start(model.inputs)
    fresh = ca.SX.sym("free", free.numel())
    expression = ca.substitute(expression, free, fresh)
    others = ca.vertcat(s.time, s.state, s.input, s.table)
    starts = ca.DM([0.0, *states, *inputs, *model.look_up(list(states), list(inputs))])
    return ca.SX(ca.substitute(ca.substitute(expression, others, starts), fresh, free))


def end_stops(drive: KnownDrive) -> list[str]:
    """Return the torques of places that the drive could not hold, as those of end stops."""
    plant, spring = drive.plant, series_spring(drive.plant)
    opened = cut(plant, [spring.effort])
    s = opened.symbols()
    known = named(opened, s)
    end = min(contour_ends(plant, spring).values(), default=math.pi / 2.0) / abs(drive.spring_turns_value)
    states, inputs = opened.start(opened.states), opened.start(opened.inputs)
    names = [v.name for v in opened.inputs]
    inputs[names.index(drive.names.current)] = plant.values[drive.motor.current_limit]
    most = abs(opened.evaluate(list(states), list(inputs))[f"{drive.body.name}.drive_torque"])
    place = [v.name for v in opened.states].index(drive.body.motion)
    largest: dict[str, float] = {}
    for angle in np.linspace(-1.5 * end, 1.5 * end, 61):
        states[place] = angle
        for name, value in opened.evaluate(list(states), list(inputs)).items():
            largest[name] = max(largest.get(name, 0.0), abs(value))
    return [
        v.name for v in opened.signals
        if v.unit == "N*m" and largest[v.name] > most and not known[v.name].is_leaf()
        and depends(known[v.name], known[drive.body.motion])
    ]  # fmt: skip


STEPS = 3
"""Steps of Newton's method to the current for a torque; from below they do not pass it where a gain falls."""

LEAST_GAIN = 0.05
"""Least gain of the drive that such a step reckons with, over that of small currents."""

_LINEAR = 1e-9
"""Share of its torque by which a drive may depart from a constant gain and count as linear."""


def current_for(drive: KnownDrive, writer: LawWriter, torque: Expression) -> Expression:
    """Return the current in A with which the drive makes a torque in N·m, also where its gain falls with it.

    What the torque of the drive depends on beside the current is taken as it starts; one that follows the
    current late counts as linear.

    ``writer``: of the controller; it is given the parameters of the plant that enter.
    """
    plant, constant = drive.plant, drive.torque_per_current(writer)
    known, s = drive.named
    asked = known[drive.names.current]
    made = _at_start(plant, s, known[f"{drive.body.name}.drive_torque"], asked)
    currents = np.linspace(0.1, 1.0, 10) * plant.values[drive.motor.current_limit]
    torques = ca.Function("made", [asked, s.parameter], [made])(
        ca.DM(currents).T, plant.start(plant.parameters)
    )
    gains = torques.full().ravel() / currents
    current = torque / constant
    if np.ptp(gains) <= _LINEAR * np.max(np.abs(gains)):
        return current
    driving = drive.written(writer, made)
    gain = ca.jacobian(driving, asked)
    for _ in range(STEPS):
        reached, slope = (ca.substitute(e, asked, current) for e in (driving, gain))
        current += (torque - reached) / ca.fmax(slope, LEAST_GAIN * constant)
    return current


SLOW = 1.0
"""Speed of the motor in rad/s at which friction is counted: what is dry slides, what is viscous is small."""


_SMALL_TURN, _NOTHING = 0.1, 1e-6
"""Angle in rad at which a spring without a cam is looked at, and share of a torque that is none."""


class TorqueLimit(NamedTuple):
    """The largest torque of the series spring in both directions, and what limits it."""

    torque: float  # in N·m
    reason: str  # in words


def torque_limit(plant: FlatModel) -> TorqueLimit:
    """Return the largest torque that a drive can bring into its series spring slowly, in both directions.

    That is where the largest current just overcomes spring, friction and the losses of the gear,
    r·|T| = k·I_max − friction, or the torque of the spring at rest at the end of the contour of its cam,
    whichever is less. A one-sided spring has one direction only, and that one counts.

    ``plant``: continuous, load fixed or prescribed; friction in its smooth form.
    """
    drive = KnownDrive(plant)
    sides = _sides(drive)
    used = [side for side in sides if side[1] > 0.0] or [(0.0, 0.0)]
    current, contour = min(side[0] for side in used), min(side[1] for side in used)
    if contour < current:
        return TorqueLimit(contour, "the spring is at the end of its contour there")
    most = plant.values[drive.motor.current_limit]
    return TorqueLimit(current, f"the current is at its limit there, {most:g} A")


def largest_torque(plant: FlatModel) -> float:
    """Return the largest torque in N·m that a drive can hold in its spring; see :func:`torque_limit`."""
    return torque_limit(plant).torque


def torque_range(plant: FlatModel) -> tuple[float, float]:
    """Return the least and the largest torque in N·m that a drive can hold in its series spring.

    Each direction by itself, where :func:`torque_limit` takes the lesser of both; zero where the spring gives
    none.

    ``plant``: continuous, load fixed or prescribed; friction in its smooth form.
    """
    drive = KnownDrive(plant)
    sides = _sides(drive)
    contours = [contour for _, contour in sides if math.isfinite(contour)]
    nothing = _NOTHING * max(contours, default=0.0)
    forward, backward = (min(side) if side[1] > nothing else 0.0 for side in sides)
    return (-backward, forward) if drive.spring_turns_value > 0.0 else (-forward, backward)


def only_side(plant: FlatModel) -> float:
    """Return the sign of the only torque that a series spring can give, 0 where it can give both.

    A cable that pulls to one side gives no torque at rest at the other end of its travel.

    ``plant``: continuous, load fixed or prescribed; friction in its smooth form.
    """
    drive = KnownDrive(plant)
    end = min(contour_ends(plant, series_spring(plant)).values(), default=_SMALL_TURN)
    torques = [torque_at_rest(drive, way * end) for way in (1.0, -1.0)]
    strongest = max(torques, key=abs)
    if min(map(abs, torques)) > _NOTHING * abs(strongest) or strongest == 0.0:
        return 0.0
    return math.copysign(1.0, strongest)


def check_torque(plant: FlatModel, torque: float) -> None:
    """Check that a drive can hold a torque.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed.
    torque
        Amplitude in N·m.

    Raises
    ------
    ValueRangeError
        If it cannot, with the largest that it can.
    """
    most = torque_limit(plant)
    if not abs(torque) <= most.torque:
        raise ValueRangeError(
            f"torque {torque:g} N·m",
            f"is more than the drive can hold, {most.torque:.4g} N·m: {most.reason}",
            next_step=f"ask for {math.floor(most.torque * 1000.0) / 1000.0:g} N·m or less",
        )


def torques_by_current(plant: FlatModel) -> tuple[float, float]:
    """Return the torques against which the largest current just creeps on, forward and backward, as sizes."""
    by_current = _by_current(KnownDrive(plant))
    return by_current(1.0), by_current(-1.0)


def _sides(drive: KnownDrive) -> list[tuple[float, float]]:
    """Return what current and contour let a drive hold, forward and backward, as sizes."""
    loose = [b.name for b in drive.plant.bodies if not b.prescribed and b.name != drive.body.name]
    if loose:
        raise ArrangementError(
            f"body '{loose[0]}'", "moves freely, so no torque can be held in the spring",
            next_step="fix the load, or prescribe its motion",
        )  # fmt: skip
    by_current = _by_current(drive)
    # The torque at rest at the end of the contour; without a cam there is no end.
    ends = contour_ends(drive.plant, series_spring(drive.plant)).values()
    return [
        (by_current(way), abs(torque_at_rest(drive, way * min(ends))) if ends else math.inf)
        for way in (1.0, -1.0)
    ]


def _by_current(drive: KnownDrive) -> Callable[[float], float]:
    """Return the size of the torque against which the largest current just creeps on, forward or backward."""
    plant, effort = drive.plant, series_spring(drive.plant).effort
    opened = cut(plant, [effort])
    states, inputs = opened.start(opened.states), opened.start(opened.inputs)
    names, places = [v.name for v in opened.states], [v.name for v in opened.inputs]
    rate, looked_up = names.index(drive.body.rate), np.zeros(opened.equations.size1_in(4))
    given = (np.zeros(1), states, inputs, opened.start(opened.parameters), looked_up)
    equations, row = Buffered(opened.equations, given), opened.equations.sparsity_out(0).row().index(rate)

    def largest(way: float) -> float:
        states[rate] = way * SLOW
        inputs[places.index(drive.names.current)] = way * plant.values[drive.motor.current_limit]
        against = way * math.copysign(1.0, drive.spring_turns_value)

        def pushes_on(torque: float) -> bool:
            inputs[places.index(effort)] = against * torque
            looked_up[:] = opened.look_up(list(states), list(inputs))
            equations.evaluate()
            return way * float(equations.results[0][row]) > 0.0

        if not pushes_on(0.0):
            return 0.0
        low, high = 0.0, 1.0
        while pushes_on(high) and math.isfinite(high):
            low, high = high, 2.0 * high
        while high - low > 1e-12 * high:
            middle = (low + high) / 2.0
            low, high = (middle, high) if pushes_on(middle) else (low, middle)
        return low

    return largest


def torque_at_rest(drive: KnownDrive, angle: float) -> float:
    """Return the torque of the spring at rest at an angle of the spring in rad."""
    body, starts = drive.body, {v.name: v.start for v in drive.plant.states}
    turned = {name: starts[name] for name in unmoved_states(drive.plant, body.rate)}
    turned |= {body.motion: angle / abs(drive.spring_turns_value), body.rate: 0.0}
    return drive.plant.evaluate(list(rest_state(drive.plant, turned)))[series_spring(drive.plant).effort]
