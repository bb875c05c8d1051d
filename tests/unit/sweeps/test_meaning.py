"""A sweep whose columns would not mean what they say is refused before anything is computed."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import ExponentialTorque
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError, NlsError, UnitError, ValueRangeError
from nlsdesign.foundation.progress import Quiet
from nlsdesign.foundation.work_sharing import InThisProcess
from nlsdesign.sweeps import (
    AngleQuestion,
    DesignQuestion,
    DiagnosisQuestion,
    GridAxis,
    LatinHypercube,
    Listed,
    LoopQuestion,
    RandomDraws,
    SaltelliSample,
    SobolSample,
    SpreadQuestion,
)
from nlsdesign.sweeps.axes import AxisSet
from nlsdesign.sweeps.axis_values import Subject, with_settings
from nlsdesign.sweeps.run_sweep import SweepSettings, run_task, sweep_task
from nlsdesign.sweeps.sweep_file import read_sweep_file
from nlsdesign.sweeps.sweep_parts import Parts
from tests import sweeping
from tests.command_line import Run, run
from tests.sweeping import AREA, actuator, question

__all__ = ["run"]
PUBLISHED = "austin2015_figure_consistent"
BOX = {AREA: ("60 mm^2", "160 mm^2")}
DESIGN = DesignQuestion(
    ExponentialTorque(maximum=2.0, angle=0.8, shape=1), free=("spring.cam.contour", "spring.pretension")
)


@pytest.fixture(scope="module")
def machine() -> Any:
    return declare(load_deck(PUBLISHED))


@pytest.mark.parametrize(
    "name", ["spring.pretension", "spring.cam.lever_arm[3]", "factor(spring.cam.lever_arm)"]
)
def test_an_axis_that_the_design_chooses_itself_is_refused(machine: Any, name: str) -> None:
    axes = [Listed({name: [0.001, 0.002]})]
    with pytest.raises(ValueRangeError, match="chosen by the question itself at each point"):
        sweep_task(machine, axes=axes, ask=DESIGN)
    # What is not free stays an axis, also of a design.
    sizes = dataclasses.replace(DESIGN, free=("spring.rubber.area",))
    assert len(sweep_task(machine, axes=axes, ask=sizes).plan) == 2


def test_a_contour_alone_is_chosen_where_nothing_is_said_to_be_free(machine: Any) -> None:
    chosen = dataclasses.replace(DESIGN, free=None).chosen(machine)
    assert chosen == {"spring.cam.lever_arm", "spring.cam.last_angle"}


def test_draws_leave_out_what_the_design_chooses(machine: Any) -> None:
    drawn = {c.name for c in RandomDraws(3).bound(Subject({"deck": machine}, DESIGN)).columns}
    every = {c.name for c in RandomDraws(3).bound(Subject({"deck": machine}, AngleQuestion())).columns}
    assert every - drawn == {"factor(spring.cam.lever_arm)", "spring.pretension"} & every
    assert "factor(spring.cam.lever_arm)" in every - drawn
    assert AREA in drawn


def test_several_decks_need_an_axis_that_says_which(machine: Any) -> None:
    decks = {"one": machine, "two": machine}
    with pytest.raises(ArrangementError, match="decks one, two: no axis 'deck' says which"):
        sweep_task(decks, axes=[GridAxis(AREA, "60 mm^2", "90 mm^2", 2)], ask=AngleQuestion())
    task = sweep_task(decks, axes=[Listed({"deck": ["two"]})], ask=AngleQuestion())
    assert task.plan.point(0) == ("two",)


@pytest.mark.parametrize(
    ("ask", "name", "ends"),
    [
        (DESIGN, "ask.target.maximum", ("2 N", "4 N")),
        (AngleQuestion(), "ask.last", ("0.2 N", "0.4 N")),
        (LoopQuestion(), "ask.amplitude", ("1 N", "2 N")),
        (LoopQuestion(), "ask.frequency", ("1 s", "2 s")),
    ],
)
def test_a_unit_that_no_point_would_take_is_refused(
    machine: Any, ask: Any, name: str, ends: tuple[str, str]
) -> None:
    with pytest.raises(UnitError, match=f"axis {name}.*is no unit of it"):
        sweep_task(machine, axes=[GridAxis(name, *ends, 2)], ask=ask)


def test_the_unit_of_a_field_of_the_file_is_checked(tmp_path: Path) -> None:
    text = (
        f'decks = "{PUBLISHED}"\n[[axes]]\nListed = {{values = {{"{AREA}" = ["90 mm^2"]}}}}\n'
        '[ask.AngleQuestion]\nlast = "30 N"\n'
    )
    path = tmp_path / "sweep.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(NlsError, match=r"sweep.toml:5:1.*last.*30 N.*'N' is no unit of it.*'rad'"):
        read_sweep_file(path)
    path.write_text(text.replace("30 N", "30 deg"), encoding="utf-8")
    asked = read_sweep_file(path).question
    assert isinstance(asked, AngleQuestion)
    assert asked.last == pytest.approx(math.radians(30.0))


def test_a_target_out_of_its_range_fails_its_own_point_only(machine: Any) -> None:
    task = sweep_task(machine, axes=[GridAxis("ask.target.maximum", "-2 N*m", "4 N*m", 3)], ask=DESIGN)
    assert len(task.plan) == 3


@pytest.mark.parametrize(
    "axes",
    [
        GridAxis("ask.count", 3, 5, 4),
        GridAxis("ask.count", 3.5, 5.5, 3),
        GridAxis("ask.count", 2, 8, 3, "ratio"),
        Listed({"ask.count": [3, 3.5]}),
        SobolSample({"ask.count": (3, 9)}, 4),
        SaltelliSample({"ask.count": (3, 9)}, 4),
    ],
)
def test_whole_numbers_are_never_rounded_behind_a_column(axes: AxisSet) -> None:
    with pytest.raises(ValueRangeError, match="takes whole numbers only"):
        axes.bound(Subject({"deck": actuator()}, AngleQuestion()))


def test_a_whole_number_that_stands_in_a_field_of_fractions_is_swept_as_one(machine: Any) -> None:
    # A shape of 1, not 1.0, and an amplitude of 1: what the field takes decides, not what stands in it.
    bound = GridAxis("ask.target.shape", 0.5, 2.0, 4).bound(Subject({"deck": machine}, DESIGN))
    assert [bound.row(k)[0] for k in range(4)] == [0.5, 1.0, 1.5, 2.0]
    assert with_settings(DESIGN, {"ask.target.shape": 1.5}, {}).target.shape == 1.5
    assert with_settings(LoopQuestion(amplitude=1), {"ask.amplitude": 0.5}, {}).amplitude == 0.5
    assert [GridAxis("ask.count", 3, 5, 3).bound(Subject({"deck": machine}, AngleQuestion())).count] == [3]


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (GridAxis(AREA, "60 mm^2", "90 mm^2", 10**9), "count = 1000000000: must be at most 10000000"),
        (LatinHypercube(BOX, 10**9), "must be at most"),
        (SaltelliSample(BOX, 2**24), "makes 50331648 points, at most"),
        (SobolSample(BOX, 2**29), "has more than 100000000"),
        (GridAxis(AREA, "60 mm^2", "90 mm^2", "3"), "count = '3': must be a whole number"),  # type: ignore[arg-type]
        (SobolSample(BOX, 4, seed=-1), "seed = -1: must be a whole number from 0 on"),
        (LatinHypercube(BOX, 4, seed=-1), "seed = -1"),
        (SaltelliSample(BOX, 4, seed=-1), "seed = -1"),
        (RandomDraws(4, seed=-1), "seed = -1"),
        (RandomDraws(4, seed=1.5), "seed = 1.5"),  # type: ignore[arg-type]
        (RandomDraws(4, names="spring.rubber.area"), "is one text, not a list"),  # type: ignore[arg-type]
    ],
)
def test_what_has_no_room_or_no_seed_is_refused_at_once(axes: AxisSet, words: str) -> None:
    with pytest.raises(ValueRangeError, match=words):
        sweep_task(actuator(), axes=[axes], ask=question())


def test_grids_whose_product_is_no_number_of_points_are_refused() -> None:
    axes = [GridAxis(f"spring.cam.lever_arm[{k}]", "1 mm", "2 mm", 1000) for k in range(1, 9)]
    with pytest.raises(ValueRangeError, match=r"sweep of 1e\+24 points"):
        sweep_task(declare(load_deck(PUBLISHED)), axes=axes, ask=AngleQuestion())


@pytest.mark.parametrize("ask", [AngleQuestion(last=1.5, count=2), LoopQuestion(last=1.5)])
def test_beyond_the_end_of_the_contour_there_is_no_answer(machine: Any, ask: Any) -> None:
    with pytest.raises(ValueRangeError, match=r"angles to 85.94°.*beyond the contour of spring.cam"):
        ask.ask(machine)


def test_a_table_is_printed_as_what_it_is(tmp_path: Path) -> None:
    table = sweeping.run(tmp_path, 3, InThisProcess())
    text = str(table)
    assert text == repr(table)
    assert "6 points" in text
    assert AREA in text
    assert len(text) < 500


def test_a_dry_run_counts_the_points_that_would_be_taken_over(tmp_path: Path, run: Run) -> None:
    path, out = tmp_path / "sweep.toml", str(tmp_path / "out")
    text = (
        f'decks = "{PUBLISHED}"\n[[axes]]\nListed = {{values = {{"{AREA}" = [9e-5, 1e-4]}}}}\n'
        "[ask.AngleQuestion]\ncount = 2\n"
    )
    path.write_text(text, encoding="utf-8")
    assert run("sweep", str(path), "--out", out, "--workers", "1")[0] == 0
    path.write_text(text.replace("9e-5", "8e-5, 9e-5"), encoding="utf-8")
    assert "3 points, 2 of them stand" in run("sweep", str(path), "--out", out, "--dry-run")[1]


def test_a_kill_while_points_are_numbered_anew_mixes_no_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = sweep_task(actuator(), axes=[Listed({AREA: [1e-5, 2e-5, 3e-5, 4e-5]})], ask=question())
    finished(tmp_path, first)
    real = Parts.replace_all

    def killed(self: Parts, tables: Iterator[Any]) -> None:
        self._write_table(next(tables))
        raise KeyboardInterrupt

    monkeypatch.setattr(Parts, "replace_all", killed)
    changed = sweep_task(actuator(), axes=[Listed({AREA: [4e-5, 3e-5, 2e-5, 1e-5]})], ask=question())
    with pytest.raises(KeyboardInterrupt):
        finished(tmp_path, changed)
    monkeypatch.setattr(Parts, "replace_all", real)
    table = finished(tmp_path, first)
    assert table.values[AREA].tolist() == [1e-5, 2e-5, 3e-5, 4e-5]


def finished(out: Path, task: Any) -> Any:
    return run_task(task, out, executor=InThisProcess(), settings=SweepSettings(), progress=Quiet())


def test_the_files_of_the_page_are_read_and_its_fields_are_all_there_are(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "how_to" / "sweep_designs.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    counts = []
    for block in blocks:
        path = tmp_path / "sweep.toml"
        path.write_text(block, encoding="utf-8")
        counts.append(len(read_sweep_file(path).plan))
    assert counts == [24, 16]
    for kind in (AngleQuestion, SpreadQuestion, LoopQuestion, DiagnosisQuestion):
        row = re.search(rf"\| `{kind.__name__}` \| (.*) \|\n", page)
        assert row is not None
        assert re.findall(r"`(\w+)`", row[1]) == [field.name for field in dataclasses.fields(kind)]
