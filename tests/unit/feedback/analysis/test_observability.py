"""Rank, Gramian and Kalman deviation on systems small enough to know the answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from nlsdesign.components import ROTATION, Dashpot, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.analysis import EstimateDeviation, Observability, over_angle
from nlsdesign.feedback.analysis.kalman import discrete_noise, steady_state_kalman
from nlsdesign.foundation.errors import ConvergenceError, UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, flatten

INERTIA, STIFF, DAMPING = 2e-3, 5.0, 0.04


@pytest.fixture(scope="module")
def swing() -> FlatModel:
    parts = {
        "motor": Inertia(inertia=INERTIA),
        "spring": tie(Spring(stiffness=STIFF, domain=ROTATION), "motor"),
        "bearing": tie(Dashpot(damping=DAMPING, domain=ROTATION), "motor"),
    }
    return flatten(assembly("swing", **parts), outputs=["motor.angle", "spring.torque"])


def matrices(scale: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    a = np.array([[0.0, 1.0], [-STIFF / INERTIA, -DAMPING / INERTIA]])
    return time * a * scale[None, :] / scale[:, None], np.array([[1.0, 0.0]])


def test_angle_alone_shows_angle_and_speed(swing: FlatModel) -> None:
    nominal = {"motor.angle": 0.5, "motor.speed": 20.0}
    view = Observability(nominal=nominal, time_scale=2e-3, horizon=0.05, measured=("motor.angle",))
    chart = over_angle(swing, [view], angles=[0.0])
    a, c = matrices(np.array([0.5, 20.0]), 2e-3)
    singular = np.linalg.svd(np.vstack([c, c @ a]), compute_uv=False)
    assert chart["observability.rank"][0] == 2
    assert chart["observability.condition"][0] == pytest.approx(singular[0] / singular[1])
    assert chart["observability.smallest"][0] == pytest.approx(singular[1])
    assert chart.words["null vector"] == ("",)
    a, c = matrices(np.array([0.5, 20.0]), 1.0)
    gramian = quad_vec(lambda t: expm(a.T * t) @ c.T @ c @ expm(a * t), 0.0, 0.05, epsrel=1e-10)[0]
    least, most = np.linalg.eigvalsh(gramian)
    assert chart["gramian.smallest"][0] == pytest.approx(least, rel=1e-6)
    assert chart["gramian.condition"][0] == pytest.approx(most / least, rel=1e-6)


def test_what_is_not_seen_is_named() -> None:
    parts = {
        "motor": Inertia(inertia=INERTIA),
        "bearing": tie(Dashpot(damping=DAMPING, domain=ROTATION), "motor"),
    }
    free = flatten(assembly("free", **parts), outputs=["bearing.torque", "motor.angle"])
    chart = over_angle(free, [Observability(measured=("bearing.torque",))], angles=[0.0, 0.3])
    assert list(chart["observability.rank"]) == [1, 1]
    assert list(chart["observability.condition"]) == [np.inf] * 2
    assert chart.words["null vector"] == ("motor.angle",) * 2


def test_a_mixed_direction_is_written_out() -> None:
    """Only the deflection of two bodies is measured: their common angle and speed are not seen."""
    parts = {
        "motor": Inertia(inertia=INERTIA),
        "load": Inertia(inertia=INERTIA),
        "spring": tie(Spring(stiffness=STIFF, domain=ROTATION), "motor", "load"),
    }
    model = flatten(assembly("pair", **parts), outputs=["spring.angle", "motor.angle"])
    nominal = {v.name: 1.0 for v in model.states}
    view = Observability(nominal=nominal, measured=("spring.angle",))
    chart = over_angle(model, [view], angles=[0.1], angle="motor.angle")
    assert chart["observability.rank"][0] == 2
    words = {name: texts[0] for name, texts in chart.words.items()}
    assert words["verdict"].endswith("does not decay (eigenvalue 0): not detectable")
    assert {"+0.71 motor.angle +0.71 load.angle", "+0.71 load.angle +0.71 motor.angle"} & {
        part.strip() for part in words["null vector"].split(" and ")
    }


def test_noise_over_a_sample_is_its_integral() -> None:
    a, density = matrices(np.ones(2), 1.0)[0], np.diag([1e-6, 4.0])
    transition, covariance = discrete_noise(a, density, 1e-2)
    expected = quad_vec(lambda t: expm(a * t) @ density @ expm(a.T * t), 0.0, 1e-2, epsrel=1e-12)[0]
    assert np.allclose(transition, expm(a * 1e-2), rtol=1e-12)
    assert np.allclose(covariance, expected, rtol=1e-9)


def test_the_kalman_filter_is_where_the_recursion_ends() -> None:
    a, density, spread = matrices(np.ones(2), 1.0)[0], np.diag([0.0, 9.0]), np.array([2e-4])
    transition, noise = discrete_noise(a, density, 1e-3)
    c, prior = np.array([[1.0, 0.0]]), np.eye(2)
    for _ in range(4000):
        gain = prior @ c.T / (c @ prior @ c.T + spread**2)
        posterior = (np.eye(2) - gain @ c) @ prior
        prior = transition @ posterior @ transition.T + noise
    found, covariance = steady_state_kalman(transition, c, noise, spread)
    assert np.allclose(found, gain, rtol=1e-6)
    assert np.allclose(covariance, posterior, rtol=1e-6)


def test_what_is_unstable_and_not_seen_has_no_steady_state() -> None:
    with pytest.raises(ConvergenceError, match="Riccati"):
        steady_state_kalman(np.diag([0.9, 1.1]), np.array([[1.0, 0.0]]), np.eye(2), np.ones(1))


def test_a_better_sensor_gives_a_better_estimate(swing: FlatModel) -> None:
    found = []
    for spread in (1e-2, 1e-3, 1e-4):
        view = EstimateDeviation(process={"motor.speed": 3.0}, measurement={"motor.angle": spread})
        chart = over_angle(swing, [view], angles=[0.2])
        # A spring without inner states: the model alone reads the angle and multiplies.
        assert chart["deviation.model"][0] == pytest.approx(STIFF * spread)
        assert chart["deviation.best"][0] < chart["deviation.model"][0]
        found.append(chart["deviation.best"][0])
    assert found == sorted(found, reverse=True)


def test_names_and_numbers_are_checked(swing: FlatModel) -> None:
    with pytest.raises(UnknownNameError, match=r"motor\.angle"):
        over_angle(swing, [Observability(measured=("motor.angel",))], angles=[0.0])
    with pytest.raises(UnknownNameError, match=r"motor\.speed"):
        over_angle(
            swing,
            [EstimateDeviation(process={"motor.sped": 1.0}, measurement={"motor.angle": 1.0})],
            angles=[0.0],
        )
    with pytest.raises(ValueRangeError, match="positive"):
        over_angle(swing, [EstimateDeviation(process={}, measurement={"motor.angle": 0.0})], angles=[0.0])
