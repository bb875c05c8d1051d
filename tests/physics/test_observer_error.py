"""What the error of the observer does: it vanishes as proved, and how large it stays in either form.

The truth is the plant simulated by CVODES; the expected decay is typed by hand.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.analysis import Stability, over_angle
from nlsdesign.feedback.observer import (
    CascadeGain,
    FixedGrid,
    GridByTolerance,
    ObserverDesign,
    PaperForm,
    PolePlacement,
    SteadyStateKalman,
    design_observer_with_details,
    observe,
)
from nlsdesign.feedback.observer.scheduling.scheduled import check_stability, error_matrices
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.paper_form import PaperFormNames
from nlsdesign.model.transform import replace_state
from nlsdesign.simulation import Trace, simulate
from tests import observed as ob

FINE = GridByTolerance(-1.2, 1.2, tolerance=1e-4)
TIME = 1e-3
KALMAN = SteadyStateKalman(
    {
        ob.RELAXING_FORCE: 2.0 * np.sqrt(2.0 * ob.RELAXING / ob.SLOW),
        "motor.speed": 0.05 / ob.INERTIA * np.sqrt(TIME),
    },
    (ob.COUNT / np.sqrt(12.0),),
)


@pytest.fixture(scope="module")
def model() -> FlatModel:
    return ob.bench(ob.SLOW)


@pytest.fixture(scope="module")
def cascade(model: FlatModel) -> ObserverDesign:
    return design_observer_with_details(ob.on_relaxing_force(model), grid=FINE)


@pytest.fixture(scope="module")
def moving(model: FlatModel) -> Trace:
    """Driven by a sine current held from sample to sample, through zero angle and into the stiffening."""
    time = np.arange(0.0, 1.0, TIME)
    current = 2.0 * np.sin(2.0 * np.pi * 1.3 * time)
    return simulate(model, time, inputs={"motor.current": current}, hold=True)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_a_wrong_start_is_forgotten_at_the_rate_of_the_rubber(cascade: ObserverDesign, moving: Trace) -> None:
    """e_M(t) = e^(−kt/η)·e_M(0), whatever the angle does; the torque errs by N·h(θ) times that."""
    wrong, name = 10.0, f"{ob.RELAXING_FORCE}.memory"
    start = cascade.start(0.0)
    found = observe(cascade.model, moving, start=start | {name: start[name] + wrong})
    error = found[ob.RELAXING_FORCE] - ob.AREA * moving["spring.rubber.relaxing.stress"]
    expected = wrong * np.exp(-ob.RELAXING / ob.SLOW * moving.time)
    assert np.max(np.abs(moving["motor.angle"])) > 0.5
    assert np.max(np.abs(error - expected)) < 0.02
    arm = moving["spring.cam.lever_arm_now"]
    torque_error = found["spring.torque"] - moving["spring.torque"]
    assert np.max(np.abs(torque_error - ob.ELEMENTS * arm * expected)) < 1e-3
    assert np.max(np.abs(torque_error[:40])) > 0.01  # it was wrong
    assert np.max(np.abs(torque_error[600:])) < 5e-4  # and is no more


def test_angle_and_speed_follow(cascade: ObserverDesign, moving: Trace) -> None:
    start = cascade.start(0.0)
    found = observe(cascade.model, moving, start=start | {"motor.speed.memory": 5.0})
    late = moving.time > 0.3
    assert np.max(np.abs(moving["motor.speed"])) > 5.0
    assert np.max(np.abs(found["motor.speed"] - moving["motor.speed"])[late]) < 0.02
    assert np.max(np.abs(found["motor.angle.estimate"] - moving["motor.angle"])[late]) < 5e-5


@pytest.mark.slow
def test_the_minimal_form_does_not_depend_on_the_state_that_carries_it(
    model: FlatModel, moving: Trace
) -> None:
    """Strain, relaxing force and total force: known functions of the angle apart, and integrated as such."""
    estimates = []
    for other in (model, ob.on_relaxing_force(model), replace_state(model, ob.STRAIN, ob.FORCE)):
        observer = design_observer_with_details(other, grid=FixedGrid(-1.0, 1.0, points=501)).model
        estimates.append(observe(observer, moving)["spring.torque"])
    size = np.max(np.abs(moving["spring.torque"]))
    assert np.max(np.abs(estimates[1] - estimates[0])) < 1e-4 * size
    assert np.max(np.abs(estimates[2] - estimates[0])) < 1e-4 * size


def test_a_quantised_angle_costs_no_more_than_half_a_count(
    model: FlatModel, cascade: ObserverDesign, moving: Trace
) -> None:
    found = observe(cascade.model, moving, readings={"motor.angle": "motor_encoder.reading"})
    exact = observe(cascade.model, moving)
    assert np.max(np.abs(moving["motor_encoder.reading"] - moving["motor.angle"])) > 0.3e-3
    error = found["spring.torque"] - moving["spring.torque"]
    # The slope of the torque over the angle, at rest and with the relaxing modulus on top.
    steepest = np.max(over_angle(model, [Stability()], angles=np.linspace(-0.9, 0.9, 181))["stiffness.fast"])
    alone = np.max(np.abs(exact["spring.torque"] - moving["spring.torque"]))
    assert np.max(np.abs(moving["motor.angle"])) < 0.9
    assert np.max(np.abs(error)) < steepest * ob.COUNT / 2.0 + alone
    assert np.all(np.isfinite(found["motor.speed"]))
    assert rms(found["motor.speed"] - moving["motor.speed"]) < 0.15


@pytest.mark.long_cases("2.0-411.0", "2.0-31000.0", "11.0-411.0", "11.0-31000.0")
@pytest.mark.parametrize("viscosity", [ob.PRINTED, ob.SLOW])
@pytest.mark.parametrize("frequency", [2.0, 11.0])
def test_integrating_the_rate_of_the_extension_costs_accuracy(frequency: float, viscosity: float) -> None:
    """The published form carries F and integrates K(δ)·dδ/dt; its error against carrying F_M; 45°, 30 Hz.

    The design notes say 4 to 10 times, at 31 kPa·s. Found: that, for the same rate; and more against the
    minimal form, which reads δ(θ) and integrates no rate at all. At 411 Pa·s the notes say that F is slightly
    better; it is not here.
    """
    model, grid = ob.bench(viscosity), FixedGrid(-0.9, 0.9, points=481)
    relaxing = PaperFormNames(force="spring.rubber.relaxing.stress")
    observers = {
        "total": design_observer_with_details(model, form=PaperForm(rate_bandwidth=30.0), grid=grid).model,
        "relaxing": design_observer_with_details(
            model, form=PaperForm(names=relaxing, rate_bandwidth=30.0), grid=grid
        ).model,
        "minimal": design_observer_with_details(model, grid=grid).model,
    }
    record = ob.servoed(viscosity, frequency, np.radians(45.0), duration=0.8)
    error = {
        name: rms((observe(observer, record)["spring.torque"] - record["spring.torque"])[400:])
        for name, observer in observers.items()
    }
    ratio = error["total"] / error["relaxing"]
    assert ratio > (4.0 if viscosity == ob.SLOW else 2.0), error
    assert viscosity == ob.PRINTED or ratio < 10.0, error
    assert error["minimal"] < error["relaxing" if viscosity == ob.SLOW else "total"]


# Quicker: the tests of test_corrected_cascade.py
@pytest.mark.slow
def test_the_correction_reduces_what_the_rubber_model_has_wrong() -> None:
    """The true rubber creeps in a way that the model does not have: a disturbance of the relaxing force.

    Kalman against the model alone, with the current known: at 31 kPa·s the angle does tell.
    """
    model, draw = ob.on_relaxing_force(ob.bench(ob.SLOW)), np.random.default_rng(6)
    cascade = design_observer_with_details(model, grid=GridByTolerance(-1.2, 1.2))
    kalman = design_observer_with_details(model, gain=KALMAN, grid=GridByTolerance(-1.2, 1.2))
    time, held = np.arange(0.0, 3.0, TIME), 0.6
    density = KALMAN.process
    state = np.array([held, 0.0, 0.0])
    log, names = [], [v.name for v in model.states]
    s = model.symbols()
    rates = ca.Function("rates", [s.state, s.input, s.parameter], [s.derivative])
    p, u0 = model.start(model.parameters), model.evaluate([held, 0.0, 0.0])["spring.torque"] / ob.CONSTANT
    for _ in time:
        current = u0 - 3.0 * (state[0] - held) - 0.1 * state[1]
        log.append((*state, current))
        for _ in range(2):
            rate = np.array(rates(state, current, p)).ravel()
            state = state + rate * TIME / 2.0
        for name, spread in density.items():
            state[names.index(name)] += spread * np.sqrt(TIME) * draw.normal()
    angle, _, force, current = np.array(log).T
    record = Trace(
        time,
        {"motor.angle": ob.COUNT * np.round(angle / ob.COUNT), "motor.current": current},
        {"motor.angle": "rad", "motor.current": "A"},
    )
    late = time > 0.5
    error = {
        name: rms((observe(d.model, record, start=d.start(held))[ob.RELAXING_FORCE] - force)[late])
        for name, d in (("alone", cascade), ("kalman", kalman))
    }
    assert error["alone"] == pytest.approx(
        2.0, rel=0.35
    )  # e^(−kt/η)-correlated: few independent samples in 3 s
    assert error["kalman"] < 0.75 * error["alone"]


# --- stability ------------------------------------------------------------------------------------


@pytest.mark.long_cases("minimal-31000.0", "published-411.0")
@pytest.mark.parametrize("viscosity", [ob.PRINTED, ob.SLOW])
@pytest.mark.parametrize("form", ["minimal", "published"])
def test_the_cascade_is_proved_for_every_motion(viscosity: float, form: str) -> None:
    grid = FixedGrid(-1.2, 1.2, points=241)
    design = design_observer_with_details(
        ob.bench(viscosity), form=PaperForm() if form == "published" else None, grid=grid
    )
    check = check_stability(design.model)
    assert check.proved
    assert len(check.angles) == 2401
    slowest = max(np.exp(-ob.RELAXING / viscosity * TIME), np.exp(-2.0 * np.pi * 30.0 * TIME))
    assert check.radius == pytest.approx(np.full(2401, slowest), rel=1e-6)


def test_random_motion_does_not_shake_the_cascade(cascade: ObserverDesign) -> None:
    """Products of error matrices at angles that jump at will shrink as fast as the slowest block."""
    draw = np.random.default_rng(7)
    angles = draw.uniform(-1.2, 1.2, 1500)
    matrices = error_matrices(cascade.model, angles)
    product, sizes = np.eye(3), cascade.step.plant.sizes
    for matrix in matrices:
        product = matrix @ product
    scaled = product * sizes[None, :] / sizes[:, None]
    slowest = np.exp(-ob.RELAXING / ob.SLOW * TIME)
    assert np.max(np.abs(scaled)) < 100.0 * slowest**1500


def test_dry_friction_leaves_the_proof_of_the_force() -> None:
    check = check_stability(
        design_observer_with_details(ob.bench(ob.SLOW, friction=0.02), grid=FixedGrid(-1.2, 1.2)).model
    )
    assert check.proved_inner
    assert not check.proved
    assert np.max(check.radius) < 1.0


def test_dry_friction_does_not_make_the_estimated_speed_chatter() -> None:
    model = ob.bench(ob.SLOW, friction=0.1)
    design = design_observer_with_details(model, grid=GridByTolerance(-1.2, 1.2))
    time = np.arange(0.0, 0.5, TIME)
    record = simulate(model, time, inputs={"motor.current": 1.5 * np.sin(9.0 * time)}, hold=True)
    found = observe(design.model, record)
    # Held at its beginning, the friction of 0.1 N·m would throw the speed from side to side by 0.17 rad/s.
    slow = np.abs(record["motor.speed"]) < 0.01
    assert np.sum(slow) > 20
    assert np.max(np.abs(found["motor.speed"])[slow]) < 0.05


@pytest.mark.long_cases("-1500.0-111", "-60.0-441", "-1500.0-441")
@pytest.mark.parametrize("points", [111, 441])
@pytest.mark.parametrize("first", [-60.0, -1500.0])
def test_pole_placement_is_unstable_between_its_grid_points(points: int, first: float) -> None:
    """Next to zero, where the gain of the force falls from its largest value to none, whatever the grid.

    The printed actuator without dry friction: its lever arm jumps at zero angle.
    """
    actuator = declare(load_deck("austin2015_as_printed")).with_values({"dry_friction.sliding_effort": 0.0})
    model = flatten(actuator, outputs=["motor.angle", "spring.torque"])
    grid = FixedGrid(-1.1, 1.1, points=points)
    check = check_stability(
        design_observer_with_details(model, gain=PolePlacement((first, -80.0, -100.0)), grid=grid).model
    )
    assert np.max(check.radius[::10]) < 0.95  # at the grid points the poles are where they were placed
    angle, worst = check.worst
    assert worst > 1.05
    assert 0.0 < abs(angle) < 2.2 / (points - 1)
    assert not check.proved
    cascade = check_stability(design_observer_with_details(model, gain=CascadeGain(), grid=grid).model)
    assert cascade.proved
    assert np.max(cascade.radius) < 0.95


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("deck", ["austin2015_as_printed", "austin2015_figure_consistent"])
def test_the_decks_have_an_observer_that_is_right(deck: str) -> None:
    model = flatten(declare(load_deck(deck)), outputs=["motor.angle", "spring.torque"])
    design = design_observer_with_details(model)
    assert max(design.table_error.values()) <= 2e-3
    time = np.arange(0.0, 1.0, TIME)
    record = simulate(
        model, time, inputs={"motor.current": 2.0 * np.sin(2.0 * np.pi * 1.3 * time)}, hold=True
    )
    error = observe(design.model, record)["spring.torque"] - record["spring.torque"]
    size = np.max(np.abs(record["spring.torque"]))
    assert size > 0.3
    assert np.max(np.abs(error)) < 0.02 * size
    assert rms(error) < 0.005 * size
