"""Sections on the torque observers: what is seen, the spread, exact numbers, and what is proved."""

from __future__ import annotations

import numpy as np

import nlsdesign as nls
from nlsdesign.foundation.quantity import three_digits
from nlsdesign.presentation.report import FigureSection, FoldedSection, Section, TableSection, TextSection

from .observer import STIFFER, WIDER
from .results import ActuatorResults, Results
from .spread import ObserverOverSpread


def observer_sections(results: Results) -> list[Section]:
    """Show the errors of the observers over the spread; observability and proofs are folded."""
    # The designed one first: its colour is that of what a figure is about.
    first, *others = (_spread_figure(*each) for each in reversed(results.over_spread.items()))
    more = (
        _errors_in_numbers(results),
        *others,
        *(_generated(*each) for each in results.over_spread.items()),
        _on_bench("designed", results.designed),
        _errors_with_known_numbers(results),
    )
    certificates = (
        TextSection(f"The certificate, {name}", " ".join(each.certificate.statement), drawing=each.hashes)
        for name, each in results.proved.items()
    )
    return [
        first,
        FoldedSection("Observability and stability over the angle", _over_angle(results)),
        FoldedSection("More on the observers", more),
        FoldedSection("What is proved", (_bounds(results), *certificates)),
    ]


def _over_angle(results: Results) -> tuple[Section, ...]:
    both = dict(reversed(results.both.items()))
    charts = {name: each.chart for name, each in both.items()}
    drops = {name: each.drops for name, each in reversed(results.over_spread.items())}
    return (
        FigureSection(
            "Observability over the cam angle",
            nls.figures.observability_over_angle(charts, drops=drops),
            caption="Rank and condition of angle, speed and rubber memory, observed through the encoder; "
            "angles of lost rank are exact, they stand in the table below.",
            means="At zero angle the lever arm vanishes: the rubber's memory is not observable, nor needed.",
        ),
        TableSection(
            "What the encoder does not show",
            ("actuator", "finding"),
            tuple((name, line.replace(" -", " −")) for name, each in drops.items() for line in each.lines()),
            caption="States that do not show at exact angles, why, and whether they decay by themselves.",
        ),
        FigureSection(
            "Stability over the cam angle",
            nls.figures.stability_over_angle(charts),
            caption="Poles of the plant while it slides and while dry friction holds it; stiffness at rest. "
            "With pretension the designed spring is stiff at zero too.",
        ),
    )


def _errors_with_known_numbers(results: Results) -> TableSection:
    rows = tuple(
        (
            name,
            1e3 * each.observers.minimal_error,
            1e3 * each.observers.published_error,
            1e3 * each.observers.stiffer_error,
        )
        for name, each in results.both.items()
    )
    return TableSection(
        "Errors with exact numbers, and with one other rubber",
        ("actuator", "cascade", "published form", "cascade, stiffer rubber"),
        rows,
        caption="mN·m rms after 1 s. Exact numbers: the observer knows every number of the actuator, so only "
        f"encoder and sampling are left. Stiffer rubber: all moduli {_more(STIFFER)} and the section "
        f"{_more(WIDER)} larger than the observer knows, one declared spread each; the cascade trusts its "
        "rubber and does not correct it by the current.",
    )


def _more(factor: float) -> str:
    return f"{100 * (factor - 1):.0f} %"


def _on_bench(name: str, results: ActuatorResults) -> FigureSection:
    observers = results.observers
    bench = observers.bench
    estimates = {"cascade": observers.minimal_estimate, "published form": observers.published_estimate}
    first = bench.time <= 0.5  # one period
    shown = {label: estimate["spring.torque"][first] for label, estimate in estimates.items()}
    return FigureSection(
        f"Estimated torque on the bench, exact numbers, {name}",
        nls.figures.observer_error(bench.time[first], bench["spring.torque"][first], shown),
        caption="Current 6 A at 2 Hz, 8192 counts per turn; the cascade starts wrong.",
        means=f"With exact numbers, after 1 s: {1e3 * observers.minimal_error:.2f} mN·m rms of the "
        f"cascade, {1e3 * observers.published_error:.2f} in the paper's form. What the spread of the "
        "deck makes of this stands above.",
        assumed="The observer knows every number of the actuator exactly.",
    )


def _spread_figure(name: str, spread: ObserverOverSpread) -> FigureSection:
    errors = spread.errors
    draws = errors.drawn.shape[1]
    middle, paper = (float(np.max(errors.quantile(each, 0.5))) for each in ("best", "published form"))
    ranked = errors.ranked_causes("best")[:3]
    causes = ", ".join(f"{cause} ({1e3 * size:.0f})" for cause, size in ranked)
    return FigureSection(
        f"Torque errors over the spread, {name}",
        nls.figures.errors_over_spread(errors),
        caption=f"Sines of {errors.torque:.2f} N·m, one run for all; {draws} machines drawn from the "
        "spreads of the deck. Dashed, where computed: bound of Cramér and Rao on the rms over all machines, "
        "for any estimator with encoder and current.",
        means=f"Median over the spread at the worse frequency: {1e3 * middle:.0f} mN·m of the observer "
        f"that is generated, {1e3 * paper:.0f} of the published form. Most costs what rubber and drive "
        f"are not known: {causes} mN·m.",
        assumed=f"{draws} draws scatter; numbers of the deck are independent.",
    )


def _errors_in_numbers(results: Results) -> TableSection:
    return TableSection(
        "Torque errors in numbers",
        ("actuator", "observer", "Hz", "median", "90 %", "rms", "bound on the rms", "exact numbers"),
        tuple((name, *row) for name, each in results.over_spread.items() for row in each.errors.rows()),
        caption="mN·m rms. `best` is the observer that is generated, by the error that is expected over "
        "the spread before anything is drawn.",
    )


def _generated(name: str, spread: ObserverOverSpread) -> TextSection:
    return TextSection(
        f"The observer that is generated, {name}",
        f"Taken was {spread.chosen.reason}. It is not certified.",
        drawing=str(spread.chosen.design),
    )


def _bounds(results: Results) -> TableSection:
    rows = []
    for name, each in results.proved.items():
        proof = each.certificate.proof
        within = "none" if isinstance(proof.torque, str) else f"{1e3 * proof.torque.total:.1f}"
        rows.append((name, f"{proof.decay:.1f}", three_digits(proof.condition), within))
    return TableSection(
        "What is proved of one constant gain",
        ("actuator", "decay in 1/s", "condition of P at most", "torque within, mN·m, exact numbers"),
        tuple(rows),
        caption="A second observer with one certified gain lies beside the generated one, with its C code "
        "and certificate.json; `nlsdesign observer verify` checks it again without the solver.",
    )
