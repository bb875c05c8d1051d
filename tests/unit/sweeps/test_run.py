"""A sweep survives its driver and its workers, refuses what would mix results, and never computes twice."""

from __future__ import annotations

import errno
import functools
import json
import os
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.foundation.errors import ExportError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.progress import Quiet
from nlsdesign.foundation.work_sharing import CodeIdentity, InThisProcess, PointOutcome, Processes
from nlsdesign.sweeps import (
    FunctionQuestion,
    GridAxis,
    LatinHypercube,
    Listed,
    RandomDraws,
    SaltelliSample,
    SobolSample,
    sweep,
)
from nlsdesign.sweeps.axes import AxisSet
from nlsdesign.sweeps.run_sweep import SweepSettings, duration, run_task, sweep_task
from tests import sweeping
from tests.sweeping import AREA, INERTIA, actuator, question

HERE = InThisProcess()


def test_processes_give_the_bytes_of_one_process_and_nothing_is_computed_twice(tmp_path: Path) -> None:
    table = sweeping.run(tmp_path / "two", 40, Processes(2))
    assert len(table) == 80
    assert 0 < (~table.done).sum() < 20
    assert sweeping.same_table(tmp_path / "two", 40, tmp_path / "one")
    timings = pq.read_table(tmp_path / "two" / "timings.parquet")
    assert timings.column("point").to_pylist() == list(range(80))
    before = sorted((tmp_path / "two" / "parts").iterdir())
    sweeping.run(tmp_path / "two", 40, Processes(2))
    assert sorted((tmp_path / "two" / "parts").iterdir()) == before


@pytest.mark.slow
def test_a_killed_driver_leaves_what_it_had_and_the_next_run_adds_the_rest(tmp_path: Path) -> None:
    out = tmp_path / "killed"
    with sweeping.driver(out, 60, 0.1, "2") as process:
        standing = sweeping.wait_for_rows(out, 20)
        workers = sweeping.children(process.pid)
        assert len(workers) >= 2
        process.kill()
        process.wait()
    assert standing < 120
    assert not (out / "results.parquet").exists()
    half = len(sweeping.rows_in_parts(out))
    sweeping.run(out, 60, HERE)
    points = sweeping.rows_in_parts(out)
    assert sorted(points) == list(range(120)), "nothing lost, nothing twice"
    assert half >= standing
    assert not any(sweeping.runs(each) for each in workers), "a worker outlived its driver"
    assert sweeping.same_table(out, 60, tmp_path / "one")


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_driver_that_is_asked_to_end_writes_what_it_has(tmp_path: Path, number: signal.Signals) -> None:
    out = tmp_path / "asked"
    with sweeping.driver(out, 5000, 0.005, "2") as process:
        sweeping.wait_for_rows(out, 1)
        before = len(sweeping.rows_in_parts(out))
        process.send_signal(number)
        process.communicate(timeout=20)
        assert process.returncode == 128 + number
    after = sweeping.rows_in_parts(out)
    assert len(after) >= before
    assert len(set(after)) == len(after)


def test_failed_points_are_computed_again_only_when_asked(tmp_path: Path) -> None:
    first = sweeping.run(tmp_path, 20, HERE)
    failed = first.values["point"][~first.done].tolist()
    assert failed
    sweeping.run(tmp_path, 20, HERE)
    assert len(sweeping.rows_in_parts(tmp_path)) == 40
    again = sweeping.run(tmp_path, 20, HERE, settings=SweepSettings(retry_failed=True))
    assert sorted(sweeping.rows_in_parts(tmp_path)) == sorted([*range(40), *failed])
    assert again.values["point"].tolist() == list(range(40))
    assert "the area is too large" in again.values["reason"][failed[0]]


def swept(out: Path, *axes: AxisSet, ask: FunctionQuestion | None = None, **settings: bool) -> Any:
    return sweep(actuator(), axes=axes, ask=ask or question(), out=out, executor=HERE,
                 settings=SweepSettings(**settings))  # fmt: skip


def test_points_of_other_axes_are_taken_over_by_their_content(tmp_path: Path) -> None:
    swept(tmp_path, Listed({AREA: [1e-5, 2e-5, 3e-5]}))
    table = swept(tmp_path, Listed({AREA: [3e-5, 2.5e-5, 1e-5]}))
    points = sweeping.rows_in_parts(tmp_path)
    assert sorted(points) == [-1, 0, 1, 2], "2e-5 is kept and has no number, one point was computed"
    assert table.values[AREA].tolist() == [3e-5, 2.5e-5, 1e-5]
    inertia = actuator().quantities()[INERTIA].number
    assert table.values["product"].tolist() == [x * inertia for x in (3e-5, 2.5e-5, 1e-5)]
    swept(tmp_path, Listed({AREA: [2e-5]}))
    assert sorted(sweeping.rows_in_parts(tmp_path)) == [-1, -1, -1, 0]


def other(made: Assembly) -> Mapping[str, float]:
    return {"product": 1.0}


def test_a_folder_of_another_sweep_is_refused_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    axes = Listed({AREA: [1e-5, 2e-5]})
    swept(tmp_path, axes)
    kept = (tmp_path / "results.parquet").read_bytes()
    with pytest.raises(ExportError, match=r"its question .* is another one.*--again"):
        swept(tmp_path, axes, ask=FunctionQuestion(other, {"product": ""}))
    with pytest.raises(ExportError, match=r"its axes or answers are others: spring\.rubber\.area, product"):
        swept(tmp_path, Listed({INERTIA: [1e-6]}))
    changed = actuator().with_values({INERTIA: 5e-6})
    with pytest.raises(ExportError, match="its deck 'austin2015_as_printed' has other numbers"):
        sweep(changed, axes=[axes], ask=question(), out=tmp_path, executor=HERE)
    about = json.loads((tmp_path / "sweep.json").read_text())
    for key, value, words in (
        ("code", "0" * 64, r"computed by nlsdesign .* \(code 000000000000\), this is nlsdesign"),
        ("version", "0.0.1", r"nlsdesign 0\.0\.1 "),
        ("libraries", {"casadi": "1"}, "computed with casadi 1, here are casadi"),
    ):
        (tmp_path / "sweep.json").write_text(json.dumps({**about, key: value}))
        with pytest.raises(ExportError, match=words):
            swept(tmp_path, axes)
    assert (tmp_path / "results.parquet").read_bytes() == kept
    assert swept(tmp_path, axes, ask=FunctionQuestion(other, {"product": ""}), again=True).values[
        "product"
    ].tolist() == [1.0, 1.0]


def test_changed_code_is_named_file_by_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    axes = Listed({AREA: [1e-5]})
    swept(tmp_path, axes)
    real = sweep_task(actuator(), axes=[axes], ask=question())
    files = json.loads((tmp_path / "code.json").read_text())
    name = "nlsdesign/design/statics/equilibrium.py"
    assert name in files
    changed = CodeIdentity("0.1.0", "1" * 64, {**files, name: "2" * 64})
    monkeypatch.setattr("nlsdesign.sweeps.sweep_folder.code_identity", lambda: changed)
    task = sweep_task(actuator(), axes=[axes], ask=question())
    assert task.about["code"] != real.about["code"]
    with pytest.raises(ExportError, match=f"; changed: {name} ->"):
        run_task(task, tmp_path, executor=HERE, settings=SweepSettings(), progress=Quiet())


def scaled(made: Assembly, factor: float) -> Mapping[str, float]:
    return {"a": factor}


def test_a_function_is_known_by_its_source_and_by_what_it_holds() -> None:
    one, two = (FunctionQuestion(functools.partial(scaled, factor=c), {"a": ""}) for c in (0.0, 1.0))
    assert one.describe() != two.describe()
    factors = [FunctionQuestion(lambda made, f=f: {"a": f}, {"a": ""}).describe() for f in (1.0, 2.0, 1.0)]
    assert factors[0] == factors[2] != factors[1]


def test_two_runs_in_one_folder_and_foreign_files_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nlsdesign.sweeps.sweep_folder._LOCK_SECONDS", 0.2)
    out = tmp_path / "shared"
    out.mkdir()
    lock = f"import fcntl; f = open({str(out / '.running')!r}, 'w'); fcntl.lockf(f, fcntl.LOCK_EX); "
    with sweeping.program("-c", lock + "print('held', flush=True); input()") as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(ExportError, match="is in use by another run"):
            sweeping.run(out, 2, HERE)
    assert len(sweeping.run(out, 2, HERE)) == 4, "the lock ends with its process"
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "results.parquet").write_bytes(b"mine")
    with pytest.raises(ExportError, match=r"results.parquet: stands there without the sweep.json"):
        sweeping.run(tmp_path / "foreign", 2, HERE)


def test_a_folder_that_cannot_be_written_or_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ExportError, match="name another folder"):
        sweeping.run(tmp_path / "file" / "inside", 2, HERE)

    def full(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(pq.ParquetWriter, "write_table", full)
        with pytest.raises(ExportError, match="No space left on device"):
            sweeping.run(tmp_path / "full", 2, HERE)
    assert sweeping.rows_in_parts(tmp_path / "full") == []
    assert len(sweeping.run(tmp_path / "full", 2, HERE)) == 4, "with room again it goes on"


@pytest.mark.parametrize(
    ("axes", "kind", "words"),
    [
        ([GridAxis("spring.rubber.aria", 1, 2, 3)], UnknownNameError, "did you mean 'spring.rubber.area'"),
        ([GridAxis(AREA, "1 mm", "2 mm", 3)], UnitError, "give it in a unit like 'm\\^2'"),
        ([GridAxis(AREA, 2e-5, 1e-5, 3)], ValueRangeError, "the smaller end first"),
        ([GridAxis(AREA, 0.0, 1e-5, 3, "ratio")], ValueRangeError, "steps have no ratio"),
        ([GridAxis("spring.rubber", 1, 2, 3)], UnknownNameError, "axis spring.rubber '1'"),
        ([Listed({"spring.rubber": ["PMC-77"]})], UnknownNameError, "did you mean 'PMC-770'"),
        ([Listed({AREA: [1e-5, 2e-5, 1e-5]})], ValueRangeError, "twice: rows 1 and 3"),
        ([Listed({AREA: [1e-5], INERTIA: [1e-6, 2e-6]})], ValueRangeError, "rows of different length"),
        ([Listed({AREA: [1e-5]}), GridAxis(AREA, 1e-5, 2e-5, 2)], ValueRangeError, "points collide"),
        (
            [Listed({"factor(spring.cam.lever_arm)": [1.0]}), Listed({"spring.cam.lever_arm[2]": [1e-3]})],
            ValueRangeError, "change the same number",
        ),
        ([Listed({"spring.cam.lever_arm": [1e-3]})], ValueRangeError, "is a row of .* numbers"),
        ([SobolSample({AREA: (1e-5, 2e-5)}, 0)], ValueRangeError, "count = 0"),
        ([LatinHypercube({"spring.rubber": ("PMC-770", "EPDM")}, 4)], ValueRangeError, "takes words"),
        ([RandomDraws(3, names=("motor.gear_ratio",))], UnknownNameError, "number with a spread"),
        ([], ValueRangeError, "has no axes"),
        ([Listed({"ask.function": [1]})], UnknownNameError, "axis 'ask.function'"),
        ([Listed({AREA: [float("nan")]})], ValueRangeError, "is not finite"),
    ],
)  # fmt: skip
def test_axes_that_cannot_be_are_refused_before_anything_runs(
    axes: list[AxisSet], kind: type[Exception], words: str, tmp_path: Path
) -> None:
    with pytest.raises(kind, match=words):
        sweep(actuator(), axes=axes, ask=question(), out=tmp_path / "none", executor=HERE)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    "other",
    [
        GridAxis(INERTIA, 1e-6, 2e-6, 2),
        Listed({"spring.rubber": ["PMC-770", "Dragon_Skin_30"]}),
        SaltelliSample({INERTIA: (1e-6, 2e-6)}, 4),
    ],
)
def test_a_saltelli_plan_is_not_crossed(other: AxisSet) -> None:
    pytest.importorskip("SALib")
    plan = SaltelliSample({AREA: (1e-5, 2e-5)}, 4)
    for axes in ([plan, other], [other, plan]):
        with pytest.raises(
            ValueRangeError, match=r"Saltelli sample over .* is crossed with axis .*among its"
        ):
            sweep_task(actuator(), axes=axes, ask=question())
    alone = sweep_task(actuator(), axes=[plan, Listed({INERTIA: [1e-6]})], ask=question())
    assert len(alone.plan) == 12, "one value crosses nothing"


def test_an_answer_that_was_not_announced_is_the_failure_of_its_point(tmp_path: Path) -> None:
    table = swept(tmp_path, Listed({AREA: [1e-5]}), ask=FunctionQuestion(other, {"another": ""}))
    assert "answered ['product'], ['another'] were announced" in table.values["reason"][0]


def test_time_left_is_said(tmp_path: Path) -> None:
    texts: list[str] = []

    class Noted:
        def note(self, text: str) -> None:
            texts.append(text)

    task = sweep_task(actuator(), axes=[Listed({AREA: [1e-5, 4e-5]})], ask=question())
    run_task(task, tmp_path, executor=HERE, settings=SweepSettings(), progress=Noted())
    assert any(t.startswith("2 of 2 points, 1 failed, about 0 s left") for t in texts)
    assert duration(754.0) == "12 min 34 s"
    assert PointOutcome(1, 2).reason == ""
