"""How the search for a design is carried out, and what counts as a miss."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...foundation.errors import ValueRangeError, brief
from ..curves.numbers import in_si
from ..statics.contour import Contour
from ..tolerance.monte_carlo import FEWEST_DRAWS, MOST_DRAWS
from .limits import Limit

_LARGEST_ERROR = 0.5
_MOST_STARTS = 10_000


def no_progress() -> None:
    """Report no progress."""


@dataclass(frozen=True, kw_only=True)
class DesignSettings:
    """How the search is carried out, and what counts as a miss.

    Parameters
    ----------
    starts
        Most starting points; the first four are always the same. Six are taken, and six more each time until
        the best design has been found from two of them.
    seed
        Of the starting points after the fourth.
    largest_error
        Rms torque error, relative to the largest torque of the target, above which a design misses it.
    defaults
        Limits that hold unless one of the same kind is asked for; ``None`` for those that follow from the
        declared cable and rubber, see :func:`safe_limits`. Empty for none.
    look_for_size_ranges
        Whether the ranges of sizes that cost nothing are looked for, which takes as long as the design again.
    look_for_remedies
        Whether it is found out, at a miss, what to free.
    draws
        Number of made springs of the tolerance analysis, at least 20; zero for none.
    progress
        Called after each starting point, or after each combination of a stock.
    contour
        To which the cam of the assembly was fitted, where it is known: what limits on the shape of a contour
        that is held are judged by.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range.

    Examples
    --------
    >>> DesignSettings(starts=20, seed=3).largest_error
    0.01
    """

    starts: int = 24
    seed: int = 1
    largest_error: float = 0.01
    defaults: Sequence[Limit] | None = None
    look_for_size_ranges: bool = True
    look_for_remedies: bool = True
    draws: int = 200
    progress: Callable[[], None] = no_progress
    contour: Contour | None = None

    def __post_init__(self) -> None:
        in_si("largest_error", self.largest_error, "1", minimum=1e-6, maximum=1.0)
        if self.largest_error > _LARGEST_ERROR:
            raise ValueRangeError(
                f"largest_error = {self.largest_error:g}",
                f"is {100 * self.largest_error:g} % of the largest torque, which nearly any curve meets",
                next_step=f'write "{self.largest_error:g} %" if per cent were meant; at most 50 %',
            )
        if not 1 <= self.starts <= _MOST_STARTS:
            rule = f"a search has from 1 to {_MOST_STARTS} starting points"
            raise ValueRangeError(f"starts = {self.starts}", rule, next_step="take 4")
        if self.seed < 0:
            raise ValueRangeError(
                f"seed = {self.seed}", "a seed is a whole number from zero on", next_step="take 1"
            )
        if self.draws and not FEWEST_DRAWS <= self.draws <= MOST_DRAWS:
            raise ValueRangeError(
                f"draws = {brief(self.draws)}", f"a tolerance needs {FEWEST_DRAWS} to {MOST_DRAWS} draws",
                next_step="take 200, or 0 for no tolerance",
            )  # fmt: skip
