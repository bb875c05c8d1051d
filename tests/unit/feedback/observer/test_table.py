"""Tables: what becomes a number, what shares a column, and an error that is what it says."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.feedback.observer import FixedGrid, GridByTolerance
from nlsdesign.feedback.observer.scheduling.table import ColumnPlace, Compact, Entry, Grid, compacted
from nlsdesign.foundation.errors import ConvergenceError, ValueRangeError


def entry(key: str, values: np.ndarray, *, row: str = "sum", weight: float = 1.0) -> Entry:
    return Entry(key, row, key, "1", values, weight)


def smooth(angles: np.ndarray) -> list[Entry]:
    return [
        entry("wave", np.sin(3.0 * angles)),
        entry("half", 0.5 * np.sin(3.0 * angles), row="other"),
        entry("number", np.full(len(angles), 7.0)),
        entry("nothing", np.zeros(len(angles))),
        entry("small", 1e-12 * angles),
    ]


def read(compact: Compact, key: str, angle: float) -> float:
    place = compact.places[key]
    if place.column is None:
        return place.factor
    return place.factor * float(np.interp(angle, compact.angles, compact.values[:, place.column]))


@pytest.mark.parametrize(
    "grid", [GridByTolerance(-1.0, 1.0, tolerance=1e-3), FixedGrid(-1.0, 1.0, points=101)]
)
def test_only_what_changes_costs_a_column(grid: Grid) -> None:
    compact = grid.compact(smooth)
    assert [column.key for column in compact.columns] == ["wave"]
    assert compact.places["wave"] == ColumnPlace(1.0, 0)
    assert compact.places["half"].column == 0
    assert compact.places["half"].factor == pytest.approx(0.5)
    assert compact.places["number"] == ColumnPlace(7.0)
    assert compact.places["nothing"] == ColumnPlace(0.0)
    assert compact.places["small"] == ColumnPlace(0.0)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_the_error_keeps_its_bound_everywhere(tolerance: float) -> None:
    compact = GridByTolerance(-1.0, 1.0, tolerance=tolerance, angle_tolerance=0.0).compact(smooth)
    angles = np.linspace(-1.0, 1.0, 7919)
    off = max(abs(read(compact, "wave", a) - np.sin(3.0 * a)) for a in angles)
    assert off <= compact.error["sum"] * 1.05 <= 1.05 * tolerance
    # and it is not much better than asked for: the grid is the coarsest of its kind
    assert off > tolerance / 16.0


def test_errors_of_one_sum_add_up() -> None:
    def two(angles: np.ndarray) -> list[Entry]:
        return [entry("a", np.sin(3.0 * angles)), entry("b", np.cos(5.0 * angles), weight=2.0)]

    compact = FixedGrid(-1.0, 1.0, points=21).compact(two)
    single = [
        FixedGrid(-1.0, 1.0, points=21).compact(lambda a, i=i: [two(a)[i]]).error["sum"] for i in (0, 1)
    ]
    assert compact.error["sum"] == pytest.approx(sum(single))


def test_a_jump_counts_as_exact_within_the_angle_tolerance() -> None:
    def jump(angles: np.ndarray) -> list[Entry]:
        return [entry("jump", np.tanh(angles / 1e-4))]

    with pytest.raises(ConvergenceError, match="'sum' is off by"):
        GridByTolerance(-1.0, 1.0, tolerance=1e-3, angle_tolerance=0.0, most_points=1025).compact(jump)
    compact = GridByTolerance(-1.0, 1.0, tolerance=1e-3, angle_tolerance=2e-3, most_points=1025).compact(jump)
    for angle in np.linspace(-5e-3, 5e-3, 41):
        low, high = np.tanh((angle - 2.1e-3) / 1e-4), np.tanh((angle + 2.1e-3) / 1e-4)
        assert low - 1e-3 <= read(compact, "jump", angle) <= high + 1e-3


def test_what_is_not_finite_makes_no_table() -> None:
    with pytest.raises(ConvergenceError, match="not finite"):
        FixedGrid().compact(lambda angles: [entry("bad", np.where(angles > 0.5, np.nan, angles))])


@pytest.mark.parametrize(
    "make",
    [
        lambda: GridByTolerance(1.0, -1.0),
        lambda: GridByTolerance(-1.0, np.inf),
        lambda: GridByTolerance(tolerance=0.0),
        lambda: FixedGrid(points=1),
    ],
)
def test_settings_out_of_range(make: object) -> None:
    with pytest.raises(ValueRangeError):
        make()


@pytest.mark.parametrize(("share", "columns"), [(0.9, 0), (1.1, 1)])
def test_a_tenth_of_the_tolerance_may_be_spent_on_a_literal(share: float, columns: int) -> None:
    def nearly_constant(angles: np.ndarray) -> list[Entry]:
        return [entry("number", 7.0 + share * 1e-4 * angles)]

    compact = GridByTolerance(-1.0, 1.0, tolerance=1e-3).compact(nearly_constant)
    assert len(compact.columns) == columns


def test_every_angle_within_the_angle_tolerance_is_looked_at() -> None:
    """Read is a ramp over four cells up to a spike of one: it is exact as soon as the spike is in reach."""
    angles = np.linspace(-1.0, 1.0, 17)
    spike = [entry("spike", np.where(np.arange(17) == 8, 1.0, 0.0))]
    cell = angles[1] - angles[0]
    errors = [
        compacted(angles, spike, every=4, tolerance=0.0, angle_error=cells * cell).error["sum"]
        for cells in (0.0, 1.0, 2.0, 3.5)
    ]
    assert errors == pytest.approx([0.75, 0.5, 0.25, 0.0])
