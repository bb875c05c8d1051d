"""Steady cycles of a designed cam against time integration of the network written by hand.

The cam is a table made from the numbers of the declared part; the rubber is a neo-Hookean spring with Maxwell
branches, integrated by scipy until the cycles repeat. No equation of the package takes part.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from nlsdesign.components import (
    Assembly,
    Element,
    Fixed,
    Inertia,
    LinearElastic,
    OneSidedCam,
    TwoSidedCam,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import BothStrokes, EnergyLost, ExponentialTorque, Goal, TorqueError
from nlsdesign.design.optimisation.problem import DesignProblem, design_problem
from nlsdesign.design.optimisation.shape import Start
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE

LAST = 0.9
TARGET = ExponentialTorque(maximum=2.0, angle=LAST, shape=1.0)
AREA, LENGTH, PRETENSION, ELEMENTS = 1e-4, 12.5e-3, 2e-3, 2.0
MODULUS = 0.58e6
ARMS = 0.006 + 0.008 * np.linspace(0.0, 1.0, 9) ** 1.5

Curve = Callable[[np.ndarray], np.ndarray]


class Branch(NamedTuple):
    """Spring and dashpot in series, in Pa and Pa·s."""

    modulus: float
    viscosity: float

    @property
    def part(self) -> Element:
        spring, dashpot = LinearElastic(modulus=self.modulus), ViscousMaterial(viscosity=self.viscosity)
        return series(spring=spring, dashpot=dashpot)


SLOW, FAST = Branch(MODULUS, 3.0e4), Branch(0.3e6, 2.0e3)


def machine(*branches: Branch, damping: float = 0.0, one_sided: bool = False) -> Assembly:
    inside = {f"branch{i}": branch.part for i, branch in enumerate(branches)}
    if damping:
        inside["damping"] = ViscousMaterial(viscosity=damping)
    rubber = specimen(area=AREA, rest_length=LENGTH, stiff=CONCAVE, **inside)
    row = tuple(float(value) for value in ARMS)
    cam = (
        OneSidedCam(lever_arm=row, last_angle=LAST, elements=ELEMENTS, onset=1e-6)
        if one_sided
        else TwoSidedCam(lever_arm=row, last_angle=LAST, elements=ELEMENTS, changeover=1e-6)
    )
    spring = tie(through(cam, rubber=rubber, pretension=PRETENSION), "wheel", "load")
    return assembly("bench", wheel=Inertia(inertia=1e-3), load=Fixed(), spring=spring)


def given(made: Assembly) -> DesignProblem:
    return design_problem(flatten(made), made["spring.cam"], target=TARGET, free=["spring.pretension"])


def value(problem: DesignProblem, goal: Goal, point: np.ndarray | None = None) -> float:
    start = problem.completed({}) if point is None else point
    return float(problem.evaluate(goal.measured(problem.design).expression, start)[0])


class Cycle(NamedTuple):
    """Energies in J and mean square torque error in (N·m)²."""

    lost: float
    stored: float
    mean_square: float


def by_integration(
    arm: Curve, frequency: float, amplitude: float, branches: tuple[Branch, ...], *,
    damping: float = 0.0, one_sided: bool = False, pretension: float = PRETENSION,
) -> Cycle:  # fmt: skip
    """Drive the network with a sine until it repeats, then take one stretch of the rubber."""
    grid = np.linspace(0.0, amplitude, 4001)
    taken = CubicSpline(grid, arm(grid)).antiderivative()
    period = 1.0 / frequency if one_sided else 0.5 / frequency

    def angle(time: np.ndarray) -> np.ndarray:
        turn = 2.0 * np.pi * frequency * time
        return amplitude * ((1.0 - np.cos(turn)) / 2.0 if one_sided else np.abs(np.sin(turn)))

    def strain(time: np.ndarray) -> np.ndarray:
        return (pretension + taken(np.minimum(angle(time), amplitude))) / LENGTH

    def relaxed(time: float, inner: np.ndarray) -> list[float]:
        total = float(strain(np.array(time)))
        return [b.modulus * (total - x) / b.viscosity for b, x in zip(branches, inner, strict=True)]

    slowest = max([b.viscosity / b.modulus for b in branches], default=0.0)
    begin = (np.ceil(25.0 * slowest / period) + 1.0) * period
    time = begin + np.linspace(0.0, period, 4001)
    first = np.full(len(branches), float(strain(np.array(0.0))))
    inner = np.zeros((0, time.size))
    if branches:
        inner = solve_ivp(
            relaxed, (0.0, time[-1]), first, t_eval=time, rtol=1e-10, atol=1e-13, max_step=period / 50
        ).y
    total, theta = strain(time), angle(time)
    stretch = 1.0 + total
    static = AREA * 0.8456e6 * (stretch - stretch**-2)
    moduli = np.array([b.modulus for b in branches]).reshape(-1, 1)
    force = static + AREA * (moduli * (total - inner)).sum(axis=0)
    force = force + AREA * damping * np.gradient(total, time, edge_order=2)
    extension = total * LENGTH
    half = time.size // 2
    lost = ELEMENTS * np.trapezoid(force, extension)
    stored = ELEMENTS * np.trapezoid(static[: half + 1], extension[: half + 1])
    errors = (ELEMENTS * arm(theta) * force - TARGET.torque(theta)) ** 2
    up, down = slice(0, half + 1), slice(half, None)
    mean = np.trapezoid(errors[up], theta[up]) - np.trapezoid(errors[down], theta[down])
    return Cycle(float(lost), float(stored), float(mean / (2.0 * amplitude)))


@cache
def declared_arm() -> CubicSpline:
    """Lever arm of the declared control values: a uniform cubic B-spline, written out."""
    spans = len(ARMS) - 3
    u = np.linspace(0.0, spans, 2001)
    k = np.minimum(u.astype(int), spans - 1)
    s = u - k
    weights = [(1 - s) ** 3, 3 * s**3 - 6 * s**2 + 4, -3 * s**3 + 3 * s**2 + 3 * s + 1, s**3]
    arm = sum(w * ARMS[k + i] for i, w in enumerate(weights)) / 6.0
    return CubicSpline(LAST * u / spans, arm)


CASES = {
    "one branch": ((SLOW,), 0.0, False, None),
    "two branches": ((SLOW, FAST), 0.0, False, None),
    "part of the range": ((SLOW, FAST), 0.0, False, 0.55),
    "a dashpot beside them": ((SLOW,), 4e3, False, None),
    "a dashpot alone": ((), 4e3, False, None),
    "one-sided": ((SLOW, FAST), 0.0, True, None),
    "one-sided, part": ((SLOW,), 4e3, True, 0.5),
}


@pytest.mark.slow
@pytest.mark.long_cases(
    "two branches-0.3",
    "one-sided, part-0.3",
    "a dashpot alone-0.3",
    "a dashpot alone-4.0",
    "a dashpot beside them-0.3",
    "one branch-0.3",
    "one branch-4.0",
    "one-sided-0.3",
    "one-sided-4.0",
    "one-sided, part-4.0",
    "part of the range-0.3",
    "part of the range-4.0",
    "two branches-4.0",
)
@pytest.mark.parametrize("frequency", [0.3, 4.0])
@pytest.mark.parametrize("case", CASES)
def test_losses_and_both_strokes_are_those_of_the_integrated_network(case: str, frequency: float) -> None:
    branches, damping, one_sided, amplitude = CASES[case]
    problem = given(machine(*branches, damping=damping, one_sided=one_sided))
    reach = amplitude or LAST
    cycle = by_integration(declared_arm(), frequency, reach, branches, damping=damping, one_sided=one_sided)
    assert cycle.lost / cycle.stored > 1e-3, "nothing would be compared"
    lost = value(problem, EnergyLost(frequency, amplitude))
    assert lost == pytest.approx(cycle.lost / cycle.stored, rel=2e-3)
    error = value(problem, BothStrokes((frequency,), amplitude))
    assert error == pytest.approx(np.sqrt(cycle.mean_square), rel=1e-3)


@pytest.mark.slow
def test_a_band_is_the_mean_of_its_frequencies() -> None:
    problem = given(machine(SLOW))
    cycles = [by_integration(declared_arm(), f, LAST, (SLOW,)) for f in (0.3, 1.0, 4.0)]
    wanted = np.sqrt(np.mean([cycle.mean_square for cycle in cycles]))
    assert value(problem, BothStrokes((0.3, 1.0, 4.0))) == pytest.approx(wanted, rel=1e-3)


@pytest.mark.slow
def test_a_free_contour_on_its_way_has_the_cycle_of_its_own_nodes() -> None:
    """Angles of the nodes depend on the contour there; part of the range ends between nodes."""
    made = machine(SLOW, FAST)
    made = made.with_part("spring.cam", TwoSidedCam(
        lever_arm=tuple(map(float, ARMS)), last_angle=LAST, elements=ELEMENTS, anchor_distance=30e-3
    ))  # fmt: skip
    free = ["spring.cam.contour", "spring.pretension"]
    problem = design_problem(flatten(made), made["spring.cam"], target=TARGET, free=free)
    point = problem.at(Start(0.5, 0.3, {}))
    design = problem.design
    angles, arms = (problem.evaluate(e, point) for e in (design.angles, design.lever_arms))
    pretension = problem.named(point)["spring.pretension"]
    assert abs(angles[-1] - LAST) > 0.01, "the contour is not yet as long as the target"
    arm = CubicSpline(angles, arms)
    for frequency in (0.3, 4.0):
        cycle = by_integration(arm, frequency, 0.5, (SLOW, FAST), pretension=pretension)
        assert value(problem, EnergyLost(frequency, 0.5), point) == pytest.approx(
            cycle.lost / cycle.stored, rel=2e-3
        )
        assert value(problem, BothStrokes((frequency,), 0.5), point) == pytest.approx(
            np.sqrt(cycle.mean_square), rel=1e-3
        )


def test_slow_cycles_are_the_static_law() -> None:
    problem = given(machine(SLOW, FAST))
    assert value(problem, EnergyLost(1e-5)) < 1e-5
    assert value(problem, BothStrokes((1e-5,))) == pytest.approx(value(problem, TorqueError()), rel=1e-3)


@pytest.mark.slow
def test_fast_cycles_have_the_instantaneous_modulus() -> None:
    """The branches do not move about the mean strain of a cycle, and the torque has their modulus on top."""
    problem = given(machine(SLOW))
    assert value(problem, EnergyLost(9e3)) < 1e-4
    phase = np.linspace(0.0, np.pi / 2, 20001)
    theta = LAST * np.sin(phase)
    total = (PRETENSION + declared_arm().antiderivative()(theta)) / LENGTH
    stretch = 1.0 + total
    mean = np.trapezoid(total, phase) / phase[-1]
    force = AREA * (0.8456e6 * (stretch - stretch**-2) + MODULUS * (total - mean))
    errors = (ELEMENTS * declared_arm()(theta) * force - TARGET.torque(theta)) ** 2
    wanted = np.sqrt(np.trapezoid(errors, theta) / LAST)
    assert value(problem, BothStrokes((9e3,))) == pytest.approx(wanted, rel=1e-3)


@pytest.mark.slow
def test_a_round_cam_loses_what_complex_stiffness_says() -> None:
    """On a round cam the strain is a sine; its loss is π·E″ per volume and amplitude squared."""
    made = machine(SLOW, one_sided=True).with_part(
        "spring.cam", OneSidedCam(lever_arm=(0.01,) * 9, last_angle=LAST, elements=ELEMENTS, onset=1e-6)
    )
    frequency = 0.8
    ratio = 2 * np.pi * frequency * SLOW.viscosity / SLOW.modulus
    loss_modulus = SLOW.modulus * ratio / (1 + ratio**2)
    for amplitude in (0.25 * LAST, 0.6, LAST):
        strain = 0.01 * amplitude / LENGTH
        stretch = 1.0 + (PRETENSION / LENGTH + np.array([0.0, strain]))
        energy = AREA * LENGTH * 0.8456e6 * np.diff(stretch**2 / 2 + 1 / stretch)[0]
        lost = np.pi * loss_modulus * (strain / 2) ** 2 * AREA * LENGTH
        found = value(given(made), EnergyLost(frequency, amplitude))
        assert found == pytest.approx(lost / energy, rel=2e-3)
