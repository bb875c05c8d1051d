"""Writes a controller part by part: every part declares its numbers and states in one flat model.

The names by which a torque loop is wired are those of the plant. What an integrator does while a limit holds
back what it asks for is a choice of its own.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.symbolic import Expression
from ....model import FlatModel, Origin, Table, Variable
from ....model.flat import stated_equations
from ....model.roles import motor_of, series_spring

DESIRED = "desired"
"""What is added to the name of the torque for the torque that the spring should have."""


@dataclass(frozen=True)
class LoopNames:
    """Names of the variables by which a torque loop is wired: those of the plant."""

    # angle, speed: motion of the motor and its rate
    angle: str
    speed: str
    torque: str  # torque of the series spring
    current: str  # input of the motor

    @property
    def desired(self) -> str:
        """Name of the torque that the spring should have."""
        return f"{self.torque}.{DESIRED}"

    @property
    def desired_rate(self) -> str:
        """Name of the rate of the torque that the spring should have, where a controller is given it."""
        return f"{self.desired}.rate"


def loop_names(plant: FlatModel) -> LoopNames:
    """Return the names of a plant by which its torque loop is wired, decided from its structure."""
    body, motor = motor_of(plant)
    if motor.command is None or plant.variable(motor.command).unit != "A":
        raise ArrangementError(
            f"motor '{body.name}'", "is not driven by a current, which a torque controller gives",
            next_step="declare it as a GearedMotor and keep its current among the inputs",
        )  # fmt: skip
    return LoopNames(body.motion, body.rate, series_spring(plant).effort, motor.command)


_DEPTH = 3
"""How many states in a row may begin with one another's values."""

GAIN = "controller"
"""What the names of settings begin with: they belong to no part of the plant."""


class LawWriter:
    """Collects what the parts of a controller declare, and writes it as one discrete flat model.

    ``origin``: the deck of the plant that the controller is for.
    """

    def __init__(self, sample_time: float, origin: Origin | None = None) -> None:
        self.sample_time, self.origin = sample_time, origin
        self._states: dict[str, tuple[Variable, Expression]] = {}
        self._following: dict[str, Expression] = {}
        self._beginning: dict[str, Expression] = {}
        self._resuming: dict[str, Expression] = {}
        self._inputs: dict[str, tuple[Variable, Expression]] = {}
        self._parameters: dict[str, tuple[Variable, Expression]] = {}
        self._signals: dict[str, tuple[Variable, Expression]] = {}
        self._tables: list[tuple[Table, tuple[Expression, ...]]] = []

    def input(self, name: str, unit: str, description: str) -> Expression:
        """Return an input; the same for the same name."""
        return self._inputs.setdefault(name, (Variable(name, unit, description), ca.SX.sym(name)))[1]

    def setting(self, name: str, unit: str, description: str, value: float) -> Expression:
        """Return a setting of the controller, which is not negative, as the parameter ``controller.NAME``."""
        full = f"{GAIN}.{name}"
        return self.number(Variable(full, unit, description, value, value or 1.0, 0.0))

    def number(self, variable: Variable) -> Expression:
        """Return a parameter that is declared elsewhere, such as a number of the plant."""
        known, symbol = self._parameters.setdefault(variable.name, (variable, ca.SX.sym(variable.name)))
        if known != variable:
            raise ArrangementError(
                f"parameter '{variable.name}' of a controller", "is declared twice, with other numbers",
                next_step=f"give the part of the plant another name than '{GAIN}'",
            )  # fmt: skip
        return symbol

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Return a state that starts at zero."""
        if name in self._states:
            raise ArrangementError(f"state '{name}' of a controller", "is declared by two of its parts")
        self._states[name] = (Variable(name, unit, description), ca.SX.sym(name))
        return self._states[name][1]

    def begin(self, name: str, value: Expression, *, resumes: bool = False) -> None:
        """Say what a state is before the first sample, where that is not zero.

        ``resumes``: whether it is that after a gap in the readings too; other states go on as they were.
        """
        self._beginning[name] = value
        if resumes:
            self._resuming[name] = value

    def follow(self, name: str, value: Expression) -> None:
        """Say what a state is one sample later."""
        self._following[name] = value

    def signal(self, name: str, unit: str, description: str, value: Expression) -> Expression:
        """Give a name to an expression, and return it."""
        self._signals[name] = (Variable(name, unit, description), value)
        return value

    def look_up(self, table: Table) -> tuple[Expression, ...]:
        """Return the columns of a table over one of the inputs or states."""
        columns = tuple(ca.SX.sym(v.name) for v in table.columns)
        self._tables.append((table, columns))
        return columns

    def low_pass(self, old: Expression, new: Expression, bandwidth: Expression) -> Expression:
        """Return a low-pass of first order one sample on, exact for an input that is held."""
        keep = ca.exp(-2.0 * math.pi * bandwidth * self.sample_time)
        return keep * old + (1 - keep) * new

    def model(self, name: str, description: str, output: tuple[Variable, Expression]) -> FlatModel:
        """Return the controller."""
        x, u, p = (
            ca.vertcat(*(symbol for _, symbol in group.values()))
            for group in (self._states, self._inputs, self._parameters)
        )
        w = [symbol for _, columns in self._tables for symbol in columns]
        following = [self._following[state] for state in self._states]
        signals = [value for _, value in self._signals.values()]
        return FlatModel(
            name=name,
            description=description,
            states=tuple(v for v, _ in self._states.values()),
            inputs=tuple(v for v, _ in self._inputs.values()),
            parameters=tuple(v for v, _ in self._parameters.values()),
            outputs=(output[0],),
            signals=tuple(v for v, _ in self._signals.values()),
            equations=stated_equations(
                x,
                u,
                derivative=ca.vertcat(*following),
                output=output[1],
                parameter=p,
                table=ca.vertcat(*w) if w else ca.SX(0, 1),
                signal=ca.vertcat(*signals),
            ),
            sample_time=self.sample_time,
            origin=self.origin,
            tables=tuple(table for table, _ in self._tables),
            begin=self._begun(x, u, p, ca.vertcat(*w) if w else ca.SX(0, 1)),
        )

    def _begun(self, x: Expression, u: Expression, p: Expression, w: Expression) -> ca.Function:
        """Return the states before the first sample, and those after a gap in the readings."""
        first = ca.SX(ca.vertcat(*[self._beginning.get(name, ca.SX(0)) for name in self._states]))
        own = [symbol for _, symbol in self._states.values()]
        again = [self._resuming.get(name, symbol) for name, symbol in zip(self._states, own, strict=True)]
        begun = ca.SX.zeros(len(own), 1)
        for _ in range(_DEPTH):
            begun = ca.substitute(first, ca.SX(x), begun)
        return ca.Function("begin", [x, u, p, w], [ca.densify(begun), ca.densify(ca.vertcat(*again))])


def filtered_rate(
    writer: LawWriter, name: str, *, value: Expression, corner: Expression, of: str, unit: str, rate_unit: str
) -> Expression:
    """Return the filtered rate of a value; ``name``: what its states begin with, ``of``: what it is."""
    before = writer.state(f"{name}.previous", unit, f"{of} one sample ago")
    old = writer.state(f"{name}.rate", rate_unit, f"filtered rate of the {of}")
    rate = writer.low_pass(old, (value - before) / writer.sample_time, corner)
    writer.begin(f"{name}.previous", value)
    writer.follow(f"{name}.previous", value)
    writer.follow(f"{name}.rate", rate)
    return rate


def limited(value: Expression, limit: Expression) -> Expression:
    """Return a value within ±limit."""
    return ca.fmin(ca.fmax(value, -limit), limit)


class Integration(NamedTuple):
    """One integrator of a controller at one sample."""

    name: str  # own name of the loop that it belongs to, for settings: torque or velocity
    value: Expression  # what the integrator holds
    error: Expression  # what it integrates, before its gain; its sign is that of the growth
    rate: Expression  # error times gain: growth per second
    # beyond: by how much what it asks for exceeds each limit behind it; positive at the upper limit
    beyond: tuple[Expression, ...]
    # nearest: the excess over the nearest limit in the unit of the integrator, for back-calculation
    nearest: Expression


class AntiWindup(ABC):
    """How integrators are kept from winding up behind a limit."""

    @abstractmethod
    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return what the integrator holds one sample later.

        Parameters
        ----------
        writer
            Of the controller.
        one
            The integrator.
        """


@dataclass(frozen=True)
class ConditionalIntegration(AntiWindup):
    """The integrator stands still while it pushes further into a limit, and only then.

    Source: Åström and Hägglund 2006 (conditional integration).
    """

    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return x + T·ẋ, or x while error and excess have the same sign."""
        free = one.error * one.beyond[0] <= 0
        for beyond in one.beyond[1:]:
            free = free * (one.error * beyond <= 0)
        return one.value + writer.sample_time * one.rate * free


@dataclass(frozen=True)
class BackCalculation(AntiWindup):
    """The integrator is led back by the excess over the limit: ẋ = K·e − excess/T_t.

    Source: Åström and Hägglund 2006.

    Parameters
    ----------
    tracking_time
        T_t in s: after so long 63 % of what is beyond the limit is given up. Not below the sample time.

    Raises
    ------
    ValueRangeError
        If the time is not positive.
    """

    tracking_time: float = 0.02

    def __post_init__(self) -> None:
        if not 0.0 < self.tracking_time < float("inf"):
            raise ValueRangeError(f"tracking_time {self.tracking_time:g} s", "must be positive and finite")

    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return x + T·(ẋ − excess/T_t).

        Raises
        ------
        ValueRangeError
            If the tracking time is below the sample time.
        """
        if self.tracking_time < writer.sample_time:
            raise ValueRangeError(
                f"tracking_time {self.tracking_time:g} s",
                f"is below the sample time of {writer.sample_time:g} s, so the integrator would overshoot",
                next_step="take a few sample times at least",
            )
        time = writer.setting(
            f"{one.name}_tracking_time", "s", f"{one.name} loop: time in which an excess is given up",
            self.tracking_time,
        )  # fmt: skip
        return one.value + writer.sample_time * (one.rate - one.nearest / time)
