"""Which sensor helps most, against an augmented filter built by hand and solved by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_discrete_are

from nlsdesign.components import (
    ROTATION,
    CoulombFriction,
    Dashpot,
    Encoder,
    Fixed,
    GearedMotor,
    Inertia,
    Spring,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.analysis import SensorCandidate, rank_sensors
from nlsdesign.feedback.analysis.sensor_ranking import RankingAssumptions
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import FlatModel, flatten

J, RATIO, CONSTANT, STIFF, DAMPING, LEVEL, COUNT = 6e-4, 4.0, 0.055, 3.0, 2e-3, 0.02, 1e-3
GIVEN = RankingAssumptions(wander=20.0, current_error=0.05, current_time=0.02)


def drive(*, encoder: bool = True, spread: bool = True) -> FlatModel:
    def number(value: float, unit: str, share: float) -> object:
        return quantity(value, unit, spread=share if spread else 0.0)

    parts = {
        "motor": GearedMotor(
            inertia=J, gear_ratio=RATIO, torque_constant=number(CONSTANT, "N*m/A", 0.05), current_limit=50.0
        ),
        "load": Fixed(),
        "spring": tie(Spring(stiffness=number(STIFF, "N*m/rad", 0.1), domain=ROTATION), "motor", "load"),
        "bearing": tie(Dashpot(damping=number(DAMPING, "N*m*s/rad", 0.6), domain=ROTATION), "motor"),
        "rub": tie(CoulombFriction(sliding_effort=number(LEVEL, "N*m", 0.5)), "motor"),
    }
    if encoder:
        parts["encoder"] = Encoder(of="motor.angle", quantum=COUNT)
    return flatten(assembly("drive", **parts))


def by_hand(angle: float, largest: float, *, rows: tuple[str, ...], spread: bool) -> float:
    """States θ, ω, error of the current; then stiffness, torque constant, friction in units of a spread."""
    hold = STIFF * angle / (RATIO * CONSTANT)
    most = STIFF * largest / (RATIO * CONSTANT)
    offset = np.array([-np.log(1.1) * STIFF * angle, np.log(1.05) * STIFF * angle, -np.log(1.5) * LEVEL]) / J
    a = block_diag(np.array([[0.0, 1.0], [-STIFF / J, -DAMPING / J]]), -1.0 / GIVEN.current_time)
    a[1, 2] = RATIO * CONSTANT / J
    torque = np.array([STIFF, 0.0, 0.0])
    push = GIVEN.noise.torque * STIFF * largest / J * np.sqrt(1e-3)
    density = [0.0, push**2, 2.0 * (GIVEN.current_error * most) ** 2 / GIVEN.current_time]
    if spread:
        a = block_diag(a, -np.eye(3) / GIVEN.wander)
        a[1, 3:] = offset
        torque = np.append(torque, [np.log(1.1) * STIFF * angle, 0.0, 0.0])
        density += [2.0 / GIVEN.wander] * 3
    n, step = len(a), 1e-3
    whole = expm(np.block([[-a, np.diag(density)], [np.zeros((n, n)), a.T]]) * step)
    phi = whole[n:, n:].T
    noise = phi @ whole[:n, n:]
    known = {"angle": np.eye(n)[0], "current": np.eye(n)[2], "torque": torque}
    size = {"angle": COUNT / np.sqrt(12.0), "current": 0.005 * most, "torque": 0.005 * STIFF * largest}
    c = np.array([known[row] / size[row] for row in rows])
    unit = np.diag(np.maximum(np.sqrt(np.diag(noise)), 1e-9))
    back = np.linalg.inv(unit)
    prior = unit @ solve_discrete_are(
        (back @ phi @ unit).T, (c @ unit).T, back @ (noise + noise.T) @ back / 2.0, np.eye(len(c))
    ) @ unit  # fmt: skip
    posterior = prior - prior @ c.T @ np.linalg.solve(c @ prior @ c.T + np.eye(len(c)), c @ prior)
    assert hold <= most
    return float(np.sqrt(torque @ posterior @ torque))


@pytest.mark.parametrize("spread", [False, True], ids=["exact", "spread"])
def test_the_deviations_are_those_of_a_filter_built_by_hand(spread: bool) -> None:
    angles = np.array([0.2, 0.5, 0.9])
    ranking = rank_sensors(drive(), angles=angles, assumptions=GIVEN)
    gains = {gain.candidate.name: gain for gain in (ranking.present, *ranking.gains)}
    cases = {
        "present sensors": ("angle",),
        "torque sensor": ("angle", "torque"),
        "current sensor": ("angle", "current"),
    }
    for name, rows in cases.items():
        expected = [by_hand(each, 0.9, rows=rows, spread=spread) for each in angles]
        found = gains[name].spread if spread else gains[name].exact
        assert found == pytest.approx((np.median(expected), np.max(expected)), rel=1e-4), name


def test_the_table_is_in_order_and_says_its_condition() -> None:
    ranking = rank_sensors(drive(), angles=[0.2, 0.5, 0.9], assumptions=GIVEN)
    medians = [gain.spread[0] for gain in ranking.gains]
    assert medians == sorted(medians)
    assert all(gain.spread[0] <= ranking.present.spread[0] * (1.0 + 1e-9) for gain in ranking.gains)
    assert ranking.gains[0].candidate.name == "torque sensor"
    assert "within their spread over 20 s" in str(ranking)
    assert any("encoder of the load" in each for each in ranking.left_out)


def test_numbers_without_a_spread_leave_the_exact_deviation() -> None:
    ranking = rank_sensors(drive(spread=False), angles=[0.2, 0.9])
    for gain in (ranking.present, *ranking.gains):
        assert gain.spread == pytest.approx(gain.exact, rel=1e-9), gain.candidate.name


def test_a_load_that_moves_freely_can_have_an_encoder() -> None:
    parts = {
        "motor": GearedMotor(inertia=J, gear_ratio=RATIO, torque_constant=CONSTANT, current_limit=50.0),
        "arm": Inertia(inertia=2e-3),
        "spring": tie(Spring(stiffness=STIFF, domain=ROTATION), "motor", "arm"),
        "hold": tie(Spring(stiffness=0.5, domain=ROTATION), "arm"),
        "damp": tie(Dashpot(damping=0.01, domain=ROTATION), "arm"),
        "encoder": Encoder(of="motor.angle", quantum=COUNT),
    }
    ranking = rank_sensors(
        flatten(assembly("free", **parts)), angles=[0.2, 0.5], angle="motor.angle", estimate="spring.torque"
    )
    gains = {gain.candidate.name: gain for gain in ranking.gains}
    assert gains["encoder of arm"].exact[1] < ranking.present.exact[1]


def test_candidates_of_ones_own_and_what_is_missing() -> None:
    own = [
        SensorCandidate("two readings", {"motor.angle": COUNT}),
        SensorCandidate("no news", {"motor.speed": 1e9}),
    ]
    ranking = rank_sensors(drive(), angles=[0.5], candidates=own)
    assert {gain.candidate.name for gain in ranking.gains} == {"two readings", "no news"}
    blind = next(gain for gain in ranking.gains if gain.candidate.name == "no news")
    assert blind.exact == pytest.approx(ranking.present.exact, rel=1e-6)
    with pytest.raises(ValueRangeError, match="declares its quantum or noise"):
        rank_sensors(drive(encoder=False), angles=[0.5])
    with pytest.raises(ValueRangeError, match="must be positive"):
        SensorCandidate("noiseless", {"motor.angle": 0.0})


def test_on_the_published_deck_only_a_torque_sensor_helps_over_the_spread() -> None:
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    ranking = rank_sensors(model, angles=np.radians([5.0, 25.0, 45.0]))
    best, *others = ranking.gains
    assert best.candidate.name == "torque sensor"
    assert best.spread[0] < 0.15 * ranking.present.spread[0]
    assert all(gain.spread[0] > 0.9 * ranking.present.spread[0] for gain in others)
