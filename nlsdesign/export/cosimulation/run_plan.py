"""What a run is made of: instances, wires with their numbers, given signals, communication points.

Instances exchange values at every sample of every sampled instance, and in between as often as asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from .coupling import Coupling
from .fmu_description import FmuDescription
from .wires import split_name

MOST_POINTS = 20_000_000
"""Communication points of one run; a run with a hundred signals then fills 16 GB."""
_SAME = 1e-9
"""Times closer than this part of the step are one."""


def sample_times(period: float, stop: float) -> Array:
    """Return the samples of an instance from 0 to the end."""
    return np.arange(math.floor(stop / period + 1e-6) + 1.0) * period


def communication_points(
    stop: float,
    step: float,
    *,
    periods: Iterable[float],
    changes: Iterable[tuple[float, float]],
    parts: int = 1,
) -> Array:
    """Return the communication points in s, from 0 to the end.

    What lies between two samples is divided into equal steps no longer than asked for, so step and sample
    times are independent; sample times need not be multiples of each other.
    """
    rhythms = [(period, 0.0) for period in sorted(set(periods))] + sorted(set(changes))
    expected = parts * (stop / step + sum(stop / period for period, _ in rhythms))
    if not expected <= MOST_POINTS:
        raise ValueRangeError(
            f"stop={stop:g} s in steps of at most {step:g} s",
            f"makes {expected:.3g} communication points, at most {MOST_POINTS} are possible",
            next_step="take a longer step or an earlier end",
        )
    breaks = [np.array([0.0, stop])]
    breaks += [sample_times(period, stop) + delay % period for period, delay in rhythms]
    if not rhythms:
        breaks.append(step * np.arange(math.floor(stop / step + 1e-6) + 1.0))
    # Ascending times up to the end, those that are one by rounding taken once.
    times = np.concatenate(breaks)
    same = _SAME * min([step, *(period for period, _ in rhythms)])
    ascending = np.unique(times[times <= stop + same])
    merged: Array = ascending[np.append(True, np.diff(ascending) > same)]
    if len(merged) > 1 and merged[-1] >= stop - same:
        merged[-1] = stop
    gaps = np.diff(merged)
    counts = parts * np.maximum(1, np.ceil(gaps / step - 1e-6).astype(int))
    starts, lengths = np.repeat(merged[:-1], counts), np.repeat(gaps / counts, counts)
    numbers = np.arange(len(starts)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(starts + numbers * lengths, merged[-1])


def rows_of(points: Array, times: Array) -> NDArray[np.int64]:
    """Return the numbers of the points that are nearest to times."""
    after = np.clip(np.searchsorted(points, times), 1, max(1, len(points) - 1))
    nearer = np.abs(points[after - 1] - times) <= np.abs(points[np.minimum(after, len(points) - 1)] - times)
    return np.where(nearer, after - 1, np.minimum(after, len(points) - 1))


@dataclass(frozen=True)
class Link:
    """A wire with its numbers."""

    # target, source: instance.variable
    target: str
    source: str
    gain: float  # factor between the numbers of both ends
    delay: float  # in s
    fresh: bool  # whether a sampled source has computed already when its target reads at the same time


@dataclass(frozen=True, eq=False)
class Given:
    """A signal from outside at the communication points."""

    # values, left, middle: at each point, just before it, and in the middle of the step from it
    values: Array
    left: Array
    middle: Array


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a run needs to know."""

    descriptions: Mapping[str, FmuDescription]
    links: tuple[Link, ...]
    signals: Mapping[str, Given]
    parameters: Mapping[str, float]
    order: tuple[str, ...]
    points: Array
    coupling: Coupling

    @property
    def columns(self) -> list[str]:
        """Names of what is recorded: outputs and inner signals, then driven inputs."""
        shown = [f"{name}.{v.name}" for name, each in self.descriptions.items() for v in each.shown]
        return [*shown, *(link.target for link in self.links), *self.signals]

    def sampled(self, name: str) -> bool:
        """Tell whether an instance, or the instance of a variable, is sampled."""
        return self.descriptions[split_name(name)[0]].sample_time is not None

    @property
    def coupling_links(self) -> list[Link]:
        """Wires between continuous instances."""
        return [link for link in self.links if self.curved(link) and not self.sampled(link.target)]

    @property
    def coupled(self) -> bool:
        """Whether there is an error of coupling: inputs of continuous instances that move between samples."""
        return bool(self.coupling_links) or any(not self.sampled(name) for name in self.signals)

    @property
    def acts_at_once(self) -> bool:
        """Whether something that is computed at a time acts on a continuous instance at that time."""
        return any(link.fresh and not link.delay and not self.sampled(link.target) for link in self.links)

    def curved(self, link: Link) -> bool:
        """Tell whether the source of a wire is continuous."""
        return not self.sampled(link.source)


def points_of(
    descriptions: Mapping[str, FmuDescription],
    links: Sequence[Link],
    stop: float,
    step: float,
    parts: int = 1,
) -> Array:
    """Return the communication points of a system in s."""
    periods = {name: each.sample_time for name, each in descriptions.items() if each.sample_time is not None}
    changes = {
        (periods[split_name(link.source)[0]], link.delay)
        for link in links
        if link.delay and split_name(link.source)[0] in periods and split_name(link.target)[0] not in periods
    }
    return communication_points(stop, step, periods=periods.values(), changes=changes, parts=parts)
