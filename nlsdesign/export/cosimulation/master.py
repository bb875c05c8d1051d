"""The master algorithm: order of steps, and the age of the values that each instance reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...simulation.trace import Trace
from .fmu_instance import FmuInstance

Signal: TypeAlias = Callable[[float], float] | tuple[ArrayLike, ArrayLike]
"""A function of time in s, or times and values between which it is linear and beyond which it is held."""


def split_name(name: str) -> tuple[str, str]:
    """Return instance and variable of ``instance.variable``.

    Parameters
    ----------
    name
        The first word is the instance.
    """
    instance, _, variable = name.partition(".")
    return instance, variable


class Late(str):
    """Source of a wire that is read as it was before the step, one communication step old."""


class System:
    """Instances, wires between them and external signals.

    Parameters
    ----------
    instances
        By name.
    wires
        Source by target.
    inputs
        Signal by input.
    order
        Order of stepping; empty if all inputs are read before any instance steps.
    """

    def __init__(
        self,
        instances: Mapping[str, FmuInstance],
        wires: Mapping[str, str],
        inputs: Mapping[str, Signal],
        order: tuple[str, ...],
    ) -> None:
        self._instances = instances
        self._order = order
        self._late = frozenset(target for target, source in wires.items() if isinstance(source, Late))
        self._wires = {name: _of(name, wires) for name in instances}
        self._inputs = {
            name: {variable: _function(signal) for variable, signal in _of(name, inputs).items()}
            for name in instances
        }
        self._shown = {
            name: [v.name for v in instance.variables.values() if v.causality in ("output", "local")]
            for name, instance in instances.items()
        }
        self._latest: dict[str, float] = {}
        self._before: dict[str, float] = {}

    def delays(self) -> dict[str, int]:
        """Return the delay of each wire target in steps, see :class:`.cosimulate.CoSimulation`."""
        late: dict[str, int] = {}
        for name, wires in self._wires.items():
            for variable, source in wires.items():
                of, output = split_name(source)
                sampled = self._instances[of].variables[output].variability == "discrete"
                # A sampled source computes its output at the beginning of a step.
                before = bool(self._order) and self._order.index(of) < self._order.index(name)
                before = before and f"{name}.{variable}" not in self._late
                late[f"{name}.{variable}"] = (1 if sampled else 0) - (1 if before else 0)
        return late

    def run(self, stop: float, step: float) -> Trace:
        """Run from 0 to the end.

        Parameters
        ----------
        stop, step
            End and communication step in s.

        Returns
        -------
        Trace
            Everything shown, at every communication point.
        """
        count = (
            max(1, round(stop / step))
            if abs(stop / step - round(stop / step)) < 1e-6
            else int(stop / step) + 1
        )
        times = np.minimum(np.arange(count + 1) * step, stop)
        self._initialise(stop)
        rows = [self._row(0.0)]
        for begin, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
            self._before = dict(self._latest)
            if not self._order:
                for name in self._instances:
                    self._apply(name, begin)
            for name in self._order or self._instances:
                if self._order:
                    self._apply(name, begin)
                self._instances[name].step(begin, end - begin)
                if self._order:
                    self._read(name)
            for name in () if self._order else self._instances:
                self._read(name)
            rows.append(self._row(end))
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        return Trace(times, columns, {name: self._unit(name) for name in columns}, "co-simulation")

    def _initialise(self, stop: float) -> None:
        for instance in self._instances.values():
            instance.begin(0.0, stop)
        # One round for each instance that a chain of direct feedthrough may have.
        for _ in range(len(self._instances) + 1):
            for name in self._instances:
                self._read(name)
            for name in self._instances:
                self._apply(name, 0.0)
        for name, instance in self._instances.items():
            instance.run()
            self._read(name)

    def _read(self, name: str) -> None:
        values = self._instances[name].get(self._shown[name])
        self._latest |= {f"{name}.{variable}": value for variable, value in values.items()}

    def _apply(self, name: str, time: float) -> None:
        seen = {
            variable: self._before if f"{name}.{variable}" in self._late and self._before else self._latest
            for variable in self._wires[name]
        }
        values = {variable: seen[variable][source] for variable, source in self._wires[name].items()}
        values |= {variable: float(signal(time)) for variable, signal in self._inputs[name].items()}
        self._instances[name].set(values)

    def _row(self, time: float) -> dict[str, float]:
        given = {
            f"{name}.{variable}": float(signal(time))
            for name, signals in self._inputs.items()
            for variable, signal in signals.items()
        }
        return self._latest | given

    def _unit(self, name: str) -> str:
        instance, variable = split_name(name)
        return self._instances[instance].unit(variable) or "1"


End = TypeVar("End")


def _of(instance: str, ends: Mapping[str, End]) -> dict[str, End]:
    """Return the entries of one instance by variable."""
    return {split_name(name)[1]: end for name, end in ends.items() if split_name(name)[0] == instance}


def _function(signal: Signal) -> Callable[[float], float]:
    if callable(signal):
        return signal
    times, values = (np.asarray(each, dtype=float) for each in signal)
    return lambda time: float(np.interp(time, times, values))
