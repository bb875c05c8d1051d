"""Models of MuJoCo: both forms follow our own simulation, and what MuJoCo cannot carry is refused."""

from __future__ import annotations

import ctypes
import importlib.util
import math
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects import catalogue
from nlsdesign.components import CoulombFriction, Inertia, Spring, assembly, smoothed, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.core.element import ROTATION
from nlsdesign.export import export_mujoco, read_exports
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.mujoco.actuator_model import MujocoModel
from nlsdesign.feedback.control import encoder_loop, joined, torque_controller
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ExportError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.command_line import Run, run

__all__ = ["run"]

mujoco: Any = pytest.importorskip("mujoco")
DECK = "austin2015_figure_consistent"
STEP = 1e-3  # s
CLOSE = 1e-3
"""Largest rms difference from our own simulation, over the rms of the motion."""


def plant(deck: str = DECK) -> FlatModel:
    # The code of the page in docs loads a plug-in of the deck's own name, maybe in this process.
    return replace(flatten(smoothed(declare(load_deck(deck)))), name=f"{deck}_smooth")


def module_of(written: MujocoModel) -> ModuleType:
    spec = importlib.util.spec_from_file_location(written.name, written.module)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings into a file of the present folder."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> tuple[MujocoModel, ModuleType]:
    if not shutil.which("cc"):
        pytest.skip("there is no C compiler")
    written = export_mujoco(plant(), tmp_path_factory.mktemp("mujoco"))
    module = module_of(written)
    module.load_plugin()
    return written, module


def test_a_second_plugin_of_a_name_is_refused_and_leaves_the_process_able_to_load(
    exported: tuple[MujocoModel, ModuleType], tmp_path: Path
) -> None:
    """An error of MuJoCo while a library is loaded leaves the loader locked: any other thread hangs then."""
    written, _ = exported
    again = module_of(export_mujoco(plant(), tmp_path / "same"))
    again.load_plugin()
    stiffer = plant().with_values({"bearing.damping": 2.0 * plant().values["bearing.damping"]})
    other = export_mujoco(stiffer, tmp_path / "other")
    assert other.name == written.name
    with pytest.raises(RuntimeError, match="has loaded other laws under that name"):
        module_of(other).load_plugin()
    library = shutil.copy(written.module.with_name(f"{written.name}_plugin.so"), tmp_path)
    mujoco.mj_loadPluginLibrary(str(library))
    loading = threading.Thread(target=ctypes.CDLL, args=(None,), daemon=True)
    loading.start()
    loading.join(20.0)
    assert not loading.is_alive()


def difference(angles: Array, own: Array) -> float:
    return float(np.sqrt(np.mean((angles - own) ** 2) / np.mean(own**2)))


def desired(t: float) -> float:
    return 0.8 + 0.6 * math.sin(4.4 * t) + 0.3 * math.sin(14.5 * t)


def loop_difference(written: MujocoModel, module: ModuleType, stop: float) -> float:
    """The torque loop around MuJoCo against the one around our own plant."""
    observer = design_observer(written.model, gain=CascadeGain())
    controller = torque_controller(written.model)
    loop = encoder_loop(written.model, observer=observer, controller=controller)
    own = loop.run(stop, inputs={loop.desired: desired})["plant.motor.angle"]
    step = GuardedModel(joined(observer, controller))
    named = [v.name for v in step.model.outputs].index("motor.current")
    model = mujoco.MjModel.from_xml_path(str(written.plugin_scene))
    data = mujoco.MjData(model)
    law = module.Law(model)
    angles, current = np.zeros(len(own)), 0.0
    for k in range(len(own)):
        angles[k] = data.qpos[0]
        reading = law.outputs(data)["motor_encoder.reading"]
        outputs, _ = step.step([reading, desired(k * STEP)])
        data.ctrl[0], current = current, outputs[named]
        mujoco.mj_step(model, data)
    return difference(angles, own)


@pytest.mark.slow
def test_a_closed_torque_loop_follows_our_own(exported: tuple[MujocoModel, ModuleType]) -> None:
    assert loop_difference(*exported, 2.0) < CLOSE


@pytest.mark.slow
def test_so_does_one_of_twenty_seconds(exported: tuple[MujocoModel, ModuleType]) -> None:
    assert loop_difference(*exported, 20.0) < CLOSE


def pushed(model: Any, module: ModuleType, currents: Array, *, callback: bool) -> Array:
    data = mujoco.MjData(model)
    if callback:
        module.install(module.Law(model))
    angles = np.zeros(len(currents))
    for k, current in enumerate(currents):
        angles[k], data.ctrl[0] = data.qpos[0], current
        mujoco.mj_step(model, data)
    module.uninstall()
    return angles


def test_callback_and_plugin_are_one_law(exported: tuple[MujocoModel, ModuleType]) -> None:
    written, module = exported
    times = STEP * np.arange(500)
    currents = 3.0 * np.sin(13.0 * times)
    scenes = [mujoco.MjModel.from_xml_path(str(p)) for p in (written.scene, written.plugin_scene)]
    forms = [pushed(m, module, currents, callback=m is scenes[0]) for m in scenes]
    assert np.array_equal(*forms)
    own = simulate(written.model, times, inputs={"motor.current": currents}, hold=True)
    assert difference(forms[0], own["motor.angle"]) < CLOSE


def test_numbers_and_prefix_of_an_instance(exported: tuple[MujocoModel, ModuleType]) -> None:
    """Two actuators in one model, one of them with another number of the deck."""
    written, _ = exported
    other = {"bearing.damping": 0.05}
    robot, name = mujoco.MjSpec(), written.name
    for prefix in ("left_", "right_"):
        child = mujoco.MjSpec.from_file(str(written.scene))
        robot.attach(child, prefix=prefix, frame=robot.worldbody.add_frame())
    keys = {"left_": "", "right_": '<config key="bearing.damping" value="0.05"/>'}
    rows = "".join(
        f'<instance name="{p}"><config key="prefix" value="{p}"/>{more}</instance>'
        for p, more in keys.items()
    )
    text = robot.to_xml()
    head, rest = text.split(">", 1)
    text = f'{head}><extension><plugin plugin="nlsdesign.{name}">{rows}</plugin></extension>{rest}'
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    currents = 3.0 * np.sin(13.0 * STEP * np.arange(300))
    angles = np.zeros((len(currents), 2))
    for k, current in enumerate(currents):
        angles[k] = data.qpos
        data.ctrl[[model.actuator(f"{p}motor.current").id for p in keys]] = current
        mujoco.mj_step(model, data)
    for column, values in enumerate(({}, other)):
        changed = written.model.with_values(values)
        own = simulate(changed, STEP * np.arange(300), inputs={"motor.current": currents}, hold=True)
        assert difference(angles[:, column], own["motor.angle"]) < CLOSE


STEPS = {
    "stribeck_friction": 1, "rate_independent_hysteresis": 1, "load_dependent_friction": 1, "backlash": 2,
}  # fmt: skip
"""Steps of MuJoCo in 1 ms, by effect: explicit steps of 1 ms are unstable on the stiff side of a gap."""


@pytest.mark.long_cases("backlash", "stribeck_friction", "load_dependent_friction")
@pytest.mark.parametrize("effect", STEPS)
def test_a_deck_with_an_effect_added_follows_our_own(effect: str, tmp_path: Path) -> None:
    """As a diagnosis adds it: friction that sticks, a gap, hysteresis, friction by the load."""
    row = next(each for each in catalogue() if each.identifier == effect)
    candidate = row(declare(load_deck(DECK)))[0]
    # One process knows one plug-in of a name.
    written = export_mujoco(replace(flatten(smoothed(candidate.assembly)), name=effect), tmp_path)
    module = module_of(written)
    module.load_plugin()
    times = STEP * np.arange(1000)
    currents = 3.0 * np.sin(13.0 * times)
    own = simulate(written.model, times, inputs={"motor.current": currents}, hold=True)
    model = mujoco.MjModel.from_xml_path(str(written.plugin_scene))
    model.opt.timestep = STEP / STEPS[effect]
    angles = pushed(model, module, np.repeat(currents, STEPS[effect]), callback=False)
    assert difference(angles[:: STEPS[effect]], own["motor.angle"]) < CLOSE


def test_what_mujoco_cannot_carry_is_refused_and_nothing_written(tmp_path: Path) -> None:
    wheel = Inertia(inertia=1e-3)
    spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    sharp = assembly(
        "sharp", wheel=wheel, spring=spring, rub=tie(CoulombFriction(sliding_effort=0.1), "wheel")
    )
    refused = {
        "is sharp.*--smooth": flatten(sharp),
        "prescribed motion.*Mass": plant("vhb4910_specimen"),
        "is sampled.*export c": design_observer(plant(), gain=CascadeGain()),
    }
    for message, model in refused.items():
        with pytest.raises(ExportError, match=message):
            export_mujoco(model, tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_without_a_compiler_the_module_says_what_to_install(
    exported: tuple[MujocoModel, ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, module = exported
    monkeypatch.setattr(module.shutil, "which", lambda _: None)
    monkeypatch.setattr(module, "find_spec", lambda _: None)
    with pytest.raises(SystemExit, match=r"no C compiler.*ziglang"):
        module.compiler()


def test_the_command(run: Run, tmp_path: Path) -> None:
    status, out, _ = run("export", "mujoco", "--deck", "dfki_pendulum", "--out", str(tmp_path / "m"))
    assert status == 0
    assert "next: python" in out
    mujoco.MjModel.from_xml_path(str(tmp_path / "m" / "dfki_pendulum.xml"))
    assert read_exports(tmp_path / "m").together
