"""The adaptive observer against what is derived or integrated without it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.stats import truncnorm

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_c
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.analysis.rest import rest_states
from nlsdesign.feedback.observer import (
    AdaptiveDesign,
    AdaptiveSettings,
    design_adaptive_observer,
)
from nlsdesign.feedback.observer.adaptive.adaptive_step import _matrices, _Side
from nlsdesign.feedback.observer.adaptive.duty_and_directions import (
    Duty,
    UncertainDirections,
    uncertain_directions,
)
from nlsdesign.feedback.observer.adaptive.estimator_bound import SensedTorque, estimator_bound
from nlsdesign.feedback.observer.adaptive.filter_equations import pairs, truncated_update
from nlsdesign.feedback.observer.scheduling.angle_form import minimal_form
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
def learning(linear: FlatModel) -> AdaptiveDesign:
    return design_adaptive_observer(linear, settings=AdaptiveSettings(duty=Duty(torque=1.5)))


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
    design = design_adaptive_observer(quiet)
    step, plant = design.step, design.step.nominal.plant
    if side == "raised":
        at = np.zeros(len(design.directions.effect))
        at[0] = 1.0
        quiet = quiet.with_values(design.directions.values(quiet.values, at))
        step_plant, heavier = step.raised[0]
    else:
        step_plant, heavier = plant, 1.0
    start = {ANGLE: 0.5, SPEED: 6.0, "spring.rubber.relaxing.dashpot.strain": 0.05}
    current = 7.0
    times = np.linspace(0.0, TIME, 11)
    run = simulate(quiet, times, inputs={CURRENT: np.full(11, current)}, start=start)
    ends = np.array([run[ANGLE][0], run[ANGLE][-1]])
    m = _matrices(_Side(step_plant, heavier), TIME, ends, step.inner)
    before = np.array([start[v.name] for v in plant.states]) - m["shift"][0, :, 0]
    pushed = heavier * np.array(step_plant.driven(current)).ravel()
    light = np.ones(len(before))
    light[step.inner :] = 1.0 / heavier
    factors = np.ones(m["next"].shape[2])
    following = m["next"][0] * factors
    following[step.inner :, : step.inner] /= heavier
    following[step.inner :, len(before) :] /= heavier
    memory = following @ np.concatenate([before, [1.0], pushed])
    after = memory + m["prior"][1, :, 0] * light
    after += (m["coupling"][1] * light[:, None]) @ after[: step.inner]
    after += m["shift"][1, :, 0]
    expected = np.array([run[v.name][-1] for v in plant.states])
    moved = np.abs(expected - np.array([start[v.name] for v in plant.states]))
    # A torque held from the beginning of the sample instead would miss 6 % of the change of speed.
    assert np.all(np.abs(after - expected) <= 2e-3 * moved)


def run(design: AdaptiveDesign, angle: np.ndarray, current: np.ndarray) -> dict[str, np.ndarray]:
    trace = simulate(
        design.model, TIME * np.arange(len(angle)), inputs={ANGLE: angle, CURRENT: current}, hold=True
    )
    return {v.name: trace[v.name] for v in (*design.model.outputs, *design.model.states)}


def slow(design: AdaptiveDesign, seen: dict[str, np.ndarray]) -> np.ndarray:
    return np.array([seen[f"{TORQUE}.deviation[{d + 1}]"] for d in range(len(design.directions.effect))])


def swing(model: FlatModel, seconds: float, frequency: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    time = TIME * np.arange(round(seconds / TIME))
    current = size * np.sin(2.0 * np.pi * frequency * time)
    seen = simulate(model, time, inputs={CURRENT: current}, hold=True)
    return seen["motor_encoder.reading"], current


def test_the_covariance_stays_positive(linear: FlatModel, learning: AdaptiveDesign) -> None:
    angle, current = swing(linear, 1.5, 3.0, 3.0)
    seen = run(learning, angle, current)
    size = len(learning.step.nominal.plant.states) + len(learning.directions.effect)
    for k in range(0, len(angle), 100):
        matrix = np.zeros((size, size))
        for i, j in pairs(size):
            matrix[i, j] = matrix[j, i] = seen[f"covariance[{i + 1},{j + 1}]"][k]
        assert np.min(np.linalg.eigvalsh(matrix)) > 0.0, k


def test_a_machine_with_another_spring_is_learned(linear: FlatModel) -> None:
    """A drive that is known exactly shows a spring that is ten per cent stiffer, two deviations."""
    known = declared_prior(linear)
    sure = known.only(["spring.stiffness"])
    design = design_adaptive_observer(linear, settings=AdaptiveSettings(prior=sure, duty=Duty(torque=1.5)))
    angle, current = swing(linear.with_values({"spring.stiffness": 1.7 * 1.1}), 2.0, 2.0, 4.0)
    seen = run(design, angle, current)
    late = slice(1500, None)
    wrong = seen[TORQUE][late] - 1.7 * 1.1 * angle[late]
    assert np.sqrt(np.mean(wrong**2)) < 0.1 * np.sqrt(np.mean((0.17 * angle[late]) ** 2))


def test_nothing_is_learned_at_standstill_nor_near_the_current_limit(learning: AdaptiveDesign) -> None:
    rng = np.random.default_rng(0)
    still = run(learning, np.full(400, 0.4), 5.0 + rng.normal(size=400))
    # Coming to rest at an angle that nobody told takes a few samples of apparent motion.
    assert np.max(np.abs(slow(learning, still)[:, 200:] - slow(learning, still)[:, 200:201])) < 0.02
    time = TIME * np.arange(400)
    limited = run(learning, 0.5 * np.sin(20.0 * time), np.full(400, 19.0))
    assert np.max(np.abs(slow(learning, limited))) == 0.0


def test_slow_states_stay_in_their_box(linear: FlatModel, learning: AdaptiveDesign) -> None:
    angle, current = swing(linear, 1.5, 2.0, 4.0)
    seen = run(learning, 3.0 * angle, -current)
    limit = learning.trust.limit
    assert np.max(np.abs(slow(learning, seen))) <= limit
    assert np.max(np.abs(slow(learning, seen))) > 0.9 * limit


def test_noise_that_nobody_declared_is_said(linear: FlatModel, learning: AdaptiveDesign) -> None:
    angle, current = swing(linear, 2.0, 2.0, 3.0)
    noisy = angle + 12e-3 * np.random.default_rng(2).standard_normal(len(angle))
    quiet, loud = run(learning, angle, current), run(learning, noisy, current)
    name = f"{TORQUE}.unrest"
    assert np.max(quiet[name][500:]) < 2.0
    # Standard deviation 12 mrad against four times 0.767/√12.
    assert loud[name][-1] > 10.0


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


def test_c_gives_the_same_numbers(linear: FlatModel, learning: AdaptiveDesign, tmp_path) -> None:
    angle, current = swing(linear, 0.6, 3.0, 3.0)
    given = {ANGLE: angle, CURRENT: current}
    inputs = np.column_stack([given[v.name] for v in learning.model.inputs]).tolist()
    step, reference = CompiledStep(export_c(learning.model, tmp_path)), GuardedModel(learning.model)
    found, expected = (np.array([side(u)[0] for u in inputs]) for side in (step, reference.step))
    size = np.max(np.abs(expected), axis=0)
    # Slow states are in standard deviations: one is their size, also where little was learned.
    size[-len(learning.directions.effect) :] = 1.0
    rounding = np.finfo(float).eps * np.max(np.abs(angle))
    assert np.all(np.max(np.abs(found - expected), axis=0) <= 1e-12 * size + rounding)
