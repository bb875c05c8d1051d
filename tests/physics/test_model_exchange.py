"""Model exchange: foreign integrators on the equations of an FMU against the package's own simulation."""

from __future__ import annotations

import math
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import pytest

from models import cam_rubber_actuator
from nlsdesign.deck import load_deck
from nlsdesign.export import export_fmu
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.hand_built import plant

VERSIONS = ("2.0", "3.0")
STEP = 1e-3
both = pytest.mark.parametrize("version", VERSIONS)


def stairs(times: np.ndarray, values: np.ndarray, name: str) -> np.ndarray:
    """Return an input of fmpy that is held from each sample to the next; it makes an event of each step."""
    rows = [(times[0], values[0])]
    for before, value, time in zip(values, values[1:], times[1:], strict=False):
        rows += [(time, before), (time, value)] if value != before else []
    return np.array([*rows, (times[-1], values[-1])], dtype=[("time", float), (name, float)])


def exchanged(
    path: Path, times: np.ndarray, shown: list[str], tolerance: float, **more: object
) -> np.ndarray:
    """Run an FMU with the integrator CVode of fmpy."""
    return fmpy.simulate_fmu(
        str(path), fmi_type="ModelExchange", stop_time=times[-1], output_interval=times[1] - times[0],
        relative_tolerance=tolerance, output=shown, record_events=False, **more,
    )  # fmt: skip


# --- smooth models --------------------------------------------------------------------------------


def published() -> FlatModel:
    deck = load_deck("austin2015_figure_consistent")
    return flatten(cam_rubber_actuator(deck), inputs=["motor.current"], outputs=["motor.angle"])


@both
@pytest.mark.parametrize("made", [plant, published], ids=["by hand", "published"])
def test_a_foreign_integrator_agrees_and_the_better_the_finer_it_is(made, version, tmp_path):
    """CVode's error accumulates over some hundred steps, so a thousand tolerances are allowed."""
    model, times = made(), STEP * np.arange(301)
    current = 3.0 * np.sin(40.0 * 0.02 * np.floor(times / 0.02 + 1e-9))
    shown = ["motor.angle", "motor.speed", "spring.torque"]
    own = simulate(model, times, inputs={"motor.current": current}, hold=True)
    path = export_fmu(model, tmp_path / "plant.fmu", version=version)
    worst = []
    for tolerance in (1e-5, 1e-7, 1e-9):
        run = exchanged(path, times, shown, tolerance, input=stairs(times, current, "motor.current"))
        assert len(run) == len(times)
        worst.append(max(np.abs(run[n] - own[n]).max() / np.abs(own[n]).max() for n in shown))
        assert worst[-1] < 1e3 * tolerance
    assert worst[0] > worst[1] > worst[2]


@both
def test_casadi_imports_the_plant_and_its_jacobian_is_that_of_central_differences(version, tmp_path):
    model = plant()
    folder = fmpy.extract(
        str(export_fmu(model, tmp_path / "plant.fmu", version=version)), str(tmp_path / "unpacked")
    )
    dae = ca.DaeBuilder("plant", str(folder))
    assert (dae.nx(), dae.nu(), dae.ny()) == (3, 1, 2)
    names = [v.name for v in model.states]
    assert dae.x() == names
    system = dae.create("system", ["x", "u"], ["ode", "y"])
    point, current = np.array([1e-3, 0.3, -2.0]), 1.0
    rate, shown = (np.array(each).ravel() for each in system(point, current))
    expected = model.evaluate(point.tolist(), [current])
    assert rate == pytest.approx([expected[f"der({n})"] for n in names], rel=1e-14)
    assert shown == pytest.approx([expected["motor.angle"], expected["spring.torque"]], rel=1e-14)
    blocks = [np.array(ca.DM(b)) for b in system.jacobian()(point, current, ca.DM.zeros(3), ca.DM.zeros(2))]
    found = np.vstack([np.hstack(blocks[:2]), np.hstack(blocks[2:])])

    def values(x: np.ndarray) -> np.ndarray:
        e = model.evaluate(x[:3].tolist(), x[3:].tolist())
        return np.array([e[f"der({n})"] for n in names] + [e["motor.angle"], e["spring.torque"]])

    at = np.append(point, current)
    for column, size in enumerate([1e-3, 1.0, 10.0, 5.0]):
        step = np.zeros(4)
        step[column] = 1e-5 * size
        slope = (values(at + step) - values(at - step)) / (2 * step[column])
        # Central differences are good to the square of the share that the step is.
        np.testing.assert_allclose(found[:, column], slope, rtol=1e-7, atol=1e-7 * np.abs(slope).max())
    assert math.isfinite(found.sum())
