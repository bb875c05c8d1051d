"""Torque controller of a series elastic drive: PID on the estimated torque around a velocity loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import casadi as ca

from ...errors import ArrangementError, ValueRangeError
from ...model import FlatModel, Variable
from ...model.roles import motor_of, series_spring
from ...symbolic import Expression

DESIRED = "desired"
"""What is added to the name of the torque for the torque that the spring should have."""


@dataclass(frozen=True)
class LoopNames:
    """Names of the variables by which a torque loop is wired: those of the plant.

    Parameters
    ----------
    angle, speed
        Motion of the motor and its rate.
    torque
        Torque of the series spring.
    current
        Input of the motor.
    """

    angle: str
    speed: str
    torque: str
    current: str

    @property
    def desired(self) -> str:
        """Name of the torque that the spring should have."""
        return f"{self.torque}.{DESIRED}"


def loop_names(plant: FlatModel) -> LoopNames:
    """Return the names of a plant by which its torque loop is wired, decided from its structure.

    Parameters
    ----------
    plant
        With one series spring and one motor that is driven by a current.

    Raises
    ------
    ArrangementError
        If the structure does not decide, or the motor is not driven by a current.
    """
    body, motor = motor_of(plant)
    if motor.command is None or plant.variable(motor.command).unit != "A":
        raise ArrangementError(
            f"motor '{body.name}'", "is not driven by a current, which a torque controller gives",
            next_step="declare it as a GearedMotor and keep its current among the inputs",
        )  # fmt: skip
    return LoopNames(body.motion, body.rate, series_spring(plant).effort, motor.command)


@dataclass(frozen=True)
class TorqueGains:
    """Settings of both loops; all of them are parameters of the controller and can be tuned there.

    Parameters
    ----------
    proportional
        Speed command per torque error, in rad/s per N·m. Below crossover the torque that a moved load feels
        is its speed over this number.
    integral
        In rad/s² per N·m.
    derivative
        In rad per N·m.
    derivative_bandwidth
        Cut-off frequency of the filter on the derivative, in Hz.
    speed_limit
        Largest speed command, in rad/s.
    velocity_bandwidth
        Of the velocity loop, in Hz.
    velocity_integral
        Frequency below which the velocity loop integrates, in Hz.
    speed_bandwidth
        Cut-off frequency of the filter on the difference of the encoder, in Hz.
    compensation
        Share of the estimated spring torque that is added to the current, so that the velocity loop does not
        have to carry it.

    Raises
    ------
    ValueRangeError
        If a gain is negative or not finite.
    """

    proportional: float = 32.0
    integral: float = 100.0
    derivative: float = 0.0
    derivative_bandwidth: float = 100.0
    speed_limit: float = 60.0
    velocity_bandwidth: float = 60.0
    velocity_integral: float = 6.0
    speed_bandwidth: float = 300.0
    compensation: float = 1.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueRangeError(f"{each.name} {value:g}", "must be finite and not negative")


_UNITS = {
    "proportional": ("rad/s/N/m", "torque loop: speed command per torque error"),
    "integral": ("rad/s^2/N/m", "torque loop: integral gain"),
    "derivative": ("rad/N/m", "torque loop: derivative gain"),
    "derivative_bandwidth": ("Hz", "torque loop: corner of the filter on the derivative"),
    "speed_limit": ("rad/s", "torque loop: largest speed command"),
    "velocity_bandwidth": ("Hz", "velocity loop: bandwidth"),
    "velocity_integral": ("Hz", "velocity loop: corner below which it integrates"),
    "speed_bandwidth": ("Hz", "velocity loop: corner of the filter on the difference of the encoder"),
    "compensation": ("1", "velocity loop: share of the estimated spring torque added to the current"),
}


def torque_controller(
    plant: FlatModel,
    *,
    gains: TorqueGains | None = None,
    sample_time: float = 1e-3,
    current: str | None = None,
) -> FlatModel:
    """Return the controller as a discrete flat model.

    Inputs are the desired torque, the estimate of the spring's torque and the measured angle of the motor;
    output is the motor current. Their names are those of the plant, the desired torque has the ending
    ``.desired``: ``spring.torque.desired``, ``spring.torque``, ``motor.angle`` and ``motor.current`` where
    the plant's parts are called spring and motor. Speed command v = Kp·e + ∫Ki·e dt + Kd·de/dt, held within
    its limit; motor torque J·ω_b·(v − ω̂)·(1 + ω_i∫dt) + c·T̂, with J, gear ratio, torque constant and current
    limit from the plant. Where a command is limited, the integrators that push further into the limit stand
    still.

    Parameters
    ----------
    plant
        Gives names, and inertia, gear ratio, torque constant and current limit of its motor.
    gains
        Settings; the defaults of :class:`TorqueGains` where none are given.
    sample_time
        In s.
    current
        Name of the output; by default that of the input of the motor.

    Raises
    ------
    ArrangementError
        If the plant has no geared motor that is driven by a current, or no series spring.
    ValueRangeError
        If the sample time is not positive.
    """
    if not sample_time > 0.0:
        raise ValueRangeError(f"sample_time {sample_time:g} s", "must be positive")
    names, drive = loop_names(plant), _drive_numbers(plant)
    settings = _settings(gains or TorqueGains())
    inputs = (
        Variable(names.desired, "N*m", "torque that the spring should have"),
        Variable(names.torque, "N*m", "estimate of the torque that the spring has"),
        Variable(names.angle, "rad", "measured angle of the motor"),
    )
    limit = drive["current_limit"].start
    output = Variable(
        current or names.current, "A", "current for the coming sample",
        nominal=limit, minimum=-limit, maximum=limit,
    )  # fmt: skip
    states = _states(names)
    return FlatModel(
        name="torque_controller",
        description="PID on the estimated torque around a velocity loop",
        states=tuple(states.values()),
        inputs=inputs,
        parameters=(*settings.values(), *drive.values()),
        outputs=(output,),
        signals=(
            Variable(f"{names.speed}.{DESIRED}", "rad/s", "speed command"),
            Variable(f"{names.speed}.measured", "rad/s", "filtered speed"),
        ),
        equations=_equations(states, settings | drive, sample_time),
        sample_time=sample_time,
    )


def _drive_numbers(plant: FlatModel) -> dict[str, Variable]:
    body, motor = motor_of(plant)
    if motor.gear_ratio is None:
        raise ArrangementError(
            f"motor '{body.name}'", "has no gear ratio of its own",
            next_step="declare it as a GearedMotor: the controller knows a motor behind its gear",
        )  # fmt: skip
    return {
        "inertia": plant.variable(motor.inertia),
        "gear_ratio": plant.variable(motor.gear_ratio),
        "torque_constant": plant.variable(motor.torque_constant),
        "current_limit": plant.variable(motor.current_limit),
    }


def _settings(gains: TorqueGains) -> dict[str, Variable]:
    values = {name: getattr(gains, name) for name in _UNITS}
    return {
        name: Variable(f"controller.{name}", unit, text, values[name], values[name] or 1.0, 0.0)
        for name, (unit, text) in _UNITS.items()
    }


def _states(names: LoopNames) -> dict[str, Variable]:
    return {
        "angle before": Variable(f"{names.angle}.previous", "rad", "measured angle one sample ago"),
        "speed": Variable(f"{names.speed}.filtered", "rad/s", "filtered difference of the measured angle"),
        "error before": Variable("torque_loop.error.previous", "N*m", "torque error one sample ago"),
        "error rate": Variable("torque_loop.error.rate", "N*m/s", "filtered rate of the torque error"),
        "speed integral": Variable("torque_loop.integral", "rad/s", "integral part of the speed command"),
        "torque integral": Variable("velocity_loop.integral", "N*m", "integral part of the motor torque"),
    }


def _equations(
    states: Mapping[str, Variable], parameters: Mapping[str, Variable], time: float
) -> ca.Function:
    p = {key: ca.SX.sym(v.name) for key, v in parameters.items()}
    x = {key: ca.SX.sym(v.name) for key, v in states.items()}
    desired, torque, angle = (ca.SX.sym(n) for n in ("desired", "torque", "angle"))
    raw = (angle - x["angle before"]) / time
    speed = _low_pass(x["speed"], raw, p["speed_bandwidth"], time)
    error = desired - torque
    difference = (error - x["error before"]) / time
    rate = _low_pass(x["error rate"], difference, p["derivative_bandwidth"], time)
    command = p["proportional"] * error + x["speed integral"] + p["derivative"] * rate
    limited = _limited(command, p["speed_limit"])
    stiffness = p["inertia"] * 2.0 * math.pi * p["velocity_bandwidth"]
    slow = x["torque integral"]
    constant = p["gear_ratio"] * p["torque_constant"]
    wanted = (stiffness * (limited - speed) + slow + p["compensation"] * torque) / constant
    current = _limited(wanted, p["current_limit"])
    beyond_speed, beyond_current = command - limited, wanted - current
    # An integrator rests while it pushes further into a limit, and only then.
    free = (error * beyond_speed <= 0) * (error * beyond_current <= 0)
    free_slow = (limited - speed) * beyond_current <= 0
    integral = x["speed integral"] + time * p["integral"] * error * free
    slow_rate = 2.0 * math.pi * p["velocity_integral"] * stiffness * (limited - speed)
    following = [angle, speed, error, rate, integral, slow + time * slow_rate * free_slow]
    return ca.Function(
        "equations",
        [
            ca.SX.sym("time"), ca.vertcat(*x.values()), ca.vertcat(desired, torque, angle),
            ca.vertcat(*p.values()), ca.SX(0, 1),
        ],
        [ca.vertcat(*following), current, ca.vertcat(limited, speed), ca.SX(0, 1)],
        ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
    )  # fmt: skip


def _low_pass(old: Expression, new: Expression, bandwidth: Expression, time: float) -> Expression:
    keep = ca.exp(-2.0 * math.pi * bandwidth * time)
    return keep * old + (1 - keep) * new


def _limited(value: Expression, limit: Expression) -> Expression:
    return ca.fmin(ca.fmax(value, -limit), limit)
