"""Tolerance analysis: draws of made springs, shares of the causes to first order, trims after assembly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.work_sharing import parallel_map
from ...model import FlatModel, flatten
from ...model.roles import series_cam
from ..curves.target import Target
from ..statics.equilibrium import with_smooth_cables
from .causes import NumberCause, SpreadRules, draw_deviations, shown_unit, spring_causes
from .lasting import lasting_causes
from .made_spring import MadeSpring, made_spring
from .tolerance_result import SHARES, CauseEffect, QuantileEstimate, ToleranceResult, TrimEffect, quantile
from .trimming import Trim, Trimmed, trimmed

_ANGLES = 101
FEWEST_DRAWS, MOST_DRAWS = 20, 100_000
_SMALL = 0.01
"""Share of the variance below which a cause counts to first order where less of it is asked for."""
_NODES, _STRATA = 41, 800
_BAND = (0.05, 0.5, 0.95)

_Built = tuple[tuple[Array, Array], Array]


class _BestTrim(NamedTuple):
    """The trim with the least 95 % quantile: its column in the spring, its range and what it gives."""

    column: int
    ends: tuple[float, float]
    result: Trimmed


def tolerance_analysis(
    spring: FlatModel | Assembly,
    *,
    target: Target,
    name: str | None = None,
    draws: int = 1000,
    seed: int = 0,
    rules: SpreadRules | None = None,
    trims: Sequence[Trim] | None = None,
) -> ToleranceResult:
    """Return what the spreads of all numbers do to the torque of a cam spring at rest, and what helps.

    The made cam has a fixed contour: its errors, another anchor and another cable move the point of contact.
    Friction of guides counts on both strokes. Elements that share the torque are alike, as from one sheet.
    Deviations stop at the range of a number and where the anchor would touch the cam.

    Parameters
    ----------
    spring
        The actuator; where it is declared, cables that go slack take their smooth form, which is quicker.
    target
        Torque curve.
    name
        Path of the cam spring; decided from the structure if it is left out.
    draws
        Number of made springs, at least 20.
    seed
        Of the draws; the same seed gives the same springs, also for another design with the same names.
    rules
        How declared spreads become deviations; by default the moduli of a piece deviate together.
    trims
        What may be set after assembly; by default the pretension. Each is tried alone.

    Returns
    -------
    ToleranceResult
        Quantiles, shares of the causes, and trims.

    Raises
    ------
    UnknownNameError
        If a name does not exist.
    ArrangementError
        If the structure does not say which spring is meant, or a trim does not change the torque.
    ValueRangeError
        If the number of draws or the seed is out of range.
    UnitError
        If a spread or a range is given in a unit of something else.
    ConvergenceError
        If the point of contact is not found.

    Examples
    --------
    >>> from nlsdesign import declare, load_deck
    >>> from nlsdesign.design import PowerTorque
    >>> actuator = declare(load_deck("austin2015_figure_consistent"))
    >>> curve = PowerTorque(coefficient=4.35, exponent=2.09, angle=0.87)
    >>> tolerance_analysis(actuator, target=curve, draws=20).trim_first
    'spring.pretension'
    """
    _checked("draws", draws, FEWEST_DRAWS, MOST_DRAWS)
    _checked("seed", seed, 0, 2**63)
    model = flatten(with_smooth_cables(spring)) if isinstance(spring, Assembly) else spring
    rules, cam = rules or SpreadRules(), series_cam(model, name)
    chosen = [Trim(cam.pretension)] if trims is None else list(trims)
    columns = [trim.column(model, cam) for trim in chosen]
    lasting, sentences = lasting_causes(model, name, np.linspace(0.0, target.last_angle, _ANGLES))
    everything = (*spring_causes(model, name, rules), *lasting, *(column for column, _ in columns))
    made = made_spring(model, name, target=target, causes=everything, angles=_ANGLES)
    ranges = [(trim.name, ends) for trim, (_, ends) in zip(chosen, columns, strict=True)]
    # The last causes of these springs are the trims.
    causes = made.causes[: len(made.causes) - len(ranges)]
    largest = np.max(np.abs(made.sensitivities), axis=1, initial=0.0)
    acting = [k for k in range(len(causes)) if largest[k] > 1e-9 * target.largest]
    deviations = np.zeros((draws, len(made.causes)))
    deviations[:, acting] = draw_deviations([causes[k] for k in acting], draws, seed=seed)
    touched = made.contour.deviating(made.causes, deviations)
    torques = made.torques(deviations, touched)
    errors = made.rms(torques)
    tried, best = _tried(made, deviations, touched, ranges)
    effects = _effects(made, _WithLess(made, deviations, (touched, torques), best), acting)
    return ToleranceResult(
        target=target,
        angles=made.angles,
        nominal=_mean_of_strokes(made, made.nominal[None, :])[0],
        nominal_rms=float(made.rms(made.nominal[None, :])[0]),
        errors=errors,
        quantiles=_quantiles(errors),
        band=_band(made, torques),
        causes=tuple(sorted(effects, key=lambda each: -each.share)),
        trims=tuple(sorted(tried, key=lambda each: each.quantiles[-1].value)),
        without_effect=tuple(cause.name for k, cause in enumerate(causes) if k not in acting),
        held=made.held(deviations),
        seed=seed,
        over_time=sentences,
    )


def _checked(what: str, given: int, least: int, most: int) -> None:
    if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
        raise ValueRangeError(
            f"{what} = {given}", f"must be a whole number from {least} to {most}",
            next_step=f"give for instance {what}={max(least, 1000 if what == 'draws' else 0)}",
        )  # fmt: skip


def _quantiles(errors: Array) -> tuple[QuantileEstimate, ...]:
    return tuple(quantile(errors, share) for share in SHARES)


def _mean_of_strokes(made: MadeSpring, torques: Array) -> Array:
    if not made.rubs:
        return torques
    half = torques.shape[1] // 2
    return (torques[:, :half] + torques[:, half:]) / 2


def _band(made: MadeSpring, torques: Array) -> Array:
    """Return the band of the torque; of two strokes it reaches from the lower to the upper."""
    half = torques.shape[1] // (2 if made.rubs else 1)
    low, high = torques[:, -half:], torques[:, :half]
    return np.array(
        [
            np.quantile(low, _BAND[0], axis=0),
            np.quantile(_mean_of_strokes(made, torques), _BAND[1], axis=0),
            np.quantile(high, _BAND[2], axis=0),
        ]
    )


def _tried(
    made: MadeSpring,
    deviations: Array,
    touched: tuple[Array, Array],
    trims: Sequence[tuple[str, tuple[float, float]]],
) -> tuple[list[TrimEffect], _BestTrim | None]:
    """Return the effect of each trim, and the best."""
    effects: list[TrimEffect] = []
    best: _BestTrim | None = None
    least, first = np.inf, len(made.causes) - len(trims)
    for column, (name, ends) in enumerate(trims, start=first):
        result = trimmed(made, deviations, column=column, ends=ends, touched=touched)
        unit = shown_unit(made.causes[column].unit)
        band = _band(made, result.torques)
        effects.append(TrimEffect(name, unit, _quantiles(result.rms), result.rms, result.settings, band))
        if effects[-1].quantiles[-1].value < least:
            least, best = effects[-1].quantiles[-1].value, _BestTrim(column, ends, result)
    return effects, best


class _WithLess:
    """The 95 % quantiles if a cause deviated less, as built and trimmed anew, in N·m.

    Of small causes only the part of first order is taken off.
    """

    def __init__(self, made: MadeSpring, deviations: Array, built: _Built, best: _BestTrim | None) -> None:
        self.made, self.deviations, self.best = made, deviations, best
        self.touched, torques = built
        self.torques = (torques, torques if best is None else best.result.torques)

    def small(self, rows: tuple[Array, Array], column: int, share: float) -> tuple[float, float]:
        """Return the quantiles for a cause that does little, from its rows as built and after the trim."""
        off = share * self.deviations[:, column, None]
        pairs = zip(self.torques, rows, strict=True)
        return self._quantiles(*(torques - off * row for torques, row in pairs))

    def __call__(self, column: int, share: float) -> tuple[float, float]:
        made, less = self.made, self.deviations.copy()
        less[:, column] *= 1.0 - share
        of_cam = not isinstance(made.causes[column], NumberCause)
        touched = made.contour.deviating(made.causes, less) if of_cam else self.touched
        built, best = made.torques(less, touched), self.best
        if best is None:
            return self._quantiles(built, built)
        after = trimmed(made, less, column=best.column, ends=best.ends, touched=touched, start=best.result)
        return self._quantiles(built, after.torques)

    def _quantiles(self, *torques: Array) -> tuple[float, float]:
        built, after = (float(np.quantile(self.made.rms(each), SHARES[-1])) for each in torques)
        return built, after


def _effects(made: MadeSpring, with_less: _WithLess, acting: Sequence[int]) -> list[CauseEffect]:
    rows = made.sensitivities
    best = with_less.best
    left = rows
    if best is not None:
        # Without their part along the trim, in the mean over angle and stroke.
        trim = rows[best.column]
        along = (rows * trim) @ made.weights / (trim**2 @ made.weights)
        left = rows - along[:, None] * trim
    sizes, sizes_left = ((part[list(acting)] ** 2 @ made.weights) for part in (rows, left))
    totals = [float(np.sum(each)) or 1.0 for each in (sizes, sizes_left)]

    def effect(place: int) -> CauseEffect:
        k, size, size_left = acting[place], float(sizes[place]), float(sizes_left[place])
        shares = size / totals[0], size_left / totals[1]
        if max(shares) < _SMALL:
            halved, measured = (with_less.small((rows[k], left[k]), k, part) for part in (0.5, 1.0))
        else:
            halved, measured = (with_less(k, part) for part in (0.5, 1.0))
        # The 95 % quantile for one cause, from evenly spaced shares of its distribution.
        normal = scipy.special.ndtri((np.arange(_STRATA) + 0.5) / _STRATA)
        places = made.causes[k].spread.deviate(normal)
        nodes = np.linspace(places[0], places[-1], _NODES)
        deviations = np.zeros((_NODES, len(made.causes)))
        deviations[:, k] = nodes
        errors = made.rms(scipy.interpolate.CubicSpline(nodes, made.torques(deviations))(places))
        return CauseEffect(
            cause=made.causes[k],
            share=shares[0],
            share_after_trim=shares[1],
            alone=float(np.quantile(errors, SHARES[-1])),
            halved=halved[0],
            measured=measured[0],
            halved_after_trim=halved[1],
            measured_after_trim=measured[1],
        )

    return list(parallel_map(effect, len(acting)))
