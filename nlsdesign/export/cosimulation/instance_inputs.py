"""The inputs of the instances of a run: what each reads, and the call that sets it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...foundation.arrays import Array
from .coupling import Curve, CurveFeed, Feed, GivenFeed, HeldFeed, LateFeed
from .fmu_instance import FmuInstance
from .run_plan import Link, Plan, rows_of, sample_times
from .wires import split_name


class InstanceInputs:
    """The driven inputs of one instance.

    ``columns``: of the row of present values, by full name.
    """

    def __init__(self, instance: FmuInstance, feeds: Mapping[str, Feed], columns: Mapping[str, int]) -> None:
        self.feeds = list(feeds.values())
        self.columns = [columns[f"{instance.name}.{name}"] for name in feeds]
        self.moves = any(feed.moves for feed in self.feeds)
        self._values = np.full(len(feeds), np.nan)
        self._set = instance.setter(list(feeds), self._values) if feeds else None

    def first(self) -> list[float]:
        """Return the values during initialization."""
        return [feed.initial() for feed in self.feeds]

    def present(self, row: int, time: float) -> list[float]:
        """Return the values at a communication point."""
        return [feed.at(row, time) for feed in self.feeds]

    def before(self, row: int, time: float) -> list[float]:
        """Return the values just before a communication point."""
        return [feed.before(row, time) for feed in self.feeds]

    def over(self, row: int, time: float, length: float) -> list[float]:
        """Return the values for the step from a communication point."""
        return [feed.over(row, time, length) for feed in self.feeds]

    def apply(self, values: list[float]) -> bool:
        """Set the inputs if they are others than before; return whether they were."""
        if self._set is None or self._values.tolist() == values:
            return False
        self._values[:] = values
        self._set()
        return True

    def forget(self) -> None:
        """Forget what was set, after the instance went back to an earlier state."""
        self._values[:] = np.nan

    def begin(self) -> None:
        """Keep what late sources show before their first sample."""
        for feed in self.feeds:
            if isinstance(feed, LateFeed):
                feed.begin()


class ConnectedInputs:
    """All inputs of a run, and the values that they keep of the past.

    ``instances``: by name, with their parameters set. ``now``: present values, in the columns of the plan.
    """

    def __init__(self, plan: Plan, instances: Mapping[str, FmuInstance], now: Array) -> None:
        self._plan, self._instances, self._now = plan, instances, now
        self._columns = {name: i for i, name in enumerate(plan.columns)}
        self.samples: dict[str, list[float]] = {}
        """What sampled sources have computed, by source; only of those that are read late."""
        self.curves: dict[str, Curve] = {}
        """Continuous sources over time."""
        self.inputs = {
            name: InstanceInputs(instance, self._feeds(name), self._columns)
            for name, instance in instances.items()
        }

    def note_samples(self, names: Sequence[str]) -> None:
        """Note what sampled instances have just computed."""
        for source, samples in self.samples.items():
            if split_name(source)[0] in names:
                samples.append(float(self._now[self._columns[source]]))

    def _feeds(self, name: str) -> dict[str, Feed]:
        """Return what each driven input of an instance reads."""
        links = {
            split_name(link.target)[1]: link
            for link in self._plan.links
            if split_name(link.target)[0] == name
        }
        feeds = {variable: self._feed(name, variable, link) for variable, link in links.items()}
        for target, given in self._plan.signals.items():
            instance, variable = split_name(target)
            if instance == name:
                middle = given.values if self._plan.coupling.order < 2 else given.middle
                feeds[variable] = GivenFeed(given.values, given.left, middle)
        return feeds

    def _feed(self, name: str, variable: str, link: Link) -> Feed:
        value = np.zeros(1)
        instance = self._instances[name]
        instance.reader([instance.description.variables[variable]], value)()
        first = float(value[0])
        held = HeldFeed(self._now, self._columns[link.source], link.gain)
        if self._plan.curved(link):
            if not link.delay and self._plan.sampled(name):
                return held
            source, output = split_name(link.source)
            smooth = self._plan.descriptions[source].variables[output].variability == "continuous"
            curve = self.curves.setdefault(link.source, Curve(self._columns[link.source], smooth))
            return CurveFeed(self._now, curve, link.gain, link.delay, first)
        samples = self.samples.setdefault(link.source, [])
        period = self._plan.descriptions[split_name(link.source)[0]].sample_time or 0.0
        if link.delay:
            return LateFeed(held, samples, period, link.delay, first)
        if link.fresh:
            return held
        if not self._plan.sampled(name):
            # Without an order as with every master that passes initial values on.
            return LateFeed(held, samples, period, period, first if self._plan.order else None)
        return replace(held, samples=samples, first=first) if self._plan.order else held


def due_by_row(plan: Plan) -> dict[int, list[str]]:
    """Return the sampled instances that are due, in the order in which they compute, by row."""
    due: dict[int, list[str]] = {}
    for name in plan.order or plan.descriptions:
        period = plan.descriptions[name].sample_time
        if period is not None:
            for row in rows_of(plan.points, sample_times(period, float(plan.points[-1]))).tolist():
                due.setdefault(row, []).append(name)
    return due
