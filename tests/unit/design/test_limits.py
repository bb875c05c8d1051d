"""Limits: their numbers, units and slips, and what each of them bounds."""

from __future__ import annotations

import re
from collections.abc import Callable
from inspect import isabstract
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign import design
from nlsdesign.components import Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.transmission.cam_drive import through
from nlsdesign.design import (
    AnchorDistance,
    AreaRange,
    DesignSettings,
    Limit,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumLastingStrain,
    MaximumStrain,
    MaximumStress,
    MaximumTorqueError,
    MinimumRadiusOfCurvature,
    PositiveStiffness,
    PretensionRange,
    RestLengthRange,
    design_cam,
)
from nlsdesign.design.optimisation import limits
from nlsdesign.design.optimisation.design_search import row_of, spans_of
from nlsdesign.design.optimisation.problem import design_problem
from nlsdesign.design.optimisation.program import Program, Rows
from nlsdesign.design.optimisation.shape import Start
from nlsdesign.foundation.errors import ArrangementError, UnitError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, KEEP, RUBBER, TARGET, actuator


def test_quantities_and_bare_numbers_are_the_same() -> None:
    assert MaximumCamRadius(quantity(20.0, "mm")) == MaximumCamRadius(0.02)
    assert MaximumStrain(quantity(100.0, "%")) == MaximumStrain(1.0)


def test_every_limit_of_the_package_is_handed_out() -> None:
    own = [kind for kind in vars(limits).values() if isinstance(kind, type) and issubclass(kind, Limit)]
    names = {kind.__name__ for kind in own if not isabstract(kind)}
    assert "MaximumCamRadius" in names
    assert not names - set(design.__all__), "add them to nlsdesign/design/__init__.py"


def test_every_curve_limit_and_goal_stands_in_a_how_to(root: Path) -> None:
    pages = "".join(page.read_text(encoding="utf-8") for page in (root / "docs" / "how_to").glob("*.md"))
    bases = (Limit, design.Target, design.Goal, design.TaskGoal)
    names = {name for base in bases for name in design.kinds(base) if name in design.__all__}
    assert len(names) > 30
    assert not {name for name in names if not re.search(rf"\b{name}\b", pages)}


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: MinimumRadiusOfCurvature(1.0), ValueRangeError, r"was 'mm' meant\? quantity\(1, 'mm'\)"),
        (lambda: MaximumCamRadius(20.0), ValueRangeError, "was 'mm' meant"),
        (lambda: MaximumCamRadius(quantity(20.0, "N")), UnitError, "unit like 'm'"),
        (lambda: AreaRange(50.0, 100.0), ValueRangeError, r"was 'mm\^2' meant"),
        (lambda: MaximumStress(5.17), ValueRangeError, "was 'MPa' meant"),
        (lambda: MaximumStress(5e6, safety_factor=0.5), ValueRangeError, "safety_factor = 0.5"),
        (lambda: PretensionRange(5e-3, 3e-3), ValueRangeError, "minimum exceeds the maximum"),
        (lambda: MaximumStrain(float("nan")), ValueRangeError, "strain = nan"),
        (lambda: MaximumLastingStrain(quantity(1.0, "mm")), UnitError, "unit like '1'"),
    ],
)
def test_slips_are_named(make: Callable[[], Limit], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()


# Limit; a value at the starting point that it bounds, found by hand from the design's own numbers.
QUICK = DesignSettings(look_for_size_ranges=False, draws=0, starts=2)
BOUNDED = [
    (MinimumRadiusOfCurvature(1e-3), "radius of curvature >= 1 mm"),
    (MaximumCamRadius(20e-3), "cam radius <= 20 mm"),
    (MaximumStrain(0.8), "strain of spring.rubber <= 0.8"),
    (MaximumLastingStrain(0.8), "strain at rest of spring.rubber <= 80 %"),
    (MaximumStress(quantity(5.17, "MPa"), safety_factor=2.0), "stress of spring.rubber <= 2.585 MPa"),
    (MaximumCableTension(150.0), "cable tension <= 150 N"),
    (PositiveStiffness(0.5), "tangent stiffness >= 0.5 N·m/rad"),
    (MaximumTorqueError(quantity(30.0, "mN·m")), "rms torque error <= 30 mN·m"),
    (PretensionRange(1e-3, 5e-3), "spring.pretension >= 1 mm"),
    (AreaRange(80e-6, 200e-6), "spring.rubber.area >= 80 mm²"),
    (RestLengthRange(10e-3, 30e-3), "spring.rubber.rest_length >= 10 mm"),
    (AnchorDistance(20e-3, 30e-3), "spring.cam.anchor_distance >= 20 mm"),
]


@pytest.mark.parametrize(("limit", "text"), BOUNDED, ids=[type(item).__name__ for item, _ in BOUNDED])
def test_each_limit_says_what_it_bounds(limit: Limit, text: str) -> None:
    machine = actuator(CONCAVE, pretension=2e-3)
    problem = design_problem(
        flatten(machine), machine["spring.cam"], target=TARGET, free=RUBBER, spring="spring"
    )
    start = problem.at(Start(0.5, 0.3, {}))
    first, *rest = limit.bounds(problem.design)
    assert (first.limit, str(first)) == (type(limit).__name__, text)
    assert len(rest) == (1 if hasattr(limit, "maximum") else 0)
    # The row is the distance from the bound in units of its scale; a slack of 1 gives way by one scale.
    row = row_of(first)
    assert (row.lower, row.upper) == ((-np.inf, 0.0) if first.upper else (0.0, np.inf))
    values = problem.evaluate(first.expression, start)
    assert problem.evaluate(row.expression, start) == pytest.approx((values - first.value) / first.scale)
    softened = problem.evaluate(row_of(first, 1.0).expression, start)
    shift = -1.0 if first.upper else 1.0
    assert softened == pytest.approx((values - first.value) / first.scale + shift)


# Each limit that binds must hold in the finished assembly, measured on it and not in the optimiser.
@pytest.mark.long_cases("radius", "strain", "tension", "stress", "pretension")
@pytest.mark.parametrize(
    ("limit", "measure"),
    [
        (MaximumStress(quantity(1.4, "MPa")), lambda d: -_force(d)[-1] / 1e-4 + 1.4e6),
        (MaximumCableTension(140.0), lambda d: 140.0 - _force(d)[-1]),
        (PretensionRange(0.0, 2e-3), lambda d: 2e-3 - d.values["spring.pretension"].number),
        (MaximumCamRadius(16e-3), lambda d: 16e-3 - d.contour.radii.max()),
        (MaximumStrain(0.9), lambda d: 0.9 - _extension(d)[-1] / 12.5e-3),
        (MaximumLastingStrain(0.2), lambda d: 0.2 - d.values["spring.pretension"].number / 12.5e-3),
    ],
    ids=["stress", "tension", "pretension", "radius", "strain", "lasting"],
)
def test_an_active_limit_is_kept_and_named(limit: Limit, measure: Callable[[object], float]) -> None:
    keep = [*KEEP, limit]
    found = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER[:2], keep=keep, settings=QUICK)
    assert type(limit).__name__ in found.active_limits
    room = measure(found)
    # The declared cam holds the contour to parts in 1e5.
    scale = max(state.bound for state in found.limits if state.limit == type(limit).__name__)
    assert room == pytest.approx(0.0, abs=1e-4 * scale)


def test_limits_of_rubber_need_rubber() -> None:
    machine = actuator(CONCAVE)
    spring = tie(through(machine["spring.cam"], wire=Spring(stiffness=9e3)), "motor", "load")
    wire = assembly("wire", motor=machine["motor"], load=machine["load"], spring=spring)
    with pytest.raises(ArrangementError, match="has no specimen behind its cam"):
        design_cam(wire, target=TARGET, free=["spring.cam.contour"], keep=[MaximumStrain(1.0)])


def _extension(found: object) -> np.ndarray:
    model = flatten(found.actuator)
    angle = found.target.last_angle
    state = [angle if v.name == "motor.angle" else 0.0 for v in model.states]
    return np.array([model.evaluate(state)["spring.rubber.extension"]])


def _force(found: object) -> np.ndarray:
    stretch = 1 + _extension(found) / 12.5e-3
    return 84.56 * (stretch - stretch**-2)


def test_a_program_without_anything_to_make_small_is_solved() -> None:
    """So is asked whether any cam keeps the rules of the contour, where there is no limit that could give."""
    unknown = ca.SX.sym("x")
    rows = (Rows(unknown * unknown, 4.0, 4.0),)
    program = Program(unknown, np.array([0.0]), np.array([9.0]), ca.SX(1, 1), rows)
    solution = program.solve(np.array([1.0]))
    assert solution.solved
    assert solution.point[0] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ((0, 1, 2), "from 0° to 2°"),
        ((0, 2, 4, 8), "from 0° to 4° and at 8°"),
        ((0, 3, 6), "at 0° and at 3° and at 6°"),
        ((1, 4, 7, 8, 11), "in 4 places from 1° to 11°"),
    ],
)
def test_where_something_holds_is_said_in_few_ranges(nodes: tuple[int, ...], words: str) -> None:
    angles = np.radians(np.arange(13.0))
    assert spans_of(angles, np.isin(np.arange(13), nodes)) == words
