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
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .errors import ValueRangeError

if TYPE_CHECKING:
    from .arrays import Array


@dataclass(frozen=True)
class Spread(ABC):
    """Base of what a deck states about the error of a number."""

    @property
    @abstractmethod
    def deviation(self) -> float:
        """Standard deviation of the coordinate x; zero for a number that is known exactly."""

    @abstractmethod
    def number(self, value: float, x: Array) -> Array:
        """Return the number at a coordinate.

        Parameters
        ----------
        value
            Declared number in SI.
        x
            Any shape; zero gives the declared number.

        Returns
        -------
        numpy.ndarray
            In SI, of the shape of ``x``.
        """

    @abstractmethod
    def expression(self, value: float, x: Any) -> Any:
        """Return the number at a symbolic coordinate, for what takes derivatives with respect to it.

        Parameters
        ----------
        value
            Declared number in SI.
        x
            CasADi expression.
        """

    @abstractmethod
    def slope(self, value: float) -> float:
        """Return the derivative of the number with respect to x at the declared number, in SI.

        Parameters
        ----------
        value
            Declared number in SI.
        """

    @abstractmethod
    def deviate(self, normal: Array) -> Array:
        """Return how far the number is from the declared one, in units of its standard deviation.

        Parameters
        ----------
        normal
            Standard normal numbers, any shape.

        Returns
        -------
        numpy.ndarray
            Without a unit, of the shape of ``normal``: (number − value)/(slope·deviation).
        """

    @property
    @abstractmethod
    def fourth_moment(self) -> float:
        """Mean of the fourth power of ``deviate``, to first order: 3 of a normal distribution."""

    @abstractmethod
    def times(self, factor: float) -> Spread:
        """Return the spread of the number times a factor.

        Parameters
        ----------
        factor
            Above zero.
        """

    @abstractmethod
    def narrowed(self, share: float) -> Spread:
        """Return the spread of a number of which measurements have left a share of the deviation of x.

        Parameters
        ----------
        share
            At least zero.
        """

    @abstractmethod
    def rounded(self, digits: int) -> Spread:
        """Return the spread with so many significant digits.

        Parameters
        ----------
        digits
            At least one.
        """

    @abstractmethod
    def text(self, shown: Callable[[float], str]) -> str:
        """Return the spread as people read it, ``± 10 %`` or ``± 2 N·m``; nothing for an exact number.

        Parameters
        ----------
        shown
            Writes a number in SI with the unit in which the declared number is shown.
        """

    def data(self, shown: Callable[[float], str]) -> float | str:
        """Return what stands in a file of data: the number of a relative spread, else the text.

        Parameters
        ----------
        shown
            As for ``text``.
        """
        return self.text(shown)

    def standard_error(self, value: float) -> float:
        """Return the standard deviation of the number in SI, to first order.

        Parameters
        ----------
        value
            Declared number in SI.
        """
        return abs(self.slope(value)) * self.deviation

    def share(self, value: float) -> float:
        """Return the standard deviation relative to the number; infinite for one around zero.

        Parameters
        ----------
        value
            Declared number in SI.
        """
        if not self:
            return 0.0
        return self.standard_error(value) / abs(value) if value else math.inf

    def __bool__(self) -> bool:
        """Tell whether the number is anything but exact."""
        return self.deviation > 0.0


@dataclass(frozen=True)
class RelativeSpread(Spread):
    """A factor of 1 + relative for each standard deviation, upwards and downwards.

    Parameters
    ----------
    relative
        At least zero, without a unit: 0.1 for ± 10 %.

    Raises
    ------
    ValueRangeError
        If it is negative or not a number.
    """

    relative: float

    def __post_init__(self) -> None:
        if not self.relative >= 0.0:
            raise ValueRangeError(
                f"spread {self.relative}", "a relative spread is a number >= 0, 0.06 for 6 %"
            )

    @property
    def deviation(self) -> float:
        """ln(1 + s)."""
        return math.log1p(self.relative)

    def number(self, value: float, x: Array) -> Array:
        """Return value·exp(x)."""
        import numpy as np

        result: Array = value * np.exp(x)
        return result

    def expression(self, value: float, x: Any) -> Any:
        """Return value·exp(x)."""
        import casadi as ca

        return value * ca.exp(x)

    def slope(self, value: float) -> float:
        """Return the number itself."""
        return value

    def deviate(self, normal: Array) -> Array:
        """Return (exp(x) − 1)/ln(1 + s)."""
        import numpy as np

        result: Array = np.expm1(self.deviation * normal) / self.deviation if self else 0.0 * normal
        return result

    @property
    def fourth_moment(self) -> float:
        """3."""
        return 3.0

    def times(self, factor: float) -> RelativeSpread:
        """Return the same share."""
        return self

    def narrowed(self, share: float) -> RelativeSpread:
        """Return (1 + s)^share − 1."""
        return RelativeSpread(math.expm1(share * self.deviation))

    def share(self, value: float) -> float:
        """Return s as it is declared."""
        return self.relative

    def rounded(self, digits: int) -> RelativeSpread:
        """Return s rounded."""
        return RelativeSpread(float(f"{self.relative:.{digits}g}"))

    def data(self, shown: Callable[[float], str]) -> float:
        """Return s."""
        return self.relative

    def text(self, shown: Callable[[float], str]) -> str:
        """Return per cent."""
        return f"± {100 * self.relative:.6g} %" if self else ""


@dataclass(frozen=True)
class NormalSpread(Spread):
    """A normal distribution around the declared number, which may be zero.

    Parameters
    ----------
    size
        Standard deviation in SI.

    Raises
    ------
    ValueRangeError
        If it is not above zero, or not finite.
    """

    size: float

    def __post_init__(self) -> None:
        if not 0.0 < self.size < math.inf:
            raise ValueRangeError(
                f"spread {self.size} with a unit",
                "a standard deviation is above zero and finite",
                next_step="leave the spread out for a number that is known exactly",
            )

    @property
    def deviation(self) -> float:
        """1."""
        return 1.0

    def number(self, value: float, x: Array) -> Array:
        """Return value + size·x."""
        result: Array = value + self.size * x
        return result

    def expression(self, value: float, x: Any) -> Any:
        """Return value + size·x."""
        return value + self.size * x

    def slope(self, value: float) -> float:
        """Return the standard deviation."""
        return self.size

    def deviate(self, normal: Array) -> Array:
        """Return the normal numbers themselves."""
        return normal

    @property
    def fourth_moment(self) -> float:
        """3."""
        return 3.0

    def times(self, factor: float) -> NormalSpread:
        """Return the size times the factor."""
        return NormalSpread(factor * self.size)

    def narrowed(self, share: float) -> Spread:
        """Return a normal distribution of that share of the size."""
        return NormalSpread(share * self.size) if share > 0.0 else EXACT

    def rounded(self, digits: int) -> NormalSpread:
        """Return the size rounded."""
        return NormalSpread(float(f"{self.size:.{digits}g}"))

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

    def __post_init__(self) -> None:
        if not 0.0 < self.half_width < math.inf:
            raise ValueRangeError(
                f"range of half width {self.half_width}", "a range ends above where it begins"
            )

    @property
    def deviation(self) -> float:
        """1."""
        return 1.0

    def number(self, value: float, x: Array) -> Array:
        """Return value + half_width·(2Φ(x) − 1)."""
        from scipy.special import erf

        result: Array = value + self.half_width * erf(x / math.sqrt(2.0))
        return result

    def expression(self, value: float, x: Any) -> Any:
        """Return value + half_width/√3·x, the straight line with the same standard deviation."""
        return value + self.slope(value) * x

    def slope(self, value: float) -> float:
        """Return half_width/√3: of the straight line with the same standard deviation."""
        return self.half_width / math.sqrt(3.0)

    def deviate(self, normal: Array) -> Array:
        """Return √3·(2Φ(x) − 1), between −√3 and √3."""
        from scipy.special import erf

        result: Array = math.sqrt(3.0) * erf(normal / math.sqrt(2.0))
        return result

    @property
    def fourth_moment(self) -> float:
        """9/5."""
        return 1.8

    def times(self, factor: float) -> UniformSpread:
        """Return the half width times the factor."""
        return UniformSpread(factor * self.half_width)

    def narrowed(self, share: float) -> Spread:
        """Return the range itself while nothing was learned, and a normal distribution afterwards."""
        if share >= 1.0:
            return self
        return NormalSpread(share * self.slope(0.0)) if share > 0.0 else EXACT

    def rounded(self, digits: int) -> UniformSpread:
        """Return the half width rounded."""
        return UniformSpread(float(f"{self.half_width:.{digits}g}"))

    def text(self, shown: Callable[[float], str]) -> str:
        """Return the half width in the unit of the number."""
        return f"within ± {shown(self.half_width)}"


EXACT = RelativeSpread(0.0)
"""Of a number that is taken as exactly known."""


def as_spread(given: Spread | float) -> Spread:
    """Return a spread; a bare number is a relative one."""
    return given if isinstance(given, Spread) else RelativeSpread(float(given))
