"""Springs in other places: beside the drive beyond an angle, a cam with unequal sides, a stop; by hand.

Independent roads: splines of scipy with numerical integration, work against stored energy, and the motion of
a driven joint integrated by scipy from laws that are written here.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import BSpline

from nlsdesign.components import (
    ROTATION,
    Cable,
    Driven,
    EndStop,
    Fixed,
    Gear,
    GearedMotor,
    Inertia,
    LopsidedCam,
    OneSidedCam,
    Spring,
    Turned,
    TwoSidedCam,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import Assembly, assembly
from nlsdesign.design import (
    DesignSettings,
    MachinedTwoSidedCam,
    MaximumCableTension,
    MinimumRadiusOfCurvature,
    PowerTorque,
    PretensionRange,
    design_cam,
    design_sides,
    equilibrium_torque,
    motor_and_gear,
    walking_task,
    write_sides,
)
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError, InfeasibleError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.roles import passed_ends
from nlsdesign.simulation import simulate
from nlsdesign.simulation.limits_reached import limits_reached
from tests.physics.table import Row

FRONT = (0.0, 0.001, 0.004, 0.009, 0.0128, 0.0147, 0.0158)
BACK = (0.0, 0.0005, 0.003, 0.0035, 0.002, 0.004)
ENDS, WIDTH, STIFF, PRESSED = (1.1, 0.5), 0.01, 2e3, 4e-3
LOPSIDED = LopsidedCam(
    lever_arm=FRONT, last_angle=ENDS[0], back_lever_arm=BACK, back_last_angle=ENDS[1], changeover=WIDTH,
    elements=2.0, anchor_distance=0.05,
)  # fmt: skip
CABLE = Cable(cable_diameter=9e-4, cable_breaking_force=1285.0, cable_bend_ratio=5.0)
EXAMPLES = (
    LOPSIDED,
    LopsidedCam(lever_arm=FRONT, last_angle=1.1, back_lever_arm=BACK, back_last_angle=0.5, cable=CABLE),
)
ROWS = (
    Row(
        LopsidedCam, "δ = ∫H±, h = dδ/dθ", ("flat model", "scipy splines, numerical integration"),
        "test_spring_beside.py::test_both_sides_are_splines_integrated_numerically",
    ),
    Row(
        LopsidedCam, "work from side to side = energy of the element",
        ("torque of the flat model, integrated", "½·k·e²"),
        "test_spring_beside.py::test_the_work_from_one_side_to_the_other_is_the_difference_of_energies",
    ),
)  # fmt: skip


def shaft(cam: LopsidedCam | TwoSidedCam) -> FlatModel:
    spring = tie(through(cam, pretension=PRESSED, k=Spring(stiffness=STIFF)), "shaft")
    return flatten(assembly("a", shaft=Driven(), s=spring))


def arm(angle: float) -> float:
    """Lever arm by hand: the spline of the side at q = √(θ² + w²) − w, times dq/dθ."""
    row, end = (FRONT, ENDS[0]) if angle >= 0.0 else (BACK, ENDS[1])
    step = end / (len(row) - 3)
    spline, q = BSpline(step * np.arange(-3, len(row) + 1), row, 3), math.hypot(angle, WIDTH) - WIDTH
    return float(spline(min(q, end))) * angle / math.hypot(angle, WIDTH)


ANGLES = (-0.6, -0.5, -0.31, -0.02, -0.003, 0.0, 0.003, 0.02, 0.31, 0.77, 1.1, 1.2)


@pytest.mark.parametrize("angle", ANGLES)
def test_both_sides_are_splines_integrated_numerically(angle: float) -> None:
    values = shaft(LOPSIDED).evaluate([], [angle, 0.0])
    taken = quad(arm, 0.0, angle, epsabs=1e-12, limit=200)[0]
    assert values["s.k.extension"] - PRESSED == pytest.approx(taken, abs=1e-10)
    assert values["s.cam.lever_arm_now"] == pytest.approx(arm(angle), abs=1e-12)
    assert values["s.torque"] == pytest.approx(2.0 * STIFF * (PRESSED + taken) * arm(angle), abs=1e-8)


def test_the_work_from_one_side_to_the_other_is_the_difference_of_energies() -> None:
    model = shaft(LOPSIDED)
    angles = np.linspace(-0.55, 1.15, 6001)
    torque = equilibrium_torque(model, "s", angles)
    ends = [model.evaluate([], [angle, 0.0])["s.k.extension"] for angle in (angles[0], angles[-1])]
    stored = [2.0 * 0.5 * STIFF * end**2 for end in ends]
    assert np.trapezoid(torque, angles) == pytest.approx(stored[1] - stored[0], rel=1e-6)
    assert stored[1] > 3.0 * stored[0], "the sides differ"


def test_a_cam_with_equal_sides_is_the_two_sided_one() -> None:
    even = LopsidedCam(
        lever_arm=FRONT,
        last_angle=1.1,
        back_lever_arm=FRONT,
        back_last_angle=1.1,
        changeover=WIDTH,
        elements=2.0,
    )
    both = [equilibrium_torque(shaft(cam), "s", ANGLES) for cam in (even, even.side(back=True))]
    assert np.array_equal(*both)


# --- beside the drive ---------------------------------------------------------------------------------

ENGAGED, RATIO, GEARED, STOP = 0.3, 3.0, 2.0, 0.9
ONE_SIDED = OneSidedCam(lever_arm=(0.01,) * 6, last_angle=1.2)


def beside(engaged: float = ENGAGED, *, mirrored: bool = False) -> Assembly:
    """A motor moves a joint through a gear; a spring to the frame acts on the joint beyond an angle."""
    spring = through(ONE_SIDED, pretension=PRESSED, k=Spring(stiffness=STIFF))
    return assembly(
        "joint",
        frame=Fixed(),
        motor=GearedMotor(inertia=2e-3, gear_ratio=GEARED, torque_constant=0.05, current_limit=10.0),
        joint=Inertia(inertia=0.03),
        gear=Gear(between=("motor", "joint"), ratio=RATIO),
        spring=tie(
            Turned(offset=engaged, members=(("beyond", spring),)),
            *(("frame", "joint") if mirrored else ("joint",)),
        ),
        stop=tie(EndStop(lower=-STOP, upper=STOP, stiffness=400.0, damping=0.5, domain=ROTATION), "joint"),
    )


@pytest.mark.long_cases("True")
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_spring_beside_the_drive_acts_on_the_joint_beyond_its_angle(mirrored: bool) -> None:
    """The joint is pushed through the angle of engagement into the stop and comes back; no clutch."""
    sign, current = -1.0 if mirrored else 1.0, 9.0
    inertia = RATIO**2 * 2e-3 + 0.03

    def pushing(t: float) -> float:
        return sign * current * math.sin(2.0 * math.pi * t / 0.8)

    def rates(t: float, x: np.ndarray) -> list[float]:
        on_side = sign * x[0] - ENGAGED
        r = min(max(on_side / 1e-3, 0.0), 1.0)
        taken = 1e-3 * r**3 * (1.0 - r / 2.0) + max(on_side - 1e-3, 0.0)
        spring = sign * 0.01 * r * r * (3.0 - 2.0 * r) * STIFF * (PRESSED + 0.01 * taken)
        over, under = max(x[0] - STOP, 0.0), max(-STOP - x[0], 0.0)
        stop = 400.0 * (over * max(1.0 + 0.5 * x[1], 0.0) - under * max(1.0 - 0.5 * x[1], 0.0))
        push = RATIO * GEARED * 0.05 * pushing(t)
        return [x[1], (push - spring - stop) / inertia]

    theirs = solve_ivp(rates, (0.0, 0.8), [0.0, 0.0], rtol=1e-9, atol=1e-11, max_step=1e-4)
    model = flatten(beside(mirrored=mirrored))
    ours = simulate(model, np.linspace(0.0, 0.8, 801), inputs={"motor.current": pushing}, tolerance=1e-9)
    joint = ours["motor.angle"] / RATIO
    assert joint == pytest.approx(np.interp(ours.time, theirs.t, theirs.y[0]), abs=2e-5)
    assert np.max(sign * joint) > STOP, "it met the stop"
    free = sign * joint < ENGAGED
    assert np.all(ours["spring.torque"][free] == 0.0), "nothing acts before the spring is engaged"


@pytest.mark.slow
def test_the_design_counts_from_the_angle_of_engagement() -> None:
    target, quick = PowerTorque(coefficient=2.0, exponent=1.2, angle=0.8), DesignSettings(
        draws=0, look_for_size_ranges=False, starts=2
    )  # fmt: skip
    free = ["spring.beyond.cam.contour", "spring.beyond.pretension"]
    designs = [
        design_cam(beside(angle), target=target, free=free, settings=quick) for angle in (0.0, ENGAGED)
    ]  # fmt: skip
    assert all(design.met for design in designs)
    assert designs[1].values == designs[0].values, "where it engages changes nothing of the cam"
    angles = np.linspace(0.02, 0.8, 30)
    torque = equilibrium_torque(flatten(designs[1].actuator), None, np.append(ENGAGED + angles, ENGAGED))
    assert torque[:-1] == pytest.approx(2.0 * angles**1.2, abs=0.01)
    assert torque[-1] == 0.0


# --- both sides designed ------------------------------------------------------------------------------


def knee() -> Assembly:
    spring = tie(through(LOPSIDED, pretension=PRESSED, k=Spring(stiffness=STIFF)), "motor", "load")
    return assembly("knee", motor=Inertia(inertia=1e-3), load=Fixed(), spring=spring)


QUICK = DesignSettings(draws=0, look_for_size_ranges=False, starts=2)
SIDES = (
    PowerTorque(coefficient=3.0, exponent=1.5, angle=0.9),
    PowerTorque(coefficient=2.0, exponent=1.2, angle=0.4),
)  # fmt: skip


@pytest.mark.long_cases("back works harder")
@pytest.mark.parametrize("turned", [False, True], ids=["front works harder", "back works harder"])
def test_both_sides_of_a_cam_meet_their_own_curve_on_one_element(turned: bool) -> None:
    targets = (SIDES[1], SIDES[0]) if turned else SIDES
    design = design_sides(
        knee(), targets=targets, free=["spring.cam.contour", "spring.pretension"], settings=QUICK
    )
    assert design.met
    assert design.chosen_by == ("back" if turned else "front")
    model = flatten(design.actuator)
    for sign, target in zip((1.0, -1.0), targets, strict=True):
        angles = np.linspace(0.02, target.last_angle, 50)
        torque = sign * equilibrium_torque(model, None, sign * angles)
        assert torque == pytest.approx(target.torque(angles), abs=0.005 * target.largest)
    assert design.actuator.parent.name == "knee"


@pytest.mark.slow
def test_what_cannot_be_designed_on_both_sides_says_so() -> None:
    with pytest.raises(ArrangementError, match=r"OneSidedCam: has no contour for each side.*LopsidedCam"):
        design_sides(beside(), targets=SIDES, settings=QUICK)
    with pytest.raises(ArrangementError, match=r"two contours.*design_sides"):
        design_cam(knee(), target=SIDES[0], settings=QUICK)
    keep = [PretensionRange(4e-3, 5e-3), MaximumCableTension(1.0)]
    with pytest.raises(InfeasibleError, match=r"front: .*MaximumCableTension"):
        design_sides(knee(), targets=SIDES, keep=keep, settings=QUICK)


def test_each_side_ends_where_its_own_contour_does() -> None:
    """Ends that are passed are named by their own side, at rest and over time."""
    model = shaft(LOPSIDED)
    assert passed_ends(model, -0.45, 1.0) == {}
    assert passed_ends(model, -1.2, 0.2) == {"s.cam.back": 0.5}
    assert passed_ends(model, -0.45, 1.2) == {"s.cam": 1.1}
    run = simulate(
        model,
        np.linspace(0.0, 1.0, 101),
        inputs={
            "shaft.angle": lambda t: 0.7 * math.sin(6.0 * t),
            "shaft.speed": lambda t: 4.2 * math.cos(6.0 * t),
        },
    )
    (reached,) = limits_reached(model, run)
    assert reached.limit == -0.5


def test_the_drive_of_the_deck_loses_little_beside_its_spring(tmp_path: Path) -> None:
    """The bundled deck on the task that it was made for; and the files of a design of both sides."""
    model = flatten(declare(load_deck("spring_beside_drive")))
    cycle = walking_task("hip", body_mass=75.0).scaled(0.05).sampled()
    drive = motor_and_gear(model, resistance=0.3)
    rest = cycle.torque + drive.reflected_inertia * cycle.acceleration
    spring = -equilibrium_torque(model, "spring", cycle.angle)
    assert np.mean((rest - spring) ** 2) < 0.1 * np.mean(rest**2)
    free, pressed = (
        ["spring.cam.contour", "spring.pretension"],
        [PretensionRange(0.01, 0.03), MinimumRadiusOfCurvature(1e-3)],
    )
    straight = [PowerTorque(coefficient=c, exponent=1.0, angle=a) for c, a in ((1.5, 0.6), (1.0, 0.4))]
    both = design_sides(knee(), targets=(straight[0], straight[1]), free=free, keep=pressed, settings=QUICK)
    assert both.met
    files = write_sides(both, tmp_path, machined=MachinedTwoSidedCam(cable_radius=2e-4))
    assert {file.name for file in files} == {
        "model.toml", "cam.csv", "cam_centre_line.csv", "cam.svg", "cam.dxf", "cam_back.csv"
    }  # fmt: skip
    again = flatten(declare(load_deck(tmp_path / "model.toml")))
    assert np.array_equal(
        equilibrium_torque(again, None, [-0.3, 0.5]),
        equilibrium_torque(flatten(both.actuator), None, [-0.3, 0.5]),
    )
