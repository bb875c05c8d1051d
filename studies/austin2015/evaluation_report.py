"""Sections on the torque loop as it is judged: verdicts, margins, impedance, onset of limit cycling."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import nlsdesign as nls
from nlsdesign.presentation.figures.loop_evaluation import passivity_words
from nlsdesign.presentation.report import FigureSection, FoldedSection, Section, TableSection

from .evaluation import AMPLITUDES, KP, LoopEvaluation
from .results import Results


def evaluation_sections(results: Results) -> list[Section]:
    """Show where the loop holds, and where it stops doing so, for both actuators."""
    judged = {name: each.evaluation for name, each in results.both.items() if each.evaluation is not None}
    figures = [figure for name, each in judged.items() for figure in _of_one(name, each)]
    return [FoldedSection("Where the loop holds", (_table(judged), *figures))]


def _of_one(name: str, judged: LoopEvaluation) -> list[Section]:
    means = f"Where it begins to oscillate: {judged.onset}."
    if (spread := judged.spread) is not None:
        signed = [*(spread.findings() or [spread.margins()]), *spread.words()]
        means += f" Over the spread of the deck: {'; '.join(signed)}."
    lost = [
        f"{response.amplitude:g} N·m at {f:.2g} Hz: {verdict}"
        for response in judged.responses
        for f, verdict in zip(response.frequency, response.verdicts, strict=True)
        if not verdict.holds
    ]
    return [
        FigureSection(
            f"Desired to actual torque, {name}",
            nls.figures.torque_responses(judged.responses),
            caption="Simulated with counts, friction, delay and limits, at two amplitudes. "
            + (f"Not settled: {'; '.join(lost)}." if lost else "Settled at every frequency."),
        ),
        FigureSection(
            f"Margins over the angle, {name}",
            nls.figures.margins_over_angle([judged.margins]),
            caption="Of the linearised sampled loop, cut at the current, while the machine slides; nothing "
            "where it is unstable or the drive cannot hold the angle.",
            means=means,
        ),
        FigureSection(
            f"Output impedance, {name}",
            nls.figures.impedance_over_frequency(judged.impedance),
            caption="Torque that a moved load feels. "
            + "; ".join(
                f"{np.degrees(angle):.0f}°: {passivity_words(float(first))}"
                for angle, first in zip(
                    judged.impedance.linear.angles, judged.impedance.first_active(), strict=True
                )
            )
            + ".",
        ),
    ]


def _table(evaluations: Mapping[str, LoopEvaluation]) -> TableSection:
    rows = []
    for name, judged in evaluations.items():
        margin, linear = judged.least_gain_margin, judged.margins.linear
        unstable = int(np.sum(linear.reached & ~linear.stable()))
        rows.append(
            (
                name,
                f"{margin:.2f}" if np.isfinite(margin) else "none: unstable",
                f"{unstable} of {int(np.sum(linear.reached))}",
                *(f"{sum(v.holds for v in r.verdicts)} of {len(r.verdicts)}" for r in judged.responses),
                f"{judged.onset.value:.1f}" if np.isfinite(judged.onset.value) else "not found",
                f"{judged.onset.linear:.1f}" if np.isfinite(judged.onset.linear) else "not found",
            )
        )
    settled = tuple(f"settled at {a:g} N·m" for a in AMPLITUDES)
    return TableSection(
        "Margins and onset of limit cycling",
        ("actuator", "least gain margin in dB", "unstable angles", *settled, "onset Kp, simulated", "linear"),
        tuple(rows),
        caption=f"PID with Kp {KP:g} rad/s per N·m behind the cascade, exact numbers. The paper prints no "
        "gains: with these the loop follows its figures; the code is generated with the scheduled law. "
        "Onset: gain from which the loop limit-cycles while it holds the larger torque, by simulation and "
        "by linearisation. What does not settle has no number.",
    )
