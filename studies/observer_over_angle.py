"""Stability and observability over the cam angle, as a machine with dry friction has them: sliding and stuck.

Both decks of the published actuator. What is shown: the poles of the plant in each mode, the exact angle at
which the memory of the rubber is not seen, what becomes of it there, the published form against the minimal
one, and which further sensor would help the torque estimate most.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.feedback.analysis import (
    Chart,
    EmpiricalGramian,
    EstimateDeviation,
    Observability,
    RankDrops,
    SensorRanking,
    Stability,
    empirical_gramian,
    rank_drops,
    rank_sensors,
    rest_points,
)
from nlsdesign.model.paper_form import GEOMETRIC, PaperFormNames, paper_form
from nlsdesign.presentation.report import (
    Chapter,
    FigureSection,
    Section,
    TableSection,
    TextSection,
    write_report,
)

DECKS = {"as printed": "austin2015_as_printed", "figure-consistent": "austin2015_figure_consistent"}
LAST = nls.degrees(50.0)
NOMINAL_FORCE, NOMINAL_EXTENSION, NOMINAL_SPEED = 302.0, 12e-3, 20.0  # N, m, rad/s: the printed law at 12 mm


@dataclass(frozen=True)
class Results:
    """The numbers that ``expected.toml`` claims, of the figure-consistent deck unless they say otherwise."""

    frequency_at_1_deg_Hz: float
    frequency_at_45_deg_Hz: float
    decay_at_45_deg_per_s: float
    damping_ratio_at_45_deg: float
    decay_stuck_per_s: float
    decay_of_the_smoothed_corner_at_45_deg_per_s: float
    as_printed_lowest_frequency_from_1_to_45_deg_Hz: float
    as_printed_highest_frequency_from_1_to_45_deg_Hz: float
    as_printed_lowest_damping_ratio_from_1_to_45_deg: float
    as_printed_highest_damping_ratio_from_1_to_45_deg: float
    unseen_angle_rad: float
    unseen_angle_of_the_published_form_rad: float
    unseen_eigenvalue_per_s: float
    as_printed_unseen_eigenvalue_per_s: float
    angles_of_lost_rank: float
    rank_of_the_published_form_elsewhere: float
    published_condition_at_5_deg: float
    published_condition_at_45_deg: float
    best_deviation_at_45_deg_mNm: float
    deviation_over_spread_mNm: float
    torque_sensor_times_better: float
    finer_encoder_times_better: float
    empirical_condition: float
    numbers = property(asdict, doc="The results by name.")


@dataclass(frozen=True, eq=False)
class DeckAnalysis:
    """What is found of one deck: the minimal form, the published one, the sensors, one motion."""

    chart: Chart
    drops: RankDrops
    corner: float
    published: Chart
    published_drops: RankDrops
    ranking: SensorRanking
    motion: EmpiricalGramian


def main(out: Path, fast: bool = False) -> Results:
    """Analyse both decks, draw and report."""
    both = {name: analysed(deck, 400 if fast else 2000) for name, deck in DECKS.items()}
    charts = {name: each.chart for name, each in both.items()}
    forms = {
        f"{name}, {form}": chart
        for name, each in both.items()
        for form, chart in (("minimal", each.chart), ("published form", each.published))
    }
    pictures = {
        "poles": nls.figures.stability_over_angle(charts),
        "observability": nls.figures.observability_over_angle(
            charts, drops={name: each.drops for name, each in both.items()}
        ),
        "forms": nls.figures.observability_over_angle(
            {label: _without_deviation(chart) for label, chart in forms.items()}
        ),
    }
    nls.figures.write_figures(out, pictures)
    _report(out, both)
    one, printed = both["figure-consistent"], both["as printed"].chart
    moving = (printed.at >= nls.degrees(1.0)) & (printed.at <= nls.degrees(45.0))
    gains = {gain.candidate.name: gain for gain in one.ranking.gains}
    present = one.ranking.present.spread[0]
    return Results(
        frequency_at_1_deg_Hz=_at(one.chart, "sliding.frequency", 1.0),
        frequency_at_45_deg_Hz=_at(one.chart, "sliding.frequency", 45.0),
        decay_at_45_deg_per_s=_at(one.chart, "sliding.decay", 45.0),
        damping_ratio_at_45_deg=_at(one.chart, "sliding.damping_ratio", 45.0),
        decay_stuck_per_s=_at(one.chart, "stuck.decay", 45.0),
        decay_of_the_smoothed_corner_at_45_deg_per_s=one.corner,
        as_printed_lowest_frequency_from_1_to_45_deg_Hz=float(np.min(printed["sliding.frequency"][moving])),
        as_printed_highest_frequency_from_1_to_45_deg_Hz=float(np.max(printed["sliding.frequency"][moving])),
        as_printed_lowest_damping_ratio_from_1_to_45_deg=float(
            np.min(printed["sliding.damping_ratio"][moving])
        ),
        as_printed_highest_damping_ratio_from_1_to_45_deg=float(
            np.max(printed["sliding.damping_ratio"][moving])
        ),
        unseen_angle_rad=one.drops.drops[0].first,
        unseen_angle_of_the_published_form_rad=one.published_drops.drops[0].first,
        unseen_eigenvalue_per_s=float(one.drops.drops[0].unseen.eigenvalues[0].real),
        as_printed_unseen_eigenvalue_per_s=float(
            both["as printed"].drops.drops[0].unseen.eigenvalues[0].real
        ),
        angles_of_lost_rank=float(len(one.drops.drops)),
        rank_of_the_published_form_elsewhere=float(np.max(one.published["observability.rank"])),
        published_condition_at_5_deg=_at(one.published, "observability.condition", 5.0),
        published_condition_at_45_deg=_at(one.published, "observability.condition", 45.0),
        best_deviation_at_45_deg_mNm=1e3 * _at(one.chart, "deviation.best", 45.0),
        deviation_over_spread_mNm=1e3 * present,
        torque_sensor_times_better=present / gains["torque sensor"].spread[0],
        finer_encoder_times_better=present / gains["encoder with a quarter of the count"].spread[0],
        empirical_condition=one.motion.condition,
    )


def analysed(deck: str, count: int) -> DeckAnalysis:
    """Return what is found of a deck at so many angles from −50° to 50°; an even number leaves out 0°."""
    model = nls.flatten(nls.declare(nls.load_deck(deck)), outputs=["motor.angle", "spring.torque"])
    angles = np.linspace(-LAST, LAST, count)
    views = [Observability(measured=("motor.angle",)), Stability(), EstimateDeviation()]
    names = PaperFormNames().of(model)
    form = nls.with_outputs(paper_form(model), [names.extension, names.angle])
    consistent = {names.extension: f"{names.extension}.{GEOMETRIC}"}
    scaling = Observability(
        nominal={
            names.force: NOMINAL_FORCE,
            names.extension: NOMINAL_EXTENSION,
            names.angle: np.pi / 4.0,
            names.speed: NOMINAL_SPEED,
        }
    )
    at_rest = rest_points(model, nls.degrees(45.0) * np.ones(1), angle=names.angle).a[0]
    wanted = [names.extension, names.angle]
    return DeckAnalysis(
        chart=nls.over_angle(model, views, angles=angles),
        drops=rank_drops(model, angles=angles),
        corner=float(np.max(np.linalg.eigvals(at_rest).real)),
        published=nls.over_angle(form, [scaling], angles=angles, consistent=consistent),
        published_drops=rank_drops(
            form, angles=angles, measured=wanted, consistent=consistent, scaling=scaling
        ),
        ranking=rank_sensors(model, angles=np.linspace(0.02, 1.0, 50) * LAST),
        motion=empirical_gramian(
            model, np.linspace(0.0, 0.5, 501), inputs=nls.sine("motor.current", 6.0, 2.0)
        ),
    )


def _at(chart: Chart, column: str, degrees: float) -> float:
    return float(np.interp(nls.degrees(degrees), chart.at, chart[column]))


def _without_deviation(chart: Chart) -> Chart:
    kept = [i for i, v in enumerate(chart.columns) if not v.name.startswith("deviation")]
    columns = tuple(chart.columns[i] for i in kept)
    return Chart(chart.argument, chart.at, columns, chart.values[:, kept], chart.words)


def _report(out: Path, both: dict[str, DeckAnalysis]) -> None:
    charts = {name: each.chart for name, each in both.items()}
    drops = {name: each.drops for name, each in both.items()}
    sections: list[Section] = [
        FigureSection(
            "Poles of the plant",
            nls.figures.stability_over_angle(charts),
            caption="Sliding: dry friction has its sliding level. Stuck: the speed is held at zero.",
            means="Moving, the plant is a lightly damped oscillator; stuck, only the rubber relaxes.",
        ),
        FigureSection(
            "Observability of the minimal form",
            nls.figures.observability_over_angle(charts, drops=drops),
            caption="Angle, speed and memory of the rubber, observed through the encoder.",
            assumed=charts["as printed"].columns[-1].description,
        ),
    ]
    for name, each in both.items():
        rows = tuple(tuple(row) for row in each.ranking.rows())
        lines = [*each.drops.lines(), "Published form:", *each.published_drops.lines(), str(each.motion)]
        sections += [
            Chapter(name.capitalize()),
            TextSection("What is not seen", drawing="\n".join(lines)),
            TableSection(
                "Which sensor would help most", tuple(each.ranking.headings), rows,
                caption=each.ranking.condition,
            ),
        ]  # fmt: skip
    write_report(out / "report.html", *sections, title="Stability and observability over the cam angle")
