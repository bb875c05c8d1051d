"""Generated code of the published actuator: C, FMUs, and the closed loop that they make."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nlsdesign as nls

WIRES = {
    "observer.motor.angle": "plant.motor_encoder.reading",
    "observer.motor.current": "controller.motor.current",
    "controller.motor.angle": "plant.motor_encoder.reading",
    "controller.spring.torque": "observer.spring.torque",
    "plant.motor.current": nls.Late("controller.motor.current"),  # one sample to compute
}


def exported(model: Any, observer: Any, out: Path, stop: float) -> dict[str, Any]:
    """Write C and FMUs, co-simulate the closed loop, and simulate the same loop in one piece."""
    controller = nls.torque_controller(model)
    parts = {"plant": model, "observer": observer.model, "controller": controller}
    source = nls.export_c(observer.model, out / "c", name="observer")
    fmus = {name: nls.export_fmu(each, out / "fmu" / f"{name}.fmu") for name, each in parts.items()}
    older = nls.export_fmu(model, out / "fmu" / "plant_fmi2.fmu", version="2.0")
    desired = nls.sine("controller.spring.torque.desired", 0.8, 1.0)
    run = nls.cosimulate(
        fmus=fmus,
        wires=WIRES,
        order=("observer", "controller", "plant"),
        stop=stop,
        inputs=desired,
    )
    loop = nls.ClosedLoop(
        **parts, wires={k: v for k, v in WIRES.items() if v == "plant.motor_encoder.reading"}
    )
    whole = loop.run(stop, inputs=desired)
    return {"source": source, "fmus": [*fmus.values(), older], "run": run, "whole": whole}
