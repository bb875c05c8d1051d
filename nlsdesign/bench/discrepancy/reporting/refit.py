"""The declared numbers refitted to records, without any effect: what they are, how well known, how good.

Every measured force or torque is simulated from the measured motion; every moving body is held to the balance
of the efforts on it, because in a servoed record the motion is what the servo wanted. Where the motion is
free, the whole model may be simulated over windows instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ....components.assembly.named_parts import Assembly
from ....foundation.errors import MeasurementError
from ....model import flatten
from ....model.derived_deck import derived
from ...identification.equation_error.evidence import Bench
from ...identification.least_squares import Fit
from ...identification.records.measurement import RecordSet, in_canonical_order
from ...identification.records.quality import Finding
from ..blocks.tearing import blocks_of
from ..screening.drive_check import drive_findings
from ..screening.other_rig import out_of_reach
from ..screening.scale_check import scale_findings, typical_sizes
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from .advice import more_excitation
from .fitted_numbers import FittedNumber as FittedNumber
from .fitted_numbers import fitted_numbers
from .gap import gaps_of
from .verdict import RecordGap
from .window_refit import fitted_over_windows, window_gaps

_FROM_SPREAD = 0.8
"""Share of the variance of a declared spread above which the records have added next to nothing."""
_AT_END = 1.96
"""Declared ranges from the declared value; a refit is stopped at two."""


class BlockError(NamedTuple):
    """Root mean square errors of one block over the records of one role, and the noise floor, in its unit."""

    block: str
    role: str
    declared: float
    fitted: float
    noise_floor: float
    unit: str


@dataclass(frozen=True, eq=False)
class Refit:
    """A refit of the declared numbers.

    Parameters
    ----------
    actuator
        With the fitted numbers, marked with where they come from.
    fits
        One for each group of blocks that share numbers.
    numbers
        By group, in the order of the model.
    gaps
        Error of every block on every record, with the declared and with the fitted numbers.
    findings
        What makes the records suspect.
    """

    actuator: Assembly
    fits: tuple[Fit, ...]
    numbers: tuple[FittedNumber, ...]
    gaps: tuple[RecordGap, ...]
    findings: tuple[Finding, ...]

    def errors(self) -> tuple[BlockError, ...]:
        """Return the errors of each block, over the records that were fitted and over those that were not."""
        keys = dict.fromkeys((g.block, g.role) for g in self.gaps)
        return tuple(_mean([g for g in self.gaps if (g.block, g.role) == key]) for key in keys)

    def words(self) -> tuple[str, ...]:
        """Return what the records cannot tell, what is at the end of its range, and what is suspect."""
        stuck = [
            f"{n.name} stands at the end of its range, {n.strain:+.1f} declared spreads away: the declared "
            "value, its spread or the structure is wrong; ask `nlsdesign diagnose` what is missing."
            for n in self.numbers
            if abs(n.strain) >= _AT_END
        ]
        unknown = [
            f"The records say next to nothing of {name}: what is given as its error is its declared spread."
            for name, share in self._known_by_spread().items()
            if share > _FROM_SPREAD
        ]
        return (*[f"suspect: {f}" for f in self.findings], *stuck, *unknown, *more_excitation(self.fits))

    def _known_by_spread(self) -> dict[str, float]:
        """Return by name the share of what is known of a number that comes from its declared spread."""
        return {
            p.name: float(fit.covariance[i, i]) / p.sigma**2
            for fit in self.fits
            for i, p in enumerate(fit.parameters)
        }

    def to_dict(self, model: str = "model.toml") -> dict[str, Any]:
        """Return the content of ``fit.json``.

        Parameters
        ----------
        model
            Path of the deck that was written.
        """
        return {
            "numbers": [n._asdict() for n in self.numbers],
            "errors": [e._asdict() for e in self.errors()],
            "records": [
                {"block": g.block, "record": g.record, "role": g.role, "unit": g.unit,
                 "declared": g.before, "fitted": g.after, "noise_floor": g.noise_floor}
                for g in self.gaps
            ],
            "converged": all(f.converged for f in self.fits),
            "unidentified": [text for fit in self.fits for text in fit.unidentified()],
            "words": list(self.words()),
            "model": model,
        }  # fmt: skip


def _mean(gaps: Sequence[RecordGap]) -> BlockError:
    total = sum(g.rows for g in gaps)

    def rms(which: str) -> float:
        return math.sqrt(math.fsum(getattr(g, which) ** 2 * g.rows for g in gaps) / total)

    first = gaps[0]
    return BlockError(first.block, first.role, rms("before"), rms("after"), rms("noise_floor"), first.unit)


def _silent(text: str) -> None:
    """Say nothing."""


def refit(
    actuator: Assembly,
    records: RecordSet,
    *,
    window: float | None = None,
    progress: Callable[[str], None] = _silent,
) -> Refit:
    """Refit the numbers that are declared with a spread.

    Parameters
    ----------
    actuator
        As declared; the spreads are priors, and the fit stops at twice the range they stand for.
    records
        Bench records with their roles; those held out are only judged on.
    window
        Length in s of windows over which the whole model is then simulated from the measured state, driven by
        the measured inputs, and the numbers fitted to that; without it the blocks decide.
    progress
        Told what is being done.

    Raises
    ------
    MeasurementError
        If no number has a spread, the records do not fit the model, or nothing moves enough.
    ConvergenceError
        If the numbers cannot be fitted.
    """
    progress("refitting the declared numbers")
    bench = Bench(records, blocks_of(flatten(actuator), records.signals))
    records = in_canonical_order(records)
    comparison = Comparison(bench, typical_sizes(actuator, bench.records))
    fitted = comparison.base(actuator)
    if not any(fit.parameters for fit in fitted.fits.values()):
        raise MeasurementError(
            f"deck of '{actuator.name}'",
            "declares no spread for any number that these records show, so none is free",
            next_step="give what is uncertain a spread, for instance spread = 0.1",
        )
    findings = (*records.findings, *out_of_reach(actuator, records), *scale_findings(comparison, fitted))
    findings = findings or tuple(drive_findings(actuator, comparison, fitted))
    fits, window_errors = tuple(fitted.fits.values()), tuple[RecordGap, ...]()
    if window is not None:
        progress(f"simulating windows of {window:g} s")
        values, fit = fitted_over_windows(actuator, records, fitted.values, window)
        fitted = comparison.on_all_samples(replace(fitted, values=values))
        fits, window_errors = (fit,), window_gaps(actuator, values, records, window)
    numbers = fitted_numbers(fits)
    fitted = fitted.as_written()
    gaps = gaps_of(Hypothesis(actuator), fitted, comparison)
    better = derived(sourced(fitted), actuator, "refitted")
    return Refit(better, fits, numbers, (*gaps, *window_errors), findings)


def sourced(hypothesis: Hypothesis) -> Assembly:
    """Return the fitted assembly, its fitted numbers marked with where they come from."""
    fitted = hypothesis.fitted
    known, declared = fitted.quantities(), hypothesis.assembly.quantities()
    rows = {name.partition("[")[0] for name in hypothesis.values}
    return fitted.with_values(
        {
            n: known[n].with_value(known[n].value, f"fitted to bench records; declared: {declared[n].source}")
            for n in rows
        }
    )
