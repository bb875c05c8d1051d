"""Driven responses and fits against other integrators, finite differences and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import lsq_linear

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification.equation_error.block import Block, NoiseFloor
from nlsdesign.bench.identification.equation_error.block_response import DrivenBlock
from nlsdesign.bench.identification.equation_error.evidence import Bench, Evidence
from nlsdesign.bench.identification.equation_error.stepping import exact_step, rosenbrock_step, stages_of
from nlsdesign.bench.identification.filters import every
from nlsdesign.bench.identification.least_squares import (
    Fit,
    Parameter,
    declared_parameter,
    fit,
    gauss_newton_step,
    minimise,
    promised_costs,
)
from nlsdesign.bench.identification.records.measurement import Column, Record, RecordSet
from nlsdesign.components import (
    Assembly,
    Driven,
    Encoder,
    ForceSensor,
    LinearElastic,
    Pulley,
    SlidingFillers,
    StrainStiffening,
    StretchyCable,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ConvergenceError, UnknownNameError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace

STEP, RADIUS, AREA, LENGTH = 0.004, 0.012, 1e-4, 0.0125
MODULI, KNOTS, K, ETA = (0.9e6, 0.6e6), (0.0, 0.1), 0.5e6, 2.0e4
TIME = np.arange(1500) * STEP


def angle_of(time: np.ndarray) -> np.ndarray:
    return 0.5 * (1.0 - np.cos(2 * np.pi * 0.8 * time)) + 0.05 * np.sin(2 * np.pi * 3.0 * time) * time / 6.0


def puller(**inside: object) -> Assembly:
    """A specimen on a round pulley, turned by hand; every force is F = f(angle) by a few lines of NumPy."""
    piece = specimen(
        area=AREA,
        rest_length=LENGTH,
        stiff=StrainStiffening(modulus=quantity(MODULI, "Pa", spread=0.2), knots=KNOTS),
        relaxing=series(
            spring=LinearElastic(modulus=quantity(K, "Pa", spread=0.2)),
            dashpot=ViscousMaterial(viscosity=quantity(ETA, "Pa*s", spread=0.5)),
        ),
        **inside,  # type: ignore[arg-type]
    )
    return assembly(
        "puller",
        hand=Driven(),
        spring=tie(through(Pulley(radius=RADIUS), piece=piece), "hand"),
        encoder=Encoder(of="hand.angle", quantum=1e-6),
        cell=ForceSensor(of="spring.piece.force"),
    )


def block_of(declared: Assembly) -> Block:
    (found,) = blocks_of(flatten(declared), ["encoder.reading", "cell.reading"])
    return found


def record_of(force: np.ndarray, role: str = "fit", name: str = "a") -> Record:
    signals = {"encoder.reading": angle_of(TIME), "cell.reading": force}
    trace = Trace(TIME, signals, {"encoder.reading": "rad", "cell.reading": "N"}, name)
    return Record(name, trace, role)  # type: ignore[arg-type]


def force_by_hand(moduli: tuple[float, ...] = MODULI, k: float = K, eta: float = ETA) -> np.ndarray:
    """Independent: ẋ = (ε − x)·k/η by ``solve_ivp``, F = A·(Σkᵢ⟨ε − εᵢ⟩ + k·(ε − x))."""

    def strain(time: np.ndarray | float) -> np.ndarray:
        return RADIUS * angle_of(np.asarray(time)) / LENGTH

    found = solve_ivp(
        lambda t, x: (strain(t) - x) * k / eta, (0.0, TIME[-1]), [0.0], t_eval=TIME, rtol=1e-10, atol=1e-12,
        max_step=STEP,
    )  # fmt: skip
    stiff = sum(m * np.maximum(strain(TIME) - at, 0.0) for m, at in zip(moduli, KNOTS, strict=True))
    return AREA * (stiff + k * (strain(TIME) - found.y[0]))


FREE = [
    "spring.piece.stiff.modulus[1]",
    "spring.piece.stiff.modulus[2]",
    "spring.piece.relaxing.spring.modulus",
    "spring.piece.relaxing.dashpot.viscosity",
]


def test_a_driven_block_answers_like_another_integrator() -> None:
    block = block_of(puller())
    driven = DrivenBlock(block, FREE, records=[record_of(np.zeros_like(TIME))])
    found = driven.respond(
        driven.samples(record_of(np.zeros_like(TIME)), block.model.values), block.model.values
    )
    # Linear interpolation of the angle between samples: relative (ωh)²/8 at most.
    np.testing.assert_allclose(found.output, force_by_hand(), atol=2e-4 * np.max(force_by_hand()))


@pytest.mark.parametrize("inside", [{}, {"fillers": SlidingFillers(modulus=4e5, yield_stress=2e4)}])
def test_derivatives_are_those_of_finite_differences(inside: dict[str, object]) -> None:
    block = block_of(puller(**inside))
    names = [*FREE, "cell.gain"] + [
        f"spring.piece.fillers.{n}" for n in ("modulus", "yield_stress") if inside
    ]
    driven = DrivenBlock(block, names, records=[record_of(np.zeros_like(TIME))])
    values = dict(block.model.values)
    samples = driven.samples(record_of(np.zeros_like(TIME)), values)
    slope = driven.respond(samples, values).slope
    for j, name in enumerate(driven.free):
        h = 1e-5 * values[name]
        up, down = (driven.respond(samples, values | {name: values[name] + s * h}).output for s in (1, -1))
        difference = (up - down) / (2.0 * h)
        assert np.max(np.abs(slope[:, j] - difference)) < 2e-5 * np.max(np.abs(difference)), name


def test_slopes_that_the_output_contradicts_are_refused() -> None:
    """Fillers that slide within a sample: the force is bounded, and its slopes had fifty digits."""
    block = block_of(puller(fillers=SlidingFillers(modulus=4e5, yield_stress=2e4)))
    number = "spring.piece.fillers.yield_stress"
    driven = DrivenBlock(block, [number], records=[record_of(np.zeros_like(TIME))])
    samples = driven.samples(record_of(np.zeros_like(TIME)), block.model.values)
    for sound in (2e4, 200.0):
        driven.respond(samples, {number: sound})
    assert np.all(np.isfinite(driven.output(samples, {number: 100.0})))
    with pytest.raises(ConvergenceError, match="no derivative"):
        driven.respond(samples, {number: 100.0})


def test_the_last_four_answers_of_a_record_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    block, record, asked = block_of(puller()), record_of(force_by_hand()), list[float]()
    driven = DrivenBlock(block, FREE, records=[record])
    samples = driven.samples(record, block.model.values)
    floor = NoiseFloor(every(len(TIME), 1), np.ones_like(TIME), np.ones_like(TIME))
    evidence, respond = Evidence(driven, record, floor, samples), driven.respond
    monkeypatch.setattr(driven, "respond", lambda given, p: (asked.append(p[FREE[0]]), respond(given, p))[1])
    answers = [
        evidence.residual({**block.model.values, FREE[0]: modulus}) for modulus in (1e5, 2e5, 3e5, 4e5, 1e5)
    ]
    assert asked == [1e5, 2e5, 3e5, 4e5]
    assert answers[-1] is answers[0]
    for modulus in (5e5, 1e5):
        again = evidence.residual({**block.model.values, FREE[0]: modulus})
    assert asked[4:] == [5e5, 1e5], "the oldest answer has made room"
    for now, then in zip(again, answers[0], strict=True):
        np.testing.assert_array_equal(now, then)


@pytest.mark.slow
def test_a_stretchy_cable_answers_like_the_implicit_equation_solved_by_bisection() -> None:
    declared, stiffness = puller(), 6e4
    piece = declared.element("spring.piece")
    declared = declared.with_part(
        "spring.piece", StretchyCable(members=(("piece", piece),), stiffness=stiffness)
    )
    block = block_of(declared)
    driven = DrivenBlock(block, [], records=[record_of(np.zeros_like(TIME))])
    found = driven.respond(driven.samples(record_of(np.zeros_like(TIME)), {}), {}).output
    # By hand: Euler with 20 parts per sample for the dashpot, bisection for the split of the extension.
    parts, x, expected = 20, 0.0, [0.0]
    fine = np.linspace(0.0, TIME[-1], (len(TIME) - 1) * parts + 1)
    for count, whole in enumerate(RADIUS * angle_of(fine)[1:], start=1):
        low, high = -0.02, whole + 0.02
        for _ in range(32):
            y = 0.5 * (low + high)
            strain = y / LENGTH
            force = AREA * (
                sum(m * max(strain - e, 0.0) for m, e in zip(MODULI, KNOTS, strict=True)) + K * (strain - x)
            )
            low, high = (y, high) if force < stiffness * (whole - y) else (low, y)
        x += (STEP / parts) * (low / LENGTH - x) * K / ETA
        if count % parts == 0:
            expected.append(stiffness * (whole - low))
    np.testing.assert_allclose(found, expected, atol=4e-3 * max(expected))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'cell.gain'"):
        DrivenBlock(block_of(puller()), ["cell.gian"], records=[])


# --- steps ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("decay", [0.01, 3.0, 80.0, 3000.0])
def test_exact_steps_are_those_of_the_matrix_exponential(decay: float) -> None:
    a = np.array([[-decay, 0.3], [0.0, -0.5]])
    h = 0.02
    table = np.array(ca.DM(ca.evalf(exact_step(ca.SX(ca.DM(a)), ca.SX(h)))))
    # Van Loan: exp of [[A, I, 0], [0, 0, I], [0, 0, 0]]·h holds φ₀, h·φ₁ and h²·φ₂.
    big = np.zeros((6, 6))
    big[:2, :2], big[:2, 2:4], big[2:4, 4:6] = a, np.eye(2), np.eye(2)
    whole = expm(big * h)
    phi0, hphi1, hhphi2 = whole[:2, :2], whole[:2, 2:4], whole[:2, 4:6]
    expected = np.hstack([phi0, hphi1 - hhphi2 / h, hhphi2 / h])
    np.testing.assert_allclose(table, expected, rtol=1e-6, atol=1e-10)


def test_stages_put_the_driver_before_the_driven_and_know_what_is_linear() -> None:
    x, u, p = ca.SX.sym("x", 4), ca.SX.sym("u"), ca.SX.sym("p")
    # x3 drives x0 and x1, which act on each other; x2 is nonlinear and drives nobody.
    f = ca.vertcat(-p * x[0] + x[1] + x[3], x[0] - 3 * x[1], x[0] - x[2] ** 3, u - x[3])
    found = stages_of(f, x, u)
    order = [stage.states for stage in found]
    assert order.index([3]) < order.index([0, 1]) < order.index([2])
    assert [stage.linear for stage in found if stage.states == [2]] == [False]
    assert all(stage.linear for stage in found if stage.states != [2])
    (varying,) = stages_of(-u * x[0], x[0], u)
    assert not varying.linear


def test_rosenbrock_steps_are_of_second_order_and_stable_when_stiff() -> None:
    x, v0, v1 = (ca.SX.sym(n) for n in ("x", "v0", "v1"))

    def end(decay: float, count: int) -> float:
        h = 1.0 / count
        new = rosenbrock_step(lambda s, v: -decay * (s - v) ** 3 - (s - v), x, (v0, v1), None, ca.SX(h))
        step = ca.Function("step", [x, v0, v1], [new])
        value = 0.0
        for k in range(count):
            value = float(step(value, np.sin(3 * k * h), np.sin(3 * (k + 1) * h)))
        return value

    exact = solve_ivp(
        lambda t, y: -2.0 * (y - np.sin(3 * t)) ** 3 - (y - np.sin(3 * t)),
        (0, 1),
        [0.0],
        rtol=1e-11,
        atol=1e-12,
    ).y[0, -1]
    errors = [abs(end(2.0, n) - exact) for n in (10, 20)]
    assert 3.2 < errors[0] / errors[1] < 4.8
    assert abs(end(1e8, 20)) < 1.1


# --- fits -------------------------------------------------------------------------------------------


def bench_of(records: list[Record], block: Block) -> Bench:
    columns = (Column("a", "encoder.reading", "rad", quantum=1e-6), Column("f", "cell.reading", "N"))
    return Bench(RecordSet(tuple(records), columns), [block])


def test_a_fit_finds_the_numbers_behind_noisy_records_within_its_own_errors() -> None:
    truth = dict(zip(FREE, (0.85e6, 0.7e6, 0.55e6, 2.4e4), strict=True))
    clean = force_by_hand((0.85e6, 0.7e6), 0.55e6, 2.4e4)
    block = block_of(puller())
    driven = DrivenBlock(block, FREE, records=[record_of(np.zeros_like(TIME))])
    parameters = [declared_parameter(block.model.variable(n)) for n in FREE]
    beyond = []
    for seed in range(6):
        force = clean + 0.3 * np.random.default_rng(seed).standard_normal(len(TIME))
        record = record_of(force)
        found = fit(bench_of([record], block).evidence(driven, [record], block.model.values), parameters)
        assert found.converged
        beyond += [(found.values[n] - truth[n]) / found.standard_error(n) for n in FREE]
    # 24 numbers: their errors have the size that the fit claims.
    assert 0.5 < np.sqrt(np.mean(np.square(beyond))) < 1.6


def test_prior_z_scores_say_how_far_the_numbers_have_left_their_declaration() -> None:
    block = block_of(puller())
    driven = DrivenBlock(block, FREE, records=[record_of(np.zeros_like(TIME))])
    record = record_of(
        force_by_hand((1.15 * 0.9e6, 0.6e6)) + 0.05 * np.random.default_rng(1).standard_normal(len(TIME))
    )
    evidence = bench_of([record], block).evidence(driven, [record], block.model.values)
    scores = fit(evidence, [declared_parameter(block.model.variable(n)) for n in FREE]).prior_z_scores()
    # The prior's deviation is ln(1.2).
    assert scores[FREE[0]] == pytest.approx(np.log(1.15) / np.log(1.2), abs=0.1)
    assert abs(scores[FREE[1]]) < 0.3


def test_what_the_records_cannot_tell_is_said_in_words() -> None:
    block = block_of(puller())
    driven = DrivenBlock(block, [*FREE, "cell.gain"], records=[record_of(np.zeros_like(TIME))])
    record = record_of(force_by_hand() + 0.1 * np.random.default_rng(2).standard_normal(len(TIME)))
    evidence = bench_of([record], block).evidence(driven, [record], block.model.values)
    open_ended = [
        Parameter(n, "", v, v, float("inf"), v / 50, v * 50, "log")
        for n, v in ((n, block.model.values[n]) for n in driven.free)
    ]
    (words,) = fit(evidence, open_ended).unidentified()
    # A gain and all stiffnesses together give the same reading.
    assert "cell.gain" in words
    assert "modulus" in words
    assert "up" in words
    assert "down" in words


def test_a_look_ahead_equals_the_fit_of_a_linear_problem() -> None:
    block = block_of(puller())
    names = FREE[:2]
    driven = DrivenBlock(block, names, records=[record_of(np.zeros_like(TIME))])
    record = record_of(
        force_by_hand((0.8e6, 0.5e6)) + 0.1 * np.random.default_rng(3).standard_normal(len(TIME))
    )
    evidence = bench_of([record], block).evidence(driven, [record], block.model.values)
    parameters = [Parameter(n, "Pa", 1e6, 1e6, float("inf"), -1e8, 1e8, "linear", 1e6) for n in names]
    promise = promised_costs(evidence, parameters)
    assert promise.far == pytest.approx(fit(evidence, parameters).cost, rel=1e-4)
    assert promise.near == pytest.approx(promise.far, rel=1e-6)
    cost, ended = gauss_newton_step(evidence, parameters)
    assert cost == pytest.approx(promise.far, rel=1e-6)
    for number in ended:
        assert number.start == pytest.approx(fit(evidence, parameters).values[number.name], rel=1e-3)
    held = promised_costs(evidence, parameters, {names[1]})
    assert held.far == promise.far
    fixed = [parameters[0], replace(parameters[1], lower=1e6 - 1.0, upper=1e6 + 1.0)]
    assert held.near == pytest.approx(fit(evidence, fixed).cost, rel=1e-4)
    assert held.near > 2.0 * held.far
    assert gauss_newton_step(evidence, fixed)[0] == pytest.approx(held.near, rel=1e-4), "inside the bounds"


def test_least_squares_meets_bounds_like_a_solver_for_linear_problems() -> None:
    draw = np.random.default_rng(4)
    matrix, target = draw.standard_normal((30, 5)), draw.standard_normal(30)
    box = (np.full(5, -0.05), np.full(5, 0.08))
    found = minimise(lambda x: (matrix @ x - target, matrix), np.zeros(5), box, evaluations=50)
    best = lsq_linear(matrix, target, box, tol=1e-12)
    assert found.cost == pytest.approx(best.cost, rel=1e-4)
    assert found.converged


def test_least_squares_follows_a_curved_valley_and_steps_around_a_hole() -> None:
    def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if x[0] < -1.5:
            raise ConvergenceError("response", "is not finite")
        value = np.array([100.0 * (x[1] - x[0] ** 2), 10.0 * (1.0 - x[0])])
        return value, np.array([[-200.0 * x[0], 100.0], [-10.0, 0.0]])

    found = minimise(rows, np.array([-1.2, 1.0]), (np.full(2, -5.0), np.full(2, 5.0)), evaluations=200)
    np.testing.assert_allclose(found.x, 1.0, atol=0.02)


def test_a_fit_goes_on_along_what_is_known_least_although_damping_hides_what_is_there() -> None:
    """A common scale of two numbers is known to one part in 10⁴ of what each is: it is still known."""
    scale = 1e4
    matrix = np.array([[scale, -scale], [1.0, 1.0]])
    target = np.array([0.0, 8.0])
    box = np.full(2, -50.0), np.full(2, 50.0)
    found = minimise(lambda x: (matrix @ x - target, matrix), np.zeros(2), box, evaluations=20)
    assert found.converged
    np.testing.assert_allclose(found.x, [4.0, 4.0], atol=0.1)


def test_numbers_that_a_model_is_linear_in_are_found_along_a_narrow_valley() -> None:
    """Viscous friction, dry friction and drag nearly stand for each other in sharp records."""
    speed = 0.3 * np.sin(np.linspace(0.0, 20.0, 400))
    matrix = 1e4 * np.column_stack([speed, np.tanh(speed / 1e-3), speed * np.abs(speed)])
    true = np.array([160.0, 15.0, 500.0])
    used = 0

    def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nonlocal used
        used += 1
        return matrix @ (np.exp(x) - true), matrix * np.exp(x)

    box = np.log([1.0, 0.1, 0.1]), np.log([1e4, 1e3, 1e5])
    start = np.log([324.0, 7.0, 64.0])
    found = minimise(rows, start, box, evaluations=20, share=1e-3, logarithmic=np.ones(3, dtype=bool))
    np.testing.assert_allclose(np.exp(found.x), true, rtol=1e-4)
    assert used <= 10
    lost = minimise(rows, start, box, evaluations=20, share=1e-3)
    assert lost.cost > 1e6 * max(found.cost, 1.0)


def test_a_straight_step_keeps_within_the_bounds() -> None:
    matrix = 1e3 * np.array([[1.0, 1.0], [1.0, 1.02], [1.0, 0.97]])
    target = matrix @ np.array([2.0, 40.0])

    def rows(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert np.all(x <= box[1] + 1e-12)
        assert np.all(x >= box[0] - 1e-12)
        return matrix @ np.exp(x) - target, matrix * np.exp(x)

    box = np.log([1.0, 1.0]), np.log([30.0, 30.0])
    found = minimise(rows, np.log([25.0, 1.5]), box, evaluations=60, logarithmic=np.ones(2, dtype=bool))
    best = lsq_linear(matrix, target, (np.exp(box[0]), np.exp(box[1])), tol=1e-12)
    np.testing.assert_allclose(np.exp(found.x), best.x, rtol=1e-3)


def test_a_direction_that_many_numbers_share_evenly_is_told_too() -> None:
    """Of sixteen numbers each has a share of 0.25, which is less than what is mentioned otherwise."""
    parameters = tuple(Parameter(f"p{k}", "1", 1.0, 1.0, math.inf, 0.1, 10.0, "log") for k in range(16))
    even = np.full(16, 0.25)
    known = Fit(parameters, {p.name: 1.0 for p in parameters}, np.outer(even, even), 1.0, {}, converged=True)
    (words,) = known.unidentified()
    assert words.startswith("p")
    assert words.endswith("known to 100 % only")


def test_slopes_that_overflow_are_no_place_to_begin_or_to_go_on_from() -> None:
    """A strange model beside badly declared numbers answers with 1e200: one start less, not a crash."""

    def steep(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([1.0, x[0] - 1.0]), np.array([[1e200, 1e200], [1.0, 0.0]])

    box = np.full(2, -5.0), np.full(2, 5.0)
    with pytest.raises(ConvergenceError, match="slopes that are not finite"):
        minimise(steep, np.zeros(2), box, evaluations=20)

    def steep_beyond(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([x[0] - 1.0]), np.array([[1.0 if x[0] < 0.5 else 1e200]])

    found = minimise(steep_beyond, np.zeros(1), (np.full(1, -5.0), np.full(1, 5.0)), evaluations=20)
    assert np.isfinite(found.cost)
    assert found.x[0] < 0.5
