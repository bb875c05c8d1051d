"""The whole chain: refit, locate, name, add, refit, judge on records that no fit has seen, abstain.

Each hypothesis is fitted to the same records in the same way; what decides is the share of a block's excess
over the noise that an effect explains, on the fitted and on the held-out records. An effect that explains
little is not added, however significant; if what remains is large, the verdict is ``unknown``.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from ..components import Assembly
from ..components.assembly.deck_writer import write_deck
from ..identification.equation_error.evidence import Bench
from ..identification.estimation.least_squares import Fit
from ..identification.records.measurement import RecordSet
from ..model import flatten
from ..writing import write_text
from .blocks.tearing import blocks_of
from .effects import ALL, Effect
from .reporting.advice import advice, more_excitation, where_they_differ
from .reporting.gap import course_of, gaps_of, shapes_of
from .reporting.refit import Refit, refit_text, sourced
from .reporting.remainder import Remainder, remainder_of
from .reporting.verdict import NamedEffect, Verdict
from .screening.causality import late_forces
from .screening.other_rig import other_numbers, out_of_reach
from .screening.scale_check import suspicions_of, typical_sizes
from .selection.comparison import Comparison
from .selection.excess import DECLARED, Excess, excesses
from .selection.hypothesis import Hypothesis
from .selection.search import Outcome, Step, search

_RUNNERS_UP, _MOST_ALIASES = 6, 3


def _silent(text: str) -> None:
    """Say nothing."""


def diagnose(
    actuator: Assembly,
    records: RecordSet,
    *,
    catalogue: Sequence[Effect] = ALL,
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
        Effects to try; functions from an assembly to candidates.
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
    bench = Bench(records, blocks_of(flatten(actuator), records.signals))
    comparison = Comparison(bench, typical_sizes(actuator, records))
    base = comparison.base(actuator)
    findings = [*records.findings, *out_of_reach(actuator, records), *suspicions_of(comparison, base)]
    late = late_forces(actuator, records)
    if findings or (late.findings and not late.testable):
        findings += late.findings
        outcome = Outcome(base, (), (), False)
        return _verdict(comparison, base, outcome, ("data_suspect", tuple(str(f) for f in findings)))
    outcome = search(comparison, base, catalogue, progress)
    if late.findings and not any("delay" in step.chosen.added[-1].effect for step in outcome.steps):
        told = tuple(str(f) for f in late.findings)
        return _verdict(comparison, base, outcome, ("data_suspect", told))
    word = _word(comparison, base, outcome)
    other = other_numbers(comparison, base, outcome.last if word == "named" else base)
    told = (other.words,) if other.words else ()
    return _verdict(comparison, base, outcome, ("data_suspect" if other.decides else word, told))


def _word(comparison: Comparison, base: Hypothesis, outcome: Outcome) -> str:
    if not any(e.open for e in excesses(base, comparison.bench).values()):
        return "none"
    return "named" if outcome.steps and outcome.explained else "unknown"


def _verdict(
    comparison: Comparison, base: Hypothesis, outcome: Outcome, said: tuple[str, tuple[str, ...]]
) -> Verdict:
    word, findings = said
    better = outcome.last if word == "named" else base
    before, after = excesses(base, comparison.bench), excesses(better, comparison.bench)
    blocks = [n for n in before if n != DECLARED]
    worst = max(blocks, key=lambda n: sum(before[n].chi2) / max(sum(before[n].rows), 1))
    steps = outcome.steps if word == "named" else ()
    named = {step.effect for step in steps}
    tried = [(c.effect, share) for c, share in outcome.ranking]
    runners_up = [pair for pair in tried if pair[0] in named] + [
        pair for pair in tried if pair[0] not in named
    ]
    unidentified = tuple(text for fit in better.fits.values() for text in fit.unidentified())
    return Verdict(
        word,
        tuple(_named(better, step, place) for place, step in enumerate(steps)),
        tuple(_where(before[n], after[n]) for n in before if n != DECLARED or before[n].open)
        + tuple(_gone(key) for key in sorted(better.astray))
        + findings,
        gaps_of(base, better, comparison),
        worst,
        tuple(sorted(runners_up[:_RUNNERS_UP], key=lambda pair: -pair[1])),
        sourced(better),
        sourced(base),
        course_of(base, better, comparison, worst),
        unidentified,
        shapes_of(base, better, comparison, worst),
        tuple(better.fits.values()),
        _remainder(comparison, better, after) if word in ("named", "unknown") else None,
        _next_steps(comparison, steps, tuple(better.fits.values())),
    )


def _remainder(comparison: Comparison, better: Hypothesis, after: dict[str, Excess]) -> Remainder | None:
    """Return what is left in the block that is furthest from its noise floor, if any is open."""
    left = [n for n, e in after.items() if n != DECLARED and e.open]
    if not left:
        return None
    worst = max(left, key=lambda n: sum(after[n].chi2) / max(sum(after[n].rows), 1))
    bench = comparison.bench
    mine = [j for j in comparison.judged(better) if j.block.name == worst]
    return remainder_of(mine, bench.records, [s for s in bench.records.signals if bench.noise.rounded[s]])


def _next_steps(comparison: Comparison, steps: Sequence[Step], fits: Sequence[Fit]) -> tuple[str, ...]:
    """Return what to measure to tell apart what these records cannot."""
    found: list[str] = []
    for step in steps:
        mine = comparison.judged(step.chosen) if step.equals else ()
        differ = {
            h.added[-1].effect: where_they_differ(mine, comparison.judged(h))
            for h in step.equals[:_MOST_ALIASES]
        }
        found += advice(step.effect, differ)
    return (*found, *more_excitation(fits))


def _where(before: Excess, after: Excess) -> str:
    if before.block == DECLARED:
        return (
            f"{DECLARED}: refitted {before.fit:.1f} standard deviations of their spread away before, "
            f"{after.fit:.1f} after"
        )
    ratio, later = before.held_out / before.floor, after.held_out / after.floor
    state = "open" if before.open else "closed"
    told = f"{ratio:.2f} times the noise floor on held-out records before, {later:.2f} after"
    return f"{before.block} ({state}): {told}"


def _gone(key: tuple[str, str]) -> str:
    block, record = key
    return (
        f"{block}: record '{record}', the quickest, is not predicted: there a body that coasts between "
        "contacts may go another way. The effect is judged by the other records."
    )


def _named(last: Hypothesis, step: Step, place: int) -> NamedEffect:
    # Later edits may have put the same number under a longer name: the last hypothesis knows.
    mine = last.added[place]
    own = {u.name for u in mine.unknowns}
    numbers = {
        p.name: (last.values[p.name], p.unit, fit.standard_error(p.name))
        for fit in last.fits.values()
        for p in fit.parameters
        if p.name in own
    }
    return NamedEffect(
        mine.effect,
        mine.location,
        numbers,
        tuple(h.added[-1].effect for h in step.equals),
        step.share_fit,
        step.share_held_out,
        mine.signature,
        mine.source,
    )


def write_verdict(verdict: Verdict, folder: Path) -> list[Path]:
    """Write ``verdict.json`` and the deck of the better model, ``model.toml``.

    Parameters
    ----------
    verdict
        As found.
    folder
        Is made where it does not exist.
    """
    deck, file = folder / "model.toml", folder / "verdict.json"
    folder.mkdir(parents=True, exist_ok=True)
    write_deck(verdict.actuator, deck)
    write_text(file, json.dumps(verdict.to_dict(str(deck)), indent=2, ensure_ascii=False) + "\n")
    return [file, deck]


def write_refit(found: Refit, folder: Path) -> list[Path]:
    """Write ``fit.json`` and the deck with the fitted numbers, ``model.toml``.

    Parameters
    ----------
    found
        As fitted.
    folder
        Is made where it does not exist.
    """
    deck, file = folder / "model.toml", folder / "fit.json"
    folder.mkdir(parents=True, exist_ok=True)
    write_deck(found.actuator, deck)
    write_text(file, refit_text(found, str(deck)))
    return [file, deck]
