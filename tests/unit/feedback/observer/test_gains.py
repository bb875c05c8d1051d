"""Gain rules: the poles they place, the filter they are, and what they do where nothing is seen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from nlsdesign.feedback.observer import CascadeGain, PolePlacement, SteadyStateKalman
from nlsdesign.feedback.observer.scheduling.step import GainRule, SampledPlant
from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from tests import observed as ob

TIME = 1e-3


def minimal(arm: float, viscosity: float = ob.SLOW) -> SampledPlant:
    """(ζ, θ, ω) with ζ = F_M − a·k·δ(θ), measured θ; the angle has no column."""
    a = np.array(
        [
            [-ob.RELAXING / viscosity, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [-ob.ELEMENTS * arm / ob.INERTIA, 0.0, -ob.DAMPING / ob.INERTIA],
        ]
    )
    names = (ob.RELAXING_FORCE, "motor.angle", "motor.speed")
    sizes = np.array([160.0, 0.785, 57.0])
    return SampledPlant(0.5, a, expm(a * TIME), np.array([[0.0, 1.0, 0.0]]), names, sizes, TIME, names[-1])


def published(arm: float, viscosity: float = ob.SLOW) -> SampledPlant:
    a, c = ob.published_matrices(3e-3, arm, viscosity)
    names = (ob.FORCE, ob.EXTENSION, "motor.angle", "motor.speed")
    sizes = np.array([300.0, 12e-3, 0.785, 57.0])
    return SampledPlant(0.5, a, expm(a * TIME), c[::-1], names, sizes, TIME, names[-1])


def error_matrix(plant: SampledPlant, rule: GainRule) -> np.ndarray:
    correction = rule.correction(plant)
    return plant.transition @ (np.eye(len(plant.a)) - correction @ plant.output_matrix)


@pytest.mark.parametrize("arm", [0.0, 4e-3, -7e-3])
@pytest.mark.parametrize("viscosity", [ob.PRINTED, ob.SLOW])
def test_the_cascade_has_a_double_pole_and_the_rubbers_own(arm: float, viscosity: float) -> None:
    found = error_matrix(minimal(arm, viscosity), CascadeGain(bandwidth=25.0))
    pole, own = np.exp(-2.0 * np.pi * 25.0 * TIME), np.exp(-ob.RELAXING / viscosity * TIME)
    assert found[0] == pytest.approx([own, 0.0, 0.0])
    block = found[1:, 1:]
    assert np.trace(block) == pytest.approx(2.0 * pole)
    assert np.linalg.det(block) == pytest.approx(pole**2)


def test_the_published_cascade_drives_the_force_with_the_measured_extension() -> None:
    """L11 = a12, L12 = 0: the error of the force sees neither that of the extension nor that of the angle."""
    plant = published(5e-3)
    found = error_matrix(plant, CascadeGain())
    assert found[0] == pytest.approx([np.exp(-ob.RELAXING / ob.SLOW * TIME), 0.0, 0.0, 0.0])
    gain = plant.transition @ CascadeGain().correction(plant)
    assert gain[0, 1] == pytest.approx(plant.transition[0, 1])
    assert gain[0, 0] == 0.0


def test_poles_are_placed() -> None:
    poles = (-40.0, -90.0 + 30.0j, -90.0 - 30.0j)
    found = np.linalg.eigvals(error_matrix(minimal(5e-3), PolePlacement(poles)))
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(np.exp(np.array(poles) * TIME)), rel=1e-9)
    four = (-40.0, -60.0, -80.0, -100.0)
    found = np.linalg.eigvals(error_matrix(published(5e-3), PolePlacement(four)))
    assert np.sort(found.real) == pytest.approx(np.sort(np.exp(np.array(four) * TIME)), rel=1e-6)


def test_equal_poles_are_placed() -> None:
    found = error_matrix(minimal(5e-3), PolePlacement((-50.0, -50.0, -50.0)))
    wanted = np.poly(np.full(3, np.exp(-50.0 * TIME)))
    assert np.poly(found) == pytest.approx(wanted, rel=1e-9)


def test_at_zero_angle_only_what_is_seen_is_placed() -> None:
    """The paper's decomposition: the force keeps −k/η and gets no correction."""
    plant = published(0.0)
    rule = PolePlacement((-20.0, -60.0, -80.0, -100.0))
    found = error_matrix(plant, rule)
    own = np.exp(-ob.RELAXING / ob.SLOW * TIME)
    expected = [own, *np.exp(np.array([-60.0, -80.0, -100.0]) * TIME)]
    assert np.sort(np.linalg.eigvals(found).real) == pytest.approx(np.sort(expected), rel=1e-6)
    correction = PolePlacement((-20.0, -60.0, -80.0)).correction(minimal(0.0))
    assert correction[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.abs(correction[1:]) > 0.1)


def test_gains_of_pole_placement_grow_without_bound_towards_zero_angle() -> None:
    rule = PolePlacement((-40.0, -60.0, -80.0), condition_limit=1e12)
    largest = [np.max(np.abs(rule.correction(minimal(arm))[0])) for arm in (1e-3, 1e-4, 1e-5, 1e-6)]
    assert np.array(largest[1:]) / np.array(largest[:-1]) == pytest.approx([10.0] * 3, rel=0.05)
    # while the others stay where they are
    kalman = SteadyStateKalman({ob.RELAXING_FORCE: 12.0, "motor.speed": 2.6}, (ob.COUNT / np.sqrt(12.0),))
    far, near, zero = (kalman.correction(minimal(arm)) for arm in (1e-5, 1e-6, 0.0))
    assert near[0, 0] == pytest.approx(far[0, 0] / 10.0, rel=1e-3)
    assert zero[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert near[1:] == pytest.approx(zero[1:], rel=1e-4)


def test_the_kalman_rule_is_where_the_recursion_ends() -> None:
    plant, spread = minimal(5e-3), ob.COUNT / np.sqrt(12.0)
    rule = SteadyStateKalman({ob.RELAXING_FORCE: 12.0, "motor.speed": 2.6}, (spread,))
    density = np.diag([12.0**2, 0.0, 2.6**2])
    points, weights = np.polynomial.legendre.leggauss(20)
    times = TIME / 2.0 * (points + 1.0)
    noise = (
        TIME
        / 2.0
        * sum(
            w * expm(plant.a * t) @ density @ expm(plant.a.T * t) for t, w in zip(times, weights, strict=True)
        )
    )
    c, prior = plant.output_matrix, np.diag([4.0, 1e-6, 1e-2])
    for _ in range(3000):
        gain = prior @ c.T / (c @ prior @ c.T + spread**2)
        prior = plant.transition @ (np.eye(3) - gain @ c) @ prior @ plant.transition.T + noise
    assert rule.correction(plant) == pytest.approx(gain, rel=1e-5)


def test_settings_are_checked() -> None:
    with pytest.raises(ValueRangeError, match="needs 3 poles"):
        PolePlacement((-1.0, -2.0)).correction(minimal(5e-3))
    with pytest.raises(ValueRangeError, match="negative real part"):
        PolePlacement((-1.0, -2.0, 3.0)).correction(minimal(5e-3))
    with pytest.raises(ValueRangeError, match=r"are not in pairs .* -> give complex poles in pairs"):
        PolePlacement((-50.0, -50.0 + 9.0j, -60.0)).correction(minimal(5e-3))
    swinging = (-50.0 + 9.0j, -50.0 - 9.0j, -60.0)
    PolePlacement(swinging).correction(minimal(0.0))  # the real one is that of what is not seen
    with pytest.raises(ValueRangeError, match="bandwidth"):
        CascadeGain(bandwidth=0.0)
    with pytest.raises(UnknownNameError, match=r"did you mean 'motor\.speed'"):
        SteadyStateKalman({"motor.sped": 1.0}, (1e-3,)).correction(minimal(5e-3))
    with pytest.raises(ValueRangeError, match="one positive standard deviation"):
        SteadyStateKalman({}, (1e-3, 1e-3)).correction(minimal(5e-3))
