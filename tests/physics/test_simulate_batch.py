"""Many simulations at once: each column is what ``simulate`` gives for it, or says why not."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import ROTATION, CoulombFriction, Dashpot, RigidStop, Spring
from nlsdesign.export import natively
from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Sine, Trace, column_runs, simulate, simulate_batch, simulated_batch
from nlsdesign.simulation.buffered import Translate, as_it_is
from tests import observed as ob
from tests.physics.test_dry_friction import wheel

TOLERANCE = 1e-9
RANDOM = np.random.default_rng(11)


def one_by_one(model: FlatModel, times: np.ndarray, columns: dict[str, np.ndarray], **given: object) -> None:
    """Compare each column of a batch with the same simulation alone."""
    keep = [v.name for v in (*model.states, *model.signals)]
    translate = given.pop("translate", as_it_is)
    batch = simulate_batch(
        model, times, draws=columns, keep=keep, tolerance=TOLERANCE, translate=translate, **given
    )
    assert batch.failures == {}
    for i in range(len(batch.events)):
        values = {name: float(each[i]) for name, each in columns.items()}
        alone = simulate(model.with_values(values), times, tolerance=TOLERANCE, **given)
        assert [(e.name, e.what) for e in batch.events[i]] == [(e.name, e.what) for e in alone.events]
        moments = [e.time for e in alone.events]
        assert [e.time for e in batch.events[i]] == pytest.approx(moments, abs=100 * TOLERANCE)
        for name in keep:
            size = np.max(np.abs(alone[name])) + 1e-9
            # The steps are the same but for the last digits of their lengths, far below the tolerance.
            assert np.max(np.abs(batch[name][i] - alone[name])) <= 10 * TOLERANCE * size, (i, name)


@pytest.mark.long_cases("1")
@pytest.mark.parametrize("least", [1, 1000])
def test_the_published_actuator_with_corners_in_its_rubber(
    monkeypatch: pytest.MonkeyPatch, least: int
) -> None:
    """With NumPy, as for many columns, and with CasADi, as for few."""
    monkeypatch.setattr(column_runs, "MANY", least)
    plant = ob.bench(ob.SLOW)
    columns = {
        "motor.inertia": RANDOM.uniform(4e-4, 9e-4, 3), "spring.pretension": RANDOM.uniform(0.0, 1e-3, 3),
        "motor.angle": RANDOM.uniform(-0.2, 0.2, 3),
    }  # fmt: skip
    drive = {"motor.current": Sine(3.0, 6.0)}
    one_by_one(plant, np.linspace(0.0, 0.1, 6), columns, inputs=drive)


@pytest.mark.parametrize("translate", [as_it_is, natively])
def test_stiction_and_stops_are_met_by_each_column_at_its_own_time(translate: Translate) -> None:
    rubbing = flatten(
        wheel(CoulombFriction(sliding_effort=0.05), spring=Spring(stiffness=2.0, domain=ROTATION))
    )
    one_by_one(rubbing, np.linspace(0.0, 0.6, 25), {"wheel.angle": np.array([0.33, -0.51, 0.01, 0.1])},
               translate=translate)  # fmt: skip
    stopped = flatten(wheel(RigidStop(lower=-0.1, upper=0.2, restitution=0.5, resting_speed=1e-3)))
    columns = {"wheel.speed": np.array([0.4, -0.4, 2.0]), "wheel.inertia": np.array([1e-3, 2e-3, 3e-3])}
    one_by_one(stopped, np.linspace(0.0, 1.0, 21), columns, inputs={"wheel.torque": lambda t: 0.002 * t},
               translate=translate)  # fmt: skip


def test_samples_and_functions_drive_all_columns() -> None:
    model = flatten(
        wheel(Dashpot(damping=0.01, domain=ROTATION), spring=Spring(stiffness=1.0, domain=ROTATION))
    )
    times = np.sort(RANDOM.uniform(0.0, 1.0, 12))
    columns = {"rub.damping": np.array([0.01, 0.05, 0.002])}
    for drive in (RANDOM.normal(0.0, 0.1, 12), lambda t: 0.1 * np.cos(30.0 * t), 0.04):
        one_by_one(model, times, columns, inputs={"wheel.torque": drive})


def test_a_column_that_fails_is_named_and_the_others_go_on() -> None:
    model = flatten(wheel(Dashpot(damping=0.01, domain=ROTATION)))
    times, names = np.linspace(0.0, 0.1, 3), ["wheel.angle"]
    columns = {
        "wheel.inertia": np.array([1e-3, -1e-3, np.nan, 1e-3]),
        "wheel.speed": np.array([1.0, 1.0, 1.0, 1e308]),
    }  # fmt: skip
    batch = simulate_batch(model, times, draws=columns, keep=names)
    assert sorted(batch.failures) == [1, 2, 3]
    assert "wheel.inertia = -0.001: must be a finite number in [1e-12, 1e+06] kg*m^2" in batch.failures[1]
    assert batch.done.tolist() == [True, False, False, False]
    assert np.all(np.isnan(batch["wheel.angle"][1:]))
    assert np.all(np.isfinite(batch["wheel.angle"][0]))
    assert batch.units == {"wheel.angle": "rad"}


def test_a_stiff_column_is_simulated_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A time constant of 10 ns beside others of 0.1 s: explicit steps would be a hundred million."""
    model = flatten(
        wheel(Dashpot(damping=0.01, domain=ROTATION), spring=Spring(stiffness=1.0, domain=ROTATION))
    )
    times = np.linspace(0.0, 0.5, 6)
    columns = {"wheel.angle": np.array([0.1, 0.1]), "rub.damping": np.array([0.01, 1e5])}
    alone_with: list[float] = []

    def listening(model: FlatModel, times: np.ndarray, **given: object) -> Trace:
        alone_with.append(model.values["rub.damping"])
        return simulate(model, times, **given)

    monkeypatch.setattr(simulated_batch, "simulate", listening)
    batch = simulate_batch(model, times, draws=columns, keep=["wheel.angle"], tolerance=1e-8)
    assert batch.failures == {}
    assert alone_with == [1e5]
    for i in range(2):
        alone = simulate(
            model.with_values({name: float(v[i]) for name, v in columns.items()}), times, tolerance=1e-8
        )
        assert batch["wheel.angle"][i] == pytest.approx(alone["wheel.angle"], abs=1e-9)


def test_bad_input_is_refused_in_words() -> None:
    model = flatten(wheel(Dashpot(damping=0.01, domain=ROTATION)))
    times, good = np.linspace(0.0, 0.1, 3), {"wheel.inertia": np.array([1e-3, 2e-3])}
    with pytest.raises(UnknownNameError, match=r"wheel\.inertai.*did you mean 'wheel\.inertia'"):
        simulate_batch(model, times, draws={"wheel.inertai": np.ones(2)}, keep=["wheel.angle"])
    with pytest.raises(UnknownNameError, match=r"wheel\.angel.*did you mean 'wheel\.angle'"):
        simulate_batch(model, times, draws=good, keep=["wheel.angel"])
    with pytest.raises(ValueRangeError, match=r"columns of shapes \(2,\), \(3,\)"):
        simulate_batch(model, times, draws=good | {"rub.damping": np.ones(3)}, keep=["wheel.angle"])
    with pytest.raises(ValueRangeError, match="columns of shapes none"):
        simulate_batch(model, times, draws={}, keep=["wheel.angle"])
    with pytest.raises(ValueRangeError, match="strictly ascending"):
        simulate_batch(model, times[::-1], draws=good, keep=["wheel.angle"])
    batch = simulate_batch(model, times, draws=good, keep=["wheel.angle"])
    with pytest.raises(UnknownNameError, match=r"wheel\.speed"):
        batch["wheel.speed"]
