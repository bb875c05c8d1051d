"""How far the true number may lie from the declared one: read here, and the same for everything that asks.

A fit, a diagnosis, an observer, a tolerance analysis, a sweep and a calibration all take a declared number as
``spread.number(value, x)``, where x is normal with zero mean and the standard deviation ``spread.deviation``.

| in a deck | class | the number at x | deviation of x |
| --- | --- | --- | --- |
| ``spread = 0.1`` | ``RelativeSpread`` | value·exp(x) | ln(1 + 0.1) |
| ``spread = "2 N*m"`` | ``NormalSpread`` | value + (2 N·m)·x | 1 |
| ``range = [1.0, 3.0]`` | ``UniformSpread`` | middle + half width·(2Φ(x) − 1) | 1 |

So a relative spread is a factor, which never changes the sign of a number; a spread with a unit may.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Self

from .errors import ValueRangeError

if TYPE_CHECKING:
    from .arrays import Array


@dataclass(frozen=True)
class Spread(ABC):
    """Base of what a deck states about the error of a number; each form has one number of its own."""

    fourth_moment = 3.0
    """Mean of the fourth power of ``deviate``, to first order: 3 of a normal distribution."""

    @property
    def deviation(self) -> float:
        """Standard deviation of the coordinate x; zero for a number that is known exactly."""
        return 1.0

    @abstractmethod
    def number(self, value: float, x: Array) -> Array:
        """Return the number in SI at coordinates of any shape; zero gives the declared number."""

    @abstractmethod
    def slope(self, value: float) -> float:
        """Return the derivative of the number with respect to x at the declared number, in SI."""

    def expression(self, value: float, x: Any) -> Any:
        """Return the number at a symbolic coordinate, for what takes derivatives with respect to it."""
        return value + self.slope(value) * x

    def deviate(self, normal: Array) -> Array:
        """Return how far numbers are from the declared one, in standard deviations, from normal ones."""
        result: Array = self.number(0.0, normal) / self.slope(0.0)
        return result

    def narrowed(self, share: float) -> Spread:
        """Return the spread of a number of which measurements have left a share of the deviation of x."""
        return NormalSpread(share * self.slope(0.0)) if share > 0.0 else EXACT

    def times(self, factor: float) -> Self:
        """Return the spread of the number times a factor above zero."""
        return replace(self, **{f.name: factor * getattr(self, f.name) for f in fields(self)})

    @abstractmethod
    def text(self, shown: Callable[[float], str]) -> str:
        """Return the spread as people read it, ``± 10 %`` or ``± 2 N·m``; nothing for an exact number.

        ``shown``: writes a number in SI with the unit in which the declared number is shown.
        """

    def data(self, shown: Callable[[float], str]) -> float | str:
        """Return what stands in a file of data: the number of a relative spread, else the text."""
        return self.text(shown)

    def standard_error(self, value: float) -> float:
        """Return the standard deviation of the number in SI, to first order."""
        return abs(self.slope(value)) * self.deviation

    def share(self, value: float) -> float:
        """Return the standard deviation relative to the number; infinite for one around zero."""
        return self.standard_error(value) / abs(value) if value else math.inf

    def __bool__(self) -> bool:
        return self.deviation > 0.0


@dataclass(frozen=True)
class RelativeSpread(Spread):
    """A factor of 1 + relative for each standard deviation, upwards and downwards.

    Parameters
    ----------
    relative
        At least zero, without a unit: 0.1 for ± 10 %.
    """

    relative: float

    def __post_init__(self) -> None:
        if not self.relative >= 0.0:
            rule = "a relative spread is a number >= 0, 0.06 for 6 %"
            raise ValueRangeError(f"spread {self.relative}", rule)

    @property
    def deviation(self) -> float:
        """ln(1 + s)."""
        return math.log1p(self.relative)

    def number(self, value: float, x: Array) -> Array:
        """Return value·exp(x)."""
        import numpy as np

        result: Array = value * np.exp(x)
        return result

    def slope(self, value: float) -> float:
        """Return the number itself."""
        return value

    def expression(self, value: float, x: Any) -> Any:
        """Return value·exp(x)."""
        import casadi as ca

        return value * ca.exp(x)

    def deviate(self, normal: Array) -> Array:
        """Return (exp(x) − 1)/ln(1 + s)."""
        import numpy as np

        result: Array = np.expm1(self.deviation * normal) / self.deviation if self else 0.0 * normal
        return result

    def narrowed(self, share: float) -> RelativeSpread:
        """Return (1 + s)^share − 1."""
        return RelativeSpread(math.expm1(share * self.deviation))

    def times(self, factor: float) -> RelativeSpread:
        """Return the same share."""
        return self

    def text(self, shown: Callable[[float], str]) -> str:
        """Return per cent."""
        return f"± {100 * self.relative:.6g} %" if self else ""

    def data(self, shown: Callable[[float], str]) -> float:
        """Return s."""
        return self.relative

    def share(self, value: float) -> float:
        """Return s as it is declared."""
        return self.relative


@dataclass(frozen=True)
class NormalSpread(Spread):
    """A normal distribution around the declared number, which may be zero.

    Parameters
    ----------
    size
        Standard deviation in SI.
    """

    size: float

    def __post_init__(self) -> None:
        _check("standard deviation", self.size)

    def number(self, value: float, x: Array) -> Array:
        """Return value + size·x."""
        result: Array = value + self.size * x
        return result

    def slope(self, value: float) -> float:
        """Return the standard deviation."""
        return self.size

    def text(self, shown: Callable[[float], str]) -> str:
        """Return the standard deviation in the unit of the number."""
        return f"± {shown(self.size)}"


@dataclass(frozen=True)
class UniformSpread(Spread):
    """Each number of a range is as likely; the declared number is its middle.

    What looks at small deviations only takes a normal distribution with the same standard deviation,
    half_width/√3. Source: JCGM 2008, 4.3.7 (the standard deviation is the half width over √3).

    Parameters
    ----------
    half_width
        Of the range, in SI.

    Raises
    ------
    ValueRangeError
        If it is not above zero, or not finite.
    """

    half_width: float
    fourth_moment = 1.8

    def __post_init__(self) -> None:
        _check("half width of a range", self.half_width)

    def number(self, value: float, x: Array) -> Array:
        """Return value + half_width·(2Φ(x) − 1)."""
        from scipy.special import erf

        result: Array = value + self.half_width * erf(x / math.sqrt(2.0))
        return result

    def slope(self, value: float) -> float:
        """Return half_width/√3: of the straight line with the same standard deviation."""
        return self.half_width / math.sqrt(3.0)

    def narrowed(self, share: float) -> Spread:
        """Return the range itself while nothing was learned, and a normal distribution afterwards."""
        return self if share >= 1.0 else super().narrowed(share)

    def text(self, shown: Callable[[float], str]) -> str:
        """Return the half width in the unit of the number."""
        return f"within ± {shown(self.half_width)}"


def _check(what: str, size: float) -> None:
    """Refuse a size that is no size; several forms state one."""
    if not 0.0 < size < math.inf:
        raise ValueRangeError(
            f"{what} {size}",
            "is above zero and finite",
            next_step="leave the spread out for a number that is known exactly",
        )


EXACT = RelativeSpread(0.0)
"""Of a number that is taken as exactly known."""


def as_spread(given: Spread | float) -> Spread:
    """Return a spread; a bare number is a relative one."""
    return given if isinstance(given, Spread) else RelativeSpread(float(given))
