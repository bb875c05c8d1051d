"""The default observer: what its factors tell is derived by hand, what it costs and gains is measured in
runs.

The machines are those of ``benchmarks/default_machine.c``, which shares nothing with the package.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from benchmarks._default_machines import RUBBER, SINGLE, Course, Run
from benchmarks.observer_defaults import (
    Observer,
    coordinates,
    drawn,
    judged,
    kinds,
    known_of,
    ratio,
    spring_share,
)
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.observer import CorrectedDesign, Duty, design_corrected_observer
from nlsdesign.feedback.observer.corrected.balance import DRIVE, OFFSET, RELAXING, REST
from nlsdesign.feedback.observer.corrected.correction_equations import rest_torque
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.model import FlatModel
from nlsdesign.simulation.prior import Prior, declared_prior

PUBLISHED, LINEAR = "austin2015_figure_consistent", "austin2015_soft_spring"


@cache
def deck(name: str) -> FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(name)))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Course, Prior, dict[str, Observer]]:
    folder = tmp_path_factory.mktemp("corrected")
    course, prior = Course(deck(PUBLISHED), folder), known_of(deck(PUBLISHED))
    return course, prior, kinds(deck(PUBLISHED), course, prior, folder, ["cascade", "default"])


def errors(bench: tuple[Course, Prior, dict[str, Observer]], run: Run) -> tuple[np.ndarray, np.ndarray]:
    course, _, observers = bench
    alone, corrected = (judged(course, observer, [run])[0][0] for observer in observers.values())
    return alone, corrected


def sure(names: dict[str, float]) -> Prior:
    known = declared_prior(deck(LINEAR)).only(list(names))
    return Prior(known.names, known.values, np.diag(np.square(list(names.values()))))


def test_factors_of_a_linear_spring_tell_what_is_derived_by_hand() -> None:
    """ln k − ln J and ln s − ln J are seen; E[ln s] = σs²·(σk² + σJ²)-weighted, from Σ⁻¹ of three normals."""
    drive, inertia, spring = 0.1, 0.08, 0.05
    names = {"motor.torque_constant": drive, "motor.inertia": inertia, "spring.stiffness": spring}
    found = design_corrected_observer(deck(LINEAR), prior=sure(names), duty=Duty(torque=1.5)).balance
    assert found.terms[:2] == (DRIVE, REST)
    assert found.terms[-1] == OFFSET
    assert RELAXING not in found.terms
    np.testing.assert_allclose(
        found.deviations[:2], [math.hypot(drive, inertia), math.hypot(spring, inertia)], 1e-3
    )
    seen = np.array([[drive**2 + inertia**2, inertia**2], [inertia**2, spring**2 + inertia**2]])
    expected = np.linalg.solve(seen, [0.0, spring**2])
    # Friction falls with the inertia too, and tells of it.
    assert found.slopes.shape == (2, len(found.terms))
    common = 1.0 / (1.0 / drive**2 + 1.0 / inertia**2 + 1.0 / spring**2)
    left = spring**2 - expected @ [0.0, spring**2]
    assert left == pytest.approx(common, rel=1e-9)
    assert 0.0 <= found.unseen[0, 0] <= left * 1.001


def test_an_exact_deck_costs_nothing_whatever_the_current_meter_does(
    bench: tuple[Course, Prior, dict[str, Observer]],
) -> None:
    course = bench[0]
    run = course.run(course.declared)
    noise = 0.5 * np.random.default_rng(7).standard_normal(len(run.current))
    for current in (run.current, run.current + 0.2 + noise):
        alone, corrected = errors(bench, Run(run.angle, current, run.torque))
        assert np.all(corrected <= np.maximum(1.5 * alone, 3e-3))


def test_what_no_deck_declares_does_not_make_it_worse_than_the_cascade_by_much(
    bench: tuple[Course, Prior, dict[str, Observer]],
) -> None:
    course = bench[0]
    second, coarse = course.declared.copy(), course.declared.copy()
    first = second[SINGLE.index(f"{RUBBER}.relaxing.spring.modulus")]
    second[SINGLE.index("second.modulus")] = 0.3 * first
    second[SINGLE.index("second.viscosity")] = 0.15 * first
    coarse[SINGLE.index("motor_encoder.quantum")] = 2.0 * math.pi / 512
    for machine in (second, coarse):
        alone, corrected = errors(bench, course.run(machine))
        assert np.all(corrected <= 1.5 * alone)


def test_over_the_spread_it_errs_less_than_the_cascade_and_says_how_much(
    bench: tuple[Course, Prior, dict[str, Observer]],
) -> None:
    course, prior, observers = bench
    runs = [course.run(drawn(course, prior, x)) for x in coordinates(prior, 12, 4)]
    alone, _ = judged(course, observers["cascade"], runs)
    corrected, said = judged(course, observers["default"], runs)
    assert np.all(np.sqrt(np.mean(corrected**2, axis=0)) < 0.8 * np.sqrt(np.mean(alone**2, axis=0)))
    assert np.mean(corrected > 2.0 * said) <= 0.1
    # What it says is at least what no estimator can know of a common scale, and less than the cascade's.
    assert np.all(said < spring_share(course, prior) * 2.8)


def test_a_number_three_spreads_off_costs_less_than_the_simpler_observer_that_hears_it(
    bench: tuple[Course, Prior, dict[str, Observer]],
) -> None:
    """Beside a wrong rubber the cascade is the measure, beside a wrong torque constant a single ratio."""
    course, prior, observers = bench
    spring = np.array([n.endswith("area") or "modulus" in n for n in prior.names])
    drive = np.array([n.endswith("torque_constant") for n in prior.names])
    simpler = {"rubber": observers["cascade"], "drive": ratio(course, observers["cascade"], prior)}
    for (what, other), off in zip(simpler.items(), (spring, drive), strict=True):
        run = course.run(drawn(course, prior, 3.0 * prior.deviations * off))
        simple, default = (judged(course, o, [run])[0][0] for o in (other, observers["default"]))
        assert np.all(default < (0.5 if what == "rubber" else 0.9) * simple), what


@cache
def corrected() -> CorrectedDesign:
    return design_corrected_observer(deck(PUBLISHED))


def estimates(folder: Path, angle: np.ndarray, current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    step = CompiledStep(nls.export_c(corrected().model, folder, name="observer", real="float"))
    both = [step([a, c]) for a, c in zip(angle, current, strict=True)]
    return np.array([y for y, _ in both]), np.array([status for _, status in both])


@pytest.mark.long_cases("frozen-2300-1000", "long jump-2200-40", "frozen-3300-100")
@pytest.mark.parametrize(
    ("fault", "first", "length"),
    [("jump", 2200, 3), ("long jump", 2200, 40), ("frozen", 2300, 1000), ("frozen", 3300, 100)],
)
def test_a_fault_is_forgotten_in_three_tenths_of_a_second(
    fault: str, first: int, length: int, bench: tuple[Course, Prior, dict[str, Observer]], tmp_path: Path
) -> None:
    """Within 1 % of 5 N·m of the undisturbed twin, on a machine whose factors are learned."""
    course, prior, _ = bench
    run = course.run(drawn(course, prior, coordinates(prior, 1, 11)[0]))
    undisturbed, _ = estimates(tmp_path, run.angle, run.current)
    seen = run.angle.copy()
    seen[first : first + length] = seen[first] if fault == "frozen" else seen[first : first + length] + 0.6
    disturbed, status = estimates(tmp_path, seen, run.current)
    apart = np.abs(disturbed[:, 0] - undisturbed[:, 0])
    # The encoder's stale time is longer than the shortest of these.
    assert length == 100 or np.any(status[first : first + length])
    assert np.max(apart[first + length + 300 :]) <= 0.01 * 5.0


def test_nothing_is_learned_at_standstill(tmp_path: Path) -> None:
    """Friction holds: a current that the spring does not need says nothing of the spring."""
    design = corrected()
    place = [v.name for v in design.model.outputs].index("correction.factor[1]")
    still = np.full(1500, 0.4 - 0.4 % 0.767e-3)
    learned, _ = estimates(tmp_path, still, np.full(1500, 5.0))
    assert np.max(np.abs(learned[:, place:])[:, : len(design.balance.terms)]) < 0.02


# Quicker: physics/test_single_precision.py
@pytest.mark.slow
def test_single_precision_gives_the_same_torque(
    bench: tuple[Course, Prior, dict[str, Observer]], tmp_path: Path
) -> None:
    course, prior, observers = bench
    run = course.run(drawn(course, prior, coordinates(prior, 1, 11)[0]))
    single, _ = estimates(tmp_path, run.angle, run.current)
    double, _ = observers["default"](run)
    assert np.max(np.abs(single[:, 0] - double)) < 1e-3


def test_a_weight_is_refused_and_the_cascade_taken_without_spreads() -> None:
    known = declared_prior(deck(LINEAR)).only(["spring.stiffness"])
    nothing = Prior(known.names, known.values, np.zeros((1, 1)))
    with pytest.raises(ArrangementError, match="no uncertain numbers"):
        design_corrected_observer(deck(LINEAR), prior=nothing)


def test_the_correction_is_held_within_its_reach() -> None:
    """Factors a hundred deviations off move the torque as far as stated and no further."""
    design = corrected()
    model, angle = design.model, 0.6
    names = [v.name for v in model.states]

    def torque(factor: float) -> float:
        x = model.start(model.states)
        for name, value in design.start(angle).items():
            x[names.index(name)] = value
        x[names.index("correction.evidence")] = 30.0
        x[names.index("correction.factor[2].memory")] = factor
        w = model.look_up(x.tolist(), [angle, 0.0])
        return float(np.array(model.equations(0.0, x, [angle, 0.0], [], w)[1]).ravel()[0])

    rest = float(rest_torque(design.cascade, np.array([angle]))[0])
    x = 3.5 * float(design.balance.alone[0])
    # Three terms of the exponential of 3.5 deviations; the weight is 0.9997, nothing relaxes at rest.
    for sign in (1.0, -1.0):
        expected = sign * x + x**2 / 2.0 + sign * x**3 / 6.0
        assert torque(sign * 100.0) / rest - 1.0 == pytest.approx(expected, rel=0.01)
