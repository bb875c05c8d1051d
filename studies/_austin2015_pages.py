"""The report of the study of the published actuator."""

from __future__ import annotations

from typing import Any

import numpy as np

import nlsdesign as nls

from ._austin2015_numbers import key_numbers, numbers
from ._austin2015_watching import file_pages, loop_pages, observer_pages

ABSTRACT = (
    "Declared once, flattened once: the cam-rubber actuator of Austin, Schepelmann and Geyer (IROS 2015), "
    "its design, analysis, observer, generated code, co-simulation, and what bench records say is missing."
)


def write_pages(done: dict[str, Any]) -> dict[str, float]:
    """Write the report and return the numbers of the study.

    Parameters
    ----------
    done
        What the stations have given, by name.
    """
    results = numbers(done)
    sections = [
        nls.NumbersSection("Key numbers", key_numbers(done, results)),
        *actuator_pages(done),
        *design_pages(done),
        *figure_pages(done),
        *observer_pages(done, results),
        *loop_pages(done, results),
        *nls.verdict_sections(done["verdict"]),
        *file_pages(done),
    ]
    title = "A cam-rubber actuator, from deck to report"
    nls.write_report(done["out"] / "report.html", *sections, title=title, abstract=ABSTRACT)
    return results


def actuator_pages(done: dict[str, Any]) -> list[Any]:
    """Show what was declared."""
    actuator, model = done["actuator"], done["model"]
    return [
        nls.Chapter(
            "The actuator", "Every number has a unit, a source and a spread; what is assumed says so."
        ),
        nls.TextSection("Parts", "The declaration, as `print(actuator)` draws it.", drawing=str(actuator)),
        nls.numbers_table("Numbers of the deck", actuator.quantities(), folded=True),
        nls.EquationsSection(
            "Equations", nls.equations(model), "The flat model; `f(…)` stands for a long law."
        ),
    ]


def design_pages(done: dict[str, Any]) -> list[Any]:
    """Show the designed cam."""
    design = done["design"]
    designed = nls.flatten(design.actuator, outputs=["spring.torque"])
    motion = nls.figures.cam_motion_of(designed, design.contour)
    check = design.check
    figure = nls.figures.torque_against_target(
        design.target, {"designed actuator": (check.angles, check.torques)}
    )
    return [
        nls.Chapter("Design", "Contour, pretension and rubber designed together for 5 N·m at 53°."),
        nls.CamSection(
            "Cam, cable and rubber",
            motion,
            caption="Move the slider to turn the cam.",
            means="The contact point wanders outwards, so the lever arm grows and the spring stiffens.",
            assumed="Rubber at rest; the anchor of the cable is not dimensioned in the paper.",
        ),
        nls.FigureSection(
            "Torque against the target",
            figure,
            caption="Torque of the flattened, changed assembly.",
            means=f"Worst case over the moduli's spread: {design.sensitivity}.",
        ),
        nls.TableSection("What was found", ("what", "value"), tuple(design.rows())),
        nls.TableSection("Limits", ("limit",), tuple((str(state),) for state in design.limits)),
    ]


def figure_pages(done: dict[str, Any]) -> list[Any]:
    """Show the model against the figures of the paper."""
    found = done["figures"]
    angle, measured, torque = found.static
    order = np.argsort(angle)
    models = {
        "model at rest": (angle[order], torque[order]),
        "best linear spring": (angle[order], found.hooke[order]),
    }
    notes = {
        "model at rest": nls.figures.metric_note(found.agreement),
        "best linear spring": nls.figures.metric_note(found.hooke_agreement),
    }
    rows = [
        nls.PublishedNumber(
            "mean relative error, model", 13.6, found.agreement.relative, "%", "paper: own bench data"
        ),
        nls.PublishedNumber("rms error, model", 0.10, found.agreement.rmse, "N*m", "here: points of Fig. 8"),
        nls.PublishedNumber("mean relative error, linear spring", 25.2, found.hooke_agreement.relative, "%"),
    ]
    element = [
        (amplitude, f"{result.relative:.1f} %", f"{result.rmse:.1f} N")
        for amplitude, (_, force, model) in found.element.items()
        for result in [nls.agreement(force, model)]
    ]
    return [
        nls.Chapter("Model and measurement", "The points are read off the figures of the paper."),
        nls.FigureSection(
            "Fig. 8: torque over angle",
            nls.figures.torque_against_measured(models, {"Fig. 8": (angle, measured)}, notes=notes),
            caption="Points: measured. Lines: model with all relaxation at rest, and the best linear spring.",
            assumed="The cam follows from this figure by energy: this checks the chain, not the law.",
        ),
        nls.FigureSection(
            "Fig. 1: hysteresis",
            nls.figures.torque_loops(found.loops),
            caption="Measured and simulated loops.",
            assumed="Driven at 1 Hz, which is not printed; the viscosity was chosen for the 45° loop.",
        ),
        nls.comparison_table("In the metrics of the paper", rows),
        nls.TableSection(
            "Fig. 6: force of one element",
            ("amplitude", "mean relative error", "rms error"),
            tuple(element),
            caption="Sine stretch at 10.8 Hz assumed. In drawing order the measured force lags it, "
            "which no passive element can do, so only the mean of both strokes is compared.",
        ),
    ]
