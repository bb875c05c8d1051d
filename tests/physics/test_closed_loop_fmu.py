"""The closed torque loop, co-simulated as FMUs and simulated in one piece.

Two roads that share the flat models but neither integrator nor scheduling: FMUs in C (Rosenbrock method,
stepped by a master) against explicit Runge-Kutta steps in Python.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.control import DisturbanceObserver, ScheduledTorque, VelocityLoop

WIRES = {
    "observer.motor.angle": "plant.motor_encoder.reading",
    "observer.motor.current": "controller.motor.current",
    "controller.motor.angle": "plant.motor_encoder.reading",
    "controller.spring.torque": "observer.spring.torque",
    "plant.motor.current": nls.Late("controller.motor.current"),
}


def test_co_simulated_loop_is_that_of_one_piece(tmp_path: Path) -> None:
    actuator = nls.declare(nls.load_deck("austin2015_figure_consistent"))
    plant = nls.flatten(actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
    parts = {"plant": plant, "observer": nls.design_observer(plant, gain=nls.observer.CascadeGain())}
    fmus = {name: nls.export_fmu(model, tmp_path / f"{name}.fmu") for name, model in parts.items()}
    desired = nls.sine("controller.spring.torque.desired", 0.8, 1.0)
    order = ("observer", "controller", "plant")
    scheduled = nls.torque_controller(
        plant, law=ScheduledTorque(), velocity=VelocityLoop(disturbance=DisturbanceObserver())
    )
    # The scheduled law divides by the small stiffness around zero, which enlarges the integration error at
    # the corner of the friction until a count of the encoder falls one sample later: shorter steps there.
    controllers = ((nls.torque_controller(plant), 10), (scheduled, 80))
    for number, (controller, substeps) in enumerate(controllers):
        file = nls.export_fmu(controller, tmp_path / f"controller{number}.fmu")
        together = nls.cosimulate(
            fmus=fmus | {"controller": file}, wires=WIRES, inputs=desired, stop=0.6, order=order
        )
        assert together.delays["plant.motor.current"] == 1
        assert together.delays["controller.spring.torque"] == 0
        encoder = {target: source for target, source in WIRES.items() if "encoder" in source}
        loop = nls.ClosedLoop(**parts, controller=controller, wires=encoder, substeps=substeps)
        whole = loop.run(0.6, inputs=desired)
        for name, nominal in (("plant.spring.torque", 1.0), ("plant.motor.angle", 1.0)):
            apart = np.abs(together[name] - whole[name][: len(together.time)])
            # Both integrators keep 1e-6 of the range over one sample; the stable loop does not let that grow.
            assert np.max(apart) <= 5e-6 * nominal, (name, number)
