"""The adaptive yardstick of ``benchmarks`` against what is derived or integrated without it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.stats import truncnorm

from benchmarks._adaptive_directions import UncertainDirections, uncertain_directions
from benchmarks._adaptive_filter import AdaptiveFilter, Estimates, Side, matrices, truncated_update
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.analysis.rest import rest_states
from nlsdesign.feedback.observer import Duty
from nlsdesign.feedback.observer.corrected.correction_equations import pairs
from nlsdesign.feedback.observer.scheduling.angle_form import minimal_form
from nlsdesign.feedback.observer.spread.estimator_bound import SensedTorque, estimator_bound
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.transform import named
from nlsdesign.simulation import simulate
from nlsdesign.simulation.prior import declared_prior

TORQUE, ANGLE, SPEED, CURRENT = "spring.torque", "motor.angle", "motor.speed", "motor.current"
TIME = 1e-3


def deck(name: str) -> FlatModel:
    return flatten(declare(load_deck(name)))


@pytest.fixture(scope="module")
def linear() -> FlatModel:
    return deck("austin2015_soft_spring")


@pytest.fixture(scope="module")
def cam() -> FlatModel:
    return deck("austin2015_figure_consistent")


@pytest.fixture(scope="module")
def learning(linear: FlatModel) -> AdaptiveFilter:
    return AdaptiveFilter(linear, duty=Duty(torque=1.5))


def directions_of(model: FlatModel, duty: Duty) -> UncertainDirections:
    form, _ = minimal_form(model, estimate=TORQUE, angle=ANGLE, angles=np.linspace(-1.1, 1.1, 65))
    return uncertain_directions(form, declared_prior(model), duty, resolution=1e-4, most=40)


def test_directions_are_independent_and_of_unit_variance(cam: FlatModel) -> None:
    found = directions_of(cam, Duty())
    covariance = declared_prior(cam).only(found.names).covariance
    inside = found.slopes.T @ np.linalg.pinv(covariance, rcond=1e-9, hermitian=True) @ found.slopes
    np.testing.assert_allclose(inside, np.eye(inside.shape[0]), atol=1e-6)
    assert np.all(np.diff(found.effect) <= 0.0)


def test_a_linear_spring_moves_its_torque_by_its_spread(linear: FlatModel) -> None:
    """By hand: a sine of 1.5 N·m has 1.5/√2 rms, and the stiffness is known to a factor of 1.05."""
    found = directions_of(linear, Duty(torque=1.5))
    own = np.sqrt(np.sum((found.effect * found.torque_share) ** 2))
    # Half a deviation to both sides: sinh(x/2)/(x/2) of x = ln 1.05.
    assert own == pytest.approx(np.log(1.05) * 1.5 / np.sqrt(2.0), rel=1e-3)


@pytest.mark.slow
def test_directions_move_the_torque_at_rest_as_drawn_machines_do(cam: FlatModel) -> None:
    """So slow that nothing of the relaxing part is left: the torque at rest alone, over 150 machines."""
    duty = Duty(torque=2.8, frequencies=(1e-6,))
    found = directions_of(cam, duty)
    s = cam.symbols()
    read = ca.Function("torque", [s.time, s.state, s.input, s.parameter], [named(cam, s)[TORQUE]])

    def torque(model: FlatModel, angles: np.ndarray) -> np.ndarray:
        x, p = rest_states(model, angles, angle=ANGLE), model.start(model.parameters)
        many = read.map(len(angles))
        return many(0.0, x.T, np.zeros((len(model.inputs), len(angles))), p).full().ravel()

    fine = np.linspace(0.0, 1.1, 2001)
    end = float(np.interp(2.8, torque(cam, fine), fine))
    angles = end * np.sin(np.pi * (np.arange(48) + 0.5) / 96)
    drawn = declared_prior(cam).draws(150, 5)
    off = [
        torque(cam.with_values({n: float(v[i]) for n, v in drawn.items()}), angles) - torque(cam, angles)
        for i in range(150)
    ]
    own = np.sqrt(np.sum((found.effect * found.torque_share) ** 2))
    # 150 draws of mostly one direction scatter by 1/√300, 6 %; two of these.
    assert own == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=0.12)


# Beyond three deviations from the edge the correction goes on linearly: that is the test below.
WITHIN = [(x, s) for s in (0.2, 1.0, 4.0) for x in (0.0, 0.7, -1.7, 2.5) if abs(x) - 3.0**0.5 <= 3.0 * s]


@pytest.mark.parametrize(("off", "deviation"), WITHIN)
def test_a_reading_cuts_the_prediction_at_the_edges_of_a_count(off: float, deviation: float) -> None:
    """Against SciPy's moments of a truncated normal; a count is √12 of its deviation wide."""
    half = np.sqrt(3.0)
    edges = (off - half) / deviation, (off + half) / deviation
    mean, variance = truncnorm.stats(*edges, scale=deviation, moments="mv")
    moved, kept = (float(ca.evalf(v)) for v in truncated_update(ca.SX(off), ca.SX(deviation**2)))
    assert moved == pytest.approx(float(mean), abs=1e-9)
    assert kept == pytest.approx(float(variance) / deviation**2, abs=1e-9)


def test_a_wide_prediction_is_corrected_as_by_kalman() -> None:
    moved, kept = (float(ca.evalf(v)) for v in truncated_update(ca.SX(-30.0), ca.SX(400.0)))
    assert moved == pytest.approx(-30.0 * 400.0 / 401.0)
    assert kept == pytest.approx(1.0 / 401.0)


@pytest.mark.long_cases("raised")
@pytest.mark.parametrize("side", ["declared", "raised"])
def test_a_step_is_the_equations_over_one_sample(cam: FlatModel, side: str) -> None:
    """Integrated finely from a moving state; the step reads the angle at both ends."""
    quiet = cam.with_values({"dry_friction.sliding_effort": 0.0})
    design = AdaptiveFilter(quiet)
    plant = design.plant
    if side == "raised":
        at = np.zeros(len(design.directions.effect))
        at[0] = 1.0
        quiet = quiet.with_values(design.directions.values(quiet.values, at))
        step_plant, heavier = design.sides[0][0]
    else:
        step_plant, heavier = plant, 1.0
    start = {ANGLE: 0.5, SPEED: 6.0, "spring.rubber.relaxing.dashpot.strain": 0.05}
    current = 7.0
    times = np.linspace(0.0, TIME, 11)
    run = simulate(quiet, times, inputs={CURRENT: np.full(11, current)}, start=start)
    ends = np.array([run[ANGLE][0], run[ANGLE][-1]])
    m = matrices(Side(step_plant, heavier), ends)
    before = np.array([start[v.name] for v in plant.states]) - m["shift"][0, :, 0]
    pushed = heavier * np.array(step_plant.driven(current)).ravel()
    light = np.ones(len(before))
    light[design.inner :] = 1.0 / heavier
    factors = np.ones(m["next"].shape[2])
    following = m["next"][0] * factors
    following[design.inner :, : design.inner] /= heavier
    following[design.inner :, len(before) :] /= heavier
    memory = following @ np.concatenate([before, [1.0], pushed])
    after = memory + m["prior"][1, :, 0] * light
    after += (m["coupling"][1] * light[:, None]) @ after[: design.inner]
    after += m["shift"][1, :, 0]
    expected = np.array([run[v.name][-1] for v in plant.states])
    moved = np.abs(expected - np.array([start[v.name] for v in plant.states]))
    # A torque held from the beginning of the sample instead would miss 6 % of the change of speed.
    assert np.all(np.abs(after - expected) <= 2e-3 * moved)


def expected_states(learning: AdaptiveFilter) -> ca.Function:
    """(memory, slow states, columns of the table) -> the states that are expected at a sample."""
    memory, slow = ca.SX.sym("memory", learning.n), ca.SX.sym("slow", learning.slow)
    return ca.Function("expected", [memory, slow, learning.w], [learning.expected_states(memory, slow)])


def table(learning: AdaptiveFilter) -> np.ndarray:
    """Columns of the table in the middle of its range."""
    return learning.columns[:, learning.columns.shape[1] // 2]


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_friction_moves_the_angle_by_what_it_takes_from_the_speed(
    linear: FlatModel, learning: AdaptiveFilter, speed: float
) -> None:
    """ω̇ = −(τ/J)·sign ω for one sample: the angle falls behind ω₀·T by the integral of what is lost."""
    rate = -np.sign(speed) * linear.values["dry_friction.sliding_effort"] / linear.values["motor.inertia"]
    time = np.linspace(0.0, TIME, 1001)
    assert abs(rate * TIME) < 0.2 * abs(speed), "the speed stays well away from zero"
    memory = np.zeros(learning.n)
    memory[learning.speed] = speed
    states = expected_states(learning)
    moving, standing = (
        states(m, np.zeros(learning.slow), table(learning)).full().ravel() for m in (memory, 0.0 * memory)
    )
    moved = moving - standing - memory
    assert moved[learning.speed] == pytest.approx(rate * TIME, rel=0.02)
    assert moved[learning.angle] == pytest.approx(np.trapezoid(rate * time, time), rel=0.02)


def test_slopes_are_taken_at_the_deck_and_not_at_the_estimate(learning: AdaptiveFilter) -> None:
    """By differences at the deck; an estimate that lies elsewhere changes the states but no slope."""
    memory, slow = ca.SX.sym("memory", learning.n), ca.SX.sym("slow", learning.slow)
    states = learning.expected_states(memory, slow)
    slopes = ca.Function("slopes", [memory, slow, learning.w], [learning.slopes(states, memory, slow)])
    at, away = np.zeros(learning.n), np.full(learning.slow, 1.5)
    at[learning.speed] = 3.0
    read, width = expected_states(learning), 1e-4

    def differences(around: np.ndarray) -> np.ndarray:
        """Central differences of the states by each slow state."""
        sides = [
            [read(at, around + sign * width * unit, table(learning)).full().ravel() for sign in (1.0, -1.0)]
            for unit in np.eye(learning.slow)
        ]
        return np.array([(up - down) / (2.0 * width) for up, down in sides]).T

    nominal = slopes(at, 0.0 * away, table(learning)).full()
    np.testing.assert_allclose(nominal[:, learning.n :], differences(0.0 * away), rtol=1e-5, atol=1e-12)
    np.testing.assert_array_equal(slopes(at, away, table(learning)).full(), nominal)
    apart = np.abs(differences(away) - nominal[:, learning.n :])
    assert np.max(apart) > 0.05 * np.max(np.abs(nominal[:, learning.n :])), (
        "the slopes at the estimate differ"
    )


def run(design: AdaptiveFilter, angle: np.ndarray, current: np.ndarray) -> Estimates:
    return design.run(angle, current[None, :])


def swing(model: FlatModel, seconds: float, frequency: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    time = TIME * np.arange(round(seconds / TIME))
    current = size * np.sin(2.0 * np.pi * frequency * time)
    seen = simulate(model, time, inputs={CURRENT: current}, hold=True)
    return seen["motor_encoder.reading"], current


def test_the_covariance_stays_positive(linear: FlatModel, learning: AdaptiveFilter) -> None:
    angle, current = swing(linear, 1.5, 3.0, 3.0)
    seen = run(learning, angle, current)
    size = learning.n + learning.slow
    for k in range(0, len(angle), 100):
        matrix = np.zeros((size, size))
        for place, (i, j) in enumerate(pairs(size)):
            matrix[i, j] = matrix[j, i] = seen.covariance[place, k]
        assert np.min(np.linalg.eigvalsh(matrix)) > 0.0, k


def test_a_machine_with_another_spring_is_learned(linear: FlatModel) -> None:
    """A drive that is known exactly shows a spring that is ten per cent stiffer, two deviations."""
    known = declared_prior(linear)
    sure = known.only(["spring.stiffness"])
    design = AdaptiveFilter(linear, prior=sure, duty=Duty(torque=1.5))
    angle, current = swing(linear.with_values({"spring.stiffness": 1.7 * 1.1}), 2.0, 2.0, 4.0)
    seen = run(design, angle, current)
    late = slice(1500, None)
    wrong = seen.torque[late] - 1.7 * 1.1 * angle[late]
    assert np.sqrt(np.mean(wrong**2)) < 0.1 * np.sqrt(np.mean((0.17 * angle[late]) ** 2))


def test_nothing_is_learned_at_standstill_nor_near_the_current_limit(learning: AdaptiveFilter) -> None:
    rng = np.random.default_rng(0)
    still = run(learning, np.full(400, 0.4), 5.0 + rng.normal(size=400))
    # Coming to rest at an angle that nobody told takes a few samples of apparent motion.
    assert np.max(np.abs(still.slow[:, 200:] - still.slow[:, 200:201])) < 0.02
    time = TIME * np.arange(400)
    limited = run(learning, 0.5 * np.sin(20.0 * time), np.full(400, 19.0))
    assert np.max(np.abs(limited.slow)) == 0.0


def test_slow_states_stay_in_their_box(linear: FlatModel, learning: AdaptiveFilter) -> None:
    angle, current = swing(linear, 1.5, 2.0, 4.0)
    seen = run(learning, 3.0 * angle, -current)
    limit = learning.trust.limit
    assert np.max(np.abs(seen.slow)) <= limit
    assert np.max(np.abs(seen.slow)) > 0.9 * limit


def test_noise_that_nobody_declared_is_said(linear: FlatModel, learning: AdaptiveFilter) -> None:
    angle, current = swing(linear, 2.0, 2.0, 3.0)
    noisy = angle + 12e-3 * np.random.default_rng(2).standard_normal(len(angle))
    quiet, loud = run(learning, angle, current), run(learning, noisy, current)
    assert np.max(quiet.inflation[500:]) < 2.0
    # Standard deviation 12 mrad against four times 0.767/√12.
    assert loud.inflation[-1] > 10.0


def test_the_bound_is_that_of_batch_least_squares(linear: FlatModel) -> None:
    """Slopes by differences of whole simulations instead of the variational equations."""
    model = linear.with_values({"dry_friction.sliding_effort": 0.0})
    names = ["motor.inertia", "motor.torque_constant", "spring.stiffness", "bearing.damping"]
    prior = declared_prior(model).only(names)
    time = TIME * np.arange(120)
    current = 3.0 * np.sin(2.0 * np.pi * 5.0 * time)
    quantum = model.values["motor_encoder.quantum"]
    h, g = [], []
    for name, deviation in zip(names, prior.deviations, strict=True):
        up, down = (
            simulate(
                model.with_values({name: model.values[name] * np.exp(sign * 1e-3 * deviation)}), time,
                inputs={CURRENT: current}, hold=True, tolerance=1e-11,
            )
            for sign in (1.0, -1.0)
        )  # fmt: skip
        h.append((up[ANGLE] - down[ANGLE]) / 2e-3)
        g.append((up[TORQUE] - down[TORQUE]) / 2e-3)
    found = estimator_bound(model, prior, current[None, :], SensedTorque(TORQUE, ANGLE, quantum))
    for k in (12, 25, 119):
        slopes, wanted = np.array(h).T[: k + 1], np.array(g)[:, k]
        information = np.eye(4) + slopes.T @ slopes / (quantum**2 / 12.0)
        expected = np.sqrt(wanted @ np.linalg.inv(information) @ wanted)
        assert found.deviation[k] == pytest.approx(expected, rel=2e-3)
        assert found.before[k] == pytest.approx(float(np.linalg.norm(wanted)), rel=2e-3)
    assert np.all(found.deviation <= found.before * (1.0 + 1e-9))
