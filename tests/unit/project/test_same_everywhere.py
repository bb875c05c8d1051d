"""What is written is the same on every processor: linear algebra differs in its last digits, files do not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.rig import ACTUATORS, make_records, write_set

# Kernels of OpenBLAS that any x86-64 processor with AVX2 can run; other BLAS libraries ignore the name.
KERNELS = ("Haswell", "Prescott", "Zen")


def written(kernel: str, out: Path, *words: str) -> dict[str, bytes]:
    """Content of the files that a command writes, by name."""
    out.mkdir()
    subprocess.run(
        [sys.executable, "-m", "nlsdesign", *words],
        cwd=out,
        env=os.environ | {"OPENBLAS_CORETYPE": kernel},
        check=True,
        capture_output=True,
    )
    return {file.name: file.read_bytes() for file in sorted(out.rglob("*")) if file.is_file()}


@pytest.mark.slow
def test_the_deck_of_a_rig_is_the_same_to_the_byte(tmp_path: Path) -> None:
    write_set(tmp_path / "set", ACTUATORS["wrist"], make_records(ACTUATORS["wrist"], {}, 1))
    rig, cam = str(tmp_path / "set" / "rig.toml"), str(tmp_path / "set" / "cam.csv")
    words = ("deck", "from-rig", rig, cam, "--out", "deck.toml")
    decks = [written(kernel, tmp_path / kernel, *words) for kernel in KERNELS]
    assert decks[0]["deck.toml"].count(b"value = ") > 20
    assert decks[0] == decks[1] == decks[2]


# Half a minute; the deck of a rig is compared in every run, below.
@pytest.mark.slow
def test_a_designed_deck_and_its_drawings_are_the_same_to_the_byte(tmp_path: Path) -> None:
    target = ("--maximum", "5 N*m", "--angle", "53 deg")
    names = ("cam.contour", "pretension", "rubber.area", "rubber.rest_length")
    free = [word for name in names for word in ("--free", f"spring.{name}")]
    free += ["--limit", 'RestLengthRange = {minimum = "10 mm", maximum = "50 mm"}', "--draws", "50"]
    words = ("design", "--deck", "austin2015_figure_consistent", *target, *free, "--out", "o")
    files = [written(kernel, tmp_path / kernel, *words) for kernel in KERNELS]
    assert {"model.toml", "cam.csv"} <= set(files[0])
    assert files[0] == files[1] == files[2]
