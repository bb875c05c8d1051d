"""Size of tables: as small as a stated torque error allows, after a diagnosis too, met or refused."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import LinearElastic, ViscousMaterial, series
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_c
from nlsdesign.export.compilation.processors import CORTEX_M4F
from nlsdesign.export.compilation.target_run import controller_sizes
from nlsdesign.feedback.observer import (
    FixedGrid,
    GridByTolerance,
    GridByTorqueError,
    ObserverDesign,
    design_observer_with_details,
)
from nlsdesign.feedback.observer.scheduling.scheduled import check_stability, whole_contour
from nlsdesign.feedback.observer.scheduling.table import Entry, FineEntries, linearly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ConvergenceError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity, quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from studies._published import declared_actuator, with_bench_sensors
from tests.selection import quick_only

END = np.radians(65.0)


def fitted(value: float, unit: str) -> Quantity:
    return quantity(value, unit, source="as the diagnosis of the bench records fits it")


def diagnosed() -> FlatModel:
    """The published actuator with the branch that the diagnosis of its bench records adds, at its numbers."""
    branch = series(
        spring=LinearElastic(modulus=fitted(1.7787e6, "Pa")),
        dashpot=ViscousMaterial(viscosity=fitted(1.3962e6, "Pa*s")),
    )
    bench = with_bench_sensors(declared_actuator())
    return flatten(bench.with_part("spring.cable.rubber.second_relaxing", branch))


def of_deck(name: str) -> FlatModel:
    return flatten(declare(load_deck(name)))


MACHINES = {
    "diagnosed": diagnosed,
    **{
        name: (lambda name=name: of_deck(name))
        for name in (
            "austin2015_as_printed", "austin2015_figure_consistent", "austin2015_soft_spring",
            "austin2015_stiff_spring", "test_rig",
        )
    },
}  # fmt: skip


class Designs(dict[str, ObserverDesign]):
    """Each designed when it is first asked for."""

    def __missing__(self, name: str) -> ObserverDesign:
        return self.setdefault(name, design_observer_with_details(MACHINES[name]()))


@pytest.fixture(scope="module")
def designs() -> dict[str, ObserverDesign]:
    return Designs()


def numbers(model: FlatModel) -> int:
    return sum(t.values.size + (0 if t.breakpoints is None else len(t.breakpoints)) for t in model.tables)


@pytest.mark.parametrize("name", quick_only(MACHINES, ["diagnosed"]))
def test_the_default_observer_fits_16_kb_with_its_torque_error_stated(name, designs, tmp_path):
    """The table of the diagnosed deck had 2049 × 7 numbers, 57 kB in float."""
    design = designs[name]
    assert 4 * numbers(design.model) == design.compact.size(4) <= 8000
    source = export_c(design.model, tmp_path, real="float", name="observer")
    _, added = controller_sizes(source, CORTEX_M4F, tmp_path)
    assert design.compact.size(4) < added.flash <= 16000
    error = design.table_torque_error
    assert error.rms <= error.largest <= 2e-4 * error.full_scale


def exact_torque(design: ObserverDesign, angles: np.ndarray) -> np.ndarray:
    """The estimate with the exact matrices at each angle: s⁺ = Φ(θ)ζ + γ₀(θ), ζ = s + γ₁(θ), T = t·ζ + t₀."""
    matrices, plant = design.step.matrices(angles), design.step.plant
    inner = len(plant.states) - 2
    assert not np.any(matrices["estimate"][:, 0, inner : inner + 2])
    start = design.start(float(angles[0]))
    memory = np.array([start[f"{v.name}.memory"] for v in plant.states[:inner]])
    torque = np.zeros(len(angles))
    for k in range(len(angles)):
        state = memory + matrices["prior"][k, :inner, 0]
        torque[k] = matrices["estimate"][k, 0, :inner] @ state + matrices["estimate"][k, 0, inner + 2]
        memory = matrices["next"][k, :inner, :inner] @ state + matrices["next"][k, :inner, inner + 2]
    return torque


def other_motions(end: float) -> list[np.ndarray]:
    """Motions that the table was not made with: a chirp, a random walk of counts, a swing off the middle."""
    time = 1e-3 * np.arange(1500)
    walk = np.cumsum(np.random.default_rng(8).normal(0.0, 0.02, len(time)))
    count = 2.0 * np.pi / 8192.0
    return [
        end * np.sin(2.0 * np.pi * (0.3 + 3.0 * time) * time),
        np.clip(np.round(walk / count) * count, -end, end),
        0.4 * end + 0.57 * end * np.sin(2.0 * np.pi * 1.7 * time + 0.4),
        0.02 * end * np.sin(2.0 * np.pi * 6.0 * time),
    ]


@pytest.mark.parametrize(
    "name",
    ["diagnosed", *(pytest.param(n, marks=pytest.mark.slow) for n in ("austin2015_as_printed", "test_rig"))],
)
def test_other_motions_find_the_torque_error_that_is_stated(name, designs):
    """Reference: the equations of the observer, with matrices computed at every single angle."""
    design = designs[name]
    angle, stated = design.step.plant.angle, design.table_torque_error
    largest = 0.0
    for angles in other_motions(float(design.compact.angles[-1])):
        start = design.start(float(angles[0]))
        run = simulate(design.model, 1e-3 * np.arange(len(angles)), inputs={angle: angles}, start=start)
        off = run[design.step.plant.estimate.name] - exact_torque(design, angles)
        largest = max(largest, float(np.max(np.abs(off))))
    assert 0.2 * stated.largest < largest < 1.3 * stated.largest


@pytest.mark.slow
def test_the_error_keeps_what_is_asked_and_the_table_is_not_much_finer():
    model = of_deck("austin2015_figure_consistent")
    sizes = []
    for asked in (1e-3, 10e-3, 100e-3):
        design = design_observer_with_details(model, grid=GridByTorqueError(-END, END, torque_error=asked))
        assert design.table_torque_error.largest <= asked
        if asked < 0.1:
            assert design.table_torque_error.largest > 0.3 * asked
        sizes.append(design.compact.size(4))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[2] < sizes[0] / 3


# Quicker: test_a_table_within_size_and_error_is_taken in unit/cli/test_flash.py
@pytest.mark.slow
def test_a_size_is_met_by_a_coarser_table_that_says_what_it_costs(designs):
    usual = designs["diagnosed"]
    design = design_observer_with_details(diagnosed(), grid=GridByTorqueError(-END, END, most_bytes=1500))
    assert design.compact.size(4) <= 1500 < usual.compact.size(4)
    assert usual.table_torque_error.largest < design.table_torque_error.largest
    assert f"at most {design.table_torque_error.largest:.2g} N·m" in str(design)


@pytest.mark.slow
def test_a_size_that_cannot_be_met_is_refused_with_its_cost_and_the_smallest():
    model = of_deck("austin2015_figure_consistent")
    for grid, words in (
        (
            GridByTorqueError(-END, END, torque_error=1e-3, most_bytes=600),
            "it would cost 0.0.* N·m, more than",
        ),
        (GridByTorqueError(-END, END, most_bytes=8), "no table is that small"),
    ):
        with pytest.raises(ConvergenceError, match=words) as refused:
            design_observer_with_details(model, grid=grid)
        least = int(str(refused.value).split("smallest found that keeps this has ")[1].split(" B")[0])
        allowed = GridByTorqueError(-END, END, torque_error=grid.torque_error, most_bytes=least)
        assert design_observer_with_details(model, grid=allowed).compact.size(4) <= least


@pytest.mark.parametrize("wrong", [{"torque_error": 0.0}, {"torque_error": -1.0}, {"most_bytes": 0}])
def test_nonsense_budgets_are_refused(wrong):
    with pytest.raises(ValueRangeError, match="must be positive"):
        GridByTorqueError(**wrong)


def test_a_grid_by_torque_error_needs_an_observer():
    with pytest.raises(ValueRangeError, match="needs the observer whose torque counts"):
        GridByTorqueError().compact(lambda angles: [Entry("a", "sum", "a", "1", angles, 1.0)])


def test_breakpoints_stand_where_a_function_bends_and_on_both_sides_of_a_jump():
    def entries(angles: np.ndarray) -> list[Entry]:
        bent = np.abs(angles - 0.3) + np.where(angles > -0.4, 1.0, 0.0)
        return [Entry("bent", "sum", "bent", "1", bent, 1.0)]

    fine = FineEntries.of(entries, -1.0, 1.0, 1e-4)
    table = fine.placed(np.array([1e-3])).with_breakpoints()
    assert len(table.angles) <= 8
    assert np.min(np.abs(table.angles - 0.3)) < 2e-3
    left, right = table.angles[table.angles < -0.4], table.angles[table.angles >= -0.4]
    assert right[0] - left[-1] < 3e-4
    angles = np.linspace(-1.0, 1.0, 4001)
    away = np.abs(angles + 0.4) > 3e-4
    read = linearly(table.angles, table.values, angles)[0]
    assert np.max(np.abs(read - entries(angles)[0].values)[away]) <= 1.05e-3


def test_a_straight_function_needs_two_points_and_no_search(designs):
    table = designs["austin2015_soft_spring"].compact
    assert table.uniform or len(table.angles) == 2
    assert table.size(4) <= 36


def test_the_cascade_is_stable_between_breakpoints(designs):
    found = check_stability(designs["austin2015_as_printed"].model)
    assert found.proved_inner
    assert found.worst[1] < 1.0


@pytest.mark.slow
def test_a_fixed_grid_says_its_torque_error_too():
    model = of_deck("austin2015_as_printed")
    ends = whole_contour(model)
    coarse, old = (
        design_observer_with_details(model, grid=grid).table_torque_error
        for grid in (FixedGrid(ends.lower, ends.upper, 33), GridByTolerance(ends.lower, ends.upper))
    )
    assert coarse.largest > 3.0 * old.largest
