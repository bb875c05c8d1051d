"""Wrappers that swallow motion, and friction that takes power, against their textbook forms.

Independent roads: the sharp laws typed here with ``max``; potential energies, whose numerical derivative must
be the torque; loops over closed paths; steady sliding of many-element friction against its staircase.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Backlash,
    Driven,
    Element,
    Fixed,
    GearFriction,
    Inertia,
    Inertial,
    InextensibleCable,
    LinearElastic,
    LoadFriction,
    Mass,
    QuadraticDrag,
    Regularised,
    Rounded,
    Slack,
    SlidingFillers,
    Spring,
    StretchyCable,
    StribeckFriction,
    TorqueRipple,
    Turned,
    ViscousMaterial,
    parallel,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate

SPRING = Spring(stiffness=3.4, domain=ROTATION)


def on_shaft(element: Element) -> FlatModel:
    return flatten(assembly("a", shaft=Driven(), e=tie(element, "shaft")), outputs=["e.torque"])


def torque(element: Element, angle: float, speed: float = 0.0) -> float:
    return on_shaft(element).evaluate([], [angle, speed])["e.torque"]


# --- backlash -------------------------------------------------------------------------------------


@given(st.floats(-0.3, 0.3))
def test_backlash_is_a_dead_zone_within_its_rounding(angle: float) -> None:
    gap, width = 0.05, 1e-4
    sharp = 3.4 * (max(angle - gap / 2, 0.0) - max(-angle - gap / 2, 0.0))
    found = torque(Backlash(members=(("s", SPRING),), gap=gap, contact=Rounded(width=width)), angle)
    assert abs(found - sharp) <= 3.4 * width * (2 * math.log(2.0) + 1.0)


def test_what_meets_the_far_side_of_a_backlash_takes_it_along() -> None:
    """Nothing touches for g/2 over the speed; then both turn with J₁·ω/(J₁ + J₂): a plastic impact."""
    backlash = Backlash(
        members=(("s", Spring(stiffness=1e-9, domain=ROTATION)),), gap=0.1, contact=Inertial(inertia=2e-3)
    )
    model = flatten(assembly("a", wheel=Inertia(inertia=6e-3), backlash=tie(backlash, "wheel")))
    run = simulate(model, np.linspace(0.0, 0.2, 401), start={"wheel.speed": 2.0})
    early = run.time < 0.05 / 2.0 - 5e-3
    assert np.allclose(run["backlash.inner_speed"][early], 0.0, atol=1e-6)
    for name in ("wheel.speed", "backlash.inner_speed"):
        assert run[name][-1] == pytest.approx(2.0 * 6.0 / 8.0, rel=1e-3)
    assert run["wheel.angle"][-1] - run["backlash.inner_angle"][-1] == pytest.approx(0.05, abs=1e-3)


def test_a_load_lags_by_half_the_gap_behind_a_backlash() -> None:
    backlash = Backlash(members=(("s", SPRING),), gap=0.05, contact=Inertial(inertia=1e-3, contact_time=1e-4))
    model = flatten(assembly("a", shaft=Driven(), e=tie(backlash, "shaft")), outputs=["e.torque"])
    # At rest the contact is a spring of stiffness J/τ², a hundred thousand N·m/rad, in series.
    lag = 0.025 + 3.4 * (0.3 - 0.025) / (3.4 + 1e5)
    angle = 0.3 - lag
    assert model.evaluate([angle, 0.0], [0.3, 0.0])["e.torque"] == pytest.approx(3.4 * angle, rel=1e-6)


def test_torque_behind_a_backlash_is_the_slope_of_its_energy() -> None:
    """½k·φ(θ)² is stored; its numerical derivative over θ must be the torque: virtual work."""
    backlash = Backlash(members=(("s", SPRING),), gap=0.05, contact=Rounded(width=2e-3))
    model, step = on_shaft(backlash), 1e-5
    for angle in np.linspace(-0.06, 0.06, 41):
        inner = [
            model.evaluate([], [angle + d, 0.0])["e.s.torque"] / 3.4
            for d in (-2 * step, -step, step, 2 * step)
        ]
        energy = [1.7 * phi**2 for phi in inner]
        slope = (energy[0] - 8 * energy[1] + 8 * energy[2] - energy[3]) / (12 * step)
        assert model.evaluate([], [angle, 0.0])["e.torque"] == pytest.approx(slope, rel=1e-6, abs=1e-9)


@given(st.floats(-0.01, 0.02))
def test_slack_shifts_the_law_of_what_is_behind(extension: float) -> None:
    made = assembly(
        "a",
        grip=Driven(domain=TRANSLATION),
        s=tie(
            Slack(members=(("k", Spring(stiffness=2500.0)),), length=2e-3, contact=Rounded(width=1e-5)),
            "grip",
        ),
    )
    found = flatten(made, outputs=["s.force"]).evaluate([], [extension, 0.0])["s.force"]
    assert abs(found - 2500.0 * max(extension - 2e-3, 0.0)) <= 2500.0 * 1e-5 * (2 * math.log(2.0) + 1.0)


@given(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_a_turned_cam_is_the_cam_at_the_turned_angle(angle: float, offset: float) -> None:
    found = torque(Turned(members=(("s", SPRING),), offset=offset), angle)
    assert found == pytest.approx(torque(SPRING, angle - offset), rel=1e-14, abs=1e-15)


# --- cables ---------------------------------------------------------------------------------------


@given(st.floats(0.0, 0.02), st.floats(1e3, 1e6))
def test_a_stretchy_cable_is_a_spring_in_series(extension: float, stiffness: float) -> None:
    """1/(1/C + 1/k) for linear laws, and the rigid limit as C grows."""
    made = assembly(
        "a",
        grip=Driven(domain=TRANSLATION),
        s=tie(StretchyCable(stiffness=stiffness, members=(("k", Spring(stiffness=2500.0)),)), "grip"),
    )
    found = flatten(made, outputs=["s.force"]).evaluate([], [extension, 0.0])["s.force"]
    assert found == pytest.approx(extension / (1 / stiffness + 1 / 2500.0), rel=1e-12, abs=1e-12)
    assert abs(found - 2500.0 * extension) <= 2500.0 * extension * 2500.0 / stiffness + 1e-12


def test_a_slack_cable_meets_the_rubber_where_it_has_recovered_to() -> None:
    """Standard linear solid held stretched, let go, met again: the force is zero until the recovered length.

    Force-free, the Maxwell spring-dashpot of moduli k₀ (still) and k (branch) recovers as
    ε(t) = k·e/(k₀ + k)·exp(−t/(τ(1 + k/k₀))), e the dashpot's strain when the cable went slack.
    """
    still, branch, viscosity, length = 0.9e6, 0.6e6, 3e4, 0.0125
    rubber = specimen(
        area=1e-4, rest_length=length,
        still=LinearElastic(modulus=still),
        relaxing=series(spring=LinearElastic(modulus=branch), dashpot=ViscousMaterial(viscosity=viscosity)),
    )  # fmt: skip
    made = assembly(
        "a", grip=Driven(domain=TRANSLATION), s=tie(InextensibleCable(members=(("r", rubber),)), "grip")
    )
    model = flatten(made, outputs=["s.force"])
    held = 0.3
    times = np.linspace(0.0, 0.2, 401)
    drive = {"grip.position": 0.0 * times, "grip.speed": 0.0 * times}
    run = simulate(model, times, inputs=drive, start={"s.r.relaxing.dashpot.strain": held}, tolerance=1e-11)
    tau = viscosity / branch * (1 + branch / still)
    expected = held * branch / (still + branch) * np.exp(-times / tau)
    assert np.max(np.abs(run["s.force"])) < 1e-9
    assert run["s.r.extension"] / length == pytest.approx(expected, rel=1e-7)
    # Meeting it again: one micrometre beyond the recovered length pulls, one before does not.
    state = [run["s.r.relaxing.dashpot.strain"][-1]]
    at = run["s.r.extension"][-1]
    assert model.evaluate(state, [at - 1e-6, 0.0])["s.force"] == pytest.approx(0.0, abs=1e-9)
    pull = model.evaluate(state, [at + 1e-6, 0.0])["s.force"]
    assert pull == pytest.approx(1e-4 * (still + branch) * 1e-6 / length, rel=1e-5)


# --- friction -------------------------------------------------------------------------------------


@given(st.floats(-20.0, 20.0))
def test_stribeck_lies_between_breakaway_and_sliding(speed: float) -> None:
    rub = StribeckFriction(
        sliding_effort=0.4, contact=Regularised(creep_speed=1e-3), breakaway=0.2, stribeck_speed=0.5
    )
    found = torque(rub, 0.0, speed)
    assert found * speed >= 0.0
    if abs(speed) > 0.02:
        assert abs(found) == pytest.approx(0.4 + 0.2 * math.exp(-4 * speed**2), rel=1e-12)


def test_drag_stops_a_wheel_as_one_over_one_plus_time() -> None:
    """J·ω̇ = −c·ω² has ω = ω₀/(1 + c·ω₀·t/J)."""
    made = assembly("a", wheel=Inertia(inertia=2e-3), air=tie(QuadraticDrag(drag=1e-4), "wheel"))
    times = np.linspace(0.0, 2.0, 101)
    run = simulate(flatten(made), times, start={"wheel.speed": 40.0}, tolerance=1e-11)
    assert run["wheel.speed"] == pytest.approx(40.0 / (1 + 1e-4 * 40.0 * times / 2e-3), rel=1e-8)


def test_ripple_does_no_work_over_a_turn() -> None:
    model = on_shaft(TorqueRipple(sine=0.01, cosine=0.005, order=28.0))
    angles = np.linspace(0.0, 2 * math.pi, 20_001)
    torques = np.array([model.evaluate([], [a, 1.0])["e.torque"] for a in angles[::20]])
    assert abs(np.mean(torques[:-1])) < 1e-15 * len(torques)
    assert np.max(torques) == pytest.approx(math.hypot(0.01, 0.005), rel=1e-3)


def test_ripple_along_a_line_repeats_with_its_pitch() -> None:
    """Magnets with a pitch of 24 mm: F = A·cos(2πx/24 mm − φ), and a carriage swings about its rest."""
    pitch, size, phase = 0.024, 3.0, 0.7
    ripple = TorqueRipple(
        sine=size * math.sin(phase),
        cosine=size * math.cos(phase),
        order=2 * math.pi / pitch,
        domain=TRANSLATION,
    )
    made = assembly("line", carriage=Mass(mass=2.0), cogging=tie(ripple, "carriage"))
    model = flatten(made)
    assert model.variable("cogging.order").unit == "rad/m"
    places = np.linspace(0.0, 2 * pitch, 41)
    forces = [model.evaluate([x, 0.0], [0.0])["cogging.force"] for x in places]
    assert forces == pytest.approx(size * np.cos(2 * math.pi * places / pitch - phase), abs=1e-12)
    # A quarter of a period before its crest the force against the motion rises: there the carriage rests.
    rest = pitch * (phase - math.pi / 2) / (2 * math.pi)
    period = 2 * math.pi * math.sqrt(2.0 / (size * 2 * math.pi / pitch))
    run = simulate(
        model, np.linspace(0.0, period, 201), start={"carriage.position": rest + 1e-6}, tolerance=1e-13
    )
    assert run["carriage.position"][100] - rest == pytest.approx(-1e-6, rel=1e-3)
    assert run["carriage.position"][-1] - rest == pytest.approx(1e-6, rel=1e-3)


@given(st.floats(-0.5, 0.5), st.sampled_from([-2.0, 2.0]))
def test_load_friction_takes_its_share_of_the_load_and_only_takes(angle: float, speed: float) -> None:
    found = torque(
        LoadFriction(members=(("s", SPRING),), ratio=0.05, contact=Regularised(creep_speed=0.02)),
        angle,
        speed,
    )
    assert found == pytest.approx(3.4 * angle + 0.05 * abs(3.4 * angle) * math.copysign(1, speed), rel=1e-9)
    assert (found - 3.4 * angle) * speed >= 0.0


@given(st.floats(-0.5, 0.5), st.sampled_from([-2.0, 2.0]), st.sampled_from([-3.0, 0.0, 3.0]))
def test_friction_of_a_gear_acts_on_the_first_body_alone(angle: float, speed: float, far: float) -> None:
    """Its sign is that of the speed of the first body, whatever the second one does."""
    law = GearFriction(members=(("s", SPRING),), ratio=0.1, contact=Regularised(creep_speed=0.02))
    bodies = {"motor": Inertia(inertia=0.5), "joint": Inertia(inertia=2.0)}
    model = flatten(assembly("a", **bodies, link=tie(law, "motor", "joint")))
    names = [v.name for v in model.states]
    place = {"motor.angle": angle, "motor.speed": speed, "joint.angle": 0.0, "joint.speed": far}
    now = model.evaluate([place[name] for name in names], [0.0] * len(model.inputs))
    load = 3.4 * angle
    friction = 0.1 * abs(load) * math.copysign(1.0, speed)
    assert now["link.torque"] == pytest.approx(load)
    assert now["motor.acceleration"] == pytest.approx(-(load + friction) / 0.5, rel=1e-9)
    assert now["joint.acceleration"] == pytest.approx(load / 2.0)


def test_sliding_fillers_do_not_know_the_rate_and_only_lose() -> None:
    """The same path at 1 and at 100 times the speed gives one loop; its area is positive; it saturates."""
    law = SlidingFillers(modulus=0.5e6, yield_stress=4e4)
    rubber = specimen(area=1e-4, rest_length=0.0125, fillers=law)
    model = flatten(
        assembly("a", grip=Driven(domain=TRANSLATION), r=tie(rubber, "grip")), outputs=["r.force"]
    )
    loops = []
    for period in (10.0, 0.1):
        times = np.linspace(0.0, 2 * period, 4001)
        angle = 2 * math.pi * times / period
        drive = {
            "grip.position": lambda t, p=period: 0.006 * math.sin(2 * math.pi * t / p),
            "grip.speed": lambda t, p=period: 0.006 * 2 * math.pi / p * math.cos(2 * math.pi * t / p),
        }
        run = simulate(model, times, inputs=drive, tolerance=1e-9)
        loops.append(run["r.force"])
        area = np.trapezoid(run["r.force"][2000:] * np.cos(angle[2000:]), angle[2000:]) * 0.006
        assert area > 0.0
    assert loops[0] == pytest.approx(loops[1], abs=1e-5 * np.max(np.abs(loops[0])))
    # Ideally plastic, σ_y on the whole loop, would lose 4·σ_y·ε̂ per volume; rounded sliders lose less.
    assert area < 4 * 1e-4 * 4e4 * 0.006
    assert np.max(loops[0]) == pytest.approx(1e-4 * 4e4, rel=0.02)


# --- bodies ---------------------------------------------------------------------------------------


def test_a_mass_on_a_spring_swings_at_its_frequency() -> None:
    made = assembly(
        "a",
        block=Mass(mass=0.4),
        wall=Fixed(domain=TRANSLATION),
        s=tie(Spring(stiffness=90.0), "block", "wall"),
    )
    times = np.linspace(0.0, 2.0, 201)
    run = simulate(flatten(made), times, start={"block.position": 0.01}, tolerance=1e-11)
    assert run["block.position"] == pytest.approx(0.01 * np.cos(15.0 * times), abs=1e-9)
    assert run["wall.reaction"] == pytest.approx(-90.0 * run["block.position"], rel=1e-12, abs=1e-15)


def test_two_wheels_on_a_spring_keep_their_momentum_and_swing_at_the_reduced_inertia() -> None:
    made = assembly(
        "a",
        one=Inertia(inertia=2e-3), other=Inertia(inertia=6e-3), bench=Fixed(),
        s=tie(parallel(k=Spring(stiffness=3.0, domain=ROTATION)), "one", "other"),
    )  # fmt: skip
    times = np.linspace(0.0, 1.0, 401)
    run = simulate(flatten(made), times, start={"one.angle": 0.1}, tolerance=1e-11)
    omega = math.sqrt(3.0 * (1 / 2e-3 + 1 / 6e-3))
    assert run["one.angle"] - run["other.angle"] == pytest.approx(0.1 * np.cos(omega * times), abs=1e-8)
    assert 2e-3 * run["one.speed"] + 6e-3 * run["other.speed"] == pytest.approx(0.0 * times, abs=1e-11)
