"""A simulated run over time: one panel for each unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_unit
from ...simulation import Trace
from .lines import thinned
from .number_text import significant
from .style import described, legend, look, panels, styled

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

    Parameters
    ----------
    run
        Simulated or measured.
    names
        What is drawn, in this order; of more than six units those of the first six.

    Raises
    ------
    ValueRangeError
        If there is none.
    UnknownNameError
        If the run has no such signal.
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
            low, high = (significant(float(end)) for end in (np.min(run[name]), np.max(run[name])))
            sizes.append(f"{name} from {low} to {high} {typeset_unit(unit)}".strip())
        shown = typeset_unit(unit)
        panel.set_ylabel(f"in {shown}" if shown else "without unit")
        legend(panel)
    axes[-1].set_xlabel("time in s")
    span = significant(float(run.time[-1] - run.time[0]))
    return described(figure, f"{len(sizes)} signals over {span} s: {'; '.join(sizes)}.")
