"""A closed loop of plant, observer and controller, simulated in one piece.

Time runs in samples. At t_k the plant is read, the observer and the controller are stepped with what was
read, and the plant is integrated to t_{k+1} with the current held. The current that the controller computes
at t_k acts from t_{k+delay} on; with the default of one sample the computer has a whole sample for it. The
observer is given the current that really acts in the coming sample.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ArrangementError, ConvergenceError, ValueRangeError, unknown_name
from ....model import FlatModel
from ....simulation import Trace, range_warnings
from ....simulation.sampled_batch import PLANT, BatchTrace, SampledSystem, run_batch
from ..laws.torque_loop import LoopNames, loop_names

Array = NDArray[np.float64]
Drive = Callable[[float], float] | float

OBSERVER, CONTROLLER = "observer", "controller"


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
        kept = _kept(self)
        batch = run_batch(self.system(inputs), stop, inputs=inputs, start=start, keep=kept)
        if not batch.finite[0]:
            lost = np.flatnonzero(~np.all([np.isfinite(batch[name][0]) for name in kept], axis=0))
            at = batch.time[lost[0]] if len(lost) else batch.time[-1]
            raise ConvergenceError(
                f"plant {self.plant.name} at t = {at:g} s", "a state is not finite",
                next_step="use more substeps per sample, or check the gains of the loop",
            )  # fmt: skip
        return _record(self, batch)

    def system(self, opened: Iterable[str]) -> SampledSystem:
        """Return plant, observer and controller as one sampled system, for many runs at once.

        Parameters
        ----------
        opened
            Full names of the inputs that are driven from outside.

        Raises
        ------
        UnknownNameError
            If an input or the source of a wire does not exist.
        ArrangementError
            If an input is neither driven nor wired.
        """
        opened = set(opened)
        sources = {
            f"{owner}.{v.name}": self._source(owner, v.name, opened)
            for owner, model in ((OBSERVER, self.observer), (CONTROLLER, self.controller))
            for v in model.inputs
        }
        self._check_open(opened, sources)
        self._check_sources(sources)
        return SampledSystem(
            plant=self.plant,
            blocks={OBSERVER: self.observer, CONTROLLER: self.controller},
            sources=sources,
            driven=self.names.current,
            delay=self.delay,
            substeps=self.substeps,
        )

    def _source(self, owner: str, name: str, opened: set[str]) -> str:
        full = f"{owner}.{name}"
        if full in opened:
            return full
        if full in self.wires:
            return self.wires[full]
        outputs = {v.name for v in self.observer.outputs}
        return f"{OBSERVER if owner == CONTROLLER and name in outputs else PLANT}.{name}"

    def _check_open(self, opened: set[str], sources: Mapping[str, str]) -> None:
        known = {f"{PLANT}.{v.name}" for v in self.plant.inputs} - {f"{PLANT}.{self.names.current}"}
        known |= {name for name, source in sources.items() if source == name}
        known |= {f"{CONTROLLER}.{v.name}" for v in self.controller.inputs}
        for name in opened:
            if name not in known:
                raise unknown_name("input of the loop", name, known)

    def _check_sources(self, sources: Mapping[str, str]) -> None:
        known = {f"{PLANT}.{name}" for name in _names(self.plant)}
        known |= {f"{OBSERVER}.{v.name}" for v in self.observer.outputs}
        for name, source in sources.items():
            if source in known or source == name:
                continue
            if name in self.wires:
                raise unknown_name(f"wire to '{name}' from", source, known)
            raise ArrangementError(
                f"input '{name}'", "is open: it is neither driven nor wired, and nothing has the same name",
                next_step="give it in inputs or in wires",
            )  # fmt: skip


def _names(model: FlatModel) -> set[str]:
    groups = (model.states, model.inputs, model.parameters, model.outputs, model.signals)
    return {v.name for group in groups for v in group}


def _kept(loop: ClosedLoop) -> list[str]:
    groups = (
        (PLANT, loop.plant.states), (PLANT, loop.plant.inputs), (OBSERVER, loop.observer.inputs),
        (OBSERVER, loop.observer.outputs), (CONTROLLER, loop.controller.inputs),
        (CONTROLLER, loop.controller.outputs),
    )  # fmt: skip
    return [f"{owner}.{v.name}" for owner, group in groups for v in group]


def _record(loop: ClosedLoop, batch: BatchTrace) -> Trace:
    """Return the record, with the signals of the plant computed from its states and inputs."""
    plant, time = loop.plant, batch.time
    x, u = (
        np.array([batch[f"{PLANT}.{v.name}"][0] for v in group]).reshape(len(group), len(time))
        for group in (plant.states, plant.inputs)
    )
    p = np.repeat(plant.start(plant.parameters)[:, None], len(time), axis=1)
    _, y, s, _ = plant.equations.map(len(time))(time[None, :], x, u, p, np.zeros((0, len(time))))
    rows = {f"{PLANT}.{v.name}": row for v, row in zip(plant.signals, ca.densify(s).full(), strict=True)}
    rows |= {f"{PLANT}.{v.name}": row for v, row in zip(plant.outputs, ca.densify(y).full(), strict=True)}
    signals = rows | {name: values[0] for name, values in batch.signals.items()}
    owners = {PLANT: plant, OBSERVER: loop.observer, CONTROLLER: loop.controller}
    units = {
        f"{owner}.{v.name}": v.unit
        for owner, model in owners.items()
        for v in (*model.signals, *model.states, *model.inputs, *model.outputs)
    }
    warnings = range_warnings(plant.signals + plant.states, time, signals, f"{PLANT}.")
    return Trace(
        time, signals, {name: units[name] for name in signals}, f"closed loop of {plant.name}",
        warnings=warnings,
    )  # fmt: skip
