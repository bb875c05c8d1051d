"""How an input runs between its samples, told from the records where nobody says it.

Half a sample is seen in a balance of efforts long before it is seen in a picture. Each way to run between
samples gives other residuals of the blocks that the input drives; their likelihoods are compared. What else
the model may lack must not decide: numbers with a spread, and a set of plain terms of each motion (constant,
place, sine and cosine of it, speed, its sign and its square) take from the residuals what
they can, however much. So a friction that nobody declared is not taken for a hold.

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
from .block import Block
from .block_noise import BlockNoise, Filters
from .block_response import DrivenBlock

_FORMS = (SAMPLED, HELD, AVERAGED)
_PLAINLY = 5.0
"""Natural logarithm of the likelihood ratio from which another way to run is taken: odds of 150."""
_MOST = 1.0
"""Samples by which two channels can be shifted against each other: half a sample of each."""
_ERRORS = 3.0
"""Standard errors by which a shift must lie beyond that to be none."""


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
            told, remark = _told(records, seen, column.signal)
            remarks = (Finding(f"column '{column.name}'", remark),) if remark else ()
            records = replace(
                with_sampling(records, {column.signal: told}), remarks=records.remarks + remarks
            )
    return records


def with_sampling(records: RecordSet, sampling: Mapping[str, Sampling]) -> RecordSet:
    """Return the records in which some inputs run between their samples as they are told to."""
    columns = tuple(replace(c, sampling=sampling.get(c.signal, c.sampling)) for c in records.columns)
    return replace(records, records=tuple(_as(r, sampling) for r in records.records), columns=columns)


def _as(record: Record, sampling: Mapping[str, Sampling]) -> Record:
    known = {signal: form for signal, form in sampling.items() if form is not SAMPLED}
    return replace(record, sampling={**record.sampling, **known})


def _told(records: RecordSet, seen: Sequence[SeenBlock], signal: str) -> tuple[Sampling, str]:
    """Return how a signal runs between its samples, and the remark on it; none where it is sampled."""
    driven = [each for each in seen if any(d.signal == signal for d in each.block.drives.values())]
    try:
        likelihood = _Likelihood([_rows(each, records.deciding, signal) for each in driven])
    except ConvergenceError:
        return SAMPLED, ""  # a fit tells that the declared numbers give no response
    shift, error, best = likelihood.shift, likelihood.error, likelihood.of_shift
    gains = {form.name: value - best for form, value in zip(_FORMS, likelihood.of_forms, strict=True)}
    if not likelihood.tells or -gains[SAMPLED.name] < _PLAINLY or abs(shift) > _MOST + _ERRORS * error:
        return SAMPLED, ""
    form = max(_FORMS, key=lambda each: gains[each.name])
    words = f"is taken as {form.name}: it {form.words}"
    if -gains[form.name] >= _PLAINLY:
        form = shifted(shift)
        words = f"is read {abs(shift):.2g} of a sample {'later' if shift > 0.0 else 'earlier'}"
    others = ", ".join(
        f"{other.name} is e^{gains[other.name] - gains.get(form.name, 0.0):.3g} times as likely"
        for other in _FORMS
        if other is not form
    )
    return form, (
        f"{words}; nothing says how it runs between its samples, and the records show it {shift:.2f} ± "
        f"{error:.2g} samples behind its stamps ({others}); between_samples in records.toml decides it"
    )


class _Rows(NamedTuple):
    """Residuals of a block for each form, shape (forms, rows), and what may explain them, (rows, terms)."""

    residuals: Array
    terms: Array


class _Likelihood:
    """Likelihoods of the ways in which a signal runs between its samples, and of a shift of any size.

    The residuals of each block are freed of its terms. What is left beyond the noise scales the noise: the
    blocks then say as much less.
    """

    def __init__(self, blocks: Sequence[_Rows]) -> None:
        freed = [_freed(each) for each in blocks]
        rows = np.hstack([residual for residual, _ in freed])
        slope = rows[_FORMS.index(HELD)] - rows[_FORMS.index(AVERAGED)]
        information = float(slope @ slope)
        count = rows.shape[1] - sum(rank for _, rank in freed) - 1
        self.tells = count > 0 and information > 0.0
        if not self.tells:
            self.shift = self.error = self.of_shift = 0.0
            self.of_forms = [0.0] * len(_FORMS)
            return
        sampled = rows[_FORMS.index(SAMPLED)]
        self.shift = -float(slope @ sampled) / information
        left = float(np.sum((sampled + self.shift * slope) ** 2))
        scale = max(1.0, left / count)
        self.error = math.sqrt(scale / information)
        self.of_shift = -0.5 * left / scale
        self.of_forms = [-0.5 * float(row @ row) / scale for row in rows]


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
            read = _as(record, {signal: form}) if form is not SAMPLED else record
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
    for signal in dict.fromkeys(d.signal for d in block.drives.values() if d.order > 0):
        place = record.trace[signal]
        rate = derivative(place, record.step, order=1, span=span)
        yield from (place, np.sin(place), np.cos(place), rate, np.sign(rate), rate * np.abs(rate))
