"""Location of events, compiled steps, and what a trace tells of events."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from nlsdesign.components import ROTATION, Backlash, CoulombFriction, EndStop, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.export import natively
from nlsdesign.export.compilation.cross_compiler import compiler
from nlsdesign.foundation.errors import ArrangementError, ExportError
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.transform import replace_state, with_outputs, with_signal
from nlsdesign.simulation import Sine, simulate
from nlsdesign.simulation.events import Event, locate_event
from nlsdesign.simulation.input_signals import drives_of

LAWS: list[tuple[Callable[[float], float], float]] = [
    (lambda h: math.cos(1.2 * h) - 0.3, math.acos(0.3) / 1.2),
    (lambda h: 0.7 - h, 0.7),
    (lambda h: h * (0.5 - h), 0.5),
    (lambda h: (0.3 - h) ** 3, 0.3),
    (lambda h: 1.0 if h < 0.21 else -1.0, 0.21),
    (lambda h: math.exp(-40 * h) - 1e-3, math.log(1e3) / 40),
]


@pytest.mark.parametrize(("law", "root"), LAWS)
def test_an_event_is_located_from_behind(law: Callable[[float], float], root: float) -> None:
    asked: list[float] = []

    def lasts(length: float) -> float:
        asked.append(length)
        return law(length)

    found = locate_event(lasts, 1.2, 1e-12)
    assert root <= found + 1e-15
    assert found - root < 1e-12
    assert asked[-1] == found, "the step that is kept is the last one that was taken"
    assert law(found) < 0.0
    assert len(asked) < 50, "no worse than halving"


def test_smooth_laws_take_few_steps() -> None:
    for law, _ in LAWS[:3]:
        asked: list[float] = []
        locate_event(lambda h, law=law, asked=asked: asked.append(h) or law(h), 1.2, 1e-12)  # type: ignore[misc]
        assert len(asked) <= 11


def gear() -> FlatModel:
    inside = (("spring", Spring(stiffness=50.0, domain=ROTATION)),)
    return flatten(
        assembly(
            "gear",
            motor=Inertia(inertia=1e-3),
            load=Inertia(inertia=2e-3),
            backlash=tie(Backlash(gap=0.02, members=inside), "motor", "load"),
            rub=tie(CoulombFriction(sliding_effort=0.03), "motor"),
        )
    )


def test_a_compiled_step_gives_the_same_numbers() -> None:
    try:
        compiler()
    except ExportError as missing:
        # The compiler is an extra: the package works without, and what is skipped needs one by its nature.
        pytest.skip(str(missing))
    model, times = gear(), np.linspace(0.0, 0.3, 31)
    drive = {"motor.torque": Sine(0.1, 5.0)}
    one = simulate(model, times, inputs=drive)
    other = simulate(model, times, inputs=drive, translate=natively)
    assert [(e.name, e.what) for e in one.events] == [(e.name, e.what) for e in other.events]
    assert len(one.events) > 5
    assert other["load.angle"] == pytest.approx(one["load.angle"], rel=1e-9, abs=1e-12)


def test_events_are_told_in_words_and_in_order() -> None:
    run = simulate(gear(), np.linspace(0.0, 0.3, 31), inputs={"motor.torque": Sine(0.1, 5.0)})
    assert all(isinstance(e, Event) for e in run.events)
    assert [e.time for e in run.events] == sorted(e.time for e in run.events)
    assert f"{len(run.events)} events, the first at {run.events[0]}" in str(run)
    assert str(run.events[0]) == f"{run.events[0].time:.9g} s: rub slips forward"


def test_a_sine_at_many_times_is_the_sine_at_each() -> None:
    wave, times = Sine(1.3, 2.5, 0.2, 0.7), np.linspace(0.0, 1.0, 13)
    assert wave.at(times) == pytest.approx([wave(t) for t in times], abs=1e-15)
    model = gear()
    drives = drives_of(model, times, {"motor.torque": wave}, hold=False)
    assert drives.at(3, times[3:5])[:, 0] == pytest.approx([wave(times[3]), wave(times[4])], abs=1e-15)


def test_other_views_keep_switches_or_refuse() -> None:
    model = gear()
    seen = with_outputs(model, ["load.angle"])
    assert seen.switching is not None
    assert model.switching is not None
    assert seen.switching.branch is model.switching.branch
    doubled = with_signal(seen, Variable("twice", "rad", "twice the angle"), lambda n: 2 * n["load.angle"])
    point = (0.0, [0.4, -1.3, 0.1, 0.7], [0.2, 0.0], model.start(model.parameters))
    for view in (model, seen, doubled):
        assert view.switching is not None
        # At the modes that belong to the state, what is shown is what the equations give.
        found = view.switching.shown(*point, view.switching.natural(*point))
        _, *expected, _ = view.equations(*point, [])
        for one, other in zip(found, expected, strict=True):
            assert np.array(one).ravel() == pytest.approx(np.array(other).ravel(), rel=1e-14)
    assert float(found[1][-1]) == pytest.approx(0.2, rel=1e-14)
    spring = flatten(
        assembly(
            "a",
            wheel=Inertia(inertia=1e-3),
            s=tie(Spring(stiffness=2.0, domain=ROTATION), "wheel"),
            rub=tie(CoulombFriction(sliding_effort=0.03), "wheel"),
        )
    )
    with pytest.raises(ArrangementError, match=r"'rub' is sharp.*smoothed\(assembly\)"):
        replace_state(spring, "wheel.angle", "s.torque")


def test_equations_at_rest_are_those_of_sticking() -> None:
    """Without simulation too: at exactly zero speed the friction holds, just beside it slips."""
    model = flatten(
        assembly("a", wheel=Inertia(inertia=1e-3), rub=tie(CoulombFriction(sliding_effort=0.03), "wheel"))
    )
    assert model.evaluate([0.0, 0.0], [0.02])["rub.torque"] == 0.02
    assert model.evaluate([0.0, 0.0], [0.02])["der(wheel.speed)"] == 0.0
    assert model.evaluate([0.0, 0.0], [-0.05])["rub.torque"] == -0.03
    assert model.evaluate([0.0, 1e-9], [0.02])["rub.torque"] == 0.03
    assert model.evaluate([0.0, -1e-9], [0.02])["der(wheel.speed)"] == pytest.approx(50.0)


@pytest.mark.parametrize("angle", [-1.3, 0.04, 0.3])
def test_a_corner_lasts_as_long_as_its_distance_is_positive(angle: float) -> None:
    """What locates it is the distance itself, which has a slope there: not its inverse, which has a pole."""
    stop = tie(EndStop(lower=-1.0, upper=0.1, stiffness=400.0, damping=0.0), "wheel")
    model = flatten(assembly("a", wheel=Inertia(inertia=1e-3), stop=stop))
    given = (0.0, [angle, 0.0], [0.0], model.start(model.parameters))
    modes = model.switching.natural(*given)
    lasts = np.array(model.switching.branch(*given, modes)[1]).ravel()
    assert sorted(lasts) == pytest.approx(sorted([abs(0.1 - angle), abs(angle + 1.0)]))
