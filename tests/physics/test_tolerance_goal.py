"""The goal over the spreads against draws of the quadratic form, of made springs, and the nominal design."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import OneSidedCam
from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.design import (
    CamDesign,
    DesignSettings,
    LeastRubber,
    MaximumCableTension,
    PowerTorque,
    RestLengthRange,
    SmoothContour,
    SpreadRules,
    TabulatedTorque,
    Target,
    ToleranceQuantile,
    Trim,
    TrimRoom,
    design_cam,
    equilibrium_torque,
    tolerance_analysis,
)
from nlsdesign.design.optimisation.problem import design_problem
from nlsdesign.design.tolerance.causes import SinceMade, spring_causes
from nlsdesign.design.tolerance.lasting import lasting_causes
from nlsdesign.design.tolerance.made_spring import made_spring
from nlsdesign.foundation.errors import ArrangementError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.spread import NormalSpread, UniformSpread
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, KEEP, PRETENSION, RUBBER, TARGET, actuator
from tests.physics.test_lasting_tolerance import with_rubber
from tests.physics.test_tolerance import actuator as arc_actuator

MACHINE = arc_actuator()
ANCHORED = SpreadRules(given={"spring.cam.anchor_distance": 2e-4})
RULES = SpreadRules(given={"spring.cam.lever_arm": 0.01})
FAR_OFF = PowerTorque(coefficient=4.0, exponent=1.5, angle=0.9)


def own_torque(machine: Assembly = MACHINE) -> TabulatedTorque:
    """What the spring gives without deviations, as a target: then the spreads make most of the error."""
    angles = np.linspace(0.0, FAR_OFF.last_angle, 60)
    torques = equilibrium_torque(flatten(machine), None, angles)
    return TabulatedTorque(angles=tuple(angles), torques=(0.0, *torques[1:]))


def goal_in_newton_metres(
    goal: ToleranceQuantile, target: Target = FAR_OFF, machine: Assembly = MACHINE
) -> float:
    """The root of the goal for a cam as it is declared; nothing but the pretension is free, and it stays."""
    model = flatten(machine)
    problem = design_problem(model, machine["spring.cam"], target=target, free=["spring.pretension"])
    point = problem.completed({})
    return float(np.sqrt(problem.evaluate(ca.SX(goal.mean_square(problem.design)), point)[0]))


def drawn_quantile(
    goal: ToleranceQuantile, target: Target = FAR_OFF, machine: Assembly = MACHINE, count: int = 400_000
) -> float:
    """The same from draws of the quadratic form, with the sensitivities of the analysis."""
    model = flatten(machine)
    lasting = lasting_causes(model, None, np.linspace(0.0, target.last_angle, 401))[0]
    causes = (*spring_causes(model, None, goal.rules), *lasting)
    trims = [] if goal.trims == () else [Trim("spring.pretension")]
    columns = [trim.column(model, model.springs[0].cams[0])[0] for trim in trims]
    made = made_spring(model, None, target=target, causes=(*causes, *columns), angles=401)
    root = np.sqrt(made.weights)
    rows = made.sensitivities[: len(causes)] * root
    if trims:
        tangent = made.sensitivities[-1] * root
        rows = rows - np.outer(rows @ tangent, tangent) / (tangent @ tangent)
    error = (made.nominal - made.wanted) * root
    normal = np.random.default_rng(4).standard_normal((count, len(causes)))
    # To first order a factor is normal, as the goal takes it; a range has ends.
    kept = (UniformSpread, SinceMade)
    kinds = [c.spread if isinstance(c.spread, kept) else NormalSpread(1.0) for c in causes]
    x = np.column_stack([kind.deviate(column) for kind, column in zip(kinds, normal.T, strict=True)])
    squares = error @ error + 2 * x @ (rows @ error) + np.einsum("ij,jk,ik->i", x, rows @ rows.T, x)
    return float(np.sqrt(np.quantile(squares, goal.share)))


@pytest.mark.long_cases(
    "trimmed-0.95",
    "trimmed-0.5",
    "trimmed-0.9",
    "trimmed-0.99",
    "as built-0.5",
    "as built-0.9",
    "as built-0.95",
)
@pytest.mark.parametrize("share", [0.5, 0.9, 0.95, 0.99])
@pytest.mark.parametrize("trims", [None, ()], ids=["trimmed", "as built"])
def test_the_quantile_is_that_of_draws(share: float, trims: tuple[str, ...] | None) -> None:
    goal, target = ToleranceQuantile(share=share, trims=trims, rules=RULES), own_torque()
    # A multiple of χ² is not the distribution itself.
    assert goal_in_newton_metres(goal, target) == pytest.approx(drawn_quantile(goal, target), rel=0.04)


@pytest.mark.parametrize("trims", [None, ()], ids=["trimmed", "as built"])
def test_so_it_is_where_the_design_itself_is_far_off(trims: tuple[str, ...] | None) -> None:
    goal = ToleranceQuantile(trims=trims, rules=RULES)
    assert goal_in_newton_metres(goal) == pytest.approx(drawn_quantile(goal), rel=0.04)


def test_ranges_have_a_lower_tail() -> None:
    causes = [c for c in spring_causes(flatten(MACHINE), None, RULES) if ".contour" not in c.name]
    target = own_torque()
    ranges = {c.name: UniformSpread(c.deviation) for c in causes}
    rules = SpreadRules(given={**RULES.given, **ranges})
    goal = ToleranceQuantile(rules=rules, trims=())
    bounded = goal_in_newton_metres(goal, target)
    assert bounded == pytest.approx(drawn_quantile(goal, target), rel=0.04)
    assert bounded < 0.7 * goal_in_newton_metres(ToleranceQuantile(rules=RULES, trims=()), target)


@pytest.mark.long_cases("set-as built", "set-trimmed", "creep-trimmed")
@pytest.mark.parametrize("trims", [None, ()], ids=["trimmed", "as built"])
@pytest.mark.parametrize("takes", [{"share": 0.3}, {"time": 600.0}], ids=["set", "creep"])
def test_what_time_takes_is_counted(takes: dict[str, float], trims: tuple[str, ...] | None) -> None:
    """A share between nothing and the whole, on one side: a mean besides a variance."""
    machine = with_rubber(**takes)
    goal, target = ToleranceQuantile(trims=trims, rules=RULES), own_torque(machine)
    found = goal_in_newton_metres(goal, target, machine)
    assert found == pytest.approx(drawn_quantile(goal, target, machine), rel=0.04)
    if trims == ():
        assert found > 1.01 * goal_in_newton_metres(goal, target, with_rubber(time=0.1))


def test_without_spreads_it_is_the_nominal_error() -> None:
    model = flatten(MACHINE)
    nothing = SpreadRules(
        given={
            name: 0.0
            for name in (
                *("spring.element.moduli", "spring.element.area", "spring.element.rest_length"),
                *("spring.pretension", "spring.cam.anchor_distance"),
                *("spring.cam.contour", "spring.cam.cable_radius"),
            )
        }
    )
    problem = design_problem(model, MACHINE["spring.cam"], target=FAR_OFF, free=["spring.pretension"])
    nominal = problem.evaluate(problem.design.mean_square_error, problem.completed({}))[0]
    assert goal_in_newton_metres(ToleranceQuantile(rules=nothing)) == pytest.approx(
        np.sqrt(nominal), rel=1e-6
    )


def test_a_one_sided_cam_has_the_same_goal_as_draws() -> None:
    cam = OneSidedCam(lever_arm=tuple(0.0012 * (i - 1) for i in range(12)), last_angle=1.0, elements=2.0)
    machine = MACHINE.with_part("spring.cam", cam)
    given = {name: size for name, size in RULES.given.items() if "anchor" not in name}
    goal, target = ToleranceQuantile(rules=SpreadRules(given=given)), own_torque(machine)
    found = goal_in_newton_metres(goal, target, machine)
    assert found == pytest.approx(drawn_quantile(goal, target, machine), rel=0.04)


@pytest.fixture(scope="module")
def designs() -> tuple[CamDesign, CamDesign]:
    """Nominal and robust, with room for the trim up to 30 mm."""
    keep = [*KEEP, MaximumCableTension(400.0), RestLengthRange(8e-3, 40e-3)]
    settings = DesignSettings(look_for_size_ranges=False, look_for_remedies=False, draws=0)
    goals = (ToleranceQuantile(rules=ANCHORED), SmoothContour(), LeastRubber())
    room = TrimRoom("spring.pretension", 0.0, 30e-3, rules=ANCHORED)
    return (
        design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=keep, settings=settings),
        design_cam(
            actuator(CONCAVE), target=TARGET, free=RUBBER, keep=[*keep, room], goals=goals, settings=settings
        ),
    )


@pytest.mark.slow
def test_the_robust_design_is_a_third_better_after_the_same_trim(
    designs: tuple[CamDesign, CamDesign],
) -> None:
    """Quantiles of full draws, not of the goal; 30 % is what was to be reached."""
    trims = [Trim("spring.pretension", 0.0, 30e-3)]
    nominal, robust = (
        tolerance_analysis(d.actuator, target=TARGET, rules=ANCHORED, trims=trims) for d in designs
    )
    before, after = (result.trims[0].quantiles[-1] for result in (nominal, robust))
    assert after.upper < 0.7 * before.lower
    promised = 1e-3 * TARGET.largest * np.sqrt(designs[1].starts[designs[1].taken].cost)
    assert promised == pytest.approx(after.value, rel=0.15)
    # As built nothing helps against stiffness that scatters as a whole.
    assert robust.quantiles[-1].value > 0.8 * nominal.quantiles[-1].value


@pytest.mark.slow
def test_the_room_for_the_trim_is_kept(designs: tuple[CamDesign, CamDesign]) -> None:
    result = tolerance_analysis(designs[1].actuator, target=TARGET, rules=ANCHORED)
    (state,) = (each for each in designs[1].limits if each.limit == "TrimRoom" and each.upper)
    assert state.active
    assert state.value == pytest.approx(30e-3, rel=1e-3)
    # Three standard deviations to first order are 99.9 % of the springs; soft ones need more than that says.
    below = np.mean(result.trims[0].settings <= 30e-3)
    assert 0.97 < below < 0.999


TASK = PowerTorque(coefficient=4.0, exponent=1.5, angle=0.8)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"trims": ("spring.pretensoin",)}, ArrangementError, "trim 'spring.pretension'"),
        ({"rules": SpreadRules(given={"spring.rubber.aera": 0.1})}, UnknownNameError, "spring.rubber.area"),
    ],
)
def test_names_that_do_not_exist_are_named(
    given: dict[str, object], error: type[Exception], words: str
) -> None:
    goal = ToleranceQuantile(**given)  # type: ignore[arg-type]
    with pytest.raises(error, match=words):
        design_cam(actuator(CONCAVE), target=TASK, free=PRETENSION, keep=KEEP, goals=[goal])


@pytest.mark.parametrize("share", [0.2, 1.0, float("nan")])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with pytest.raises(ValueRangeError, match=r"take 0\.95"):
        ToleranceQuantile(share=share)


def test_a_room_without_room_is_refused() -> None:
    with pytest.raises(ValueRangeError, match="has no room"):
        TrimRoom("spring.pretension", 5e-3, 5e-3)
    with pytest.raises(ValueRangeError, match="deviations"):
        TrimRoom("spring.pretension", 0.0, 5e-3, deviations=-1.0)
    with pytest.raises(UnitError, match=r"TrimRoom of spring\.pretension"):
        design_cam(
            actuator(CONCAVE), target=TASK, free=PRETENSION,
            keep=[*KEEP, TrimRoom("spring.pretension", 0.0, quantity(5.0, "N"))],
        )  # fmt: skip
