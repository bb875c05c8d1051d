"""Several FMUs as one system: wired by name, stepped together, recorded.

Order. Without ``order`` all inputs are read before any instance steps (Jacobi): the result does not depend on
how the instances are listed, and the output that a *sampled* instance computes at a communication point
reaches the others one step later. With ``order`` each instance reads what earlier ones have computed in the
same step (Gauss-Seidel): sensors, observer and controller before the plant give a loop without computing
delay; a wire from a :class:`Late` source keeps it, for instance when the plant gets the current of the
previous sample. The result lists the delay of every wire in steps.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import ExportError, UnitError, ValueRangeError, unknown_name
from ...quantity import parse_unit
from ...simulation.trace import Trace
from .fmu_instance import FmuInstance
from .master import Signal, System, split_name

DEFAULT_STEP = 1e-3
"""Communication step in s where no instance is sampled."""


@dataclass(frozen=True, eq=False)
class CoSimulation:
    """Result of a co-simulation.

    Parameters
    ----------
    trace
        Outputs and inner signals of all instances as ``instance.variable``, and the inputs from outside, at
        every communication point. What a sampled instance shows belongs to its last sample before it.
    step
        Communication step in s.
    order
        Order of stepping; empty when all inputs were read first.
    delays
        By wire target: steps by which what it reads is late; −1 means that it reads the end of the step it is
        about to take.
    """

    trace: Trace
    step: float
    order: tuple[str, ...]
    delays: Mapping[str, int]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return one recorded signal.

        Parameters
        ----------
        name
            ``instance.variable``.
        """
        return self.trace[name]

    @property
    def time(self) -> NDArray[np.float64]:
        """Communication points in s."""
        return self.trace.time


def cosimulate(
    *,
    fmus: Mapping[str, str | Path],
    wires: Mapping[str, str],
    inputs: Mapping[str, Signal],
    stop: float,
    step: float | None = None,
    order: Sequence[str] = (),
    parameters: Mapping[str, float] | None = None,
) -> CoSimulation:
    """Simulate FMUs together.

    Parameters
    ----------
    fmus
        FMU by name of the instance.
    wires
        Source by target, for instance ``{"observer.motor.angle": "plant.motor.angle"}``; a source wrapped in
        :class:`Late` is read as it was before the step, whatever the order.
    inputs
        Signals from outside by input, held over each communication step.
    stop
        End in s; the start is 0.
    step
        Communication step in s; by default the shortest sample time of the instances.
    order
        Instances in the order in which they step, see the head of this module.
    parameters
        Parameters and start values by ``instance.variable``.

    Raises
    ------
    UnknownNameError
        If a wire, input or parameter names what does not exist, with the nearest that does.
    ExportError
        If an FMU cannot be used, or an input is driven twice.
    UnitError
        If a wire joins different units.
    ValueRangeError
        If sample times are no multiples of the step.
    ConvergenceError
        If an instance cannot take a step, with its own words.
    """
    if not (math.isfinite(stop) and stop > 0.0):
        raise ValueRangeError(f"stop={stop}", "must be a positive number of seconds")
    _check_order(order, fmus)
    with _instances(fmus) as instances:
        _check_ends(instances, wires, inputs, parameters or {})
        length = _communication_step(instances, step)
        system = System(instances, wires, inputs, tuple(order))
        for target, value in (parameters or {}).items():
            instance, variable = split_name(target)
            instances[instance].set({variable: value})
        trace = system.run(stop, length)
        return CoSimulation(trace, length, tuple(order), system.delays())


@contextmanager
def _instances(fmus: Mapping[str, str | Path]) -> Iterator[dict[str, FmuInstance]]:
    """Yield loaded instances; afterwards, also after an error, all are freed and their files removed."""
    with tempfile.TemporaryDirectory(prefix="nlsdesign-cosimulation-") as folder, ExitStack() as stack:
        instances: dict[str, FmuInstance] = {}
        for number, (name, path) in enumerate(fmus.items()):
            if not name.isidentifier():
                raise ExportError(f"instance '{name}'", "must be one word without a dot")
            instances[name] = FmuInstance(name, Path(path), Path(folder) / str(number))
            stack.callback(instances[name].close)
        yield instances


def _check_order(order: Sequence[str], fmus: Mapping[str, str | Path]) -> None:
    for name in order:
        if name not in fmus:
            raise unknown_name("instance in order", name, fmus)
    if order and sorted(order) != sorted(fmus):
        raise ValueRangeError(f"order={tuple(order)}", f"must name each of {', '.join(fmus)} once")


def _check_ends(
    instances: Mapping[str, FmuInstance],
    wires: Mapping[str, str],
    inputs: Mapping[str, Signal],
    parameters: Mapping[str, float],
) -> None:
    names: dict[str, list[str]] = {"input": [], "output": [], "any": []}
    for instance in instances.values():
        for variable in instance.variables.values():
            names["any"].append(f"{instance.name}.{variable.name}")
            names.setdefault(variable.causality, []).append(names["any"][-1])
    for kind, given, valid in (
        ("wire to input", wires, names["input"]),
        ("wire from output", wires.values(), names["output"]),
        ("signal for input", inputs, names["input"]),
        ("parameter", parameters, names["any"]),
    ):
        for name in given:
            if name not in valid:
                raise unknown_name(kind, name, valid)
    for name in inputs:
        if name in wires:
            raise ExportError(
                f"input '{name}'", "is driven by a wire and by a signal", next_step="remove one of them"
            )
    for target, source in wires.items():
        _check_units(instances, target, source)


def _check_units(instances: Mapping[str, FmuInstance], target: str, source: str) -> None:
    units = [_unit(instances, end) for end in (target, source)]
    if None in units or units[0] == units[1]:
        return
    try:
        one, other = (parse_unit(unit or "1") for unit in units)
    except UnitError:
        return  # a unit of a foreign FMU that cannot be read here
    # Without the radian: torque is given in N·m and in N·m/rad.
    if (one.factor, one.mechanical) != (other.factor, other.mechanical):
        raise UnitError(f"wire '{target}' [{units[0]}]", f"reads '{source}', which is in [{units[1]}]")


def _unit(instances: Mapping[str, FmuInstance], name: str) -> str | None:
    instance, variable = split_name(name)
    return instances[instance].unit(variable)


def _communication_step(instances: Mapping[str, FmuInstance], step: float | None) -> float:
    """Return the communication step, of which every sample time must be a multiple."""
    times = {name: instance.sample_time for name, instance in instances.items() if instance.sample_time}
    length = step if step is not None else min(times.values(), default=DEFAULT_STEP)
    if not (math.isfinite(length) and length > 0.0):
        raise ValueRangeError(f"step={length}", "must be a positive number of seconds")
    for name, period in times.items():
        samples = period / length
        if round(samples) < 1 or abs(samples - round(samples)) > 1e-9 * samples:
            raise ValueRangeError(
                f"step={length:g} s",
                f"the sample time of '{name}', {period:g} s, is no multiple of it",
                next_step=f"take step={period:g} or a whole fraction of it",
            )
    return length
