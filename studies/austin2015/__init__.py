"""The published cam-rubber actuator, from deck to report, and the same with a spring designed anew.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015. The deck is the figure-consistent one; where it departs from the printed numbers, it
states why. Design, observer, torque loop and generated code are shown for both actuators side by side.
"""

from __future__ import annotations

from pathlib import Path
from typing import cast

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict
from nlsdesign.design import DesignSettings
from nlsdesign.foundation.work_sharing import parallel_map

from .._published import declared_actuator
from .design import FIRST_DESIGN, design_spring
from .diagnosis import NAMED, SLOWEST, diagnose_bench
from .evaluation import evaluate_loop
from .figures import compare_with_figures
from .generated import Code, code_of_three_decks
from .observer import compare_observers, sweep_angle
from .report import write_page
from .results import ActuatorResults, Results
from .spread import certified, over_spread
from .torque_loop import export_and_cosimulate
from .tracking import FREQUENCIES, follow_sines


def main(out: Path, fast: bool = False) -> Results:
    """Run every step of the workbench and write ``report.html``, with all files beside it.

    What the fast way leaves out stands in ``report.FIRST_LOOK``.
    """
    steps = nls.progress.Steps()
    with steps.step("deck and assembly"):
        actuator = declared_actuator()
        nls.write_deck(actuator, out / "actuator.toml")

    with steps.step("joint design of cam, pretension and rubber"):
        settings = FIRST_DESIGN if fast else DesignSettings(draws=1000)
        cam = design_spring(actuator, out, settings)
    with steps.step("model against the figures of the paper"):
        figures = compare_with_figures(actuator)

    def branch(number: int) -> ActuatorResults | Verdict:
        """Do what needs nothing of the others, so that each may have a core of its own."""
        if number == 1:
            catalogue, without = (NAMED, SLOWEST) if fast else (None, ())
            with steps.step("diagnosis of the bench records"):
                return diagnose_bench(actuator, out, steps, catalogue, without=without)
        name, machine = ("designed", cam.design.actuator) if number else ("published", actuator)
        deck = out / ("designed.toml" if number else "actuator.toml")
        return work_up(machine, deck, out / name, steps=steps, fast=fast)

    whole = cast("tuple[ActuatorResults, Verdict, ActuatorResults]", tuple(parallel_map(branch, 3)))
    published, verdict, designed = whole
    both = {"published": published, "designed": designed}
    with steps.step("the diagnosed actuator under code from three decks"):
        codes = {
            name: Code(each.model, each.observers.minimal.model, each.generated)
            for name, each in both.items()
        }
        generated = code_of_three_decks(verdict.actuator, codes, out / "diagnosed", fast=fast)
    results = Results(published, designed, cam, figures, verdict, generated)
    with steps.step("report"):
        write_page(results, out, fast=fast)
    return results


def work_up(
    actuator: nls.Assembly, deck: Path, out: Path, *, steps: nls.progress.Steps, fast: bool
) -> ActuatorResults:
    """Take one actuator through analysis, observer, torque loop and export."""
    name = out.name
    whole = not fast or name == "published"
    model = nls.flatten(actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
    with steps.step(f"observability over the cam angle, {name}"):
        chart = sweep_angle(model, 11 if fast else 61)
    with steps.step(f"observers, on the bench and with the load free, {name}"):
        observers = compare_observers(actuator, model, 2.0 if fast else 5.0)
    spread = evaluation = None
    if whole:
        with steps.step(f"observers over the spread, and what is proved, {name}"):
            spread = over_spread(model, observers, 2 if fast else 16, proved=certified(model, deck, out))
    with steps.step(f"torque loop, {name}"):
        following = follow_sines(model, observers.minimal, FREQUENCIES[1:2] if fast else FREQUENCIES)
        if whole:
            evaluation = evaluate_loop(actuator, model, observers.minimal, fast=fast)
    observer = observers.minimal.model if spread is None else spread.chosen.model
    with steps.step(f"C code, FMUs and their co-simulation, {name}"):
        stop = 3.0 if not fast else 0.25 if whole else None
        loop = export_and_cosimulate(model, observer, out, stop)
    return ActuatorResults(actuator, model, chart, observers, following, loop, spread, evaluation)
