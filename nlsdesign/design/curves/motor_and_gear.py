"""Motor and gear of an actuator, and what they do over one period of a task."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, InfeasibleError
from ...foundation.quantity import Quantity
from ...model import FlatModel
from ...model.roles import driven_body, series_spring
from .numbers import in_si, plain
from .target import Target
from .task import MixedTask, Task, TaskCycle

_SOFTEST = 1e-3
"""Share of the mean stiffness below which a spring cannot serve a task: the deflection would jump there."""


@dataclass(frozen=True, kw_only=True)
class MotorAndGear:
    """Numbers of a motor with a rigid gear without loss; friction and the losses of the gear are left out.

    Parameters
    ----------
    inertia
        Of the rotor and what turns with it, in kg·m².
    torque_constant
        In N·m/A.
    resistance
        Of the winding in Ohm.
    gear_ratio
        Motor turns per turn of the output.
    output_inertia
        Behind the gear, before the spring, in kg·m².
    damping
        At the motor shaft in N·m·s/rad.
    current_limit, voltage_limit
        Of the amplifier in A and of the supply in V; infinite for none.

    Examples
    --------
    >>> MotorAndGear(inertia=1e-5, torque_constant=0.03, resistance=0.3, gear_ratio=50.0).reflected_inertia
    0.025
    """

    inertia: Quantity | float
    torque_constant: Quantity | float
    resistance: Quantity | float
    gear_ratio: Quantity | float
    output_inertia: Quantity | float = 0.0
    damping: Quantity | float = 0.0
    current_limit: Quantity | float = float("inf")
    voltage_limit: Quantity | float = float("inf")

    def __post_init__(self) -> None:
        units = {
            "inertia": ("kg*m^2", 0.0, 1e6),
            "torque_constant": ("N*m/A", 1e-6, 1e3),
            "resistance": ("Ohm", 1e-6, 1e6),
            "gear_ratio": ("1", 1e-3, 1e4),
            "output_inertia": ("kg*m^2", 0.0, 1e6),
            "damping": ("N*m*s/rad", 0.0, 1e6),
            "current_limit": ("A", 1e-6, float("inf")),
            "voltage_limit": ("V", 1e-3, float("inf")),
        }
        for name, (unit, least, most) in units.items():
            object.__setattr__(
                self, name, in_si(name, getattr(self, name), unit, minimum=least, maximum=most)
            )

    @property
    def reflected_inertia(self) -> float:
        """Inertia of motor, gear and output seen from the output, in kg·m²."""
        return plain(self.gear_ratio) ** 2 * plain(self.inertia) + plain(self.output_inertia)

    def geared(self, ratio: float) -> MotorAndGear:
        """Return the same motor with another gear ratio.

        Parameters
        ----------
        ratio
            Motor turns per turn of the output.
        """
        return replace(self, gear_ratio=ratio)


def motor_and_gear(model: FlatModel, *, resistance: Quantity | float | None = None) -> MotorAndGear:
    """Return motor and gear of an actuator, as its model declares them.

    The gear ratio is that between the rotor and the body at the near end of the series spring. Friction,
    damping and the losses of the gear are not taken over.

    Parameters
    ----------
    model
        As flattened, continuous.
    resistance
        Of the winding in Ohm, for a model that declares none.

    Raises
    ------
    ArrangementError
        If the model declares no motor, or no resistance of its winding while none is given.
    """
    body = driven_body(model)
    if body.motor is None:
        raise ArrangementError(
            f"model '{model.name}'", f"'{body.name}' has no electric motor",
            next_step="give its numbers: MotorAndGear(inertia=..., torque_constant=..., resistance=..., ...)",
        )  # fmt: skip
    numbers = model.values
    winding = numbers.get(f"{body.name}.resistance", resistance)
    if winding is None:
        raise ArrangementError(
            f"model '{model.name}', motor '{body.name}'",
            "declares no resistance of its winding, and without it there is no Joule heat",
            next_step="declare a CurrentDrivenMotor, or give MotorAndGear(..., resistance=...)",
        )
    declared = model.values
    behind = [end for end in series_spring(model).between if end in body.geared]
    ratio = 1.0
    if behind:
        turned = [1.0 if v.name == body.motion else v.start for v in model.states]
        ratio = 1.0 / model.evaluate(turned)[f"{behind[0]}.{body.domain.motion}"]
    rotor = declared[body.motor.inertia]
    total = (
        declared.get(str(body.inertia)) or model.evaluate([v.start for v in model.states])[str(body.inertia)]
    )
    infinite = float("inf")
    geared = declared.get(str(body.motor.gear_ratio), 1.0)  # of a motor that is declared behind its gear
    return MotorAndGear(
        inertia=rotor / geared**2,
        torque_constant=declared[body.motor.torque_constant],
        resistance=winding,
        gear_ratio=abs(ratio) * geared,
        output_inertia=max(total - rotor, 0.0) * ratio**2,
        current_limit=declared.get(body.motor.current_limit, infinite),
        voltage_limit=declared.get(f"{body.name}.voltage_limit", infinite),
    )


@dataclass(frozen=True, eq=False)
class MotorCycle:
    """What the motor does over one period of a task; arrays of shape (n,).

    Parameters
    ----------
    cycle
        The task, with the times.
    drive
        The motor and its gear.
    deflection
        Output of the gear minus joint, in rad.
    speed, torque
        At the motor shaft in rad/s and N·m.
    """

    cycle: TaskCycle
    drive: MotorAndGear
    deflection: Array
    speed: Array
    torque: Array

    @property
    def current(self) -> Array:
        """In the winding, in A."""
        return self.torque / plain(self.drive.torque_constant)

    @property
    def voltage(self) -> Array:
        """At the winding, in V."""
        return plain(self.drive.resistance) * self.current + plain(self.drive.torque_constant) * self.speed

    @property
    def power(self) -> Array:
        """At the motor shaft, in W."""
        return self.torque * self.speed

    @property
    def heat(self) -> float:
        """Joule heat of a period in J."""
        return self.cycle.over_period(plain(self.drive.resistance) * self.current**2)

    @property
    def energy(self) -> float:
        """Joule heat and work of a period in J; braking gives power back to the supply."""
        return self.heat + self.cycle.over_period(self.power)

    @property
    def peak_power(self) -> float:
        """Largest power at the motor shaft in W, driving or braking."""
        return float(np.max(np.abs(self.power)))

    @property
    def peaks(self) -> dict[str, float]:
        """Largest current in A, voltage in V, motor torque in N·m and speed in rad/s, deflection in rad."""
        columns = {
            "current": self.current,
            "voltage": self.voltage,
            "torque": self.torque,
            "speed": self.speed,
            "deflection": self.deflection,
        }
        return {name: float(np.max(np.abs(column))) for name, column in columns.items()}


def motor_cycle(
    task: Task | MixedTask,
    drive: MotorAndGear,
    *,
    spring: Target | None = None,
    opposite: Target | None = None,
    count: int = 1200,
) -> MotorCycle:
    """Return what the motor does over a task, through a spring or rigidly coupled.

    The deflection follows from the torque by turning the curve round, speed and acceleration of the motor
    from its exact derivatives.

    Parameters
    ----------
    task
        Motion and torque of the joint.
    drive
        Motor and gear.
    spring
        Torque over deflection; ``None`` for a rigid coupling.
    opposite
        The same for negative torque; ``None`` for an odd spring.
    count
        Number of times.

    Raises
    ------
    InfeasibleError
        If the spring does not reach the torque, or has no positive stiffness on the way.
    """
    cycle = task.sampled(count)
    deflection, slope, bend = (np.zeros_like(cycle.time) for _ in range(3))
    for sign, branch in ((1.0, spring), (-1.0, opposite or spring)):
        rows = sign * cycle.torque >= 0.0
        if branch is not None and np.any(rows):
            at, soft, softening = _deflections(branch, sign * cycle.torque[rows])
            deflection[rows], slope[rows], bend[rows] = sign * at, soft, sign * softening
    return driven_cycle(cycle, drive, deflection, motion_through(cycle, slope, bend))


def motion_through(cycle: TaskCycle, slope: Array, bend: Array) -> tuple[Array, Array]:
    """Return speed and acceleration of the gear's output before a spring, in rad/s and rad/s²."""
    acceleration = cycle.acceleration + slope * cycle.torque_acceleration + bend * cycle.torque_rate**2
    return cycle.speed + slope * cycle.torque_rate, acceleration


def driven_cycle(
    cycle: TaskCycle, drive: MotorAndGear, deflection: Array, motion: tuple[Array, Array]
) -> MotorCycle:
    """Return what the motor does where the output of the gear moves in a known way."""
    speed, acceleration = motion
    ratio, inertia = plain(drive.gear_ratio), drive.reflected_inertia
    torque = (cycle.torque + inertia * acceleration) / ratio + plain(drive.damping) * ratio * speed
    return MotorCycle(cycle, drive, deflection, ratio * speed, torque)


def beside_cycle(cycle: TaskCycle, drive: MotorAndGear, spring: Array) -> MotorCycle:
    """Return what the motor does where a spring beside it puts a torque in N·m on the joint, shape (n,)."""
    rest = replace(cycle, torque=cycle.torque - spring)
    return driven_cycle(rest, drive, np.zeros_like(spring), (cycle.speed, cycle.acceleration))


def _deflections(spring: Target, size: Array) -> tuple[Array, Array, Array]:
    """Return deflection, its slope and its bend over torque, at torques of one sign."""
    most = float(spring.torque(spring.last_angle))
    if float(np.max(size)) > most * (1.0 + 1e-9):
        raise InfeasibleError(
            f"{type(spring).__name__} up to {most:.4g} N·m",
            f"the task needs {float(np.max(size)):.4g} N·m",
            next_step="let the curve go on to a larger angle, or take a share of the task: task.scaled(0.1)",
        )
    angle = ca.SX.sym("angle")
    torque = spring.torque_law(angle)
    slope = ca.gradient(torque, angle)
    law = ca.Function("spring", [angle], [torque, slope, ca.gradient(slope, angle)]).map(len(size))
    grid = np.linspace(0.0, spring.last_angle, 2001)
    known = spring.torque(grid)
    cell = np.clip(np.searchsorted(known, size) - 1, 0, len(grid) - 2)
    at: Array = np.interp(size, known, grid)
    for _ in range(8):  # Newton within the cell of the grid; a cell that it would leave is closed at its edge
        value, rise = (np.array(each).ravel() for each in law(at)[:2])
        at = np.clip(at - (value - size) / np.maximum(rise, 1e-300), grid[cell], grid[cell + 1])
    stiffness, stiffening = (np.array(each).ravel() for each in law(at)[1:])
    secant = np.diff(known) / np.diff(grid)
    used = secant[np.min(cell) : np.max(cell) + 1]
    if np.min(used) < _SOFTEST * most / spring.last_angle or not np.all(stiffness > 0.0):
        worst = float(np.degrees(grid[np.min(cell) + int(np.argmin(used))]))
        raise InfeasibleError(
            f"{type(spring).__name__} at {worst:.3g}°",
            "its stiffness is not positive, or next to zero, so the motor would jump",
            next_step="give the curve a positive slope from angle zero on",
        )
    return at, 1.0 / stiffness, -stiffening / stiffness**3
