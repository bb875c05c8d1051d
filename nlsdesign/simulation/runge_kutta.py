"""Explicit Runge–Kutta integration of order 8 with error control, written out in CasADi.

A one-step method loses no accuracy where an input has a kink at every sample; a multi-step method would
have to restart there. Source of the method: Dormand and Prince 1981; Hairer, Nørsett and Wanner,
Solving Ordinary Differential Equations I, section II.5; coefficients from ``scipy.integrate.DOP853``.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import scipy

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError
from ..foundation.symbolic import remembered
from ..model import FlatModel
from .buffered import Buffered, Translate, as_it_is
from .events import LOCATED, Event, Modes, branch_of, locate_event
from .input_signals import Drives

STAGES = 12
SMALLEST_STEP = 1e-13
"""Shortest step relative to the distance of two samples or to the time itself."""

LARGEST_ERROR = 1e6
"""With an error beyond this a step is shortened before its events are located."""

WRITTEN_OUT = 2000
"""Right-hand sides with more operations than this are called, not written out twelve times."""


def nodes() -> Array:
    """Return the times of the stages and of the middle, as shares of a step."""
    # SciPy loads the table at its first use, which takes 0.4 s.
    return np.append(scipy.integrate.DOP853.C[:STAGES], 0.5)


class TooStiffError(Exception):
    """Stability limits the steps, not accuracy; an implicit method is needed."""

    def __init__(self, interval: int, states: Array, events: list[Event]) -> None:
        super().__init__(interval)
        self.interval = interval
        self.states = states
        self.events = events


@remembered(16)
def step_function(branch: ca.Function) -> ca.Function:
    """Return (t, h, x, U, p, tolerance, nominal, m) -> (x after the step, error, c, d, v), all dense.

    The error is relative to the tolerance. c is not negative if all modes last at the end of the step, d if
    they do in the middle too; v is the rate of each switch at the end.

    ``branch``: (t, x, u, p, m) -> (f, c, v). U holds the inputs at the twelve stages and in the middle, one
    column each.
    """
    n, m, parameters, switches = (branch.size1_in(i) for i in (1, 2, 3, 4))
    t, h, tolerance = ca.MX.sym("t"), ca.MX.sym("h"), ca.MX.sym("tolerance")
    x, u, p = ca.MX.sym("x", n), ca.MX.sym("u", m, STAGES + 1), ca.MX.sym("p", parameters)
    nominal, modes = ca.MX.sym("nominal", n), ca.MX.sym("m", switches)
    rates: list[ca.MX] = []
    method = scipy.integrate.DOP853

    def weighted(weights: Array) -> ca.MX:
        return sum((float(w) * k for w, k in zip(weights, rates, strict=False) if w), start=ca.MX.zeros(n))

    for i in range(STAGES):
        place = x + h * weighted(method.A[i, :i])
        rates.append(branch(t + float(method.C[i]) * h, place, u[:, i], p, modes)[0])
    after = x + h * weighted(method.B)
    scale = tolerance * (nominal + ca.fmax(ca.fabs(x), ca.fabs(after)))
    fifth, third = ca.sumsqr(weighted(method.E5) / scale), ca.sumsqr(weighted(method.E3) / scale)
    # The smallest normal number avoids 0/0.
    error = h * fifth / ca.sqrt(n * (fifth + 0.01 * third) + 2.3e-308)
    monitors = [ca.MX(1), ca.MX(1), ca.MX(0, 1)]
    if switches:
        last, at_end, rate = branch(t + h, after, u[:, STAGES - 1], p, modes)
        middle = (x + after) / 2 + h / 8 * (rates[0] - last)
        at_middle = branch(t + h / 2, middle, u[:, STAGES], p, modes)[1]
        monitors = [ca.mmin(at_end), ca.mmin(ca.vertcat(at_end, at_middle)), rate]
    results = [ca.densify(each) for each in (after, error, *monitors)]
    step = ca.Function("step", [t, h, x, u, p, tolerance, nominal, modes], results)
    if branch.n_instructions() >= WRITTEN_OUT:
        return step
    symbols = [step.sx_in(i) for i in range(step.n_in())]
    # Expressions of parameters alone are then computed once, not at every stage.
    return ca.Function("step", symbols, ca.cse([ca.densify(ca.SX(each)) for each in step.call(symbols)]))


class Stepper:
    """One step at a time through fixed buffers, without allocation.

    ``model``: continuous, with at least one state. ``modes``: of all switches; read at each step.
    ``translate``: makes the function of a step a faster one.
    """

    def __init__(
        self, model: FlatModel, drives: Drives, tolerance: float, modes: Array, translate: Translate
    ) -> None:
        self._moments = nodes()[: STAGES + (len(modes) > 0)]
        self._time, self._length = np.zeros(1), np.zeros(1)
        self.state, self._inputs = np.zeros(len(model.states)), np.zeros((STAGES + 1, len(model.inputs)))
        nominal = np.array([v.nominal for v in model.states])
        self.numbers = model.start(model.parameters)
        fixed = (self.numbers, np.array([tolerance]), nominal, modes)
        step = translate(step_function(branch_of(model.switching, model.equations)))
        given = (self._time, self._length, self.state, self._inputs, *fixed)
        self._step = Buffered(step, given)
        self.after, self.error, self._end, self._least, self._rate = self._step.results
        self._drives, self._stage_inputs = drives, self._inputs[: len(self._moments)]

    def step(self, interval: int, time: float, length: float) -> float:
        """Try a step from ``state`` to ``after`` and return its error; at most 1 is accepted."""
        self._time[0], self._length[0] = time, length
        self._drives.at(interval, time + length * self._moments, self._stage_inputs)
        self._step.evaluate()
        return float(self.error[0])

    def ends(self) -> bool:
        """Tell whether a mode has ended in the last step."""
        return bool(self._least[0] < 0.0)

    def settle(self, modes: Modes, time: float) -> None:
        """After an accepted step, change the modes that have ended and project the constrained rates."""
        inputs = self._inputs[STAGES - 1]
        if self._end[0] < 0.0:
            modes.settle(time, self.state, inputs)
        elif len(modes.held) and self._rate[modes.held].any():
            modes.keep(time, self.state, inputs)

    def shortened(self, interval: int, length: float, distance: float) -> float:
        """Repeat the step so that it ends where the first mode ends; return its length."""
        time = float(self._time[0])

        def lasts(length: float) -> float:
            self.step(interval, time, length)
            return float(self._end[0])

        if self._end[0] >= 0.0:
            # A mode has ended in the middle of the step, and begun again.
            if lasts(length / 2) >= 0.0:
                self.step(interval, time, length)
                return length
            length /= 2
        return locate_event(lasts, length, max(LOCATED * distance, 4 * math.ulp(time)))


def integrate_explicitly(
    model: FlatModel, drives: Drives, x0: Array, tolerance: float, translate: Translate = as_it_is
) -> tuple[Array, list[Event]]:
    """Return the states at the sample times, shape (states, n), and the events.

    No step reaches across a sample or an event.
    """
    times = drives.times.tolist()
    modes = Modes(model, times[-1] - times[0]) if model.switching else None
    stepper = Stepper(model, drives, tolerance, modes.now if modes else np.zeros(0), translate)
    states = np.zeros((len(x0), len(times)))
    stepper.state[:] = x0
    if modes:
        modes.begin(times[0], stepper.state, drives.at(0, drives.times[:1])[0])
    states[:, 0] = stepper.state
    may_change_method = modes is None or not modes.jump
    proposed, budget, done = times[1] - times[0], 40 * 20.0, 0
    for k, end in enumerate(times[1:]):
        now = times[k]
        while now < end:
            left = end - now
            # A very short last step would cost as much as a full one.
            length = left if left <= 1.001 * proposed else proposed
            error = stepper.step(k, now, length)
            ended = modes is not None and error < LARGEST_ERROR and stepper.ends()
            taken = stepper.shortened(k, length, end - times[k]) if ended else length
            error = float(stepper.error[0])
            if error <= 1.0:
                now = end if taken == left else now + taken
                stepper.state[:] = stepper.after
                longer = taken * min(10.0, 0.9 * max(error, 1e-30) ** -0.125)
                proposed = max(proposed, longer) if taken == left or ended else longer
                if modes:
                    stepper.settle(modes, now)
            else:
                proposed = taken * (max(0.2, 0.9 * error**-0.125) if error < np.inf else 0.2)
                if proposed < SMALLEST_STEP * max(abs(now), end - times[k]):
                    raise ConvergenceError(
                        f"simulation of {model.name}",
                        f"no step is short enough at t = {now:g} s",
                        next_step="check the inputs for jumps beyond the range of the laws, or "
                        "start nearer to rest",
                    )
            done += 1
            if done > budget:
                if may_change_method and limited_by_stability(model, drives, k, stepper.state, proposed):
                    raise TooStiffError(k, states[:, : k + 1], modes.log.events if modes else [])
                budget *= 2.0
        states[:, k + 1] = stepper.state
        budget += 40.0
    return states, modes.log.events if modes else []


def limited_by_stability(model: FlatModel, drives: Drives, interval: int, x: Array, length: float) -> bool:
    """Tell whether a step length is near the stability limit of the fastest pole."""
    s = model.symbols()
    slope = ca.Function(
        "slope", [s.time, s.state, s.input, s.parameter], [ca.jacobian(s.derivative, s.state)]
    )
    moment = drives.times[interval : interval + 1]
    inputs = drives.at(interval, moment)[0]
    jacobian = np.array(slope(moment, x, inputs, model.start(model.parameters)), dtype=float)
    return bool(np.all(np.isfinite(jacobian)) and np.max(np.abs(np.linalg.eigvals(jacobian))) * length > 1.5)
