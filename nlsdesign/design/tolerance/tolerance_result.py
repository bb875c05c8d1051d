"""What a tolerance analysis gives back: quantiles, causes, trims, and what to do first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.csv_tables import Axis, data_frame
from ...foundation.quantity import parse_unit, with_unit
from ...foundation.written_numbers import prefixed, shared_prefix, without_power
from ..curves.target import Target
from .causes import Cause

SHARES = (0.5, 0.9, 0.95)
"""Shares of the made springs for which the largest error is stated."""
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class QuantileEstimate:
    """The error that a share of the made springs stays below, from a number of draws."""

    share: float
    value: float  # in N·m
    # lower, upper: ends of its 95 % confidence interval in N·m, by order statistics, for any distribution;
    # infinite above where there are too few draws to tell
    lower: float
    upper: float

    def __str__(self) -> str:
        factor, unit = shared_prefix([self.value], "N*m")
        low, value, high = (without_power(factor * each, 4) for each in (self.lower, self.value, self.upper))
        return f"{100 * self.share:g} % below {value} {unit} rms ({low} to {high} with 95 % confidence)"


def quantile(errors: Array, share: float) -> QuantileEstimate:
    """Return a quantile of independent draws with its confidence interval.

    The number of draws below the true quantile is binomial, whatever the distribution, so two of the ordered
    draws enclose it.
    """
    ordered, count = np.sort(errors), len(errors)
    fewer = scipy.special.bdtr(np.arange(count + 1), count, share)
    below, above = np.searchsorted(fewer, [(1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2])
    lower = ordered[below - 1] if below >= 1 else 0.0
    upper = ordered[above] if above < count else np.inf
    return QuantileEstimate(share, float(np.quantile(errors, share)), float(lower), float(upper))


@dataclass(frozen=True)
class CauseEffect:
    """What one cause does to the torque error."""

    cause: Cause  # what deviates
    # share, share_after_trim: its part of the variance of the torque that all causes together have to first
    # order, as built and after the best trim
    share: float
    share_after_trim: float
    alone: float  # 95 % quantile of the rms error in N·m if nothing else deviated; as built
    # halved, measured: 95 % quantile if its deviation were half as large, and if it were known before the cam
    # is made; as built
    halved: float
    measured: float
    # halved_after_trim, measured_after_trim: the same after the best trim
    halved_after_trim: float
    measured_after_trim: float


@dataclass(frozen=True, eq=False)
class TrimEffect:
    """What a trim after assembly recovers."""

    # name, unit: of the number that is set, and the unit in which it is shown
    name: str
    unit: str
    quantiles: tuple[QuantileEstimate, ...]  # of the rms error after the trim
    errors: Array  # rms error of each draw after the trim, shape (draws,), in N·m
    settings: Array  # the number as set in each draw, shape (draws,), in SI
    band: Array  # torque below which 5, 50 and 95 % of the springs lie, shape (3, angles), in N·m

    @property
    def needed(self) -> tuple[float, float]:
        """Range in SI within which 95 % of the springs are set."""
        low, high = np.quantile(self.settings, [0.025, 0.975])
        return float(low), float(high)

    def __str__(self) -> str:
        factor = parse_unit(self.unit).factor
        ends = " to ".join(
            f"{round(end / factor, 9) + 0.0:.4g}" for end in self.needed
        )  # no rounding of zero
        return f"trim of {self.name}: {self.quantiles[-1]}, set from {with_unit(ends, self.unit)}"


@dataclass(frozen=True, eq=False)
class ToleranceResult:
    """What the spreads do to the torque of a spring; immutable.

    Parameters
    ----------
    target
        Torque curve that was asked for.
    angles, nominal
        Angles in rad and torque at rest without deviations in N·m, shape (n,) each.
    nominal_rms
        Rms error without deviations in N·m, over both strokes where guides have friction.
    errors
        Rms error of each draw as built, shape (draws,), in N·m.
    quantiles
        Of these errors for 50, 90 and 95 %.
    band
        Torque below which 5, 50 and 95 % of the springs lie as built, shape (3, n), in N·m.
    causes
        By falling share.
    trims
        The best first; empty where nothing can be trimmed.
    without_effect
        Names of numbers with a spread that do not change the torque at rest.
    held
        In how many draws a number was held at the end of its range.
    seed
        Of the draws.
    over_time
        On what creep and set are counted, or what is stated of neither, in sentences.
    """

    target: Target
    angles: Array
    nominal: Array
    nominal_rms: float
    errors: Array
    quantiles: tuple[QuantileEstimate, ...]
    band: Array
    causes: tuple[CauseEffect, ...]
    trims: tuple[TrimEffect, ...]
    without_effect: tuple[str, ...]
    held: int
    seed: int
    over_time: tuple[str, ...] = ()

    @property
    def worst(self) -> float:
        """Largest rms error of all draws as built, in N·m."""
        return float(np.max(self.errors))

    @property
    def trim_first(self) -> str | None:
        """Name of the number whose trim recovers most; None where nothing can be trimmed or no trim helps."""
        best = self.trims[0] if self.trims else None
        helps = best is not None and best.quantiles[-1].value < self.quantiles[-1].value
        return best.name if best is not None and helps else None

    @property
    def tighten_first(self) -> str | None:
        """Name of the cause whose halving lowers the 95 % quantile most, after the best trim if any."""
        trimmed = bool(self.trims)
        return _least(self.causes, [c.halved_after_trim if trimmed else c.halved for c in self.causes])

    @property
    def measure_first(self) -> str | None:
        """Name of the cause whose knowledge before the cam is made lowers that quantile most."""
        trimmed = bool(self.trims)
        return _least(self.causes, [c.measured_after_trim if trimmed else c.measured for c in self.causes])

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the causes whose deviation is assumed."""
        return tuple(each.cause.name for each in self.causes if each.cause.assumed)

    def rows(self) -> list[tuple[str, str]]:
        """Return a summary: pairs of text."""
        rows = [("nominal", f"{prefixed(self.nominal_rms, digits=4)} rms")]
        rows += [("as built", str(each)) for each in self.quantiles]
        rows.append(
            (
                "worst",
                f"{prefixed(self.worst, digits=4)} rms of {len(self.errors)} draws, seed {self.seed}",
            )
        )
        rows += [(f"trim {k + 1}", str(each)) for k, each in enumerate(self.trims)]
        named = (
            ("trim first", self.trim_first),
            ("tighten first", self.tighten_first),
            ("measure first", self.measure_first),
            ("without effect", ", ".join(self.without_effect)),
        )
        rows += [(what, name) for what, name in named if name]
        rows += [("over time", sentence) for sentence in self.over_time]
        if self.held:
            rows.append(("held", f"a number was held at the end of its range in {self.held} draws"))
        return rows

    def to_frames(self) -> dict[str, Any]:
        """Return ``pandas.DataFrame`` objects by name, in SI; needs pandas.

        ``causes`` has one row for each cause, ``draws`` the rms torque error of each draw as built and after
        each trim, ``band`` the torque without deviations and those that 5, 50 and 95 % of the springs lie
        below, over the angle.
        """
        figures = ("share", "share_after_trim", "alone", "halved", "measured", "halved_after_trim",
                   "measured_after_trim")  # fmt: skip
        causes = {"cause": [each.cause.name for each in self.causes]}
        causes |= {name: [getattr(each, name) for each in self.causes] for name in figures}
        draws = {"as_built": self.errors} | {trim.name: trim.errors for trim in self.trims}
        band = {"nominal": self.nominal} | dict(zip(("p05", "p50", "p95"), self.band, strict=True))
        return {
            "causes": data_frame(causes, units=dict.fromkeys(figures[2:], "N*m")),
            "draws": data_frame(draws, units=dict.fromkeys(draws, "N*m")),
            "band": data_frame(
                band, units=dict.fromkeys(band, "N*m"), index=Axis("angle", "rad", self.angles)
            ),
        }

    def table(self) -> list[tuple[str, ...]]:
        """Return the causes as rows of text under a head: shares in %, 95 % quantiles in `shown_in`."""
        head = ("cause", "±", "share", "alone", "halved", "known", "share", "halved", "known")
        factor, _ = self._prefix()
        return [head, *(_cells(each, factor) for each in self.causes)]

    @property
    def shown_in(self) -> str:
        """Unit in which :meth:`table` shows quantiles."""
        return self._prefix()[1]

    def _prefix(self) -> tuple[float, str]:
        return shared_prefix([size for each in self.causes for size in _sizes(each)], "N*m")

    def __str__(self) -> str:
        rows, table = self.rows(), self.table()
        width = max(len(name) for name, _ in rows)
        lines = ["tolerance", *(f"  {name:<{width}}  {text}" for name, text in rows)]
        sizes = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
        lines.append(
            f"  causes: share of the variance in %, 95 % quantile in {self.shown_in} rms; as built, after "
            "the trim"
        )
        for row in table:
            cells = [
                row[0].ljust(sizes[0]),
                *(cell.rjust(n) for cell, n in zip(row[1:], sizes[1:], strict=True)),
            ]
            lines.append("    " + "  ".join(cells))
        reasons: dict[str, list[str]] = {}
        for each in self.causes:
            reasons.setdefault(each.cause.source, []).append(each.cause.name)
        lines += [f"    {source} ({', '.join(names)})" for source, names in reasons.items()]
        return "\n".join(lines)


def _sizes(each: CauseEffect) -> tuple[float, ...]:
    """Return the quantiles of a cause in N·m: three as built, two after the trim."""
    return each.alone, each.halved, each.measured, each.halved_after_trim, each.measured_after_trim


def _cells(each: CauseEffect, factor: float) -> tuple[str, ...]:
    sizes = [without_power(factor * size, 4) for size in _sizes(each)]
    built, left = (_per_cent(each.share), *sizes[:3]), (_per_cent(each.share_after_trim), *sizes[3:])
    return each.cause.name, each.cause.size, *built, *left


def _per_cent(share: float) -> str:
    return f"{100 * share:.1f}"


def _least(causes: Sequence[CauseEffect], values: Sequence[float]) -> str | None:
    return causes[int(np.argmin(values))].cause.name if causes else None
