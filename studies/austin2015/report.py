"""The report of the study of the published actuator."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.report import (
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
    numbers_table,
    verdict_sections,
)

from .results import Results

ABSTRACT = (
    "Declared once, flattened once: the cam-rubber actuator of Austin, Schepelmann and Geyer (IROS 2015), "
    "its design, analysis, observer, generated code, co-simulation, and what bench records show is missing."
)

RECORDS = (
    "There are no public bench records of this actuator. These come from a rig simulation that shares no "
    "model code with the package (`tests/rig`): servoed motor, encoder, ammeter and load cell with noise, "
    "dry friction as declared, numbers within their declared spread, and a second, slower relaxation of the "
    "rubber that the deck does not declare."
)


def write_page(results: Results, out: Path) -> None:
    """Write ``report.html``."""
    nls.write_report(
        out / "report.html",
        key_numbers(results),
        *actuator_sections(results),
        *design_sections(results),
        *figure_sections(results),
        *observer_sections(results),
        *loop_sections(results),
        *verdict_sections(results.verdict),
        TextSection("Where the records come from", RECORDS),
        *file_sections(results, out),
        title="A cam-rubber actuator, from deck to report",
        abstract=ABSTRACT,
    )


def key_numbers(results: Results) -> Section:
    """Return what stands at the top of the page."""
    numbers, assumed = results.numbers, nls.sources(results.actuator.quantities())["assumed"]
    fig8, design = numbers["fig8_rms_error_Nm"], numbers["design_torque_error_mNm_rms"]
    observer, verdict = (
        numbers["observer_minimal_error_mNm_rms"],
        numbers["verdict_held_out_error_over_noise"],
    )
    difference = numbers["cosimulation_difference_Nm"]
    keys = (
        KeyNumber("torque of the model", f"{fig8:.3f} N·m rms", "against Fig. 8; paper: 0.10"),
        KeyNumber("designed torque", f"{design:.2g} mN·m rms", "5 N·m at 53°"),
        KeyNumber("torque observer", f"{observer:.2g} mN·m rms", "through the encoder"),
        KeyNumber("FMUs against one piece", f"{difference:.1e} N·m", "closed loop"),
        KeyNumber("held-out error", f"{verdict:.2f} × noise", "after diagnosis"),
        KeyNumber("numbers only assumed", f"{100 * assumed:.0f} %", "of the deck"),
    )
    return NumbersSection("Key numbers", keys)


def actuator_sections(results: Results) -> list[Section]:
    """Show what was declared."""
    actuator = results.actuator
    return [
        Chapter("The actuator", "Every number has a unit, a source and a spread; what is assumed says so."),
        TextSection("Parts", "The declaration, as `print(actuator)` draws it.", drawing=str(actuator)),
        numbers_table("Numbers of the deck", actuator.quantities(), folded=True),
        EquationsSection(
            "Equations", nls.equations(results.model), "The flat model; `f(…)` stands for a long law."
        ),
    ]


def design_sections(results: Results) -> list[Section]:
    """Show the designed cam."""
    design = results.design
    designed = nls.flatten(design.actuator, outputs=["spring.torque"])
    curve = {"designed actuator": (design.check.angles, design.check.torques)}
    return [
        Chapter("Design", "Contour, pretension and rubber designed together for 5 N·m at 53°."),
        CamSection(
            "Cam, cable and rubber",
            nls.figures.cam_motion_of(designed, design.contour),
            caption="Move the slider to turn the cam.",
            means="The contact point moves outwards, so the lever arm grows and the spring stiffens.",
            assumed="Rubber at rest; the anchor of the cable is not dimensioned in the paper.",
        ),
        FigureSection(
            "Torque against the target",
            nls.figures.torque_against_target(design.target, curve),
            caption="Torque of the flattened, changed assembly.",
            means=f"Worst case over the moduli's spread: {design.sensitivity}.",
        ),
        TableSection("Result of the design", ("quantity", "value"), tuple(design.rows())),
        TableSection("Limits", ("limit",), tuple((str(state),) for state in design.limits)),
    ]


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
        Chapter("Model and measurement", "The points are read off the figures of the paper."),
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
        comparison_table("In the metrics of the paper", rows),
        TableSection(
            "Fig. 6: force of one element",
            ("amplitude", "mean relative error", "rms error"),
            element,
            caption="Sine stretch at 10.8 Hz assumed. In drawing order the measured force lags it, "
            "which no passive element can do, so only the mean of both strokes is compared.",
        ),
    ]


def observer_sections(results: Results) -> list[Section]:
    """Show observability, and the errors of the observers on the bench."""
    observers, chart = results.observers, {"figure-consistent deck": results.chart}
    bench, free = observers.bench, observers.free
    estimates = {"minimal form": observers.minimal_estimate, "published form": observers.published_estimate}
    minimal, published = (1e3 * observers.error(estimate) for estimate in estimates.values())
    first = bench.time <= 1.0
    shown = {name: estimate["spring.torque"][first] for name, estimate in estimates.items()}
    angles = {name: np.degrees(free[f"{name}.angle"]) for name in ("motor", "load")}
    return [
        Chapter("Observer", "The torque is not measured: it is estimated from the encoder and the current."),
        FigureSection(
            "Observability over the cam angle",
            nls.figures.observability_over_angle(chart),
            caption="Rank and condition of angle, speed and rubber memory, observed through the encoder.",
            means="At zero angle the lever arm vanishes: the rubber's memory is not observable, nor needed.",
        ),
        FigureSection(
            "Stability over the cam angle",
            nls.figures.stability_over_angle(chart),
            caption="Poles and stiffness of the actuator at rest.",
        ),
        FigureSection(
            "Estimated torque on the bench",
            nls.figures.observer_error(bench.time[first], bench["spring.torque"][first], shown),
            caption="Current 6 A at 2 Hz, 8192 counts per turn; the minimal form starts wrong.",
            means=f"After 1 s: {minimal:.2f} mN·m rms in minimal, {published:.2f} in the paper's form.",
        ),
        FigureSection(
            "Free drivetrain",
            nls.figures.over_time(free.time, angles, quantity="angle", unit="deg"),
            caption="The load is let go: a link of 2e-3 kg·m² behind the spring, current 0.5 A at 2 Hz.",
        ),
        TextSection("Observer", "The table and its error.", drawing=str(observers.minimal)),
    ]


def loop_sections(results: Results) -> list[Section]:
    """Show the co-simulated closed loop."""
    loop = nls.figures.closed_loop_of(
        results.loop.cosimulated,
        desired="controller.spring.torque.desired",
        true="plant.spring.torque",
        estimated="observer.spring.torque",
        current="controller.motor.current",
    )
    difference = results.loop.difference
    return [
        Chapter("Co-simulation", "Plant, observer and torque controller as FMUs, wired by name."),
        FigureSection(
            "Closed torque loop",
            nls.figures.closed_loop(loop, differences={"true torque": difference}),
            caption="0.8 N·m at 1 Hz; the controller has one sample to compute.",
            means="The same loop simulated in one piece differs by at most "
            f"{np.max(np.abs(difference)):.1e} N·m.",
        ),
    ]


def file_sections(results: Results, out: Path) -> list[Section]:
    """List what was written."""
    source = results.loop.source
    files = {
        out / "actuator.toml": "deck of the actuator",
        out / "designed.toml": "deck of the designed actuator",
        out / "diagnosis" / "model.toml": "deck of the refitted actuator with the missing effect",
        source.header: "observer in C99, interface",
        source.source: "observer in C99",
        source.selftest: "self-test with vectors",
        **dict.fromkeys(results.loop.fmus, "co-simulation FMU"),
        **dict.fromkeys(sorted((out / "drawing").iterdir()), "drawing of the cam"),
    }
    return [Chapter("Files"), FileSection("Written beside this page", files)]
