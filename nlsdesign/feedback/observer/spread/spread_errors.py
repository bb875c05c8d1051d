"""Errors of observers on one bench: with the numbers of the deck, over their spread, and cause by cause."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.csv_tables import Axis, data_set
from ....foundation.errors import ArrangementError, ConvergenceError, unknown_name
from ....foundation.quantity import three_digits
from ....foundation.text_files import write_table, write_text
from ....foundation.written_numbers import shared_prefix
from ....model import FlatModel
from ....model.roles import measured_motion, series_spring
from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import Prior, declared_prior
from ....simulation.sampled_batch import PLANT, BatchTrace, run_batch
from ..corrected.corrected_cascade import encoder_quantum
from .choice import CASCADE, DesignedObserver, designed_observer
from .estimator_bound import SensedTorque, estimator_bound, rms_over
from .observer_bench import ObserverBench, observer_bench

FINE = 1e-6
"""Counts over declared counts of the run that has no rounding of the encoder worth mentioning."""


@dataclass(frozen=True, eq=False)
class SpreadErrors:
    """Root mean square torque errors, in the unit of the torque.

    Parameters
    ----------
    observers
        Names, in the order of the first axis.
    frequencies
        In Hz, in the order of the last axis.
    unit
        Of the torque.
    torque
        Amplitude in that unit.
    exact
        With every number of the machine as declared, shape (observers, frequencies).
    drawn
        With numbers drawn from what is known of them, shape (observers, draws, frequencies).
    causes
        One number, or all numbers of a row, one standard deviation off, the two signs together, by name:
        shape (observers, frequencies). ``sampling`` is what is left with exact numbers and an encoder without
        counts, ``counts`` what the counts add.
    bound
        Least error that any estimator could have over the same draws, shape (frequencies,); empty if it was
        not computed.
    lost
        Draws whose machine did not run, and which are in none of the figures.
    """

    observers: tuple[str, ...]
    frequencies: tuple[float, ...]
    unit: str
    torque: float
    exact: Array
    drawn: Array
    causes: Mapping[str, Array]
    bound: Array
    lost: int

    def quantile(self, observer: str, share: float) -> Array:
        """Return a quantile over the draws, shape (frequencies,).

        Parameters
        ----------
        observer
            Name.
        share
            0.5 for the median.

        Raises
        ------
        UnknownNameError
            If there is no such observer.
        """
        if observer not in self.observers:
            raise unknown_name("observer", observer, self.observers)
        result: Array = np.quantile(self.drawn[self.observers.index(observer)], share, axis=0)
        return result

    def rms(self, observer: str) -> Array:
        """Return the root mean square over the draws, which the bound is compared with, shape (frequencies,).

        Parameters
        ----------
        observer
            Name.
        """
        result: Array = np.sqrt(np.mean(self.drawn[self.observers.index(observer)] ** 2, axis=0))
        return result

    @property
    def best(self) -> str:
        """The observer whose 90 % quantile is least at its worst frequency."""
        return min(self.observers, key=lambda name: float(np.max(self.quantile(name, 0.9))))

    def ranked_causes(self, observer: str) -> list[tuple[str, float]]:
        """Return the causes of an observer's error, root mean square over the frequencies, largest first.

        Parameters
        ----------
        observer
            Name.
        """
        place = self.observers.index(observer)
        sizes = {name: math.sqrt(float(np.mean(each[place] ** 2))) for name, each in self.causes.items()}
        return sorted(sizes.items(), key=lambda item: -item[1])

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset`` over observer, frequency in Hz, draw and cause; needs xarray."""
        names, over = tuple(self.causes), ("observer", "frequency")
        data = {
            "exact": (over, self.exact),
            "drawn": (("observer", "draw", "frequency"), self.drawn),
            "causes": (("cause", *over), np.array([self.causes[name] for name in names])),
        } | ({"bound": (("frequency",), self.bound)} if len(self.bound) else {})
        axes = [
            Axis("observer", "", list(self.observers)), Axis("frequency", "Hz", list(self.frequencies)),
            Axis("draw", "", np.arange(self.drawn.shape[1])), Axis("cause", "", list(names)),
        ]  # fmt: skip
        return data_set(data, axes=axes, units=dict.fromkeys(data, self.unit))

    def rows(self) -> list[list[str]]:
        """Return a table in `shown_in`: observer, errors over the spread, bound, with exact numbers."""
        rows, factor = [], self.shown_factor
        for i, name in enumerate(self.observers):
            median, most, rms = self.quantile(name, 0.5), self.quantile(name, 0.9), self.rms(name)
            for k, f in enumerate(self.frequencies):
                over = [three_digits(factor * value[k]) for value in (median, most, rms)]
                bound = three_digits(factor * self.bound[k]) if len(self.bound) else "not computed"
                rows.append([name, f"{f:g}", *over, bound, three_digits(factor * self.exact[i, k])])
        return rows

    def content(self) -> dict[str, Any]:
        """Return the errors as JSON holds them."""
        keys = ("observer", "frequency_Hz", "exact", "median", "quantile_90", "rms", "bound")
        return {
            "unit": self.unit,
            "amplitude": self.torque,
            "draws": int(self.drawn.shape[1]),
            "draws_that_did_not_run": self.lost,
            "errors": [dict(zip(keys, row, strict=True)) for row in _numbers(self)],
            "causes": {name: dict(self.ranked_causes(name)) for name in self.observers},
            "least_over_the_spread": self.best,
        }

    def write(self, folder: Path) -> list[Path]:
        """Write the errors as a table and as JSON.

        Parameters
        ----------
        folder
            Where ``errors.csv`` and ``errors.json`` are written.

        Returns
        -------
        list of pathlib.Path
            What was written.

        Raises
        ------
        ExportError
            If one cannot be written.
        """
        numbers = ("exact", "median", "quantile 90 %", "rms", "bound")
        heads = ["observer", "frequency [Hz]", *(f"{name} [{self.unit}]" for name in numbers)]
        rows = [
            [name, f"{f:g}", *(f"{v:.9g}" for v in values), "" if bound is None else f"{bound:.9g}"]
            for name, f, *values, bound in _numbers(self)
        ]
        write_table(folder / "errors.csv", [heads, *rows])
        text = json.dumps(self.content(), indent=2, ensure_ascii=False) + "\n"
        write_text(folder / "errors.json", text)
        return [folder / "errors.csv", folder / "errors.json"]

    @property
    def shown_in(self) -> str:
        """Unit in which :meth:`rows` shows errors, typeset."""
        return self._prefix()[1]

    @property
    def shown_factor(self) -> float:
        """Factor from SI to :attr:`shown_in`."""
        return self._prefix()[0]

    def _prefix(self) -> tuple[float, str]:
        most = [self.quantile(name, 0.9) for name in self.observers]
        return shared_prefix([*self.exact.ravel(), *np.ravel(most)], self.unit)

    def __str__(self) -> str:
        head = (
            f"torque error, {self.shown_in} rms, {self.torque:.3g} {self.unit}, {self.drawn.shape[1]} draws"
        )
        lines = [head, "observer  Hz  median  90 %  rms  no estimator below  exact numbers"]
        lines += ["  ".join(row) for row in self.rows()]
        return "\n".join([*lines, f"least over the spread: {self.best}"])


def _numbers(errors: SpreadErrors) -> list[tuple[Any, ...]]:
    """Return observer, frequency, exact, median, 90 %, rms and bound, one row per sine."""
    return [
        (
            name, f, float(errors.exact[i, k]), float(errors.quantile(name, 0.5)[k]),
            float(errors.quantile(name, 0.9)[k]), float(errors.rms(name)[k]),
            float(errors.bound[k]) if len(errors.bound) else None,
        )
        for i, name in enumerate(errors.observers)
        for k, f in enumerate(errors.frequencies)
    ]  # fmt: skip


def observer_errors(
    observers: Mapping[str, FlatModel],
    bench: ObserverBench,
    *,
    prior: Prior | None = None,
    draws: int = 64,
    seed: int = 0,
    bounded: int = 4,
    translate: Translate = as_it_is,
) -> SpreadErrors:
    """Run all observers on one bench: as declared, each number off by a deviation, and over draws of all.

    Parameters
    ----------
    observers
        By name; designed with the numbers of the deck, which they keep in every run.
    bench
        The bench.
    prior
        What is known of the numbers of the machine; the spreads of the deck by default.
    draws
        How many machines are drawn.
    seed
        The same seed gives the same machines.
    bounded
        Along how many of the drawn runs the Cramér–Rao bound is taken; 0 for none.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ConvergenceError
        If the machine as declared does not run, or fewer than half of those drawn do.
    """
    known = relevant(prior or declared_prior(bench.model), bench)
    shifts = _shifts(known)
    values = {name: [v, v] for name, v in zip(known.names, known.values.tolist(), strict=True)}
    for _, shifted in shifts:
        for name, value in zip(known.names, shifted.tolist(), strict=True):
            values[name].append(value)
    drawn = known.draws(draws, seed)
    rows = {f"{PLANT}.{name}": np.concatenate([values[name], drawn[name]]) for name in known.names}
    runs = 2 + len(shifts) + draws
    quantum = _quantum_name(bench)
    if quantum is not None:
        rows[f"{PLANT}.{quantum}"] = bench.model.values[quantum] * np.where(np.arange(runs) == 1, FINE, 1.0)
    estimates = {name: f"{name}.{bench.estimate}" for name in observers}
    system = bench.system(observers)
    torque, acting = f"{PLANT}.{bench.estimate}", [f"{PLANT}.{v.name}" for v in bench.model.inputs]
    batch = run_batch(
        system, bench.stop, inputs=bench.inputs, parameters=rows,
        keep=[torque, *acting, *estimates.values()], translate=translate,
    )  # fmt: skip
    errors = _errors(batch, torque, estimates, bench)
    whole = batch.finite & np.all(np.isfinite(errors), axis=(0, 2))
    first = 2 + len(shifts)
    if not whole[0] or np.mean(whole[first:]) < 0.5:
        raise ConvergenceError(
            f"bench of {bench.model.name}",
            f"{int(np.sum(~whole[first:]))} of {draws} drawn machines do not run",
            next_step="look at the spreads of the deck, or use more substeps per sample",
        )
    kept = [i for i in range(first, runs) if whole[i]]
    bound = _bound(bench, known, rows, batch, kept[:bounded]) if bounded else np.zeros(0)
    unit = bench.model.variable(bench.estimate).unit
    return SpreadErrors(
        tuple(observers), tuple(f for f, _, _ in bench.stretches), unit, bench.torque, errors[:, 0],
        errors[:, kept], _causes(errors, shifts, quantum is not None), bound,
        draws - len(kept),
    )  # fmt: skip


def errors_beside(
    plant: FlatModel,
    chosen: DesignedObserver,
    *,
    draws: int,
    sample_time: float,
    spring: str | None = None,
    measured: str | None = None,
    translate: Translate = as_it_is,
) -> SpreadErrors:
    """Run the chosen observer, the cascade and the published form on one bench, over the spread of the deck.

    Parameters
    ----------
    plant
        Flat model of an actuator.
    chosen
        Is compared with the others.
    draws
        How many machines are drawn.
    sample_time
        In s.
    spring, measured
        Where the structure leaves them open.
    translate
        Turns the equations into those that are run, such as :func:`~nlsdesign.export.quickest` gives.

    Raises
    ------
    ArrangementError
        If no number of the deck has a spread.
    """
    if not any(v.uncertain for v in plant.parameters):
        raise ArrangementError(
            f"model '{plant.name}'", "declares no spread, so there are no errors over it",
            next_step="give numbers a spread, or leave out --errors",
        )  # fmt: skip
    torque, measured = series_spring(plant, spring).effort, measured_motion(plant, measured)
    observers = {chosen.kind: chosen.design.model}
    for kind in (CASCADE, "published"):
        if kind not in observers:
            observers[kind] = designed_observer(
                plant, kind=kind, sample_time=sample_time, spring=spring, measured=measured
            ).design.model
    bench = observer_bench(plant, estimate=torque, measured=measured, sample_time=sample_time)
    try:
        encoder_quantum(plant, measured)
        bounded = 2
    except ArrangementError:
        # What no estimator can do better depends on the counts; without an encoder it is not computed.
        bounded = 0
    return observer_errors(observers, bench, draws=draws, bounded=bounded, translate=translate)


def relevant(prior: Prior, bench: ObserverBench) -> Prior:
    """Return what is known of the numbers that the bench notices at all."""
    model = bench.model
    s = model.symbols()
    everything = ca.vertcat(s.derivative, s.output, s.signal)
    depends = ca.which_depends(everything, s.parameter, 1, False)
    noticed = {v.name for v, used in zip(model.parameters, depends, strict=True) if used}
    # A signal that only informs, such as a margin to a strength, counts as noticed; it changes no error.
    return prior.only([name for name in prior.names if name in noticed])


def _shifts(prior: Prior) -> list[tuple[str, Array]]:
    """Return, for each number or row, all numbers one deviation up and down each direction."""
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(prior.names):
        groups.setdefault(name.partition("[")[0], []).append(i)
    shifts = []
    for name, places in groups.items():
        values, vectors = np.linalg.eigh(prior.covariance[np.ix_(places, places)])
        for value, vector in zip(values, vectors.T, strict=True):
            if value <= 1e-12 * max(float(values[-1]), 1e-300):
                continue
            for sign in (1.0, -1.0):
                x = np.zeros(len(prior.names))
                x[places] = sign * math.sqrt(value) * vector
                shifts.append((name, prior.numbers(x)))
    return shifts


def _quantum_name(bench: ObserverBench) -> str | None:
    try:
        encoder_quantum(bench.model, bench.measured)
    except ArrangementError:
        # Without a declared encoder the angle is read exactly; then there are no counts to leave out.
        return None
    reading = next(r for r in bench.model.readings if r.measured == bench.measured)
    return next(f"{s}.quantum" for s in reading.sensors if f"{s}.quantum" in bench.model.values)


def _errors(batch: BatchTrace, torque: str, estimates: Mapping[str, str], bench: ObserverBench) -> Array:
    """Return root mean square errors, shape (observers, runs, frequencies)."""
    result = []
    for name in estimates.values():
        wrong = batch[name] - batch[torque]
        columns = []
        for _, first, last in bench.stretches:
            counted = (batch.time >= first) & (batch.time < last)
            columns.append(np.sqrt(np.mean(wrong[:, counted] ** 2, axis=1)))
        result.append(np.stack(columns, axis=1))
    return np.array(result)


def _causes(errors: Array, shifts: list[tuple[str, Array]], counted: bool) -> dict[str, Array]:
    exact, fine = errors[:, 0] ** 2, errors[:, 1] ** 2
    squares: dict[str, Array] = {"sampling": fine}
    if counted:
        squares["counts"] = np.maximum(exact - fine, 0.0)
    for i, (name, _) in enumerate(shifts):
        # Both signs of a direction count half each.
        added = np.maximum(errors[:, 2 + i] ** 2 - exact, 0.0) / 2.0
        squares[name] = squares.get(name, np.zeros_like(added)) + added
    return {name: np.sqrt(square) for name, square in squares.items()}


def _bound(
    bench: ObserverBench, known: Prior, rows: Mapping[str, Array], batch: BatchTrace, chosen: list[int]
) -> Array:
    sensed = SensedTorque(
        bench.estimate, bench.measured, encoder_quantum(bench.model, bench.measured),
        float(bench.servo.sample_time or 1e-3),
    )  # fmt: skip
    bounds = []
    for i in chosen:
        values = {name: float(rows[f"{PLANT}.{name}"][i]) for name in known.names}
        # As they act: one sample passes before that of a computed input.
        inputs = np.stack([batch[f"{PLANT}.{v.name}"][i] for v in bench.model.inputs])
        try:
            bounds.append(estimator_bound(bench.model.with_values(values), known, inputs, sensed))
        except ConvergenceError:
            return np.zeros(0)  # an unstable motion has no bound; the table says "not computed"
    return np.array([rms_over(bounds, first, last) for _, first, last in bench.stretches])
