"""Sections on a diagnosis and on the observer that was designed again from the better model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...bench.discrepancy.effects.plain_names import kind_in_words, title
from ...bench.discrepancy.reporting.circumstances import settings_of
from ...bench.discrepancy.reporting.fitted_numbers import FittedNumber, fitted_numbers
from ...bench.discrepancy.reporting.verdict import (
    Gap,
    RecordGap,
    Verdict,
    best_forms,
    details_of,
    in_brief,
    let_go,
    suspicions,
)
from ...foundation.errors import unknown_name
from ...foundation.quantity import three_digits, typeset_number, typeset_unit, with_error
from ...model import FlatModel, flatten
from ..figures import RecordError, compact, gap_bars
from ..figures.before_after import (
    CandidateShare,
    HeldOut,
    binned_errors,
    candidate_shares,
    held_out_series,
)
from .sections import (
    Chapter,
    FigureSection,
    FileSection,
    KeyNumber,
    NumbersSection,
    PagePosition,
    Section,
    TableSection,
    inner_sections,
)

if TYPE_CHECKING:
    # Only its type is wanted here: the module brings the compiler and fmpy along.
    from ...regeneration import Regeneration

VERDICTS = {
    "none": "nothing is missing",
    "named": "effect named",
    "unknown": "an effect without a name",
    "undecidable": "the records cannot tell",
    "data_suspect": "data or deck are suspect",
}

_WIDTH = 100.0
"""Width of the longer bar of the gap, in units of the drawing."""


@dataclass(frozen=True, eq=False)
class VerdictSection(Section):
    """A verdict with its evidence: tables of candidates, figures of the errors."""

    verdict: str  # "none", "named", "unknown", "undecidable" or "data_suspect"
    words: str  # the findings, in sentences
    _: KW_ONLY
    detail: str = ""  # what speaks for them, in sentences that are folded away; empty for none
    headline: str = ""  # the findings in one line
    gap: Gap | None = None  # error before and after; None where there is none to show
    after: str = "with what was added"  # how the model after differs from the one before
    parts: tuple[Section, ...] = ()  # sections with the evidence
    template: ClassVar[str] = "verdict.html"

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise unknown_name("verdict", self.verdict, VERDICTS)

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the verdict and the contents of its parts."""
        return {
            "verdict": self.verdict,
            "badge": VERDICTS[self.verdict],
            "headline": self.headline,
            "gap": None if self.gap is None else _drawn(self.gap, self.after),
            "words": self.words,
            "detail": self.detail,
            "parts": inner_sections(self.parts, place),
        }


def _drawn(gap: Gap, after: str) -> Mapping[str, Any]:
    """Return the two bars of a gap and the numbers below them."""
    longest = max(gap.before, gap.after) or 1.0
    bars = {n: f"{_WIDTH * getattr(gap, n) / longest:.2f}" for n in ("before", "after")}
    records = "records that no fit has seen" if gap.role == "held_out" else "the fitted records"
    note = (
        f"before, the refitted declared model; after, {after}. Both filtered alike."
        if gap.changed
        else "the refitted declared model; nothing was added."
    )
    note = f"Root mean square error of `{gap.block}` on {records}: {note}"
    return {"bars": bars if gap.changed else None, "rows": gap.rows(), "note": note, "words": gap.words()}


_SHAPES = 2
_EDGE = 2.0
"""Declared standard deviations beyond which a number has left what was declared."""
ROLES = {"fit": "fitted", "selection": "for selection", "held_out": "held out"}


def verdict_sections(verdict: Verdict) -> list[Section]:
    """Return the sections of a report on a diagnosis.

    Parameters
    ----------
    verdict
        Result of a diagnosis.
    """
    reasons = suspicions(verdict)
    others = [text for text in verdict.findings if text not in reasons]
    numbers = fitted_numbers(verdict.fits)
    columns = ("block", "record", "used", "before", "after", "noise", "unit", "after / noise")
    rows = tuple(_gap_row(g) for g in verdict.gaps)
    caption = "Root mean square error of every block on every record."
    parts = [
        _blocks(verdict),
        *_list("Findings", "finding", others, "What was noticed besides the errors of the blocks."),
        *_error_figures(verdict),
        *_candidates(verdict),
        *_shape_figures(verdict),
        *fitted_table(numbers, f"{'with' if verdict.effects else 'without'} what was added"),
        *_list(
            "What to measure next",
            "experiment",
            verdict.next_steps,
            "Experiments that would tell apart what these records leave open.",
        ),
        *_left_out(verdict),
        *_circumstances(verdict),
        TableSection("All blocks and records", columns, rows, caption=caption, folded=True),
    ]
    card = VerdictSection(
        "Verdict",
        verdict.verdict,
        " ".join(in_brief(verdict)),
        detail="\n\n".join(details_of(verdict)),
        headline=verdict.headline(),
        gap=verdict.gap(),
        after="with declared numbers let go" if let_go(verdict) else "with what was added",
        parts=tuple(parts),
    )
    text = (
        "Bench records against the declared model. Before: the declared model with its numbers refitted. "
        "After: the same model with what was added."
    )
    return [Chapter("Diagnosis", text), card]


def _blocks(verdict: Verdict) -> TableSection:
    """Return the table of blocks: where the model disagrees with the records."""
    rows = []
    for name in verdict.blocks:
        gap, kind = verdict.gap(name), kind_in_words(verdict.actuator, name)
        size = (typeset_number(each) for each in (gap.before, gap.after, gap.noise_floor))
        times = (typeset_number(each) for each in gap.times)
        unit = typeset_unit(gap.unit) or "1"
        rows.append((f"`{name}`{f', {kind}' if kind else ''}", *size, unit, *times))
    columns = ("block", "before", "after", "noise", "unit", "before / noise", "after / noise")
    which = "held-out" if verdict.gap().role == "held_out" else "fitted"
    caption = (
        "The machine, cut at the measured signals: error of each block, root mean square over the "
        f"{which} records. At 1 × noise nothing is missing there."
    )
    marked = frozenset([verdict.blocks.index(verdict.block)])
    return TableSection("Where", columns, tuple(rows), caption=caption, marked=marked)


def _error_figures(verdict: Verdict) -> list[Section]:
    """Return the error of each record, and one record over time, of the summed-up block."""
    gaps = [g for g in verdict.gaps if g.block == verdict.block]
    errors = [RecordError(g.record, g.before, g.after, g.noise_floor, g.role == "held_out") for g in gaps]
    course = verdict.course
    held = "held-out" if course.role == "held_out" else "fitted"
    heading = f"A {held} record: {course.record}"
    if verdict.gap().changed:
        when, model = "before and after", "as the model has it before and after"
    else:
        when = "of the refitted model, to which nothing was added"
        model = "as the refitted model has it, to which nothing was added"
    series = HeldOut(
        course.time, course.measured, course.before, course.after, course.quantity, course.unit, course.noise,
        heading,
    )  # fmt: skip
    return [
        FigureSection(
            f"Error of each record: {verdict.block}", gap_bars(errors, unit=gaps[0].unit),
            caption=f"Root mean square error {when}; the line across is what noise alone leaves.",
            means="Where a bar ends at the line, the model explains the record down to its noise. "
            "Records marked as held out were used by no fit.",
        ),
        FigureSection(
            heading, held_out_series(series),
            caption=f"Above: {course.quantity}, as measured and {model}. Below: the "
            "difference. Where a line is interrupted, samples do not count.",
            means="All curves have passed the filter of the block, so the errors in the legend are those "
            "of this record in the bars and tables.",
        ),
    ]  # fmt: skip


def _candidates(verdict: Verdict) -> list[Section]:
    """Return what each effect explains alone, and why it was not named."""
    if not verdict.runners_up:
        return []
    chosen = {effect.name for effect in verdict.effects}
    shares = [
        CandidateShare(title(name), share, name in chosen)
        for name, share, *_ in best_forms(verdict.runners_up)
    ]
    figure = FigureSection(
        "Effects tried first", candidate_shares(shares),
        caption="Share of the excess over the noise floor that each effect explains alone, in its best form.",
        means="A large share is not enough to be named: an effect must predict records that it was not "
        "fitted to, and better than its simpler form.",
    )  # fmt: skip
    caption = "Effects that help but are not named, and why."
    return [figure, *_list("Not named", "effect", verdict.tried_words(), caption)]


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
            caption="Mean of the filtered error in bins, over all records; noise alone leaves zero.",
        )
        for name in sorted(over, key=strength, reverse=True)[:_SHAPES]
    ]


def _with_unit_of(abscissa: str, model: FlatModel) -> str:
    """Return the label of an axis: the name of a signal, ``time`` or ``speed``, with its unit."""
    if abscissa == "time":
        return "time in s"
    if abscissa == "speed":
        units = dict.fromkeys(typeset_unit(body.domain.rate_unit) for body in model.bodies)
        return f"speed of the motion in {' or '.join(units) or 'rad/s or m/s'}"
    return f"{abscissa} in {typeset_unit(model.variable(abscissa).unit) or '1'}"


def fitted_table(numbers: Sequence[FittedNumber], how: str) -> list[Section]:
    """Return the table of refitted numbers, highlighted those that left what was declared."""
    if not numbers:
        return []
    rows = tuple(
        (
            n.name,
            compact(n.declared),
            f"± {100 * n.spread:.3g} %" if isinstance(n.spread, float) else n.spread,
            with_error(n.fitted, n.standard_error),
            typeset_unit(n.unit),
            f"{n.strain:+.2f}".replace("-0.00", "0.00").replace("-", "−"),
        )
        for n in numbers
    )
    beyond = frozenset(i for i, n in enumerate(numbers) if abs(n.strain) > _EDGE)
    caption = (
        f"Numbers that were declared with a spread, refitted {how}, with standard errors. The last column is "
        "how far each moved, in declared standard deviations: beyond 2 it is outside what was declared"
        f"{' (marked)' if beyond else '; none has'}."
    )
    columns = ("number", "declared", "spread", "refitted", "unit", "moved")
    return [TableSection("Refitted numbers", columns, rows, caption=caption, marked=beyond)]


def _left_out(verdict: Verdict) -> list[Section]:
    """Return what was masked, set aside or not compared, so that nothing is left out silently."""
    remarks = _list(
        "Done to the records",
        "remark",
        verdict.remarks,
        "Samples that were masked or set aside, files that were not read, and what was chosen by default.",
    )
    if not verdict.skipped:
        return remarks
    rows = tuple(
        (title(s.effect), s.location, " and ".join(map(title, s.beside)), s.reason) for s in verdict.skipped
    )
    columns = ("effect", "location", "beside", "reason")
    caption = "Effects that were left out of the comparison; each may still be there."
    return [*remarks, TableSection("What could not be compared", columns, rows, caption=caption)]


def _circumstances(verdict: Verdict) -> list[Section]:
    """Return records, deck, day and command, and the rule that decided."""
    sections: list[Section] = []
    if verdict.run is not None:
        caption = (
            f"Deck `{verdict.run.deck}`, records in `{verdict.run.folder}`, {verdict.run.date}, nlsdesign "
            f"{verdict.run.version}. To repeat it: `{verdict.run.command}`"
        )
        rows = tuple(
            (
                r.name,
                ROLES.get(r.role, r.role),
                compact(r.duration),
                str(r.samples),
                compact(r.rate),
                r.source,
            )
            for r in verdict.run.records
        )
        columns = ("record", "used", "duration in s", "samples", "samples per s", "file")
        sections.append(TableSection("Records, deck and command", columns, rows, caption=caption))
    settings = tuple(
        (s.name.replace("_", " "), str(s.value), s.meaning) for s in settings_of(verdict.criteria)
    )
    if settings:
        caption = "The rule that decided, with the value and meaning of each of its numbers."
        heads = ("criterion", "value", "meaning")
        sections.append(TableSection("Criteria", heads, settings, caption=caption, folded=True))
    return sections


def _gap_row(gap: RecordGap) -> tuple[str, ...]:
    numbers = (typeset_number(each) for each in (gap.before, gap.after, gap.noise_floor))
    times = typeset_number(gap.after / gap.noise_floor)
    return (
        gap.block,
        gap.record,
        ROLES.get(gap.role, gap.role),
        *numbers,
        typeset_unit(gap.unit) or "1",
        times,
    )


def _list(heading: str, column: str, texts: Sequence[str], caption: str) -> list[Section]:
    """Return a table of sentences; none where there are none."""
    rows = tuple((text,) for text in texts)
    return [TableSection(heading, (column,), rows, caption=caption)] if rows else []


def regeneration_sections(result: Regeneration, files: Mapping[Path, str]) -> list[Section]:
    """Return the chapter on the observer: torque error before and after, and the files."""
    sections: list[Section] = [
        Chapter(
            "Observer and controller from the better model",
            "The torque observer, designed from the declared (before) and from the better model (after). "
            "Both read the measured signals and are compared with the torque that the records show.",
        )
    ]
    if result.errors:
        sections += [_torque_errors(result), _table(result)]
    if result.course is not None:
        time, torque, before, after = result.course
        name = result.errors[0].record
        series = HeldOut(time, torque, before, after, result.quantity, result.unit, 0.0, f"Record {name}")
        sections.append(
            FigureSection(
                f"Estimated torque: {name}", held_out_series(series),
                caption=f"Above: {result.quantity}, as measured and as both observers estimate it. "
                "Below: the errors, unfiltered.",
                assumed="The measured torque is what the better model says is behind the readings.",
            )
        )  # fmt: skip
    if result.controller:
        rows = [sine.shown() for sine in result.controller.sines]
        columns = ("amplitude in N·m", "frequency in Hz", "before in N·m", "after in N·m")
        caption = (
            "Root mean square torque error of the better model over the last periods of a sine of the wanted "
            "torque, under observer and controller of the declared model and those of the better one. "
            f"{result.controller.words()[1]}"
        )
        sections.append(TableSection("Tracking of the torque", columns, tuple(rows), caption=caption))
    if result.reasons:
        reasons = tuple((reason,) for reason in result.reasons)
        caption = "Why something is lacking here."
        sections.append(TableSection("Not done", ("reason",), reasons, caption=caption))
    if files:
        sections.append(FileSection("Files", files, caption="Written beside this report."))
    return sections


def _torque_errors(result: Regeneration) -> NumbersSection:
    unit = typeset_unit(result.unit)
    before, after = (three_digits(each) for each in result.nominal)
    numbers = [KeyNumber("torque error, nominal numbers", f"{before} → {after} {unit}", "before → after")]
    if result.spread_before and result.spread_after:
        before, after = (three_digits(each) for each in result.over_spread)
        counts = f"{len(result.spread_before)} and {len(result.spread_after)} draws"
        note = f"declared spreads → covariance of the fit, {counts}"
        numbers.append(KeyNumber("torque error over the spread", f"{before} → {after} {unit}", note))
    if result.corrected:
        before, after = (three_digits(each) for each in result.learning)
        note = "learns on each record, begun at the numbers of its model"
        numbers.append(KeyNumber("corrected observer", f"{before} → {after} {unit}", note))
    return NumbersSection("Torque error", tuple(numbers))


def _table(result: Regeneration) -> TableSection:
    unit = typeset_unit(result.unit)
    rows = tuple(
        (
            kind,
            e.record,
            e.role.replace("_", " "),
            three_digits(e.before),
            three_digits(e.after),
            three_digits(e.torque),
        )
        for kind, errors in (("cascade", result.errors), ("corrected", result.corrected))
        for e in errors
    )
    columns = ("observer", "record", "used", f"before in {unit}", f"after in {unit}", f"torque in {unit}")
    caption = (
        "Root mean square error of the estimated torque, and the torque itself; the cascade with nominal "
        "numbers, the corrected one begun with them."
        + (f" Generated is the {result.chosen}." if result.chosen else "")
    )
    return TableSection("Torque error of each record", columns, rows, caption=caption)
