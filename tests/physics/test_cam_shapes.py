"""One-sided and anchored cams, and the friction of a cable, by two roads.

Independent roads: a taut string laid around a polygon, splines of scipy with numerical integration, the
contour that the design room draws, the closed area of a capstan's loop, powers by Simpson's rule.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad
from scipy.interpolate import BSpline

from nlsdesign.components import (
    TRANSLATION,
    AnchoredCam,
    Cam,
    CapstanFriction,
    Driven,
    Element,
    Guide,
    InextensibleCable,
    LinearElastic,
    OneSidedCam,
    Spring,
    StretchyCable,
    TwoSidedCam,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import contour_from_lever_arm
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate

ROW = (0.009, 0.0105, 0.0128, 0.0147, 0.0158, 0.0161, 0.0155, 0.0142)
END = 1.2


def spline(row: tuple[float, ...] = ROW, end: float = END) -> BSpline:
    step = end / (len(row) - 3)
    return BSpline(step * np.arange(-3, len(row) + 1), row, 3)


def shaft(cam: Cam, behind: Element) -> FlatModel:
    return flatten(assembly("a", shaft=Driven(), s=tie(through(cam, k=behind), "shaft")))


def over(model: FlatModel, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Extension and lever arm at each angle."""
    rows = [model.evaluate([], [angle, 0.0]) for angle in angles]
    return np.array([r["s.k.extension"] for r in rows]), np.array([r["s.cam.lever_arm_now"] for r in rows])


# --- one side -------------------------------------------------------------------------------------


def one_sided() -> OneSidedCam:
    return OneSidedCam(lever_arm=ROW, last_angle=END, onset=0.02)


def test_a_one_sided_cam_against_a_spline_integrated_numerically() -> None:
    angles = np.array([0.004, 0.013, 0.02, 0.3, 0.77, 1.2, 1.25])
    extension, arm = over(shaft(one_sided(), Spring(stiffness=1e3)), angles)
    law = spline()

    def rising(angle: float) -> float:
        return 3 * (angle / 0.02) ** 2 - 2 * (angle / 0.02) ** 3 if angle < 0.02 else 1.0

    for angle, found, slope in zip(angles, extension, arm, strict=True):
        on = quad(rising, 0.0, min(angle, 0.02))[0] + max(angle - 0.02, 0.0)
        held = min(on, END)
        expected = law.integrate(0.0, held) + law(held) * (on - held)
        assert found == pytest.approx(expected, rel=1e-9)
        assert slope == pytest.approx(law(held) * rising(angle), rel=1e-9)


def test_a_one_sided_cam_does_nothing_at_all_for_negative_angles() -> None:
    model = flatten(
        assembly(
            "a",
            shaft=Driven(),
            s=tie(through(one_sided(), pretension=2e-3, k=Spring(stiffness=1e3)), "shaft"),
        )
    )
    for angle in (-2.0, -0.3, -1e-9, 0.0):
        found = model.evaluate([], [angle, -3.0])
        assert found["s.torque"] == 0.0
        assert found["s.k.extension"] == 2e-3
    assert model.evaluate([], [0.3, 0.0])["s.torque"] > 0.01


def test_a_one_sided_cam_far_from_its_onset_is_a_side_of_the_two_sided_one() -> None:
    angles = np.linspace(0.1, 1.1, 9)
    one = over(shaft(one_sided(), Spring(stiffness=1e3)), angles + 0.01)
    two = TwoSidedCam(lever_arm=ROW, last_angle=END, changeover=1e-6)
    other = over(shaft(two, Spring(stiffness=1e3)), angles + 1e-6)
    assert one[0] == pytest.approx(other[0], rel=1e-9)
    assert one[1] == pytest.approx(other[1], rel=1e-9)


# --- anchor ---------------------------------------------------------------------------------------


def anchored(distance: float, width: float = 1e-6) -> AnchoredCam:
    return AnchoredCam(support=ROW, last_direction=END, anchor_distance=distance, changeover=width)


def string(distance: float, turned: float) -> tuple[float, float]:
    """Length of a taut string around the finely drawn, turned cam to the anchor, and its lever arm."""
    law, slope, bend = spline(), spline().derivative(), spline().derivative(2)
    phi = np.linspace(0.0, END, 200_001)
    sine, cosine = np.sin(phi), np.cos(phi)
    p, rise = law(phi), slope(phi)
    assert np.all(p + bend(phi) > 0.0), "convex"
    points = np.column_stack([p * sine + rise * cosine, p * cosine - rise * sine])
    turn = np.array([[math.cos(turned), -math.sin(turned)], [math.sin(turned), math.cos(turned)]])
    points = points @ turn.T
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    way = np.array([distance, 0.0]) - points
    edges = np.diff(points, axis=0)
    cross = edges[:, 0] * way[:-1, 1] - edges[:, 1] * way[:-1, 0]
    (touching,) = np.flatnonzero(np.diff(np.sign(cross)))[:1] + 1
    free = way[touching] / np.linalg.norm(way[touching])
    return along[touching] + np.linalg.norm(way[touching]), abs(-distance * free[1])


@pytest.mark.parametrize("distance", [0.025, 0.04, 0.3])
def test_an_anchored_cam_takes_up_a_string_laid_around_it(distance: float) -> None:
    angles = np.array([0.1, 0.25, 0.4, 0.5])
    # The change of sides shifts the angle by its width.
    extension, arm = over(shaft(anchored(distance), Spring(stiffness=1e3)), angles + 1e-6)
    drawn = np.array([string(distance, angle) for angle in angles])
    assert extension - extension[0] == pytest.approx(drawn[:, 0] - drawn[0, 0], abs=2e-10)
    assert arm == pytest.approx(drawn[:, 1], rel=1e-5)


@pytest.mark.parametrize("distance", [0.022, 0.06, 1e6])
@pytest.mark.parametrize("width", [1e-6, 0.05])
def test_the_lever_arm_of_an_anchored_cam_is_the_slope_of_its_extension(
    distance: float, width: float
) -> None:
    angles = np.linspace(-1.3, 1.3, 14)
    step = 1e-5
    model = shaft(anchored(distance, width), Spring(stiffness=1e3))
    rise = (over(model, angles + step)[0] - over(model, angles - step)[0]) / (2 * step)
    assert over(model, angles)[1] == pytest.approx(rise, rel=1e-6, abs=1e-9)
    assert over(model, np.array([0.0]))[0] == pytest.approx([0.0], abs=1e-15)


def test_a_far_anchor_is_the_parallel_cable() -> None:
    """As D → ∞ the error of both falls like 1/D; at 1e9 m nothing is left of it."""
    angles = np.linspace(-1.3, 1.3, 27)
    parallel = TwoSidedCam(lever_arm=ROW, last_angle=END, changeover=1e-3)
    wanted = over(shaft(parallel, Spring(stiffness=1e3)), angles)
    errors = []
    for distance in (1.0, 10.0, 1e9):
        found = over(shaft(anchored(distance, 1e-3), Spring(stiffness=1e3)), angles)
        errors.append([float(np.max(np.abs(a - b))) for a, b in zip(found, wanted, strict=True)])
    for one, ten, far in zip(*errors, strict=True):
        assert 8.0 < one / ten < 12.0
        assert far < 1e-10


def test_the_contour_that_the_design_draws_for_an_anchor_gives_back_its_lever_arm() -> None:
    """h(θ) → contour at D (design room) → support function → h(θ) at the same D."""
    wanted, distance = spline(), 0.035
    angles = np.linspace(0.0, 1.0, 801)
    drawn = contour_from_lever_arm(angles, wanted(angles), anchor_distance=distance)
    first, last = drawn.directions[0], drawn.directions[-1]
    assert first > 0.2, "the cable leans at angle zero"
    # Below the first direction nothing touches; the spline may go on there as a line.
    count = 60
    phi = np.linspace(0.0, last, 1200)
    ahead = drawn.lever_arms[0] + (phi - first) * drawn.slopes[0]
    support = np.where(phi < first, ahead, np.interp(phi, drawn.directions, drawn.lever_arms))
    grid = last / (count - 3) * np.arange(-3, count + 1)
    values, *_ = np.linalg.lstsq(BSpline.design_matrix(phi, grid, 3).toarray(), support, rcond=None)
    made = AnchoredCam(support=tuple(values), last_direction=last, anchor_distance=distance, changeover=1e-6)
    probe = np.linspace(0.05, 0.95, 19)
    assert over(shaft(made, Spring(stiffness=1e3)), probe)[1] == pytest.approx(wanted(probe), abs=2e-6)


# --- energy ---------------------------------------------------------------------------------------


def waved(behind: Element, cam: Cam, times: np.ndarray) -> Trace:
    drive = {
        "shaft.angle": lambda t: 0.7 * math.sin(9.0 * t) + 0.2 * math.sin(23.0 * t),
        "shaft.speed": lambda t: 6.3 * math.cos(9.0 * t) + 4.6 * math.cos(23.0 * t),
    }
    return simulate(shaft(cam, behind), times, inputs=drive)


@pytest.mark.parametrize("cam", [one_sided(), anchored(0.025, 0.02)], ids=["one-sided", "anchored"])
@pytest.mark.parametrize("cable", ["stretchy", "inextensible"])
def test_work_at_a_cam_is_the_energy_of_the_spring_and_of_the_cable(cam: Cam, cable: str) -> None:
    """∫T dθ = ½k·y² + F²/2C; an inextensible cable stores nothing."""
    inside, stretch = (("r", Spring(stiffness=4e3)),), 5e4
    made: Element = InextensibleCable(members=inside)
    if cable == "stretchy":
        made = StretchyCable(members=inside, stiffness=stretch)
    times = np.linspace(0.0, 1.5, 30_001)
    run = waved(made, cam, times)
    work = cumulative_simpson(run["s.torque"] * run["shaft.speed"], x=times, initial=0.0)
    pull = run["s.k.force"]
    stored = 0.5 * 4e3 * run["s.k.r.extension"] ** 2
    stored = stored + (pull**2 / (2 * stretch) if cable == "stretchy" else 0.0)
    assert np.max(np.abs(work - stored)) < 2e-6 * np.max(work)
    assert np.max(work) > 0.05


# --- capstan --------------------------------------------------------------------------------------


def pulled(behind: Element) -> FlatModel:
    return flatten(assembly("c", grip=Driven(domain=TRANSLATION), rope=tie(behind, "grip")))


def guide(friction: float, wrap: float, **inside: Element) -> CapstanFriction:
    return CapstanFriction(members=tuple(inside.items()), guide=Guide(friction=friction, wrap_angle=wrap))


def test_the_loop_of_a_capstan_has_the_area_of_eytelwein() -> None:
    """Spring pulled to E and back: the area is k·E²·sinh(µφ)."""
    stiffness, reach, friction, wrap = 2e3, 0.02, 0.15, 2.0
    times = np.linspace(0.0, 2.0, 40_001)
    half = math.pi
    drive = {
        "grip.position": lambda t: reach / 2 * (1 - math.cos(half * t)),
        "grip.speed": lambda t: reach / 2 * half * math.sin(half * t),
    }
    run = simulate(pulled(guide(friction, wrap, k=Spring(stiffness=stiffness))), times, inputs=drive)
    lost = cumulative_simpson(run["rope.force"] * run["grip.speed"], x=times)[-1]
    assert lost == pytest.approx(stiffness * reach**2 * math.sinh(friction * wrap), rel=1e-4)


def test_the_tensions_of_a_capstan_are_those_of_many_small_guides() -> None:
    """Coulomb's law at each of 4000 small bends, dF = µF dφ, against the exponential."""
    friction, wrap, pull = 0.3, 1.5 * math.pi, 40.0
    tension = pull
    for _ in range(4000):
        tension *= (1 + friction * wrap / 8000) / (1 - friction * wrap / 8000)
    model = pulled(guide(friction, wrap, k=Spring(stiffness=1e3)))
    assert model.evaluate([], [0.04, 1.0])["rope.force"] == pytest.approx(tension, rel=1e-6)
    assert model.evaluate([], [0.04, -1.0])["rope.force"] == pytest.approx(pull**2 / tension, rel=1e-6)
    assert model.evaluate([], [-0.04, 1.0])["rope.force"] == pytest.approx(-pull), "a push passes unchanged"


def test_two_guides_in_a_row_bend_like_one() -> None:
    spring = Spring(stiffness=1e3)
    both = pulled(guide(0.2, 0.5, inner=guide(0.1, 1.3, k=spring)))
    one = pulled(guide(1.0, 0.2 * 0.5 + 0.1 * 1.3, k=spring))
    for rate in (-1e-4, 3e-5, 2.0):
        here, there = (m.evaluate([], [0.01, rate])["rope.force"] for m in (both, one))
        assert here == pytest.approx(there, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_capstan_only_takes_power(seed: int) -> None:
    """Relaxing rubber behind a guide and a cable that can go slack, on a random path."""
    rubber = specimen(
        area=1e-4,
        rest_length=0.0125,
        still=LinearElastic(modulus=0.9e6),
        relaxing=series(spring=LinearElastic(modulus=0.6e6), dashpot=ViscousMaterial(viscosity=3e4)),
    )
    behind = guide(0.2, 2.0, cable=InextensibleCable(members=(("rubber", rubber),)))
    draw = np.random.default_rng(seed)
    sizes, phases = draw.normal(size=4) * 2e-3, draw.uniform(0, 6.28, 4)
    speeds = np.array([3.0, 7.0, 13.0, 21.0])
    times = np.linspace(0.0, 2.0, 4001)
    position = np.array([float(np.sum(sizes * np.sin(speeds * t + phases))) for t in times])
    rate = np.array([float(np.sum(sizes * speeds * np.cos(speeds * t + phases))) for t in times])
    run = simulate(
        pulled(behind), times, inputs={"grip.position": position, "grip.speed": rate}, tolerance=1e-7
    )
    lost = (run["rope.force"] - run["rope.cable.force"]) * rate
    assert np.min(lost) >= -1e-12
    assert np.max(lost) > 1e-3
    assert np.min(run["rope.force"]) >= 0.0


def test_the_exponent_is_smooth_in_the_rate() -> None:
    """At the creep speed 76 % of the exponent acts; the slope at rest is µφ/v_s."""
    model = pulled(guide(0.2, 1.0, k=Spring(stiffness=1e3)))
    s = model.symbols()
    law = ca.Function("law", [s.input, s.parameter], [s.output, ca.jacobian(s.output, s.input)])
    force, slopes = law([0.01, 0.0], model.start(model.parameters))
    assert float(force) == pytest.approx(10.0)
    assert float(slopes[1]) == pytest.approx(10.0 * 0.2 / 1e-4)
    creeping = model.evaluate([], [0.01, 1e-4])["rope.force"]
    assert math.log(creeping / 10.0) / 0.2 == pytest.approx(math.tanh(1.0))
