"""What a decision rests on, and other ways to read its records: inputs, their noise, shifted motions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from ...components import Assembly
from ...model import flatten
from ..identification.equation_error.block import Block
from ..identification.equation_error.evidence import Bench
from ..identification.equation_error.inferred_sampling import Missing, no_terms, plain_terms
from ..identification.records.measurement import RecordSet
from .effects import Candidate
from .effects.effect import EffectFunction
from .effects.sensing import delays
from .reporting.refit import sourced
from .screening.scale_and_sign import typical_sizes
from .selection.comparison import Comparison
from .selection.criteria import Change, Criteria, is_complete
from .selection.hypothesis import Hypothesis, excesses
from .selection.measures import Excesses
from .selection.search import Outcome, search
from .tearing import blocks_of

_EARLY = 1.2
"""Samples by which a motion is read too early where its delay is looked for: more than a shift can be."""
_SAME_SAMPLING = 0.1
"""Samples by which an input may be read otherwise without a second look at everything."""


_Delayed: TypeAlias = "tuple[str, Case, Hypothesis]"
"""A motion, the case in which it is read too early, and its delay fitted."""


@dataclass(frozen=True, eq=False)
class Case:
    """What a decision rests on: the declared assembly, the records that choose, and the rule."""

    actuator: Assembly
    bench: Bench
    comparison: Comparison
    criteria: Criteria
    settled: bool = False  # whether inputs are read as they run beside what was found already
    begun: list[_Delayed] = field(default_factory=list, repr=False)  # what _delayed gives, once it was asked

    def excesses(self, hypothesis: Hypothesis) -> Excesses:
        """Return the excess of each block on all samples."""
        return excesses(hypothesis, self.bench, self.criteria)

    def read_as_declared(self, base: Hypothesis) -> tuple[Case, Hypothesis]:
        """Return the case and its fit, with inputs read between their samples as the declared machine asks.

        Where it then leaves nothing, it lacks nothing: what a shift within a sample explains is no effect. It
        must explain as much of each block as effects must. Else both stay as they are.
        """
        before = self.excesses(base)
        if _leaves_nothing(before):
            return self, base
        for other in self._readings_of_declared():
            again = other.comparison.base(self.actuator)
            after = other.excesses(again)
            least = min(Change(self.criteria, before, after).shares.values(), default=1.0)
            if _leaves_nothing(after) and least >= self.criteria.closed_share:
                return other, again
        return self, base

    def _readings_of_declared(self) -> Iterator[Case]:
        """Yield the case as the declared machine asks, and with a motion shifted if that leaves nothing."""
        other = self._read_as(self.bench.inferred(_blocks(self, self.actuator), no_terms), 0.0)
        if other is not None:
            yield other
        for signal, early, beside in self._delayed():
            closes = _leaves_nothing(early.excesses(beside))
            if closes and (shifted := self._shifted(signal, early, beside)) is not None:
                yield shifted

    def read_as_inferred_beside(self, outcome: Outcome, verdict: str) -> Case | None:
        """Return the case with inputs read between their samples as records tell it beside what was found.

        Backlash that nobody declared, for instance, hides at first that a current is held. Where what was
        named leaves no block open, it is asked as if nothing were missing: plain terms would hide a shift.
        Where nothing may be named, it is asked so beside the best that closes every block: inputs that are
        read half a sample early spoil the quickest record, and a right name with it. Nothing is returned
        where the inputs are read so already.
        """
        if outcome.steps:
            return self._read_beside(outcome.last, no_terms if outcome.complete else plain_terms)
        if verdict not in ("unknown", "undecidable"):
            return None
        fitted = (each.hypothesis for each in outcome.tried)
        closing = next((each for each in fitted if is_complete(self.excesses(each))), None)
        return self._read_beside(closing, no_terms) if closing else None

    def read_in_turn(self, effects: Sequence[EffectFunction], progress: Callable[[str], None]) -> Case | None:
        """Return the case with a motion read as much earlier or later as leaves nothing, if there is one.

        Effects are searched for beside a delay of that motion.
        """
        for signal, early, beside in self._delayed():
            progress(f"looking for effects beside a shift of {signal}")
            outcome = search(early.comparison, beside, effects, self.criteria, progress)
            if outcome.complete:
                return self._shifted(signal, early, outcome.last)
        return None

    def read_with_noise_beside(self, outcome: Outcome) -> Case | None:
        """Return the case with inputs whose noise has the colour that what was named leaves, if it shows one.

        What is missing goes with the motion and hides it at first: then noise counts as white.
        """
        if not outcome.steps:
            return None
        bench = self.bench.coloured_beside(_blocks(self, outcome.last.fitted))
        return case_of(self.actuator, bench, self.criteria) if bench is not None else None

    def _delayed(self) -> list[_Delayed]:
        """Return each motion that may be shifted, the case in which it is read too early, and its delay.

        It is read earlier than two channels of one recorder can be shifted, so that what is left is a delay.
        The hold of an input is told beside it: alone each would take from the other.
        """
        for signal in () if self.begun else self.bench.shiftable:
            delay = next((c for c in delays(self.actuator) if f"{c.location}.reading" == signal), None)
            cases = (
                self._with_records(self.bench.shifted(signal, _EARLY, form)) for form in self.bench.forms
            )
            begun = [(case, _beginning_with(case, delay)) for case in cases if delay]
            fitted = [(case, beside) for case, beside in begun if beside is not None]
            if not (delay and fitted):
                continue
            early, beside = min(
                fitted, key=lambda each: sum(e.chi2 for e in each[0].excesses(each[1]).values())
            )
            read = early.bench.inferred(_blocks(self, sourced(beside)), no_terms)
            other = early._read_as(read, _SAME_SAMPLING)
            again = _beginning_with(other, delay) if other else None
            self.begun.append((signal, other, again) if other and again else (signal, early, beside))
        return self.begun

    def _shifted(self, signal: str, early: Case, beside: Hypothesis) -> Case | None:
        """Return the case with a motion read as late as its delay says, beyond how early it was read."""
        step = min(record.step for record in self.bench.records.records)
        late = _EARLY - beside.values[beside.added[0].unknowns[0].name] / step
        return self._with_records(early.bench.shifted(signal, late)) if abs(late) > _SAME_SAMPLING else None

    def is_read_otherwise_beside(self, hypothesis: Hypothesis) -> bool:
        """Tell whether inputs run otherwise beside what is named so far than they were read.

        Then what a block still lacks is that shift before it is an effect. It is not asked beside a lag,
        which may stand for the shift itself.
        """
        if self.settled or hypothesis.newest.explains_lag:
            return False
        return self._read_beside(hypothesis, plain_terms) is not None

    def _read_beside(self, hypothesis: Hypothesis, lacks: Missing) -> Case | None:
        return self._read_as(self.bench.inferred(_blocks(self, hypothesis.fitted), lacks), _SAME_SAMPLING)

    def _read_as(self, records: RecordSet, least: float) -> Case | None:
        """Return the case with inputs read otherwise; nothing where none moves by more samples than that."""
        moved = (
            abs(now.sampling.late - then.sampling.late)
            for then, now in zip(self.bench.records.columns, records.columns, strict=True)
            if then.sampling and now.sampling
        )
        if max(moved, default=0.0) <= least:
            return None
        return self._with_records(records)

    def _with_records(self, records: RecordSet) -> Case:
        return case_of(self.actuator, self.bench.read_otherwise(records), self.criteria)


def case_of(actuator: Assembly, bench: Bench, criteria: Criteria) -> Case:
    """Return the case of a declared assembly on a bench."""
    return Case(actuator, bench, Comparison(bench, typical_sizes(actuator, bench.records)), criteria)


def _beginning_with(case: Case, candidate: Candidate) -> Hypothesis | None:
    """Fit an effect to the declared machine."""
    return case.comparison.with_effect(case.comparison.base(case.actuator), candidate)


def _blocks(case: Case, assembly: Assembly) -> Sequence[Block]:
    """Return the blocks of a machine between the signals that were measured."""
    return blocks_of(flatten(assembly), case.bench.records.signals)


def _leaves_nothing(left: Excesses) -> bool:
    """Tell whether no block and no declared number is open."""
    return not any(each.open for each in left.values())
