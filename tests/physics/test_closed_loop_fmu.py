"""The closed torque loop, co-simulated as FMUs and simulated in one piece.

Two roads that share the flat models but neither integrator nor scheduling: FMUs in C (Rosenbrock method,
stepped by a master) against explicit Runge-Kutta steps in Python.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.feedback.control import DisturbanceObserver, PidTorque, ScheduledTorque, VelocityLoop

WIRES = {
    "observer.motor.angle": "plant.motor_encoder.reading",
    "observer.motor.current": "controller.motor.current",  # stands later in the order: its last sample
    "controller.motor.angle": "plant.motor_encoder.reading",
    "controller.spring.torque": "observer.spring.torque",
    "plant.motor.current": nls.Late("controller.motor.current"),
}
ORDER = ("observer", "controller", "plant")


STEPS = (1e-3, 2.5e-4)


@pytest.fixture(scope="module")
def models() -> dict[str, nls.FlatModel]:
    actuator = nls.declare(nls.load_deck("austin2015_figure_consistent"))
    plant = nls.flatten(actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
    return {"plant": plant, "observer": nls.design_observer(plant, gain=nls.observer.CascadeGain())}


@pytest.fixture(scope="module")
def fmus(models: dict[str, nls.FlatModel], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {name: nls.export_fmu(model, folder / f"{name}.fmu") for name, model in models.items()}


# The scheduled law divides by the small stiffness around zero, which enlarges the integration error at the
# corner of the friction until a count of the encoder falls one sample later: shorter steps there.
@pytest.mark.long_cases("scheduled", "PID")
@pytest.mark.parametrize(("scheduled", "substeps"), [(False, 40), (True, 320)], ids=["PID", "scheduled"])
def test_co_simulated_loop_is_that_of_one_piece_at_every_step(
    scheduled: bool, substeps: int, models: dict[str, nls.FlatModel], fmus: dict[str, Path], tmp_path: Path
) -> None:
    """Row by row: torque and angle, and what is sampled, at its own time.

    The desired torque is not zero at the start, so that it matters what is there before the first sample.
    """
    velocity = VelocityLoop(disturbance=DisturbanceObserver())
    law = {"law": ScheduledTorque(), "velocity": velocity} if scheduled else {"law": PidTorque()}
    controller = nls.torque_controller(models["plant"], **law)
    given = fmus | {"controller": nls.export_fmu(controller, tmp_path / "controller.fmu")}
    desired = nls.sine("controller.spring.torque.desired", 0.6, 1.0, offset=0.2)
    encoder = {target: source for target, source in WIRES.items() if "encoder" in str(source)}
    loop = nls.ClosedLoop(**models, controller=controller, wires=encoder, substeps=substeps)
    whole = loop.run(0.15, inputs=desired)
    for step in STEPS:
        run = nls.cosimulate(fmus=given, wires=WIRES, inputs=desired, stop=0.15, order=ORDER, step=step)
        assert run.step == step
        assert run.delays["plant.motor.current"] == loop.sample_time
        assert run.delays["controller.spring.torque"] == 0.0
        assert not run.errors
        rows = np.round(whole.time / step).astype(int)
        np.testing.assert_allclose(run.time[rows], whole.time, atol=1e-12)
        for name, bound in (
            ("plant.spring.torque", 1e-6),
            ("plant.motor.angle", 1e-6),
            ("plant.motor.current", 1e-5),
            ("observer.spring.torque", 1e-5),
            ("observer.motor.current", 1e-5),
            ("controller.motor.current", 1e-5),
        ):
            assert np.ptp(whole[name]) > 0.1
            assert np.max(np.abs(run[name][rows] - whole[name])) <= bound, (name, step)
        # What is sampled differs from one row to the next by far more: rows are not shifted.
        shifted = run["controller.motor.current"][rows][1:] - whole["controller.motor.current"][:-1]
        assert np.max(np.abs(shifted)) > 0.1
