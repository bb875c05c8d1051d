"""What a controller knows of the drive: the plant's own numbers and laws, under the plant's own names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from ....foundation.errors import ArrangementError
from ....foundation.symbolic import Expression, depends
from ....model import FlatModel
from ....model.flat import Symbols
from ....model.roles import motor_of, series_spring
from ....model.structure import MotorNames, MovingBody
from ....model.transform import named
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

        Parameters
        ----------
        writer
            Of the controller; it is given the parameters of the plant that enter.
        """
        return self.written(writer, self.named[0][self.body.inertia or ""])

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
        known, _ = self.named
        return self.written(
            writer, ca.jacobian(known[series_spring(self.plant).motion], known[self.body.motion])
        )

    def current_limit(self, writer: LawWriter) -> Expression:
        """Return the largest current in A.

        Parameters
        ----------
        writer
            Of the controller.
        """
        return writer.number(self.plant.variable(self.motor.current_limit))

    @cached_property
    def named(self) -> tuple[dict[str, Expression], Symbols]:
        """Expressions of everything in the plant by name, and the symbols in them."""
        s = self.plant.symbols()
        return named(self.plant, s), s

    def written(self, writer: LawWriter, expression: Expression) -> Expression:
        """Return an expression in the plant's parameters with those of the controller.

        Parameters
        ----------
        writer
            Of the controller; it is given the parameters that enter.
        expression
            In the symbols of :attr:`named`.
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
    """Return the items of a column without one of them.

    Parameters
    ----------
    column
        Of symbols.
    one
        The one to leave out.
    """
    return ca.vertcat(*(each for each in ca.vertsplit(column) if not ca.is_equal(each, one)))
