"""Pages of the study of the published actuator: the model against the figures of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np

import nlsdesign as nls


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
        nls.report.PublishedNumber(
            "mean relative error, model", 13.6, found.agreement.relative, "%", "paper: own bench data"
        ),
        nls.report.PublishedNumber(
            "rms error, model", 0.10, found.agreement.rmse, "N*m", "here: points of Fig. 8"
        ),
        nls.report.PublishedNumber(
            "mean relative error, linear spring", 25.2, found.hooke_agreement.relative, "%"
        ),
    ]
    element = [
        (amplitude, f"{result.relative:.1f} %", f"{result.rmse:.1f} N")
        for amplitude, (_, force, model) in found.element.items()
        for result in [nls.agreement(force, model)]
    ]
    return [
        nls.report.Chapter("Model and measurement", "The points are read off the figures of the paper."),
        nls.report.FigureSection(
            "Fig. 8: torque over angle",
            nls.figures.torque_against_measured(models, {"Fig. 8": (angle, measured)}, notes=notes),
            caption="Points: measured. Lines: model with all relaxation at rest, and the best linear spring.",
            assumed="The cam follows from this figure by energy: this checks the chain, not the law.",
        ),
        nls.report.FigureSection(
            "Fig. 1: hysteresis",
            nls.figures.torque_loops(found.loops),
            caption="Measured and simulated loops.",
            assumed="Driven at 1 Hz, which is not printed; the viscosity was chosen for the 45° loop.",
        ),
        nls.report.comparison_table("In the metrics of the paper", rows),
        nls.report.TableSection(
            "Fig. 6: force of one element",
            ("amplitude", "mean relative error", "rms error"),
            tuple(element),
            caption="Sine stretch at 10.8 Hz assumed. In drawing order the measured force lags it, "
            "which no passive element can do, so only the mean of both strokes is compared.",
        ),
    ]
