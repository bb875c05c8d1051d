"""Exact discretisation over one sample by the matrix exponential; many angles at once. Never Euler.

At 1 kHz forward Euler turns the pole of the printed relaxation, −1411 1/s, into a factor −0.41 per sample
instead of +0.24.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]


def held(a: Array, b: Array, sample_time: float) -> tuple[Array, Array]:
    """Return Φ and Γ of x⁺ = Φx + Γu for an input that is held over the sample.

    Parameters
    ----------
    a, b
        Shapes (..., n, n) and (..., n, m); ẋ = A x + B u.
    sample_time
        T in s.
    """
    n, m = b.shape[-2:]
    block = np.zeros((*a.shape[:-2], n + m, n + m))
    block[..., :n, :n], block[..., :n, n:] = a, b
    whole = _exponentials(block * sample_time)
    return whole[..., :n, :n], whole[..., :n, n:]


def linear(a: Array, sample_time: float) -> tuple[Array, Array, Array]:
    """Return Φ, Γ₀ and Γ₁ of x⁺ = Φx + Γ₀g₀ + Γ₁g₁ for a drive that runs linearly from g₀ to g₁.

    ẋ = A x + g(t). Source: Van Loan 1978.

    Parameters
    ----------
    a
        Shape (..., n, n).
    sample_time
        T in s.
    """
    n = a.shape[-1]
    block = np.zeros((*a.shape[:-2], 3 * n, 3 * n))
    block[..., :n, :n] = a * sample_time
    block[..., :n, n : 2 * n] = np.eye(n) * sample_time
    block[..., n : 2 * n, 2 * n :] = np.eye(n)
    whole = _exponentials(block)
    end = whole[..., :n, 2 * n :]
    return whole[..., :n, :n], whole[..., :n, n : 2 * n] - end, end


def _exponentials(blocks: Array) -> Array:
    """Return the exponential of each matrix; those that are equal at all angles are computed once."""
    if (
        blocks.ndim == 3
        and len(blocks) > 1
        and np.array_equal(blocks, np.broadcast_to(blocks[0], blocks.shape))
    ):
        same: Array = np.broadcast_to(expm(blocks[0]), blocks.shape).copy()
        return same
    result: Array = expm(blocks)
    return result
