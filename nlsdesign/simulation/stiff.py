"""Implicit integration for stiff models: CVODES, restarted at every sample.

Source: Hindmarsh et al. 2005 (SUNDIALS), through CasADi.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError
from ..model import FlatModel
from .input_signals import Drives

_PLACES = (1.0 - np.cos(np.pi * np.arange(6) / 5)) / 2
_TO_COEFFICIENTS = np.linalg.inv(np.vander(_PLACES, increasing=True))
_BETWEEN = np.array([0.17, 0.58, 0.83])
MOST_HALVINGS = 12
SMALLEST_TOLERANCE = 1e-11


def _pieces(
    drives: Drives, interval: int, begin: float, end: float, tolerance: float, halvings: int = 0
) -> Iterator[tuple[float, float, Array]]:
    """Yield begin, end and coefficients (inputs, 6) of polynomials that follow the inputs."""
    length = end - begin
    values = drives.at(interval, begin + length * _PLACES)
    coefficients = (_TO_COEFFICIENTS @ values).T
    if drives.functions and halvings < MOST_HALVINGS:
        exact = drives.at(interval, begin + length * _BETWEEN)
        fitted = np.vander(_BETWEEN, 6, increasing=True) @ coefficients.T
        if np.any(np.abs(exact - fitted) > tolerance * (1.0 + np.max(np.abs(values)))):
            middle = begin + length / 2
            yield from _pieces(drives, interval, begin, middle, tolerance, halvings + 1)
            yield from _pieces(drives, interval, middle, end, tolerance, halvings + 1)
            return
    yield begin, end, coefficients


def integrate_implicitly(model: FlatModel, drives: Drives, first: int, x0: Array, tolerance: float) -> Array:
    """Return the states at the sample times from number ``first`` on, shape (states, n − first).

    ``drives``: inputs; functions of time are approximated piecewise by polynomials of degree five.
    """
    times, parameters = drives.times.tolist(), model.start(model.parameters)
    nominal = np.array([v.nominal for v in model.states])
    # Errors of CVODES grow up to a hundredfold over the steps; below the smallest tolerance it fails.
    each = max(tolerance / 100, SMALLEST_TOLERANCE)
    options = {"reltol": each, "abstol": each, "max_num_steps": 1_000_000}
    # Called for each piece: with a grid of times CasADi would step across jumps of the inputs.
    solver = ca.integrator("solver", "cvodes", _problem(model), 0.0, 1.0, options)
    states = [np.asarray(x0, dtype=float)]
    for k in range(first, len(times) - 1):
        x = states[-1]
        for begin, end, coefficients in _pieces(drives, k, times[k], times[k + 1], 10 * tolerance):
            fixed = [*parameters, *coefficients.ravel(order="F"), begin, end - begin]
            try:
                x = np.array(solver(x0=x / nominal, p=fixed)["xf"]).ravel() * nominal
            except RuntimeError as error:
                reason = str(error).strip().splitlines()[-1][:200]
                raise ConvergenceError(
                    f"simulation of {model.name}",
                    f"the integrator stopped after t = {begin:g} s: {reason}",
                    next_step="check the inputs for jumps beyond the range of the laws",
                ) from error
        states.append(x)
    return np.array(states).T


def _problem(model: FlatModel) -> dict[str, ca.SX]:
    """Return one piece in scaled states and relative time, with inputs as polynomials."""
    s = model.symbols()
    coefficients = ca.SX.sym("coefficients", s.input.shape[0], 6)
    begin, length, share = ca.SX.sym("begin"), ca.SX.sym("length"), ca.SX.sym("share")
    running = ca.mtimes(coefficients, ca.vertcat(*[share**k for k in range(6)]))
    nominal, scaled = ca.DM([v.nominal for v in model.states]), ca.SX.sym("scaled", s.state.shape)
    symbols = ca.vertcat(s.time, s.state, s.input)
    values = ca.vertcat(begin + share * length, scaled * nominal, running)
    rate = ca.substitute(s.derivative, symbols, values) * length / nominal
    fixed = ca.vertcat(s.parameter, ca.vec(coefficients), begin, length)
    return {"x": scaled, "t": share, "p": fixed, "ode": rate}
