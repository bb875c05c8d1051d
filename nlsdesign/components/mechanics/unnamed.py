"""Efforts without a name: tables over the motion, taken from bench records; no law, but passive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, with_unit
from ...foundation.symbolic import Expression, uniform_spline
from ..core.contacts import WithFriction
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Element, Range, Scope
from ..core.part_numbers import one_of, parameter

LEAST = 4
"""Control values of a cubic spline of one span."""


@dataclass(frozen=True, kw_only=True)
class _Tabled(Element):
    """Base of tables over the motion with a range."""

    picture: ClassVar[str] = "box"

    domain: Domain = one_of(ROTATION, TRANSLATION)
    lowest: Quantity = parameter("{motion}", "motion at which the table begins", minimum=-1e6, maximum=1e6)
    highest: Quantity = parameter("{motion}", "motion at which the table ends", minimum=-1e6, maximum=1e6)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lowest.number >= self.highest.number:
            low, high = (with_unit(f"{q.number:g}", q.unit) for q in (self.lowest, self.highest))
            raise ValueRangeError(f"lowest = {low}", f"must lie below highest = {high}")

    @property
    def valid(self) -> Range:
        """Where the records have shown it."""
        return self.lowest.number, self.highest.number

    def _table(self, scope: Scope, name: str, motion: Expression) -> Expression:
        # A uniform cubic B-spline on [lowest, highest], which keeps its end values outside of it.
        row = scope.row(name)
        lowest = scope.parameter("lowest")
        highest = scope.parameter("highest")
        inside = ca.fmin(ca.fmax(motion, lowest), highest)
        return uniform_spline(row, 0.0, (highest - lowest) / (len(row) - 3), inside - lowest)


def _check_count(name: str, row: Quantity) -> None:
    if len(row.values) < LEAST:
        raise ValueRangeError(
            f"{name} with {len(row.values)} control values", f"a cubic spline needs at least {LEAST}"
        )


@dataclass(frozen=True, kw_only=True)
class UnnamedSpring(_Tabled):
    """A remainder without a name that depends on the motion alone: T = E(θ), or F = E(e).

    E is a uniform cubic B-spline on [``lowest``, ``highest``]; outside of it the end values are held. It is
    no law of nature and says nothing beyond its range; as a function of one motion it has a potential, so it
    stores work and gives it back. Source: definition (what was measured, as a table).

    Raises
    ------
    ValueRangeError
        If there are fewer than four control values, or the range is empty.

    Examples
    --------
    >>> part = UnnamedSpring(elastic=(0.0, 0.0, 0.1, 0.1), lowest=-0.5, highest=0.5)
    >>> part.valid
    (-0.5, 0.5)
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"unnamed effort"})

    elastic: Quantity = parameter(
        "{effort}", "control values of the effort over the motion", minimum=-1e9, maximum=1e9, row=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_count("elastic", self.elastic)

    @property
    def needs_rate(self) -> bool:
        """False: it knows the motion alone."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return E."""
        return self._table(scope, "elastic", motion)


@dataclass(frozen=True, kw_only=True)
class UnnamedFriction(WithFriction, _Tabled):
    """A remainder without a name that acts against the motion: T = D(θ)·sgn(ω), |T| ≤ D(θ) while ω = 0.

    D is a uniform cubic B-spline on [``lowest``, ``highest``] with control values ≥ 0, so D ≥ 0 and T·ω ≥ 0:
    it only takes work. Outside of its range the end values are held. With
    ``contact=Regularised(creep_speed=...)`` tanh(ω/ω_s) stands for the sign. It is no law of nature and says
    nothing beyond its range. Source: definition (what was measured, as a table).

    Raises
    ------
    ValueRangeError
        If there are fewer than four control values, or the range is empty.
    """

    picture: ClassVar[str] = "friction"
    phenomena: ClassVar[frozenset[str]] = frozenset({"unnamed friction"})

    friction: Quantity = parameter(
        "{effort}", "control values of the friction over the motion", minimum=0.0, maximum=1e9, row=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_count("friction", self.friction)

    @property
    def dissipates(self) -> bool:
        """True: nothing is stored."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        level = self._table(scope, "friction", motion)
        return self.rubbing.against(scope, rate, lambda speed: level, level)
