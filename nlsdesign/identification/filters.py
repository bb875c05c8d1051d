"""Zero-phase filters and derivatives of sampled signals; one and the same filter for every term."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]

RATE_WIDTH = 4.0
"""Standard deviation, in samples, of the filter in a measured rate."""
_REACH = 5.0


def derivative(signal: Array, step: float, *, order: int) -> Array:
    """Return a signal, its smoothed rate, or its raw second derivative.

    The rate passes a Gaussian of standard deviation :data:`RATE_WIDTH`, because dry friction asks for its
    sign. The second derivative is the central difference: whoever uses it filters it with all other terms.

    Parameters
    ----------
    signal
        Shape (n,).
    step
        Time between samples in s.
    order
        0, 1 or 2.
    """
    if order == 0:
        return signal
    if order == 1:
        rate: Array = gaussian_filter1d(signal, RATE_WIDTH, order=1, mode="nearest", truncate=_REACH) / step
        return rate
    second = np.zeros_like(signal)
    second[1:-1] = (signal[2:] - 2.0 * signal[1:-1] + signal[:-2]) / step**2
    return second


def kernel(width: float) -> Array:
    """Return a Gaussian of unit sum over whole samples.

    Parameters
    ----------
    width
        Standard deviation in samples.
    """
    reach = int(np.ceil(_REACH * width))
    at = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (at / width) ** 2)
    result: Array = weights / weights.sum()
    return result


def noise_gain(width: float, order: int) -> float:
    """Return the factor from the standard deviation of white noise to that behind derivative and filter.

    Parameters
    ----------
    width
        Of the filter, in samples.
    order
        Of the derivative, per sample: divide by stepᵒʳᵈᵉʳ.
    """
    weights = kernel(width)
    if order == 1:
        weights = np.convolve(weights, np.gradient(kernel(RATE_WIDTH)))
    elif order == 2:
        weights = np.convolve(weights, [1.0, -2.0, 1.0])
    return float(np.sqrt(np.sum(weights**2)))


def rate_noise_gain() -> float:
    """Return the factor from the standard deviation of white noise to that of a measured rate, per sample."""
    return float(np.sqrt(np.sum(np.gradient(kernel(RATE_WIDTH)) ** 2)))


def smoothing(n: int, width: float, stride: int) -> scipy.sparse.csr_array:
    """Return the matrix that filters n samples and keeps every ``stride``-th; near the ends nothing is kept.

    Parameters
    ----------
    n
        Number of samples.
    width
        Standard deviation of the Gaussian in samples.
    stride
        One of so many is kept.
    """
    weights = kernel(width)
    reach = len(weights) // 2
    centres = np.arange(reach, n - reach, stride)
    columns = centres[:, None] + np.arange(-reach, reach + 1)[None, :]
    rows = np.repeat(np.arange(len(centres)), len(weights))
    data = np.tile(weights, len(centres))
    return scipy.sparse.csr_array((data, (rows, columns.ravel())), shape=(len(centres), n))
