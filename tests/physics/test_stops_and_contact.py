"""Stops, backlash and slack with located contact, against closed forms and sums of energy.

Independent roads: free fall between impacts, half sines of contact, the exact speed after an impact on a
Hunt–Crossley stop from its energy integral, momentum and energy of two inertias, and scipy phase by phase.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

from nlsdesign.components import (
    ROTATION,
    Backlash,
    CoulombFriction,
    Dashpot,
    Element,
    EndStop,
    Inertia,
    InextensibleCable,
    Mass,
    RigidStop,
    Rounded,
    Slack,
    Spring,
    StrainStiffening,
    smoothed,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.export.c.controller_code import check_discrete
from nlsdesign.export.fmi.fmu import fmu_texts
from nlsdesign.foundation.errors import (
    ArrangementError,
    ConvergenceError,
    ExportError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate

J = 1e-3


def against(stop: Element) -> FlatModel:
    return flatten(assembly("stopped", wheel=Inertia(inertia=J), stop=tie(stop, "wheel")))


# --- rigid stops ----------------------------------------------------------------------------------


def test_a_bouncing_body_strikes_at_the_moments_of_free_fall() -> None:
    """Speed at impact v₀·eⁿ, flight time 2·v₀·eⁿ/a; rests below the resting speed, at the exact place."""
    restitution, torque, height = 0.6, -0.02, 0.5
    model = against(RigidStop(lower=0.0, upper=1.0, restitution=restitution, resting_speed=1e-3))
    run = simulate(
        model, np.linspace(0.0, 1.0, 11), inputs={"wheel.torque": torque}, start={"wheel.angle": height}
    )
    fall = -torque / J
    moments, speed = [math.sqrt(2 * height / fall)], math.sqrt(2 * height * fall)
    while speed > 1e-3:
        speed *= restitution
        moments.append(moments[-1] + 2 * speed / fall)
    assert [e.time for e in run.events] == pytest.approx(moments, abs=1e-11)
    assert [e.what for e in run.events] == ["rebounds"] * (len(moments) - 1) + ["rests at a stop"]
    assert run["wheel.speed"][-1] == 0.0
    assert abs(run["wheel.angle"][-1]) < 1e-12
    assert run["stop.torque"][-1] == pytest.approx(torque, rel=1e-12)


def test_a_body_leaves_the_stop_when_it_is_pulled_away() -> None:
    model = against(RigidStop(lower=-1.0, upper=0.2, restitution=0.0))
    drive = {"wheel.torque": lambda t: 0.1 * math.cos(3.0 * t)}
    run = simulate(model, np.linspace(0.0, 1.0, 21), inputs=drive)
    # ω = 0.1·sin(3t)/(3J), θ = 0.1·(1 − cos(3t))/(9J) up to the stop.
    meets = math.acos(1.0 - 0.2 * 9 * J / 0.1) / 3.0
    leaves = math.pi / 6
    assert [(e.what, e.time) for e in run.events[:2]] == [
        ("rests at a stop", pytest.approx(meets, abs=1e-11)),
        ("leaves the stop", pytest.approx(leaves, abs=1e-11)),
    ]
    after = np.clip(run.time - leaves, 0.0, None)
    back = 0.2 - 0.1 * (3 * after - np.sin(3 * after)) / (9 * J)
    before_next = run.time < (run.events[2].time if len(run.events) > 2 else 2.0)
    chosen = (run.time > meets) & before_next
    assert run["wheel.angle"][chosen] == pytest.approx(back[chosen], abs=1e-10)


def test_an_impact_between_two_inertias_keeps_momentum_and_loses_the_energy_of_restitution() -> None:
    one, other, e = 1e-3, 3e-3, 0.4
    made = assembly(
        "clash",
        one=Inertia(inertia=one),
        other=Inertia(inertia=other),
        stop=tie(RigidStop(lower=-0.1, upper=0.1, restitution=e), "one", "other"),
    )
    times = np.linspace(0.0, 0.5, 51)
    run = simulate(flatten(made), times, start={"one.speed": 2.0, "other.speed": -1.0})
    momentum = one * run["one.speed"] + other * run["other.speed"]
    assert momentum == pytest.approx(np.full(51, one * 2.0 - other * 1.0), rel=1e-12)
    apart = 3.0 * (-e) ** np.searchsorted([v.time for v in run.events], times, side="left")
    assert run["one.speed"] - run["other.speed"] == pytest.approx(apart, rel=1e-9)
    gaps = [0.1 / 3.0] + [0.2 / (3.0 * e**k) for k in range(1, len(run.events))]
    assert len(run.events) >= 2
    assert [v.time for v in run.events] == pytest.approx(np.cumsum(gaps), rel=1e-10)


def test_impacts_without_end_are_named() -> None:
    model = against(RigidStop(lower=0.0, upper=1.0, restitution=0.5, resting_speed=0.0))
    with pytest.raises(ConvergenceError, match=r"events of 'stop' accumulate at t = 0\.6\d*.*rests"):
        simulate(model, np.linspace(0.0, 1.0, 3), inputs={"wheel.torque": -0.02}, start={"wheel.angle": 0.4})


def test_a_stop_with_friction_on_the_same_motion_is_refused() -> None:
    made = assembly(
        "held twice",
        wheel=Inertia(inertia=J),
        stop=tie(RigidStop(lower=0.0, upper=1.0, restitution=0.5), "wheel"),
        rub=tie(CoulombFriction(sliding_effort=0.01), "wheel"),
    )
    with pytest.raises(ArrangementError, match=r"'stop' and 'rub'.*hold the same motion.*elastic stop"):
        flatten(made)


def test_stops_in_the_wrong_order_are_refused() -> None:
    for kind, more in ((RigidStop, {"restitution": 0.5}), (EndStop, {"stiffness": 1.0, "damping": 0.0})):
        with pytest.raises(ValueRangeError, match="lower stop must lie below"):
            kind(lower=0.2, upper=0.1, **more)


# --- elastic stops --------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.4])
def test_rebound_from_an_elastic_stop(damping: float) -> None:
    """J·v·dv/(1 + d·v) = −k·p·dp: with F(v) = (d·v − ln(1 + d·v))/d², F(v⁻) = F(v⁺), whatever k is."""
    stiffness, speed = 400.0, 1.5
    model = against(EndStop(lower=-1.0, upper=0.1, stiffness=stiffness, damping=damping))
    run = simulate(model, np.linspace(0.0, 0.12, 13), start={"wheel.speed": speed}, tolerance=1e-11)
    meets, leaves = run.events
    assert (meets.what, leaves.what) == ("meets the upper stop", "leaves the upper stop")
    assert meets.time == pytest.approx(0.1 / speed, rel=1e-11)
    if damping == 0.0:
        assert leaves.time - meets.time == pytest.approx(math.pi * math.sqrt(J / stiffness), rel=1e-8)
        expected = -speed
    else:

        def energy(v: float) -> float:
            return (damping * v - math.log1p(damping * v)) / damping**2

        expected = brentq(lambda v: energy(v) - energy(speed), -speed, 0.0, xtol=1e-15)
    assert run["wheel.speed"][-1] == pytest.approx(expected, rel=1e-8)
    assert -expected / speed == pytest.approx(1 - 2 * damping * speed / 3, abs=0.5 * (damping * speed) ** 2)


# --- backlash between two inertias ----------------------------------------------------------------


def test_backlash_between_two_inertias() -> None:
    """Free through the gap, then half a sine of the reduced inertia, then free with speeds exchanged."""
    one, other, stiffness, gap, speed = 1e-3, 2e-3, 50.0, 0.02, 0.8
    inside = (("spring", Spring(stiffness=stiffness, domain=ROTATION)),)
    made = assembly(
        "gear",
        motor=Inertia(inertia=one),
        load=Inertia(inertia=other),
        backlash=tie(Backlash(gap=gap, members=inside), "motor", "load"),
    )
    run = simulate(flatten(made), np.linspace(0.0, 0.1, 11), start={"motor.speed": speed}, tolerance=1e-11)
    reduced = one * other / (one + other)
    meets = gap / 2 / speed
    parts = meets + math.pi * math.sqrt(reduced / stiffness)
    again = parts + gap / speed
    last = again + math.pi * math.sqrt(reduced / stiffness)
    expected = [
        ("meets ahead", meets),
        ("parts ahead", parts),
        ("meets behind", again),
        ("parts behind", last),
    ]
    found = [(e.what, e.time) for e in run.events if e.time < 0.1]
    assert [w for w, _ in found][:4] == [w for w, _ in expected][: len(found)]
    for (_, time), (_, exact) in zip(found, expected, strict=False):
        assert time == pytest.approx(exact, abs=1e-9)
    between = (run.time > parts) & (run.time < again)
    assert np.any(between)
    after = (one - other) / (one + other) * speed
    assert run["motor.speed"][between] == pytest.approx(np.full(between.sum(), after), rel=1e-8)
    energy = one / 2 * run["motor.speed"] ** 2 + other / 2 * run["load.speed"] ** 2
    energy += run["backlash.spring.torque"] ** 2 / (2 * stiffness)
    assert energy == pytest.approx(np.full(11, one / 2 * speed**2), rel=1e-8)


def test_backlash_with_a_damper_balances_and_jumps_where_it_should() -> None:
    stiffness, damping = 50.0, 0.01
    inside = (
        ("spring", Spring(stiffness=stiffness, domain=ROTATION)),
        ("damper", Dashpot(damping=damping, domain=ROTATION)),
    )
    made = assembly(
        "gear",
        motor=Inertia(inertia=J),
        load=Inertia(inertia=2 * J),
        backlash=tie(Backlash(gap=0.02, members=inside), "motor", "load"),
    )
    times = np.linspace(0.0, 0.5, 50_001)
    run = simulate(
        flatten(made), times, inputs={"motor.torque": lambda t: 0.2 * math.sin(30 * t)}, tolerance=1e-10
    )
    assert len(run.events) > 10
    between = run["motor.angle"] - run["load.angle"]
    beyond = np.maximum(between - 0.01, 0.0) - np.maximum(-between - 0.01, 0.0)
    speed = run["motor.speed"] - run["load.speed"]
    torque = np.where(beyond != 0.0, stiffness * beyond + damping * speed, 0.0)
    assert run["backlash.torque"] == pytest.approx(torque, abs=1e-9)
    work = cumulative_simpson(0.2 * np.sin(30 * times) * run["motor.speed"], x=times, initial=0.0)
    stored = J / 2 * run["motor.speed"] ** 2 + J * run["load.speed"] ** 2 + stiffness / 2 * beyond**2
    # The loss jumps with contact: the trapezoidal rule is as good as any there.
    power = np.where(beyond != 0.0, damping * speed**2, 0.0)
    lost = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(times))])
    assert np.max(np.abs(work - stored - lost)) < 1e-4 * np.max(work)
    assert lost[-1] > 0.01 * np.max(work)


# --- cables and knots -----------------------------------------------------------------------------


def test_a_loose_cable_catches_a_mass() -> None:
    """Free flight to the length, half a sine in the cable, free flight back."""
    mass, stiffness, length, speed = 0.5, 800.0, 0.03, 0.4
    cable = Slack(length=length, members=(("spring", Spring(stiffness=stiffness)),))
    made = assembly("catch", mass=Mass(mass=mass), cable=tie(cable, "mass"))
    run = simulate(flatten(made), np.linspace(0.0, 0.25, 26), start={"mass.speed": speed}, tolerance=1e-11)
    taut = length / speed
    slack = taut + math.pi * math.sqrt(mass / stiffness)
    assert [(e.what, e.time) for e in run.events] == [
        ("becomes taut", pytest.approx(taut, rel=1e-11)),
        ("goes slack", pytest.approx(slack, rel=1e-9)),
    ]
    assert run["mass.position"][-1] == pytest.approx(length - speed * (0.25 - slack), rel=1e-8)
    assert np.all(run["cable.force"] >= 0.0)


def test_taut_and_slack_of_an_inextensible_cable_are_located() -> None:
    cable = InextensibleCable(members=(("spring", Spring(stiffness=500.0)),))
    back = tie(Spring(stiffness=50.0), "mass")
    made = assembly("swing", mass=Mass(mass=0.2), cable=tie(cable, "mass"), back=back)
    run = simulate(flatten(made), np.linspace(0.0, 0.3, 31), start={"mass.position": 0.01}, tolerance=1e-11)
    slack = math.pi / 2 / math.sqrt(550.0 / 0.2)
    taut = slack + math.pi / math.sqrt(50.0 / 0.2)
    assert [(e.what, e.time) for e in run.events[:2]] == [
        ("goes slack", pytest.approx(slack, abs=1e-9)),
        ("becomes taut", pytest.approx(taut, abs=1e-9)),
    ]


def test_no_step_straddles_a_knot() -> None:
    """A mass on rubber of two moduli: harmonic on each side of the knot, as exact as the tolerance."""
    rubber = specimen(area=1e-4, rest_length=0.1, law=StrainStiffening(modulus=(1e6, 3e6), knots=(0.0, 0.2)))
    mass, soft, hard, knot = 0.3, 1e3, 4e3, 0.02
    made = assembly("swing", mass=Mass(mass=mass), rubber=tie(rubber, "mass"))
    speed = 2.0
    run = simulate(flatten(made), np.array([0.0, 0.02, 0.04]), start={"mass.speed": speed}, tolerance=1e-10)
    first = math.sqrt(soft / mass)
    meets = math.asin(knot * first / speed) / first
    there = speed * math.cos(first * meets)
    second, centre = math.sqrt(hard / mass), knot - soft * knot / hard
    phase = second * (0.02 - meets)
    place = centre + (knot - centre) * math.cos(phase) + there / second * math.sin(phase)
    assert (run.events[0].name, run.events[0].what) == ("rubber.law.knot_2", "engages modulus 2")
    assert run.events[0].time == pytest.approx(meets, abs=1e-11)
    assert run["mass.position"][1] == pytest.approx(place, abs=1e-10)


# --- smooth forms ---------------------------------------------------------------------------------


def ending(made: object, start: dict[str, float], name: str) -> float:
    return float(simulate(flatten(made), np.array([0.0, 0.35]), start=start, tolerance=1e-10)[name][-1])  # type: ignore[arg-type]


def test_smooth_friction_tends_to_the_sharp_one() -> None:
    """At first order in the width: the time spent where |ω| is about the width is, so is its torque."""
    made = assembly(
        "swing",
        wheel=Inertia(inertia=J),
        spring=tie(Spring(stiffness=2.0, domain=ROTATION), "wheel"),
        rub=tie(CoulombFriction(sliding_effort=0.05), "wheel"),
    )
    sharp = ending(made, {"wheel.angle": 0.33}, "wheel.angle")
    widths = (0.08, 0.04, 0.02, 0.01)
    first = {"wheel.angle": 0.33}
    errors = [abs(ending(smoothed(made, {"rub": w}), first, "wheel.angle") - sharp) for w in widths]
    rates = [math.log2(a / b) for a, b in pairwise(errors)]
    assert errors[-1] < 1e-4
    assert min(rates) > 0.9, (errors, rates)


@pytest.mark.parametrize("what", ["stop", "backlash"])
def test_rounded_corners_tend_to_the_sharp_ones(what: str) -> None:
    """At second order in the width, ∫(softplus − plus) = π²/6·w², or better where entry and exit cancel."""
    stop = EndStop(lower=-1.0, upper=0.1, stiffness=4.0, damping=0.1)
    backlash = Backlash(gap=0.2, members=(("spring", Spring(stiffness=4.0, domain=ROTATION)),))
    made = assembly("a", wheel=Inertia(inertia=J), it=tie(stop if what == "stop" else backlash, "wheel"))
    sharp = ending(made, {"wheel.speed": 0.9}, "wheel.angle")
    errors = [
        abs(ending(smoothed(made, {"it": w}), {"wheel.speed": 0.9}, "wheel.angle") - sharp)
        for w in (1e-3, 5e-4, 2.5e-4)
    ]
    rates = [math.log2(a / b) for a, b in pairwise(errors)]
    assert errors[-1] < 5e-5
    assert min(rates) > 1.7, (errors, rates)


def test_a_rigid_stop_is_the_limit_of_a_stiff_one() -> None:
    """Contact takes π·√(J/k): the difference falls with the root of the stiffness, with e from d·v."""
    made = assembly(
        "a", wheel=Inertia(inertia=J), it=tie(RigidStop(lower=-1.0, upper=0.1, restitution=1.0), "wheel")
    )
    sharp = ending(made, {"wheel.speed": 1.0}, "wheel.angle")
    errors = []
    for stiffness in (1e2, 4e2, 16e2):
        soft = EndStop(lower=-1.0, upper=0.1, stiffness=stiffness, damping=0.0, contact=Rounded(width=1e-6))
        errors.append(abs(ending(made.with_part("it", soft), {"wheel.speed": 1.0}, "wheel.angle") - sharp))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.02)


def test_smoothed_says_what_it_cannot_find() -> None:
    made = assembly("a", wheel=Inertia(inertia=J), rub=tie(CoulombFriction(sliding_effort=0.1), "wheel"))
    with pytest.raises(UnknownNameError, match=r"'rbu'.*did you mean 'rub'"):
        smoothed(made, {"rbu": 0.1})
    assert flatten(smoothed(made)).switching is None


def test_smoothed_reaches_what_lies_inside_others() -> None:
    rubber = specimen(area=1e-4, rest_length=0.1, law=StrainStiffening(modulus=(1e6, 3e6), knots=(0.0, 0.2)))
    cable = InextensibleCable(members=(("rubber", rubber),))
    made = assembly("a", mass=Mass(mass=0.1), it=tie(Slack(length=0.01, members=(("c", cable),)), "mass"))
    kinds = {path: type(part).__name__ for path, part in smoothed(made).walk()}
    assert kinds["it.c"] == "PullOnly"
    laws = [smoothed(made).element(path) for path in ("it", "it.c.rubber.law")]
    assert [type(law) for law in laws] == [Slack, StrainStiffening]
    assert all(isinstance(law.contact, Rounded) for law in laws)


# --- exports --------------------------------------------------------------------------------------


def test_the_controllers_code_refuses_what_jumps_and_fmus_take_it() -> None:
    sharp = assembly("sharp", wheel=Inertia(inertia=J), rub=tie(CoulombFriction(sliding_effort=0.1), "wheel"))
    with pytest.raises(ExportError, match=r"'rub'.*is not smooth.*smoothed\(assembly\)"):
        check_discrete(flatten(sharp))
    assert b"EventIndicator" in fmu_texts(flatten(sharp), version="3.0", step=1e-3)["modelDescription.xml"]
    stop = EndStop(lower=-1.0, upper=0.1, stiffness=40.0, damping=0.1)
    cornered = flatten(assembly("corner", wheel=Inertia(inertia=J), stop=tie(stop, "wheel")))
    assert cornered.switching is not None
    assert b"EventIndicator" not in fmu_texts(cornered, version="3.0", step=1e-3)["modelDescription.xml"]
    assert "modelDescription.xml" in fmu_texts(flatten(smoothed(sharp)), version="3.0", step=1e-3)
