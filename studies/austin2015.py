"""The published cam-rubber actuator, from deck to report.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015. The deck is the figure-consistent one; where it departs from the printed numbers, it
says why.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls

from ._austin2015_bench import diagnosed
from ._austin2015_loop import exported
from ._austin2015_measured import compare_with_figures
from ._austin2015_pages import write_pages

DECK = "austin2015_figure_consistent"
FREE = ("spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length")


def main(out: Path, fast: bool = False, steps: Any = None) -> dict[str, float]:
    """Run every station of the workbench and write ``report.html`` with all that was made beside it.

    Parameters
    ----------
    out
        Folder for everything.
    fast
        Shorter runs and fewer angles, for a first look.
    steps
        Shows progress; see ``nlsdesign.progress``.
    """
    steps = steps or nls.progress.Steps()
    done: dict[str, Any] = {"out": out}
    with steps.step("deck, assembly, flat model"):
        done["actuator"] = actuator = nls.models.cam_rubber_actuator(nls.load_deck(DECK))
        done["model"] = model = nls.flatten(
            actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"]
        )
        nls.write_deck(actuator, out / "actuator.toml")
    with steps.step("joint design of cam, pretension and rubber"):
        done["design"] = joint_design(actuator, out)
    with steps.step("model against the figures of the paper"):
        done["figures"] = compare_with_figures(actuator)
    with steps.step("observability over the cam angle"):
        done["chart"] = over_the_angle(model, 19 if fast else 61)
    with steps.step("observers, on the bench and with the load free"):
        done |= observers(actuator, model, 2.0 if fast else 5.0)
    with steps.step("C code, FMUs and their co-simulation"):
        done |= exported(model, done["observer"], out, 1.0 if fast else 3.0)
    with steps.step("diagnosis of the bench records"):
        done["verdict"] = diagnosed(actuator, out, steps)
    with steps.step("report"):
        return write_pages(done)


def joint_design(actuator: Any, out: Path) -> Any:
    """Design for the torque curve of 2014, 5 N·m at 53°, and write deck and drawings."""
    design = nls.design_cam(
        actuator,
        target=nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0),
        free=FREE,
        keep=[
            nls.MinimumRadiusOfCurvature(1e-3),
            nls.MaximumCamRadius(20e-3),
            nls.MaximumStrain(1.0),
            nls.RestLengthRange(8e-3, 20e-3),
        ],
    )
    nls.write_drawings(out / "drawing", design.contour, note=f"design {design.fingerprint}")
    nls.write_deck(design.actuator, out / "designed.toml")
    return design


def over_the_angle(model: Any, count: int) -> Any:
    """Look at observability and stability from −50° to 50°."""
    angles = np.radians(np.linspace(-50.0, 50.0, count))
    seen = nls.with_outputs(model, ["motor.angle", "spring.torque"])
    return nls.over_angle(
        seen, [nls.Observability(measured=("motor.angle",)), nls.Stability()], angles=angles
    )


def observers(actuator: Any, model: Any, stop: float) -> dict[str, Any]:
    """Design both observers and let them watch the bench and the free drivetrain through the encoder."""
    observer, published = (
        nls.design_observer_with_details(model),
        nls.design_observer_with_details(model, form=nls.PaperForm()),
    )
    time = np.arange(0.0, stop, observer.step.sample_time)
    loose = actuator.with_part(
        "load", nls.Inertia(inertia=nls.Quantity(2e-3, "kg*m^2", "assumed: a light link"))
    )
    free = nls.flatten(loose, inputs=["motor.current"])
    bench = nls.simulate(model, time, inputs=nls.sine("motor.current", 6.0, 2.0), hold=True)
    seen = {"motor.angle": "motor_encoder.reading"}
    wrong = {"spring.rubber.relaxing.dashpot.strain.memory": 0.05}
    return {
        "observer": observer,
        "bench": bench,
        "free": nls.simulate(free, time, inputs=nls.sine("motor.current", 0.5, 2.0), hold=True),
        "watched": {
            "minimal form": nls.observe(observer.model, bench, readings=seen, start=wrong),
            "published form": nls.observe(published.model, bench, readings=seen),
        },
    }
