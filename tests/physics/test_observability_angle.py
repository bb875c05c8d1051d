"""Observability over the angle, against matrices typed by hand and a determinant worked out by SymPy."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from nlsdesign.feedback.analysis import EstimateDeviation, Observability, over_angle
from nlsdesign.feedback.analysis.rest import rest_states
from nlsdesign.model import FlatModel
from nlsdesign.model.linear import linearise
from nlsdesign.model.paper_form import paper_form
from tests import observed as ob

ANGLES = np.radians([-45.0, -1.0, 0.0, 0.2, 1.0, 5.0, 45.0])
NOMINAL = {ob.FORCE: 302.0, ob.EXTENSION: 12e-3, "motor.angle": np.pi / 4.0, "motor.speed": 20.0}


def condition_by_hand(model: FlatModel, angle: float, viscosity: float) -> float:
    at = model.evaluate([angle, 0.0, 0.0])
    extension, arm = at[ob.EXTENSION], at["spring.cam.lever_arm_now"]
    a, c = ob.published_matrices(extension, arm, viscosity)
    # The change of the lever arm with the angle, which the paper leaves out because the angle is measured.
    step = 1e-6
    arms = [model.evaluate([angle + s, 0.0, 0.0])["spring.cam.lever_arm_now"] for s in (-step, step)]
    a[3, 2] = -ob.ELEMENTS * (arms[1] - arms[0]) / (2.0 * step) * ob.equilibrium_force(extension) / ob.INERTIA
    size, time = np.array(list(NOMINAL.values())), 1e-3
    a, c = time * a * size[None, :] / size[:, None], c * size[None, :] / size[[1, 2], None]
    rows = [c @ np.linalg.matrix_power(a, power) for power in range(4)]
    return float(np.linalg.cond(np.vstack(rows)))


@pytest.mark.parametrize("viscosity", [ob.PRINTED, ob.SLOW])
def test_condition_of_the_published_form(viscosity: float) -> None:
    model = ob.bench(viscosity)
    chart = over_angle(
        paper_form(model), [Observability(nominal=NOMINAL)], angles=ANGLES, consistent=ob.CONSISTENT
    )
    for angle, rank, found in zip(
        ANGLES, chart["observability.rank"], chart["observability.condition"], strict=True
    ):
        assert rank == (3 if angle == 0.0 else 4)
        if angle != 0.0:
            assert found == pytest.approx(condition_by_hand(model, angle, viscosity), rel=1e-4), angle
    assert [words for words in chart.words["null vector"] if words] == [ob.FORCE]


def test_determinant_of_the_minimal_form_is_minus_h_over_j() -> None:
    """x = (F_M, θ, ω), y = θ: the determinant of the observability matrix is −N·h/J, whatever the rest is."""
    relaxation, stretch, arm, elements, inertia, damping, tangent = sympy.symbols("r g h N J b kt")
    a = sympy.Matrix(
        [
            [-relaxation, 0, stretch * arm],
            [0, 0, 1],
            [-elements * arm / inertia, -tangent / inertia, -damping / inertia],
        ]
    )
    c = sympy.Matrix([[0, 1, 0]])
    symbolic = sympy.simplify(sympy.Matrix.vstack(c, c * a, c * a * a).det())
    assert sympy.simplify(symbolic**2 - (elements * arm / inertia) ** 2) == 0
    # The order of the states decides the sign; with (F_M, θ, ω) it is minus.
    assert sympy.simplify(symbolic + elements * arm / inertia) == 0

    model = ob.on_relaxing_force(ob.bench(ob.SLOW))
    names = [v.name for v in model.states]
    order = [names.index(n) for n in (ob.RELAXING_FORCE, "motor.angle", "motor.speed")]
    for angle in (-0.7, -0.01, 0.0, 0.01, 0.3, 1.0):
        state = rest_states(model, np.array([angle]))[0]
        linear = linearise(model, list(state))
        a_number, c_number = linear.A[np.ix_(order, order)], linear.C[:1][:, order]
        rows = np.vstack([c_number, c_number @ a_number, c_number @ a_number @ a_number])
        arm_number = model.evaluate(list(state))["spring.cam.lever_arm_now"]
        expected = -ob.ELEMENTS * arm_number / ob.INERTIA
        assert np.linalg.det(rows) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_the_state_that_is_not_seen_at_zero_decays_with_the_relaxation() -> None:
    """At zero angle the force hides, with the eigenvalue −k/η; the angle is measured, its eigenvalue is 0."""
    form = paper_form(ob.bench(ob.SLOW))
    state = rest_states(form, np.zeros(1), consistent=ob.CONSISTENT)[0]
    linear = linearise(form, list(state))
    hidden = np.array([1.0, 0.0, 0.0, 0.0])
    for power in range(4):
        assert not np.any(linear.C @ np.linalg.matrix_power(linear.A, power) @ hidden)
    assert linear.A @ hidden == pytest.approx(-ob.RELAXING / ob.SLOW * hidden)


def deviations(viscosity: float, angles: np.ndarray) -> np.ndarray:
    """Model alone and best, of the relaxing force in N, where the model alone errs by 2 N."""
    process = {
        ob.RELAXING_FORCE: 2.0 * np.sqrt(2.0 * ob.RELAXING / viscosity),
        # A torque of 0.05 N·m that changes from sample to sample.
        "motor.speed": 0.05 / ob.INERTIA * np.sqrt(1e-3),
    }
    view = EstimateDeviation(process=process, measurement={"motor.angle": ob.COUNT / np.sqrt(12.0)})
    model = ob.on_relaxing_force(ob.bench(viscosity))
    chart = over_angle(model, [view], angles=angles)
    arms = np.array([model.evaluate([angle, 0.0, 0.0])["spring.cam.lever_arm_now"] for angle in angles])
    per_force = ob.ELEMENTS * arms
    return np.array([chart["deviation.model"], chart["deviation.best"]]) / per_force


def test_with_the_printed_viscosity_the_current_cannot_improve_the_estimate() -> None:
    alone, best = deviations(ob.PRINTED, np.radians([0.2, 1.0, 5.0, 25.0, 45.0]))
    # At large angles the model alone has the reading error of the angle on top of its 2 N.
    assert alone == pytest.approx(2.0, rel=0.02)
    assert np.all(best > 1.98)


def test_with_a_slow_relaxation_it_can() -> None:
    _, best = deviations(ob.SLOW, np.radians([0.2, 1.0, 5.0, 25.0, 45.0]))
    assert best[0] > 1.95
    assert np.all(np.diff(best) < 0.0)
    assert best[-1] == pytest.approx(1.2, abs=0.05)
