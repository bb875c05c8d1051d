"""The whole chain: refit, locate, name, add, refit, judge on records that no fit has seen, abstain.

Each hypothesis is fitted to the same records in the same way; what decides is the share of the excess over the
noise that an effect explains, on the fitted and on the held-out records. An effect that explains little is
not added, however significant; if what remains is large, the verdict is ``unknown``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..components import Assembly
from ..components.part import quantities
from ..errors import NlsError
from ..identification.evidence import Bench
from ..identification.measurement import RecordSet
from ..model import flatten
from .compare import Comparison, Hypothesis, chi2_of
from .cuts import blocks_of
from .effects import ALL, Candidate, Effect
from .outcome import course_of, gaps_of
from .verdict import NamedEffect, Verdict

OPEN = 1.15
"""A block is open while its residual is this many times the noise floor; clean rigs stay below 1.05."""
LEAST_SHARE = 0.25
"""An effect must explain this share of the excess, fitted and held out; unlisted effects leave 0.2 at most."""
NAMED_SHARE = 0.5
"""Of the held-out excess all effects together must explain this share, or all blocks be closed."""
AS_GOOD = 0.01
"""Shares closer than this do not tell two hypotheses apart: the one with fewer numbers is taken."""
MOST_EFFECTS = 3


def _silent(text: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class _Trial:
    candidate: Candidate
    hypothesis: Hypothesis
    share: float
    share_held_out: float


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
        With the refitted, augmented assembly.

    Raises
    ------
    MeasurementError
        If the records do not fit the model, or nothing moves enough to say anything.
    ConvergenceError
        If the declared model cannot be refitted.
    """
    progress("refitting the declared model")
    bench = Bench(records, blocks_of(actuator, records.signals))
    comparison = Comparison(bench, typical_sizes(actuator, records))
    base = comparison.base(actuator)
    state = comparison.coarsely(base)
    taken: list[tuple[_Trial, tuple[str, ...]]] = []
    runners_up: tuple[tuple[str, float], ...] = ()
    while len(taken) < MOST_EFFECTS and open_blocks(state, bench):
        trials = _tried(state, comparison, catalogue, progress)
        good = [t for t in trials if t.share >= LEAST_SHARE and t.share_held_out >= LEAST_SHARE]
        if not taken:
            runners_up = tuple((t.candidate.effect, t.share) for t in trials[:6])
        if not good:
            break
        chosen = min(
            (t for t in good if t.share >= good[0].share - AS_GOOD),
            key=lambda t: (len(t.candidate.unknowns), -t.share),
        )
        aliases = {t.candidate.effect for t in good if t.share >= chosen.share - AS_GOOD} - {chosen.candidate.effect}
        taken.append((chosen, tuple(sorted(aliases))))
        state = chosen.hypothesis
    progress("refitting to all samples")
    final = comparison.polished(state) if taken else base
    return _verdict(base, final, taken, runners_up, comparison)


def _tried(
    state: Hypothesis, comparison: Comparison, catalogue: Sequence[Effect], progress: Callable[[str], None]
) -> list[_Trial]:
    """Return all candidates fitted, by the share that they explain, best first."""
    trials = []
    present = {(c.effect, c.location) for c in state.added}
    for effect in catalogue:
        for candidate in effect(state.assembly):
            if (candidate.effect, candidate.location) in present:
                continue
            progress(f"trying {candidate.effect} at {candidate.location}")
            try:
                found = comparison.with_effect(state, candidate)
            except NlsError:
                # A candidate that cannot be fitted explains nothing; the others go on.
                continue
            trials.append(
                _Trial(
                    candidate, found, _share(state, found, comparison.bench, "fit"),
                    _share(state, found, comparison.bench, "held_out"),
                )
            )  # fmt: skip
    return sorted(trials, key=lambda t: -t.share)


def excess(hypothesis: Hypothesis, bench: Bench, role: str) -> float:
    """Return the sum of squares above the noise over all blocks, with the strain of the declared numbers.

    Parameters
    ----------
    hypothesis
        Fitted.
    bench
        Knows the records.
    role
        ``fit`` or ``held_out``; the strain belongs to the fit.
    """
    total = hypothesis.prior if role == "fit" else 0.0
    for block in {name for name, _ in hypothesis.chi2}:
        square, rows = chi2_of(hypothesis, bench, block, role)  # type: ignore[arg-type]
        total += max(0.0, square - rows)
    return total


def _share(before: Hypothesis, after: Hypothesis, bench: Bench, role: str) -> float:
    start = excess(before, bench, role)
    return 1.0 - excess(after, bench, role) / start if start > 0.0 else 0.0


def open_blocks(hypothesis: Hypothesis, bench: Bench) -> list[str]:
    """Return the blocks whose residual is more than noise, on the fitted or on the held-out records.

    Parameters
    ----------
    hypothesis
        Fitted.
    bench
        Knows the records.
    """
    return sorted(
        block
        for block in {name for name, _ in hypothesis.chi2}
        if any(ratio(hypothesis, bench, block, role) > OPEN for role in ("fit", "held_out"))
    )


def ratio(hypothesis: Hypothesis, bench: Bench, block: str, role: str) -> float:
    """Return the rms residual of a block over its noise floor.

    Parameters
    ----------
    hypothesis, bench
        As above.
    block
        Name.
    role
        ``fit`` or ``held_out``.
    """
    square, rows = chi2_of(hypothesis, bench, block, role)  # type: ignore[arg-type]
    return float(np.sqrt(square / rows)) if rows else 0.0


def typical_sizes(actuator: Assembly, records: RecordSet) -> dict[str, float]:
    """Return how large each signal of the declared model gets on the records, for bounds and starts.

    Parameters
    ----------
    actuator
        As declared.
    records
        Measured.
    """
    model, sensors = flatten(actuator), actuator.sensors()
    largest = {s: max(float(np.abs(r.trace[s]).max()) for r in records.records) for s in records.signals}
    truth = {
        (sensors[s.rpartition(".")[0]].of if s.endswith(".reading") and s.rpartition(".")[0] in sensors else s): size
        for s, size in largest.items()
    }
    state = [truth.get(v.name, v.start) for v in model.states]
    inputs = [truth.get(v.name, v.start) for v in model.inputs]
    return {name: abs(size) for name, size in model.evaluate(state, inputs).items()} | largest


def _verdict(
    base: Hypothesis, final: Hypothesis, taken: Sequence[tuple[_Trial, tuple[str, ...]]],
    runners_up: tuple[tuple[str, float], ...], comparison: Comparison,
) -> Verdict:  # fmt: skip
    bench = comparison.bench
    blocks = sorted({name for name, _ in base.chi2})
    worst = max(blocks, key=lambda b: ratio(base, bench, b, "held_out"))
    closed = not open_blocks(final, bench)
    enough = closed or _share(base, final, bench, "held_out") >= NAMED_SHARE
    if not open_blocks(base, bench):
        word = "none"
    elif taken and enough:
        word = "named"
    else:
        word = "data_suspect" if bench.records.findings else "unknown"
    effects = tuple(_named(trial, aliases, final) for trial, aliases in taken) if word == "named" else ()
    better = final if word == "named" else base
    where = tuple(
        f"{block}: {ratio(base, bench, block, 'held_out'):.2f} times the noise floor on held-out records before, "
        f"{ratio(better, bench, block, 'held_out'):.2f} after"
        for block in blocks
    )
    return Verdict(
        word, effects, where + tuple(str(f) for f in bench.records.findings),
        gaps_of(base, better, comparison), worst, runners_up, sourced(better), sourced(base),
        course_of(base, better, comparison, worst),
    )  # fmt: skip


def sourced(hypothesis: Hypothesis) -> Assembly:
    """Return the fitted assembly, its fitted numbers marked with where they come from.

    Parameters
    ----------
    hypothesis
        Fitted.
    """
    fitted = hypothesis.fitted
    rows = {name.partition("[")[0] for name in hypothesis.values}
    known = {k: q for name, part in fitted.parts for k, q in quantities(part, name).items()}
    return fitted.with_values(
        {n: known[n].with_value(known[n].value, f"fitted to bench records; declared: {known[n].source}") for n in rows}
    )


def _named(trial: _Trial, aliases: tuple[str, ...], final: Hypothesis) -> NamedEffect:
    # Later edits may have put the same number under a longer name.
    units = {v.name: v.unit for v in flatten(final.assembly).parameters}
    mine = next(c for c in final.added if (c.effect, c.signature) == (trial.candidate.effect, trial.candidate.signature))
    numbers = {}
    for unknown in mine.unknowns:
        fit = next(f for f in final.fits.values() if unknown.name in f.values)
        numbers[unknown.name] = (final.values[unknown.name], units[unknown.name], fit.standard_error(unknown.name))
    return NamedEffect(
        mine.effect, mine.location, numbers, aliases, trial.share, trial.share_held_out, mine.signature, mine.source
    )
