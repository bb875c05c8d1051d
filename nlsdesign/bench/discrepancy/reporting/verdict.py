"""What a diagnosis says, for people and for programs: the verdict, with the gap on each record."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.arrays import Array
from ....foundation.quantity import significant, three_digits, typeset_unit
from ....model import flatten
from ...identification.equation_error.block_noise import rate_span
from ...identification.filters import derivative
from ...identification.least_squares import Fit
from ...identification.residuals import Binned, agreement, shapes
from ..effects.plain_names import capitalised, simpler_forms, title
from ..planning.experiment import Experiment
from ..screening.scale_and_sign import Acting
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from ..selection.measures import DECLARED
from ..selection.trials import Skipped
from .circumstances import DiagnosisRun, settings_of
from .fitted_numbers import fitted_numbers
from .named_effect import (
    CONTRADICTION,
    LET_GO,
    STRAINED,
    Numbers,
    as_sentence,
    listed_numbers,
    numbers_in_words,
)
from .named_effect import NamedEffect as NamedEffect
from .remainder import Remainder

HEADLINES: Mapping[str, str] = {
    "none": "Nothing is missing",
    "unknown": "Something is missing that has no name in the catalogue",
    "undecidable": "These records cannot tell what is missing",
    "data_suspect": "The records are suspect",
}
"""What a verdict says in one line, where it names no effect."""
EXPLANATIONS: Mapping[str, str] = {
    "none": "The refitted model explains the records down to their noise; nothing is missing.",
    "unknown": "Something is missing; what was tried and how far it goes is listed below.",
    "undecidable": "An effect may be missing, but these records cannot tell which; see below what was tried.",
    "data_suspect": "The records are suspect, so nothing is named; look at the data first.",
}
_NOT_NAMED = "too little, or not surely enough, to be named under the criteria of this diagnosis"
_HELPS = 0.005
"""Share of the excess below which an effect helps by less than half a per cent and is not listed."""


class Gap(NamedTuple):
    """Error of the summed-up block before and after, root mean square, all in one unit."""

    # block, role: which block, on the records of which role
    block: str
    role: str
    # before, after, noise_floor, signal: errors, noise floor, and standard deviation of what the error is a
    # part of
    before: float
    after: float
    noise_floor: float
    signal: float
    unit: str
    beside: str  # name of what the error is a part of

    @property
    def times(self) -> tuple[float, float]:
        """Errors over the noise floor, before and after."""
        return self.before / self.noise_floor, self.after / self.noise_floor

    @property
    def shares(self) -> tuple[float, float]:
        """Errors as shares of what they are a part of, before and after."""
        return self.before / self.signal, self.after / self.signal

    @property
    def changed(self) -> bool:
        """Whether anything was added that changes the error."""
        return self.before != self.after

    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """Return before, after and in what: times the noise, in the unit, as a share."""
        before, after = (three_digits(each) for each in self.times)
        result = [(before, after, "times the noise")]
        result.append((three_digits(self.before), three_digits(self.after), typeset_unit(self.unit) or "1"))
        if math.isfinite(self.signal) and self.signal > 0.0:
            before, after = (f"{three_digits(100.0 * each)} %" for each in self.shares)
            name = self.beside if "." in self.beside else f"the {self.beside}"
            result.append((before, after, f"of {name}"))
        return tuple(result)

    def words(self) -> str:
        """Return the error in one sentence, before and after where something was added."""
        which = "held-out" if self.role == "held_out" else "fitted"
        steps = ", ".join(f"{a} → {b} {u}" if self.changed else f"{a} {u}" for a, b, u in self.rows())
        return f"Error of `{self.block}` on {which} records{', before → after' * self.changed}: {steps}."


@dataclass(frozen=True)
class RecordGap:
    """Error of one block on one record before and after, in the unit of the block."""

    block: str
    record: str
    role: str
    before: float
    after: float
    noise_floor: float
    rows: int
    unit: str
    signal: float = math.nan
    beside: str = ""
    relative: float = math.nan  # average percent relative error after, beside what the block is judged by


@dataclass(frozen=True, eq=False)
class Course:
    """One record over time: measured, predicted before and after, all through the filter of the block."""

    record: str
    # quantity, unit: what is shown: a measured signal, or the effort of the drive beside the one that the
    # model needs
    quantity: str
    unit: str
    time: Array  # in s, shape (n,)
    # measured, before, after: in the unit, shape (n,) each; the rms of the differences are those of RecordGap
    measured: Array
    before: Array
    after: Array
    noise: float  # standard deviation of the filtered noise, in the unit
    role: str = "held_out"


@dataclass(frozen=True, eq=False)
class Verdict:
    """The outcome of a diagnosis.

    Parameters
    ----------
    verdict
        ``none``, ``named``, ``unknown``, ``undecidable`` or ``data_suspect``.
    effects
        In the order in which they were added.
    where
        Findings in words, one per block, and what is odd about the data.
    gaps
        Error of every block on every record.
    block
        The block that was furthest from its noise floor; errors are summed up for it.
    runners_up
        Effect and share of the excess that it would have explained, best first; perhaps why it was not named,
        or an empty text, and its numbers as those of a :class:`NamedEffect`.
    actuator
        The refitted assembly with the effects.
    declared
        The refitted assembly without them.
    course
        A held-out record over time.
    unidentified
        What the records cannot tell, in words.
    shapes
        Residual of the summed-up block before and after, over every measured signal, frequency, time and
        direction.
    fits
        Numbers of the better model with their covariance, one for each group of blocks that share some.
    remainder
        What is left without a name in the block that is furthest from its floor; ``None`` if nothing is.
    next_steps
        What to measure next to tell apart what these records cannot.
    skipped
        Effects that were left out of the comparison, and why: too expensive, or not converged.
    complete
        Whether what was named explains all; otherwise there is a remainder.
    criteria
        The rule that decided, a frozen dataclass.
    remarks
        What was done to the records or left out, in sentences.
    run
        Records, deck, day and command; ``None`` where a program asked.
    unnamed
        Tables in the place of effects that have no name.
    experiment
        The record that would tell apart what these do not; ``None`` where nothing is to be told apart.
    """

    verdict: str
    effects: tuple[NamedEffect, ...]
    where: tuple[str, ...]
    gaps: tuple[RecordGap, ...]
    block: str
    runners_up: tuple[tuple[Any, ...], ...]
    actuator: Assembly
    declared: Assembly
    course: Course
    unidentified: tuple[str, ...] = ()
    shapes: Mapping[str, tuple[Binned, Binned]] = field(default_factory=dict)
    fits: tuple[Fit, ...] = ()
    remainder: Remainder | None = None
    next_steps: tuple[str, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    complete: bool = True
    criteria: Any = None
    remarks: tuple[str, ...] = ()
    run: DiagnosisRun | None = None
    unnamed: tuple[NamedEffect, ...] = ()
    experiment: Experiment | None = None

    def rms(self, which: str, role: str) -> float:
        """Return the rms error of the summed-up block over the records of a role.

        Parameters
        ----------
        which
            ``before``, ``after``, ``noise_floor`` or ``signal``.
        role
            ``fit`` or ``held_out``.
        """
        return rms_over([g for g in self.gaps if g.block == self.block and g.role == role], which)

    @property
    def held_out_ratio(self) -> float:
        """Held-out error over the noise floor, after."""
        return self.rms("after", "held_out") / self.rms("noise_floor", "held_out")

    @property
    def closed(self) -> float:
        """Share of the held-out excess (in mean square) that is gone."""
        floor = self.rms("noise_floor", "held_out") ** 2
        before, after = (max(0.0, self.rms(w, "held_out") ** 2 - floor) for w in ("before", "after"))
        return 1.0 - after / before if before > 0.0 else 0.0

    @property
    def blocks(self) -> tuple[str, ...]:
        """Names of the blocks."""
        return tuple(dict.fromkeys(g.block for g in self.gaps))

    def gap(self, block: str = "") -> Gap:
        """Return the error of a block before and after, on the records that are assessed.

        Parameters
        ----------
        block
            Name; by default that of the summed-up block.
        """
        name = block or self.block
        own = [g for g in self.gaps if g.block == name]
        seen = [g for g in own if g.role == "held_out"] or own
        before, after, floor, signal = (
            rms_over(seen, which) for which in ("before", "after", "noise_floor", "signal")
        )
        return Gap(name, seen[0].role, before, after, floor, signal, seen[0].unit, seen[0].beside)

    @property
    def findings(self) -> tuple[str, ...]:
        """What was noticed besides the errors of the blocks, in sentences."""
        errors = tuple(f"{name} ({state})" for name in self.blocks for state in ("open", "closed"))
        return tuple(text for text in self.where if not text.startswith(errors))

    def headline(self) -> str:
        """Return the verdict in one line."""
        if self.verdict == "named":
            effects = " and ".join(e.headline(self.actuator) for e in self.effects)
            return capitalised(effects)
        return LET_GO[0] if let_go(self) else HEADLINES[self.verdict]

    def paragraphs(self) -> tuple[str, ...]:
        """Return the verdict in words: what was found, each effect, what is left."""
        sentences = [] if self.verdict == "named" else [_explanation(self)]
        if let_go(self):
            sentences = [LET_GO[1]]
        sentences += [as_sentence(reason) for reason in suspicions(self)]
        if self.verdict == "none" and self.unidentified:
            sentences.append(
                f"They leave {len(self.unidentified)} of its numbers or combinations of them open, so they "
                "would not show all that could be missing."
            )
        sentences += [effect.words(self.actuator) + _why_richer(self, effect) for effect in self.effects]
        if self.effects and not self.complete:
            sentences.append(
                "That is not all: an error beyond the noise is left, for which there is no name."
            )
        sentences += [
            f"What has no name at `{each.location}` was added as a smooth table: it predicts what it was not "
            "fitted to, within the range of these records and nowhere else."
            for each in self.unnamed
        ]
        if self.remainder is not None:
            sentences.append(self.remainder.words())
        return tuple(sentences)

    def words(self) -> str:
        """Return the verdict in a few sentences."""
        return " ".join(self.paragraphs())

    def tried_words(self) -> tuple[str, ...]:
        """Return a sentence for each effect that helps and is not named: how much, and why not."""
        named = {effect.name for effect in self.effects}
        sentences = []
        for name, share, *why in best_forms(self.runners_up):
            if name in named or not share > _HELPS:
                continue
            alone = (
                f"{title(name)} alone explains {three_digits(100.0 * share)} % of the excess over the noise"
            )
            reason = (why and why[0]) or _why_not(self, name, named)
            numbers = f", with {numbers_in_words(why[1])}" if why[1:] and why[1] else ""
            sentences.append(f"{capitalised(alone)}{numbers}: {reason}.")
        return tuple(sentences)

    def to_dict(self, model: str = "model.toml") -> dict[str, Any]:
        """Return the content of ``verdict.json``.

        Parameters
        ----------
        model
            Path of the deck of the better model.
        """
        gap = self.gap()
        measured = {
            "error": {
                "unit": gap.unit,
                "block": self.block,
                "noise_floor": self.rms("noise_floor", "held_out"),
                **{
                    role: {when: self.rms(when, role) for when in ("before", "after")}
                    for role in ("fit", "held_out")
                },
                "signal": {"name": gap.beside, "rms": gap.signal},
            },
            "runners_up": [_runner_up(*each) for each in self.runners_up],
            "remainder": None if self.remainder is None else self.remainder.to_dict(),
            "records": [asdict(each) for each in self.gaps],
        }
        content = {
            "verdict": self.verdict,
            "headline": self.headline(),
            "complete": self.complete,
            "effects": [{**e.to_dict(), "title": e.headline(self.actuator)} for e in self.effects],
            "where": [*(self.gap(name).words() for name in self.blocks), *self.findings],
            **_rounded(measured, 6),
            "skipped": [
                {"name": s.effect, "location": s.location, "beside": list(s.beside), "reason": s.reason}
                for s in self.skipped
            ],
            "remarks": list(self.remarks),
            "unidentified": list(self.unidentified),
            "next": list(self.next_steps),
            "experiment": None if self.experiment is None else self.experiment.to_dict(),
            "unnamed": [each.to_dict() for each in self.unnamed],
            "numbers": [n._asdict() for n in fitted_numbers(self.fits)],
            "criteria": {
                each.name: {"value": each.value, "meaning": each.meaning}
                for each in settings_of(self.criteria)
            },
            "run": None if self.run is None else self.run.to_dict(),
            "model": model,
        }
        written: dict[str, Any] = _rounded(content, 9)
        return written

    def __str__(self) -> str:
        return "\n".join(
            [
                f"verdict: {self.verdict}",
                *in_brief(self),
                "In detail:",
                *(self.gap(name).words() for name in self.blocks),
                *details_of(self),
                *(each for each in self.findings if each not in suspicions(self)),
                *(self.tried_words() if self.verdict != "named" or not self.complete else ()),
                *self.remarks,
                *(f"not compared: {each}" for each in self.skipped),
                *self.next_steps,
            ]
        )


def _explanation(verdict: Verdict) -> str:
    """Return what a verdict without a name means; that a record would tell only where one is proposed."""
    if verdict.verdict == "undecidable" and verdict.experiment is not None:
        return "Several effects explain these records about as well; the proposed record would tell."
    return EXPLANATIONS.get(verdict.verdict, "")


def in_brief(verdict: Verdict) -> tuple[str, ...]:
    """Return the verdict in at most three sentences: what is missing, what that changes, what is next."""
    gap = verdict.gap()
    before, after = (three_digits(each) for each in gap.times)
    records = "held-out" if gap.role == "held_out" else "fitted"
    where = f"the error of `{gap.block}` on {records} records"
    sentences = [LET_GO[1] if let_go(verdict) else _explanation(verdict)]
    if verdict.verdict == "named":
        one = len(verdict.effects) == 1
        numbers = "; ".join(e.numbers_in_words() for e in verdict.effects if e.parameters)
        sentences = [
            f"{verdict.headline()} {'is' if one else 'are'} missing from the deck"
            + (f": {numbers}." if numbers else ".")
        ]
        rest = "" if verdict.complete else ", so something without a name is left"
        change = f"falls from {before} to {after} times the noise{rest}"
        sentences.append(f"With {'it' if one else 'them'} {where} {change}.")
        chance = min((e.probability for e in verdict.effects), default=math.nan)
        if math.isfinite(chance):
            there = "It is there with a probability of" if one else "Each is there with at least probability"
            sentences.append(f"{there} {chance:.3g}.")
    elif verdict.verdict == "data_suspect":
        sentences += [as_sentence(reason) for reason in suspicions(verdict)[:1]]
    else:
        sentences.append(f"{capitalised(where)} is {after} times the noise.")
        sentences += [as_sentence(step) for step in verdict.next_steps[:1]]
    return tuple(sentences)


def details_of(verdict: Verdict) -> tuple[str, ...]:
    """Return the verdict in words, without the sentences of :func:`in_brief`."""
    brief = in_brief(verdict)
    return tuple(each for each in verdict.paragraphs() if each not in brief)


def let_go(verdict: Verdict) -> bool:
    """Return whether the records contradict declared numbers, and other numbers explain them."""
    changed = verdict.verdict == "data_suspect" and any(verdict.gap(name).changed for name in verdict.blocks)
    return changed or any(text.startswith(STRAINED) for text in suspicions(verdict))


def suspicions(verdict: Verdict) -> tuple[str, ...]:
    """Return why records or deck are suspect, in sentences; none with another verdict."""
    if verdict.verdict != "data_suspect":
        return ()
    return tuple(text for text in verdict.findings if not text.startswith(f"{DECLARED}:"))


def best_forms(tried: Sequence[tuple[Any, ...]]) -> tuple[tuple[Any, ...], ...]:
    """Return of each effect the form or place that explains most: one name stands for all of them."""
    best: dict[str, tuple[Any, ...]] = {}
    for each in tried:
        best.setdefault(each[0], each)
    return tuple(best.values())


def _runner_up(name: str, share: float, reason: str = "", numbers: Numbers | None = None) -> dict[str, Any]:
    return (
        {"name": name, "share": share}
        | ({"reason": reason} if reason else {})
        | ({"parameters": listed_numbers(numbers)} if numbers else {})
    )


def _why_not(verdict: Verdict, name: str, named: Collection[str]) -> str:
    nested = [simple for simple in simpler_forms(verdict.declared, name) if simple in named]
    if nested:
        return f"{title(nested[0])}, its simpler form, predicts as well"
    if verdict.verdict == "data_suspect":
        return CONTRADICTION
    return "what was named accounts for it" if named and verdict.complete else _NOT_NAMED


def _why_richer(verdict: Verdict, effect: NamedEffect) -> str:
    """Return why an effect was named and not its simpler form, from what each explains alone."""
    shares = {name: share for name, share, *_ in verdict.runners_up}
    simple = next((s for s in simpler_forms(verdict.declared, effect.name) if s in shares), None)
    if simple is None or effect.name not in shares:
        return ""
    left, own = (three_digits(100.0 * (1.0 - shares[n])) for n in (simple, effect.name))
    return (
        f" {capitalised(title(simple))}, its simpler form, alone leaves {left} % of the excess over the "
        f"noise, {title(effect.name)} {own} %."
    )


def rms_over(gaps: Sequence[RecordGap], which: str) -> float:
    """Return the root mean square over several records, each sample counted once."""
    total = sum(g.rows for g in gaps)
    # An exact sum, so that the order of the records makes no difference.
    squares = math.fsum(getattr(g, which) ** 2 * g.rows for g in gaps)
    return math.sqrt(squares / total) if total else math.nan


def _rounded(content: Any, digits: int) -> Any:
    """Return numbers in any nest as they are written: the last digits mean nothing, JSON has no infinity."""
    if isinstance(content, float):
        return significant([content], digits)[0] if math.isfinite(content) else None
    if isinstance(content, Mapping):
        return {key: _rounded(value, digits) for key, value in content.items()}
    return [_rounded(each, digits) for each in content] if isinstance(content, (list, tuple)) else content


def gaps_of(before: Hypothesis, after: Hypothesis, comparison: Comparison) -> tuple[RecordGap, ...]:
    """Return the error of every block on every record, the records in the order in which they were given."""
    gaps = []
    acting = Acting(comparison.bench, flatten(before.fitted))
    for then, now in zip(comparison.judged(before), comparison.judged(after), strict=True):
        first, last, floor = (
            float(np.sqrt(np.mean(np.square(r)))) for r in (then.error, now.error, then.floor.sigma)
        )
        name, record, unit = then.block.name, then.record, then.block.model.outputs[0].unit
        acts = acting.filtered(then)
        size, relative = float(np.std(acts)), agreement(acts, acts - now.error).relative
        rows, beside = len(then.residual), acting.name(then.block)
        gap = RecordGap(
            name, record.name, record.role, first, last, floor, rows, unit, size, beside, relative
        )
        gaps.append(gap)
    blocks, given = list(dict.fromkeys(g.block for g in gaps)), comparison.bench.given_order
    return tuple(sorted(gaps, key=lambda gap: (blocks.index(gap.block), given[gap.record])))


def course_of(before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str) -> Course:
    """Return a held-out record of a block over time; the one with the largest error before.

    Everything passes the filter of the block, so that the errors are those of :func:`gaps_of`.
    """
    pairs = zip(comparison.judged(before), comparison.judged(after), strict=True)
    own = [(a, b) for a, b in pairs if a.block.name == block]
    held = [pair for pair in own if pair[0].record.role == "held_out"] or own
    then, now = max(held, key=lambda pair: float(np.mean(np.square(pair[0].error))))
    acting = Acting(comparison.bench, flatten(before.fitted))
    measured = acting.filtered(then)
    return Course(
        then.record.name,
        acting.name(then.block),
        then.block.model.outputs[0].unit,
        then.record.trace.time[then.floor.places],
        measured,
        measured - then.error,
        measured - now.error,
        float(np.sqrt(np.mean(np.square(then.floor.sigma)))),
        then.record.role,
    )


def shapes_of(
    before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str
) -> dict[str, tuple[Binned, Binned]]:
    """Return the residual of a block over every measured signal, before and after, from all records."""
    first, last = (_shapes(h, comparison, block) for h in (before, after))
    return {name: (first[name], last[name]) for name in first if name in last}


def _shapes(hypothesis: Hypothesis, comparison: Comparison, block: str) -> dict[str, Binned]:
    bench = comparison.bench
    judged = [e for e in comparison.judged(hypothesis) if e.block.name == block]
    error = np.concatenate([e.error for e in judged])

    def gathered(signal: str, order: int) -> Array:
        span = rate_span(bench.records.records, signal) if order else 0.0
        rows = [
            derivative(e.record.trace[signal], e.record.step, order=order, span=span)[e.floor.places]
            for e in judged
        ]
        return np.concatenate(rows)

    signals = {s: gathered(s, 0) for s in bench.records.signals}
    motion = next((s for s in bench.records.signals if bench.noise.rounded[s]), bench.records.signals[0])
    time = np.concatenate([(e.record.trace.time - e.record.trace.time[0])[e.floor.places] for e in judged])
    return shapes(
        error, signals, speed=gathered(motion, 1), time=time, step=bench.block_noise[block].filters.spacing
    )
