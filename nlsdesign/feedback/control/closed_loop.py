"""Plant, observer and controller wired by name and simulated in one piece; the outcome is not judged here."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from ...foundation.errors import ArrangementError, ConvergenceError, ValueRangeError, nearest, unknown_name
from ...foundation.symbolic import Expression
from ...model import FlatModel, Variable
from ...model.flat import stated_equations
from ...model.origin import common_origin
from ...model.roles import moved_load, series_spring
from ...model.transform import with_signal
from ...simulation import Trace, range_warnings
from ...simulation.sampled_batch import PLANT, SampledSystem, run_batch
from .laws.law_writer import GAIN
from .laws.torque_loop import LoopNames, loop_names

ACTING = "acting"
"""Ending of the name of what the controller computed before and what acts in the coming sample."""


def joined(observer: FlatModel, controller: FlatModel, *, delay: int = 1) -> FlatModel:
    """Return observer and controller as one discrete flat model.

    The controller's inputs that are outputs of the observer are wired, inputs of one name are one input, and
    the observer is given the output of the controller that acts in the coming sample. Outputs are those of
    the observer, then those of the controller.

    Parameters
    ----------
    observer, controller
        Discrete, with the same sample time.
    delay
        Samples between the computation of the controller's output and its effect, at least 1.

    Returns
    -------
    FlatModel
        Discrete.

    Raises
    ------
    ValueRangeError
        If they are not sampled alike, or the delay is smaller than one sample.
    ArrangementError
        If no output of the controller is an input of the observer, no output of the observer one of the
        controller, or two different variables have one name.

    Examples
    --------
    >>> import nlsdesign as nls
    >>> from nlsdesign.feedback.observer import design_observer_with_details
    >>> plant = nls.flatten(nls.declare(nls.load_deck("austin2015_figure_consistent")))
    >>> both = joined(design_observer_with_details(plant).model, nls.torque_controller(plant))
    >>> [v.name for v in both.inputs]
    ['motor.angle', 'spring.torque.desired']
    """
    if observer.sample_time is None or observer.sample_time != controller.sample_time:
        times = f"sample times {observer.sample_time} and {controller.sample_time} s"
        raise ValueRangeError(times, "observer and controller must be discrete and sampled alike")
    if delay < 1:
        raise ValueRangeError(f"delay {delay}", "must be at least one sample: a step has to compute")
    wiring = _Wiring(observer, controller, _driven(observer, controller))
    inputs, waiting = wiring.inputs(), _waiting(wiring.driven, delay)
    states = (*observer.states, *controller.states, *waiting)
    parameters = (*observer.parameters, *wiring.controller_only())
    outputs = (*observer.outputs, *controller.outputs)
    tables = (*observer.tables, *controller.tables)
    for group in ((*states, *inputs), parameters, outputs):
        once: set[str] = set()
        for v in group:
            if v.name in once:
                raise ArrangementError(
                    f"'{v.name}'", "is a variable of the observer and another one of the controller",
                    next_step="design both on the same flat model, in which names are unique",
                )  # fmt: skip
            once.add(v.name)
    known = {v.name for v in (*states, *inputs)}
    for table in controller.tables:
        if table.argument not in known:
            raise ArrangementError(
                f"table of the controller over '{table.argument}'", "is read at an output of the observer",
                next_step="look it up over the measured angle",
            )  # fmt: skip
    joint = _Joint(wiring, inputs, delay)
    return FlatModel(
        name=f"{observer.name}_and_controller",
        description=f"{observer.description}; {controller.description}",
        states=states,
        inputs=inputs,
        parameters=parameters,
        outputs=outputs,
        signals=(*observer.signals, *controller.signals),
        equations=joint.equations(),
        sample_time=observer.sample_time,
        tables=tables,
        bodies=observer.bodies,
        begin=joint.begin(),
        expected=joint.expected(),
        origin=common_origin(observer.origin, controller.origin),
    )


@dataclass(frozen=True, eq=False)
class _Wiring:
    """Both models, and the output of the controller that the observer reads."""

    observer: FlatModel
    controller: FlatModel
    driven: Variable

    def inputs(self) -> tuple[Variable, ...]:
        """Return the inputs that are left, a shared one as the observer declares it."""
        given = {v.name for v in self.observer.outputs}
        own = [self._measured(v) for v in self.observer.inputs if v.name != self.driven.name]
        names = {v.name for v in own}
        wishes = [v for v in self.controller.inputs if v.name not in given | names]
        if len(wishes) == len([v for v in self.controller.inputs if v.name not in names]):
            wanted = ", ".join(v.name for v in self.controller.inputs)
            raise ArrangementError(
                f"controller '{self.controller.name}'", f"reads no output of the observer, only {wanted}",
                did_you_mean=nearest(self.controller.inputs[0].name, list(given)),
            )  # fmt: skip
        return (*own, *wishes)

    def controller_only(self) -> tuple[Variable, ...]:
        """Return the parameters of the controller: those of the plant say that the observer keeps its own.

        What limits the driven output can only be lowered: the observer believes no more than that.
        """
        limits = (-self.driven.minimum, self.driven.maximum)
        parameters: list[Variable] = []
        for v in self.controller.parameters:
            if not v.name.startswith(f"{GAIN}."):
                is_limit = v.unit == self.driven.unit and v.start in limits
                words = f"{v.description}; controller only: the observer keeps the number of its design"
                v = replace(v, maximum=v.start) if is_limit else replace(v, description=words)
            parameters.append(v)
        return tuple(parameters)

    def _measured(self, variable: Variable) -> Variable:
        """Return an input whose reading is moved by what acts, now a state."""
        can = variable.plausibility
        if can is None or can.moved_by != self.driven.name:
            return variable
        return replace(variable, plausibility=replace(can, moved_by=f"{self.driven.name}.{ACTING}"))


class _Joint:
    """Both models in common symbols."""

    def __init__(self, wiring: _Wiring, inputs: Sequence[Variable], delay: int) -> None:
        self.wiring, self.observer, self.controller = wiring, wiring.observer, wiring.controller
        self.inputs = {v.name: ca.SX.sym(v.name) for v in inputs}
        self.seen, self.heard = self.observer.symbols(), self.controller.symbols()
        self.waiting = ca.SX.sym("waiting", delay)

    def _arguments(self) -> list[Expression]:
        one, other = self.seen, self.heard
        return [
            ca.SX(ca.vertcat(one.state, other.state, self.waiting)),
            ca.SX(ca.vertcat(*self.inputs.values())),
            ca.SX(ca.vertcat(one.parameter, other.parameter)),
            ca.SX(ca.vertcat(one.table, other.table)),
        ]

    def _readings(self) -> Expression:
        """Return the inputs of the observer."""
        known: Mapping[str, Expression] = {**self.inputs, self.wiring.driven.name: self.waiting[0]}
        return ca.SX(ca.vertcat(*[known[v.name] for v in self.observer.inputs]))

    def _observed(self, state: Expression) -> tuple[Expression, Expression, Expression]:
        """Return next state, outputs and signals of the observer."""
        one = self.seen
        following, outputs, signals, _ = self.observer.equations(
            0.0, state, self._readings(), one.parameter, one.table
        )
        return following, outputs, signals

    def _wish(self, estimates: Expression) -> Expression:
        """Return the inputs of the controller."""
        known = {v.name: estimates[i] for i, v in enumerate(self.observer.outputs)} | self.inputs
        return ca.SX(ca.vertcat(*[known[v.name] for v in self.controller.inputs]))

    def equations(self) -> ca.Function:
        """Return the equations of one sample."""
        other = self.heard
        following, estimates, shown = self._observed(self.seen.state)
        after, command, signals, _ = self.controller.equations(
            0.0, other.state, self._wish(estimates), other.parameter, other.table
        )
        place = [v.name for v in self.controller.outputs].index(self.wiring.driven.name)
        later = [self.waiting[i] for i in range(1, self.waiting.numel())]
        states = ca.vertcat(following, after, *later, command[place])
        x, u, p, w = self._arguments()
        return stated_equations(
            x, u, derivative=ca.densify(states), output=ca.densify(ca.vertcat(estimates, command)),
            parameter=p, table=w, signal=ca.densify(ca.vertcat(shown, signals)),
        )  # fmt: skip

    def begin(self) -> ca.Function:
        """Return the states before the first sample, and those after a gap in the readings."""
        one, other = self.seen, self.heard
        observers = [one.state, one.state]
        if self.observer.begin is not None:
            observers = self.observer.begin.call([one.state, self._readings(), one.parameter, one.table])
        results = []
        for which, state in enumerate(observers):
            controllers = [other.state, other.state]
            if self.controller.begin is not None:
                wish = self._wish(self._observed(state)[1])
                controllers = self.controller.begin.call([other.state, wish, other.parameter, other.table])
            results.append(ca.densify(ca.vertcat(state, controllers[which], self.waiting)))
        return ca.Function("begin", self._arguments(), results)

    def expected(self) -> ca.Function | None:
        """Return what the observer expects of each input, ``None`` where it expects nothing."""
        if self.observer.expected is None:
            return None
        one = self.seen
        values = self.observer.expected(one.state, self._readings(), one.parameter, one.table)
        known = self.inputs | {
            v.name: values[i] for i, v in enumerate(self.observer.inputs) if v.name in self.inputs
        }
        return ca.Function("expected", self._arguments(), [ca.vertcat(*known.values())])


def _driven(observer: FlatModel, controller: FlatModel) -> Variable:
    wanted = [v.name for v in observer.inputs]
    for v in controller.outputs:
        if v.name in wanted:
            return v
    raise ArrangementError(
        f"observer '{observer.name}'",
        f"reads no output of the controller, which gives {', '.join(v.name for v in controller.outputs)}",
        next_step="name the output as the observer's input: torque_controller(..., current=NAME)",
    )


def _waiting(driven: Variable, delay: int) -> tuple[Variable, ...]:
    first = Variable(
        f"{driven.name}.{ACTING}", driven.unit, f"{driven.name} that acts in the coming sample",
        nominal=driven.nominal,
    )  # fmt: skip
    later = [
        Variable(f"{driven.name}.waiting[{i}]", driven.unit, f"{driven.name} that acts {i} samples later",
                 nominal=driven.nominal)
        for i in range(1, delay)
    ]  # fmt: skip
    return (first, *later)


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
        groups = (
            (PLANT, self.plant.states), (PLANT, self.plant.inputs), (OBSERVER, self.observer.inputs),
            (OBSERVER, self.observer.outputs), (CONTROLLER, self.controller.inputs),
            (CONTROLLER, self.controller.outputs),
        )  # fmt: skip
        kept = [f"{owner}.{v.name}" for owner, group in groups for v in group]
        batch = run_batch(self.system(inputs), stop, inputs=inputs, start=start, keep=kept)
        if not batch.finite[0]:
            lost = np.flatnonzero(~np.all([np.isfinite(batch[name][0]) for name in kept], axis=0))
            at = batch.time[lost[0]] if len(lost) else batch.time[-1]
            raise ConvergenceError(
                f"plant {self.plant.name} at t = {at:g} s", "a state is not finite",
                next_step="use more substeps per sample, or check the gains of the loop",
            )  # fmt: skip
        # The record, with the signals of the plant computed from its states and inputs.
        plant, time = self.plant, batch.time
        x, u = (
            np.array([batch[f"{PLANT}.{v.name}"][0] for v in group]).reshape(len(group), len(time))
            for group in (plant.states, plant.inputs)
        )
        p = np.repeat(plant.start(plant.parameters)[:, None], len(time), axis=1)
        _, y, s, _ = plant.equations.map(len(time))(time[None, :], x, u, p, np.zeros((0, len(time))))
        rows = {f"{PLANT}.{v.name}": row for v, row in zip(plant.signals, ca.densify(s).full(), strict=True)}
        rows |= {f"{PLANT}.{v.name}": row for v, row in zip(plant.outputs, ca.densify(y).full(), strict=True)}
        signals = rows | {name: values[0] for name, values in batch.signals.items()}
        owners = {PLANT: plant, OBSERVER: self.observer, CONTROLLER: self.controller}
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
        known = {f"{PLANT}.{v.name}" for v in self.plant.inputs} - {f"{PLANT}.{self.names.current}"}
        known |= {name for name, source in sources.items() if source == name}
        known |= {f"{CONTROLLER}.{v.name}" for v in self.controller.inputs}
        for name in opened:
            if name not in known:
                raise unknown_name("input of the loop", name, known)
        plant = self.plant
        groups = (plant.states, plant.inputs, plant.parameters, plant.outputs, plant.signals)
        offered = {f"{PLANT}.{v.name}" for group in groups for v in group}
        offered |= {f"{OBSERVER}.{v.name}" for v in self.observer.outputs}
        for target, origin in sources.items():
            if origin in offered or origin == target:
                continue
            if target in self.wires:
                raise unknown_name(f"wire to '{target}' from", origin, offered)
            raise ArrangementError(
                f"input '{target}'", "is open: it is neither driven nor wired, and nothing has the same name",
                next_step="give it in inputs or in wires",
            )  # fmt: skip
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


DEFLECTION = "measured"
"""What is added to the name of the spring's motion for what the encoders at both ends read of it."""


def encoder_loop(
    plant: FlatModel, *, observer: FlatModel, controller: FlatModel, delay: int = 1, substeps: int = 10
) -> ClosedLoop:
    """Return the closed loop in which observer and controller read encoders where the plant has them.

    The controller reads the motor. The observer reads the motor where the load is fixed, and the difference
    of motor and load where the motion of the load is prescribed. An angle without a sensor is taken as it is.

    Parameters
    ----------
    plant
        Continuous.
    observer, controller
        Discrete, designed on the plant with its load fixed.
    delay, substeps
        As :class:`ClosedLoop` has them.

    Raises
    ------
    ArrangementError
        If several loads are moved.
    """
    angle = loop_names(plant).angle
    motor = _read(plant, angle)
    deflection = motor
    if any(body.prescribed for body in plant.bodies):
        load = _read(plant, moved_load(plant).motion)
        spring = plant.variable(series_spring(plant).motion)
        deflection = f"{spring.name}.{DEFLECTION}"
        shown = Variable(deflection, spring.unit, "deflection of the spring as it is read")
        plant = with_signal(plant, shown, lambda known: known[motor] - known[load])
    wires = {f"{OBSERVER}.{angle}": f"{PLANT}.{deflection}", f"{CONTROLLER}.{angle}": f"{PLANT}.{motor}"}
    inputs = {OBSERVER: observer, CONTROLLER: controller}
    present = {f"{owner}.{v.name}" for owner, model in inputs.items() for v in model.inputs}
    wires = {name: source for name, source in wires.items() if name in present}
    return ClosedLoop(
        plant=plant, observer=observer, controller=controller, wires=wires, delay=delay, substeps=substeps
    )


def _read(plant: FlatModel, motion: str) -> str:
    """Return the first sensor that reads a motion, or the motion itself."""
    readings = [r.signal for r in plant.readings if r.measured == motion and r.sensors]
    return readings[0] if readings else motion
