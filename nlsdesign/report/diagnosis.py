"""The pages of a diagnosis: what disagrees, where, what is missing, how sure, and the gap."""

from __future__ import annotations

import numpy as np

from ..discrepancy.reporting.verdict import Verdict
from ..figures import CandidateShare, HeldOut, RecordError, candidate_shares, gap_bars, held_out_series
from ..figures.curves import curves
from .sections import Chapter, FigureSection, Section, TableSection
from .verdict import VerdictSection

_SHAPES = 2


def verdict_sections(verdict: Verdict) -> list[Section]:
    """Return the sections of a report on a diagnosis.

    Parameters
    ----------
    verdict
        As found.
    """
    gaps = [g for g in verdict.gaps if g.block == verdict.block]
    errors = [RecordError(g.record, g.before, g.after, g.noise_floor, g.role == "held_out") for g in gaps]
    course = verdict.course
    series = HeldOut(
        course.time, course.measured, course.before, course.after, course.quantity, course.unit, course.noise
    )
    chosen = {effect.name for effect in verdict.effects}
    parts: list[Section] = [
        TableSection("Where", ("finding",), tuple((text,) for text in verdict.where)),
        FigureSection(
            f"Error of each record: {verdict.block}", gap_bars(errors, unit=gaps[0].unit),
            caption="Refitted declared model before, model with the added effect after; line: noise floor.",
            means="Records marked as held out were seen by no fit.",
        ),
        FigureSection(
            f"A held-out record: {course.record}", held_out_series(series),
            caption="Measured, and predicted before and after.",
        ),
    ]  # fmt: skip
    if verdict.runners_up:
        shares = [CandidateShare(name, share, name in chosen) for name, share in verdict.runners_up]
        parts.append(
            FigureSection(
                "What was tried first", candidate_shares(shares),
                caption="Share of the excess over the noise that each effect alone explains.",
            )
        )  # fmt: skip
    parts += _shape_figures(verdict)
    if verdict.skipped:
        skipped = tuple((s.effect, s.location, " and ".join(s.beside), s.reason) for s in verdict.skipped)
        heads = ("effect", "location", "beside", "reason")
        parts.append(TableSection("What could not be compared", heads, skipped))
    if verdict.next_steps:
        rows = tuple((text,) for text in verdict.next_steps)
        parts.append(TableSection("What to measure next", ("experiment",), rows))
    columns = ("block", "record", "role", "before", "after", "noise floor")
    parts.append(TableSection("All blocks and records", columns, tuple(verdict.rows()), folded=True))
    words = verdict.words()
    return [
        Chapter("Diagnosis", "Bench records against the declared model."),
        VerdictSection("Verdict", verdict.verdict, words, parts=tuple(parts)),
    ]


def _shape_figures(verdict: Verdict) -> list[Section]:
    """Return the residual over the signals on which its mean depends most, before and after."""

    def strength(name: str) -> float:
        first, _ = verdict.shapes[name]
        return float(np.mean(np.square(first.mean)))

    over = [n for n in verdict.shapes if "frequency" not in n and "ward" not in n]
    unit = next(g.unit for g in verdict.gaps if g.block == verdict.block)
    return [
        FigureSection(
            f"Error {name}: {verdict.block}",
            curves(
                {
                    word: (binned.centre, binned.mean)
                    for word, binned in zip(("before", "after"), verdict.shapes[name], strict=True)
                },
                across=name.removeprefix("over "),
                up=f"mean error in {unit}",
                words=f"Mean error of block {verdict.block} {name}, before and after.",
            ),
            caption="Mean of the error in bins, over all records; zero throughout is what noise leaves.",
        )
        for name in sorted(over, key=strength, reverse=True)[:_SHAPES]
    ]
