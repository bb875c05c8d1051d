"""How much of the variance of an answer each axis causes, by a method that the points allow.

Three ways, in this order: the whole table of a full grid, exactly; a Saltelli plan, by SALib's Sobol
indices, with totals; any other independent sample, by first-order indices from the data as they are
(SALib's RBD-FAST for numbers, the correlation ratio for words and for numbers of which there are no more than
twenty). What the indices mean rests on independent axes, so axes that depend on each other are refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..foundation.arrays import Array, Mask
from ..foundation.errors import missing_library
from .answer_statistics import codes, dependent_axes
from .axes import SaltelliForm, saltelli_plan
from .sweep_columns import SALTELLI

FEWEST_POINTS: Final = 200
FEWEST_BLOCKS: Final = 16
MOST_FAILED: Final = 0.1
_NO_PLAN: Final = (
    "the points were made by a Saltelli sample and are no whole plan: the sweep is not finished, or the plan "
    "is crossed with other axes; finish it, or sweep the plan alone"
)
_MOST_LEVELS, _DRAWS, _SEED = 20, 100, 1


class SensitivityIndex(NamedTuple):
    """Share of the variance of one answer that one axis causes."""

    axis: str  # its name
    first: float  # share caused by the axis alone; an estimate may lie a little outside 0 to 1
    first_error: float  # half the width of its 95 % interval; zero where it is exact
    # total, total_error: the same with all interactions that the axis takes part in; not a number where the
    # points do not say
    total: float = float("nan")
    total_error: float = float("nan")


@dataclass(frozen=True)
class AnswerSensitivity:
    """Sensitivity of one answer."""

    answer: str  # its name
    method: str  # how the indices were found, as text; empty where they are refused
    points: int  # how many points they rest on
    indices: tuple[SensitivityIndex, ...] = ()  # one per axis that varies, largest first
    remarks: tuple[str, ...] = field(default_factory=tuple)  # conditions under which they hold
    refusal: str = ""  # why there are none; else empty


def sensitivity(
    axes: Mapping[str, NDArray[Any]],
    answers: Mapping[str, Array],
    done: Mask,
    *,
    kinds: Mapping[str, str] | None = None,
) -> list[AnswerSensitivity]:
    """Return how each answer depends on each axis."""
    varying = {name: values for name, values in axes.items() if len(np.unique(codes(values))) > 1}
    plan = saltelli_plan(np.column_stack([codes(v) for v in varying.values()])) if varying else None
    if plan is None and any((kinds or {}).get(name) == SALTELLI for name in varying):
        # Its points belong together in blocks, so methods for independent points do not hold for them.
        return [AnswerSensitivity(name, "", len(done), refusal=_NO_PLAN) for name in answers]
    return [_of_answer(name, varying, values, np.asarray(done, dtype=bool), plan)
            for name, values in answers.items()]  # fmt: skip


def _of_answer(
    name: str,
    axes: Mapping[str, NDArray[Any]],
    values: Array,
    done: Mask,
    plan: SaltelliForm | None,
) -> AnswerSensitivity:
    values = np.asarray(values, dtype=float)
    good = done & np.isfinite(values)
    count, lost = int(np.sum(good)), int(np.sum(~good))

    def refused(reason: str) -> AnswerSensitivity:
        return AnswerSensitivity(name, "", count, refusal=reason)

    if not axes:
        return refused("no axis varies")
    if not count:
        return refused("no point has a finite answer")
    if np.ptp(values[good]) <= 1e-12 * np.max(np.abs(values[good])):
        return refused("the answer is the same at all points")
    if lost > MOST_FAILED * len(values):
        return refused(
            f"{lost} of {len(values)} points have no finite answer; beyond {MOST_FAILED:.0%} what remains "
            "says how the others were lost, not how the answer depends on the axes"
        )
    kept = {axis: column[good] for axis, column in axes.items()}
    remarks = [f"{lost} points without a finite answer are left out"] if lost else []
    # Whether every combination of the values of the axes stands there, and once.
    columns = np.column_stack([codes(values) for values in kept.values()])
    sizes = [len(np.unique(column)) for column in columns.T]
    grid = bool(np.prod(np.array(sizes, dtype=float)) == len(columns)) and len(
        np.unique(columns, axis=0)
    ) == len(columns)
    if grid and not lost:
        method = (
            "exact shares of the variance over all points of the grid, all of the same weight, no interval"
        )
        return AnswerSensitivity(name, method, count, _ordered(_by_grid(kept, values)), tuple(remarks))
    if plan is not None:
        return _by_plan(name, list(axes), values, good, plan)
    if count < FEWEST_POINTS:
        return refused(f"{count} points are too few; {FEWEST_POINTS} are the least without a Saltelli plan")
    tied = dependent_axes(kept)
    if tied:
        return refused(f"{tied}; shares of the variance are defined for independent axes only")
    if any(2 * len(np.unique(codes(column))) < count for column in kept.values() if _smooth(column)):
        remarks.append(
            "axes that were crossed repeat their values; intervals count each point as a draw of its own and "
            "may be too narrow"
        )
    remarks.append("of interactions between axes these indices say nothing but what they leave to one")
    return _from_data(name, kept, values[good], remarks)


def _smooth(column: NDArray[Any]) -> bool:
    """Tell whether an axis holds numbers that are more than levels."""
    return column.dtype.kind == "f" and len(np.unique(column)) > _MOST_LEVELS


def _ordered(indices: Sequence[SensitivityIndex]) -> tuple[SensitivityIndex, ...]:
    return tuple(
        sorted(indices, key=lambda each: -np.nan_to_num(max(each.first, each.total, key=np.nan_to_num)))
    )


def _by_grid(axes: Mapping[str, NDArray[Any]], values: Array) -> list[SensitivityIndex]:
    places = [np.unique(codes(column), return_inverse=True)[1].ravel() for column in axes.values()]
    table = np.full([1 + int(place.max()) for place in places], np.nan)
    table[tuple(places)] = values
    variance = float(np.var(table))
    result = []
    for number, axis in enumerate(axes):
        others = tuple(k for k in range(table.ndim) if k != number)
        first = float(np.var(np.mean(table, axis=others))) / variance
        total = float(np.mean(np.var(table, axis=number))) / variance
        result.append(SensitivityIndex(axis, first, 0.0, total, 0.0))
    return result


def _by_plan(name: str, axes: list[str], values: Array, good: Mask, plan: SaltelliForm) -> AnswerSensitivity:
    """Return Sobol indices of the whole blocks of a Saltelli plan."""
    blocks = good[: plan.blocks * plan.rows].reshape(plan.blocks, plan.rows)
    whole = np.all(blocks, axis=1)
    count, lost = int(np.sum(whole)), int(np.sum(~whole))
    points = count * plan.rows
    if count < FEWEST_BLOCKS:
        return AnswerSensitivity(
            name,
            "",
            points,
            refusal=f"{count} whole blocks of the Saltelli plan are too few; {FEWEST_BLOCKS} are the least",
        )
    if lost > MOST_FAILED * plan.blocks:
        return AnswerSensitivity(
            name, "", points, refusal=f"{lost} of {plan.blocks} blocks of the Saltelli plan have a point "
            f"without a finite answer, more than {MOST_FAILED:.0%}",
        )  # fmt: skip
    answers = values[: plan.blocks * plan.rows].reshape(plan.blocks, plan.rows)[whole].ravel()
    if np.ptp(answers) <= 1e-12 * np.max(np.abs(answers)):
        return AnswerSensitivity(name, "", points, refusal="the answer is the same at all points")
    analyze = _salib("sobol")
    result = analyze(
        _problem(axes), answers, calc_second_order=plan.second_order, num_resamples=_DRAWS, seed=_SEED
    )
    remarks = (
        [f"{lost} of {plan.blocks} blocks with a point without a finite answer are left out whole"]
        if lost
        else []
    )
    indices = [
        SensitivityIndex(axis, *(float(result[key][k]) for key in ("S1", "S1_conf", "ST", "ST_conf")))
        for k, axis in enumerate(axes)
    ]
    method = (
        f"Sobol indices of {count} blocks of a Saltelli plan (SALib), intervals by {_DRAWS} bootstrap draws"
    )
    return AnswerSensitivity(name, method, points, _ordered(indices), tuple(remarks))


def _from_data(
    name: str, axes: Mapping[str, NDArray[Any]], values: Array, remarks: list[str]
) -> AnswerSensitivity:
    smooth = {
        axis: column.astype(float) for axis, column in axes.items()
        if _smooth(column)
    }  # fmt: skip
    indices, methods = [], []
    if smooth:
        result = _salib("rbd_fast")(
            _problem(list(smooth)),
            np.column_stack(list(smooth.values())),
            values,
            num_resamples=_DRAWS,
            seed=_SEED,
        )
        indices += [
            SensitivityIndex(axis, float(result["S1"][k]), float(result["S1_conf"][k]))
            for k, axis in enumerate(smooth)
        ]
        methods.append(
            "first-order indices by RBD-FAST (SALib), intervals by bootstrap draws of half the points"
        )
    steps = {axis: column for axis, column in axes.items() if axis not in smooth}
    for axis, column in steps.items():
        if len(np.unique(codes(column))) > len(values) // 10:
            return AnswerSensitivity(
                name, "", len(values), refusal=f"axis {axis} has fewer than ten points for each of its names"
            )
        groups = np.unique(codes(column), return_inverse=True)[1].ravel()
        random = np.random.default_rng(_SEED)
        drawn = []
        for _ in range(_DRAWS):
            rows = random.integers(len(values), size=len(values))
            drawn.append(_between_groups(groups[rows], values[rows]))
        correlation_ratio = (_between_groups(groups, values), float(1.96 * np.nanstd(drawn, ddof=1)))
        indices.append(SensitivityIndex(axis, *correlation_ratio))
    if steps:
        methods.append(f"correlation ratio for {', '.join(steps)}, intervals by bootstrap")
    return AnswerSensitivity(name, "; ".join(methods), len(values), _ordered(indices), tuple(remarks))


def _between_groups(groups: NDArray[Any], values: Array) -> float:
    sizes = np.bincount(groups)
    present = sizes > 0
    means = np.bincount(groups, weights=values)[present] / sizes[present]
    spread = float(np.sum((values - values.mean()) ** 2))
    between = float(np.sum(sizes[present] * (means - values.mean()) ** 2))
    degrees = len(values) - int(np.sum(present))
    if spread == 0.0 or degrees < 1:
        return float("nan")
    return 1.0 - (spread - between) / degrees / (spread / (len(values) - 1))


def _problem(axes: list[str]) -> dict[str, Any]:
    return {"num_vars": len(axes), "names": axes, "bounds": [[0.0, 1.0]] * len(axes)}


def _salib(method: str) -> Any:
    try:
        from SALib.analyze import rbd_fast, sobol
    except ModuleNotFoundError:
        raise missing_library("the sensitivity of a sweep", "SALib", "sensitivity") from None
    return {"sobol": sobol.analyze, "rbd_fast": rbd_fast.analyze}[method]
