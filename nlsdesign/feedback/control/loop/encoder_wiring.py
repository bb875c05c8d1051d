"""The closed loop of an actuator as its encoders see it, wired by structure."""

from __future__ import annotations

from ....model import FlatModel, Variable
from ....model.roles import moved_load, series_spring
from ....model.transform import with_signal
from ....simulation.sampled_batch import PLANT
from ..laws.torque_loop import loop_names
from .closed_loop import CONTROLLER, OBSERVER, ClosedLoop

DEFLECTION = "measured"
"""What is added to the name of the spring's motion for what the encoders at both ends read of it."""


def encoder_loop(
    plant: FlatModel, *, observer: FlatModel, controller: FlatModel, delay: int = 1, substeps: int = 10
) -> ClosedLoop:
    """Return the closed loop in which observer and controller read encoders where the plant has them.

    The controller reads the motor. The observer reads the motor where the load is fixed, and the difference
    of motor and load where the motion of the load is prescribed. An angle without a sensor is taken as it is.

    Parameters
    ----------
    plant
        Continuous.
    observer, controller
        Discrete, designed on the plant with its load fixed.
    delay
        Samples between a current's computation and its effect.
    substeps
        Integration steps of the plant per sample.

    Raises
    ------
    ArrangementError
        If several loads are moved.
    """
    angle = loop_names(plant).angle
    motor = _read(plant, angle)
    deflection = motor
    if any(body.prescribed for body in plant.bodies):
        load = _read(plant, moved_load(plant).motion)
        spring = plant.variable(series_spring(plant).motion)
        deflection = f"{spring.name}.{DEFLECTION}"
        shown = Variable(deflection, spring.unit, "deflection of the spring as it is read")
        plant = with_signal(plant, shown, lambda known: known[motor] - known[load])
    wires = {f"{OBSERVER}.{angle}": f"{PLANT}.{deflection}", f"{CONTROLLER}.{angle}": f"{PLANT}.{motor}"}
    inputs = {OBSERVER: observer, CONTROLLER: controller}
    present = {f"{owner}.{v.name}" for owner, model in inputs.items() for v in model.inputs}
    wires = {name: source for name, source in wires.items() if name in present}
    return ClosedLoop(
        plant=plant, observer=observer, controller=controller, wires=wires, delay=delay, substeps=substeps
    )


def _read(plant: FlatModel, motion: str) -> str:
    """Return the first sensor that reads a motion, or the motion itself."""
    readings = [r.signal for r in plant.readings if r.measured == motion and r.sensors]
    return readings[0] if readings else motion
