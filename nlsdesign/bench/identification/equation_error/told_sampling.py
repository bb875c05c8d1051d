"""How an input runs between its samples, told from the records where nobody says it.

Half a sample is seen in a balance of efforts long before it is seen in a picture. Each way to run between
samples gives other residuals of the blocks that the input drives; their likelihoods are compared. What else
the model may lack must not decide: numbers with a spread, and plain terms of each motion (a constant, the
place, its sine and cosine, the speed, its square, and its sign, alone and times the size of the input) take
from the residuals what they can, however much. So a friction that nobody declared is not taken for a hold.

Channels of one recorder can also be shifted against each other by a part of a sample, as where they are
sampled in turn. Up to half a sample of each of the two, such a shift is a number without a meaning of its
own: it is found in the same way, and told. A delay beyond that is left for effects to explain.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ..filters import derivative
from ..records.measurement import Record, RecordSet
from ..records.quality import Finding
from ..records.sampling import AVERAGED, HELD, SAMPLED, Sampling, shifted
from ..residuals import effective_size
from .block import Block
from .block_noise import BlockNoise, Filters
from .block_response import DrivenBlock

_FORMS = (SAMPLED, HELD, AVERAGED)
_PLAINLY = 3.0
"""Natural logarithm of the likelihood ratio from which another way to run is taken: odds of 20."""
_NO_FORM = 10.0
"""The same for a shift that none of the usual ways explains: it is rare, and what a model lacks looks so."""
_MOST = 1.0
"""Samples by which two channels can be shifted against each other: half a sample of each."""


class SeenBlock(NamedTuple):
    """A block with the filters and the noise floors with which it reads the records, by record."""

    block: Block
    filters: Filters
    floors: Mapping[str, BlockNoise]


def with_told_sampling(records: RecordSet, seen: Sequence[SeenBlock]) -> RecordSet:
    """Return the records in which every input runs between its samples as they tell best, with remarks.

    ``records``: inputs of which nothing is said have columns without a sampling.
    """
    for column in records.columns:
        if column.sampling is None:
            likelihood = _asked(records, seen, column.signal)
            inferred, remark = likelihood.taken() if likelihood else (SAMPLED, "")
            records = with_sampling(records, {column.signal: inferred})
        elif column.declared and column.sampling is not SAMPLED:
            likelihood = _asked(records, seen, column.signal)
            remark = likelihood.against(column.sampling) if likelihood else ""
        else:
            continue
        if remark:
            finding = Finding(f"column '{column.name}'", remark)
            records = replace(records, remarks=(*records.remarks, finding))
    return records


def with_sampling(records: RecordSet, sampling: Mapping[str, Sampling]) -> RecordSet:
    """Return the records in which some inputs run between their samples as they are told to."""
    columns = tuple(replace(c, sampling=sampling.get(c.signal, c.sampling)) for c in records.columns)
    return replace(records, records=tuple(_as(r, sampling) for r in records.records), columns=columns)


def _as(record: Record, sampling: Mapping[str, Sampling]) -> Record:
    known = {**record.sampling, **sampling}
    return replace(record, sampling={s: form for s, form in known.items() if form is not SAMPLED})


class _Rows(NamedTuple):
    """Residuals of a block for each form, shape (forms, rows), and what may explain them, (rows, terms)."""

    residuals: Array
    terms: Array


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
            form = shifted(self.shift)
            words = f"is read {abs(form.late):.2g} of a sample {'earlier' if form.late > 0.0 else 'later'}"
        return form, (
            f"{words}; nothing says how it runs between its samples, and the records show that it acts "
            f"{late} ({others}); to decide it, write between_samples in records.toml"
        )

    def against(self, declared: Sampling) -> str:
        """Return the remark that the records speak against what is declared; none where they do not."""
        form = self.likeliest
        if abs(self.shift) > _MOST or form.late == declared.late:
            return ""
        if 0.5 * ((declared.late - self.shift) / self.error) ** 2 < _NO_FORM:
            return ""
        return (
            f"is declared {declared.name}, but the records show that it acts {self.shift:.2f} ± "
            f"{self.error:.2g} samples behind its stamps ({self.losses_of_others(form)}); it is read "
            f"as declared: check between_samples in records.toml, {form.name} would fit"
        )

    def losses_of_others(self, form: Sampling) -> str:
        """Return in words how much less likely the other forms are than one of them."""
        others = (
            f"{other.name} by {(self.loss(other) - self.loss(form)) / math.log(10.0):.3g}"
            for other in _FORMS
            if other is not form
        )
        return f"less likely, as decimal logarithms: {', '.join(others)}"


def _asked(records: RecordSet, seen: Sequence[SeenBlock], signal: str) -> _Likelihood | None:
    """Return how likely each form of a signal is by the blocks that it drives; nothing where none tells."""
    driven = [each for each in seen if any(d.signal == signal for d in each.block.drives.values())]
    try:
        return _likelihood([_rows(each, records.deciding, signal) for each in driven]) if driven else None
    except ConvergenceError:
        return None  # a fit tells that the declared numbers give no response


def _likelihood(blocks: Sequence[_Rows]) -> _Likelihood | None:
    """Return how likely each form is; nothing where the blocks do not depend on it.

    The residuals of each block are freed of its terms. What is left beyond the noise scales the noise, and
    rows that depend on each other count as fewer: the blocks then say as much less.
    """
    freed = [_freed(each) for each in blocks]
    rows = np.hstack([residual for residual, _ in freed])
    sampled, held, averaged = rows
    slope = held - averaged
    information = float(slope @ slope)
    count = rows.shape[1] - sum(rank for _, rank in freed) - 1
    if count <= 0 or information == 0.0:
        return None
    shift = -float(slope @ sampled) / information
    best = sampled + shift * slope
    scale = max(1.0, float(best @ best) / count) * rows.shape[1] / effective_size(best)
    return _Likelihood(
        tuple(-0.5 * float(row @ row) / scale for row in rows),
        -0.5 * float(best @ best) / scale,
        shift,
        math.sqrt(scale / information),
    )


def _freed(rows: _Rows) -> tuple[Array, int]:
    """Return the residuals without what the terms can explain, and how many terms count."""
    size = np.linalg.norm(rows.terms, axis=0)
    terms = rows.terms[:, size > 0.0] / size[size > 0.0]
    u, strength, _ = np.linalg.svd(terms, full_matrices=False)
    basis = u[:, strength > 1e-8 * strength.max(initial=0.0)]
    return rows.residuals - (rows.residuals @ basis) @ basis.T, basis.shape[1]


def _rows(seen: SeenBlock, records: Sequence[Record], signal: str) -> _Rows:
    """Return the residuals of a block on all records for each form, with its terms."""
    block, filters = seen.block, seen.filters
    free = [v.name for v in block.model.parameters if v.spread]
    chosen = [r for r in records if r.name in seen.floors]
    driven = DrivenBlock(block, free, records=chosen, span=filters.span, straightened=filters.straightened)
    residuals, terms = [], []
    for record in chosen:
        floor = seen.floors[record.name]
        values, rows = block.model.values, []
        for form in _FORMS:
            read = _as(record, {signal: form})
            response = driven.respond(driven.samples(read, values), values)
            error = (read.as_computed(block.target) if block.target else 0.0) - response.output
            rows.append((floor.filter @ error) / floor.sigma)
        # The slopes of the last form stand for all: they differ by a sample at most.
        columns = [*response.slope.T, *_plain_terms(block, record, filters.span)]
        residuals.append(np.array(rows))
        terms.append((floor.filter @ np.column_stack(columns)) / floor.sigma[:, None])
    return _Rows(np.hstack(residuals), np.vstack(terms))


def _plain_terms(block: Block, record: Record, span: float) -> Iterator[Array]:
    """Yield what may be missing in a block whatever it is: plain functions of what drives it."""
    yield np.ones(len(record.trace))
    motions = dict.fromkeys(d.signal for d in block.drives.values() if d.order > 0)
    others = dict.fromkeys(d.signal for d in block.drives.values() if d.signal not in motions)
    inputs = [np.abs(record.trace[signal]) for signal in others]
    for signal in motions:
        place = record.trace[signal]
        rate = derivative(place, record.step, order=1, span=span)
        yield from (place, np.sin(place), np.cos(place), rate, rate * np.abs(rate))
        yield from (np.sign(rate) * size for size in (1.0, *inputs))
