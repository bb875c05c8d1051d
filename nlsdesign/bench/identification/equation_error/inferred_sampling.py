"""How an input runs between its samples, inferred from the records where nobody says it.

Half a sample is seen in a balance of efforts long before it is seen in a picture. Each way to run between
samples gives other residuals of the blocks that the input drives; their likelihoods are compared. What else
the model may lack must not decide: numbers with a spread, and plain terms of each motion (a constant, the
place, its sine and cosine, the speed, its square, and its sign, alone and times the size of the input) take
from the residuals what they can, however much. So a friction that nobody declared is not taken for a hold.

They take from a shift too: the force of a spring that acts late is one of its damping, and little is left
that tells the shift. Whoever asks whether a machine lacks anything at all asks without them; numbers that
blocks share are then held by what other blocks say of them. That answer is sharper, but true only if nothing
is missing; so it counts only where the one with the terms, which is true in any case, allows it.

A declared form says how a signal runs, not that nothing lags behind it: a current loop follows a command that
is held within a part of a sample. Such a lag is inferred too.

Channels of one recorder can also be shifted against each other by a part of a sample, as where they are
sampled in turn. Up to half a sample of each of the two, such a shift is a number without a meaning of its
own. That of an input is inferred in the same way, and stated; that of a motion, which moves all numbers of a
machine, is fitted with them (:mod:`nlsdesign.bench.discrepancy.diagnose`). A delay beyond that is left for
effects to explain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ....foundation.written_numbers import without_power
from ..filters import derivative
from ..records.mapping import Column
from ..records.measurement import Record, RecordSet
from ..records.quality import Finding
from ..records.sampling import AVERAGED, FORMS, HELD, SAMPLED, Sampling, shifted
from ..residuals import effective_size
from .block import Block, BlockNoise
from .block_response import DrivenBlock, free_in

_FORMS = (SAMPLED, HELD, AVERAGED)
_PLAINLY = 3.0
"""Natural logarithm of the likelihood ratio from which another way to run is taken: odds of 20."""
_NO_FORM = 10.0
"""The same for a shift that none of the usual ways explains: it is rare, and what a model lacks looks so."""
_LEAST = 0.05
"""Share of the noise that the numbers of a machine leave at least, where they do not make it vanish."""
_WEIGHINGS = 2
_EITHER_WAY = (0.5, -0.5)
"""Samples by which a signal is read later and earlier, for the slope of the residuals with a shift."""
_MOST = 1.1
"""Samples by which two channels can be shifted against each other: half a sample of each. A delay that is so
little longer stands at the least one of its search, so no effect could be named for it."""
_BESIDE = 0.6
"""The same beside what is declared: it leaves half a sample to a loop below or to another clock."""


Missing: TypeAlias = Callable[[Block, Record, float], Iterator[Array]]
"""What a block may lack on a record, whose rates are taken over a span in s: terms of shape (n,) each."""


def with_inferred_sampling(records: RecordSet, seen: Sequence[BlockNoise], missing: Missing) -> RecordSet:
    """Return the records in which every input runs between its samples as they tell best, with remarks.

    ``records``: inputs of which nothing is said have columns without a sampling. ``missing``: what the blocks
    may lack.
    """
    # What is declared to be what it was at its stamp, a load cell for instance, is not asked, nor is what was
    # inferred before.
    inputs = [c for c in records.columns if c.sampling is None or (c.declared and c.sampling in FORMS[1:])]
    remarks = list(records.remarks)
    for column in inputs:
        declared = column.sampling
        likelihood = _asked(records, seen, column.signal, missing, declared)
        form, remark = declared or SAMPLED, ""
        if likelihood:
            form, remark = likelihood.beside(declared) if declared else likelihood.taken()
        records = records.read_as({column.signal: form})
        if remark:
            remarks.append(Finding(f"column '{column.name}'", remark))
    return replace(records, remarks=tuple(remarks))


def shiftable(records: RecordSet, seen: Sequence[BlockNoise]) -> list[Column]:
    """Return the columns of motions, without the clock of all and those of which something is said."""
    motions = {d.signal for each in seen for d in each.block.drives.values() if d.order > 0}
    clock = _clock(motions, seen)
    return [c for c in records.columns if c.signal in motions and c.signal != clock and not c.declared]


def _clock(motions: set[str], seen: Sequence[BlockNoise]) -> str:
    """Return the motion that an input accelerates, or else any.

    How that input lags is told by its balance, so a shift of its motion would be told twice; all other
    motions are shifted against it.
    """
    for each in seen:
        inputs, s, drives = each.block.model.inputs, each.block.model.symbols(), each.block.drives
        column, driven = ca.vertcat(s.output, s.derivative), [v.name in drives for v in inputs]
        acts = [d and ca.depends_on(column, s.input[i]) for i, d in enumerate(driven)]
        acting = [drives[v.name] for v, does in zip(inputs, acts, strict=True) if does]
        accelerated = [d.signal for d in acting if d.order == 2]
        if accelerated and not motions >= {d.signal for d in acting}:
            return accelerated[0]
    return min(motions, default="")


def remark_on_shift(column: Column, shift: float) -> Finding:
    """Return the remark on a motion that is read earlier by so many samples."""
    way = "earlier" if shift > 0.0 else "later"
    text = (
        f"is read about {abs(shift):.2f} of a sample {way}, as where channels are sampled in turn: "
        "so it fits the motion that the input drives; to forbid it, write between_samples = "
        '"sampled" in records.toml'
    )
    return Finding(f"column '{column.name}'", text)


class BlockRows(NamedTuple):
    """Residuals of a block for each form, shape (forms, rows), and what may explain them.

    ``numbers``: what each contributes, by name, shape (rows,); blocks may share them. ``own``: of this block,
    shape (rows, terms).
    """

    residuals: Array
    numbers: Mapping[str, Array]
    own: Array


class _Likelihood(NamedTuple):
    """Logarithms of the likelihood of each form and of a shift of any size, and that shift in samples."""

    of_forms: tuple[float, ...]
    of_shift: float
    shift: float
    error: float

    @property
    def likeliest(self) -> Sampling:
        """Form with the largest likelihood."""
        return min(_FORMS, key=self.loss)

    def loss(self, form: Sampling) -> float:
        """Return the logarithm of the likelihood that a form has less than the best shift."""
        return self.of_shift - self.of_forms[_FORMS.index(form)]

    def taken(self) -> tuple[Sampling, str]:
        """Return how a signal runs between its samples, and the remark on it; none where it is sampled."""
        if self.loss(SAMPLED) < _PLAINLY:
            return SAMPLED, ""
        late = f"{self.shift:.2f} ± {self.error:.2g} samples behind its stamps"
        if abs(self.shift) > _MOST:
            return SAMPLED, (
                f"acts {late}; half a sample of each channel may be their clocks and holds, what is "
                "beyond is a delay of the machine; to tell them apart, write between_samples in records.toml"
            )
        form = self.likeliest
        words, others = f"is taken as {form.name}: it {form.words}", self.losses_of_others(form)
        if self.loss(form) >= _NO_FORM:
            form = shifted(form, self.shift)
            words = f"is read {abs(form.late):.2g} of a sample {'earlier' if form.late > 0.0 else 'later'}"
        return form, (
            f"{words}; nothing says how it runs between its samples, and the records show that it acts "
            f"{late} ({others}); to decide it, write between_samples in records.toml"
        )

    def beside(self, declared: Sampling) -> tuple[Sampling, str]:
        """Return how a signal is read of which that is declared, and the remark where records add a shift."""
        beyond = self.shift - declared.late
        if abs(beyond) > _BESIDE or 0.5 * (beyond / self.error) ** 2 < _NO_FORM:
            return declared, ""
        likeliest = self.likeliest
        other = f"; if {likeliest.name} is meant, write it there" if likeliest is not declared else ""
        return shifted(declared, self.shift), (
            f"is declared {declared.name}, but the records show that it acts {self.shift:.2f} ± "
            f"{self.error:.2g} samples behind its stamps ({self.losses_of_others(likeliest)}), as with a "
            f"current loop that lags or another clock; it is read {abs(beyond):.2g} of a sample "
            f"{'later' if beyond > 0.0 else 'earlier'} than declared: check between_samples in "
            f"records.toml{other}"
        )

    def moved(self, around: _Likelihood) -> _Likelihood:
        """Return the same with a shift that was looked for again around this one."""
        best = max(self.of_shift, around.of_shift)
        return self._replace(of_shift=best, shift=self.shift + around.shift, error=around.error)

    def allows(self, shift: float) -> bool:
        """Tell whether a shift is not plainly less likely than the best."""
        return 0.5 * ((shift - self.shift) / self.error) ** 2 < _PLAINLY

    def losses_of_others(self, form: Sampling) -> str:
        """Return in words how much less likely the other forms are than one of them."""
        others = (
            f"{other.name} by {without_power((self.loss(other) - self.loss(form)) / math.log(10.0))}"
            for other in _FORMS
            if other is not form
        )
        return f"less likely, as decimal logarithms: {', '.join(others)}"


def _asked(
    records: RecordSet,
    seen: Sequence[BlockNoise],
    signal: str,
    missing: Missing,
    declared: Sampling | None,
) -> _Likelihood | None:
    """Return how likely each form of a signal is by the blocks that it drives; nothing where none tells.

    ``declared``: the form, where one is.
    """
    asked = _asking(seen, signal)
    likelihood = _likelihood_of(_FORMS, asked, records, signal=signal, missing=missing)
    if likelihood is None or likelihood.loss(form := likelihood.likeliest) < _NO_FORM:
        return likelihood
    # The residuals are no straight line over half a sample: a shift is looked for anew around itself.
    around = [shifted(declared or form, likelihood.shift + by) for by in (0.0, *_EITHER_WAY)]
    again = _likelihood_of(around, asked, records, signal=signal, missing=missing)
    return again and likelihood.moved(again)


def _likelihood_of(
    forms: Sequence[Sampling],
    asked: Sequence[BlockNoise],
    records: RecordSet,
    *,
    signal: str,
    missing: Missing,
) -> _Likelihood | None:
    """Return how likely three forms of a signal are, of which two are half a sample off the first.

    An answer without plain terms counts only if the one with them allows it.
    """
    ways = [{signal: form} for form in forms]
    try:
        rows = [rows_of(each, records.deciding, ways, plain_terms) for each in asked]
    except ConvergenceError:
        return None  # a fit tells that the declared numbers give no response
    first = _likelihood(rows) if rows else None
    if first is None or missing is plain_terms:
        return first
    others = zip(asked, rows, strict=True)
    sharper = _likelihood(
        [own._replace(own=terms_of(each, records.deciding, missing)) for each, own in others]
    )
    return sharper if sharper and first.allows(sharper.shift) else first


def _asking(seen: Sequence[BlockNoise], signal: str) -> list[BlockNoise]:
    """Return the blocks that a signal drives, and those that share numbers with these."""
    asked = [each for each in seen if any(d.signal == signal for d in each.block.drives.values())]
    known, left = set[str](), [each for each in seen if all(each is not other for other in asked)]
    while known != (known := {name for each in asked for name in _free(each)}):
        asked += [each for each in left if known & set(_free(each))]
        left = [each for each in left if not known & set(_free(each))]
    return asked


def _free(seen: BlockNoise) -> tuple[str, ...]:
    return free_in(seen.block, [v.name for v in seen.block.model.parameters if v.spread])


def _likelihood(blocks: Sequence[BlockRows]) -> _Likelihood | None:
    """Return how likely each form is; nothing where the blocks do not depend on it.

    The residuals are freed of all terms: one for each number, and those of each block alone. What is left of
    a block beyond its noise scales the noise of that block, and rows of it that depend on each other count as
    fewer: it then says as much less, and others as much as before.
    """
    names = [*dict.fromkeys(name for each in blocks for name in each.numbers)]
    residuals = np.hstack([each.residuals for each in blocks])
    rows, rank = freed(residuals, _terms(blocks, names))
    # A balance vanishes with all of its numbers, its noise too. Where that is found, the largest is held.
    while names and np.min(np.mean(rows**2, axis=1)) < _LEAST * (1.0 - rank / rows.shape[1]):
        sizes = [
            sum(float(b.numbers[name] @ b.numbers[name]) for b in blocks if name in b.numbers)
            for name in names
        ]
        names.pop(int(np.argmax(sizes)))
        rows, rank = freed(residuals, _terms(blocks, names))
    if rank + 1 >= rows.shape[1] or not np.any(rows[1] - rows[2]):
        return None
    terms, scale = _terms(blocks, names), np.ones(rows.shape[1])
    # What is left of a noisy block also moves the numbers that it shares with others.
    for _ in range(_WEIGHINGS):
        scale = _scales(blocks, rows * np.sqrt(scale), 1.0 - (rank + 1) / rows.shape[1])
        rows, _ = freed(residuals / np.sqrt(scale), terms / np.sqrt(scale)[:, None])
    shift, best = _best_shift(rows)
    slope = rows[1] - rows[2]
    return _Likelihood(
        tuple(-0.5 * float(row @ row) for row in rows),
        -0.5 * float(best @ best),
        shift,
        1.0 / float(np.linalg.norm(slope)),
    )


def _best_shift(rows: Array) -> tuple[float, Array]:
    """Return the shift in samples that leaves least of the rows of each form, and what it leaves."""
    sampled, held, averaged = rows
    slope = held - averaged
    information = float(slope @ slope)
    shift = -float(slope @ sampled) / information if information else 0.0
    return shift, sampled + shift * slope


def _scales(blocks: Sequence[BlockRows], rows: Array, free: float) -> Array:
    """Return for each row the variance of the noise of its block, as many as are independent counted.

    It is what the shift that suits the block best leaves of it. ``free``: share of the rows that the terms
    have not taken.
    """
    scales, behind = [], 0
    for each in blocks:
        part, behind = rows[:, behind : behind + (n := each.residuals.shape[1])], behind + n
        best = _best_shift(part)[1]
        scales.append(np.full(n, max(1.0, float(best @ best) / (free * n)) * n / effective_size(best)))
    return np.hstack(scales)


def _terms(blocks: Sequence[BlockRows], names: Sequence[str]) -> Array:
    """Return what may explain the residuals of all blocks: numbers that they share, then terms of each."""
    bands = []
    for k, each in enumerate(blocks):
        zero = np.zeros(each.residuals.shape[1])
        shared = [each.numbers.get(name, zero) for name in names]
        others = [np.zeros((len(zero), other.own.shape[1])) for other in blocks]
        bands.append(np.column_stack([*shared, *others[:k], each.own, *others[k + 1 :]]))
    return np.vstack(bands)


def freed(residuals: Array, terms: Array) -> tuple[Array, int]:
    """Return the residuals without what the terms can explain, and how many terms count."""
    size = np.linalg.norm(terms, axis=0)
    terms = terms[:, size > 0.0] / size[size > 0.0]
    u, strength, _ = np.linalg.svd(terms, full_matrices=False)
    basis = u[:, strength > 1e-8 * strength.max(initial=0.0)]
    return residuals - (residuals @ basis) @ basis.T, basis.shape[1]


def rows_of(
    seen: BlockNoise, records: Sequence[Record], forms: Sequence[Mapping[str, Sampling]], missing: Missing
) -> BlockRows:
    """Return the residuals of a block on the records that it sees, for each way to read it."""
    block, filters, free = seen.block, seen.filters, _free(seen)
    chosen = [r for r in records if r.name in seen.floors]
    driven = DrivenBlock(block, free, records=chosen, span=filters.span, straightened=filters.straightened)
    residuals, slopes = [], []
    for record in chosen:
        floor = seen.floors[record.name]
        values, rows = block.model.values, []
        for form in forms:
            read = record.read_as(form)
            response = driven.respond(driven.samples(read, values), values)
            error = (read.as_computed(block.target) if block.target else 0.0) - response.output
            rows.append((floor.filter @ error) / floor.sigma)
        residuals.append(np.array(rows))
        # The slopes of the last form stand for all: they differ by a sample at most.
        slopes.append((floor.filter @ response.slope) / floor.sigma[:, None])
    parts = np.vstack(slopes) * [values[name] or 1.0 for name in free]
    numbers = dict(zip(free, parts.T, strict=True))
    return BlockRows(np.hstack(residuals), numbers, terms_of(seen, records, missing))


def terms_of(seen: BlockNoise, records: Sequence[Record], missing: Missing) -> Array:
    """Return what a block may lack on the records that it sees, shape (rows, terms)."""
    terms = []
    for record in (r for r in records if r.name in seen.floors):
        floor = seen.floors[record.name]
        own = [(floor.filter @ term) / floor.sigma for term in missing(seen.block, record, seen.filters.span)]
        terms.append(np.reshape(own, (len(own), len(floor.sigma))).T)
    return np.vstack(terms)


def no_terms(_block: Block, _record: Record, _span: float) -> Iterator[Array]:
    """Yield no term: the block lacks nothing."""
    yield from ()


def plain_terms(block: Block, record: Record, span: float) -> Iterator[Array]:
    """Yield what may be missing in a block whatever it is: plain functions of what drives it."""
    yield np.ones(len(record.trace))
    motions = dict.fromkeys(d.signal for d in block.drives.values() if d.order > 0)
    others = dict.fromkeys(d.signal for d in block.drives.values() if d.signal not in motions)
    inputs = [np.abs(record.trace[signal]) for signal in others]
    for signal in motions:
        place = record.trace[signal]
        rate = derivative(place, record.step, order=1, span=span)
        yield from (place, np.sin(place), np.cos(place), rate, rate * np.abs(rate))
        # The force of a spring that rubs is no input: it is what accelerates the body behind it.
        force = np.abs(derivative(place, record.step, order=2, span=span))
        yield from (np.sign(rate) * size for size in (1.0, *inputs, force))


def functions_of_motion(block: Block, record: Record, span: float) -> Iterator[Array]:
    """Yield what a block may lack that goes with its motion, as friction over the place or a delay does."""
    yield from plain_terms(block, record, span)
    for signal in dict.fromkeys(d.signal for d in block.drives.values() if d.order > 0):
        place = record.trace[signal]
        rate = derivative(place, record.step, order=1, span=span)
        for wave in (np.sin(place), np.cos(place)):
            yield np.sign(rate) * wave
        yield np.gradient(derivative(place, record.step, order=2), record.step)
