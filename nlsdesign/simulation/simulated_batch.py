"""Many simulations of one flat model at once, parameters as columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..foundation.arrays import Array, Mask
from ..foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ..model import FlatModel
from ..model.transform import named
from .buffered import Translate, as_it_is
from .column_runs import ColumnEvaluator
from .events import Event
from .input_signals import Drive, Drives, drives_of
from .integrate import RESIDUAL_LIMIT, checked_times, simulate
from .many_steps import ManySteps

_NOT_SOLVED = "a state is not finite, or an implicit equation was not solved"
_EVALUATED = 200
"""Samples whose signals are computed in one call."""


@dataclass(frozen=True, eq=False)
class SimulatedBatch:
    """What many simulations of one model gave."""

    time: Array  # in s, shape (T,)
    signals: Mapping[str, Array]  # by name, shape (columns, T); not a number in columns that failed
    units: Mapping[str, str]
    failures: Mapping[int, str]  # why columns failed, by their numbers
    events: tuple[tuple[Event, ...], ...]  # of each column: sticking, slipping, impacts, slack

    @property
    def done(self) -> Mask:
        """Whether each column was simulated to the end, shape (columns,)."""
        return np.array([i not in self.failures for i in range(len(self.events))])

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (columns, T)."""
        if name not in self.signals:
            raise unknown_name("signal of the batch", name, self.signals)
        return self.signals[name]


def simulate_batch(
    model: FlatModel,
    times: Array,
    *,
    draws: Mapping[str, Array],
    keep: Sequence[str],
    inputs: Mapping[str, Drive] | None = None,
    tolerance: float = 1e-9,
    translate: Translate = as_it_is,
) -> SimulatedBatch:
    """Simulate one model with many columns of numbers; each column is what ``simulate`` gives for it.

    Every column has its own steps. Where a law is not smooth a column is taken to the event alone and goes on
    with the others; a stiff column is simulated alone. A column that fails is named with its reason.

    Parameters
    ----------
    model
        Continuous.
    times
        Strictly ascending sample times in s, shape (T,).
    draws
        Numbers, or start values of states, in SI by name: shape (columns,).
    keep
        Names of states, inputs, outputs and signals.
    inputs
        By name, the same for all columns: a function of time, samples of shape (T,), or a constant.
    tolerance
        Error allowed per step, relative to the state and to its nominal size.
    translate
        For instance :data:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    UnknownNameError
        If a number, state, input or variable does not exist.
    ValueRangeError
        If the model is discrete or has no states, times do not ascend, or columns have different lengths.
    """
    _check(model, keep)
    times = checked_times(times)
    columns = _columns(model, draws)
    drives = drives_of(model, times, inputs or {}, hold=False)
    failures = _out_of_range(model, columns)
    count = len(next(iter(columns.values())))
    signals = {name: np.full((count, len(times)), np.nan) for name in keep}
    events: list[tuple[Event, ...]] = [()] * count
    places = [i for i in range(count) if i not in failures]
    if places:
        part = {name: values[places] for name, values in columns.items()}
        steps = ManySteps(model, drives, columns=part, tolerance=tolerance, translate=translate)
        kept, left = _evaluated(model, keep, drives, steps.run(), steps.numbers, translate)
        for i, place in enumerate(places):
            if i in steps.stiff:
                one = model.with_values({name: float(values[i]) for name, values in part.items()})
                try:
                    alone = simulate(one, times, inputs=inputs, tolerance=tolerance)
                except ConvergenceError as error:
                    failures[place] = str(error)
                    continue
                events[place], rows = alone.events, [alone[name] for name in keep]
            elif i in steps.failures or not left[i] <= RESIDUAL_LIMIT:
                failures[place] = steps.failures.get(i, _NOT_SOLVED)
                continue
            else:
                events[place], rows = steps.events(i), list(kept[:, :, i])
            for name, row in zip(keep, rows, strict=True):
                signals[name][place] = row
    units = {name: model.variable(name).unit for name in keep}
    return SimulatedBatch(times, signals, units, failures, tuple(events))


def _check(model: FlatModel, keep: Sequence[str]) -> None:
    if model.sample_time is not None or not model.states:
        raise ValueRangeError(
            f"model '{model.name}'",
            "is discrete or has no states; a batch needs a continuous model with states",
            next_step="run a sampled loop with nlsdesign.feedback.control.loop_over_spread",
        )
    known = named(model, model.symbols())
    for name in keep:
        if name not in known:
            raise unknown_name("variable of the model", name, known)


def _columns(model: FlatModel, draws: Mapping[str, Array]) -> dict[str, Array]:
    names = {v.name for group in (model.parameters, model.states) for v in group}
    columns = {}
    for name, values in draws.items():
        if name not in names:
            raise unknown_name("number or state", name, names)
        columns[name] = np.asarray(values, dtype=float)
    sizes = {values.shape for values in columns.values()}
    if len(sizes) != 1 or any(len(size) != 1 or size == (0,) for size in sizes):
        raise ValueRangeError(
            "columns of shapes " + (", ".join(str(size) for size in sorted(sizes)) or "none"),
            "every number needs as many values as the others, at least one",
        )
    return columns


def _out_of_range(model: FlatModel, columns: Mapping[str, Array]) -> dict[int, str]:
    """Return the columns whose numbers are not in the ranges of the model, with the reason."""
    reasons: dict[int, str] = {}
    for name, values in columns.items():
        v = model.variable(name)
        inside = (values >= v.minimum) & (values <= v.maximum) & np.isfinite(values)
        for i in np.flatnonzero(~inside).tolist():
            limits = f"must be a finite number in [{v.minimum:g}, {v.maximum:g}] {v.unit}"
            reasons.setdefault(i, f"{name} = {values[i]:g}: {limits.strip()}")
    return reasons


def _evaluated(
    model: FlatModel, keep: Sequence[str], drives: Drives, states: Array, numbers: Array, translate: Translate
) -> tuple[Array, Array]:
    """Return what is kept, (kept, T, columns), and the largest remainder of implicit equations."""
    s = model.symbols()
    expressions = named(model, s)
    residuals = model.equations.call([s.time, s.state, s.input, s.parameter, s.table])[3]
    worst = ca.mmax(ca.fabs(residuals)) if residuals.numel() else ca.SX(0)
    function = ca.Function(
        "kept", [s.time, s.state, s.input, s.parameter],
        [ca.densify(ca.vertcat(worst, *[expressions[name] for name in keep]))],
    )  # fmt: skip
    evaluate = ColumnEvaluator(function, 3, translate=translate)
    _, samples, count = states.shape
    kept, left = np.empty((1 + len(keep), samples, count)), np.zeros(count)
    every = max(1, _EVALUATED * 1024 // max(count, 1024))
    for first in range(0, samples, every):
        last = min(first + every, samples)
        wide = (last - first) * count
        (shown,) = evaluate(
            [
                np.repeat(drives.times[first:last], count)[None], states[:, first:last].reshape(-1, wide),
                np.repeat(drives.samples[:, first:last], count, axis=1), np.tile(numbers, last - first),
            ]
        )  # fmt: skip
        kept[:, first:last] = shown.reshape(-1, last - first, count)
    left = np.max(np.where(np.isfinite(kept[0]), kept[0], np.inf), axis=0)
    left = np.where(np.all(np.isfinite(states), axis=(0, 1)), left, np.inf)
    return kept[1:], left
