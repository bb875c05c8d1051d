"""The leg of three elastic joints walks in MuJoCo, and its README says what comes out."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")


@pytest.mark.slow
def test_the_leg_walks_as_its_page_says(root: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("leg", root / "examples" / "leg" / "leg.py")
    assert spec is not None
    assert spec.loader is not None
    leg = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(leg)
    results = leg.walk(2, tmp_path)
    page = (root / "examples" / "leg" / "README.md").read_text(encoding="utf-8")
    stride = leg.gait()
    for i, (joint, numbers) in enumerate(results.items()):
        # A loop that is not stable errs by newtons.
        assert numbers["torque error, mN·m rms"] < 50.0
        assert numbers["angle error, deg rms"] < 1.5
        assert numbers["largest current, A"] < 20.0
        assert numbers["largest torque, N·m"] == pytest.approx(np.abs(stride.torque[:, i]).max(), rel=0.1)
        (row,) = re.findall(rf"^\| {joint} \| (.*) \|$", page, flags=re.MULTILINE)
        assert [float(x) for x in row.split(" | ")] == pytest.approx(list(numbers.values()), rel=0.1)
