"""What a controller knows of the drive: the plant's own numbers and laws, under the plant's own names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from ...errors import ArrangementError
from ...model import FlatModel
from ...model.flat import Symbols
from ...model.roles import motor_of, series_spring
from ...model.structure import MotorNames, MovingBody
from ...model.transform import cut, named
from ...symbolic import Expression, depends
from .law_writer import LawWriter
from .wired_names import LoopNames, loop_names


@dataclass(frozen=True, eq=False)
class KnownDrive:
    """The drive of a plant as a controller knows it: J·ω̇ = k·I − r·T − friction(ω), φ̇ = r·ω.

    ω is the speed of the motor, φ the angle and T the torque of the series spring, r the turns of the spring
    per turn of the motor. All are expressions in the parameters of the plant, read off its equations, so a
    motor with its gear declared in it and one in a gear train are the same.

    Parameters
    ----------
    plant
        Continuous; its motor is driven by a current.

    Raises
    ------
    ArrangementError
        If the plant has no motor that is driven by a current, or its motor does not turn the series spring.
    """

    plant: FlatModel

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
    def spring_motion(self) -> str:
        """Name of the angle of the series spring."""
        return series_spring(self.plant).motion

    @property
    def spring_turns_value(self) -> float:
        """Turns of the spring per turn of the motor at the declared numbers, 1."""
        known, s = self._named
        slope = ca.jacobian(known[self.spring_motion], known[self.body.motion])
        point = ca.Function("turns", [s.time, s.state, s.input, s.parameter], [slope])
        plant = self.plant
        return float(
            point(0.0, plant.start(plant.states), plant.start(plant.inputs), plant.start(plant.parameters))
        )

    @property
    def spring_seen_at_the_motor(self) -> bool:
        """Whether the angle of the motor alone tells that of the spring, as with a fixed load."""
        known, s = self._named
        motion = known[self.spring_motion]
        return not depends(motion, ca.vertcat(_without(s.state, known[self.body.motion]), s.input))

    def inertia(self, writer: LawWriter) -> Expression:
        """Return J in kg·m²: of all that turns with the motor, seen from it.

        Parameters
        ----------
        writer
            Of the controller; it is given the parameters of the plant that enter.
        """
        return self._written(writer, self._named[0][self.body.inertia or ""])

    def torque_per_current(self, writer: LawWriter) -> Expression:
        """Return k in N·m/A, at the shaft whose angle is measured.

        Parameters
        ----------
        writer
            Of the controller.
        """
        motor = self.motor
        constant = writer.number(self.plant.variable(motor.torque_constant))
        if motor.gear_ratio is None:
            return constant
        return writer.number(self.plant.variable(motor.gear_ratio)) * constant

    def spring_turns(self, writer: LawWriter) -> Expression:
        """Return r, 1.

        Parameters
        ----------
        writer
            Of the controller.
        """
        known, _ = self._named
        return self._written(writer, ca.jacobian(known[self.spring_motion], known[self.body.motion]))

    def current_limit(self, writer: LawWriter) -> Expression:
        """Return the largest current in A.

        Parameters
        ----------
        writer
            Of the controller.
        """
        return writer.number(self.plant.variable(self.motor.current_limit))

    @property
    def voltage_is_limited(self) -> bool:
        """Whether the plant's motor declares a resistance and a largest voltage."""
        declared = {v.name for v in self.plant.parameters}
        return {f"{self.body.name}.resistance", f"{self.body.name}.voltage_limit"} <= declared

    def currents_of_supply(
        self, writer: LawWriter, speed: Expression
    ) -> tuple[Expression, Expression] | None:
        """Return the least and the largest current that the supply can push at a speed, (∓U_max − k·ω)/R.

        ``None`` where the motor declares no resistance: then no voltage is limited.

        Parameters
        ----------
        writer
            Of the controller.
        speed
            Of the motor in rad/s.
        """
        if not self.voltage_is_limited:
            return None
        resistance, supply = (
            writer.number(self.plant.variable(f"{self.body.name}.{own}"))
            for own in ("resistance", "voltage_limit")
        )
        induced = self.torque_per_current(writer) * speed
        return (-supply - induced) / resistance, (supply - induced) / resistance

    def friction(self, writer: LawWriter, width: Expression) -> Callable[[Expression], Expression]:
        """Return what the plant declares to resist its motor as a function of the speed alone, in N·m.

        It is read off the equations: all torques that depend on nothing but the speed of the motor, such as
        those of bearings and of dry friction in its smooth form. Losses that grow with the load are not in
        it. Its change of sign is spread over ±width: f(s)·(1 + ω/s)/2 + f(−s)·(1 − ω/s)/2 with
        s = √(ω² + width²), because a command that passes zero would otherwise make the current jump.

        Parameters
        ----------
        writer
            Of the controller; it is given the parameters of the plant that enter.
        width
            In rad/s.
        """
        torque = self._speed_torques(writer)

        def smooth(speed: Expression) -> Expression:
            size = ca.sqrt(speed * speed + width * width)
            share = speed / size
            return (torque(size) * (1 + share) + torque(-size) * (1 - share)) / 2

        return smooth

    def _speed_torques(self, writer: LawWriter) -> Callable[[Expression], Expression]:
        """Return the sum of the torques on the motor that depend on nothing but its speed."""
        known, s = self._named
        rate = known[self.body.rate]
        others = ca.vertcat(s.time, _without(s.state, rate), s.input)
        by_speed = [
            v.name
            for v in self.plant.signals
            if v.unit == "N*m" and depends(known[v.name], rate) and not depends(known[v.name], others)
        ]
        if not by_speed:
            return lambda speed: ca.SX(0)
        # Cut at all of them at once, a torque inside another one of them has no effect of its own.
        opened = cut(self.plant, by_speed)
        after = opened.symbols()
        within = named(opened, after)
        acceleration = after.derivative[[v.name for v in opened.states].index(self.body.rate)]
        total = ca.SX(0)
        for name in by_speed:
            share = -within[self.body.inertia or ""] * ca.jacobian(acceleration, within[name])
            if not depends(share, ca.vertcat(after.state, after.input)):
                total += ca.substitute(share, after.parameter, s.parameter) * known[name]
        placed = self._written(writer, total)
        return lambda speed: ca.SX(ca.substitute(placed, rate, speed))

    @cached_property
    def _named(self) -> tuple[dict[str, Expression], Symbols]:
        s = self.plant.symbols()
        return named(self.plant, s), s

    def _written(self, writer: LawWriter, expression: Expression) -> Expression:
        """Return an expression in the plant's parameters with those of the controller."""
        _, s = self._named
        used = [
            (v, symbol)
            for v, symbol in zip(self.plant.parameters, ca.vertsplit(s.parameter), strict=True)
            if depends(expression, symbol)
        ]
        if not used:
            return expression
        new = ca.vertcat(*(writer.number(v) for v, _ in used))
        return ca.SX(ca.substitute(expression, ca.vertcat(*(symbol for _, symbol in used)), new))


def _without(column: Expression, one: Expression) -> Expression:
    return ca.vertcat(*(each for each in ca.vertsplit(column) if not ca.is_equal(each, one)))
