"""Signals over time: a simulated run with one panel per unit, observers, and the co-simulated closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_number, typeset_unit
from ...simulation import Trace
from .style import (
    AFTER,
    DASHES,
    INK,
    LIMIT,
    MUTED,
    PURPLE,
    described,
    label_panel,
    legend,
    log_axis,
    look,
    panels,
    root_mean_square,
    styled,
)
from .svg import thinned


@styled
def observer_error(time: Array, true: Array, estimates: Mapping[str, Array]) -> Figure:
    """Draw true and estimated torque, and the errors below.

    Parameters
    ----------
    time
        Shape (n,), in s.
    true
        True torque in N·m.
    estimates
        Estimated torque in N·m by name of the observer.
    """
    _same_length(time, {"true torque": true, **estimates})
    figure, (upper, lower) = panels(2, height=4.6, sharex=True, height_ratios=[1.5, 1])
    upper.plot(*thinned(time, true), color=INK.light, linewidth=2.4, alpha=0.45, label="true")
    summaries = []
    for number, (label, values) in enumerate(estimates.items()):
        tone, dash, _ = look(number)
        error = values - true
        rms = f"{typeset_number(1e3 * root_mean_square(error))} mN·m"
        summaries.append(f"{label} {rms}")
        upper.plot(*thinned(time, values), color=tone, linestyle=dash, label=label, linewidth=1.3)
        lower.plot(
            *thinned(time, 1e3 * error),
            color=tone,
            linestyle=dash,
            label=f"{label}: rms {rms}",
            linewidth=1.2,
        )
    lower.axhline(0.0, color=MUTED.light, linewidth=0.8)
    label_panel(upper, "torque in N·m", "Torque of the spring")
    label_panel(lower, "error in mN·m", "Estimated minus true torque")
    lower.set_xlabel("time in s")
    return described(
        figure,
        f"True and estimated torque over {typeset_number(float(time[-1] - time[0]))} s, and the error. "
        f"Root mean square error: {'; '.join(summaries)}.",
    )


@styled
def over_time(time: Array, curves: Mapping[str, Array], *, quantity: str, unit: str) -> Figure:
    """Draw signals of one kind over time.

    Parameters
    ----------
    time
        Shape (n,), in s.
    curves
        Signals by name.
    quantity, unit
        Quantity and unit, for the axis and the alternative text.
    """
    _same_length(time, curves)
    unit = typeset_unit(unit) or "1"
    figure, (axes,) = panels(1, height=2.8)
    for number, (label, values) in enumerate(curves.items()):
        tone, dash, _ = look(number)
        axes.plot(*thinned(time, values), color=tone, linestyle=dash, label=label, linewidth=1.4)
    label_panel(axes, f"{quantity} in {unit}", quantity[:1].upper() + quantity[1:])
    axes.set_xlabel("time in s")
    sizes = "; ".join(
        f"{n} from {typeset_number(float(v.min()))} to {typeset_number(float(v.max()))}"
        for n, v in curves.items()
    )
    return described(
        figure,
        f"{quantity} over {typeset_number(float(time[-1] - time[0]))} s in {unit}: {sizes}.",
    )


@dataclass(frozen=True, eq=False)
class ClosedLoopRun:
    """Signals of a closed loop over time; arrays of shape (n,), in SI."""

    time: Array  # in s
    # desired, true, estimated: torque in N·m
    desired: Array
    true: Array
    estimated: Array
    current: Array  # motor current in A
    current_limit: float = float("inf")  # in A; infinite for none


def closed_loop_of(
    trace: Trace,
    *,
    desired: str,
    true: str,
    estimated: str,
    current: str,
    current_limit: float = float("inf"),
) -> ClosedLoopRun:
    """Return the closed loop that a simulation or co-simulation ran.

    Parameters
    ----------
    trace
        For instance ``CoSimulation.trace``.
    desired, true, estimated, current
        Names of the signals in the trace.
    current_limit
        In A.

    Raises
    ------
    UnknownNameError
        If the trace has no such signal.
    """
    return ClosedLoopRun(
        trace.time, trace[desired], trace[true], trace[estimated], trace[current], current_limit
    )


@styled
def closed_loop(
    run: ClosedLoopRun,
    *,
    differences: Mapping[str, Array] | None = None,
    bound: float | None = None,
    unit: str = "N*m",
) -> Figure:
    """Draw desired, true and estimated torque, the current, and the differences to another simulation.

    Parameters
    ----------
    run
        The closed loop.
    differences
        By label: difference of a signal between two simulations, shape (n,).
    bound
        Stated bound of the differences.
    unit
        Of differences and bound; ``"1"`` where they are relative.
    """
    _same_length(run.time, {"desired": run.desired, "true": run.true, "estimated": run.estimated,
                            "current": run.current, **(differences or {})})  # fmt: skip
    count = 3 if differences else 2
    figure, axes = panels(count, height=1.5 + 1.45 * count, sharex=True, height_ratios=[1.8, 1, 1][:count])
    shown: tuple[tuple[str, Array, dict[str, Any]], ...] = (
        ("desired", run.desired, {"color": INK.light, "linestyle": (0, (4, 2)), "linewidth": 1.2}),
        ("true", run.true, {"color": AFTER.light}),
        ("estimated", run.estimated, {"color": PURPLE.light, "linestyle": DASHES[2]}),
    )
    for label, values, drawn in shown:
        axes[0].plot(*thinned(run.time, values), label=label, **drawn)
    axes[1].plot(*thinned(run.time, run.current), color=INK.light, linewidth=1.0)
    if np.max(np.abs(run.current)) > 0.5 * run.current_limit:
        for sign in (1.0, -1.0):
            axes[1].axhline(sign * run.current_limit, color=LIMIT.light, linestyle=DASHES[1], linewidth=1.0,
                            label="limit" if sign > 0 else None)  # fmt: skip
    label_panel(axes[0], "torque in N·m", "Torque of the spring")
    label_panel(axes[1], "current in A", "Motor current")
    if differences:
        _differences(axes[2], run.time, differences, (bound, typeset_unit(unit) or "1"))
    axes[-1].set_xlabel("time in s")
    errors = [
        typeset_number(1e3 * root_mean_square(values - run.true)) for values in (run.desired, run.estimated)
    ]
    return described(
        figure,
        f"Closed loop over {typeset_number(float(run.time[-1] - run.time[0]))} s. The true torque follows "
        f"the desired one within {errors[0]} mN·m rms, the estimate the true one within {errors[1]} mN·m. "
        f"The current reaches {typeset_number(float(np.max(np.abs(run.current))))} A.",
    )


def _differences(
    axes: Axes, time: Array, differences: Mapping[str, Array], scale: tuple[float | None, str]
) -> None:
    bound, unit = scale
    for number, (label, values) in enumerate(differences.items()):
        tone, dash, _ = look(number)
        size = np.abs(values)
        # Zero has no place on a logarithmic axis.
        x, y = thinned(time, np.where(size > 0.0, size, np.nan))
        largest = f"{typeset_number(float(np.max(size)), 2)} at most"
        axes.plot(x, y, color=tone, linestyle=dash, linewidth=1.0, label=f"{label}: {largest}")
    every = np.concatenate([*(np.abs(values) for values in differences.values()), [bound or 0.0]])
    positive = every[every > 0.0]
    if len(positive):
        log_axis(axes)
        axes.set_ylim(float(positive.min()) / 3.0, 3.0 * float(positive.max()))
    if bound is not None:
        label = f"bound {typeset_number(bound, 2)}"
        axes.axhline(bound, color=INK.light, linewidth=1.0, linestyle=(0, (4, 2)), label=label)
    label_panel(axes, f"|difference| in {unit}", "Co-simulation against one monolithic simulation")


def _same_length(time: Array, signals: Mapping[str, Array]) -> None:
    for name, values in signals.items():
        if values.shape != time.shape:
            raise ValueRangeError(f"signal '{name}'", f"has {values.shape} samples, time has {time.shape}")


MOST_PANELS = 6
"""Panels of one figure."""


def groups_of_signals(run: Trace, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the signals by unit, in the given order."""
    groups: dict[str, tuple[str, ...]] = {}
    for name in names:
        unit = run.units[name]
        groups[unit] = (*groups.get(unit, ()), name)
    return groups


@styled
def run_over_time(run: Trace, names: Sequence[str]) -> Figure:
    """Draw signals of a run, those of one unit in one panel.

    ``names``: what is drawn, in this order; of more than six units those of the first six. None at all is a
    ``ValueRangeError``.
    """
    groups = list(groups_of_signals(run, names).items())[:MOST_PANELS]
    if not groups:
        raise ValueRangeError("a figure over time", "has no signal", next_step="name at least one")
    figure, axes = panels(len(groups), height=1.0 + 1.5 * len(groups), sharex=True)
    sizes: list[str] = []
    for panel, (unit, members) in zip(axes, groups, strict=True):
        for name in members:
            tone, dash, _ = look(len(sizes))  # no two signals of the figure look alike
            panel.plot(*thinned(run.time, run[name]), color=tone, linestyle=dash, linewidth=1.3, label=name)
            low, high = (typeset_number(float(end)) for end in (np.min(run[name]), np.max(run[name])))
            sizes.append(f"{name} from {low} to {high} {typeset_unit(unit)}".strip())
        shown = typeset_unit(unit)
        panel.set_ylabel(f"in {shown}" if shown else "without unit")
        legend(panel)
    axes[-1].set_xlabel("time in s")
    span = typeset_number(float(run.time[-1] - run.time[0]))
    return described(figure, f"{len(sizes)} signals over {span} s: {'; '.join(sizes)}.")
