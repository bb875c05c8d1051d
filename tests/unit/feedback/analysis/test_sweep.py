"""Sweeps over the angle: rest states, sizes, the chart."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import Dashpot, Mass, Spring, parallel, series, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.analysis import Chart, Stability, over_angle
from nlsdesign.feedback.analysis.rest import rate_state, rest_states, typical_sizes
from nlsdesign.feedback.analysis.rest_points import RestPoints
from nlsdesign.feedback.analysis.sweep import Columns, View
from nlsdesign.foundation.errors import ArrangementError, ConvergenceError, UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.paper_form import paper_form
from tests import observed as ob

ANGLES = np.radians([-45.0, -5.0, 0.0, 5.0, 45.0])


class Torque(View):
    """The torque at rest and its sign in words."""

    def over(self, points: RestPoints) -> Columns:
        torques = np.array([points.model.evaluate(list(state))["spring.torque"] for state in points.states])
        signs = tuple("pulls" if torque > 0.0 else "pushes or rests" for torque in torques)
        return Columns((Variable("torque", "N*m", "torque at rest"),), torques[:, None], {"sign": signs})


@pytest.fixture(scope="module")
def model() -> FlatModel:
    return ob.bench()


@pytest.fixture(scope="module")
def chart(model: FlatModel) -> Chart:
    return over_angle(model, [Torque(), Stability()], angles=ANGLES)


def test_at_rest_only_the_equilibrium_law_is_left(model: FlatModel, chart: Chart) -> None:
    for angle, torque in zip(chart.at, chart["torque"], strict=True):
        found = model.evaluate([angle, 0.0, 0.0])
        arm, extension = found["spring.cam.lever_arm_now"], found[ob.EXTENSION]
        expected = ob.ELEMENTS * arm * ob.equilibrium_force(extension)
        assert torque == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_rest_states_are_at_rest(model: FlatModel) -> None:
    for state in rest_states(model, ANGLES):
        found = model.evaluate(list(state))
        assert abs(found[f"der({ob.STRAIN})"]) < 1e-6
        assert found["der(motor.angle)"] == 0.0


def test_the_extension_of_the_published_form_follows_the_angle() -> None:
    form = paper_form(ob.bench(ob.SLOW))
    states = rest_states(form, ANGLES, consistent=ob.CONSISTENT)
    names = [v.name for v in form.states]
    for state in states:
        found = form.evaluate(list(state))
        extension = state[names.index(ob.EXTENSION)]
        assert extension == pytest.approx(found[f"{ob.EXTENSION}.geometric"], rel=1e-12, abs=1e-18)
        assert state[names.index(ob.FORCE)] == pytest.approx(
            ob.equilibrium_force(extension), rel=1e-9, abs=1e-9
        )


def test_what_drifts_has_no_rest() -> None:
    creeping = series(spring=Spring(stiffness=100.0), dashpot=Dashpot(damping=3.0))
    law = parallel(spring=Spring(stiffness=50.0), relaxing=creeping)
    held = flatten(assembly("held", mass=Mass(mass=1.0), spring=tie(law, "mass")), outputs=["spring.force"])
    free = assembly("free", mass=Mass(mass=1.0), spring=tie(law, "mass"), far=Mass(mass=1.0))
    (rest,) = rest_states(held, np.array([0.1]), angle="mass.position")
    assert dict(zip([v.name for v in held.states], rest, strict=True)) == pytest.approx(
        {"mass.position": 0.1, "mass.speed": 0.0, "spring.relaxing.dashpot.extension": 0.1}
    )
    drifting = flatten(free, outputs=["spring.force"])
    with pytest.raises(ConvergenceError, match="no rest of its own"):
        rest_states(drifting, np.array([0.1]), angle="mass.position")


def test_sizes_are_those_of_a_jump_and_a_swing(model: FlatModel) -> None:
    sizes = typical_sizes(ob.on_relaxing_force(model), ANGLES)
    end = model.evaluate([ANGLES[-1], 0.0, 0.0])
    assert sizes["motor.angle"] == pytest.approx(ANGLES[-1])
    jump = ob.STIFF * ob.RELAXING * end[ob.EXTENSION]
    assert sizes[ob.RELAXING_FORCE] == pytest.approx(jump, rel=1e-3)
    at_rest = ob.ELEMENTS * end["spring.cam.lever_arm_now"] * ob.equilibrium_force(end[ob.EXTENSION])
    assert sizes["spring.torque"] == pytest.approx(at_rest, rel=1e-6)
    assert sizes["motor.speed"] == pytest.approx(np.sqrt(ANGLES[-1] * at_rest / ob.INERTIA), rel=1e-6)


def test_the_speed_belongs_to_the_angle(model: FlatModel) -> None:
    assert rate_state(model, "motor.angle") == "motor.speed"
    with pytest.raises(ArrangementError, match="not a state"):
        rate_state(model, "motor.speed")
    with pytest.raises(UnknownNameError, match=r"motor\.angle"):
        rate_state(model, "motor.angel")


def test_columns_are_found_by_name(chart: Chart) -> None:
    assert np.array_equal(chart["motor.angle"], ANGLES)
    assert chart.words["sign"] == ("pushes or rests",) * 3 + ("pulls",) * 2
    with pytest.raises(UnknownNameError, match="did you mean 'torque'"):
        chart["torqe"]


def test_a_chart_prints_and_is_written_with_units(chart: Chart, tmp_path: Path) -> None:
    assert str(chart).splitlines()[0].split("  ")[0].strip() == "motor.angle [rad]"
    assert "torque [N·m]" in str(chart).splitlines()[0]
    assert len(str(chart).splitlines()) == 1 + len(ANGLES)
    file = tmp_path / "chart.csv"
    chart.write_csv(file)
    with file.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["motor.angle [rad]"]) for row in rows] == list(ANGLES)
    assert [float(row["torque [N*m]"]) for row in rows] == list(chart["torque"])
    assert [row["sign"] for row in rows] == list(chart.words["sign"])
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("angles", [[], [0.1, np.nan], [[0.1]]])
def test_angles_must_be_a_row_of_numbers(model: FlatModel, angles: list[float]) -> None:
    with pytest.raises(ValueRangeError, match="angles"):
        over_angle(model, [Stability()], angles=angles)


def test_a_missing_output_is_named(model: FlatModel) -> None:
    with pytest.raises(UnknownNameError, match=r"spring\.torque"):
        over_angle(model, [Stability(torque="spring.torqe")], angles=ANGLES)
