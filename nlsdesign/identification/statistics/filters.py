"""Zero-phase filters and derivatives of sampled signals; one and the same filter for every term."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.ndimage import correlate1d
from scipy.signal import savgol_coeffs, savgol_filter

Array = NDArray[np.float64]

RATE_SPAN = 31
"""Samples through which a quartic is put for a measured rate."""
_REACH = 5.0
_SPAN = 11


def derivative(signal: Array, step: float, *, order: int) -> Array:
    """Return a signal, its smoothed rate, or its raw second derivative.

    The rate is that of quartics through :data:`RATE_SPAN` samples (Savitzky and Golay 1964), because dry
    friction asks for its sign: as quiet as a Gaussian of four samples, but true to 3 % up to a fiftieth of
    the sampling rate, where that Gaussian has lost an eighth, and a drag twice as much. The second derivative
    is the central difference: whoever uses it filters it with all other terms.

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
        rate: Array = correlate1d(signal, _rate_kernel(), mode="nearest") / step
        return rate
    second = np.zeros_like(signal)
    second[1:-1] = (signal[2:] - 2.0 * signal[1:-1] + signal[:-2]) / step**2
    return second


def without_rounding(signal: Array) -> Array:
    """Return a motion without most of its rounding: cubics through eleven samples (Savitzky and Golay 1964).

    A motion that is a cubic over eleven samples passes unchanged, so amplitudes and stops keep their place.
    The speed of a straight line between two samples is rounded to one quantum per step; a body that flies
    freely with that speed after a contact takes a wrong course.

    Parameters
    ----------
    signal
        Shape (n,); returned as it is where it is shorter than that.
    """
    if len(signal) < _SPAN:
        return signal
    result: Array = savgol_filter(signal, _SPAN, 3)
    return result


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
        weights = np.convolve(weights, _rate_kernel())
    elif order == 2:
        weights = np.convolve(weights, [1.0, -2.0, 1.0])
    return float(np.sqrt(np.sum(weights**2)))


def rate_noise_gain() -> float:
    """Return the factor from the standard deviation of white noise to that of a measured rate, per sample."""
    return float(np.sqrt(np.sum(_rate_kernel() ** 2)))


def _rate_kernel() -> Array:
    result: Array = savgol_coeffs(RATE_SPAN, 4, deriv=1, use="dot")
    return result


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
