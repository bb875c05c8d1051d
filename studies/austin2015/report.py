"""The report of the study of the published actuator."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.feedback.control.evaluation.spread_margins import GAIN_MARGIN, PHASE_MARGIN, SpreadMargins
from nlsdesign.feedback.observer import SpreadErrors
from nlsdesign.presentation.report import (
    CamSection,
    Chapter,
    EquationsSection,
    FigureSection,
    FileSection,
    FoldedSection,
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
from nlsdesign.presentation.report.diagnosis_sections import VerdictSection

from .._designed import drawing_section
from .evaluation_report import evaluation_sections
from .figures import FigureComparison
from .generated_report import generated_sections
from .loop_report import loop_sections
from .observer_report import observer_sections
from .results import ActuatorResults, Results

ABSTRACT = (
    "The cam-rubber actuator of Austin, Schepelmann and Geyer (IROS 2015) and a spring designed anew for it: "
    "analysis, observer, torque loop and generated code of both, and what bench records show is missing."
)

FIRST_LOOK = (
    "A run with `--fast` is coarser, with fewer draws and frequencies. It leaves out spread, proofs and "
    "margins of the designed actuator, margins over the spread of the published one, FMUs of all others, "
    "code with the observer that learns, equations, and figures for a telephone. The diagnosis asks only "
    "for the effect that the whole study names among all. `nlsdesign study run austin2015` does all of it."
)

CONTROL = (
    "The torque is not measured: it is estimated from the encoder and the current. Tracking and margins are "
    "of the same observer rule (the cascade, exact numbers), controller and gains on both actuators; only "
    "the spring differs."
)

RECORDS = (
    "The diagnosis is of the published actuator, of which there are no public bench records. These come from "
    "a rig simulation that shares no model code with the package (`tests/rig`): servoed motor, encoder, "
    "ammeter and load cell with noise, dry friction as declared, numbers within their declared spread, and a "
    "second, slower relaxation of the rubber that the deck does not declare."
)


def write_page(results: Results, out: Path, *, fast: bool) -> None:
    """Write ``report.html``: what came out, a chapter for each of two readers, and the rest folded."""
    nls.write_report(
        out / "report.html",
        answers(results),
        key_numbers(results),
        *([TextSection("What this first look leaves out", FIRST_LOOK)] if fast else []),
        *chapter_of_design(results),
        Chapter("Estimate and control, for the control engineer", CONTROL),
        *observer_sections(results),
        *loop_sections(results),
        *evaluation_sections(results),
        *diagnosis_sections(results),
        *generated_sections(results.generated),
        *figure_sections(results.figures),
        actuator_section(results.published, fast=fast),
        *file_sections(results, out),
        title="A cam-rubber actuator, from deck to report",
        abstract=ABSTRACT,
        narrow=not fast,
    )


def diagnosis_sections(results: Results) -> list[Section]:
    """Show the verdict; its tables and figures are folded."""
    chapter, card = verdict_sections(results.verdict)
    assert isinstance(card, VerdictSection)
    evidence = FoldedSection("Evidence", (*card.parts, TextSection("The records", RECORDS)))
    return [chapter, replace(card, parts=()), evidence]


def answers(results: Results) -> TableSection:
    """Return what was designed, whether it can be made, and how well it is known and held."""
    design, numbers, both = results.cam.design, results.numbers, results.both
    built, trimmed = (
        f"{numbers[f'design_quantile{when}_mNm_rms']:.0f}" for when in ("", "_after_trim")
    )  # fmt: skip
    # Without the names of limits in brackets, which nobody needs here.
    bound = ", ".join(reached.partition(" (")[0] for reached in design.limits_reached) or "none"
    limits = f"every limit is kept; it sits on: {bound}" if design.met else str(design.miss)
    known, followed, margins = [], [], []
    for each in both.values():
        known.append("not looked at" if each.spread is None else errors_in_words(each.spread.errors))
        followed.append(f"{100 * each.followed(32.0, 5.0).relative_error:.0f} % of a sine at 5 Hz, Kp 32")
        spread = None if each.evaluation is None else each.evaluation.spread
        margins.append("not looked at" if spread is None else margins_in_words(spread))
    rows = (
        (
            "Which torque?", f"that of Fig. 8, the model within {numbers['fig8_rms_error_Nm']:.3f} N·m rms",
            f"5 N·m at 53°; 95 % of made springs within {built} mN·m rms, {trimmed} once trimmed",
        ),
        ("Can it be made?", "it was, in 2015", limits),
        ("How well is its torque known?", *known),
        ("How well is it held?", *followed),
        ("With which margins in 95 % of the machines?", *margins),
    )  # fmt: skip
    caption = "What was designed, whether it can be made, and how well its torque is known and held."
    return TableSection("In brief", ("question", *both), rows, caption=caption)


def errors_in_words(errors: SpreadErrors) -> str:
    """Return the error of the generated observer in half and in nine of ten machines."""
    median, most = (1e3 * float(np.max(errors.quantile("best", share))) for share in (0.5, 0.9))
    return f"{median:.0f} mN·m rms, in nine of ten machines below {most:.0f}"


def margins_in_words(margins: SpreadMargins) -> str:
    """Return the margins of a gain in 95 % of the machines, and the gain that has enough."""
    gain, phase = margins.spread
    has = f"{gain:.2g} dB and {phase:.2g}°" if math.isfinite(gain) else "none, some are unstable"
    return (
        f"{has} with Kp {margins.value:g}; {GAIN_MARGIN:g} dB and {PHASE_MARGIN:g}° with {margins.enough:.2g}"
    )


def key_numbers(results: Results) -> Section:
    """Return what stands at the top of the page."""
    numbers, assumed = results.numbers, nls.sources(results.published.actuator.quantities())["assumed"]
    old, new = (each.followed(32.0, 5.0).relative_error for each in results.both.values())
    design, trimmed = (
        numbers["design_torque_error_mNm_rms"], numbers["design_quantile_after_trim_mNm_rms"]
    )  # fmt: skip
    name, spread = list(results.over_spread.items())[-1]
    errors = spread.errors
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
            f"{name}, median over the spread, published form → generated; with exact numbers {exact:.1f}",
            before=f"{paper:.0f}",
        ),
        KeyNumber(
            "held-out error", f"{numbers['verdict_held_out_error_over_noise']:.2f} × noise",
            "published, declared → diagnosed", before=f"{results.verdict.gap().times[0]:.1f}",
        ),
        KeyNumber("numbers only assumed", f"{100 * assumed:.0f} %", "of the published deck"),
    )  # fmt: skip
    return NumbersSection("Key numbers", keys)


def actuator_section(published: ActuatorResults, *, fast: bool) -> Section:
    """Show what was declared; the equations, which SymPy writes, where there is time."""
    actuator = published.actuator
    parts: list[Section] = [
        TextSection("Parts", "The declaration, as `print(actuator)` draws it.", drawing=str(actuator)),
        numbers_table("Numbers of the deck", actuator.quantities()),
    ]
    if not fast:
        words = "The flat model; `f(…)` stands for a long law."
        parts.append(EquationsSection("Equations", nls.equations(published.model), words))
    caption = "Parts, numbers with unit, source and spread, and the equations of the published actuator"
    return FoldedSection("What was declared", tuple(parts), "" if fast else caption)


def chapter_of_design(results: Results) -> list[Section]:
    """Show the designed cam, what its spreads do, and the part."""
    cam = results.cam
    head = Chapter(
        "The spring, for the mechanical designer",
        "Contour, pretension, section and rest length of the rubber designed together for 5 N·m at 53°, the "
        "curve of 2014. Limits on curvature, cable tension, stress and strain follow from the declared cable "
        "and rubber. The `designed` actuator is the `published` one with this spring.",
    )
    moved = CamSection(
        "Cam, cable and rubber",
        nls.figures.cam_motion_of(results.designed.model, cam.design.contour, count=61),
        caption="The designed cam. Move the slider to turn it.",
        means="The contact point moves outwards, so the lever arm grows and the spring stiffens.",
        assumed="Rubber at rest.",
    )
    picture, torque, result, limits = design_sections(cam.design)
    made, band, tolerance, causes = tolerance_sections(cam.tolerance)
    drawings = drawing_section(cam)
    more = FoldedSection(
        "More on the spring", (result, limits, picture, made, band, tolerance, causes, drawings)
    )
    return [head, moved, torque, more]


def figure_sections(figures: FigureComparison) -> list[Section]:
    """Show the model against the figures of the paper."""
    static = figures.static
    model, hooke = figures.agreement, figures.hooke_agreement
    order = np.argsort(static.angle)
    angle = static.angle[order]
    curves = {
        "model at rest": (angle, static.model[order]),
        "best linear spring": (angle, static.hooke[order]),
    }
    notes = dict(zip(curves, map(nls.figures.metric_note, (model, hooke)), strict=True))
    points = {"Fig. 8": (static.angle, static.measured)}
    fig8 = FigureSection(
        "Fig. 8: torque over angle",
        nls.figures.torque_against_measured(curves, points, notes=notes),
        caption="Points: measured. Lines: model with all relaxation at rest, and the best linear spring.",
        assumed="The cam follows from this figure by energy: this checks the chain, not the law.",
    )
    return [
        Chapter(
            "Model and measurement",
            "The published actuator; the points are read off the figures of the paper.",
        ),
        FoldedSection("Against the figures of the paper", (fig8, *more_on_figures(figures))),
    ]


def more_on_figures(figures: FigureComparison) -> tuple[Section, ...]:
    """Show hysteresis, the metrics of the paper, and one element of rubber."""
    model, hooke = figures.agreement, figures.hooke_agreement
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
    return (
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
    )


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
        if loop.cosimulated is not None:
            files |= dict.fromkeys(loop.cosimulated.fmus, f"co-simulation FMU, {name}")
    for name, proved in results.proved.items():
        files |= {
            proved.code.source: f"certified observer in C99, {name}",
            proved.file: f"its certificate, {name}",
        }
    files |= dict.fromkeys(results.cam.files, "drawing of the designed cam")
    caption = "Decks, code, FMUs and drawings."
    return [
        FoldedSection("Files", (FileSection("Written beside this page", files, caption=caption),), caption)
    ]
