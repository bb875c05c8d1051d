"""What a controller knows of the drive, by the plant's names: numbers, supply, friction, largest torque."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca

from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.symbolic import Expression, depends
from ....model import FlatModel
from ....model.flat import Symbols
from ....model.linear import rest_state
from ....model.roles import contour_ends, motor_of, series_spring
from ....model.structure import MotorNames, MovingBody
from ....model.transform import cut, named
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
        return not depends(motion, ca.vertcat(all_but(s.state, known[self.body.motion]), s.input))

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
        new = ca.vertcat(*(writer.number(v) for v, _ in used))
        return ca.SX(ca.substitute(expression, ca.vertcat(*(symbol for _, symbol in used)), new))


def all_but(column: Expression, one: Expression) -> Expression:
    """Return the items of a column without one of them."""
    return ca.vertcat(*(each for each in ca.vertsplit(column) if not ca.is_equal(each, one)))


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


def declared_friction(
    drive: KnownDrive, writer: LawWriter, width: Expression
) -> Callable[[Expression], Expression]:
    """Return what the plant declares to resist its motor as a function of the speed alone, in N·m.

    It is read off the equations: all torques that depend on nothing but the speed of the motor, such as
    those of bearings and of dry friction in its smooth form. Losses that grow with the load are not in
    it. Its change of sign is spread over ±width: f(s)·(1 + ω/s)/2 + f(−s)·(1 − ω/s)/2 with
    s = √(ω² + width²), because a command that passes zero would otherwise make the current jump.

    ``writer``: of the controller; it is given the parameters of the plant that enter.
    """
    torque = _speed_torques(drive, writer)

    def smooth(speed: Expression) -> Expression:
        size = ca.sqrt(speed * speed + width * width)
        share = speed / size
        return (torque(size) * (1 + share) + torque(-size) * (1 - share)) / 2

    return smooth


def _speed_torques(drive: KnownDrive, writer: LawWriter) -> Callable[[Expression], Expression]:
    """Return the sum of the torques on the motor that depend on nothing but its speed."""
    known, s = drive.named
    rate = known[drive.body.rate]
    others = ca.vertcat(s.time, all_but(s.state, rate), s.input)
    by_speed = [
        v.name
        for v in drive.plant.signals
        if v.unit == "N*m" and depends(known[v.name], rate) and not depends(known[v.name], others)
    ]
    if not by_speed:
        return lambda speed: ca.SX(0)
    # Cut at all of them at once, a torque inside another one of them has no effect of its own.
    opened = cut(drive.plant, by_speed)
    after = opened.symbols()
    within = named(opened, after)
    acceleration = after.derivative[[v.name for v in opened.states].index(drive.body.rate)]
    total = ca.SX(0)
    for name in by_speed:
        share = -within[drive.body.inertia or ""] * ca.jacobian(acceleration, within[name])
        if not depends(share, ca.vertcat(after.state, after.input)):
            total += ca.substitute(share, after.parameter, s.parameter) * known[name]
    placed = drive.written(writer, total)
    return lambda speed: ca.SX(ca.substitute(placed, rate, speed))


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
    """Return the largest torque in N·m that a drive can hold in its series spring; see :func:`torque_limit`.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed.
    """
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
    torques = [_torque_at_rest(drive, way * end) for way in (1.0, -1.0)]
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
    return [(by_current(way), _by_contour(drive, way)) for way in (1.0, -1.0)]


def _by_current(drive: KnownDrive) -> Callable[[float], float]:
    """Return the size of the torque against which the largest current just creeps on, forward or backward."""
    plant, effort = drive.plant, series_spring(drive.plant).effort
    opened = cut(plant, [effort])
    states, inputs = opened.start(opened.states), opened.start(opened.inputs)
    names, places = [v.name for v in opened.states], [v.name for v in opened.inputs]
    rate, numbers = names.index(drive.body.rate), opened.start(opened.parameters)

    def largest(way: float) -> float:
        states[rate] = way * SLOW
        inputs[places.index(drive.names.current)] = way * plant.values[drive.motor.current_limit]
        against = way * math.copysign(1.0, drive.spring_turns_value)

        def pushes_on(torque: float) -> bool:
            inputs[places.index(effort)] = against * torque
            slopes = opened.equations(
                0.0, states, inputs, numbers, opened.look_up(list(states), list(inputs))
            )[0]
            return way * float(slopes[rate]) > 0.0

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


def _by_contour(drive: KnownDrive, way: float) -> float:
    """Return the size of the torque at rest at the end of the contour; infinite without a cam."""
    ends = contour_ends(drive.plant, series_spring(drive.plant)).values()
    return abs(_torque_at_rest(drive, way * min(ends))) if ends else math.inf


def _torque_at_rest(drive: KnownDrive, angle: float) -> float:
    """Return the torque of the spring at rest at an angle of the spring in rad."""
    turned = {drive.body.motion: angle / abs(drive.spring_turns_value), drive.body.rate: 0.0}
    return drive.plant.evaluate(list(rest_state(drive.plant, turned)))[series_spring(drive.plant).effort]
