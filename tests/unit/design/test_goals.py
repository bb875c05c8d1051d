"""Goals beyond the torque error: their numbers by hand, units and slips, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from nlsdesign.components import Element, LinearElastic, TwoSidedCam, ViscousMaterial, series, specimen
from nlsdesign.components.transmission.cam_drive import through
from nlsdesign.design import BothStrokes, EnergyLost, Goal, LeastMass, LeastRubber, LeastSize, design_cam
from nlsdesign.design.optimisation.goals import InsensitiveStiffness, TorqueError
from nlsdesign.design.optimisation.problem import DesignProblem, design_problem
from nlsdesign.design.optimisation.shape import Start
from nlsdesign.foundation.errors import ArrangementError, UnitError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, CONTOUR, RUBBER, TARGET, actuator


def problem_of(free: list[str] = RUBBER, pretension: float = 2e-3) -> tuple[DesignProblem, np.ndarray]:
    machine = actuator(CONCAVE, pretension=pretension)
    problem = design_problem(flatten(machine), machine["spring.cam"], target=TARGET, free=free)
    return problem, problem.at(Start(0.5, 0.3, {}))


def largest(goal: Goal, problem: DesignProblem, point: np.ndarray) -> float:
    return float(np.max(problem.evaluate(goal.measured(problem.design).expression, point)))


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: EnergyLost(0.0), ValueRangeError, r"EnergyLost: frequency = 0 Hz"),
        (lambda: EnergyLost(quantity(5.0, "rad")), UnitError, "unit like 'Hz'"),
        (lambda: EnergyLost(5.0, 30.0), ValueRangeError, r"were degrees meant\? degrees\(30\)"),
        (lambda: EnergyLost(5.0, weight=-1.0), ValueRangeError, "EnergyLost: weight = -1"),
        (lambda: BothStrokes(()), ValueRangeError, "at least one frequency -> write for instance"),
        (lambda: BothStrokes(5.0), ValueRangeError, r"must be a row of at least one frequency"),
        (lambda: BothStrokes((1.0, float("nan"))), ValueRangeError, "frequency = nan"),
        (lambda: LeastSize(-1.0), ValueRangeError, "LeastSize: weight = -1"),
        (lambda: LeastMass(1.1, 5e-3, 2700.0), ValueRangeError, r"was 'g/cm\^3' meant"),
        (lambda: LeastMass(1100.0, 5.0, 2700.0), ValueRangeError, "was 'mm' meant"),
        (lambda: LeastMass(1100.0, 5e-3, quantity(2.7, "kg")), UnitError, r"unit like 'kg/m\^3'"),
        (lambda: InsensitiveStiffness(0.0), ValueRangeError, "InsensitiveStiffness: deviation = 0"),
    ],
)
def test_slips_are_named(make: Callable[[], Goal], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()


def test_quantities_and_bare_numbers_are_the_same() -> None:
    assert LeastMass(quantity(1.1, "g/cm^3"), quantity(5.0, "mm"), 2700.0) == LeastMass(1100.0, 5e-3, 2700.0)
    assert EnergyLost(quantity(5.0, "Hz")) == EnergyLost(5.0)


def test_size_is_the_largest_radius() -> None:
    problem, point = problem_of()
    radii = problem.evaluate(problem.design.radii, point)
    assert largest(LeastSize(), problem, point) == radii.max()
    (cost,) = problem.evaluate(LeastSize(weight=2.0).cost(problem.design), point)
    assert radii.max() <= cost * 5e-3 <= 1.12 * radii.max()


def test_mass_is_that_of_the_polygon_and_the_rubber() -> None:
    problem, point = problem_of()
    design = problem.design
    phi, p, radii = (problem.evaluate(e, point) for e in (design.directions, design.lever_arms, design.radii))
    # Corners of the contour: p along the normal, p' = √(r² − p²) across.
    slope = np.sqrt(np.maximum(radii**2 - p**2, 0.0))
    x, y = p * np.cos(phi) - slope * np.sin(phi), p * np.sin(phi) + slope * np.cos(phi)
    sector = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    numbers = problem.named(point)
    rubber = 2.0 * numbers["spring.rubber.area"] * numbers["spring.rubber.rest_length"]
    mass = 1100.0 * rubber + 2700.0 * 5e-3 * 2.0 * sector
    goal = LeastMass(1100.0, 5e-3, 2700.0)
    assert largest(goal, problem, point) == pytest.approx(mass, rel=1e-3)
    plates = largest(LeastMass(100.0, 5e-3, 2700.0), problem, point) - 100.0 * rubber
    assert plates == pytest.approx(2700.0 * 5e-3 * 2.0 * sector, rel=2e-3)
    assert largest(LeastRubber(), problem, point) == pytest.approx(rubber)


def test_insensitivity_is_the_change_after_the_pretension_is_trimmed_to_its_force() -> None:
    """Stiffen the neo-Hookean rubber by 0.1 %, trim, and look at the torque anew."""
    problem, point = problem_of(RUBBER[:2])
    design = problem.design
    angles, arms, extensions = (
        problem.evaluate(e, point) for e in (design.angles, design.lever_arms, design.extensions)
    )

    def force(extension: np.ndarray, factor: float) -> np.ndarray:
        stretch = 1.0 + extension / 12.5e-3
        return factor * 84.56 * (stretch - stretch**-2)

    share, wanted = 1e-3, force(extensions[0], 1.0)
    trimmed = extensions[0]
    for _ in range(60):
        trimmed -= (force(trimmed, 1.0 + share) - wanted) / (84.56 / 12.5e-3 * 3.0)
    moved = extensions - extensions[0] + trimmed
    change = 2.0 * arms * (force(moved, 1.0 + share) - force(extensions, 1.0))
    rms = np.sqrt(np.trapezoid(change**2, angles) / TARGET.last_angle)
    assert largest(InsensitiveStiffness(share), problem, point) == pytest.approx(rms, rel=2e-3)
    left = np.sqrt(
        np.trapezoid((2.0 * arms * share * force(extensions, 1.0)) ** 2, angles) / TARGET.last_angle
    )
    assert rms < 0.95 * left


@pytest.mark.slow
def test_a_goal_of_equal_weight_leads_there() -> None:
    """Each goal, added to the torque error, makes small what it is about."""
    machine = actuator(CONCAVE, pretension=2e-3)
    plain = design_cam(machine, target=TARGET, free=RUBBER[:3], keep=[])
    small = design_cam(machine, target=TARGET, free=RUBBER[:3], keep=[], goals=(TorqueError(), LeastSize()))
    assert small.contour.radii.max() < 0.9 * plain.contour.radii.max()
    assert small.met


@pytest.mark.parametrize(("amplitude", "words"), [(1.5, "amplitude = 1.5 rad"), (0.1, "amplitude = 0.1 rad")])
def test_an_amplitude_outside_the_target_is_named(amplitude: float, words: str) -> None:
    with pytest.raises(ValueRangeError, match=rf"{words}.*must lie in \[0.2313, 0.925\] rad"):
        design_cam(actuator(CONCAVE), target=TARGET, free=CONTOUR, goals=[EnergyLost(5.0, amplitude)])


def with_rubber_of(**inside: Element) -> None:
    rubber = specimen(area=1e-4, rest_length=12.5e-3, **inside)
    cam = TwoSidedCam(lever_arm=(0.01,) * 8, last_angle=1.0, elements=2.0, anchor_distance=25e-3)
    machine = actuator(CONCAVE)
    spring = machine["spring"]
    changed = machine.with_part(
        "spring", type(spring)(element=through(cam, rubber=rubber), between=spring.between)
    )
    design_cam(changed, target=TARGET, free=CONTOUR, goals=[BothStrokes((1.0,))])


def test_a_branch_that_is_not_linear_is_refused_by_name() -> None:
    branch = series(spring=CONCAVE, dashpot=ViscousMaterial(viscosity=3e3))
    with pytest.raises(ArrangementError, match=r"'spring\.rubber': relaxes by a law that is not linear"):
        with_rubber_of(stiff=LinearElastic(modulus=1e6), relaxing=branch)
