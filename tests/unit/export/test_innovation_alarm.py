"""The bit INNOVATION_LARGE: what is computed, what the bound is, and what sets it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.export.c.guarded_step import INNOVATION_LARGE, GuardedModel
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.control import joined
from nlsdesign.feedback.observer import designed_observer, with_innovation_alarm
from nlsdesign.feedback.observer.spread.innovation_alarm import acceleration_gain
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import Alarm
from tests.golden.test_export_text import damper

DECK, ANGLE = "austin2015_figure_consistent", "motor.angle.innovation"


@cache
def plant() -> nls.FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(DECK)))


@cache
def cascade() -> nls.FlatModel:
    return designed_observer(plant(), kind="cascade").model


def alarm_of(model: nls.FlatModel, name: str = ANGLE) -> Alarm:
    (alarm,) = (v.alarm for v in model.outputs if v.name == name)
    assert alarm is not None
    return alarm


@pytest.mark.parametrize("real", ["float", "double"])
def test_the_step_in_c_the_reference_and_the_formula_agree(real: str, tmp_path: Path) -> None:
    """The mean of f² over what explains it, each at most nine, the slower the less motion adds."""
    alarm = Alarm(0.2, (("piston.filtered", 0.5), ("valve.opening", 0.25)), 2.0)
    model, draw = damper(), np.random.default_rng(5)
    model = replace(model, outputs=tuple(replace(v, alarm=alarm) for v in model.outputs))
    reference, step = GuardedModel(model), CompiledStep(nls.export_c(model, tmp_path, real=real))
    mean, state, seen = 0.0, 0.0, set()
    for k in range(3000):
        speed = 0.9 * math.sin(0.02 * k) + 0.05 * draw.normal()
        given = [min(max(speed, -0.99), 0.99), 1.0 if k % 1000 < 500 else 0.1]
        (force,), status = reference.step(given)
        assert step(given)[1] == status
        state = float(reference.state[0]) if k == 0 else state
        explained = 0.2 + 0.5 * before(state, k, given) ** 2 + 0.25 * reference._inputs[1] ** 2
        mean += (1.0 - 0.2 / explained) * 0.01 / 2.0 * (min(force**2 / explained, 9.0) - mean)
        state = float(reference.state[0])
        assert bool(status & INNOVATION_LARGE) == (mean > 1.0)
        seen.add(mean > 1.0)
    assert seen == {False, True}


def before(state: float, k: int, given: list[float]) -> float:
    """The state that the outputs of a sample came from; the first one is that of a machine that begins."""
    return given[0] if k == 0 else state


def test_the_gain_is_that_of_the_double_pole() -> None:
    """An acceleration that is not expected shows as a·T²/(1 − p)² with both poles at p."""
    pole = math.exp(-2.0 * math.pi * 30.0 * 1e-3)
    assert acceleration_gain(cascade()) == pytest.approx((1e-3 / (1.0 - pole)) ** 2, rel=0.01)


def test_the_bound_follows_from_count_and_spreads() -> None:
    """What drive and spring give over the inertia: 10 % each of torque constant and inertia are ln 1.1·√2."""
    alarm, values = alarm_of(cascade()), plant().values
    drive = dict(alarm.shares)["motor.current"]
    gain = acceleration_gain(cascade()) * values["motor.gear_ratio"] * values["motor.torque_constant"]
    expected = (3.0 * gain / values["motor.inertia"] * math.sqrt(2.0) * math.log(1.1)) ** 2
    assert drive == pytest.approx(expected, rel=0.02)
    assert alarm.limit > values["motor_encoder.quantum"] ** 2
    exact = replace(plant(), parameters=tuple(replace(v, spread=0.0) for v in plant().parameters))
    bare = designed_observer(exact, kind="cascade").model
    assert with_innovation_alarm(bare, exact) is bare


@pytest.mark.parametrize("kind", ["cascade", "corrected"])
def test_a_machine_as_declared_is_quiet_and_a_drifting_encoder_is_not(kind: str) -> None:
    times = np.arange(0.0, 1.5, 1e-3)
    current = 3.0 * np.sin(2.0 * np.pi * 2.0 * times)
    run = nls.simulate(plant(), times, inputs={"motor.current": current}, hold=True)
    observer = designed_observer(plant(), kind=kind).model
    for drift, alarmed in ((0.0, False), (0.3, True)):
        step = GuardedModel(observer)
        angles = run["motor.angle"] + drift * times
        words = [step.step(row)[1] for row in np.column_stack([angles, current]).tolist()]
        assert any(word & INNOVATION_LARGE for word in words) == alarmed


def test_the_joined_step_judges_by_the_current_that_acts() -> None:
    both = joined(cascade(), nls.torque_controller(plant()))
    shares = dict(alarm_of(both).shares)
    assert shares == {
        "spring.torque": dict(alarm_of(cascade()).shares)["spring.torque"],
        "motor.current.acting": dict(alarm_of(cascade()).shares)["motor.current"],
    }


def test_numbers_that_are_none_are_refused() -> None:
    for wrong in ({"limit": 0.0}, {"limit": math.inf}, {"limit": 1.0, "window": -1.0}):
        with pytest.raises(ValueRangeError, match="needs a positive limit"):
            Alarm(**wrong)
