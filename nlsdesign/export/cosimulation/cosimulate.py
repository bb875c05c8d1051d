"""Several FMUs as one system: wired by name, stepped together, recorded.

Row k of a result shows what holds at its time: continuous values at that time, and what sampled instances
have computed from values read at that time, as in a simulated
:class:`~nlsdesign.feedback.control.ClosedLoop`.

Order. Without ``order`` all sampled instances that are due read before any computes (Jacobi), as most masters
do: what a sampled instance computes reaches the others one sample later. With ``order`` each reads what
earlier ones have just computed (Gauss-Seidel): observer and controller before the plant give a loop without
computing delay. A wire from an instance that stands later carries its previous sample. Any other delay is
that of the :class:`~nlsdesign.export.cosimulation.run_plan.Wire`. No delay depends on the communication step;
the result lists them in seconds.

How a co-simulation converges when the step is halved again and again.
"""

from __future__ import annotations

import itertools
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ExportError, ValueRangeError, unknown_name
from ...simulation.input_signals import Sine
from ...simulation.trace import Trace
from .coupling import GivenFeed, Stepping
from .fmu_description import DESCRIPTION_FILE, FmuDescription, check_library, read_description, unpack
from .fmu_instance import FmuInstance
from .isolation import IsolatedWork, Watch
from .master import Master
from .run_plan import (
    Link,
    Plan,
    Wire,
    as_wire,
    check_wires,
    delay_of,
    ends,
    gain_to,
    points_of,
    split_name,
)

_STEPS_OF_A_PERIOD = 4
Signal: TypeAlias = Callable[[float], float] | tuple[ArrayLike, ArrayLike]
"""A function of time in s, or times and values between which it is linear and beyond which it is held."""
DEFAULT_STEP = 1e-3
"""Communication step in s where no instance is sampled."""
_MOST_ERROR = 0.5
"""Share of the extent of a coupled signal above which its estimated error makes a run no result."""
_AT_REST = 1e-9
"""Extent below which a signal rests, whatever its unit; there the error is rounding."""
_JUST_BEFORE = 1e-6
"""Part of a step: signals from outside that jump at a communication point are also read so long before it."""


@dataclass(frozen=True, eq=False)
class CoSimulation:
    """Result of a co-simulation.

    Parameters
    ----------
    trace
        Outputs and inner signals of all instances as ``instance.variable``, and the driven inputs, at every
        communication point. Row k shows what holds at its time: a sampled instance shows what it computed
        from values read at that time, or holds since its last sample.
    step
        Longest communication step in s.
    order
        Order of sampled instances; empty when all read before any computed.
    delays
        By wire target: age in s of what it reads, beyond the holding of samples.
    errors
        By signal: estimate of the largest error of coupling, in the unit of the signal, from a second run
        with half the step and the order of the coupling. Empty where there is no such error, or it was not
        asked for.
    ends
        Names of the outputs of all instances and of their inputs: what the FMUs show to each other.
    """

    trace: Trace
    step: float
    order: tuple[str, ...]
    delays: Mapping[str, float]
    errors: Mapping[str, float] = field(default_factory=dict)
    ends: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Array:
        """Return one recorded signal."""
        return self.trace[name]

    @property
    def time(self) -> Array:
        """Communication points in s."""
        return self.trace.time


@dataclass(frozen=True, kw_only=True)
class FmuSystem:
    """FMUs wired by name.

    Parameters
    ----------
    fmus
        FMU by name of the instance.
    wires
        Source by target.
    parameters
        Parameters and start values by ``instance.variable``.
    order
        See the head of this module.
    """

    fmus: Mapping[str, str | Path]
    wires: Mapping[str, str | Wire] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    order: tuple[str, ...] = ()

    def recorded(self) -> list[str]:
        """Return the names of what a run would record, without running anything."""
        with tempfile.TemporaryDirectory(prefix="nlsdesign-cosimulation-") as folder:
            descriptions = unpacked_fmus(self.fmus, Path(folder))
            check_wires(descriptions, {target: as_wire(source) for target, source in self.wires.items()})
        shown = [f"{name}.{v.name}" for name, each in descriptions.items() for v in each.shown]
        return list(dict.fromkeys([*shown, *self.wires]))

    def run(
        self,
        *,
        inputs: Mapping[str, Signal],
        stop: float,
        stepping: Stepping | None = None,
        parts: int = 1,
    ) -> CoSimulation:
        """Simulate; see :func:`cosimulate`."""
        if not (math.isfinite(stop) and stop > 0.0):
            raise ValueRangeError(f"stop={stop}", "must be a positive number of seconds")
        check_order(self.order, self.fmus)
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="nlsdesign-cosimulation-")))
            descriptions = unpacked_fmus(self.fmus, folder)
            for description in descriptions.values():
                check_library(description)
            run = _Run(self, descriptions, inputs, stop, stepping or Stepping(), folder)
            return run.result(parts)


def cosimulate(
    *,
    fmus: Mapping[str, str | Path],
    wires: Mapping[str, str | Wire],
    inputs: Mapping[str, Signal],
    stop: float,
    step: float | Stepping | None = None,
    order: Sequence[str] = (),
    parameters: Mapping[str, float] | None = None,
) -> CoSimulation:
    """Simulate FMUs together.

    The FMUs run in a process of their own: one that crashes or hangs ends with an error that names it.

    Parameters
    ----------
    fmus
        FMU by name of the instance.
    wires
        Source by target, for instance ``{"observer.motor.angle": "plant.motor.angle"}``; a
        :class:`~nlsdesign.export.cosimulation.run_plan.Wire` adds a gain or a delay, a :class:`Late` one is
        late by one sample.
    inputs
        Signals from outside by input. A sampled instance reads them at its samples, a continuous one gets
        their value in the middle of each step.
    stop
        End in s; the start is 0.
    step
        Longest communication step in s, by default the shortest sample time of the instances; or a
        :class:`~nlsdesign.export.cosimulation.coupling.Stepping` with more choices.
    order
        Instances in the order in which they compute, see the head of this module.
    parameters
        Parameters and start values by ``instance.variable``.

    Raises
    ------
    UnknownNameError
        If a wire, input or parameter names what does not exist, with the nearest that does.
    ExportError
        If an FMU is damaged, cannot be used, crashes or hangs, or an input is driven twice.
    UnitError
        If a wire joins different units.
    ValueRangeError
        If step or stop is not possible.
    ConvergenceError
        If an instance cannot take a step, with its own words, or a coupling does not settle or converge.
    """
    system = FmuSystem(fmus=fmus, wires=wires, parameters=parameters or {}, order=tuple(order))
    return system.run(
        inputs=inputs, stop=stop, stepping=step if isinstance(step, Stepping) else Stepping(step)
    )


class _Run:
    """One run of a system whose archives are unpacked."""

    def __init__(
        self,
        system: FmuSystem,
        descriptions: Mapping[str, FmuDescription],
        inputs: Mapping[str, Signal],
        stop: float,
        stepping: Stepping,
        folder: Path,
    ) -> None:
        self._descriptions, self._inputs, self._folder = descriptions, inputs, folder
        self._system, self._stepping, self._stop = system, stepping, stop
        wires = {target: as_wire(source) for target, source in system.wires.items()}
        check_wires(descriptions, wires)
        check_signals(descriptions, wires, inputs, system.parameters)
        self._links = tuple(self._link(target, wire) for target, wire in wires.items())
        times = [each.sample_time for each in descriptions.values() if each.sample_time is not None]
        self._step = min(times, default=DEFAULT_STEP) if stepping.step is None else stepping.step
        # Refuse sines of which an instance would see another signal: it gets one value a step.
        for name, signal in inputs.items():
            if (
                isinstance(signal, Sine)
                and _STEPS_OF_A_PERIOD * self._step * abs(signal.frequency) > 1.0 + 1e-9
            ):
                raise ValueRangeError(
                    f"input '{name}': {signal.frequency:g} Hz",
                    f"has {1.0 / (self._step * abs(signal.frequency)):.2g} steps to a period, at least "
                    f"{_STEPS_OF_A_PERIOD} are needed",
                    next_step=f"take a step of {50.0 / abs(signal.frequency):.2g} ms, or a slower sine",
                )

    def result(self, parts: int) -> CoSimulation:
        """Run, and once more with half the step where that tells an error."""
        plan = self._plan(parts)
        if plan.coupled and self._stepping.coupling.rolls_back:
            self._check_roll_back(plan)
        rows = self._rows(plan)
        # Refuse a run in which an output is no number.
        for column, name in enumerate(plan.columns):
            instance, variable = split_name(name)
            lost = np.flatnonzero(~np.isfinite(rows[:, column]))
            if len(lost) and self._descriptions[instance].variables[variable].causality == "output":
                raise ConvergenceError(
                    f"instance '{instance}' at {plan.points[lost[0]]:g} s",
                    f"its output {variable} is no number",
                )
        columns = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(plan.columns)}
        variables = ((name, *split_name(name)) for name in columns)
        units = {name: self._descriptions[i].variables[v].unit or "1" for name, i, v in variables}
        trace = Trace(plan.points, columns, units, "co-simulation")
        errors: dict[str, float] = {}
        if plan.coupled and self._stepping.estimate:
            finer = self._rows(self._plan(2 * parts))[::2]
            order = self._stepping.coupling.order
            largest = np.max(np.abs(rows - finer), axis=0) * 2**order / (2**order - 1)
            errors = dict(zip(plan.columns, largest.tolist(), strict=True))
            # Refuse a run whose wires between continuous instances are mostly error.
            for link in plan.coupling_links:
                extent = float(np.ptp(rows[:, plan.columns.index(link.source)]))
                if errors[link.source] > _MOST_ERROR * extent and extent > _AT_REST:
                    raise ConvergenceError(
                        f"wire from '{link.source}'",
                        f"half the step changes it by about {errors[link.source]:.2g} of its {extent:.2g}: "
                        f"the coupling does not converge in steps of {plan.points[1]:.3g} s",
                        next_step="take a shorter step, or coupling=Iterated()",
                    )
        shown = (*ends(self._descriptions, "input"), *ends(self._descriptions, "output"))
        # The delay of each wire in s; a sampled source that computes later is one sample late.
        periods = {name: each.sample_time or 0.0 for name, each in self._descriptions.items()}
        delays = {
            link.target: link.delay or (0.0 if link.fresh else periods[split_name(link.source)[0]])
            for link in self._links
        }
        return CoSimulation(trace, self._step, self._system.order, delays, errors, shown)

    def _plan(self, parts: int) -> Plan:
        points = points_of(self._descriptions, self._links, self._stop, self._step, parts)
        signals = {name: _sampled_signal(signal, points) for name, signal in self._inputs.items()}
        return Plan(
            self._descriptions, self._links, signals, self._system.parameters, self._system.order, points,
            self._stepping.coupling,
        )  # fmt: skip

    def _rows(self, plan: Plan) -> Array:
        watch = Watch(tuple(plan.descriptions))

        def work(rows: Array) -> None:
            with ExitStack() as stack:
                instances: dict[str, FmuInstance] = {}
                for name, description in plan.descriptions.items():
                    instances[name] = FmuInstance(description, watch)
                    stack.callback(instances[name].close)
                Master(plan, instances, watch).run(rows)

        isolated = IsolatedWork(
            work, watch, plan.points, len(plan.columns), self._folder, self._stepping.patience,
            self._stepping.progress,
        )  # fmt: skip
        return isolated.result()

    def _link(self, target: str, wire: Wire) -> Link:
        order = self._system.order
        to, of = split_name(target)[0], split_name(wire.source)[0]
        fresh = bool(order) and order.index(of) < order.index(to)
        gain = gain_to(self._descriptions, target, wire)
        return Link(target, wire.source, gain, delay_of(self._descriptions, wire), fresh)

    def _check_roll_back(self, plan: Plan) -> None:
        ends_of = [end for link in plan.coupling_links for end in (link.target, link.source)]
        for name in dict.fromkeys(split_name(end)[0] for end in ends_of):
            if not plan.descriptions[name].rolls_back:
                raise ExportError(
                    f"instance '{name}'",
                    "cannot keep and restore its state, which this coupling needs",
                    next_step="take coupling=Extrapolated()",
                )


def unpacked_fmus(fmus: Mapping[str, str | Path], folder: Path) -> dict[str, FmuDescription]:
    """Unpack all archives and read their descriptions.

    ``folder``: gets a folder for each; its owner removes it.
    """
    descriptions: dict[str, FmuDescription] = {}
    for number, (name, path) in enumerate(fmus.items()):
        if not name.isidentifier():
            raise ExportError(f"instance '{name}'", "must be one word without a dot")
        place = folder / str(number)
        unpack(f"instance '{name}' ({path})", Path(path), place, needs=DESCRIPTION_FILE)
        descriptions[name] = read_description(name, Path(path), place)
    return descriptions


def check_order(order: Sequence[str], fmus: Mapping[str, str | Path]) -> None:
    """Check that an order is empty or names each instance once."""
    for name in order:
        if name not in fmus:
            raise unknown_name("instance in order", name, fmus)
    if order and sorted(order) != sorted(fmus):
        raise ValueRangeError(f"order={tuple(order)}", f"must name each of {', '.join(fmus)} once")


def check_signals(
    descriptions: Mapping[str, FmuDescription],
    wires: Mapping[str, Wire],
    inputs: Mapping[str, Signal],
    parameters: Mapping[str, float],
) -> None:
    """Check that what is given from outside exists and is driven once."""
    valid = {
        "signal for input": (inputs, ends(descriptions, "input")),
        "parameter": (parameters, ends(descriptions)),
    }
    for kind, (given, names) in valid.items():
        for name in given:
            if name not in names:
                raise unknown_name(kind, name, names)
    for name in inputs:
        if name in wires:
            raise ExportError(
                f"input '{name}'", "is driven by a wire and by a signal", next_step="remove one of them"
            )


def _sampled_signal(signal: Signal, points: Array) -> GivenFeed:
    """Return a signal at the points, just before them, and in the middle of the steps."""
    lengths = np.diff(points)
    left = points - np.concatenate([lengths[:1], lengths]) * _JUST_BEFORE
    left[0] = points[0]
    middle = np.append(points[:-1] + 0.5 * lengths, points[-1])
    courses = (points, left, middle)
    if callable(signal):
        return GivenFeed(*(np.array([float(signal(time)) for time in times.tolist()]) for times in courses))
    given, values = (np.asarray(each, dtype=float) for each in signal)
    return GivenFeed(*(np.asarray(np.interp(times, given, values), dtype=float) for times in courses))


_EXACT = 1e-9
"""Differences below this part of the range of a signal are those of the integrators, not of the coupling."""


@dataclass(frozen=True)
class Convergence:
    """What halving the step changes.

    Parameters
    ----------
    steps
        Longest step of each run in s, each half of the one before.
    differences
        By signal: largest difference of each run from the next, in the unit of the signal.
    ranges
        By signal: largest less smallest value in the last run.
    """

    steps: tuple[float, ...]
    differences: Mapping[str, tuple[float, ...]]
    ranges: Mapping[str, float]

    def orders(self, name: str) -> tuple[float, ...]:
        """Return the observed order at each halving after the first, not a number where nothing changes.

        Parameters
        ----------
        name
            Of a signal.
        """
        changes = self.differences[name]
        floor = _EXACT * self.ranges[name]
        return tuple(
            math.log2(one / other) if one > floor and other > floor else math.nan
            for one, other in itertools.pairwise(changes)
        )


def convergence(
    system: FmuSystem,
    *,
    inputs: Mapping[str, Signal],
    stop: float,
    stepping: Stepping | None = None,
    halvings: int = 3,
) -> Convergence:
    """Run a system with a step that is halved again and again.

    Parameters
    ----------
    system
        FMUs and wires.
    inputs
        Signals from outside by input.
    stop
        End in s.
    stepping
        The first step, coupling, and limits.
    halvings
        Number of halvings, at least 2 for an order.

    Raises
    ------
    ValueRangeError
        If there are fewer than two halvings or more than ten.
    """
    if not 2 <= halvings <= 10:
        raise ValueRangeError(f"{halvings} halvings", "from 2 to 10 tell an order")
    plain = replace(stepping or Stepping(), estimate=False)
    runs = [system.run(inputs=inputs, stop=stop, stepping=plain, parts=2**k) for k in range(halvings + 1)]
    differences = {
        name: tuple(
            float(np.max(np.abs(one[name] - other[name][::2]))) for one, other in itertools.pairwise(runs)
        )
        for name in runs[0].trace.signals
    }
    steps = tuple(runs[0].step / 2**k for k in range(halvings + 1))
    return Convergence(steps, differences, {name: float(np.ptp(runs[-1][name])) for name in differences})
