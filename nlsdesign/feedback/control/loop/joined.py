"""Observer and controller as one step of a controller: one reading and one wish in, one current out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ....foundation.errors import ArrangementError, ValueRangeError, nearest
from ....foundation.symbolic import Expression
from ....model import FlatModel, Variable
from ....model.origin import common_origin

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
    parameters = (*observer.parameters, *controller.parameters)
    outputs = (*observer.outputs, *controller.outputs)
    tables = (*observer.tables, *controller.tables)
    for group in ((*states, *inputs), parameters, outputs):
        _check_names(group)
    _check_tables(controller, {v.name for v in (*states, *inputs)})
    return FlatModel(
        name=f"{observer.name}_and_controller",
        description=f"{observer.description}; {controller.description}",
        states=states,
        inputs=inputs,
        parameters=parameters,
        outputs=outputs,
        signals=(*observer.signals, *controller.signals),
        equations=_Joint(wiring, inputs, delay).equations(),
        sample_time=observer.sample_time,
        tables=tables,
        bodies=observer.bodies,
        begin=_Joint(wiring, inputs, delay).begin(),
        expected=_Joint(wiring, inputs, delay).expected(),
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
        self.seen, self.heard = (
            _ModelSymbols(*(ca.SX.sym(name, count) for name, count in zip("xpw", _sizes(model), strict=True)))
            for model in (self.observer, self.controller)
        )
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
        return ca.Function(
            "equations",
            [ca.SX.sym("time"), *self._arguments()],
            [ca.densify(states), ca.densify(ca.vertcat(estimates, command)),
             ca.densify(ca.vertcat(shown, signals)), ca.SX(0, 1)],
            ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
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


@dataclass(frozen=True, eq=False)
class _ModelSymbols:
    state: Expression
    parameter: Expression
    table: Expression


def _sizes(model: FlatModel) -> tuple[int, int, int]:
    return len(model.states), len(model.parameters), sum(len(table.columns) for table in model.tables)


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


def _check_names(group: Sequence[Variable]) -> None:
    names: set[str] = set()
    for v in group:
        if v.name in names:
            raise ArrangementError(
                f"'{v.name}'", "is a variable of the observer and another one of the controller",
                next_step="design both on the same flat model, in which names are unique",
            )  # fmt: skip
        names.add(v.name)


def _check_tables(controller: FlatModel, known: set[str]) -> None:
    for table in controller.tables:
        if table.argument not in known:
            raise ArrangementError(
                f"table of the controller over '{table.argument}'", "is read at an output of the observer",
                next_step="look it up over the measured angle",
            )  # fmt: skip
