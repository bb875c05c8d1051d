"""Sections of a report on a diagnosis: findings, errors, candidates, next experiments."""

from __future__ import annotations

import numpy as np

from ..discrepancy.reporting.verdict import Verdict
from ..figures import (
    CandidateShare,
    HeldOut,
    RecordError,
    binned_errors,
    candidate_shares,
    gap_bars,
    held_out_series,
)
from ..model import FlatModel, flatten
from ..quantity import typeset_unit
from .sections import Chapter, FigureSection, Section, TableSection
from .verdict_section import VerdictSection

_SHAPES = 2


def verdict_sections(verdict: Verdict) -> list[Section]:
    """Return the sections of a report on a diagnosis.

    Parameters
    ----------
    verdict
        Result of a diagnosis.
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
            caption="Before: the refitted declared model; after: with the added effects; line: noise floor.",
            means="Records marked as held out were used by no fit.",
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
                "Candidates of the first step", candidate_shares(shares),
                caption="Share of the excess over the noise floor that each effect alone explains.",
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
    return [
        Chapter("Diagnosis", "Bench records against the declared model."),
        VerdictSection("Verdict", verdict.verdict, verdict.words(), parts=tuple(parts)),
    ]


def _shape_figures(verdict: Verdict) -> list[Section]:
    """Return the residual over the signals on which its mean depends most, before and after."""

    def strength(name: str) -> float:
        first, _ = verdict.shapes[name]
        return float(np.mean(np.square(first.mean)))

    over = [n for n in verdict.shapes if "frequency" not in n and "ward" not in n]
    model = flatten(verdict.declared)
    unit = next(g.unit for g in verdict.gaps if g.block == verdict.block)
    return [
        FigureSection(
            f"Error {name}: {verdict.block}",
            binned_errors(
                *((binned.centre, binned.mean) for binned in verdict.shapes[name]),
                across=_with_unit_of(name.removeprefix("over "), model),
                unit=unit,
                name=f"block {verdict.block}",
            ),
            caption="Mean of the error in bins, over all records; noise alone leaves zero throughout.",
        )
        for name in sorted(over, key=strength, reverse=True)[:_SHAPES]
    ]


def _with_unit_of(abscissa: str, model: FlatModel) -> str:
    """Return the label of an axis: the name of a signal, ``time`` or ``speed``, with its unit."""
    if abscissa == "time":
        return "time in s"
    if abscissa == "speed":
        return "speed of the motion in rad/s or m/s"
    return f"{abscissa} in {typeset_unit(model.variable(abscissa).unit) or '1'}"
