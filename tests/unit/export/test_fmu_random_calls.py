"""Random calls of the FMU's own sources under the sanitizers of gcc."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from nlsdesign.components import ROTATION, CoulombFriction, Inertia, RigidStop, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.export.fmi.fmu import fmi_headers, fmu_texts
from nlsdesign.model import FlatModel, flatten
from tests.hand_built import controller, plant
from tests.selection import quick_only

DRIVER = Path(__file__).with_name("fmu_driver.c")
PURPOSES = {"co-simulation": 0, "model exchange": 1, "event mode": 2}


def struck() -> FlatModel:
    """Two bodies that stick to each other and run against a stop."""
    return flatten(
        assembly(
            "struck",
            motor=Inertia(inertia=1e-3),
            load=Inertia(inertia=2e-3),
            rub=tie(CoulombFriction(sliding_effort=0.05), "motor", "load"),
            spring=tie(Spring(stiffness=2.0, domain=ROTATION), "motor"),
            stop=tie(RigidStop(lower=-0.1, upper=0.1, restitution=0.5), "load"),
        )
    )


MODELS = {"plant": plant, "struck": struck, "controller": controller}


@pytest.mark.long_cases("struck")
@pytest.mark.skipif(shutil.which("gcc") is None, reason="the sanitizers are those of gcc")
@pytest.mark.parametrize("name", quick_only(MODELS, ["struck"]))
def test_no_call_is_beyond_bounds_undefined_or_silently_not_finite(name, tmp_path):
    for path, content in fmu_texts(MODELS[name](), version="3.0", step=1e-3).items():
        if path.startswith("sources/"):
            (tmp_path / Path(path).name).write_bytes(content)
    built = subprocess.run(
        ["gcc", "-std=c99", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
         "-isystem", fmi_headers(), "-I", tmp_path, DRIVER, "-o", tmp_path / "driver", "-lm"],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    purposes = {"struck": PURPOSES, "plant": {"co-simulation": 0, "model exchange": 1}}
    for word, number in purposes.get(name, {"co-simulation": 0}).items():
        done = subprocess.run(
            [tmp_path / "driver", str(number), "2500", "7"],
            capture_output=True, text=True, check=False, timeout=120,
        )  # fmt: skip
        assert (word, done.returncode, done.stderr) == (word, 0, "")
