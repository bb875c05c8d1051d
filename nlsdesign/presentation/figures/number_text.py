"""Numbers as text for people: significant digits, powers of ten, superscripts."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def root_mean_square(values: ArrayLike) -> float:
    """Return the root of the mean square of all finite values."""
    return float(np.sqrt(np.nanmean(np.square(np.asarray(values, dtype=float)))))


def significant(value: float, digits: int = 3) -> str:
    """Return a number with the given number of significant digits, typeset.

    Examples
    --------
    >>> significant(0.012345), significant(1234.5), significant(-3.4e-9, 2), significant(0.0)
    ('0.0123', '1230', '−3.4·10⁻⁹', '0')
    """
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else "∞" if value > 0 else "−∞"
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    if not -4 <= exponent < 6:
        text = f"{value / 10.0**exponent:.{digits - 1}f}·10{superscript(exponent)}"
    else:
        text = f"{round(value, digits - 1 - exponent):.{max(0, digits - 1 - exponent)}f}"
    return text.replace("-", "−")


def compact(value: float, digits: int = 4) -> str:
    """Return a number as :func:`significant` does, without zeros at its end.

    Parameters
    ----------
    value
        Any number.
    digits
        Largest number of significant digits.

    Examples
    --------
    >>> compact(0.25), compact(12.0), compact(2e-9), compact(1200.0)
    ('0.25', '12', '2·10⁻⁹', '1200')
    """
    mantissa, dot, power = significant(value, digits).partition("·")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return mantissa + dot + power


def superscript(number: int) -> str:
    """Return an integer in superscript digits."""
    return str(number).translate(_SUPERSCRIPTS)
