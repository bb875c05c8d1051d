"""The whole chain: refit, locate, name, add, refit, judge on records that no fit has seen, abstain.

Each hypothesis is fitted to the same records in the same way; what decides is how well it predicts records
that its numbers were not fitted to, in units of the noise, by one rule (``docs/decision.md``). Records with
the role ``held_out`` take no part: they are read once, when the verdict stands, for the error it reports.

To understand why an effect was named, read on in ``selection/search.py``, what is tried and in which order,
and in ``selection/criteria.py``, which decides.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

from ...components import Assembly
from ...components.assembly.deck_writer import write_deck
from ...foundation.errors import ConvergenceError, MeasurementError
from ...foundation.text_files import discard, make_folder, write_text
from ...model import flatten
from ...model.origin import derived
from ..identification.equation_error.block_noise import LEAST_COVERED
from ..identification.equation_error.evidence import Bench, covered
from ..identification.least_squares import Fit
from ..identification.records.measurement import RecordSet
from .case import Case, case_of
from .effects import Candidate
from .effects import catalogue as known_effects
from .effects.effect import EffectFunction
from .fitting import Key
from .planning.experiment import Experiment, next_experiment, write_command
from .reporting.advice import advice, more_excitation, where_they_differ
from .reporting.named_effect import STRAINED, EffectEvidence
from .reporting.refit import Refit, sourced
from .reporting.remainder import Remainder, remainder_of
from .reporting.verdict import NamedEffect, Verdict, course_of, gaps_of, shapes_of
from .screening.causality import lagging_forces, modes_too_quick
from .screening.misread_columns import misread_findings
from .screening.scale_and_sign import drive_findings, limit_findings, scale_findings
from .screening.wrong_numbers import (
    far_numbers,
    is_explained_by_numbers,
    other_numbers,
    out_of_reach,
    sentence_of,
    with_numbers_let_go,
    wrong_numbers,
)
from .selection.comparison import Comparison
from .selection.criteria import CALIBRATION, Criteria, is_complete
from .selection.hypothesis import Hypothesis
from .selection.measures import DECLARED, Excess, Excesses, Standing, standing_of
from .selection.search import Outcome, search, with_what_has_no_name
from .selection.trials import Step, without_twins
from .tearing import blocks_of

_CRITERIA = Criteria()
_MOST_OF_IT = 0.5
"""Share of the effort left beyond which columns are asked about before effects, few of which are as large."""
_RUNNERS_UP, _MOST_ALIASES = 6, 3
"""So many of each are shown; a longer list is not read."""


@dataclass(frozen=True)
class _Decision:
    """The verdict in one word, and what makes the records suspect in sentences."""

    verdict: Literal["none", "named", "unknown", "undecidable", "data_suspect"]
    findings: tuple[str, ...] = ()


def _silent(text: str) -> None:
    """Say nothing."""


def diagnose(
    actuator: Assembly,
    records: RecordSet,
    *,
    catalogue: Sequence[EffectFunction] | None = None,
    criteria: Criteria = _CRITERIA,
    progress: Callable[[str], None] = _silent,
) -> Verdict:
    """Find out what a declared model lacks.

    Parameters
    ----------
    actuator
        As declared; the spreads of its numbers say how far a refit may move them.
    records
        Bench records with their roles.
    catalogue
        Effects to try; functions from an assembly to candidates. By default all, with those of packages that
        the present block is extended by.
    criteria
        Numbers of the decision rule.
    progress
        Told what is being tried.

    Returns
    -------
    Verdict
        With the refitted, augmented assembly; the same for the same records.

    Raises
    ------
    MeasurementError
        If the records do not fit the model, or nothing moves enough to say anything.
    ConvergenceError
        If the declared model cannot be refitted.
    """
    progress("refitting the declared model")
    too_quick = modes_too_quick(actuator, max(record.step for record in records.records))
    records = replace(records, remarks=(*records.remarks, *too_quick))
    chosen_by = records.without_held_out()
    case = case_of(actuator, Bench(chosen_by, blocks_of(flatten(actuator), records.signals)), criteria)
    case, base = case.read_as_declared(case.comparison.base(actuator))
    effects = known_effects() if catalogue is None else catalogue
    answer = _Answer(case, base, *_decided(case, base, effects, progress, measured=chosen_by))
    other = answer.case.read_as_inferred_beside(answer.outcome, answer.decision.verdict)
    if other is not None:
        progress("reading inputs between their samples as they run beside what was found")
        anew = _answer_anew(other, effects, progress)
        answer = anew if answer.outcome.steps or anew.outcome.steps else answer
    if answer.leaves_something:
        turned = answer.case.read_in_turn(effects, progress)
        anew = _answer_anew(turned, effects, progress) if turned is not None else answer
        answer = answer if anew.leaves_something else anew
    if answer.leaves_something and (noisy := answer.case.read_with_noise_beside(answer.outcome)):
        progress("judging by the noise of inputs that shows beside what was found")
        anew = _answer_anew(noisy, effects, progress)
        answer = answer if anew.leaves_something else anew
    if answer.leaves_something:
        progress("reading columns otherwise than is stated")
        misread = misread_findings(actuator, chosen_by, answer.case.comparison, answer.base)
        if misread:
            decision = _Decision("data_suspect", tuple(str(f) for f in misread))
            answer = answer._replace(outcome=Outcome(answer.base), decision=decision)
    progress("reading the held-out records")
    return _verdict(answer, records)


class _Answer(NamedTuple):
    """What was decided, and what it rests on: the case and the fit of the declared machine."""

    case: Case
    base: Hypothesis
    outcome: Outcome
    decision: _Decision

    @property
    def leaves_something(self) -> bool:
        """Whether some block stays open for which no declared number or record is to blame."""
        return not self.outcome.complete and self.decision.verdict in ("named", "unknown", "undecidable")


def _answer_anew(case: Case, catalogue: Sequence[EffectFunction], progress: Callable[[str], None]) -> _Answer:
    """Return the answer of records that are read otherwise, as they run beside what was found before."""
    case = replace(case, settled=True)
    base = case.comparison.base(case.actuator)
    return _Answer(case, base, *_decided(case, base, catalogue, progress))


def _decided(
    case: Case,
    base: Hypothesis,
    catalogue: Sequence[EffectFunction],
    progress: Callable[[str], None],
    *,
    measured: RecordSet | None = None,
) -> tuple[Outcome, _Decision]:
    """Return what explains the records; ``measured``: they, to ask whether a column is what is stated."""
    records = case.bench.records
    findings = [
        *records.findings,
        *out_of_reach(case.actuator, records),
        *limit_findings(flatten(case.actuator), records),
        *scale_findings(case.comparison, base),
    ]
    findings = findings or drive_findings(case.actuator, case.comparison, base)
    if measured is not None and not findings:
        findings = misread_findings(case.actuator, measured, case.comparison, base, least=_MOST_OF_IT)
    lagging = lagging_forces(case.actuator, records)
    if findings:
        findings += lagging.findings
        return Outcome(base), _Decision("data_suspect", tuple(str(f) for f in findings))
    outcome = _searched(case, base, catalogue, progress)
    if outcome.stopped:
        return outcome, _Decision("unknown")
    if lagging.findings and not any(step.chosen.newest.explains_lag for step in outcome.steps):
        return outcome, _Decision("data_suspect", tuple(str(f) for f in lagging.findings))
    return outcome, _decision(case, base, outcome)


def _searched(
    case: Case, base: Hypothesis, catalogue: Sequence[EffectFunction], progress: Callable[[str], None]
) -> Outcome:
    """Search for effects, and for declared numbers that the records contradict."""
    free = with_numbers_let_go(case.comparison, base, case.criteria)
    closing = free if free and is_complete(case.excesses(free)) else None
    if closing and len(wrong_numbers(closing)) == 1:
        return Outcome(closing, complete=True)  # no effect has fewer numbers
    stop = case.is_read_otherwise_beside
    outcome = search(case.comparison, base, catalogue, case.criteria, progress, stop=stop)
    if outcome.stopped:
        return outcome
    if closing and len(wrong_numbers(closing)) < len(outcome.last.unknowns):
        return replace(outcome, last=closing, steps=(), complete=True)
    progress("letting go declared numbers at the end of their ranges")
    fewer = _with_fewer_effects(case, outcome)
    if fewer is not None or outcome.complete or free is None:
        return fewer or outcome
    again = search(case.comparison, free, catalogue, case.criteria, progress)
    # Effects beside a wrong number are named only where nothing is left to be explained by something else.
    if again.complete and wrong_numbers(again.last):
        return again
    numbers = len(wrong_numbers(free)) <= len(outcome.last.unknowns) or not outcome.steps
    explains = is_explained_by_numbers(
        case.criteria, *(case.excesses(each) for each in (base, outcome.last, free))
    )
    return replace(outcome, last=free, steps=()) if numbers and explains else outcome


def _with_fewer_effects(case: Case, outcome: Outcome) -> Outcome | None:
    """Return the first of the effects beside wrong numbers, if these leave nothing and need fewer numbers."""
    for count, step in enumerate(outcome.steps, 1):
        present = outcome.last if count == len(outcome.steps) else case.comparison.polished(step.chosen)
        free = with_numbers_let_go(case.comparison, present, case.criteria)
        if free is None or not is_complete(case.excesses(free)):
            continue
        if not outcome.complete or len(wrong_numbers(free)) < len(outcome.last.unknowns) - len(free.unknowns):
            return replace(outcome, last=free, steps=outcome.steps[:count], complete=True)
    return None


def _decision(case: Case, base: Hypothesis, outcome: Outcome) -> _Decision:
    """Return what is missing, unless other numbers of the rig explain the records better."""
    verdict: Literal["none", "named", "unknown", "undecidable"]
    wrong = sentence_of(outcome.last)
    if wrong and outcome.steps:
        return _Decision("named", (wrong,))
    if wrong and 2 * len(wrong_numbers(outcome.last)) < len(base.values):
        return _Decision("data_suspect", (wrong,))
    if wrong:
        other = other_numbers(case.comparison, base, base, case.criteria)
        return _Decision("data_suspect", (other.words if other.decides else wrong,))
    open_blocks = {name for name, each in case.excesses(base).items() if each.open}
    if not open_blocks:
        verdict = "none"
    elif open_blocks == {DECLARED} and not outcome.steps:
        far = ", ".join(far_numbers(base)) or "together, none of them alone"
        why = f"{STRAINED}: {far}; measure one of them, or widen its spread in the deck"
        return _Decision("data_suspect", (why,))
    else:
        undecided = any(each.undecided for each in outcome.tried)
        verdict = "named" if outcome.steps else "undecidable" if undecided else "unknown"
    better = outcome.last if verdict == "named" else base
    other = other_numbers(case.comparison, base, better, case.criteria)
    return _Decision("data_suspect" if other.decides else verdict, (other.words,) if other.words else ())


def _verdict(answer: _Answer, records: RecordSet) -> Verdict:
    case, base, outcome, decision = answer
    bodies = flatten(case.actuator).bodies
    outcome = replace(outcome, steps=tuple(without_twins(step, bodies) for step in outcome.steps))
    verdict = decision.verdict
    base = base.as_written()
    better = outcome.last if verdict == "named" or outcome.last.released else base
    steps = outcome.steps if verdict == "named" else ()
    # The numbers of a name are those of the fit that was judged, and so is what they leave. No record is
    # proposed for the values of a table that has no name.
    judged = better = better.as_written()
    left, known = case.excesses(judged), tuple(judged.fits.values())
    complete = is_complete(left) and min(covered(case.bench).values(), default=0.0) >= LEAST_COVERED
    if verdict in ("named", "unknown", "undecidable"):
        better = with_what_has_no_name(case.comparison, better, case.criteria).as_written()
    before, after = case.excesses(base), case.excesses(better)
    judged, better, base = (
        each.as_known_beside(open_blocks)
        for each, open_blocks in ((judged, left), (better, left), (base, before))
    )
    worst = _furthest([n for n in before if n != DECLARED], before)
    read = [(b, r) for b, each in case.bench.block_noise.items() for r in each.floors]
    unpredictable = [key for key in read if key in better.unpredictable]
    # From here on, nothing is chosen any more.
    every = Comparison(case.bench.with_records(records), case.comparison.sizes)
    experiment = _experiment(case, base, outcome, decision)
    return Verdict(
        verdict,
        tuple(_named(judged, better, step, place, left) for place, step in enumerate(steps)),
        _strained(before[DECLARED], after[DECLARED], better)
        + tuple(_not_predicted(key) for key in unpredictable)
        + decision.findings,
        gaps_of(base, better, every),
        worst,
        _runners_up(outcome, steps),
        derived(sourced(better, narrowed=complete), case.actuator, "diagnosed"),
        sourced(base),
        course_of(base, better, every, worst),
        tuple(text for fit in known for text in fit.unidentified()),
        shapes_of(base, better, every, worst),
        tuple(better.fits.values()),
        _remainder(case.comparison, better, after) if verdict not in ("none", "data_suspect") else None,
        (
            *_next_steps(case.comparison, steps, known),
            *((experiment.words(),) if experiment else ()),
        ),
        outcome.skipped,
        complete=complete,
        criteria=case.criteria,
        remarks=tuple(dict.fromkeys(str(r) for r in (*records.remarks, *every.bench.records.remarks))),
        unnamed=tuple(_unnamed(better, each) for each in better.added[len(steps) :]),
        experiment=experiment,
    )


def _experiment(case: Case, base: Hypothesis, outcome: Outcome, decision: _Decision) -> Experiment | None:
    """Return the record that would tell apart what these records do not."""
    rivals: tuple[Hypothesis, ...] = ()
    if decision.verdict == "named":
        unsure = next((step for step in outcome.steps if step.equals), None)
        rivals = (unsure.chosen, *unsure.equals[:_MOST_ALIASES]) if unsure else ()
    elif decision.verdict == "undecidable":
        fitted = [each.hypothesis for each in outcome.tried if each.undecided]
        rivals = (*fitted[:_MOST_ALIASES], *((base,) if len(fitted) < 2 else ()))
    try:
        return next_experiment(rivals, case.bench)
    except (ConvergenceError, MeasurementError):
        return None  # a record that cannot be commanded or predicted is none to propose


def _furthest(names: Sequence[str], excesses: Excesses) -> str:
    """Return the block that is furthest from its noise floor."""
    return max(names, key=lambda name: excesses[name].mean_square)


def _runners_up(outcome: Outcome, steps: Sequence[Step]) -> tuple[tuple[Any, ...], ...]:
    """Return what explains something alone: identifier, share, why it is not named, numbers."""
    named = {step.effect for step in steps}
    tried = [each for each in outcome.tried if each.share > 0.0]
    first = sorted(tried, key=lambda each: each.candidate.effect not in named)[:_RUNNERS_UP]
    return tuple(
        (
            each.candidate.effect,
            each.share,
            "; ".join(each.objections),
            _numbers(each.hypothesis, each.candidate, each.candidate),
        )
        for each in sorted(first, key=lambda each: -each.share)
    )


def _remainder(comparison: Comparison, better: Hypothesis, after: Excesses) -> Remainder | None:
    """Return what is left in the block that is furthest from its noise floor, if any is open."""
    left = [n for n, e in after.items() if n != DECLARED and e.open]
    if not left:
        return None
    worst, bench = _furthest(left, after), comparison.bench
    judged = [j for j in comparison.judged(better) if j.block.name == worst]
    return remainder_of(judged, bench.records, [s for s in bench.records.signals if bench.noise.rounded[s]])


def _next_steps(comparison: Comparison, steps: Sequence[Step], fits: Sequence[Fit]) -> tuple[str, ...]:
    """Return what to measure to tell apart what these records cannot."""
    sentences: list[str] = []
    for step in steps:
        judged = comparison.judged(step.chosen) if step.equals else ()
        differ = {
            name: where_they_differ(judged, comparison.judged(h))
            for name, h in list(zip(step.aliases, step.equals, strict=True))[:_MOST_ALIASES]
        }
        sentences += advice(step.effect, differ)
    return (*sentences, *more_excitation(fits))


def _strained(before: Excess, after: Excess, better: Hypothesis) -> tuple[str, ...]:
    """Return how far refitted numbers lie from their declaration, where all are far together or one is."""
    far = far_numbers(better)
    if not (before.open or far):
        return ()
    which = f": {', '.join(far)}" if far else ""
    return (
        f"{DECLARED}: refitted {before.fit:.1f} standard deviations of their spread away before, "
        f"{after.fit:.1f} after{which}",
    )


def _not_predicted(key: Key) -> str:
    block, record = key
    return (
        f"{block}: record '{record}', the quickest, is not predicted: there a body that flies freely between "
        "contacts may go another way. The effect is judged by the other records."
    )


def _numbers(
    last: Hypothesis, candidate: Candidate, written: Candidate
) -> dict[str, tuple[float, str, float]]:
    """Return the fitted numbers of an effect, by the names that they have in the deck that is written."""
    own = {u.name: w.name for u, w in zip(candidate.unknowns, written.unknowns, strict=True)}
    return {
        own[p.name]: (last.values[p.name], p.unit, fit.standard_error(p.name))
        for fit in last.fits.values()
        for p in fit.parameters
        if p.name in own
    }


def _unnamed(last: Hypothesis, candidate: Candidate) -> NamedEffect:
    return NamedEffect(
        candidate.effect,
        candidate.location,
        _numbers(last, candidate, candidate),
        (),
        math.nan,
        candidate.signature,
        candidate.source,
    )


def _named(last: Hypothesis, written: Hypothesis, step: Step, place: int, left: Excesses) -> NamedEffect:
    # Later edits may have put the same number under a longer name: the last hypothesis knows.
    candidate, here = last.added[place], left[step.block]
    # What is left in the block, in multiples of its noise floor.
    times_noise = math.sqrt(max(1.0, here.mean_square)) if here.open else 1.0
    return NamedEffect(
        candidate.effect,
        candidate.location,
        _numbers(last, candidate, written.added[place]),
        step.aliases,
        step.share,
        candidate.signature,
        candidate.source,
        probability=CALIBRATION.probability(
            step.distance, complete=is_complete(left), times_noise=times_noise
        )
        / (1 + len(step.equals)),
        evidence=_evidence(step, standing_of(candidate.unknowns, last.fits.values())),
    )


def _evidence(step: Step, standing: Standing) -> EffectEvidence:
    # Half the gain in effective squares of the noise is the gain in predictive log density.
    deciding = [n.name for n in standing.numbers if n.decides]
    worst = min(step.gains, key=lambda record: step.gains[record], default="")
    return EffectEvidence(
        0.5 * step.gain.value,
        0.5 * step.gain.error,
        deciding[0] if deciding else "",
        standing.exclusion if deciding else math.nan,
        worst,
        0.5 * step.gains[worst] if worst else math.nan,
        next_leaves=math.exp(step.distance),
        next_name=step.next_name,
    )


NEXT_RECORD = "next_record.csv"
OF_ONE_VERDICT = (NEXT_RECORD, "regeneration.json")
"""Files that not every diagnosis leaves behind."""


class _Written(Protocol):
    """What is written as a JSON file beside the deck it ends with."""

    @property
    def actuator(self) -> Assembly: ...

    def to_dict(self, model: str) -> Mapping[str, Any]: ...


def write_verdict(verdict: Verdict, folder: Path) -> list[Path]:
    """Write ``verdict.json`` and the deck of the better model, ``model.toml``.

    The command of the next record stands beside them as ``next_record.csv`` where one is proposed. What only
    another diagnosis in this folder has written is removed: it would contradict the verdict.

    Parameters
    ----------
    verdict
        Of a diagnosis.
    folder
        Is made where it does not exist.

    Returns
    -------
    list of Path
        Verdict and deck.
    """
    for left_over in OF_ONE_VERDICT:
        discard(folder / left_over)
    files = _write(verdict, folder, "verdict.json")
    if verdict.experiment is not None:
        write_command(verdict.experiment, folder / NEXT_RECORD)
    return files


def write_refit(refit: Refit, folder: Path) -> list[Path]:
    """Write ``fit.json`` and the deck with the fitted numbers, ``model.toml``.

    Parameters
    ----------
    refit
        Of the declared numbers.
    folder
        Is made where it does not exist.
    """
    return _write(refit, folder, "fit.json")


def _write(result: _Written, folder: Path, name: str) -> list[Path]:
    deck, file = folder / "model.toml", folder / name
    make_folder(folder)
    write_deck(result.actuator, deck)
    write_text(file, json.dumps(result.to_dict(str(deck)), indent=2, ensure_ascii=False) + "\n")
    return [file, deck]
