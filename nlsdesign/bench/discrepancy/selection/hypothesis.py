"""A hypothesis about what is missing: an assembly with effects, fitted to records; what it leaves over."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ....components.assembly.named_parts import Assembly
from ....foundation.quantity import to_resolution
from ...identification.equation_error.evidence import Bench
from ...identification.least_squares import Fit
from ..effects.effect import Candidate, Unknown
from ..fitting import Key, Tally, like_the_others
from .criteria import Criteria
from .measures import DECLARED, Excess


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An assembly fitted to the records."""

    assembly: Assembly  # with declared numbers, and the effects added so far
    added: tuple[Candidate, ...] = ()  # the effects, in the order in which they were added
    values: Mapping[str, float] = field(default_factory=dict)  # fitted numbers by name
    # fits: one for each group of blocks that share parameters, by the names of the blocks
    fits: Mapping[tuple[str, ...], Fit] = field(default_factory=dict)
    # tallies: what is left over by block and record; empty where nothing was fitted yet
    tallies: Mapping[Key, Tally] = field(default_factory=dict)
    coarse: bool = False  # whether it was fitted to thinned records only
    # has_free_flight: whether a body flies freely in it between contacts: one contact at the wrong moment,
    # and the prediction stays wrong for a while, however right the effect
    has_free_flight: bool = False
    # unpredictable: blocks and records that such a body makes unpredictable; they count as the others do
    unpredictable: frozenset[Key] = frozenset()
    # released: declared numbers of which nothing is taken as known, because the records contradict their
    # spread
    released: frozenset[str] = frozenset()
    held: frozenset[str] = frozenset()  # numbers that fits leave as they are in the assembly

    @property
    def newest(self) -> Candidate:
        """The effect that was added last."""
        return self.added[-1]

    @property
    def names(self) -> tuple[str, ...]:
        """Identifiers of the effects."""
        return tuple(c.effect for c in self.added)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Numbers that the effects brought along."""
        return tuple(u for c in self.added for u in c.unknowns)

    @property
    def prior(self) -> float:
        """Sum of squared departures from declared numbers, in standard deviations of their spread."""
        return float(sum(z**2 for f in self.fits.values() for z in f.prior_z_scores().values()))

    @property
    def expected_prior(self) -> float:
        """What noise alone makes of that sum, if the rig is the declared one."""
        return math.fsum(f.expected_prior_squares() for f in self.fits.values())

    @property
    def fitted(self) -> Assembly:
        """The assembly with the fitted numbers."""
        return self.assembly.with_values(self.values)

    def as_written(self) -> Hypothesis:
        """Return the hypothesis with each number rounded to a thousandth of its standard error.

        So the deck that is written predicts what the verdict shows, on every processor.
        """
        errors = {p.name: fit.standard_error(p.name) for fit in self.fits.values() for p in fit.parameters}
        return replace(self, values={n: to_resolution(v, errors.get(n, 0.0)) for n, v in self.values.items()})

    def as_known_beside(self, left: Mapping[str, Excess]) -> Hypothesis:
        """Return the hypothesis with its numbers as known as they are beside what blocks leave open.

        ``left``: excess by block. What a model lacks misses alike throughout a record, as noise does not.
        """
        fits = {
            names: replace(fit, covariance=fit.covariance if fit.by_records is None else fit.by_records)
            if any(left[name].open for name in names if name in left)
            else fit
            for names, fit in self.fits.items()
        }
        return replace(self, fits=fits)

    def with_names_held(self) -> Hypothesis:
        """Return the hypothesis with the numbers of its effects in the assembly, where no fit moves them."""
        names = [u.name for u in self.unknowns]
        assembly = self.assembly.with_values({n: self.values[n] for n in names if n in self.values})
        return replace(self, assembly=assembly, held=frozenset(names))

    def judged_by(self, tallies: Mapping[Key, Tally]) -> Hypothesis:
        """Return the hypothesis with what it leaves over; an unpredictable record counts as the others do."""
        return replace(self, tallies=like_the_others(tallies, self.unpredictable))


def excesses(hypothesis: Hypothesis, bench: Bench, criteria: Criteria) -> dict[str, Excess]:
    """Return the excess of each block, and of the declared numbers."""
    names = dict.fromkeys(block for block, _ in hypothesis.tallies)
    result = {name: _block_excess(hypothesis, bench, name, criteria) for name in names}
    prior, count = hypothesis.prior, sum(len(f.prior_z_scores()) for f in hypothesis.fits.values())
    # What scatters the residuals of an open block is not noise, and excuses no number.
    closed = not any(each.open for each in result.values())
    expected = hypothesis.expected_prior if closed else float(count)
    typical, beyond = math.sqrt(prior / max(count, 1)), criteria.is_beyond_prior(prior, expected)
    result[DECLARED] = Excess(
        DECLARED, "1", 1.0, typical, typical, prior, count, float(max(count, 1)), beyond
    )
    return result


def _block_excess(hypothesis: Hypothesis, bench: Bench, block: str, criteria: Criteria) -> Excess:
    tallies = {record: t for (b, record), t in hypothesis.tallies.items() if b == block}
    rows = sum(t.rows for t in tallies.values())
    effective = sum(t.effective_size for t in tallies.values())
    fitted, predicted = sum(t.squares for t in tallies.values()), sum(t.predicted for t in tallies.values())
    read = bench.block_noise[block]
    floor, known_from = read.typical, read.known

    def is_open(squares: float, count: int, independent: float) -> bool:
        return criteria.is_beyond_noise(squares / max(count, 1), independent, known_from)

    return Excess(
        block,
        read.block.unit,
        floor,
        floor * math.sqrt(fitted / max(rows, 1)),
        floor * math.sqrt(predicted / max(rows, 1)),
        predicted,
        rows,
        effective,
        is_open(predicted, rows, effective),
        {record: t.segments or (t.squares,) for record, t in tallies.items()},
        frozenset(r for r, t in tallies.items() if not is_open(t.predicted, t.rows, t.effective_size)),
        {record: t.in_common for record, t in tallies.items()},
    )
