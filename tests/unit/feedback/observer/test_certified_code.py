"""The C code of a certificate: forged files are found, and what runs keeps what is proved."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.cli import main
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_c
from nlsdesign.export.c.guarded_step import OUT_OF_TABLE
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.observer import (
    Assumptions,
    CertifiedGain,
    PolePlacement,
    certify,
    design_observer_with_details,
    read_certificate,
    write_certificate,
)
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import flatten
from tests.command_line import Run, run
from tests.unguarded import unguarded

__all__ = ["run"]  # the fixture

DECK = "austin2015_stiff_spring"
WORDS = ("observer", "--deck", DECK, "--certificate", "--real", "float")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Certificate and code as the command writes them at a given time."""
    folder = tmp_path_factory.mktemp("certified")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        patch.setattr(sys, "argv", ["nlsdesign", *WORDS, "--out", str(folder)])
        with suppress(SystemExit):
            main()
    assert (folder / "certificate.json").exists()
    return folder


@pytest.mark.slow
def test_forged_c_with_a_hash_written_anew_fails(run: Run, tmp_path: Path, written: Path) -> None:
    """The forger changes a digit of the table, its hash and the checksum; only writing anew tells."""
    shutil.copytree(written, tmp_path, dirs_exist_ok=True)
    path, source = tmp_path / "certificate.json", tmp_path / "observer.c"
    status, out, _ = run("observer", "verify", str(path), "--c", str(tmp_path))
    assert status == 0
    assert "written anew from the deck" in out
    text = source.read_text()
    at = text.index("= ") + 2
    for forged in (text[:at] + "-" + text[at:], text.replace("/*", "/* Proved to 1 mN·m. ", 1)):
        source.write_text(forged)
        proved, untouched = read_certificate(path)
        assert untouched
        anew = {**proved.code, "observer.c": hashlib.sha256(source.read_bytes()).hexdigest()}  # type: ignore[union-attr]
        write_certificate(replace(proved, code=anew), path)
        status, out, _ = run("observer", "verify", str(path), "--c", str(tmp_path), "--json")
        assert status == 1
        failing = [c for c in json.loads(out)["checks"] if c["holds"] is False]
        assert [c["name"] for c in failing] == ["C code"]
        assert "is not what the deck gives" in failing[0]["detail"]


@pytest.mark.slow
def test_code_is_verified_a_year_later_in_another_time_zone(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: Path
) -> None:
    shutil.copytree(written, tmp_path, dirs_exist_ok=True)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1731600000")
    monkeypatch.setenv("TZ", "Pacific/Auckland")
    certificate, source = tmp_path / "certificate.json", tmp_path / "observer.c"
    words = ("observer", "verify", str(certificate), "--deck", DECK, "--c", str(tmp_path))
    status, out, _ = run(*words)
    assert status == 0, out
    assert "written anew from the deck" in out
    for forged in (" int added;\n", "/* Exported by nlsdesign 9. */\n"):
        added = source.read_text() + forged
        source.write_text(added)
        proved, _ = read_certificate(certificate)
        anew = {**proved.code, "observer.c": hashlib.sha256(source.read_bytes()).hexdigest()}
        write_certificate(replace(proved, code=anew), certificate)
        assert run(*words)[0] == 1


def test_ranges_are_those_that_are_given(run: Run, tmp_path: Path) -> None:
    words = ("--angles", "-20 deg", "10 deg", "--speed", "3 rad/s", "--angle-error", "0.1 mrad")
    assert run(*WORDS, *words, "--out", str(tmp_path))[0] == 0
    proved, _ = read_certificate(tmp_path / "certificate.json")
    assumed = proved.proof.assumptions  # type: ignore[union-attr]
    assert assumed.angles == pytest.approx((math.radians(-20.0), math.radians(10.0)))
    assert (assumed.speed, assumed.angle_error) == pytest.approx((3.0, 1e-4))
    status, out, err = run(*WORDS, "--angles", "0 deg", "200 deg", "--out", str(tmp_path / "o"))
    assert (status, out) == (2, "")
    assert "beyond the table" in err
    assert not (tmp_path / "o").exists()
    status, _, err = run("observer", "--deck", DECK, "--speed", "3 rad/s", "--out", str(tmp_path / "o"))
    assert status == 2
    assert "--certificate" in err


def test_a_certificate_in_continuous_time_is_written_and_verified(run: Run, tmp_path: Path) -> None:
    status, out, err = run("observer", "certify-continuous", "--deck", DECK, "--out", str(tmp_path))
    assert status == 0, err
    status, out, _ = run("observer", "verify", str(tmp_path / "certificate.json"), "--deck", DECK)
    assert status == 0
    assert "not compared" not in out
    assert out.rstrip().endswith("the certificate holds")


def test_a_decay_out_of_reach_is_answered_with_the_best(run: Run, tmp_path: Path) -> None:
    words = ("observer", "certify-continuous", "--deck", "austin2015_figure_consistent", "--decay", "90")
    status, out, err = run(*words, "--out", str(tmp_path / "o"))
    assert (status, out) == (2, "")
    assert "the fastest that is proved is 69.05 1/s" in err
    assert "ask for at most" in err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("deck", [DECK, pytest.param("austin2015_figure_consistent", marks=pytest.mark.slow)])
def test_compiled_float_contracts_as_certified(tmp_path: Path, deck: str) -> None:
    """Two instances in single precision, begun differently, angles that jump anywhere, any current.

    Numbers of six digits: the energy is compared while it is far above the rounding of the states.
    """
    model = flatten(declare(load_deck(deck)))
    design = design_observer_with_details(model, gain=CertifiedGain())
    proved = certify(model, design, assumptions=Assumptions((0.3, 0.32), real="float"))
    polytope, draw = proved.proof.polytope, np.random.default_rng(2)
    size, end = np.array(polytope.sizes), 1.2 * float(design.compact.angles[-1])
    names = [v.name for v in design.model.states]
    begun = [
        {f"{n}.memory": s * draw.normal() for n, s in zip(polytope.states, size, strict=True)}
        for _ in range(2)
    ]
    runs = [
        CompiledStep(export_c(unguarded(design.model).with_values(start), tmp_path / str(k), real="float"))
        for k, start in enumerate(begun)
    ]
    outputs = [v.name for v in design.model.outputs]
    shown = [
        outputs.index(n if n != proved.measured else f"{n}.estimate") for n in polytope.states
    ]  # corrected states, in which the certificate is written
    assert len(names) == len(size)
    worst, before, seen = 0.0, math.nan, 0
    for _ in range(400):
        angle = draw.choice([end * draw.uniform(-1.0, 1.0), 1e-3 * draw.normal()])
        u = [angle, draw.uniform(-20.0, 20.0)]
        both = [step(u) for step in runs]
        assert {status for _, status in both} <= {0, OUT_OF_TABLE}
        apart = (both[0][0][shown] - both[1][0][shown]) / size
        energy = math.sqrt(float(apart @ proved.proof.lyapunov @ apart))
        # Rounding: 6e-8 of states ten times their size, in the norm of a P of condition 100.
        if before > 1e-2:
            worst, seen = max(worst, (energy - 1e-5) / before), seen + 1
        before = energy
    assert seen > 20
    limit = math.exp(-proved.proof.decay * polytope.sample_time)
    assert worst <= limit
    assert worst > limit**6, "not far from what is proved"


@pytest.mark.parametrize("poles", [(-70.0, -5000.0, -6000.0), (-70.0, -100.0 + 4000.0j, -100.0 - 4000.0j)])
def test_poles_faster_than_the_sample_rate_are_answered_with_the_fastest(poles: tuple[complex, ...]) -> None:
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    with pytest.raises(ValueRangeError, match=r"faster than the sample rate carries, 3142 1/s"):
        design_observer_with_details(model, gain=PolePlacement(poles))
