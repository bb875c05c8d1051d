"""The declared numbers refitted to records, without any effect: what they are, how well known, how good.

Every measured force or torque is simulated from the measured motion; every moving body is held to the balance
of the efforts on it, because in a servoed record the motion is what the servo wanted. Where the motion is
free, the whole model may be simulated over windows instead, begun where the blocks have left the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.errors import MeasurementError
from ....foundation.quantity import Quantity
from ....foundation.spread import NormalSpread
from ....model import FlatModel, flatten
from ....model.origin import derived
from ....model.readings import reading_of
from ...identification.equation_error.block import Drive
from ...identification.equation_error.evidence import Bench
from ...identification.least_squares import Fit
from ...identification.multiple_shooting import coloured_sigma, fit_by_simulation, predict_in_windows
from ...identification.parameters import declared_parameter
from ...identification.records.measurement import Record, RecordSet
from ...identification.records.quality import Finding
from ...identification.residuals import rmse
from ...identification.simulation_error import Shots, Weights
from ...identification.windowed_simulation import Wiring
from ..block_prediction import shown_values
from ..effects.effect import SOURCE
from ..screening.scale_and_sign import drive_findings, scale_findings, typical_sizes
from ..screening.wrong_numbers import out_of_reach
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from ..tearing import blocks_of
from .advice import more_excitation
from .fitted_numbers import FittedNumber as FittedNumber
from .fitted_numbers import fitted_numbers, with_records_named
from .verdict import RecordGap, gaps_of

_PHASES = 4
"""Windows begin at so many phases of one length, so that no sample is always near a beginning."""


def fitted_over_windows(
    actuator: Assembly, records: RecordSet, starts: Mapping[str, float], length: float
) -> tuple[dict[str, float], Fit]:
    """Fit numbers so that simulations over windows, each from the measured state, follow the records.

    ``actuator``: as declared; the spreads of its numbers are the prior.
    """
    model = flatten(actuator)
    free = [declared_parameter(model.variable(name), start) for name, start in starts.items()]
    wiring, shots = wiring_of(model, records.signals), Shots(length, False, phases=_PHASES)
    fitted = [_without_sensors(model, record, wiring) for record in records.of("fit")]
    white = fit_by_simulation(model, fitted, free, shots=shots, wiring=wiring)
    # What a model leaves over is coloured; weighed as white it would drown the prior.
    weights = Weights(coloured_sigma(white))
    fit = fit_by_simulation(model, fitted, free, shots=shots, wiring=wiring, weights=weights).fit
    return dict(fit.values), fit


def window_gaps(
    actuator: Assembly, values: Mapping[str, float], records: RecordSet, length: float
) -> tuple[RecordGap, ...]:
    """Return the error of predictions over windows, with the declared and with other numbers."""
    models = [flatten(actuator), flatten(actuator.with_values(values))]
    wiring = wiring_of(models[0], records.signals)
    gaps = []
    for record in records.records:
        shown = _without_sensors(models[0], record, wiring)
        runs = [predict_in_windows(m, shown, length, wiring=wiring) for m in models]
        for signal in wiring.outputs:
            before, after = (rmse(run.error[signal]) for run in runs)
            floor, unit = record.resolution_of(signal).noise, record.trace.units[signal]
            name = f"{signal} over {length:g} s"
            rows = len(runs[0].time)
            gaps.append(RecordGap(name, record.name, record.role, before, after, floor, rows, unit))
    return tuple(gaps)


def wiring_of(model: FlatModel, signals: Sequence[str]) -> Wiring:
    """Wire readings to the inputs and states that they show; other readings to themselves."""
    inputs: dict[str, Drive] = {}
    outputs: dict[str, str] = {}
    names, states = {v.name for v in model.inputs}, {v.name for v in model.states}
    for signal in signals:
        reading = reading_of(model.readings, signal)
        if reading.measured in names and reading.shows_value:
            inputs[reading.measured] = Drive(signal)
        else:
            direct = reading.measured in states and reading.shows_value
            outputs[signal] = reading.measured if direct else signal
    if not any(output in states for output in outputs.values()):
        raise MeasurementError(
            "fit over windows", "no state of the model is measured, so no window can begin",
            next_step="leave --window out, or measure an angle or a position",
        )  # fmt: skip
    return Wiring(inputs, outputs)


def _without_sensors(model: FlatModel, record: Record, wiring: Wiring) -> Record:
    """Return a record in which readings that stand for a state or an input are what their sensors have seen.

    With the numbers that the model has; readings that are compared with readings stay.
    """
    replaced = {drive.signal for drive in wiring.inputs.values()}
    replaced |= {signal for signal, output in wiring.outputs.items() if output != signal}
    signals = {
        n: shown_values(model, record, n) if n in replaced else v for n, v in record.trace.signals.items()
    }
    return replace(record, trace=replace(record.trace, signals=signals))


_EXPLAINED = 2.0
"""Times its noise beyond which a block is plainly not explained."""
_FROM_SPREAD = 0.8
"""Share of the variance of a declared spread above which the records have added next to nothing."""


class BlockError(NamedTuple):
    """Root mean square errors of one block over the records of one role, and the noise floor, in its unit."""

    block: str
    role: str
    declared: float
    fitted: float
    noise_floor: float
    unit: str
    # relative: average percent relative error with the fitted numbers, over the samples beyond a tenth of the
    # largest; None for predictions over windows
    relative: float | None


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
            f"{n.name} stands at the end of its range, {n.strain:+.1f} standard deviations away: the "
            "declared value, its spread or the structure is wrong; ask `nlsdesign diagnose` what is missing."
            for n in self.numbers
            if n.at_end
        ]
        unknown = [
            f"The records say next to nothing of {name}: what is given as its error is its declared spread."
            for name, share in self._known_by_spread().items()
            if share > _FROM_SPREAD and name not in {n.name for n in self.numbers if n.at_end}
        ]
        left = [
            f"No numbers explain the records: {e.block} is left at {e.fitted / e.noise_floor:.2g} times its "
            "noise, and these stand for what is missing too; ask `nlsdesign diagnose` of the declared deck."
            for e in self.errors()
            if e.role == "fit" and e.fitted > _EXPLAINED * e.noise_floor > 0.0
        ]
        suspect = [f"suspect: {f}" for f in self.findings]
        return (*suspect, *left, *stuck, *unknown, *more_excitation(self.fits))

    def _known_by_spread(self) -> dict[str, float]:
        """Return by name the share of what is known of a number that comes from its declared spread."""
        return {
            p.name: float(fit.covariance[i, i]) / p.sigma**2
            for fit in self.fits
            for i, p in enumerate(fit.parameters)
            if math.isfinite(p.sigma)
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

    first, relative = gaps[0], sum(g.relative * g.rows for g in gaps) / total
    sizes = (rms("before"), rms("after"), rms("noise_floor"))
    return BlockError(first.block, first.role, *sizes, first.unit, None if math.isnan(relative) else relative)


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
        As declared; the spreads are priors, and the fit stops at three standard deviations.
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
    records = records.in_canonical_order()
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


def refit_of_run(result: Refit, records: RecordSet, *, folder: str, day: str) -> Refit:
    """Return a fit whose numbers name in their source the records that they were fitted to."""
    names = [record.name for record in records.of("fit")]
    return replace(result, actuator=with_records_named(result.actuator, folder, names, day=day))


UNTOLD = 0.9
"""Share of a declared spread; where records leave more of it, the source says that they tell little."""


def sourced(hypothesis: Hypothesis, *, narrowed: bool = False) -> Assembly:
    """Return the fitted assembly, its fitted numbers marked with where they come from.

    A number that an effect has brought has its standard error as its spread. ``narrowed``: whether declared
    numbers have only the share of their spread that the records have left, of a row the largest; not where
    something is missing from the model, for a wrong number would be stated as well known. That two numbers
    are known together, such as a ratio, is not in it.
    """
    fitted = hypothesis.fitted
    known, declared = fitted.quantities(), hypothesis.assembly.quantities()
    shares, errors = dict[str, float](), dict[str, float]()
    for fit in hypothesis.fits.values():
        for p, variance in zip(fit.parameters, np.diag(fit.covariance), strict=True):
            name = p.name.partition("[")[0]
            share = math.sqrt(variance) / p.sigma if math.isfinite(p.sigma) else 0.0
            shares[name] = max(shares.get(name, 0.0), share)
            errors[name] = fit.standard_error(p.name)
    new = {u.name.partition("[")[0] for u in hypothesis.unknowns}
    written = dict[str, Quantity]()
    for name in {name.partition("[")[0] for name in hypothesis.values}:
        remaining = shares.get(name, 0.0)
        little = remaining > UNTOLD and name not in new
        remark = f", which leave {100 * remaining:.0f} % of its spread" if little else ""
        now, source = known[name], SOURCE + remark
        source += "" if name in new else f"; declared: {declared[name].source}"
        now = now.with_value(now.value, source)
        if name in new and errors.get(name, 0.0) > 0.0 and isinstance(now.value, float):
            now = now.with_spread(NormalSpread(errors[name]))
        elif narrowed and now.spread and shares.get(name, 1.0) < 1.0:
            now = now.with_spread(now.spread.narrowed(shares[name]))
        written[name] = now
    return fitted.with_values(written)
