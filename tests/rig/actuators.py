"""Four made-up actuators with cam and rubber: what their makers declare, and what was really built.

All numbers are invented for the tests.  The cams are formulas, the tables written for the makers are samples
of them:

``arm``       δ(θ) = R (θ + α (1 − cos θ)),      h(θ) = R (1 + α sin θ):   lever arm jumps to R at θ = 0+
``wrist``     δ(θ) = R θ₀ ln cosh(θ / θ₀),        h(θ) = R tanh(θ / θ₀):    lever arm starts at zero
``elbow``     h(θ) = R (1 + a exp(−θ/w) + g sin²(cθ)): falls from its largest value, then grows again
``shoulder``  δ(θ) = R (θ + β θ²/2),              h(θ) = R (1 + β θ):       lever arm grows with the angle

All have h > 0 for θ > 0, so the extension grows with the angle, and h = dδ/dθ exactly.  ``elbow`` has the
sensors, motions, forces and currents of the practice records; ``shoulder`` is slower, stronger and measured
400 times a second by other sensors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

Curve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Rubber:
    """Strain-stiffening spring beside a Maxwell branch.

    With a = area / length: F* = a Σ kᵢ* ⟨δ − δᵢ⟩ and dM/dt = a k dδ/dt − (k/η) M, force F* + M.
    """

    area: float  # m²
    length: float  # m
    k_star: tuple[float, ...]  # Pa
    engage: tuple[float, ...]  # m, extensions δᵢ; multiples of 0.01 mm
    k: float  # Pa
    eta: float  # Pa·s
    buckles: bool = True  # instead of pushing, its end goes on following the cam; else its cable goes slack

    @property
    def shape(self) -> float:
        """Area by length a, m."""
        return self.area / self.length

    @property
    def relaxation_time(self) -> float:
        """η / k, s."""
        return self.eta / self.k

    def equilibrium(self, extension: np.ndarray) -> np.ndarray:
        """Force after complete relaxation, N; below zero the first spring goes on in compression."""
        past = np.maximum(np.asarray(extension)[..., None] - np.array(self.engage), 0.0)
        compressed = self.k_star[0] * np.minimum(extension, 0.0)
        force: np.ndarray = self.shape * (past @ np.array(self.k_star) + compressed)
        return force


@dataclass(frozen=True)
class Drivetrain:
    """Motor and gear, seen from the cam."""

    inertia: float  # kg·m², motor side and cam side together
    cam_share: float  # part of it on the cam side
    gear_ratio: float
    torque_constant: float  # N·m/A at the motor shaft
    viscosity: float  # N·m·s/rad at the motor side

    @property
    def torque_per_ampere(self) -> float:
        """Gear ratio times torque constant, N·m/A."""
        return self.gear_ratio * self.torque_constant


@dataclass(frozen=True)
class Cam:
    """Extension and lever arm over the angle θ ≥ 0; δ is even, h odd in θ."""

    extension: Curve  # m
    lever_arm: Curve  # m/rad
    last_angle: float  # rad, end of the table that the makers hand out
    rows: int


@dataclass(frozen=True)
class Sensors:
    """What the declaration says about the sensors."""

    counts: int = 8192  # per turn
    current_noise: float = 0.04  # A
    force_noise: float = 0.6  # N
    sample_rate: float = 500.0  # Hz

    @property
    def angle_quantum(self) -> float:
        """One encoder count, rad."""
        return 2.0 * np.pi / self.counts


@dataclass(frozen=True)
class Actuator:
    """Everything that the makers declare."""

    name: str
    rubber: Rubber
    drivetrain: Drivetrain
    cam: Cam
    sensors: Sensors
    ripple_order: int  # periods of a torque ripple per turn of the cam, should there be one


def _arm_cam() -> Cam:
    radius, growth = 0.010, 0.6
    return Cam(
        extension=lambda angle: radius * (angle + growth * (1.0 - np.cos(angle))),
        lever_arm=lambda angle: radius * (1.0 + growth * np.sin(angle)),
        last_angle=np.radians(58.0),
        rows=233,
    )


def _wrist_cam() -> Cam:
    radius, width = 0.013, 0.2
    return Cam(
        # ln cosh x = x + ln(1 + exp(−2x)) − ln 2 does not overflow
        extension=lambda angle: (
            radius * width * (angle / width + np.log1p(np.exp(-2.0 * angle / width)) - np.log(2.0))
        ),
        lever_arm=lambda angle: radius * np.tanh(angle / width),
        last_angle=np.radians(56.0),
        rows=225,
    )


def _elbow_cam() -> Cam:
    radius, peak, width, growth, turn = 0.0113, 0.32, 0.035, 0.40, 1.75
    return Cam(
        extension=lambda angle: (
            radius
            * (
                angle
                - peak * width * np.expm1(-angle / width)
                + growth * (0.5 * angle - np.sin(2.0 * turn * angle) / (4.0 * turn))
            )
        ),
        lever_arm=lambda angle: (
            radius * (1.0 + peak * np.exp(-angle / width) + growth * np.sin(turn * angle) ** 2)
        ),
        last_angle=np.radians(56.0),
        rows=201,
    )


def _shoulder_cam() -> Cam:
    radius, growth = 0.018, 0.35
    return Cam(
        extension=lambda angle: radius * (angle + 0.5 * growth * angle**2),
        lever_arm=lambda angle: radius * (1.0 + growth * angle),
        last_angle=np.radians(60.0),
        rows=121,
    )


ARM = Actuator(
    name="arm",
    rubber=Rubber(
        area=9.0e-5,
        length=0.015,
        k_star=(1.10e6, 5.0e5, 6.5e5, 9.0e5, 6.0e5, 8.0e5),
        engage=(0.0, 3.0e-4, 1.4e-3, 3.2e-3, 6.0e-3, 8.2e-3),
        k=7.0e5,
        eta=3.0e4,
    ),
    drivetrain=Drivetrain(
        inertia=0.012, cam_share=0.12, gear_ratio=36.0, torque_constant=0.0245, viscosity=0.020
    ),
    cam=_arm_cam(),
    sensors=Sensors(),
    ripple_order=18,
)

WRIST = Actuator(
    name="wrist",
    rubber=Rubber(
        area=1.5e-4,
        length=0.020,
        k_star=(6.0e5, 4.5e5, 8.0e5, 5.0e5),
        engage=(0.0, 8.0e-4, 2.5e-3, 5.0e-3),
        k=4.0e5,
        eta=9.0e3,
    ),
    drivetrain=Drivetrain(
        inertia=0.005, cam_share=0.1, gear_ratio=18.0, torque_constant=0.035, viscosity=0.008
    ),
    cam=_wrist_cam(),
    sensors=Sensors(current_noise=0.03, force_noise=0.4),
    ripple_order=27,
)

ELBOW = Actuator(
    name="elbow",
    rubber=Rubber(
        area=1.05e-4,
        length=0.0130,
        k_star=(8.8e5, 6.2e5, 7.0e5, 7.4e5, 5.2e5, 1.1e6),
        engage=(0.0, 2.5e-4, 1.2e-3, 2.8e-3, 7.5e-3, 9.2e-3),
        k=6.2e5,
        eta=2.1e4,
    ),
    drivetrain=Drivetrain(
        inertia=0.0095, cam_share=0.1, gear_ratio=25.0, torque_constant=0.0310, viscosity=0.013
    ),
    cam=_elbow_cam(),
    sensors=Sensors(),
    ripple_order=14,
)

SHOULDER = Actuator(
    name="shoulder",
    rubber=Rubber(
        area=3.2e-4,
        length=0.040,
        k_star=(4.5e5, 3.0e5, 5.5e5),
        engage=(0.0, 2.0e-3, 8.0e-3),
        k=3.0e5,
        eta=2.4e4,
    ),
    drivetrain=Drivetrain(
        inertia=0.030, cam_share=0.15, gear_ratio=48.0, torque_constant=0.042, viscosity=0.050
    ),
    cam=_shoulder_cam(),
    sensors=Sensors(counts=4096, current_noise=0.02, force_noise=0.9, sample_rate=400.0),
    ripple_order=21,
)

ACTUATORS = {actuator.name: actuator for actuator in (ARM, WRIST, ELBOW, SHOULDER)}


def with_slack_cable(actuator: Actuator) -> Actuator:
    """The same with rubber that is on its own while its cable is slack."""
    return replace(actuator, rubber=replace(actuator.rubber, buckles=False))


def as_built(declared: Actuator, draw: np.random.Generator) -> Actuator:
    """The actuator that stands on the bench: its numbers lie within the declared spread.

    With u uniform in (−1, 1), drawn anew for each number: value · (1 + 0.06 u) for every k*, for k, J and the
    torque per ampere, value · 1.3ᵘ for η and value · 1.6ᵘ for b.  Geometry and noise are as declared.
    """
    rubber, drivetrain = declared.rubber, declared.drivetrain
    u = draw.uniform(-1.0, 1.0, size=5)
    stiffnesses = 1.0 + 0.06 * draw.uniform(-1.0, 1.0, size=len(rubber.k_star))
    return replace(
        declared,
        rubber=replace(
            rubber,
            k_star=tuple(float(k * f) for k, f in zip(rubber.k_star, stiffnesses, strict=True)),
            k=float(rubber.k * (1.0 + 0.06 * u[0])),
            eta=float(rubber.eta * 1.3 ** u[1]),
        ),
        drivetrain=replace(
            drivetrain,
            inertia=float(drivetrain.inertia * (1.0 + 0.06 * u[2])),
            torque_constant=float(drivetrain.torque_constant * (1.0 + 0.06 * u[3])),
            viscosity=float(drivetrain.viscosity * 1.6 ** u[4]),
        ),
    )
