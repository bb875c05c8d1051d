"""The FMUs in masters of other people: those that are installed agree with the package's own simulation."""

from __future__ import annotations

import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from benchmarks.foreign_masters import AGREES, cell, units
from nlsdesign.model.flat import FlatModel

PYTHON = Path(sys.executable)
QUICK = [
    ("fmpy", "plant", "2.0"), ("casadi", "plant", "3.0"), ("ecospy", "observer", "2.0"),
    ("libcosimpy", "controller", "2.0"), ("fmuloader", "observer", "3.0"),
]  # fmt: skip
REST = [
    (master, name, version)
    for master in ("fmpy", "casadi", "ecospy", "libcosimpy", "fmuloader")
    for name in ("plant", "observer", "controller")
    for version in ("2.0", "3.0")
    # CasADi imports model exchange alone; libcosim has no FMI 3.
    if not (master == "casadi" and name != "plant") and not (master == "libcosimpy" and version == "3.0")
    if (master, name, version) not in QUICK
]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], tuple[Path, FlatModel]]:
    """FMUs with their reference results."""
    return units(tmp_path_factory.mktemp("masters"))


@pytest.mark.long_cases("fmpy-plant-2.0")
@pytest.mark.parametrize(
    ("master", "name", "version"), [*QUICK, *[pytest.param(*each, marks=pytest.mark.slow) for each in REST]]
)
def test_a_foreign_master_agrees(made, master, name, version):
    if find_spec(master) is None:
        pytest.skip(f"{master} is not installed: pip install 'nlsdesign[masters]'")
    found = cell(PYTHON, master, *made[name, version])
    assert found.said == ""
    assert found.deviation < AGREES


def test_a_wrong_reference_is_found(made, tmp_path):
    fmu, model = made["controller", "2.0"]
    for file in fmu.parent.glob(f"{fmu.stem}*"):
        shutil.copy(file, tmp_path)
    reference = tmp_path / f"{fmu.stem}_ref.csv"
    lines = reference.read_text().splitlines()
    time, value = lines[501].split(",")
    lines[501] = f"{time},{float(value) + 0.01!r}"
    reference.write_text("\n".join(lines))
    found = cell(PYTHON, "fmpy", tmp_path / fmu.name, model)
    assert found.deviation > 1e-4


def test_a_master_that_cannot_says_so(made):
    fmu, model = made["observer", "3.0"]
    found = cell(PYTHON, "casadi", fmu, model)
    assert np.isnan(found.deviation)
    assert "ModelExchange" in found.said
