"""Generated code of the published actuator: C, FMUs, and the closed torque loop that they make."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.export import CSource, Wire
from nlsdesign.feedback.control import ScheduledTorque, joined
from nlsdesign.foundation.arrays import Array

READING = "plant.motor_encoder.reading"
FROM_ENCODER = {"observer.motor.angle": READING, "controller.motor.angle": READING}
WIRES: dict[str, str | Wire] = {
    **FROM_ENCODER,
    "observer.motor.current": "controller.motor.current",
    "controller.spring.torque": "observer.spring.torque",
    "plant.motor.current": nls.Late("controller.motor.current"),  # one sample to compute
}


@dataclass(frozen=True, eq=False)
class Cosimulated:
    """The closed loop as FMUs.

    Parameters
    ----------
    fmus
        Of plant, observer and controller, and of the plant in FMI 2.
    trace
        The loop of FMUs.
    whole
        The same loop simulated in one piece.
    """

    fmus: tuple[Path, ...]
    trace: nls.Trace
    whole: nls.Trace

    @property
    def difference(self) -> Array:
        """Torque of the co-simulated plant less that of the plant in one piece, in N·m, shape (n,)."""
        torque = np.interp(self.trace.time, self.whole.time, self.whole["plant.spring.torque"])
        return self.trace["plant.spring.torque"] - torque


@dataclass(frozen=True, eq=False)
class TorqueLoop:
    """Generated files, and the closed loop co-simulated and in one piece.

    Parameters
    ----------
    source, controller, both
        C files of observer, controller, and both as one step.
    cosimulated
        Its FMUs and how they run, where that was wanted.
    """

    source: CSource
    controller: CSource
    both: CSource
    cosimulated: Cosimulated | None

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed number, by name."""
        if self.cosimulated is None:
            return {}
        return {"cosimulation_difference_Nm": float(np.max(np.abs(self.cosimulated.difference)))}


def export_and_cosimulate(
    model: nls.FlatModel, observer: nls.FlatModel, out: Path, stop: float | None
) -> TorqueLoop:
    """Write C and FMUs, co-simulate the closed loop, and simulate the same loop in one piece.

    ``stop``: in s; without one there is C and nothing else.
    """
    controller = nls.torque_controller(model, law=ScheduledTorque())
    parts = {"plant": model, "observer": observer, "controller": controller}
    source = nls.export_c(observer, out / "c", name="observer")
    law = nls.export_c(controller, out / "c", name="controller")
    both = nls.export_c(joined(observer, controller), out / "c", name="torque_loop")
    if stop is None:
        return TorqueLoop(source, law, both, None)
    fmus = {name: nls.export_fmu(each, out / "fmu" / f"{name}.fmu") for name, each in parts.items()}
    second = nls.export_fmu(model, out / "fmu" / "plant_fmi2.fmu", version="2.0")
    desired = nls.sine("controller.spring.torque.desired", 0.8, 1.0)
    order = ("observer", "controller", "plant")
    run = nls.cosimulate(fmus=fmus, wires=WIRES, order=order, stop=stop, inputs=desired)
    loop = nls.ClosedLoop(plant=model, observer=observer, controller=controller, wires=FROM_ENCODER)
    whole = loop.run(stop, inputs=desired)
    return TorqueLoop(source, law, both, Cosimulated((*fmus.values(), second), run.trace, whole))
