"""Proofs about generated steps: they hold for what is exported, and a broken guard is found."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.export import CSource, export_c
from nlsdesign.export.compilation.proof import missing_prover, prove_step, with_numbers_admitted
from nlsdesign.foundation.errors import ExportError
from tests.command_line import Run, run, two_machines

__all__ = ["run", "two_machines"]

needs_prover = pytest.mark.skipif(bool(missing_prover()), reason=missing_prover())


@pytest.fixture(scope="module")
def controller(tmp_path_factory: pytest.TempPathFactory) -> CSource:
    plant = nls.flatten(nls.declare(nls.load_deck("test_rig")))
    model = nls.torque_controller(plant)
    return export_c(model, tmp_path_factory.mktemp("c"), real="float", name="step")


def broken(source: CSource, folder: Path, *faults: tuple[str, str, str]) -> CSource:
    """Return the code with some places written differently: pattern, and what stands instead."""
    code = source.source.read_text(encoding="utf-8")
    for pattern, instead, _ in faults:
        code, count = re.subn(pattern, instead, code, count=1)
        assert count == 1, pattern
    for file in (source.header, source.source):
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / source.source.name).write_text(code, encoding="utf-8")
    return replace(source, header=folder / source.header.name, source=folder / source.source.name)


@pytest.mark.slow
@needs_prover
def test_nothing_is_undefined_and_all_stays_finite(controller: CSource) -> None:
    proof = prove_step(controller)
    assert proof.alarms == ()
    assert proof.open_members == ()
    assert (proof.beyond, proof.loops) == ((), ())
    assert proof.holds
    assert proof.reached >= 0.95 * proof.statements > 100


BROKEN = [
    # The numbers of a table are read without the ends of its range.
    (r"const float place_0 = above_0 < [^;]*;", "const float place_0 = above_0;", "alarms"),
    # The next states are taken whether they are finite or not.
    (r"if \((?:\(f\d+ - f\d+\)(?: \+ )?)+ >= 0\.0f\)", "if (f0 >= f0 - 1.0f || f0 < 1.0f)", "open_members"),
    # An output is written behind the limit, or only sometimes.
    (r"(outputs->motor\.current) = y0;", r"\1 = 1e30f;", "beyond"),
    (r"(outputs->motor\.current) = y0;", r"if (y0 > 0.5f) { \1 = y0; }", "open_members"),
    (r"(    const float u0 = [^\n]*\n)", r"\1    while (u0 > 0.5f) { }\n", "loops"),
]


@pytest.mark.slow
@needs_prover
def test_what_guards_keep_off_is_found_without_them(controller: CSource, tmp_path: Path) -> None:
    faults = [BROKEN[i] for i in (0, 1, 2, 4)]
    proof = prove_step(broken(controller, tmp_path, *faults))
    for _, _, what in faults:
        assert getattr(proof, what), what
    assert not proof.holds


# All of them in one proof: the test above.
@pytest.mark.slow
@needs_prover
@pytest.mark.parametrize("fault", BROKEN, ids=lambda fault: fault[2])
def test_what_a_guard_keeps_off_is_found_without_it(
    controller: CSource, tmp_path: Path, fault: tuple[str, str, str]
) -> None:
    proof = prove_step(broken(controller, tmp_path, fault))
    assert getattr(proof, fault[2]), fault
    assert not proof.holds


def test_without_the_prover_it_says_how_to_install_it(
    controller: CSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ExportError, match="apt-get install frama-c-base"):
        prove_step(controller)


def test_a_difference_with_itself_tells_finite_numbers() -> None:
    """The guard in the code and the one that the proof reads agree for every exponent, sign and kind."""
    draw = np.random.default_rng(5)
    exponents = np.arange(512, dtype=np.uint32) << 23
    bits = np.concatenate([exponents + draw.integers(0, 1 << 23, 512, dtype=np.uint32), exponents])
    numbers = bits.view(np.float32)
    with np.errstate(all="ignore"):
        told = numbers - numbers >= 0.0
        read = (numbers >= -np.finfo(np.float32).max) & (numbers <= np.finfo(np.float32).max)
    assert np.array_equal(told, read)
    assert np.array_equal(told, np.isfinite(numbers))
    assert 0 < np.sum(told) < len(told)


def test_what_a_comparison_implies_stands_behind_it() -> None:
    code = "  if (u > b[0]) tmp = u; else tmp = b[0];\n  if ((double)f <= 3.0) {\n    x = f;\n  }\n"
    said = with_numbers_admitted(code)
    assert (
        "(u > b[0]) /*@ admit !\\is_NaN((double)u); */ /*@ admit !\\is_NaN((double)b[0]); */ tmp = u;" in said
    )
    assert "{ /*@ admit !\\is_NaN((double)f); */" in said
    wrapped = "  if (a.very.long.name <=\n      other) x = 1;\n"
    assert "admit !\\is_NaN((double)a.very.long.name)" in with_numbers_admitted(wrapped)


@pytest.mark.slow
@pytest.mark.usefixtures("two_machines")
def test_the_command_writes_the_library_and_says_what_a_proof_needs(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", "")
    words = ("export", "c", "--deck", "test_rig", "--what", "controller", "--out", str(tmp_path / "c"))
    status, _, errors = run(*words, "--package", "--prove")
    assert status != 0
    assert "needs Frama-C" in errors
    assert (tmp_path / "c" / "controller_library" / "src" / "controller.c").is_file()
