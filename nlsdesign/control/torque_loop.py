"""Torque controller of a series elastic drive: PID on the estimated torque around a velocity loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import casadi as ca

from ..errors import ValueRangeError, unknown_name
from ..model import FlatModel, Variable
from ..symbolic import Expression

DRIVE = ("motor.inertia", "motor.gear_ratio", "motor.torque_constant", "motor.current_limit")
"""Parameters of the plant that the controller knows under the same names."""


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
        Corner of the filter on the derivative, in Hz.
    speed_limit
        Largest speed command, in rad/s.
    velocity_bandwidth
        Of the velocity loop, in Hz.
    velocity_integral
        Corner below which the velocity loop integrates, in Hz.
    speed_bandwidth
        Corner of the filter on the difference of the encoder, in Hz.
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

_STATES = (
    Variable("motor.angle.previous", "rad", "measured angle one sample ago"),
    Variable("motor.speed.filtered", "rad/s", "filtered difference of the measured angle"),
    Variable("torque_loop.error.previous", "N*m", "torque error one sample ago"),
    Variable("torque_loop.error.rate", "N*m/s", "filtered rate of the torque error"),
    Variable("torque_loop.integral", "rad/s", "integral part of the speed command"),
    Variable("velocity_loop.integral", "N*m", "integral part of the motor torque"),
)


def torque_controller(
    plant: FlatModel,
    *,
    gains: TorqueGains | None = None,
    sample_time: float = 1e-3,
    current: str = "motor.current",
) -> FlatModel:
    """Return the controller as a discrete flat model.

    Inputs ``spring.torque.desired``, ``spring.torque`` (the estimate) and ``motor.angle`` (the encoder);
    output the motor current. Speed command v = Kp·e + ∫Ki·e dt + Kd·de/dt, held within its limit; motor
    torque J·ω_b·(v − ω̂)·(1 + ω_i∫dt) + c·T̂, with J, gear ratio, torque constant and current limit from the
    plant. Where a command is limited, the integrators that push further into the limit stand still.

    Parameters
    ----------
    plant
        Gives inertia, gear ratio, torque constant and current limit of ``motor``.
    gains
        Settings; the defaults of :class:`TorqueGains` where none are given.
    sample_time
        In s.
    current
        Name of the output.

    Raises
    ------
    UnknownNameError
        If the plant has no geared motor by the name of ``motor``.
    ValueRangeError
        If the sample time is not positive.
    """
    if not sample_time > 0.0:
        raise ValueRangeError(f"sample_time {sample_time:g} s", "must be positive")
    known = {v.name: v for v in plant.parameters}
    for name in DRIVE:
        if name not in known:
            raise unknown_name("parameter", name, known)
    chosen = gains or TorqueGains()
    own = [
        Variable(f"controller.{n}", unit, text, getattr(chosen, n), getattr(chosen, n) or 1.0, 0.0)
        for n, (unit, text) in _UNITS.items()
    ]
    parameters = (*own, *(known[name] for name in DRIVE))
    inputs = (
        Variable("spring.torque.desired", "N*m", "torque that the spring should have"),
        Variable("spring.torque", "N*m", "estimate of the torque that the spring has"),
        Variable("motor.angle", "rad", "measured angle of the motor"),
    )
    limit = known["motor.current_limit"].start
    output = Variable(
        current, "A", "current for the coming sample", nominal=limit, minimum=-limit, maximum=limit
    )
    signals = (
        Variable("motor.speed.desired", "rad/s", "speed command"),
        Variable("motor.speed.measured", "rad/s", "filtered speed"),
    )
    return FlatModel(
        "torque_controller",
        "PID on the estimated torque around a velocity loop",
        _STATES,
        inputs,
        parameters,
        (output,),
        signals,
        _equations(parameters, sample_time),
        sample_time,
    )


def _equations(parameters: tuple[Variable, ...], time: float) -> ca.Function:
    p = {v.name.rpartition(".")[2]: ca.SX.sym(v.name) for v in parameters}
    x = {v.name: ca.SX.sym(v.name) for v in _STATES}
    desired, torque, angle = (ca.SX.sym(n) for n in ("desired", "torque", "angle"))
    raw = (angle - x["motor.angle.previous"]) / time
    speed = _low_pass(x["motor.speed.filtered"], raw, p["speed_bandwidth"], time)
    error = desired - torque
    difference = (error - x["torque_loop.error.previous"]) / time
    rate = _low_pass(x["torque_loop.error.rate"], difference, p["derivative_bandwidth"], time)
    command = p["proportional"] * error + x["torque_loop.integral"] + p["derivative"] * rate
    limited = _limited(command, p["speed_limit"])
    stiffness = p["inertia"] * 2.0 * math.pi * p["velocity_bandwidth"]
    slow = x["velocity_loop.integral"]
    constant = p["gear_ratio"] * p["torque_constant"]
    wanted = (stiffness * (limited - speed) + slow + p["compensation"] * torque) / constant
    current = _limited(wanted, p["current_limit"])
    beyond_speed, beyond_current = command - limited, wanted - current
    # An integrator rests while it pushes further into a limit, and only then.
    free = (error * beyond_speed <= 0) * (error * beyond_current <= 0)
    free_slow = (limited - speed) * beyond_current <= 0
    integral = x["torque_loop.integral"] + time * p["integral"] * error * free
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
