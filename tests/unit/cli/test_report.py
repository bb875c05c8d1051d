"""``nlsdesign report``: the page of a sweep and the decks behind its points, from what a run has left."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.foundation.errors import NlsError
from nlsdesign.sweeps.axes import saltelli_plan
from nlsdesign.sweeps.sweep_file import read_sweep_file
from nlsdesign.sweeps.sweep_parts import Parts
from nlsdesign.sweeps.sweep_table import about_text, read_sweep
from tests.command_line import Run, run
from tests.sweep_tables import AREA, DECK, spread_table
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

pytest.importorskip("pyarrow")
pytest.importorskip("SALib")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A sweep that was stopped: 20 of 30 points stand in its parts."""
    table = spread_table(20, failed=[4], about={"deck": DECK, "points": 30})
    place = tmp_path / "sweep"
    place.mkdir()
    (place / "sweep.json").write_text(about_text(table.about, table.columns), encoding="utf-8")
    (place / "deck.toml").write_text(table.decks[DECK], encoding="utf-8")
    rows = [
        {name: column[k] for name, column in table.values.items()} | {"(seconds)": 0.1, "(worker)": "a"}
        for k in range(20)
    ]
    Parts(place, table.columns).write(rows)
    return place


def test_a_page_in_the_folder_of_the_sweep_with_directions_units_and_requirements(
    run: Run, folder: Path
) -> None:
    status, out, err = run(
        "report", str(folder), "--smaller", "error", "--near", "mass=1500 mN·m", "--at-most", "error=10 N·m",
        "--out", str(folder), "--json",
    )  # fmt: skip
    assert (status, err) == (0, "")
    content = json.loads(out)
    assert content["points"] == 20
    assert content["failed"] == 1
    table = spread_table(20, failed=[4])
    cost = np.column_stack([table.values["error"], np.abs(table.values["mass"] - 1.5)])
    assert content["front"][0] == int(np.nanargmin(cost[:, 0]))
    page = (folder / "sweep.html").read_text(encoding="utf-8")
    assert "of 20 so far; 30 are asked for" in page
    assert "nearer to 1.50 N·m is better" in page
    assert f"nlsdesign report {folder} --deck-of POINT --out {folder}" in page
    again = read_sweep(folder)  # what the page has written is no part of the sweep
    assert (len(again), list(again.decks)) == (20, [DECK])


def test_only_the_decks_that_are_asked_for(run: Run, folder: Path) -> None:
    status, _, _ = run("report", str(folder), "--deck-of", "7", "--deck-of", "4", "--out", "chosen")
    assert status == 0
    assert sorted(each.name for each in Path("chosen").glob("*.toml")) == ["point_4.toml", "point_7.toml"]
    assert not Path("chosen/sweep.html").exists()
    value = spread_table(20).values[AREA][7]
    assert f"# {AREA} = {value} m^2" in Path("chosen/point_7.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--smaller", "eror"), "did you mean 'error'"),
        (("--near", "mass"), "has no value"),
        (("--near", "mass=3 kg"), "is not a unit like 'N·m'"),
        (("--smaller", "mass", "--larger", "mass"), "has two directions"),
        (("--deck-of", "99"), "point '99'"),
    ],
)
def test_bad_input_is_one_message_and_writes_nothing(
    run: Run, folder: Path, words: tuple[str, ...], message: str
) -> None:
    status, out, err = run("report", str(folder), *words, "--out", "page")
    assert (status, out) == (2, "")
    assert message in err
    assert not Path("page").exists()


def test_a_folder_without_a_sweep_is_named(run: Run, tmp_path: Path) -> None:
    status, _, err = run("report", str(tmp_path))
    assert status == 2
    assert "sweep.json" in err


def test_the_saltelli_sample_of_the_how_to_page_is_one_in_a_sweep_file(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "how_to" / "read_a_sweep.md").read_text(encoding="utf-8")
    axes = page.split("```toml\n")[1].split("```")[0]
    file = tmp_path / "sweep.toml"
    file.write_text(f'decks = "{DECK}"\n{axes}[ask.AngleQuestion]\ncount = 3\n', encoding="utf-8")
    plan = read_sweep_file(file).plan
    points = np.array([row for _, row in plan.points()])
    assert saltelli_plan(points) == (256, 4, False)
    assert points[:, 0].min() >= 60e-6
    assert points[:, 0].max() <= 160e-6
    file.write_text(file.read_text(encoding="utf-8").replace("count = 256", "count = 255"), encoding="utf-8")
    with pytest.raises(NlsError, match=r"count = 255.*power of two"):
        read_sweep_file(file)
