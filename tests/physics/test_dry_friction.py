"""Dry friction that sticks, with located events, against closed forms and an integration by hand.

Independent roads: ramps, piecewise harmonic swings and stacks of inertias have closed forms; stick–slip on a
belt is integrated here by ``scipy.integrate.solve_ivp``, phase by phase with its own events, from equations
written in this file.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CoulombFriction,
    Dashpot,
    Driven,
    Element,
    Fixed,
    Inertia,
    LoadFriction,
    Mass,
    Spring,
    StribeckFriction,
    parallel,
    series,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ArrangementError, ConvergenceError
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate

J, K, T = 1e-3, 2.0, 0.05
FREQUENCY = math.sqrt(K / J)


def told(run: Trace, name: str = "rub") -> list[tuple[str, float]]:
    return [(e.what, e.time) for e in run.events if e.name == name]


def wheel(rub: Element, **more: Element) -> Assembly:
    ties = {name: tie(element, "wheel") for name, element in more.items()}
    return assembly("rubbing", wheel=Inertia(inertia=J), rub=tie(rub, "wheel"), **ties)


# --- ramp and rest --------------------------------------------------------------------------------


def test_a_ramp_of_torque_slips_at_its_moment() -> None:
    """Torque 0.13·t against 0.05 N·m: sticks exactly until T/0.13, then J·ω = 0.13·(t − t₁)²/2."""
    model = flatten(wheel(CoulombFriction(sliding_effort=T)))
    times = np.linspace(0.0, 1.0, 11)
    run = simulate(model, times, inputs={"wheel.torque": lambda t: 0.13 * t})
    start = T / 0.13
    since = np.clip(times - start, 0.0, None)
    assert told(run) == [("slips forward", pytest.approx(start, abs=1e-11))]
    assert np.all(run["wheel.speed"][times < start] == 0.0)
    assert np.all(run["wheel.angle"][times < start] == 0.0)
    assert run["wheel.speed"] == pytest.approx(0.13 * since**2 / (2 * J), rel=1e-9, abs=1e-12)
    assert run["wheel.angle"] == pytest.approx(0.13 * since**3 / (6 * J), rel=1e-9, abs=1e-12)
    # The friction is what holds while it sticks, and the sliding torque afterwards.
    assert run["rub.torque"] == pytest.approx(np.minimum(0.13 * times, T), rel=1e-12)


def test_what_sticks_does_not_drift() -> None:
    """A thousand seconds under half the torque that would move it."""
    model = flatten(wheel(CoulombFriction(sliding_effort=T), spring=Spring(stiffness=K, domain=ROTATION)))
    times = np.linspace(0.0, 1000.0, 101)
    drive = {"wheel.torque": lambda t: 0.5 * T * math.sin(3.7 * t)}
    run = simulate(model, times, inputs=drive, start={"wheel.angle": 0.4 * T / K}, tolerance=1e-6)
    assert run.events == ()
    assert np.all(run["wheel.speed"] == 0.0)
    assert np.all(run["wheel.angle"] == 0.4 * T / K)


@pytest.mark.parametrize("first", [0.33, -0.51])
def test_a_swing_loses_four_times_the_torque_over_stiffness_per_cycle(first: float) -> None:
    """Half cycles of π/Ω around ±T/K; each reversal is 2·T/K nearer to rest, until it sticks."""
    model = flatten(wheel(CoulombFriction(sliding_effort=T), spring=Spring(stiffness=K, domain=ROTATION)))
    times = np.linspace(0.0, 1.0, 1001)
    run = simulate(model, times, start={"wheel.angle": first}, tolerance=1e-11)
    expected, angle, side, half = np.zeros_like(times), abs(first), math.copysign(1.0, first), 0
    while angle > T / K:
        centre = side * T / K
        inside = times >= half * math.pi / FREQUENCY
        phase = FREQUENCY * (times[inside] - half * math.pi / FREQUENCY)
        expected[inside] = centre + (side * angle - centre) * np.cos(phase)
        angle, side, half = angle - 2 * T / K, -side, half + 1
    last = half * math.pi / FREQUENCY
    expected[times >= last] = side * angle
    assert half >= 4
    assert run["wheel.angle"] == pytest.approx(expected, abs=1e-10)
    moments = [t for _, t in told(run)]
    assert moments == pytest.approx([(k + 1) * math.pi / FREQUENCY for k in range(half)], abs=1e-9)
    assert [w for w, _ in told(run)][-1] == "sticks"
    assert np.all(run["wheel.speed"][times > last] == 0.0)


def test_halving_the_tolerance_moves_events_toward_the_closed_form() -> None:
    model = flatten(wheel(CoulombFriction(sliding_effort=T), spring=Spring(stiffness=K, domain=ROTATION)))
    errors = []
    for tolerance in (1e-4, 1e-7, 1e-10):
        run = simulate(model, np.array([0.0, 1.0]), start={"wheel.angle": 0.33}, tolerance=tolerance)
        errors.append(max(abs(t - (k + 1) * math.pi / FREQUENCY) for k, (_, t) in enumerate(told(run))))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-9


# --- phase by phase with scipy --------------------------------------------------------------------


def belt_by_hand(speed: float, stop: float, law: dict[str, float]) -> tuple[list[float], np.ndarray]:
    """Stick–slip of an inertia on a belt: moments of slipping and sticking, and (θ, ω) at the end."""
    moments: list[float] = []
    time, angle, rate, stuck = 0.0, 0.0, speed, True
    whole = law["sliding"] + law["breakaway"]
    while time < stop:
        if stuck:
            # Moves with the belt until the spring takes more than the friction holds.
            until = (whole / K - angle) / speed
            if time + until >= stop:
                return moments, np.array([angle + speed * (stop - time), speed])
            time, angle, stuck = time + until, whole / K, False
            moments.append(time)
            rate = speed

        def slide(_: float, x: np.ndarray) -> list[float]:
            fall = math.exp(-(((x[1] - speed) / law["fast"]) ** 2))
            return [x[1], (law["sliding"] + law["breakaway"] * fall - K * x[0]) / J]

        def catches(t: float, x: np.ndarray, begin: float = time) -> float:
            return x[1] - speed if t > begin + 1e-3 else -1.0

        catches.terminal, catches.direction = True, 1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            slide, (time, stop), [angle, rate], method="DOP853", events=catches, rtol=1e-12, atol=1e-13
        )
        time, (angle, rate) = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            moments.append(time)
            rate, stuck = speed, True
    return moments, np.array([angle, rate])


def test_stick_slip_on_a_belt() -> None:
    speed, stop = 0.4, 3.0
    law = {"sliding": 0.03, "breakaway": 0.04, "fast": 0.5}
    made = assembly(
        "belt",
        belt=Driven(),
        wheel=Inertia(inertia=J),
        spring=tie(Spring(stiffness=K, domain=ROTATION), "wheel"),
        rub=tie(StribeckFriction(sliding_effort=0.03, breakaway=0.04, stribeck_speed=0.5), "wheel", "belt"),
    )
    times = np.linspace(0.0, stop, 31)
    drive = {"belt.angle": lambda t: speed * t, "belt.speed": speed}
    run = simulate(flatten(made), times, inputs=drive, start={"wheel.speed": speed}, tolerance=1e-11)
    moments, last = belt_by_hand(speed, stop, law)
    assert len(moments) > 20
    assert [w for w, _ in told(run)] == (["slips backward", "sticks"] * 99)[: len(moments)]
    assert [t for _, t in told(run)] == pytest.approx(moments, abs=1e-7)
    assert [run["wheel.angle"][-1], run["wheel.speed"][-1]] == pytest.approx(last.tolist(), abs=1e-6)


def test_two_inertias_stick_to_each_other() -> None:
    """A torque on one drags the other; both slip as soon as the other needs more than the friction gives."""
    one, other, ramp = 2e-3, 5e-3, 0.4
    made = assembly(
        "clutch",
        driver=Inertia(inertia=one),
        driven=Inertia(inertia=other),
        rub=tie(CoulombFriction(sliding_effort=T), "driver", "driven"),
    )
    times = np.linspace(0.0, 0.4, 9)
    run = simulate(flatten(made), times, inputs={"driver.torque": lambda t: ramp * t})
    # While stuck the friction is the share other/(one + other) of the torque.
    slip = T * (one + other) / other / ramp
    assert told(run) == [("slips forward", pytest.approx(slip, rel=1e-11))]
    stuck = times < slip
    speed = ramp * times**2 / 2 / (one + other)
    assert np.all(run["driver.speed"][stuck] == run["driven.speed"][stuck])
    assert run["driven.speed"][stuck] == pytest.approx(speed[stuck], rel=1e-10)
    after = speed[~stuck] * 0 + ramp * slip**2 / 2 / (one + other) + T / other * (times[~stuck] - slip)
    assert run["driven.speed"][~stuck] == pytest.approx(after, rel=1e-9)
    momentum = one * run["driver.speed"] + other * run["driven.speed"]
    assert momentum == pytest.approx(ramp * times**2 / 2, rel=1e-11, abs=1e-15)


def test_a_loaded_gear_holds_its_load() -> None:
    """T_in ± µ·|T_in|: let go with µ = 0.2, it turns back only when the drive falls below 0.8 of the load."""
    gear = LoadFriction(ratio=0.2, members=(("spring", Spring(stiffness=K, domain=ROTATION)),))
    model = flatten(wheel(gear))
    times = np.linspace(0.0, 2.0, 21)
    start, load = 0.5, K * 0.5
    run = simulate(
        model, times, inputs={"wheel.torque": lambda t: load * (1.0 - 0.15 * t)}, start={"wheel.angle": start}
    )
    assert told(run, "rub")[0] == ("slips backward", pytest.approx(0.2 / 0.15, rel=1e-10))
    assert np.all(run["wheel.angle"][times < 1.33] == start)


def pulled_on_two_bearings(rate: float) -> Trace:
    """A wheel whose two frictions add, and whose torque grows by so many N·m/s from zero."""
    made = assembly(
        "two_bearings",
        wheel=Inertia(inertia=J), bench=Fixed(),
        rub=tie(CoulombFriction(sliding_effort=T), "wheel"),
        more=tie(CoulombFriction(sliding_effort=3 * T), "wheel", "bench"),
    )  # fmt: skip
    return simulate(flatten(made), np.linspace(0.0, 1.0, 11), inputs={"wheel.torque": lambda t: rate * t})


def test_two_frictions_on_one_shaft_share_the_load() -> None:
    """Their torques add: it slips at the sum, and while it sticks each carries its share."""
    run = pulled_on_two_bearings(0.4)
    (event,) = run.events
    assert event.time == pytest.approx(4 * T / 0.4, rel=1e-11)
    assert event.name == "rub+more"
    assert run["rub.torque"] == pytest.approx(np.minimum(0.1 * run.time, T), rel=1e-12)
    assert run["more.torque"] == pytest.approx(3 * run["rub.torque"], rel=1e-12)


def test_two_frictions_on_one_shaft_let_go_backward_too() -> None:
    """Pulled backward by a weight they slip backward at their sum, then slow it down with both torques."""
    run = pulled_on_two_bearings(-0.4)
    slip = 4 * T / 0.4
    assert told(run, "rub+more") == [("slips backward", pytest.approx(slip, rel=1e-11))]
    sliding = np.maximum(run.time - slip, 0.0)
    assert run["wheel.speed"] == pytest.approx(-0.4 / J * sliding**2 / 2, rel=1e-9)
    assert run["rub.torque"][-1] == pytest.approx(-T)
    assert run["more.torque"][-1] == pytest.approx(-3 * T)


def test_a_stack_of_sticking_inertias() -> None:
    """Three inertias and two frictions in a row: found together, and the outer one slips first."""
    made = assembly(
        "stack",
        a=Inertia(inertia=1e-3), b=Inertia(inertia=2e-3), c=Inertia(inertia=4e-3),
        ab=tie(CoulombFriction(sliding_effort=0.08), "a", "b"),
        bc=tie(CoulombFriction(sliding_effort=0.05), "b", "c"),
    )  # fmt: skip
    run = simulate(flatten(made), np.linspace(0.0, 0.5, 6), inputs={"a.torque": lambda t: 0.3 * t})
    second = 0.05 * 7 / 4 / 0.3
    # Then b feels 0.08 at most against 0.05 from c: a and b part when 0.3·t − (0.3·t − 0.05)/3 reaches 0.08.
    first = (0.08 - 0.05 / 3) * 1.5 / 0.3
    assert [(e.name, e.what) for e in run.events] == [("bc", "slips forward"), ("ab", "slips forward")]
    assert [e.time for e in run.events] == pytest.approx([second, first], rel=1e-10)


# --- power ----------------------------------------------------------------------------------------


@pytest.mark.long_cases("rub2-<lambda>")
@pytest.mark.parametrize(
    ("rub", "level"),
    [
        (CoulombFriction(sliding_effort=T), lambda run: np.full(len(run), T)),
        (
            StribeckFriction(sliding_effort=T, breakaway=0.03, stribeck_speed=0.7),
            lambda run: T + 0.03 * np.exp(-((run["wheel.speed"] / 0.7) ** 2)),
        ),
        (
            LoadFriction(ratio=0.1, members=(("in", Spring(stiffness=K / 2, domain=ROTATION)),)),
            lambda run: 0.1 * np.abs(K / 2 * run["wheel.angle"]),
        ),
    ],
)
def test_power_balance(rub: Element, level: object) -> None:
    """Work of the drive = energy of spring and wheel + ∫ level·|ω|, written here."""
    whole = K if not isinstance(rub, LoadFriction) else K / 2
    model = flatten(wheel(rub, spring=Spring(stiffness=whole, domain=ROTATION)))
    times = np.linspace(0.0, 1.0, 20_001)
    run = simulate(model, times, inputs={"wheel.torque": lambda t: 0.1 * math.sin(20 * t)}, tolerance=1e-10)
    speed = run["wheel.speed"]
    stiffness = K if not isinstance(rub, LoadFriction) else whole + K / 2
    work = cumulative_simpson(0.1 * np.sin(20 * times) * speed, x=times, initial=0.0)
    stored = J / 2 * speed**2 + stiffness / 2 * run["wheel.angle"] ** 2
    lost = cumulative_simpson(level(run) * np.abs(speed), x=times, initial=0.0)  # type: ignore[operator]
    assert np.max(np.abs(work - stored - lost)) < 2e-6 * np.max(np.abs(work))
    assert lost[-1] > 0.05 * np.max(work)
    assert {"sticks", "slips forward", "slips backward"} <= {w for w, _ in told(run)}


def test_a_sliding_body_sticks_and_slips_as_newton_says() -> None:
    """Force 4·t against 3 N on 2 kg: it sticks until 0.75 s, then m·v = ∫ (4·t − 3) dt."""
    friction = CoulombFriction(sliding_effort=3.0, domain=TRANSLATION)
    made = assembly("sledge", body=Mass(mass=2.0), rub=tie(friction, "body"))
    run = simulate(flatten(made), np.linspace(0.0, 2.0, 21), inputs={"body.force": lambda t: 4.0 * t})
    (event,) = run.events
    assert event.time == pytest.approx(0.75, rel=1e-9)
    after = np.maximum(run.time - 0.75, 0.0)
    assert run["body.speed"] == pytest.approx(after**2, abs=1e-9)
    assert np.all(run["body.speed"][run.time < 0.75] == 0.0)


# --- what is refused ------------------------------------------------------------------------------


def test_sticking_in_series_is_refused_by_name() -> None:
    inside = series(k=Spring(stiffness=K, domain=ROTATION), rub=CoulombFriction(sliding_effort=T))
    with pytest.raises(ArrangementError, match=r"net\.rub.*its rate is itself an unknown.*smoothed"):
        flatten(assembly("net", wheel=Inertia(inertia=J), net=tie(inside, "wheel")))


def test_friction_without_inertia_is_refused_by_name() -> None:
    with pytest.raises(ArrangementError, match=r"rub.*nothing with inertia"):
        flatten(
            assembly(
                "net", crank=Driven(), bench=Fixed(), rub=tie(CoulombFriction(sliding_effort=T), "crank")
            )
        )


def test_the_same_motion_held_twice_is_refused_by_name() -> None:
    """Two frictions in a row and a third around both: what each carries is not defined while all stick."""
    made = assembly(
        "net",
        a=Inertia(inertia=J), b=Inertia(inertia=J), c=Inertia(inertia=J),
        one=tie(CoulombFriction(sliding_effort=T), "a", "b"),
        two=tie(CoulombFriction(sliding_effort=T), "b", "c"),
        three=tie(CoulombFriction(sliding_effort=T), "a", "c"),
    )  # fmt: skip
    with pytest.raises(ArrangementError, match=r"'one' and 'two' and 'three'.*hold the same motion"):
        flatten(made)


def test_two_dry_frictions_between_the_same_bodies_are_refused_when_they_are_put_together() -> None:
    bodies = {"a": Inertia(inertia=J), "b": Inertia(inertia=J)}
    rub, oil = CoulombFriction(sliding_effort=T), Dashpot(damping=1e-3, domain=ROTATION)
    for second in (rub, rub.smooth(), parallel(oil=oil, rub=rub)):
        with pytest.raises(
            ArrangementError, match=r"'one' and 'two'.*both bring dry friction to 'b' and 'a'"
        ):
            assembly("net", **bodies, one=tie(rub, "a", "b"), two=tie(second, "b", "a"))
    # What is no twin: viscous friction twice, and dry friction against another body.
    assembly("net", **bodies, one=tie(oil, "a", "b"), two=tie(oil, "a", "b"), three=tie(rub, "a", "b"))
    assembly("net", **bodies, one=tie(rub, "a", "b"), two=tie(rub, "a"))


def test_load_that_contains_friction_is_refused_by_name() -> None:
    inside = parallel(k=Spring(stiffness=K, domain=ROTATION), rub=CoulombFriction(sliding_effort=T))
    made = wheel(
        LoadFriction(ratio=0.1, members=(("in", inside),)), damper=Dashpot(damping=1e-3, domain=ROTATION)
    )
    with pytest.raises(ArrangementError, match="a load contains another dry friction"):
        flatten(made)


def test_a_prescribed_speed_needs_its_acceleration() -> None:
    """Stuck to a body that is driven: without the acceleration its speed would run away from the other's."""
    made = assembly(
        "belt",
        belt=Driven(),
        wheel=Inertia(inertia=J),
        rub=tie(CoulombFriction(sliding_effort=T), "wheel", "belt"),
    )
    model, times = flatten(made), np.linspace(0.0, 1.0, 101)
    drive = {"belt.speed": lambda t: 2.0 * t, "belt.angle": lambda t: t * t}
    with pytest.raises(ConvergenceError, match=r"'rub' sticks, but its rate has changed.*acceleration"):
        simulate(model, times, inputs=drive)
    run = simulate(model, times, inputs=drive | {"belt.acceleration": 2.0})
    assert run["wheel.speed"] == pytest.approx(2.0 * times, abs=1e-12)
    assert run["rub.torque"] == pytest.approx(np.full(101, -2.0 * J), rel=1e-9)
