"""Zero-phase filters and derivatives of sampled signals; one and the same filter for every term.

Widths are in seconds, so that the same motion sampled twice as fast passes the same filter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from ...foundation.arrays import Array, Mask

_REACH = 5.0
_NARROW = 0.3
"""Standard deviation in samples below which a Gaussian leaves the samples as they are."""
_DEGREE, _POINTS = 8, 9
"""Degree and points of the polynomial through the nearest samples, whose derivatives are those of central
differences of eighth order: true to 0.1 % at six samples a period."""
_LEAST_POINTS = 13
"""Points from which a quartic is quieter than that, over the same time."""
_BLUR_REACH = 2.0
"""Spans to each side of a sample in which it has a part in what the span of a rate takes."""
_ROUNDING_SHARE = 0.35
"""Of the span of a rate, the span over which rounding is removed from a motion."""


def derivative(signal: Array, step: float, *, order: int, span: float = 0.0) -> Array:
    """Return a signal, its smoothed rate, or its unsmoothed second derivative.

    The rate is that of quartics through all samples of the span (Savitzky and Golay 1964), because dry
    friction asks for its sign: as quiet as a Gaussian of an eighth of that width, but true to 3 % up to 0.6
    periods per span, where that Gaussian has lost an eighth, and a drag twice as much. Where a span has too
    few samples for that, and for the second derivative, central differences of eighth order are taken:
    whoever uses the latter filters it with all other terms.

    ``span``: time in s over which a rate is taken; zero for that between neighbours.
    """
    if order == 0:
        return signal
    weights = difference(order, span / step)
    half = len(weights) // 2
    if order == 1 and _POINTS < len(weights) <= len(signal):
        # Near the ends the quartic through the first or last samples goes on.
        smooth: Array = scipy.signal.savgol_filter(
            signal, len(weights), 4, deriv=1, delta=step, mode="interp"
        )
        return smooth
    beyond = min(half, len(signal) - 1)
    longer = np.pad(signal, beyond, mode="reflect", reflect_type="odd")
    whole = scipy.ndimage.correlate1d(longer, weights[::-1], mode="nearest")
    result: Array = whole[beyond : beyond + len(signal)]
    if order == 2:
        result[:half] = 0.0
        result[len(result) - half :] = 0.0
    return result / step**order


def blurred(signal: Array, step: float, *, span: float) -> Array:
    """Return what a span takes from the rate of a signal: that between neighbours less that over the span.

    Where the span has too few samples for quartics, the rate over it is the one on a finer clock, on which a
    record may be read, see :mod:`.equation_error.evidence`.
    """
    times = max(1, math.ceil(_LEAST_POINTS * step / span))
    finer = signal
    if times > 1:
        clock = np.arange((len(signal) - 1) * times + 1) / times
        finer = scipy.interpolate.make_interp_spline(clock[::times], signal, k=5)(clock)
    over: Array = derivative(finer, step / times, order=1, span=span)[::times]
    return derivative(signal, step, order=1) - over


def blur_weights(width: float, step: float, span: float) -> Array:
    """Return the weights of the samples of a signal in what a span takes from its rate, behind a filter."""
    one = np.zeros(2 * math.ceil(_BLUR_REACH * span / step) + 1)
    one[len(one) // 2] = 1.0
    weights: Array = np.convolve(kernel(width / step), blurred(one, step, span=span))
    return weights


def smoothed(signal: Array, step: float, *, order: int, span: float) -> Array:
    """Return a signal or its derivative by quartics through all samples of a span (Savitzky and Golay 1964).

    ``span``: time in s; where it has too few samples nothing is smoothed.
    """
    points = 2 * round(0.5 * (span / step - 1.0)) + 1
    if not _LEAST_POINTS <= points <= len(signal):
        return derivative(signal, step, order=order)
    smooth: Array = scipy.signal.savgol_filter(signal, points, 4, deriv=order, delta=step, mode="interp")
    return smooth


@lru_cache(maxsize=64)
def difference(order: int, span: float = 0.0) -> Array:
    """Return the weights of a derivative per sample, to be convolved with a signal.

    ``span``: in samples; only rates are smoothed.
    """
    points = 2 * round(0.5 * (span - 1.0)) + 1 if order == 1 else 0
    if order == 0:
        result: Array = np.ones(1)
    elif points >= _LEAST_POINTS:
        result = scipy.signal.savgol_coeffs(points, 4, deriv=order)
    else:
        result = scipy.signal.savgol_coeffs(_POINTS, _DEGREE, deriv=order)
    result.flags.writeable = False
    return result


def without_rounding(signal: Array, step: float, span: float) -> Array:
    """Return a motion without most of its rounding: cubics through neighbours (Savitzky and Golay 1964).

    A motion that is a cubic over a third of the span passes unchanged, so amplitudes and stops keep their
    place. The speed of a straight line between two samples is rounded to one quantum per step; a body that
    flies freely with that speed after a contact takes a wrong course.

    ``signal``: shape (n,); returned as it is where so much time has less than five samples.
    """
    points = 2 * round(0.5 * (_ROUNDING_SHARE * span / step - 1.0)) + 1
    if not 5 <= points <= len(signal):
        return signal
    result: Array = scipy.signal.savgol_filter(signal, points, 3)
    return result


def kernel(width: float) -> Array:
    """Return a Gaussian of unit sum over whole samples.

    ``width``: standard deviation in samples; far below one sample nothing is filtered.
    """
    if width < _NARROW:
        return np.ones(1)
    reach = int(np.ceil(_REACH * width))
    at = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (at / width) ** 2)
    result: Array = weights / weights.sum()
    return result


def filter_weights(width: float, order: int, step: float, span: float = 0.0) -> Array:
    """Return the weights of derivative and filter together, to be convolved with a signal."""
    result: Array = np.convolve(kernel(width / step), difference(order, span / step)) / step**order
    return result


@dataclass(frozen=True, eq=False)
class Smoothing:
    """A filter that keeps one sample of several: ``smoothing @ signal`` are its rows.

    Only its weights are kept, so that it takes no memory beside its rows, however long the record.
    """

    count: int  # number of samples that it filters
    weights: Array  # to be convolved with the samples around the middle of a row, of odd number
    stride: int  # samples from one row to the next, before rows were left out
    # places: index of the sample in the middle of each row; every one is the first plus a multiple of the
    # stride
    places: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of samples."""
        return len(self.places), self.count

    def __matmul__(self, signal: Array) -> Array:
        """Return the rows of a signal, shape (n,) or (n, columns)."""
        if not len(self.places):
            return np.zeros((0, *signal.shape[1:]))
        if len(self.weights) == 1:
            result: Array = self.weights[0] * signal[self.places]
            return result
        # SciPy convolves for the samples that are kept alone: those that are a multiple of the stride behind
        # the first. So that the rows are, as many zeros stand before the signal as that takes.
        reach = len(self.weights) - 1
        first, behind = int(self.places[0]) - reach // 2, int(self.places[-1]) + reach // 2 + 1
        missing = -reach % self.stride
        longer = np.concatenate([np.zeros((missing, *signal.shape[1:])), signal[first:behind]])
        every_row = scipy.signal.upfirdn(self.weights, longer, 1, self.stride, axis=0)
        rows: Array = every_row[(self.places - self.places[0] + reach + missing) // self.stride]
        return rows

    def touched_by(self, mask: Mask) -> Mask:
        """Tell for each row whether a sample of a mask is among those that it is made of."""
        reach, count = len(self.weights) // 2, np.concatenate([[0], np.cumsum(mask)])
        touched: Mask = count[self.places + reach + 1] > count[self.places - reach]
        return touched

    def __getitem__(self, rows: NDArray[np.int64] | Mask | slice) -> Smoothing:
        """Return the filter with some of its rows."""
        return replace(self, places=self.places[rows])


def smoothing(n: int, width: float, stride: int, *, margin: int = 0) -> Smoothing:
    """Return the filter of n samples that keeps every ``stride``-th; near the ends nothing is kept."""
    weights = kernel(width)
    reach = len(weights) // 2 + margin
    return Smoothing(n, weights, stride, np.arange(reach, n - reach, stride))


def every(n: int, stride: int) -> Smoothing:
    """Return what keeps every ``stride``-th of n samples as it is."""
    return Smoothing(n, np.ones(1), stride, np.arange(0, n, stride))


def filtered(signal: Array, weights: Array, stride: int) -> Array:
    """Return every ``stride``-th sample of a filtered signal, where the filter finds all samples it needs."""
    reach = len(weights) // 2
    places = np.arange(reach, len(signal) - reach, stride)
    return Smoothing(len(signal), weights, stride, places) @ signal
