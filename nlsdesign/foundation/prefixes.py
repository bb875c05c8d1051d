"""Errors as people read them: with the prefix of the unit that leaves no power of ten."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .quantity import typeset_unit

_PREFIXES = ((1e3, 1e-3, "k"), (1.0, 1.0, ""))


def shared_prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor by which numbers of one table or line are shown, and their unit, typeset.

    ``values``: in SI; the largest decides, below one it is shown in thousandths.

    Examples
    --------
    >>> shared_prefix([0.002, 0.4], "N*m"), shared_prefix([0.4, -3.99], "N*m")
    ((1000.0, 'mN·m'), (1.0, 'N·m'))
    """
    sizes = (abs(float(f"{value:.3g}")) for value in values if math.isfinite(value))
    largest = max(sizes, default=0.0)
    for least, factor, prefix in _PREFIXES:
        if largest >= least:
            return factor, prefix + typeset_unit(unit)
    return 1e3, "m" + typeset_unit(unit)


def prefixed(value: float, unit: str = "N*m", *, digits: int = 3) -> str:
    """Return a number with the prefix that fits it.

    ``unit``: without a prefix; a torque if none is given.

    Examples
    --------
    >>> prefixed(3.99), prefixed(0.0123), prefixed(0.9999), prefixed(346.0, "N", digits=2)
    ('3.99 N·m', '12.3 mN·m', '1 N·m', '350 N')
    """
    factor, shown = shared_prefix([value], unit)
    return f"{without_power(factor * value, digits)} {shown}"


def without_power(value: float, digits: int = 3) -> str:
    """Return a number with significant digits, and zeros in place of a power of ten.

    Examples
    --------
    >>> without_power(3987.0), without_power(0.01234), without_power(2.5e7, 2)
    ('3990', '0.0123', '25000000')
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text else text
