"""The bench: servo, motor side, cam side, friction and gear backlash, by non-smooth time stepping.

    Jₘ dωₘ/dt = T I − b ωₘ + disturbance − ripple − friction − contact
    J_c dω_c/dt = contact − h(θ_c) F           I = clip(k_P (θ* − θₘ) + k_D (θ̇* − ωₘ), ±I_max)

Friction and contact are set-valued (Coulomb: any torque up to the level at standstill; unilateral stops).
They are never written as functions of speed or penetration: each step advances momentum freely and then finds
the impulse that satisfies the law at the end of the step (Moreau 1988, Unilateral contact and dry friction in
finite freedom dynamics),

    ω⁺ = prox(ω_free) = sign(ω_free) max(|ω_free| − level Δt/J, 0)

with the step Δt, so a stuck drive has exactly zero speed.  Without backlash both sides are one inertia.
A stop at the end of the cam takes all speed.
Positions follow with the new speed (leapfrog).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import copysign, exp, sin
from typing import Any, TypeVar

import numpy as np

from .actuators import Actuator, Cam, Drivetrain
from .commands import STEP, Command
from .effects import Hidden
from .faults import acting_current, capstan
from .rubber import pull_of

Numbers = TypeVar("Numbers", bound=Any)

SERVO_BANDWIDTH = 75.0  # rad/s
SERVO_DAMPING = 0.8
CURRENT_LIMIT = 12.0  # A
CAM_GRID = 5.0e-4  # rad
CONTROLLED = round(1.0e-3 / STEP)  # steps from one call of a controller to the next
CAM_END = 1.35  # rad; records end before, a machine that hunts is stopped here
SPOT_PLACE, SPOT_WIDTH = 0.25, 0.06  # rad, of the rubbing spot
BUMP_PLACE, BUMP_WIDTH = 0.4, 0.15  # rad, of the error of the contour


@dataclass(frozen=True)
class Servo:
    """PD servo on the angle of the motor side, tuned on the declared numbers."""

    stiffness: float  # A/rad
    damping: float  # A·s/rad
    limit: float = CURRENT_LIMIT  # A

    @classmethod
    def for_actuator(cls, declared: Actuator) -> Servo:
        """k_P = J Ω² / T, k_D = 2 ζ J Ω / T."""
        gain = declared.drivetrain.inertia * SERVO_BANDWIDTH / declared.drivetrain.torque_per_ampere
        return cls(stiffness=gain * SERVO_BANDWIDTH, damping=2.0 * SERVO_DAMPING * gain)


@dataclass(frozen=True)
class History:
    """True signals at every step of the simulation, arrays of shape (n,)."""

    time: np.ndarray  # s
    motor_angle: np.ndarray  # rad
    cam_angle: np.ndarray  # rad
    motor_speed: np.ndarray  # rad/s, half a step before the angle
    current: np.ndarray  # A
    force: np.ndarray  # N, cable
    extension: np.ndarray  # m, rubber
    torque: np.ndarray  # N·m, of the cable on the cam


def _cam_tables(cam: Cam, bump: float) -> tuple[list[float], list[float]]:
    """δ and h on the grid; δ is the exact integral of the linearly interpolated h, with its bump."""
    angles = np.arange(round(CAM_END / CAM_GRID) + 2) * CAM_GRID
    lever_arm = np.asarray(cam.lever_arm(angles)) + bump * np.exp(
        -(((angles - BUMP_PLACE) / BUMP_WIDTH) ** 2)
    )
    steps = 0.5 * CAM_GRID * (lever_arm[1:] + lever_arm[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)]).tolist(), lever_arm.tolist()


def friction_level(hidden: Hidden) -> Callable[[float, float, float], float] | None:
    """Level of dry friction (N·m) from speed, angle and spring torque; None where there is none."""
    usual = hidden.friction or hidden.breakaway or hidden.load_friction or hidden.spot_friction
    if not (usual or hidden.place_friction):
        return None
    base, rise, slow = hidden.friction, hidden.breakaway, hidden.stribeck_speed
    share, spot = hidden.load_friction, hidden.spot_friction
    varying, phase = hidden.place_friction, hidden.place_phase

    def level(speed: float, angle: float, load: float) -> float:
        total = base + share * abs(load)
        if rise:
            total += rise * exp(-((speed / slow) ** 2))
        if spot:
            total += spot * exp(-(((angle - SPOT_PLACE) / SPOT_WIDTH) ** 2))
        if varying:
            total += varying * (1.0 + 0.8 * sin(2.0 * angle + phase))
        return total

    return level


def plain(machine: Numbers) -> Numbers:
    """The same numbers as Python's: drawn ones are NumPy's, with which a loop takes twice as long."""
    return replace(machine, **{n: float(v) for n, v in vars(machine).items() if isinstance(v, float)})


def prox(speed: float, threshold: float) -> float:
    """Speed after dry friction that can change it by at most the threshold."""
    if speed > threshold:
        return speed - threshold
    if speed < -threshold:
        return speed + threshold
    return 0.0


def _gear_backlash(drive: Drivetrain, gap: float) -> Callable[..., tuple[float, float]]:
    """Step of the speeds of motor side and cam side with a gap between stops at ±gap/2, perfectly plastic.

    First free flight; where that would pass a stop, both sides take the speed difference `closing` that ends
    at the stop, and conserve their momentum together.
    """
    cam_inertia = drive.cam_share * drive.inertia
    motor_inertia = drive.inertia - cam_inertia
    half = 0.5 * gap

    def advance(
        speed: float, cam_speed: float, lead: float, push: float, load: float, friction: float
    ) -> tuple[float, float]:
        free = prox(speed + STEP * push / motor_inertia, friction / motor_inertia)
        flight = cam_speed - STEP * load / cam_inertia
        closing = min(max(free - flight, (-half - lead) / STEP), (half - lead) / STEP)
        if closing == free - flight:
            return free, flight
        momentum = motor_inertia * speed + STEP * push + cam_inertia * (flight + closing)
        together = prox(momentum / drive.inertia, friction / drive.inertia)
        return together, together - closing

    return advance


def _feeds(servo: Servo, hidden: Hidden, command: Command) -> Iterator[tuple[float, float, float]]:
    """Step by step: current that the command fixes (A), disturbing torque (N·m), angle of the load (rad)."""
    feed = servo.stiffness * command.angle + servo.damping * command.speed
    turns = hidden.disturbance_frequency * command.time
    push = hidden.disturbance * np.sin(2.0 * np.pi * turns + hidden.disturbance_phase)
    slow = 2.0 * np.pi * hidden.slow_frequency * command.time + hidden.slow_phase
    push += hidden.slow_load * np.sin(slow) + hidden.constant_torque
    since = (command.time - hidden.push_place * command.time[-1]) / hidden.push_time
    push += hidden.push * np.where((since > 0.0) & (since < 1.0), np.sin(np.pi * since), 0.0)
    load = hidden.shake * np.sin(2.0 * np.pi * hidden.shake_frequency * command.time)
    return zip(feed.tolist(), push.tolist(), (load + hidden.cam_offset).tolist(), strict=True)


def simulate(
    built: Actuator,
    hidden: Hidden,
    servo: Servo,
    command: Command,
    controller: Callable[[float, float], float] | None = None,
) -> History:
    """Run one record from rest.

    A controller, where there is one, takes the place of the servo: every millisecond it is given time (s) and
    angle of the motor (rad), and its current (A) is held to the next.
    """
    drive = built.drivetrain
    per_ampere, viscosity, inertia = drive.torque_per_ampere, drive.viscosity, drive.inertia
    k_p, k_d, limit = servo.stiffness, servo.damping, servo.limit
    delta, lever = _cam_tables(built.cam, hidden.profile_error)
    pull = pull_of(built.rubber, hidden, STEP, round(hidden.cold_place * command.time.size))
    level = friction_level(hidden)
    backlash = _gear_backlash(drive, hidden.gap) if hidden.gap else None
    ripple, order, phase = hidden.ripple, hidden.ripple_order, hidden.ripple_phase
    stop, stop_place, weight = hidden.stop, hidden.stop_place, hidden.weight
    act, pass_on, drag, per_grid = acting_current(hidden), capstan(hidden), hidden.drag, 1.0 / CAM_GRID
    motor = cam = speed = cam_speed = friction = 0.0
    rows: list[tuple[float, ...]] = []
    held = 0.0

    for wanted, push, offset in _feeds(servo, hidden, command):
        angle = cam - offset
        place = abs(angle) * per_grid
        j = int(place)
        part = place - j
        left = lever[j]
        arm = left + part * (lever[j + 1] - left)
        asked = delta[j] + 0.5 * part * CAM_GRID * (left + arm)
        force, extension = pull(asked)
        at_cam = force if pass_on is None else pass_on(force, asked)
        load = arm * at_cam if angle >= 0.0 else -arm * at_cam
        current = wanted - k_p * motor - k_d * speed
        if controller is not None:
            if len(rows) % CONTROLLED == 0:
                held = controller(len(rows) * STEP, motor)
            current = held
        if not -limit <= current <= limit:
            current = limit if current > 0.0 else -limit
        rows.append((motor, cam, speed, current, force, extension, load))

        push += per_ampere * (current if act is None else act(current)) - viscosity * speed
        if drag:
            push -= drag * speed * abs(speed)
        if ripple:
            push -= ripple * sin(order * motor + phase)
        if weight:
            push -= weight * sin(motor)
        if stop and abs(motor) > stop_place:
            way = abs(motor) - stop_place
            push -= stop * way * way if motor > 0.0 else -stop * way * way
        if level is not None:
            friction = STEP * level(speed, motor, load)
        if backlash is not None:
            speed, cam_speed = backlash(speed, cam_speed, motor - cam, push, load, friction)
            motor += STEP * speed
            cam += STEP * cam_speed
        else:
            speed = prox(speed + STEP * (push - load) / inertia, friction / inertia)
            cam = motor = motor + STEP * speed
        if not -CAM_END <= cam - offset <= CAM_END:
            back = copysign(CAM_END, cam - offset) + offset - cam
            motor, cam, speed, cam_speed = motor + back, cam + back, 0.0, 0.0
    return History(command.time, *np.array(rows).T)
