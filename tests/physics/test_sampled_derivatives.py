"""Directional derivatives of sampled FMUs against central differences, of the model and of the FMU itself."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_fmu
from nlsdesign.feedback.control import joined, torque_controller
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel
from tests.fmu_unit import Refused, Unit, opened
from tests.hand_built import observer

NAMES = ("table by hand", "observer", "controller", "both")


@cache
def models() -> dict[str, FlatModel]:
    plant = flatten(declare(load_deck("austin2015_as_printed")))
    watching, steering = design_observer(plant, gain=CascadeGain()), torque_controller(plant)
    return {
        "table by hand": observer(),
        "observer": watching,
        "controller": steering,
        "both": joined(watching, steering),
    }


def moved(model: FlatModel, unit: Unit, count: int) -> dict[str, float]:
    """Step with smooth inputs, which no guard changes; return the last inputs."""
    inputs: dict[str, float] = {}
    for k in range(count):
        inputs = {
            v.name: 0.15 * math.sin((0.02 + 0.01 * i) * k + i) - 0.15 * math.sin(i)
            for i, v in enumerate(model.inputs)
        }
        unit.put(inputs)
        unit.step(float(model.sample_time or 0.0))
    assert unit.get_integer(unit.references["sample.status"]) == 0
    return inputs


def computed(model: FlatModel, at: dict[str, float], names: list[str]) -> np.ndarray:
    """Outputs and signals of the model's equations at one point."""
    x, u, p = ([at[v.name] for v in group] for group in (model.states, model.inputs, model.parameters))
    _, y, s, _ = model.equations(0.0, x, u, p, model.look_up(x, u))
    values = np.concatenate([np.array(y).ravel(), np.array(s).ravel()])
    labels = [v.name for v in (*model.outputs, *model.signals)]
    by_name = dict(zip(labels, values.tolist(), strict=True))
    return np.array([by_name[name] for name in names])


QUICK = {("both", "3.0"), ("table by hand", "2.0")}


@pytest.mark.parametrize(
    ("name", "version"),
    [
        pytest.param(name, version, marks=() if (name, version) in QUICK else pytest.mark.slow)
        for name in NAMES
        for version in ("2.0", "3.0")
    ],
)
def test_derivatives_of_the_last_sample_are_those_of_the_equations(name, version, tmp_path):
    model = models()[name]
    knowns = [v.name for v in (*model.states, *model.inputs, *model.parameters)]
    taken = {v.name for v in (*model.states, *model.inputs)}
    unknowns = [n for n in dict.fromkeys(v.name for v in (*model.outputs, *model.signals)) if n not in taken]
    with opened(export_fmu(model, tmp_path / "x.fmu", version=version)) as unit:
        unit.begin().run()
        inputs = moved(model, unit, 60)
        shown = [v.name for v in (*model.states, *model.parameters)]
        at = dict(zip(shown, unit.get(*shown), strict=True)) | inputs
        np.testing.assert_allclose(computed(model, at, unknowns), unit.get(*unknowns), rtol=1e-9, atol=1e-12)
        seen = 0
        for known in knowns:
            step = 1e-6 * max(1.0, abs(at[known]))
            sides = [computed(model, at | {known: at[known] + sign * step}, unknowns) for sign in (1, -1)]
            expected = (sides[0] - sides[1]) / (2.0 * step)
            found = unit.derivative(unknowns, [known], [1.0])
            scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max() + 1e-6)
            np.testing.assert_allclose(found / scale, expected / scale, atol=2e-5, err_msg=known)
            seen += int(np.any(expected != 0.0))
        assert seen >= len(model.inputs) + 1
        # A direction is the sum of its parts.
        seed = np.random.default_rng(8).uniform(-1, 1, len(knowns)).tolist()
        parts = [np.array(unit.derivative(unknowns, [k], [s])) for k, s in zip(knowns, seed, strict=True)]
        whole = unit.derivative(unknowns, knowns, seed)
        np.testing.assert_allclose(whole, np.sum(parts, axis=0), rtol=1e-9, atol=1e-9 * np.abs(parts).max())


def test_the_slope_over_an_input_is_that_which_the_fmu_itself_shows(tmp_path):
    model = models()["table by hand"]
    with opened(export_fmu(model, tmp_path / "x.fmu")) as unit:
        unit.begin().run()
        inputs = moved(model, unit, 40)
        kept, time = unit.raw.getFMUState(), unit.time
        outcomes = []
        for change in (0.0, 1e-6, -1e-6):
            unit.raw.setFMUState(kept)
            unit.time = time
            unit.put(inputs | {"motor.angle": inputs["motor.angle"] + change})
            unit.step(float(model.sample_time or 0.0))
            if not change:
                slope = unit.derivative(["spring.torque"], ["motor.angle"], [1.0])[0]
            outcomes += unit.get("spring.torque")
        assert slope == pytest.approx((outcomes[1] - outcomes[2]) / 2e-6, rel=1e-6)
        assert abs(slope) > 0.1


def test_there_is_no_derivative_of_a_sample_that_was_not_taken_as_it_was(tmp_path):
    model = models()["table by hand"]
    asked = (["spring.torque"], ["motor.angle"], [1.0])
    with opened(export_fmu(model, tmp_path / "x.fmu")) as unit:
        unit.begin().run()
        with pytest.raises(Refused):
            unit.derivative(*asked)
        moved(model, unit, 5)
        unit.derivative(*asked)
        unit.put({"motor.angle": math.nan})
        unit.step(float(model.sample_time or 0.0))
        with pytest.raises(Refused):
            unit.derivative(*asked)
        assert "taken as it was" in unit.log[-1][2]
        with pytest.raises(Refused):
            unit.derivative(["spring.torque"], ["innovation"], [1.0])
