"""``export c``: sizes are printed, budgets are met or refused; breakpoints are the same in FMU and batch."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.cli.main import main
from nlsdesign.cli.typed_values import Bytes, TimeBudget, parse_number
from nlsdesign.export import export_fmu
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.compilation.target_run import missing_emulator
from nlsdesign.foundation.errors import ExportError, UnitError, ValueRangeError
from nlsdesign.model.flat import FlatModel, Table, Variable
from nlsdesign.regeneration import require_time
from nlsdesign.simulation.sample_writer import looked_up
from tests.command_line import files_in
from tests.fmu_unit import opened
from tests.hand_built import observer

Run = Callable[..., tuple[int, str, str]]
LINEAR = "austin2015_soft_spring"
"""Margins over the spread of a linear spring are known in no time."""


@pytest.fixture
def export(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    monkeypatch.chdir(tmp_path)
    # Margins are not looked at here.
    monkeypatch.setattr("nlsdesign.feedback.control.evaluation.spread_margins.DRAWS", 2)

    def call(*words: str) -> tuple[int, str, str]:
        usual = ("export", "c", "--deck", "austin2015_figure_consistent", "--kind", "cascade")
        monkeypatch.setattr(sys, "argv", ["nlsdesign", *usual, "--real", "float", "--out", "o", *words])
        try:
            main()
            status = 0
        except SystemExit as leaving:
            status = int(leaving.code or 0)
        return (status, *capsys.readouterr())

    return call


def sizes(text: str) -> tuple[int, int, int]:
    total, code, tables = re.search(r"M4F: (\d+) B \((\d+) B code .*, (\d+) B tables", text).groups()
    return int(total), int(code), int(tables)


def cost(text: str) -> float:
    return float(re.search(r"by at most ([\d.]+) mN·m", text)[1])


@pytest.mark.slow
def test_the_size_is_printed_and_a_budget_is_met_by_a_coarser_table(export: Run, tmp_path: Path) -> None:
    status, out, _ = export()
    total, code, tables = sizes(out)
    assert (status, total) == (0, code + tables)
    source = (tmp_path / "o" / "observer.c").read_text()
    numbers = re.findall(r"static const float (?:table|breakpoints)_0((?:\[\d+\])+)", source)
    counted = sum(int(np.prod([int(n) for n in re.findall(r"\d+", each)])) for each in numbers)
    assert tables == 4 * counted

    status, smaller, _ = export("--flash", f"{(total - 1000) / 1000}kB")
    assert status == 0
    assert sizes(smaller)[0] <= total - 1000
    assert cost(smaller) > cost(out)

    status, exact, _ = export("--table-error", "0.3mN.m")
    assert status == 0
    assert cost(exact) <= 0.3
    assert sizes(exact)[2] > tables


# The library refuses it in test_table_size.py.
@pytest.mark.slow
def test_a_budget_that_cannot_be_met_is_refused_and_nothing_is_written(export: Run, tmp_path: Path) -> None:
    status, out, error = export("--flash", "2kB")
    assert (status, out) == (2, "")
    assert "flash of 2000 B: cannot be met beside" in error
    least = int(re.search(r"smallest found that keeps this has (\d+) B", error)[1])
    status, _, error = export("--flash", f"{least - 700} B", "--table-error", "1 mN·m")
    assert status == 2
    assert re.search(r"it would cost 0\.0\d+ N·m, more than 0.001 N·m|no table is that small", error)
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("text", "value"), [("16kB", 16000), ("16 kB", 16000), ("2KiB", 2048), ("300 B", 300), ("0.5MB", 500000)]
)
def test_sizes_are_read(text: str, value: int) -> None:
    assert Bytes().convert(text, None, None) == value


@pytest.mark.parametrize("text", ["16", "16 kb", "-1kB", "kB", "0 B", "1e400 kB", "nan B"])
def test_other_sizes_are_refused(text: str) -> None:
    with pytest.raises(UnitError):
        Bytes().convert(text, None, None)


@pytest.mark.parametrize("text", ["20%@80MHz", "20 % @ 80 MHz", "20.0%@0.08GHz"])
def test_a_share_of_the_sample_time_at_a_clock_is_read(text: str) -> None:
    assert TimeBudget().convert(text, None, None) == pytest.approx((0.2, 80e6))


@pytest.mark.parametrize(
    "text", ["20%", "20@80MHz", "0%@80MHz", "101%@80MHz", "20%@80", "20%@80s", "20%@-8MHz"]
)
def test_other_budgets_of_time_are_refused(text: str) -> None:
    with pytest.raises((UnitError, ValueRangeError)):
        TimeBudget().convert(text, None, None)


def test_a_step_that_takes_more_than_its_share_is_refused_with_its_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """629 instructions of 8,000 that one ms has at 8 MHz are 7.86 %."""
    cost = SimpleNamespace(run=SimpleNamespace(instructions=np.array([434, 629, 430])), reason="")
    monkeypatch.setattr("nlsdesign.export.measure_on_target", lambda source, board: cost)
    sentence = require_time(observer(), "float", share=0.08, clock=8e6)
    assert sentence.startswith(
        "instructions on a Cortex-M4F: 434, at most 629, 7.86 % of a sample of 1 ms at 8 MHz"
    )
    with pytest.raises(ValueRangeError, match=r"budget of 7 %.*takes 629 instructions.*, 7.86 %"):
        require_time(observer(), "float", share=0.07, clock=8e6)
    cost.run, cost.reason = None, "qemu-system-arm is not installed"
    with pytest.raises(
        ExportError, match="cannot be judged: qemu-system-arm is not installed -> leave --budget"
    ):
        require_time(observer(), "float", share=0.08, clock=8e6)


# An emulator counts, a program of the system: without it the tests above judge counts made by hand.
@pytest.mark.slow
@pytest.mark.skipif(bool(missing_emulator()), reason=missing_emulator())
def test_a_budget_of_time_is_counted_and_beyond_it_nothing_is_written(export: Run, tmp_path: Path) -> None:
    status, out, _ = export("--budget", "20%@80MHz")
    assert status == 0
    assert re.search(r"instructions on a Cortex-M4F: 4\d\d, at most [56]\d\d, 0\.\d+ % of a sample", out)
    status, _, error = export("--budget", "20%@1MHz", "--out", "p")
    assert status == 2
    assert re.search(r"budget of 20 %: a step takes [56]\d\d instructions", error)
    assert not (tmp_path / "p").exists()


@pytest.mark.parametrize("text", ["1 mN*m", "1mN.m", "1mN·m", "1e-3 N·m", "0.001N*m", ".001 N*m"])
def test_a_torque_is_read_with_and_without_a_space(text: str) -> None:
    assert parse_number(text, "N*m").number == pytest.approx(1e-3)


@pytest.mark.parametrize("text", ["N*m", "1", "1 s", "one N*m", "1..2 N*m"])
def test_other_torques_are_refused(text: str) -> None:
    with pytest.raises(UnitError):
        parse_number(text, "N*m")


def over_breakpoints() -> FlatModel:
    """Counts its samples, and shows a table with breakpoints over its input."""
    points = np.array([-1.0, -0.2, -0.19, 0.0, 0.7, 0.75])
    values = np.random.default_rng(3).normal(size=(6, 2))
    columns = (Variable("a", "1", "First"), Variable("b", "1", "Second"))
    x, u, w, nothing = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("w", 2), ca.SX(0, 1)
    equations = ca.Function("e", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), w], [x + 1, w, nothing, nothing])
    return FlatModel(
        "uneven", "Looks up", (Variable("x", "1", "Samples"),), (Variable("u", "1", "Argument"),), (),
        (Variable("y[1]", "1", "First"), Variable("y[2]", "1", "Second")), (), equations, 0.1,
        (Table.over("u", points, columns, values),),
    )  # fmt: skip


def test_breakpoints_are_read_alike_in_an_fmu_and_in_a_batch(tmp_path: Path) -> None:
    model = over_breakpoints()
    reference, (table,) = GuardedModel(model), model.tables
    x, u = ca.MX.sym("x"), ca.MX.sym("u")
    many = ca.Function("look", [u], [looked_up(table, model, x, u)])
    with opened(export_fmu(model, tmp_path / "uneven.fmu")) as unit:
        unit.begin()
        unit.run()
        for at in [-1.0, -0.2, -0.195, -0.19, 0.3, 0.7, 0.72, 0.75, -3.0, 3.0]:
            expected, _ = reference.step([at])
            unit.put({"u": at})
            unit.step(0.1)
            assert unit.get("y[1]", "y[2]") == list(expected)
            assert np.array(many(at)).ravel() == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_a_budget_holds_for_a_controller_too(export: Run, tmp_path: Path) -> None:
    what = ("--what", "controller", "--deck", LINEAR)
    status, out, _ = export(*what)
    assert status == 0
    size = int(re.search(r"flash on a Cortex-M4F: (\d+) B", out)[1])  # type: ignore[index]
    status, _, err = export(*what, "--flash", "1kB", "--out", "p")
    assert status == 2
    assert f"takes {size} B" in err
    assert not (tmp_path / "p").exists()
    status, _, err = export(*what, "--table-error", "1mN*m", "--out", "p")
    assert status == 2
    assert "of an observer" in err


def test_a_table_within_size_and_error_is_taken(export: Run) -> None:
    """Asked for both, the smaller table was refused although it kept the error."""
    status, out, err = export("--flash", "5.9kB", "--table-error", "2mN*m")
    assert status == 0, err
    assert "moves the torque by at most" in out


@pytest.mark.slow
def test_a_folder_in_the_place_of_a_file_stops_everything(export: Run, tmp_path: Path) -> None:
    (tmp_path / "q" / "observer.h").mkdir(parents=True)
    status, _, err = export("--out", "q")
    assert status == 2
    assert "is a folder" in err
    assert files_in(tmp_path / "q") == ["observer.h"]
