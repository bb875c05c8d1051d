"""The published actuator with its printed numbers, and its equations typed by hand for comparison.

The lever arm is not printed; here it is 7 mm·(1 − e^(−θ/0.29)), which gives extensions of 1.5 and 3.6 mm at
25° and 45°, where Fig. 6 of the paper ends at 1.8 and 3.5 mm.
"""

from __future__ import annotations

import numpy as np

from nlsdesign.components import (
    ROTATION,
    Assembly,
    CoulombFriction,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    GearedMotor,
    LinearElastic,
    Regularised,
    Spring,
    StrainStiffening,
    TwoSidedCam,
    ViscousMaterial,
    control_values,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.mechanics.bodies import Body
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.transform import replace_state, with_signal
from nlsdesign.simulation import Trace, simulate

WIRES = {
    "observer.motor.angle": "plant.motor_encoder.reading",
    "controller.motor.angle": "plant.motor_encoder.reading",
}
"""What the encoder of the motor feeds in a closed loop."""

# Austin, Schepelmann, Geyer 2015: A0, L0, k, k*, engaging extensions; two elements share the torque.
AREA, LENGTH, RELAXING = 1e-4, 12.5e-3, 0.58e6
MODULI = np.array([0.92e6, 0.58e6, 0.74e6, 0.77e6, 0.47e6, 1.06e6])
ENGAGING = np.array([0.0, 0.20e-3, 1.06e-3, 2.65e-3, 9.04e-3, 9.05e-3])
ELEMENTS, INERTIA, CONSTANT, DAMPING = 2, 5.97e-4, 0.220, 1e-3
STIFF = AREA / LENGTH
PRINTED, SLOW = 411.0, 31e3  # Pa·s
COUNT = 0.767e-3  # rad, 13 bit encoder

STRAIN = "spring.rubber.relaxing.dashpot.strain"
RELAXING_FORCE = "spring.rubber.relaxing.force"
FORCE = "spring.rubber.force"
EXTENSION = "spring.rubber.extension"
RATE = "spring.rubber.rate"
CONSISTENT = {EXTENSION: f"{EXTENSION}.geometric"}


def lever_arm(angle: np.ndarray) -> np.ndarray:
    return 7e-3 * (1.0 - np.exp(-angle / 0.29))


def actuator(
    viscosity: float = PRINTED, *, load: Body | None = None, friction: float = 0.0, changeover: float = 1e-4
) -> Assembly:
    angles = np.linspace(0.0, 1.6, 400)
    cam = TwoSidedCam(
        lever_arm=control_values(angles, lever_arm(angles), 43),
        last_angle=1.6,
        elements=ELEMENTS,
        changeover=changeover,
    )
    rubber = specimen(
        area=AREA,
        rest_length=LENGTH,
        stiff=StrainStiffening(modulus=tuple(MODULI), knots=tuple(ENGAGING / LENGTH)),
        relaxing=series(spring=LinearElastic(modulus=RELAXING), dashpot=ViscousMaterial(viscosity=viscosity)),
    )
    parts = {
        "motor": GearedMotor(inertia=INERTIA, gear_ratio=4.0, torque_constant=CONSTANT / 4.0),
        "load": load or Fixed(),
        "spring": tie(through(cam, rubber=rubber), "motor", "load"),
        "bearing": tie(Dashpot(damping=DAMPING, domain=ROTATION), "motor"),
        "motor_encoder": Encoder(of="motor.angle", quantum=COUNT),
    }
    if friction:
        parts["dry_friction"] = tie(
            CoulombFriction(sliding_effort=friction, contact=Regularised(creep_speed=0.02)), "motor"
        )
    return assembly("published", **parts)


def linear_actuator(stiffness: float, *, moved: bool = False) -> FlatModel:
    """Return the actuator with a linear spring in place of cam and rubber; its load held or moved."""
    parts = dict(actuator().parts) | {
        "spring": tie(Spring(stiffness=stiffness, domain=ROTATION), "motor", "load")
    }
    if moved:
        parts["load"] = Driven()
    return flatten(assembly("linear", **parts), outputs=["motor.angle", "spring.torque"])


def bench(viscosity: float = PRINTED, **options: float) -> FlatModel:
    """The actuator on the bench; inner state: strain of the dashpot."""
    return flatten(actuator(viscosity, **options), outputs=["motor.angle", "spring.torque"])


def on_relaxing_force(model: FlatModel) -> FlatModel:
    """The same with the relaxing force of one element, in N, as inner state."""
    force = Variable(RELAXING_FORCE, "N", "force of the relaxing branch of one element")
    named = with_signal(model, force, lambda n: n["spring.rubber.area"] * n["spring.rubber.relaxing.stress"])
    return replace_state(named, STRAIN, RELAXING_FORCE)


def servoed(viscosity: float, frequency: float, amplitude: float, *, duration: float = 1.0) -> Trace:
    """The spring turned by a sine of the angle, sampled at 1 kHz."""
    parts = {n: Driven() if n == "motor" else p for n, p in actuator(viscosity).parts}
    kept = {n: parts[n] for n in ("motor", "load", "spring")}
    model = flatten(assembly("servoed", **kept), outputs=["spring.torque"])
    omega, fine = 2.0 * np.pi * frequency, np.arange(0.0, duration, 5e-5)
    inputs = {
        "motor.angle": amplitude * np.sin(omega * fine),
        "motor.speed": amplitude * omega * np.cos(omega * fine),
    }
    trace = simulate(model, fine, inputs=inputs).at(fine[::20])
    return trace.with_signals({"motor.current": np.zeros(len(trace.time))}, {"motor.current": "A"})


# --- typed by hand --------------------------------------------------------------------------------


def equilibrium_force(extension: float) -> float:
    return STIFF * float(np.sum(MODULI * np.maximum(extension - ENGAGING, 0.0)))


def stiffness(extension: float) -> float:
    return STIFF * float(np.sum(MODULI * (extension >= ENGAGING)))


def published_matrices(extension: float, arm: float, viscosity: float) -> tuple[np.ndarray, np.ndarray]:
    """A and C of (F, δ, θ, ω), y = (δ, θ), at a measured angle: corrected equations (3) and (4)."""
    a = np.zeros((4, 4))
    a[0, 0] = -RELAXING / viscosity
    a[0, 1] = RELAXING / viscosity * stiffness(extension)
    a[2, 3] = 1.0
    a[3, 0] = -ELEMENTS * arm / INERTIA
    a[3, 3] = -DAMPING / INERTIA
    return a, np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
