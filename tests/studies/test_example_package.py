"""The example package, installed in a temporary place and run as its README says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pip")
pytest.importorskip("hatchling")
COMMAND = [sys.executable, "-m", "nlsdesign", "--with", "rubber_lab"]


@pytest.fixture(scope="module")
def installed(root: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment in which the package is installed beside nlsdesign."""
    place = tmp_path_factory.mktemp("installed")
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--target", str(place)]
    source = root / "examples" / "rubber_lab"
    subprocess.run([sys.executable, "-m", "pip", "install", *options, str(source)], check=True, timeout=120)
    assert (place / "rubber_lab" / "materials.toml").is_file()
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(place), str(root)])}


def call(words: list[str], environment: dict[str, str], place: Path) -> str:
    done = subprocess.run(words, env=environment, cwd=place, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_installed_package_serves_a_deck(root: Path, installed: dict[str, str], tmp_path: Path) -> None:
    deck = str(root / "examples" / "rubber_lab" / "decks" / "jointed.toml")
    assert "no problem in 16 numbers" in call([*COMMAND, "deck", "check", deck], installed, tmp_path)


@pytest.mark.slow
def test_the_diagnosis_names_the_effect_of_the_package(
    root: Path, installed: dict[str, str], tmp_path: Path
) -> None:
    folder = root / "examples" / "rubber_lab"
    call([sys.executable, str(folder / "simulated_bench.py"), "records"], installed, tmp_path)
    words = ["diagnose", "--deck", str(folder / "decks" / "jointed.toml"), "--records", "records", "--json"]
    verdict = json.loads(call([*COMMAND, *words, "--out", "out"], installed, tmp_path))
    (effect,) = verdict["effects"]
    assert (effect["name"], effect["location"]) == ("wire_bundle", "motor")
    model = call([*COMMAND, "deck", "show", "out/model.toml", "--json"], installed, tmp_path)
    assert json.loads(model)["wires.stiffness"]["value"] == pytest.approx(0.15, rel=0.03)
