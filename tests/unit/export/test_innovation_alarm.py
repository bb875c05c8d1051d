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
from nlsdesign.feedback.observer.spread.innovation_alarm import (
    acceleration_gain,
    declared_balance,
    explained,
)
from nlsdesign.model import Variable

DECK, INNOVATION = "austin2015_figure_consistent", "motor.angle.innovation"
UNEXPLAINED = "motor.angle.unexplained"


@cache
def plant() -> nls.FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(DECK)))


@cache
def cascade() -> nls.FlatModel:
    return designed_observer(plant(), kind="cascade").model


def bound(observer: nls.FlatModel, machine: nls.FlatModel | None = None) -> tuple[float, float, float]:
    balance = declared_balance(plant(), "spring.torque", "motor.angle")
    return explained(observer, machine or plant(), balance, "motor.angle")


def test_step_and_reference_agree_and_follow_the_formula(tmp_path: Path) -> None:
    """The mean of e² over what explains it, each at most nine, the slower the less motion adds."""
    model, draw = cascade(), np.random.default_rng(5)
    limit, spring, drive = bound(model)
    reference, step = GuardedModel(model), CompiledStep(nls.export_c(model, tmp_path))
    names, mean, seen = [v.name for v in model.outputs], 0.0, set()
    for k in range(3000):
        given = [0.3 * math.sin(0.01 * k) + 1e-3 * draw.normal(), 2.0 if k % 1000 < 500 else 0.0]
        outputs, status = reference.step(given)
        assert step(given)[1] == status
        at = dict(zip(names, outputs, strict=True))
        explains = limit + spring * at["spring.torque"] ** 2 + drive * given[1] ** 2
        surprise = min(at[INNOVATION] ** 2 / explains, 9.0)
        mean += (1.0 - limit / explains) * 1e-3 / 2.0 * (surprise - mean)
        assert at[UNEXPLAINED] == pytest.approx(mean, rel=1e-9, abs=1e-15)
        assert bool(status & INNOVATION_LARGE) == (mean > 1.0)
        seen.add(mean > 1.0)
    assert seen == {False, True}


def test_the_gain_is_that_of_the_double_pole() -> None:
    """An acceleration that is not expected shows as a·T²/(1 − p)² with both poles at p."""
    pole = math.exp(-2.0 * math.pi * 30.0 * 1e-3)
    assert acceleration_gain(cascade()) == pytest.approx((1e-3 / (1.0 - pole)) ** 2, rel=0.01)


def test_the_bound_follows_from_count_and_spreads() -> None:
    """What drive and spring give over the inertia: 10 % each of torque constant and inertia are ln 1.1·√2."""
    values, (limit, _, drive) = plant().values, bound(cascade())
    gain = acceleration_gain(cascade()) * values["motor.gear_ratio"] * values["motor.torque_constant"]
    expected = (3.0 * gain / values["motor.inertia"] * math.sqrt(2.0) * math.log(1.1)) ** 2
    assert drive == pytest.approx(expected, rel=0.02)
    assert limit > values["motor_encoder.quantum"] ** 2
    noisy = replace(
        plant(), parameters=(*plant().parameters, Variable("motor_encoder.noise", "rad", "", 2e-3))
    )
    assert bound(cascade(), noisy)[0] - limit == pytest.approx((3.0 * 2e-3) ** 2)
    exact = replace(plant(), parameters=tuple(replace(v, spread=0.0) for v in plant().parameters))
    bare = designed_observer(exact, kind="cascade").model
    assert UNEXPLAINED not in {v.name for v in bare.outputs}
    assert with_innovation_alarm(bare, exact) is bare
    assert with_innovation_alarm(cascade(), plant()) is cascade()


@pytest.mark.parametrize("kind", ["cascade", pytest.param("corrected", marks=pytest.mark.slow)])
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
    """With the current that the joined step computed the observer alone gives the same mean."""
    both = joined(cascade(), nls.torque_controller(plant()))
    together, alone = GuardedModel(both), GuardedModel(cascade())
    place, acting, means = [v.name for v in both.outputs].index(UNEXPLAINED), 0.0, []
    for k in range(200):
        angle = 0.2 * math.sin(0.1 * k)
        outputs, _ = together.step([angle, 3.0])
        means.append(outputs[place])
        assert alone.step([angle, acting])[0][-1] == pytest.approx(means[-1], rel=1e-9, abs=1e-15)
        acting = outputs[-1]
    assert max(means) > 0.0
