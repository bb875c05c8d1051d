"""Tables without a name: against SciPy's splines, work over closed paths, power, and what is held outside."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Driven,
    Element,
    Inertia,
    Part,
    Regularised,
    UnnamedFriction,
    UnnamedSpring,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.physics.table import Row

LOW, HIGH = -0.4, 0.8
ELASTIC, RUB = (0.0, 0.3, -0.2, 0.1, 0.5, 0.4), (0.02, 0.0, 0.1, 0.05, 0.0, 0.03)
TABLE = UnnamedSpring(elastic=ELASTIC, lowest=LOW, highest=HIGH)
STICKING = UnnamedFriction(friction=RUB, lowest=LOW, highest=HIGH)
CREEPING = UnnamedFriction(friction=RUB, lowest=LOW, highest=HIGH, contact=Regularised(creep_speed=0.02))
EXAMPLES: tuple[Part, ...] = (
    TABLE,
    UnnamedSpring(elastic=ELASTIC, lowest=LOW, highest=HIGH, domain=TRANSLATION),
    STICKING,
    CREEPING,
)
ROWS = (
    Row(
        UnnamedSpring,
        "cubic B-spline, held outside",
        ("law", "SciPy's spline"),
        "test_unnamed.py::test_both_tables_are_splines_that_keep_their_ends",
    ),
    Row(
        UnnamedFriction,
        "slowing down",
        ("simulation with stiction", "work of the table = loss of kinetic energy"),
        "test_unnamed.py::test_a_wheel_loses_what_the_table_takes",
    ),
)


def on_shaft(element: Element) -> FlatModel:
    return flatten(assembly("a", shaft=Driven(domain=element.domain), e=tie(element, "shaft")))


def torque(element: Element, angle: float, speed: float) -> float:
    return on_shaft(element).evaluate([], [angle, speed])["e.torque"]


def spline(row: tuple[float, ...], angle: np.ndarray) -> np.ndarray:
    spans = len(row) - 3
    knots = LOW + (HIGH - LOW) / spans * np.arange(-3, spans + 4)
    values: np.ndarray = BSpline(knots, np.array(row), 3)(np.clip(angle, LOW, HIGH - 1e-12))
    return values


def test_both_tables_are_splines_that_keep_their_ends() -> None:
    angles = np.linspace(LOW - 0.5, HIGH + 0.5, 41)
    springs = [torque(TABLE, a, 0.7) for a in angles]
    assert springs == pytest.approx(spline(ELASTIC, angles), abs=1e-9)
    for speed in (3.0, -3.0):
        rubs = [torque(CREEPING, a, speed) for a in angles]
        assert rubs == pytest.approx(np.sign(speed) * spline(RUB, angles), abs=1e-9)


@given(st.floats(-2.0, 2.0), st.floats(-5.0, 5.0), st.lists(st.floats(0.0, 9.0), min_size=4, max_size=9))
def test_friction_without_a_name_only_takes_work(angle: float, speed: float, row: list[float]) -> None:
    part = UnnamedFriction(
        friction=tuple(row), lowest=LOW, highest=HIGH, contact=Regularised(creep_speed=0.02)
    )
    assert torque(part, angle, speed) * speed >= 0.0


def test_a_table_over_the_motion_gives_back_what_it_takes() -> None:
    """Over a closed path through the table and beyond both ends the work is zero."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2001)
    angle = 0.2 + 1.1 * np.sin(turn)
    model = on_shaft(TABLE)
    torques = np.array([model.evaluate([], [a, 0.0])["e.torque"] for a in angle])
    work = np.sum(0.5 * (torques[1:] + torques[:-1]) * np.diff(angle))
    assert abs(work) < 1e-12
    assert np.max(np.abs(torques)) > 0.1


def test_a_wheel_loses_what_the_table_takes() -> None:
    inertia, start = 0.01, 2.5
    made = assembly("a", wheel=Inertia(inertia=inertia), rub=tie(STICKING, "wheel"))
    run = simulate(flatten(made), np.linspace(0.0, 0.3, 601), start={"wheel.speed": start})
    energy = 0.5 * inertia * (start**2 - run["wheel.speed"] ** 2)
    way = np.linspace(0.0, run["wheel.angle"][-1], 20_001)
    level = spline(RUB, way)
    taken = np.sum(0.5 * (level[1:] + level[:-1])) * (way[1] - way[0])
    assert energy[-1] == pytest.approx(taken, rel=1e-6)
    assert run["wheel.speed"][-1] < start - 0.5


def test_a_table_that_is_none_is_refused() -> None:
    with pytest.raises(ValueRangeError, match="at least 4"):
        UnnamedSpring(elastic=(1.0, 2.0), lowest=LOW, highest=HIGH)
    with pytest.raises(ValueRangeError, match="below highest"):
        UnnamedFriction(friction=RUB, lowest=HIGH, highest=LOW, domain=ROTATION)
    with pytest.raises(ValueRangeError, match="friction over the motion"):
        UnnamedFriction(friction=(0.0, -0.1, 0.0, 0.0), lowest=LOW, highest=HIGH)


def test_results_name_the_range_that_is_left() -> None:
    assert TABLE.valid == (LOW, HIGH)
    made = assembly("a", wheel=Inertia(inertia=0.01), rub=tie(STICKING, "wheel"))
    run = simulate(flatten(made), np.linspace(0.0, 0.5, 101), start={"wheel.speed": 4.0})
    assert any(warning.name == "rub.angle" for warning in run.warnings)
