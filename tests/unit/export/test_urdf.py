"""URDF of an actuator: MuJoCo, which has a reader of its own, finds the inertias and limits of the deck."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.export import export_urdf
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.errors import ExportError
from tests.command_line import Run, run

__all__ = ["run"]

mujoco = pytest.importorskip("mujoco")


def plant(deck: str) -> nls.FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(deck)))


@pytest.mark.parametrize("deck", ["austin2015_figure_consistent", "spring_beside_drive", "dfki_pendulum"])
def test_another_reader_finds_the_inertias_of_the_deck(deck: str, tmp_path: Path) -> None:
    model = plant(deck)
    seen = mujoco.MjModel.from_xml_path(str(export_urdf(model, tmp_path / "joint.urdf")))
    numbers = model.values | model.evaluate(list(model.start(model.states)))
    expected = [numbers[str(body.inertia)] for body in model.bodies]
    assert seen.dof_M0 == pytest.approx(expected, rel=1e-12)
    assert [seen.joint(k).name for k in range(seen.njnt)] == [body.name for body in model.bodies]


def test_limits_and_transmission_are_those_of_the_deck(tmp_path: Path) -> None:
    """20 A, 55 mN·m/A and 4:1 are 4.4 N·m; the encoder is declared from -1.5 to 1.5 rad, 95 rad/s."""
    path = export_urdf(plant("austin2015_figure_consistent"), tmp_path / "joint.urdf")
    seen = mujoco.MjModel.from_xml_path(str(path))
    assert seen.joint("motor").range == pytest.approx([-1.5, 1.5])
    robot = ElementTree.parse(path).getroot()
    joint, transmission = robot.find("joint"), robot.find("transmission")
    assert joint is not None
    assert transmission is not None
    limit = joint.find("limit")
    assert limit is not None
    assert [float(limit.get(name, "nan")) for name in ("effort", "velocity")] == pytest.approx([4.4, 95.0])
    assert transmission.findtext("actuator/mechanicalReduction") == "4.0"
    assert [link.get("name") for link in robot.findall("link")] == ["base", "motor"]


def test_what_urdf_cannot_describe_is_refused(tmp_path: Path) -> None:
    sampled = design_observer(plant("austin2015_figure_consistent"), gain=CascadeGain())
    for message, model in {
        "is sampled": sampled,
        "slides, and URDF wants": plant("janot2019_positioning_drive"),
        "prescribed motion.*Mass": plant("vhb4910_specimen"),
    }.items():
        with pytest.raises(ExportError, match=message):
            export_urdf(model, tmp_path / "none.urdf")
    assert not list(tmp_path.iterdir())


def test_the_command(run: Run, tmp_path: Path) -> None:
    status, out, _ = run("export", "urdf", "--deck", "spring_beside_drive", "--out", str(tmp_path / "a.urdf"))
    assert status == 0
    assert "a.urdf" in out
    mujoco.MjModel.from_xml_path(str(tmp_path / "a.urdf"))
