"""Faults of the bench that were added later: each follows its own closed form."""

from __future__ import annotations

from math import atan, exp

import numpy as np
import pytest

from tests.rig import ACTUATORS, Hidden, make_records, truth
from tests.rig.actuators import Actuator
from tests.rig.aging import Aging
from tests.rig.commands import STEP
from tests.rig.faults import acting_current, capstan
from tests.rig.rubber import pull_of


@pytest.fixture(params=("arm", "wrist"))
def actuator(request: pytest.FixtureRequest) -> Actuator:
    return ACTUATORS[request.param]


def test_a_clean_drive_and_cable_have_no_fault() -> None:
    assert acting_current(Hidden()) is None
    assert capstan(Hidden()) is None


def test_current_acts_a_delay_later() -> None:
    act = acting_current(Hidden(drive_delay=0.008))
    assert act is not None
    given = np.random.default_rng(1).normal(size=400)
    acted = [act(float(i)) for i in given]
    late = round(0.008 / STEP)
    assert acted[:late] == [0.0] * late
    assert acted[late:] == list(given[:-late])


def test_saturation_and_dead_zone_are_odd_functions_of_the_current() -> None:
    soft, dead = acting_current(Hidden(saturation=0.5)), acting_current(Hidden(dead_zone=0.2))
    assert soft is not None
    assert dead is not None
    for current in (0.1, 1.0, 4.0):
        assert soft(current) == pytest.approx(2.0 * atan(current / 2.0))
        assert soft(-current) == pytest.approx(-soft(current))
        assert dead(current) == pytest.approx(max(current - 0.2, 0.0))
        assert dead(-current) == pytest.approx(-dead(current))


def test_a_hot_winding_gives_less_torque_by_the_closed_form() -> None:
    act = acting_current(Hidden(winding_heat=0.05, winding_time=2.0))
    assert act is not None
    acted = 0.0
    for _ in range(round(3.0 / STEP)):
        acted = act(1.5)
    heat = 0.05 * 1.5**2 * 2.0 * (1.0 - exp(-3.0 / 2.0))
    assert acted == pytest.approx(1.5 / (1.0 + heat), rel=1e-3)


def test_a_guide_follows_euler_in_both_directions_and_holds_in_between() -> None:
    pass_on = capstan(Hidden(wrap=0.2, guide_stiffness=1e5))
    assert pass_on is not None
    out = [pass_on(50.0, e) for e in np.linspace(0.0, 1e-3, 50)]
    back = [pass_on(50.0, e) for e in np.linspace(1e-3, 0.0, 50)]
    assert out[-1] == pytest.approx(50.0 * exp(0.2))
    assert back[-1] == pytest.approx(50.0 * exp(-0.2))
    assert back[-1] < back[1] < out[-1]


def test_softened_rubber_is_virgin_again_at_its_largest_extension(actuator: Actuator) -> None:
    pull, clean = (pull_of(actuator.rubber, Hidden(softening=s), STEP) for s in (0.3, 0.0))
    up, rest = np.linspace(0.0, 6e-3, 600), round(10.0 * actuator.rubber.relaxation_time / STEP)
    path = np.concatenate([up, up[:299:-1], np.full(rest, up[300]), up[300:], np.full(rest, up[-1])])
    forces = np.array([[pull(float(e))[0], clean(float(e))[0]] for e in path])
    np.testing.assert_allclose(forces[:600, 0], forces[:600, 1], rtol=1e-9)
    (static,) = actuator.rubber.equilibrium(up[300:301])
    below = forces[900 + rest - 1]
    assert below[1] - below[0] == pytest.approx(0.3 * (1.0 - up[300] / 6e-3) * static, rel=1e-3)
    assert forces[-1, 0] == pytest.approx(forces[-1, 1], rel=1e-4)


def test_set_moves_the_rubber_and_heat_makes_it_soft(actuator: Actuator) -> None:
    rubber = actuator.rubber
    aged = Aging(rubber, Hidden(permanent_set=0.1), STEP)
    for extension in (0.0, 4e-3, 2e-3):
        aged.advance(extension, 0.0, 0.0)
    assert (aged.set, aged.softness) == (pytest.approx(4e-4), 1.0)
    warm = Aging(rubber, Hidden(heating=0.5, cooling_time=2.0), STEP)
    for _ in range(round(4.0 / STEP)):
        warm.advance(0.0, 3.0, 0.0)
    power = 3.0**2 / (rubber.shape * rubber.eta)
    assert warm.softness == pytest.approx(1.0 / (1.0 + 0.5 * power * 2.0 * (1.0 - exp(-2.0))), rel=1e-3)


@pytest.mark.long_cases("arm", "wrist")
def test_profile_drift_and_eccentric_disc_have_the_size_they_claim(actuator: Actuator) -> None:
    def run(**effects: float) -> np.ndarray:
        return make_records(actuator, effects, 4, noise=False, only=["hold"])["hold"]

    clean, drifting = run(), run(force_sensor_drift=1.0)
    hidden = truth(actuator, {"force_sensor_drift": 1.0}, 4)[1]
    np.testing.assert_allclose(drifting[:, 3] - clean[:, 3], hidden.force_drift * clean[:, 0], atol=1e-9)
    hidden = truth(actuator, {"angle_sensor_eccentricity": 1.0}, 4)[1]
    turned = run(angle_sensor_eccentricity=1.0)[:, 1] - clean[:, 1]
    expected = np.sin(clean[:, 1] + hidden.disc_phase) - np.sin(hidden.disc_phase)
    np.testing.assert_allclose(turned, hidden.eccentricity * expected, atol=1e-12)
    built, hidden = truth(actuator, {"cam_profile_error": 1.0}, 4)
    bent = run(cam_profile_error=1.0)[-1]
    # At rest at 45°: beyond the bump the extension is larger by its whole area.
    more = hidden.profile_error * 0.15 * np.sqrt(np.pi)
    extension = built.cam.extension(np.array([bent[1]])) + more
    assert bent[3] == pytest.approx(built.rubber.equilibrium(extension)[0], rel=0.01)
