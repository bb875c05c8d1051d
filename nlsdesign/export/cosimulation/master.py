"""The master algorithm: when each instance steps, and the age of the values that it reads.

At a communication point t: continuous instances stand at t and show their outputs there. Values that are late
arrive at the inputs. Then the sampled instances that are due read their inputs and compute what holds from t
on; what is not late reaches the others at once. This is the row of the result. Then the continuous instances
are stepped to the next point. A sampled instance is stepped once per sample, by its own sample time, so
nothing depends on the communication step but the error of coupling.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import ConvergenceError
from .communication_points import communication_points, rows_of, sample_times
from .coupling import Coupling
from .feeds import Curve, CurveFeed, Feed, GivenFeed, HeldFeed, LateFeed
from .fmu_description import FmuDescription
from .fmu_instance import FmuInstance
from .isolation import Watch
from .wires import split_name

Array = NDArray[np.float64]
_ROUNDS = 50
"""Most rounds in which direct feedthrough between continuous instances settles."""
_SETTLED = 1e-12
"""Relative change of what has settled."""
_TINY = 1e-18
"""What counts as zero whatever the unit."""


@dataclass(frozen=True)
class Link:
    """A wire with its numbers.

    Parameters
    ----------
    target, source
        ``instance.variable``.
    gain
        Factor between the numbers of both ends.
    delay
        In s.
    fresh
        Whether a sampled source has computed already when its target reads at the same time.
    """

    target: str
    source: str
    gain: float
    delay: float
    fresh: bool


@dataclass(frozen=True, eq=False)
class Given:
    """A signal from outside at the communication points.

    Parameters
    ----------
    values, left, middle
        At each point, just before it, and in the middle of the step from it.
    """

    values: Array
    left: Array
    middle: Array


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a run needs to know.

    Parameters
    ----------
    descriptions
        By instance.
    links
        All wires.
    signals
        Signals from outside by input.
    parameters
        By ``instance.variable``.
    order
        Of sampled instances that are due at the same time; empty if all read before any computes.
    points
        Communication points in s.
    coupling
        Of continuous instances.
    """

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
        """Tell whether an instance, or the instance of a variable, is sampled.

        Parameters
        ----------
        name
            Of an instance, or ``instance.variable``.
        """
        return self.descriptions[split_name(name)[0]].sample_time is not None

    @property
    def coupled(self) -> bool:
        """Whether there is an error of coupling: inputs of continuous instances that move between samples."""
        return any(not self.sampled(name) for name in self.signals) or any(
            self.curved(link) and not self.sampled(link.target) for link in self.links
        )

    def curved(self, link: Link) -> bool:
        """Tell whether the source of a wire is continuous.

        Parameters
        ----------
        link
            Wire.
        """
        return not self.sampled(link.source)


def points_of(
    descriptions: Mapping[str, FmuDescription],
    links: Sequence[Link],
    stop: float,
    step: float,
    parts: int = 1,
) -> Array:
    """Return the communication points of a system in s.

    Parameters
    ----------
    descriptions
        By instance.
    links
        All wires.
    stop, step
        End and longest step in s.
    parts
        Parts into which each step is divided once more.
    """
    periods = {name: each.sample_time for name, each in descriptions.items() if each.sample_time is not None}
    changes = {
        (periods[split_name(link.source)[0]], link.delay)
        for link in links
        if link.delay and split_name(link.source)[0] in periods and split_name(link.target)[0] not in periods
    }
    return communication_points(stop, step, periods=periods.values(), changes=changes, parts=parts)


class _Inputs:
    """The inputs of one instance, what they read, and the call that sets them."""

    def __init__(self, instance: FmuInstance, feeds: Mapping[str, Feed], columns: Mapping[str, int]) -> None:
        self.feeds = list(feeds.values())
        self.columns = [columns[f"{instance.name}.{name}"] for name in feeds]
        self.moves = any(feed.moves for feed in self.feeds)
        self._values = np.full(len(feeds), np.nan)
        self._set = instance.setter(list(feeds), self._values) if feeds else None

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


class Master:
    """Instances that run together; fills one row per communication point.

    Parameters
    ----------
    plan
        What is run.
    instances
        By name, freshly made.
    watch
        Told how far the run is.
    """

    def __init__(self, plan: Plan, instances: Mapping[str, FmuInstance], watch: Watch) -> None:
        self._plan, self._instances, self._watch = plan, instances, watch
        columns = plan.columns
        self._columns = {name: i for i, name in enumerate(columns)}
        self.now: Array = np.zeros(len(columns))
        self._samples: dict[str, list[float]] = {}
        self._all_curves: dict[str, Curve] = {}
        self._read: dict[str, Callable[[], None]] = {}
        for name, instance in instances.items():
            shown = instance.description.shown
            first = self._columns[f"{name}.{shown[0].name}"] if shown else 0
            self._read[name] = instance.reader(shown, self.now[first : first + len(shown)])
        self._continuous = [name for name in instances if not plan.sampled(name)]
        order = plan.order or tuple(instances)
        self._due = self._due_by_row([name for name in order if plan.sampled(name)])
        links = [link for link in plan.links if plan.curved(link) and not plan.sampled(link.target)]
        self.curves: Sequence[Curve] = [
            self._curve(name) for name in dict.fromkeys(link.source for link in links)
        ]
        ends = {split_name(end)[0] for link in links for end in (link.target, link.source)}
        self._coupled = [name for name in self._continuous if name in ends]
        self._inputs: dict[str, _Inputs] = {}
        self._row = 0
        self._states: dict[str, object] = {}

    def run(self, rows: Array) -> None:
        """Run from the first communication point to the last.

        Parameters
        ----------
        rows
            Shape (points, columns); filled.
        """
        self._initialise()
        points, coupling = self._plan.points, self._plan.coupling
        times, lengths = points.tolist(), np.diff(points).tolist()
        for row, time in enumerate(times):
            self._row = row
            for curve in self._all_curves.values():
                curve.arrive(time, float(self.now[curve.column]))
            self._settle(self._present)
            if self._due.get(row):
                self._sample(row, time)
                self._settle(self._present)
            for curve in self._all_curves.values():
                curve.depart(float(self.now[curve.column]))
            for name in self._continuous:
                self._show(name, self._present(name))
            rows[row] = self.now
            self._watch.at_row(row)
            if row < len(lengths):
                coupling.step(self, time, lengths[row])

    # --- before the first step --------------------------------------------------------------------

    def _initialise(self) -> None:
        plan, stop = self._plan, float(self._plan.points[-1])
        for target, value in plan.parameters.items():
            name, variable = split_name(target)
            self._instances[name].set({variable: value})
        for name, instance in self._instances.items():
            # A sampled instance computes at the end too, and then for the sample beyond it.
            instance.begin(0.0, None if plan.sampled(name) else stop)
        feeds = {name: self._feeds(name) for name in self._instances}
        self._inputs = {
            name: _Inputs(instance, feeds[name], self._columns) for name, instance in self._instances.items()
        }
        for read in self._read.values():
            read()
        # One round for each instance that a chain of direct feedthrough may have.
        for _ in range(len(self._instances) + 1):
            for name, inputs in self._inputs.items():
                if inputs.apply([self._first(feed) for feed in inputs.feeds]):
                    self._read[name]()
        for name, instance in self._instances.items():
            instance.run()
            self._read[name]()
        for inputs in self._inputs.values():
            for feed in inputs.feeds:
                if isinstance(feed, LateFeed):
                    feed.begin()

    def _first(self, feed: Feed) -> float:
        if isinstance(feed, CurveFeed):
            return feed.first if feed.delay else feed.gain * float(self.now[feed.curve.column])
        return feed.at(0, 0.0)

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
        first = self._start(name, variable)
        held = HeldFeed(self.now, self._columns[link.source], link.gain)
        if self._plan.curved(link):
            if not link.delay and self._plan.sampled(name):
                return held
            return CurveFeed(self.now, self._curve(link.source), link.gain, link.delay, first)
        samples = self._samples.setdefault(link.source, [])
        period = self._plan.descriptions[split_name(link.source)[0]].sample_time or 0.0
        if link.delay:
            return LateFeed(held, samples, period, link.delay, first)
        if link.fresh:
            return held
        if not self._plan.sampled(name):
            # Without an order as with every master that passes initial values on.
            return LateFeed(held, samples, period, period, first if self._plan.order else None)
        return replace(held, samples=samples, first=first) if self._plan.order else held

    def _start(self, name: str, variable: str) -> float:
        value = np.zeros(1)
        instance = self._instances[name]
        instance.reader([instance.description.variables[variable]], value)()
        return float(value[0])

    def _curve(self, source: str) -> Curve:
        instance, variable = split_name(source)
        smooth = self._plan.descriptions[instance].variables[variable].variability == "continuous"
        return self._all_curves.setdefault(source, Curve(self._columns[source], smooth))

    def _due_by_row(self, names: Sequence[str]) -> dict[int, list[str]]:
        due: dict[int, list[str]] = {}
        points = self._plan.points
        for name in names:
            times = sample_times(self._plan.descriptions[name].sample_time or 0.0, float(points[-1]))
            for row in rows_of(points, times).tolist():
                due.setdefault(row, []).append(name)
        return due

    # --- at a communication point -----------------------------------------------------------------

    def _present(self, name: str) -> list[float]:
        time = float(self._plan.points[self._row])
        return [feed.at(self._row, time) for feed in self._inputs[name].feeds]

    def _end(self, name: str) -> list[float]:
        row = self._row + 1
        time = float(self._plan.points[row])
        return [feed.before(row, time) for feed in self._inputs[name].feeds]

    def _sample(self, row: int, time: float) -> None:
        """Let the sampled instances that are due read and compute."""
        due = self._due[row]
        if not self._plan.order:
            for name in due:
                self._take_in(name)
        for name in due:
            if self._plan.order:
                self._take_in(name)
            period = self._plan.descriptions[name].sample_time or 0.0
            self._instances[name].step(round(time / period) * period, period)
            self._read[name]()
        for source, samples in self._samples.items():
            if split_name(source)[0] in due:
                samples.append(float(self.now[self._columns[source]]))

    def _take_in(self, name: str) -> None:
        values = self._present(name)
        self._inputs[name].apply(values)
        self._show(name, values)

    def _show(self, name: str, values: list[float]) -> None:
        for column, value in zip(self._inputs[name].columns, values, strict=True):
            self.now[column] = value

    def _settle(self, values: Callable[[str], list[float]]) -> None:
        """Set the inputs of continuous instances until direct feedthrough between them changes no more."""
        columns = [curve.column for curve in self.curves]
        for _ in range(_ROUNDS):
            before = self.now[columns]
            changed = [name for name in self._continuous if self._inputs[name].apply(values(name))]
            for name in changed:
                self._read[name]()
            if not columns or not changed:
                return
            sizes = np.maximum([curve.size for curve in self.curves], np.abs(before))
            if np.all(np.abs(self.now[columns] - before) <= _SETTLED * sizes + _TINY):
                return
        time = self._plan.points[self._row]
        raise ConvergenceError(
            f"wires between {', '.join(self._coupled)} at {time:g} s",
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
        """Do work within which a step may be taken again.

        Parameters
        ----------
        work
            Calls :meth:`advance` once, then :meth:`again`.
        """
        for name in self._coupled:
            self._states[name] = self._instances[name].keep_state()
        work()
        for name in self._coupled:
            self._instances[name].forget_state(self._states.pop(name))

    def _advance(self, names: Sequence[str]) -> None:
        points, row = self._plan.points, self._row
        time = float(points[row])
        length = float(points[row + 1]) - time
        for name in names:
            inputs = self._inputs[name]
            if inputs.moves:
                inputs.apply([feed.over(row, time, length) for feed in inputs.feeds])
        for name in names:
            self._instances[name].step(time, length)
        for name in names:
            self._read[name]()
        if self.curves:
            self._settle(self._end)
