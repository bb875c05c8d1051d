"""The report of the study of the published actuator."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.presentation.report import (
    CamSection,
    Chapter,
    EquationsSection,
    FigureSection,
    FileSection,
    KeyNumber,
    NumbersSection,
    PublishedNumber,
    Section,
    TableSection,
    TextSection,
    comparison_table,
    design_sections,
    numbers_table,
    tolerance_sections,
    verdict_sections,
)

from .._designed import drawing_section
from .evaluation_report import evaluation_sections
from .generated_report import generated_sections
from .loop_report import loop_sections
from .observer_report import observer_sections
from .results import Results

ABSTRACT = (
    "Declared once, flattened once: the cam-rubber actuator of Austin, Schepelmann and Geyer (IROS 2015), "
    "a spring designed anew for it, and for both side by side analysis, observer, torque loop and generated "
    "code; then what bench records of the published one show is missing."
)

RECORDS = (
    "The diagnosis is of the published actuator, of which there are no public bench records. These come from "
    "a rig simulation that shares no model code with the package (`tests/rig`): servoed motor, encoder, "
    "ammeter and load cell with noise, dry friction as declared, numbers within their declared spread, and a "
    "second, slower relaxation of the rubber that the deck does not declare."
)


def write_page(results: Results, out: Path) -> None:
    """Write ``report.html``."""
    nls.write_report(
        out / "report.html",
        key_numbers(results),
        *actuator_sections(results),
        *figure_sections(results),
        *chapter_of_design(results),
        *observer_sections(results),
        *loop_sections(results),
        *evaluation_sections(results),
        *verdict_sections(results.verdict),
        TextSection("Where the records come from", RECORDS),
        *generated_sections(results.generated),
        *file_sections(results, out),
        title="A cam-rubber actuator, from deck to report",
        abstract=ABSTRACT,
    )


def key_numbers(results: Results) -> Section:
    """Return what stands at the top of the page."""
    numbers, assumed = results.numbers, nls.sources(results.published.actuator.quantities())["assumed"]
    old, new = (each.followed(32.0, 5.0).relative_error for each in results.both.values())
    design, trimmed = (
        numbers["design_torque_error_mNm_rms"], numbers["design_quantile_after_trim_mNm_rms"]
    )  # fmt: skip
    errors = results.designed.spread.errors
    exact, middle, paper = (
        1e3 * float(np.max(each))
        for each in (errors.exact[0], errors.quantile("best", 0.5), errors.quantile("published form", 0.5))
    )
    keys = (
        KeyNumber(
            "torque of the model", f"{numbers['fig8_rms_error_Nm']:.3f} N·m rms",
            "published actuator against Fig. 8; before: the paper's model", before="0.10",
        ),
        KeyNumber(
            "designed torque, 95 % of made springs", f"{trimmed:.0f} mN·m rms",
            f"5 N·m at 53°, as built → after a trim; with exact numbers {design:.2g}",
            before=f"{1e3 * results.cam.tolerance.quantiles[-1].value:.0f}",
        ),
        KeyNumber(
            "tracking error at 5 Hz",
            f"{100 * new:.0f} %",
            "published → designed",
            before=f"{100 * old:.0f} %",
        ),
        KeyNumber(
            "torque observer", f"{middle:.0f} mN·m rms",
            f"designed, median over the spread, published form → generated; with exact numbers {exact:.1f}",
            before=f"{paper:.0f}",
        ),
        KeyNumber(
            "held-out error", f"{numbers['verdict_held_out_error_over_noise']:.2f} × noise",
            "published, declared → diagnosed", before=f"{results.verdict.gap().times[0]:.1f}",
        ),
        KeyNumber("numbers only assumed", f"{100 * assumed:.0f} %", "of the published deck"),
    )  # fmt: skip
    return NumbersSection("Key numbers", keys)


def actuator_sections(results: Results) -> list[Section]:
    """Show what was declared."""
    actuator = results.published.actuator
    return [
        Chapter(
            "The published actuator",
            "Every number has a unit, a source and a spread; what is assumed says so.",
        ),
        TextSection("Parts", "The declaration, as `print(actuator)` draws it.", drawing=str(actuator)),
        numbers_table("Numbers of the deck", actuator.quantities(), folded=True),
        EquationsSection(
            "Equations",
            nls.equations(results.published.model),
            "The flat model; `f(…)` stands for a long law.",
            folded=True,
        ),
    ]


def chapter_of_design(results: Results) -> list[Section]:
    """Show the designed cam, what its spreads do, and the part."""
    cam = results.cam
    head = Chapter(
        "Design",
        "Contour, pretension, section and rest length of the rubber designed together for 5 N·m at 53°, the "
        "curve of 2014. Curvature, cable tension, stress and strain are held by limits that follow from the "
        "declared cable and rubber. Observer and torque loop are shown for both actuators: the `published` "
        "one, and the `designed` one, which has this spring in the place of the published.",
    )
    moved = CamSection(
        "Cam, cable and rubber",
        nls.figures.cam_motion_of(results.designed.model, cam.design.contour),
        caption="The designed cam. Move the slider to turn it.",
        means="The contact point moves outwards, so the lever arm grows and the spring stiffens.",
        assumed="Rubber at rest.",
    )
    return [
        head,
        moved,
        *design_sections(cam.design),
        *tolerance_sections(cam.tolerance),
        drawing_section(cam),
    ]  # fmt: skip


def figure_sections(results: Results) -> list[Section]:
    """Show the model against the figures of the paper."""
    figures, static = results.figures, results.figures.static
    model, hooke = figures.agreement, figures.hooke_agreement
    order = np.argsort(static.angle)
    angle = static.angle[order]
    curves = {
        "model at rest": (angle, static.model[order]),
        "best linear spring": (angle, static.hooke[order]),
    }
    notes = dict(zip(curves, map(nls.figures.metric_note, (model, hooke)), strict=True))
    points = {"Fig. 8": (static.angle, static.measured)}
    loops = {name: (loop.measured, loop.simulated) for name, loop in figures.loops.items()}
    rows = [
        PublishedNumber("mean relative error, model", 13.6, model.relative, "%", "paper: own bench data"),
        PublishedNumber("rms error, model", 0.10, model.rmse, "N*m", "here: points of Fig. 8"),
        PublishedNumber("mean relative error, linear spring", 25.2, hooke.relative, "%"),
    ]
    element = tuple(
        (amplitude, f"{loop.agreement.relative:.1f} %", f"{loop.agreement.rmse:.1f} N")
        for amplitude, loop in figures.elements.items()
    )
    return [
        Chapter(
            "Model and measurement",
            "The published actuator; the points are read off the figures of the paper.",
        ),
        FigureSection(
            "Fig. 8: torque over angle",
            nls.figures.torque_against_measured(curves, points, notes=notes),
            caption="Points: measured. Lines: model with all relaxation at rest, and the best linear spring.",
            assumed="The cam follows from this figure by energy: this checks the chain, not the law.",
        ),
        FigureSection(
            "Fig. 1: hysteresis",
            nls.figures.torque_loops(loops),
            caption="Measured and simulated loops.",
            assumed="Driven at 1 Hz, which is not printed; the viscosity was chosen for the 45° loop.",
        ),
        comparison_table(
            "In the metrics of the paper", rows, caption="Torque over the angle: the paper beside this model."
        ),
        TableSection(
            "Fig. 6: force of one element",
            ("amplitude", "mean relative error", "rms error"),
            element,
            caption="Sine stretch at 10.8 Hz assumed. In drawing order the measured force lags it, "
            "which no passive element can do, so only the mean of both strokes is compared.",
        ),
    ]


def file_sections(results: Results, out: Path) -> list[Section]:
    """List what was written."""
    files = {
        out / "actuator.toml": "deck of the published actuator",
        out / "designed.toml": "deck of the designed actuator",
        out / "diagnosis" / "model.toml": "deck of the refitted actuator with the missing effect",
    }
    loops = {name: each.loop for name, each in results.both.items()} | {"diagnosed": results.generated.loop}
    for name, loop in loops.items():
        for what, source in (("observer", loop.source), ("controller", loop.controller)):
            files |= {
                source.header: f"{what} in C99, interface, {name}",
                source.source: f"{what} in C99, {name}",
                source.selftest: f"its self-test with vectors, {name}",
            }
        files |= dict.fromkeys(loop.fmus, f"co-simulation FMU, {name}")
    for name, each in results.both.items():
        files |= {
            each.spread.code.source: f"certified observer in C99, {name}",
            each.spread.file: f"its certificate, {name}",
        }
    files |= dict.fromkeys(results.cam.files, "drawing of the designed cam")
    return [
        Chapter("Files"),
        FileSection("Written beside this page", files, caption="Decks, code, FMUs and drawings."),
    ]
