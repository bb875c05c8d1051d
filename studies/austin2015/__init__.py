"""The published cam-rubber actuator, from deck to report.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015. The deck is the figure-consistent one; where it departs from the printed numbers, it
states why.
"""

from __future__ import annotations

from pathlib import Path

import nlsdesign as nls

from .._published import declared_actuator
from .design import design_spring
from .diagnosis import diagnose_bench
from .figures import compare_with_figures
from .observer import compare_observers, sweep_angle
from .report import write_page
from .results import Results
from .torque_loop import export_and_cosimulate


def main(out: Path, fast: bool = False) -> Results:
    """Run every step of the workbench and write ``report.html``, with all files beside it.

    Parameters
    ----------
    out
        Folder for everything.
    fast
        Shorter runs and fewer angles, for a first look.
    """
    steps = nls.progress.Steps()
    with steps.step("deck, assembly, flat model"):
        actuator = declared_actuator()
        model = nls.flatten(actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
        nls.write_deck(actuator, out / "actuator.toml")
    with steps.step("joint design of cam, pretension and rubber"):
        design = design_spring(actuator, out)
    with steps.step("model against the figures of the paper"):
        figures = compare_with_figures(actuator)
    with steps.step("observability over the cam angle"):
        chart = sweep_angle(model, 19 if fast else 61)
    with steps.step("observers, on the bench and with the load free"):
        observers = compare_observers(actuator, model, 2.0 if fast else 5.0)
    with steps.step("C code, FMUs and their co-simulation"):
        loop = export_and_cosimulate(model, observers.minimal, out, 1.0 if fast else 3.0)
    with steps.step("diagnosis of the bench records"):
        verdict = diagnose_bench(actuator, out, steps)
    results = Results(actuator, model, design, figures, chart, observers, loop, verdict)
    with steps.step("report"):
        write_page(results, out)
    return results
