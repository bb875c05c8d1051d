"""Linear algebra of small systems at many angles at once: exponential, Gramian, Riccati equation.

All take stacks of matrices, shape (N, n, n), and work by doubling: what is known of a short time gives twice
that time in a few products. So a thousand angles cost little more than one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TERMS = 14
"""Terms of the power series over the shortest time, where the norm is at most 1/8: exact to rounding."""
_DOUBLINGS = 60
"""At most this many doublings towards a steady state: 2^60 samples."""


def transposed(a: Array) -> Array:
    """Return each matrix transposed.

    Parameters
    ----------
    a
        Shape (N, n, m).
    """
    return np.swapaxes(a, -1, -2)


def symmetric(a: Array) -> Array:
    """Return the symmetric part of each matrix.

    Parameters
    ----------
    a
        Shape (N, n, n).
    """
    half: Array = (a + transposed(a)) / 2.0
    return half


def exponential_and_gramian(a: Array, weight: Array, horizon: float) -> tuple[Array, Array]:
    """Return e^(A·T) and ∫₀ᵀ e^(Aᵀt)·W·e^(At) dt of each matrix.

    A power series over a short time, then doubling: W(2t) = W(t) + e^(Aᵀt)·W(t)·e^(At). Sums of what is not
    negative, so nothing cancels. With Aᵀ for A it is the covariance of white noise. Source: Van Loan 1978.

    Parameters
    ----------
    a, weight
        Shape (N, n, n), A in 1/s and W symmetric.
    horizon
        T in s.
    """
    norm = float(np.max(np.sum(np.abs(a), axis=-1), initial=0.0)) * horizon
    doublings = max(0, int(np.ceil(np.log2(max(norm, 1e-300) / 0.125))))
    step = horizon / 2.0**doublings
    whole = np.broadcast_to(np.eye(a.shape[-1]), a.shape).copy()
    total = np.zeros(np.broadcast_shapes(a.shape, weight.shape))
    power, moment = whole, np.broadcast_to(weight, total.shape)
    # d/dt of e^(Aᵀt)·W·e^(At) is Aᵀ(·) + (·)A, so its k-th derivative at zero follows from the one before.
    for k in range(1, _TERMS + 1):
        total = total + moment * step / k
        moment = (transposed(a) @ moment + moment @ a) * (step / k)
        power = power @ a * (step / k)
        whole = whole + power
    for _ in range(doublings):
        total = total + transposed(whole) @ total @ whole
        whole = whole @ whole
    return whole, symmetric(total)


def covariance_without_measurement(transition: Array, noise: Array) -> Array:
    """Return P = Φ·P·Φᵀ + Q of each pair by doubling; infinite where it grows without bound.

    Parameters
    ----------
    transition, noise
        Φ and Q, shape (N, n, n).
    """
    total, power = noise, transition
    with np.errstate(over="ignore", invalid="ignore"):  # what grows overflows, and is said to be infinite
        for _ in range(_DOUBLINGS):
            more = power @ total @ transposed(power)
            total, power = total + more, power @ power
            if not np.any(np.abs(more) > 1e-17 * np.max(np.abs(total), axis=(-1, -2), keepdims=True)):
                break
    radius = np.max(np.abs(np.linalg.eigvals(transition)), axis=-1, initial=0.0)
    return np.where((radius < 1.0)[:, None, None], symmetric(total), np.inf)


def riccati(transition: Array, information: Array, noise: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the steady prior covariance of each Kalman filter, and whether there is one.

    P = Φ·(P − P·Cᵀ(C·P·Cᵀ + R)⁻¹C·P)·Φᵀ + Q by structure-preserving doubling: after k steps it is the
    covariance after 2^k samples from a known start. There is no steady state where something that does not
    decay is not seen. Source: Anderson 1978.

    Parameters
    ----------
    transition
        Φ, shape (N, n, n).
    information
        CᵀR⁻¹C, shape (N, n, n).
    noise
        Q, shape (N, n, n).

    Returns
    -------
    tuple of numpy.ndarray
        P, shape (N, n, n), not a number where there is none; and shape (N,), whether there is one.
    """
    size = transition.shape[-1]
    identity = np.eye(size)
    a, g, h = transposed(transition).copy(), information.copy(), noise.copy()
    settled, open_ = np.zeros(len(a), dtype=bool), np.arange(len(a))
    with np.errstate(over="ignore", invalid="ignore"):  # what grows overflows, and has no steady state
        for _ in range(_DOUBLINGS):
            an, gn, hn = a[open_], g[open_], h[open_]
            solved = np.linalg.solve(identity + gn @ hn, np.concatenate([an, gn], axis=-1))
            wa, wg = solved[..., :size], solved[..., size:]
            more = symmetric(transposed(an) @ hn @ wa)
            a[open_], g[open_] = an @ wa, symmetric(gn + an @ wg @ transposed(an))
            h[open_] = hn + more
            largest, added = (np.max(np.abs(each), axis=(-1, -2)) for each in (h[open_], more))
            settled[open_] = np.isfinite(largest) & (added <= 1e-14 * largest)
            open_ = open_[np.isfinite(largest) & ~settled[open_]]
            if not len(open_):
                break
    settled &= _decays(transition, information, np.where(settled[:, None, None], h, 0.0))
    return np.where(settled[:, None, None], h, np.nan), settled


def _decays(transition: Array, information: Array, prior: Array) -> NDArray[np.bool_]:
    """Tell whether the error of each filter decays: Φ·(I + P·CᵀR⁻¹C)⁻¹ has all eigenvalues inside 1."""
    error = transition @ np.linalg.inv(np.eye(transition.shape[-1]) + prior @ information)
    radius = np.max(np.abs(np.linalg.eigvals(error)), axis=-1, initial=0.0)
    decays: NDArray[np.bool_] = radius < 1.0 - 1e-12
    return decays
