"""Explicit Runge–Kutta integration of order 8 with error control, written out in CasADi.

A one-step method loses nothing where an input has a corner at every sample; a multi-step method would
have to start again there. Source of the method: Dormand and Prince 1981; Hairer, Nørsett and Wanner,
Solving Ordinary Differential Equations I, section II.5; coefficients from ``scipy.integrate.DOP853``.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from ..errors import ConvergenceError
from ..model import FlatModel
from .drives import Drives

Array = NDArray[np.float64]

STAGES = int(DOP853.n_stages)
NODES: Array = np.asarray(DOP853.C[:STAGES], dtype=float)
SMALLEST_STEP = 1e-13
"""Shortest step relative to the distance of two samples or to the time itself."""

WRITTEN_OUT = 2000
"""Right-hand sides with more operations than this are called, not written out twelve times."""


class TooStiffError(Exception):
    """The steps are held short by stability and not by accuracy; an implicit method is due."""

    def __init__(self, interval: int, states: Array) -> None:
        super().__init__(interval)
        self.interval = interval
        self.states = states


@lru_cache(maxsize=16)
def step_function(equations: ca.Function) -> ca.Function:
    """Return (t, h, x, U, p, tolerance, nominal) -> (x after the step, error relative to the tolerance).

    Parameters
    ----------
    equations
        Of a continuous flat model. U holds the inputs at the twelve stages, one column each.
    """
    n, m, parameters = (equations.size1_in(i) for i in (1, 2, 3))
    arguments = [ca.SX.sym(name, equations.size1_in(i)) for i, name in enumerate("txupw")]
    rate = ca.Function("rate", arguments[:4], [equations.call([*arguments[:4], ca.SX(0, 1)])[0]])
    t, h, tolerance = ca.MX.sym("t"), ca.MX.sym("h"), ca.MX.sym("tolerance")
    x, u, p = ca.MX.sym("x", n), ca.MX.sym("u", m, STAGES), ca.MX.sym("p", parameters)
    nominal = ca.MX.sym("nominal", n)
    rates: list[ca.MX] = []

    def weighted(weights: Array) -> ca.MX:
        return sum((float(w) * k for w, k in zip(weights, rates, strict=False) if w), start=ca.MX.zeros(n))

    for i in range(STAGES):
        rates.append(rate(t + float(NODES[i]) * h, x + h * weighted(DOP853.A[i, :i]), u[:, i], p))
    after = x + h * weighted(DOP853.B)
    scale = tolerance * (nominal + ca.fmax(ca.fabs(x), ca.fabs(after)))
    fifth, third = ca.sumsqr(weighted(DOP853.E5) / scale), ca.sumsqr(weighted(DOP853.E3) / scale)
    # The smallest normal number only keeps 0/0 away.
    error = h * fifth / ca.sqrt(n * (fifth + 0.01 * third) + 2.3e-308)
    step = ca.Function("step", [t, h, x, u, p, tolerance, nominal], [after, error])
    if rate.n_instructions() >= WRITTEN_OUT:
        return step
    symbols = [step.sx_in(i) for i in range(step.n_in())]
    # What depends on parameters alone is then computed once and not at every stage.
    return ca.Function("step", symbols, ca.cse([ca.SX(each) for each in step.call(symbols)]))


class _Stepper:
    """One step at a time through buffers, so that a step costs little more than its arithmetic."""

    def __init__(self, model: FlatModel, tolerance: float) -> None:
        n, m = len(model.states), len(model.inputs)
        self.time, self.length = np.zeros(1), np.zeros(1)
        self.state, self.inputs = np.zeros(n), np.zeros((STAGES, m))
        self.after, self.error = np.zeros(n), np.zeros(1)
        nominal = np.array([v.nominal for v in model.states])
        fixed = (model.start(model.parameters), np.array([tolerance]), nominal)
        self._kept = (self.time, self.length, self.state, self.inputs, *fixed)
        self._buffer, self._evaluate = step_function(model.equations).buffer()
        for i, values in enumerate(self._kept):
            self._buffer.set_arg(i, memoryview(values))  # type: ignore[call-arg, arg-type]
        for i, values in enumerate((self.after, self.error)):
            self._buffer.set_res(i, memoryview(values))  # type: ignore[call-arg, arg-type]

    def step(self, drives: Drives, interval: int, time: float, length: float) -> float:
        """Try a step from ``state`` to ``after`` and return its error; 1 is as large as it may be."""
        self.time[0], self.length[0] = time, length
        drives.at(interval, time + length * NODES, self.inputs)
        self._evaluate()
        return float(self.error[0])


def integrate_explicitly(model: FlatModel, drives: Drives, x0: Array, tolerance: float) -> Array:
    """Return the states at the sample times, shape (states, n); no step reaches across a sample.

    Parameters
    ----------
    model
        Continuous, with at least one state.
    drives
        Inputs.
    x0
        States at the first time.
    tolerance
        Error allowed per step, relative to the state and to its nominal size.

    Raises
    ------
    TooStiffError
        If stability holds the steps short, with what was found so far.
    ConvergenceError
        If no step is short enough.
    """
    times, stepper = drives.times.tolist(), _Stepper(model, tolerance)
    states = np.zeros((len(x0), len(times)))
    states[:, 0] = stepper.state[:] = x0
    wanted, budget, done = times[1] - times[0], 40 * 20.0, 0
    for k, end in enumerate(times[1:]):
        now = times[k]
        while now < end:
            left = end - now
            # A sliver of a step at the end would cost as much as a whole one.
            length = left if left <= 1.001 * wanted else wanted
            error = stepper.step(drives, k, now, length)
            if error <= 1.0:
                now = end if length == left else now + length
                stepper.state[:] = stepper.after
                longer = length * min(10.0, 0.9 * max(error, 1e-30) ** -0.125)
                wanted = max(wanted, longer) if length == left else longer
            else:
                wanted = length * (max(0.2, 0.9 * error**-0.125) if error < np.inf else 0.2)
                if wanted < SMALLEST_STEP * max(abs(now), end - times[k]):
                    raise _no_step(model, now)
            done += 1
            if done > budget:
                if _held_by_stability(model, drives, k, stepper.state, wanted):
                    raise TooStiffError(k, states[:, : k + 1])
                budget *= 2.0
        states[:, k + 1] = stepper.state
        budget += 40.0
    return states


def _held_by_stability(model: FlatModel, drives: Drives, interval: int, x: Array, wanted: float) -> bool:
    """Tell whether the step wanted is about as long as the fastest pole allows."""
    s = model.symbols()
    slope = ca.Function(
        "slope", [s.time, s.state, s.input, s.parameter], [ca.jacobian(s.derivative, s.state)]
    )
    moment = drives.times[interval : interval + 1]
    inputs = drives.at(interval, moment)[0]
    found = np.array(slope(moment, x, inputs, model.start(model.parameters)), dtype=float)
    return bool(np.all(np.isfinite(found)) and np.max(np.abs(np.linalg.eigvals(found))) * wanted > 1.5)


def _no_step(model: FlatModel, time: float) -> ConvergenceError:
    return ConvergenceError(
        f"simulation of {model.name}",
        f"no step is short enough at t = {time:g} s",
        next_step="check the inputs for jumps beyond the range of the laws, or start nearer to rest",
    )
