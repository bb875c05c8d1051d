"""The master algorithm: when each instance steps, and the age of the values that it reads.

At a communication point t: continuous instances stand at t and show their outputs there. Values that are late
arrive at the inputs. Then the sampled instances that are due read their inputs and compute what holds from t
on; what is not late reaches the others at once. This is the row of the result. Then the continuous instances
are stepped to the next point. A sampled instance is stepped once per sample, by its own sample time, so
nothing depends on the communication step but the error of coupling.

The inputs of the instances of a run: what each reads, and the call that sets it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError
from .coupling import Curve, CurveFeed, Feed, HeldFeed, LateFeed
from .fmu_instance import FmuInstance
from .isolation import Watch
from .run_plan import Link, Plan, rows_of, sample_times, split_name


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
                first = self._plan.coupling.order < 2
                feeds[variable] = replace(given, middle=given.values) if first else given
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


Values = Callable[[InstanceInputs], list[float]]
_ROUNDS = 50
"""Most rounds in which direct feedthrough between continuous instances settles."""
_SETTLED = 1e-12
"""Relative change of what has settled."""
_TINY = 1e-18
"""What counts as zero whatever the unit."""


class Master:
    """Instances that run together; fills one row per communication point."""

    def __init__(self, plan: Plan, instances: Mapping[str, FmuInstance], watch: Watch) -> None:
        self._plan, self._instances, self._watch = plan, instances, watch
        self._points: list[float] = plan.points.tolist()
        self._row = 0
        self._due = due_by_row(plan)
        columns = {name: i for i, name in enumerate(plan.columns)}
        self.now: Array = np.zeros(len(columns))
        self._read: dict[str, Callable[[], None]] = {}
        for name, instance in instances.items():
            shown = instance.description.shown
            first = columns[f"{name}.{shown[0].name}"] if shown else 0
            self._read[name] = instance.reader(shown, self.now[first : first + len(shown)])
        self._connected = self._initialised()
        self._inputs = self._connected.inputs
        links = plan.coupling_links
        sources = dict.fromkeys(link.source for link in links)
        self.curves: Sequence[Curve] = [self._connected.curves[source] for source in sources]
        ends = {split_name(end)[0] for link in links for end in (link.target, link.source)}
        self._continuous = [name for name in instances if not plan.sampled(name)]
        self._coupled = [name for name in self._continuous if name in ends]
        self._driven = [name for name in self._continuous if self._inputs[name].feeds]
        self._states: dict[str, object] = {}

    def run(self, rows: Array) -> None:
        """Run from the first communication point to the last.

        ``rows``: shape (points, columns); filled.
        """
        acts_at_once = self._plan.acts_at_once
        curves, coupling = self._connected.curves.values(), self._plan.coupling
        for row, time in enumerate(self._points):
            self._row = row
            self._watch.at_row(row)
            for curve in curves:
                curve.arrive(time, float(self.now[curve.column]))
            present = partial(InstanceInputs.present, row=row, time=time)
            self._settle(present)
            if row in self._due:
                self._sample(row, time)
                if acts_at_once:
                    self._settle(present)
            for curve in curves:
                curve.depart(float(self.now[curve.column]))
            for name in self._driven:
                self._show(name, self._inputs[name].present(row, time))
            rows[row] = self.now
            if row + 1 < len(self._points):
                coupling.step(self, time, self._points[row + 1] - time)

    def _initialised(self) -> ConnectedInputs:
        """Bring all instances through initialization; return the wires between them."""
        plan, instances = self._plan, self._instances
        for target, value in plan.parameters.items():
            name, variable = split_name(target)
            instances[name].set({variable: value})
        for name, instance in instances.items():
            # A sampled instance computes at the end too, and then for the sample beyond it.
            instance.begin(0.0, None if plan.sampled(name) else self._points[-1])
        connected = ConnectedInputs(plan, instances, self.now)
        for read in self._read.values():
            read()
        # One round for each instance that a chain of direct feedthrough may have.
        for _ in range(len(instances) + 1):
            for name, inputs in connected.inputs.items():
                if inputs.apply(inputs.first()):
                    self._read[name]()
        for name, instance in instances.items():
            instance.run()
            self._read[name]()
        for inputs in connected.inputs.values():
            inputs.begin()
        return connected

    # --- at a communication point -----------------------------------------------------------------

    def _sample(self, row: int, time: float) -> None:
        """Let the sampled instances that are due read and compute."""
        due = self._due[row]
        if not self._plan.order:
            for name in due:
                self._take_in(name, row, time)
        for name in due:
            if self._plan.order:
                self._take_in(name, row, time)
            period = self._plan.descriptions[name].sample_time or 0.0
            self._instances[name].step(round(time / period) * period, period)
            self._read[name]()
        self._connected.note_samples(due)

    def _take_in(self, name: str, row: int, time: float) -> None:
        values = self._inputs[name].present(row, time)
        self._inputs[name].apply(values)
        self._show(name, values)

    def _show(self, name: str, values: list[float]) -> None:
        for column, value in zip(self._inputs[name].columns, values, strict=True):
            self.now[column] = value

    def _settle(self, values: Values) -> None:
        """Set the inputs of continuous instances until direct feedthrough between them changes no more."""
        columns = [curve.column for curve in self.curves]
        for _ in range(_ROUNDS):
            before = self.now[columns] if columns else self.now
            changed = [n for n in self._driven if self._inputs[n].apply(values(self._inputs[n]))]
            for name in changed:
                self._read[name]()
            if not columns or not changed:
                return
            sizes = np.maximum([curve.size for curve in self.curves], np.abs(before))
            if np.all(np.abs(self.now[columns] - before) <= _SETTLED * sizes + _TINY):
                return
        raise ConvergenceError(
            f"wires between {', '.join(self._coupled)} at {self._points[self._row]:g} s",
            "form a loop of direct feedthrough that does not settle",
            next_step="give one of the wires a delay",
        )

    # --- from one communication point to the next -------------------------------------------------

    def advance(self) -> None:
        """Take the present step with the slopes that the curves have."""
        self._advance(self._continuous)

    def again(self) -> None:
        """Take the present step of coupled instances once more, from its beginning."""
        for name in self._coupled:
            self._instances[name].restore_state(self._states[name])
            self._inputs[name].forget()
        self._advance(self._coupled)

    def rolling_back(self, work: Callable[[], None]) -> None:
        """Do work within which a step may be taken again."""
        for name in self._coupled:
            self._states[name] = self._instances[name].keep_state()
        work()
        for name in self._coupled:
            self._instances[name].forget_state(self._states.pop(name))

    def _advance(self, names: Sequence[str]) -> None:
        row = self._row
        time = self._points[row]
        length = self._points[row + 1] - time
        for name in names:
            inputs = self._inputs[name]
            if inputs.moves:
                inputs.apply(inputs.over(row, time, length))
        for name in names:
            self._instances[name].step(time, length)
        for name in names:
            self._read[name]()
        if self.curves:
            self._settle(partial(InstanceInputs.before, row=row + 1, time=time + length))
