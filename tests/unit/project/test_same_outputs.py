"""The comparison of two recordings notices what machines read, and only lists what readers read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.same_outputs.comparison import show
from tests.same_outputs.jobs import jobs

RECORDED = {
    "verdict.json": '{"verdict": "named", "share": 0.125, "why": "the error is smaller by far"}',
    "observer.c": "double gain = 0.5;\n",
    "help.txt": "Design the cam.\n",
}


def recorded(folder: Path, **changed: str) -> Path:
    """Write a recording of one job, with other contents for the files whose stem is given."""
    job = folder / "code" / "observer"
    job.mkdir(parents=True)
    for name, text in (RECORDED | {".done": "1.0 s"}).items():
        (job / name).write_text(changed.get(name.split(".")[0], text), encoding="utf8")
    return folder


@pytest.mark.parametrize(
    ("changed", "place"),
    [
        ({"verdict": RECORDED["verdict.json"].replace("0.125", "0.1250001")}, "/share: 0.125 -> 0.1250001"),
        ({"verdict": RECORDED["verdict.json"].replace("named", "none")}, "/verdict: named -> none"),
        ({"verdict": RECORDED["verdict.json"].replace("share", "part")}, "/share: only before"),
        ({"verdict": RECORDED["verdict.json"].replace("by far", "by 3 %")}, "smaller by 3 %"),
        ({"verdict": RECORDED["verdict.json"].replace(", ", ",  ")}, '+ {"verdict": "named",  "share"'),
        ({"observer": "double gain = 0.51;\n"}, "+ double gain = 0.51;"),
    ],
)
def test_a_changed_number_or_name_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changed: dict[str, str], place: str
) -> None:
    assert show(recorded(tmp_path / "a"), recorded(tmp_path / "b", **changed)) == 1
    said = capsys.readouterr().out
    assert place in said
    assert "reworded: 0" in said


@pytest.mark.parametrize(
    "changed",
    [
        {"help": "Design the contour.\n"},
        {"verdict": RECORDED["verdict.json"].replace("by far", "by a wide margin")},
    ],
)
def test_a_reworded_text_is_only_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changed: dict[str, str]
) -> None:
    assert show(recorded(tmp_path / "a"), recorded(tmp_path / "b", **changed)) == 0
    assert "reworded: 1" in capsys.readouterr().out


def test_what_is_missing_is_noticed(tmp_path: Path) -> None:
    before, after = recorded(tmp_path / "a"), recorded(tmp_path / "b")
    assert show(before, after) == 0
    (after / "code" / "observer" / "observer.c").unlink()
    assert show(before, after) == 1  # a file
    assert show(before, recorded(tmp_path / "c") / "code" / "observer") == 1  # all jobs


def test_a_job_that_did_not_end_is_noticed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, after = recorded(tmp_path / "a"), recorded(tmp_path / "b")
    (after / "code" / "observer" / ".done").unlink()
    assert show(before, after) == 1
    assert "code/observer/.done: only before" in capsys.readouterr().out


def test_every_group_has_a_quick_job_and_every_job_its_own_name() -> None:
    names = [job.name for job in jobs()]
    assert len(set(names)) == len(names)
    groups = {job.name.split("/")[0] for job in jobs()}
    assert groups == {"decks", "code", "analysis", "design", "diagnose", "sweep", "studies"}
    assert {job.name.split("/")[0] for job in jobs() if job.quick} == groups
