"""Fronts of two or three goals."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...design import ParetoFront
from ...foundation.quantity import typeset_unit, with_unit
from .number_text import significant
from .style import described, legend, look, panels, styled


@styled
def pareto_front(front: ParetoFront) -> Figure:
    """Draw the points of a front: the first goal over the second, by steps of the third where there is one.

    Each point carries its number in the front.

    Parameters
    ----------
    front
        Of two or three goals.
    """
    figure, (axes,) = panels(1, height=3.4)
    labels = [
        goal if unit == "1" else f"{goal} in {typeset_unit(unit)}"
        for goal, unit in zip(front.goals, front.units, strict=True)
    ]
    values = front.shown
    for step, numbers in enumerate(_steps(front)):
        tone, dash, marker = look(step)
        chosen = values[numbers][np.argsort(values[numbers][:, 1])]
        named = None if len(labels) == 2 else _range(front, values[numbers][:, 2])
        joined = dash if len(labels) == 2 else ""
        axes.plot(chosen[:, 1], chosen[:, 0], color=tone, linestyle=joined, marker=marker, label=named)
    for number, row in enumerate(values):
        axes.annotate(str(number), (row[1], row[0]), xytext=(5, 4), textcoords="offset points", fontsize=8)
    axes.set_xlabel(labels[1])
    axes.set_ylabel(labels[0])
    axes.margins(0.08)
    if len(labels) == 3:
        axes.set_title(labels[2])
    legend(axes)
    return described(figure, _words(front))


def _steps(front: ParetoFront) -> list[list[int]]:
    """Return the numbers of the points, for three goals in up to four steps of the third."""
    everything = list(range(len(front.points)))
    if len(front.goals) == 2:
        return [everything]
    third = front.shown[:, 2]
    edges = np.linspace(third.min(), third.max(), 5)[1:-1]
    step = np.searchsorted(edges, third)
    groups = [[number for number in everything if step[number] == k] for k in range(4)]
    return [group for group in groups if group]


def _range(front: ParetoFront, values: np.ndarray) -> str:
    ends = dict.fromkeys(significant(float(value)) for value in (values.min(), values.max()))
    unit = front.units[2]
    return with_unit(" to ".join(ends), "" if unit == "1" else unit)


def _words(front: ParetoFront) -> str:
    low, high = front.shown.min(axis=0), front.shown.max(axis=0)
    ranges = (
        f"{goal} {with_unit(f'{significant(float(a))} to {significant(float(b))}', unit)}"
        for goal, unit, a, b in zip(front.goals, front.units, low, high, strict=True)
    )
    return f"Front of {len(front.points)} designs: " + ", ".join(ranges) + "."
