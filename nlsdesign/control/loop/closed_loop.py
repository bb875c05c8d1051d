"""A closed loop of plant, observer and controller, simulated in one piece.

Time runs in samples. At t_k the plant is read, the observer and the controller are stepped with what was
read, and the plant is integrated to t_{k+1} with the current held. The current that the controller computes
at t_k acts from t_{k+delay} on; with the default of one sample the computer has a whole sample for it. The
observer is given the current that really acts in the coming sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...errors import ArrangementError, ValueRangeError, unknown_name
from ...model import FlatModel
from ...simulation import Trace, range_warnings
from ...simulation.sampled import DiscreteStepper, PlantStepper
from ..laws.torque_loop import LoopNames, loop_names

Array = NDArray[np.float64]
Drive = Callable[[float], float] | float

PLANT, OBSERVER, CONTROLLER = "plant", "observer", "controller"


@dataclass(frozen=True, eq=False, kw_only=True)
class ClosedLoop:
    """Plant, observer and controller wired by name.

    The structure of the plant says what its series spring and its motor are called.

    Parameters
    ----------
    plant
        Continuous.
    observer, controller
        Discrete, with the same sample time.
    wires
        Where an input comes from, ``{"observer.motor.angle": "plant.motor_encoder.reading"}``. Inputs that
        are not named get the variable of the same name: the observer from the plant, the controller's
        torque from the observer and its angle from the plant.
    delay
        Samples between a current's computation and its effect.
    substeps
        Integration steps of the plant per sample.

    Raises
    ------
    ValueRangeError
        If observer and controller are not sampled alike, or delay or substeps is too small.
    ArrangementError
        If a wire leads to none of the three.
    """

    plant: FlatModel
    observer: FlatModel
    controller: FlatModel
    wires: Mapping[str, str] = field(default_factory=dict)
    delay: int = 1
    substeps: int = 10

    def __post_init__(self) -> None:
        if self.observer.sample_time is None or self.observer.sample_time != self.controller.sample_time:
            raise ValueRangeError(
                f"sample times {self.observer.sample_time} and {self.controller.sample_time} s",
                "observer and controller must be discrete and sampled alike",
            )
        if self.delay < 0 or self.substeps < 1:
            raise ValueRangeError(f"delay {self.delay}, substeps {self.substeps}", "must be at least 0 and 1")
        for name in (*self.wires, *self.wires.values()):
            owner = name.partition(".")[0]
            if owner not in (PLANT, OBSERVER, CONTROLLER):
                raise ArrangementError(
                    f"wire '{name}'", f"must begin with {PLANT}., {OBSERVER}. or {CONTROLLER}."
                )

    @cached_property
    def names(self) -> LoopNames:
        """Names by which plant, observer and controller are wired."""
        return loop_names(self.plant)

    @property
    def desired(self) -> str:
        """Full name of the torque that the spring should have: an input of the controller."""
        return f"{CONTROLLER}.{self.names.desired}"

    @property
    def torque(self) -> str:
        """Full name of the torque that the spring has."""
        return f"{PLANT}.{self.names.torque}"

    @property
    def estimate(self) -> str:
        """Full name of the estimate of that torque."""
        return f"{OBSERVER}.{self.names.torque}"

    @property
    def sample_time(self) -> float:
        """Sample time in s."""
        return float(self.controller.sample_time or 0.0)

    def run(
        self, stop: float, *, inputs: Mapping[str, Drive], start: Mapping[str, float] | None = None
    ) -> Trace:
        """Simulate from zero.

        Parameters
        ----------
        stop
            Last time in s.
        inputs
            Open inputs by full name: functions of time or constants. Those of the controller, such as
            ``"controller.spring.torque.desired"``, are held from sample to sample; those of the plant, such
            as ``"plant.load.angle"``, run linearly.
        start
            Start values of states by full name; the others are those of the models.

        Returns
        -------
        Trace
            Every variable of the plant and the inputs and outputs of observer and controller, at the
            samples, with the prefixes ``plant.``, ``observer.`` and ``controller.``.

        Raises
        ------
        UnknownNameError
            If an input or state does not exist.
        ConvergenceError
            If the plant runs away.
        """
        return _Run(self, inputs, dict(start or {})).until(stop)


def _names(model: FlatModel) -> set[str]:
    groups = (model.states, model.inputs, model.parameters, model.outputs, model.signals)
    return {v.name for group in groups for v in group}


class _Run:
    """One simulation: the steppers, the wiring, the record."""

    def __init__(self, loop: ClosedLoop, inputs: Mapping[str, Drive], start: dict[str, float]) -> None:
        self.loop = loop
        self.observer, self.controller = DiscreteStepper(loop.observer), DiscreteStepper(loop.controller)
        self.open = dict(inputs)
        self.current_name = loop.names.current
        self.current = [v.name for v in loop.plant.inputs].index(self.current_name)
        self.sources = {
            f"{owner}.{v.name}": self._source(owner, v.name)
            for owner, model in ((OBSERVER, loop.observer), (CONTROLLER, loop.controller))
            for v in model.inputs
        }
        self._check_open()
        self._check_sources()
        used = set(self.sources.values())
        self.seen = sorted(
            name for name in _names(loop.plant) if name != self.current_name and f"{PLANT}.{name}" in used
        )
        self.plant = PlantStepper(loop.plant, loop.sample_time, loop.substeps, self.seen)
        self._begin(start)

    def _source(self, owner: str, name: str) -> str:
        full = f"{owner}.{name}"
        if full in self.open:
            return full
        if full in self.loop.wires:
            return self.loop.wires[full]
        outputs = {v.name for v in self.loop.observer.outputs}
        return f"{OBSERVER if owner == CONTROLLER and name in outputs else PLANT}.{name}"

    def _check_open(self) -> None:
        known = {f"{PLANT}.{v.name}" for v in self.loop.plant.inputs} - {f"{PLANT}.{self.current_name}"}
        known |= {name for name, source in self.sources.items() if source == name}
        known |= {f"{CONTROLLER}.{v.name}" for v in self.loop.controller.inputs}
        for name in self.open:
            if name not in known:
                raise unknown_name("input of the loop", name, known)

    def _check_sources(self) -> None:
        known = {f"{PLANT}.{name}" for name in _names(self.loop.plant)}
        known |= {f"{OBSERVER}.{v.name}" for v in self.loop.observer.outputs}
        for name, source in self.sources.items():
            if source in known or source == name:
                continue
            if name in self.loop.wires:
                raise unknown_name(f"wire to '{name}' from", source, known)
            raise ArrangementError(
                f"input '{name}'", "is open: it is neither driven nor wired, and nothing has the same name",
                next_step="give it in inputs or in wires",
            )  # fmt: skip

    def _begin(self, start: dict[str, float]) -> None:
        owners = {
            PLANT: (self.loop.plant, self.plant.state),
            OBSERVER: (self.loop.observer, self.observer.state),
        }
        owners[CONTROLLER] = (self.loop.controller, self.controller.state)
        known = {
            f"{o}.{v.name}": (state, i) for o, (m, state) in owners.items() for i, v in enumerate(m.states)
        }
        for name, value in start.items():
            if name not in known:
                raise unknown_name("state of the loop", name, known)
            state, place = known[name]
            state[place] = value

    def until(self, stop: float) -> Trace:
        """Run, and return the record."""
        step = self.loop.sample_time
        time: Array = step * np.arange(round(stop / step) + 1.0)
        loop = self.loop
        groups = (
            loop.plant.states, loop.plant.inputs, loop.observer.inputs, loop.observer.outputs,
            loop.controller.inputs, loop.controller.outputs,
        )  # fmt: skip
        logs = [np.zeros((len(group), len(time))) for group in groups]
        others = [
            (i, self._drive(f"{PLANT}.{v.name}", v.start))
            for i, v in enumerate(loop.plant.inputs)
            if i != self.current
        ]
        waiting = [float(loop.plant.inputs[self.current].start)] * loop.delay
        for k, now in enumerate(time):
            for i, drive in others:
                self.plant.begin[i], self.plant.end[i] = drive(now), drive(now + step)
            current = self._sample(float(now), waiting)
            parts = (
                self.plant.state, self.plant.begin, self.observer.inputs, self.observer.outputs,
                self.controller.inputs, self.controller.outputs,
            )  # fmt: skip
            for log, part in zip(logs, parts, strict=True):
                log[:, k] = part[: len(log)]
            if k + 1 < len(time):
                self.plant.end[self.current] = current
                self.plant.advance(float(now))
        return self._trace(time, logs)

    def _sample(self, now: float, waiting: list[float]) -> float:
        """Step observer and controller at one sample; return the current that acts in the coming one."""
        if waiting:
            self.plant.begin[self.current] = waiting[0]
        acting_now = f"{PLANT}.{self.current_name}"
        known = {f"{PLANT}.{n}": v for n, v in zip(self.seen, self.plant.read(now), strict=False)}
        known[acting_now] = self.plant.begin[self.current]
        self._feed(OBSERVER, self.observer, known, now)
        self.observer.evaluate()
        known |= {
            f"{OBSERVER}.{v.name}": self.observer.outputs[i] for i, v in enumerate(self.loop.observer.outputs)
        }
        self._feed(CONTROLLER, self.controller, known, now)
        self.controller.evaluate()
        self.controller.advance()
        waiting.append(float(self.controller.outputs[0]))
        acting = waiting.pop(0)
        if self.loop.delay == 0:
            # What was computed just now acts at once: the observer is given it before it moves on.
            self.plant.begin[self.current] = known[acting_now] = acting
            self._feed(OBSERVER, self.observer, known, now)
            self.observer.evaluate()
        self.observer.advance()
        return acting

    def _feed(self, owner: str, stepper: DiscreteStepper, known: Mapping[str, float], now: float) -> None:
        for i, v in enumerate(stepper.model.inputs):
            source = self.sources[f"{owner}.{v.name}"]
            stepper.inputs[i] = known[source] if source in known else self._drive(source, v.start)(now)

    def _drive(self, name: str, rest: float) -> Callable[[float], float]:
        given = self.open.get(name, rest)
        if callable(given):
            return given
        constant = float(given)
        return lambda _: constant

    def _trace(self, time: Array, logs: list[Array]) -> Trace:
        loop = self.loop
        plant = loop.plant
        p = np.repeat(plant.start(plant.parameters)[:, None], len(time), axis=1)
        _, y, s, _ = plant.equations.map(len(time))(
            time[None, :], logs[0], logs[1], p, np.zeros((0, len(time)))
        )
        groups = [
            (PLANT, plant.signals, np.array(ca.densify(s))), (PLANT, plant.outputs, np.array(ca.densify(y))),
            (PLANT, plant.inputs, logs[1]), (PLANT, plant.states, logs[0]),
            (OBSERVER, loop.observer.inputs, logs[2]), (OBSERVER, loop.observer.outputs, logs[3]),
            (CONTROLLER, loop.controller.inputs, logs[4]), (CONTROLLER, loop.controller.outputs, logs[5]),
        ]  # fmt: skip
        signals = {f"{o}.{v.name}": rows[i] for o, group, rows in groups for i, v in enumerate(group)}
        units = {f"{o}.{v.name}": v.unit for o, group, _ in groups for v in group}
        warnings = range_warnings(plant.signals + plant.states, time, signals, f"{PLANT}.")
        return Trace(time, signals, units, f"closed loop of {plant.name}", warnings=warnings)
