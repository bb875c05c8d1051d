"""The least error that any estimator of the torque can have with these sensors: Bayesian Cramér–Rao bound.

The unknown numbers are p = p₀·exp(L·ξ) with ξ of unit variance; angle readings y_k have white Gaussian errors
with the variance of the encoder's rounding, quantum²/12; the input is known. To first order along one
trajectory

    J_k = I + Σ_{i≤k} hᵢᵀhᵢ / r,   h = ∂θ/∂ξ,   var τ_k ≥ g_k J_k⁻¹ g_kᵀ,   g = ∂τ/∂ξ,

with the slopes from the variational equations of the model, which shares nothing with any observer. The
rounding of an encoder is not Gaussian: at standstill it says less, over a long motion it can say more.

Source: Van Trees 1968, sec. 2.4; Tichavský et al. 1998.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, unknown_name
from ....model import FlatModel
from ....model.transform import named
from ....simulation.prior import Prior


@dataclass(frozen=True, eq=False)
class EstimatorBound:
    """Least standard deviation of an estimate along a run."""

    time: Array  # in s, shape (T,)
    deviation: Array  # of the estimate from all readings so far, shape (T,)
    before: Array  # the same from the numbers of the deck alone, without any reading, shape (T,)


@dataclass(frozen=True)
class SensedTorque:
    """What is estimated from what."""

    estimate: str
    measured: str
    quantum: float
    sample_time: float = 1e-3
    substeps: int = 6


def estimator_bound(model: FlatModel, prior: Prior, inputs: Array, sensed: SensedTorque) -> EstimatorBound:
    """Return the bound along the trajectory that known inputs cause from the start values of a model.

    ``model``: continuous, with the numbers of the trajectory. ``prior``: what is known of the numbers; those
    that the model does not have are left out. ``inputs``: held over each sample, shape (inputs, T).
    """
    known = prior.only([name for name in prior.names if name in model.values])
    step, read = _variational(model, known, sensed)
    count = inputs.shape[1]
    xi = len(known.names)
    begin = np.concatenate([model.start(model.states), np.zeros(len(model.states) * xi)])
    course = step.mapaccum("course", count)(begin, inputs).full()
    course = np.concatenate([begin[:, None], course[:, :-1]], axis=1)
    seen, wanted = read.map(count)(course, inputs)
    h, g = seen.full().T, wanted.full().T
    variance, before = np.zeros(count), np.einsum("ti,ti->t", g, g)
    covariance, noise = np.eye(xi), sensed.quantum**2 / 12.0
    # Of an unstable motion the slopes grow without end: beside them the prior is lost in a double.
    if not (np.all(np.isfinite(course)) and np.max(np.square(h)) < noise / np.finfo(float).eps):
        raise ConvergenceError(
            f"motion of {model.name} along the run", "is not decided by its inputs to first order",
            next_step="use a smaller torque or lower frequencies in the duty",
        )  # fmt: skip
    for k in range(count):
        # J⁻¹ with one more reading, by Sherman and Morrison.
        gained = covariance @ h[k]
        covariance -= np.outer(gained, gained) / (noise + h[k] @ gained)
        variance[k] = g[k] @ covariance @ g[k]
    time: Array = sensed.sample_time * np.arange(float(count))
    return EstimatorBound(time, np.sqrt(np.maximum(variance, 0.0)), np.sqrt(before))


def _variational(model: FlatModel, prior: Prior, sensed: SensedTorque) -> tuple[ca.Function, ca.Function]:
    """Return one sample of states and their slopes, and the slopes of reading and estimate."""
    s = model.symbols()
    expressions = named(model, s)
    for name in (sensed.estimate, sensed.measured):
        if name not in expressions:
            raise unknown_name("state, output or signal", name, expressions)
    xi = ca.SX.sym("xi", len(prior.names))
    values, vectors = np.linalg.eigh(prior.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    moved = ca.mtimes(ca.DM(root), xi)
    shifted = {
        name: spread.expression(model.values[name], moved[k])
        for k, (name, spread) in enumerate(zip(prior.names, prior.kinds, strict=True))
    }
    p = ca.vertcat(*[shifted.get(v.name, ca.SX(v.start)) for v in model.parameters])
    n, count = len(model.states), len(prior.names)
    rate, estimate = (ca.substitute(e, s.parameter, p) for e in (s.derivative, expressions[sensed.estimate]))
    slopes = ca.SX.sym("slopes", n, count)
    nothing = ca.SX.zeros(count, 1)

    def along(expression: ca.SX) -> ca.SX:
        by_state, by_number = ca.jacobian(expression, s.state), ca.jacobian(expression, xi)
        return ca.substitute(ca.mtimes(by_state, slopes) + by_number, xi, nothing)

    both = ca.vertcat(s.state, ca.vec(slopes))
    whole = ca.vertcat(ca.substitute(rate, xi, nothing), ca.vec(along(rate)))
    field = ca.Function("field", [s.time, both, s.input], [ca.cse(ca.densify(whole))])
    x, u = ca.MX.sym("x", n * (1 + count)), ca.MX.sym("u", len(model.inputs))
    h, at = sensed.sample_time / sensed.substeps, x
    for _ in range(sensed.substeps):
        k1 = field(0, at, u)
        k2 = field(0, at + h / 2 * k1, u)
        k3 = field(0, at + h / 2 * k2, u)
        k4 = field(0, at + h * k3, u)
        at = at + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    place = [v.name for v in model.states].index(sensed.measured)
    read = ca.Function("read", [both, s.input], [slopes[place, :].T, ca.densify(along(estimate)).T])
    return ca.Function("step", [x, u], [at]), read


def rms_over(bounds: list[EstimatorBound], first: float, last: float) -> float:
    """Return the root mean square of the bound over a stretch of several runs."""
    squares = [b.deviation[(b.time >= first) & (b.time < last)] ** 2 for b in bounds]
    return math.sqrt(float(np.mean(np.concatenate(squares))))
