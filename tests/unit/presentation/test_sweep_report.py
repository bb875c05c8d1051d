"""The page of a sweep says what was asked, what failed, what was left out, whatever the names and numbers."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import UnknownNameError
from nlsdesign.presentation.sweep_report import write_sweep_report
from nlsdesign.presentation.sweep_report.shown_points import MOST_KEPT, MOST_OTHERS, shown_points
from nlsdesign.presentation.sweep_report.sweep_page import SweepPage, usual_requirements
from nlsdesign.sweeps import Preference
from nlsdesign.sweeps.preferences import Requirement, nondominated, rank_points
from nlsdesign.sweeps.sweep_table import SweepTable, point_deck_text, point_deck_texts
from tests.sweep_tables import AREA, HOSTILE, INERTIA, RUBBER, spread_table, table_of

pytest.importorskip("SALib")

BOTH = (Preference.smaller("error"), Preference.smaller("mass"))


def page_of(table: SweepTable, folder: Path, **options: Any) -> str:
    return write_sweep_report(table, folder, **options).page.read_text(encoding="utf-8")


def linked(page: str) -> set[int]:
    """Points that a figure of the page links."""
    return {int(each) for each in re.findall(r'<a href="#point-(\d+)">', page)}


def rows_of(page: str) -> dict[str, Any]:
    text = re.search(
        r'<script type="application/json" id="points-of-the-page">(.*?)</script>', page, re.DOTALL
    )
    assert text is not None
    return dict(json.loads(text[1]))


@pytest.fixture(scope="module")
def table() -> SweepTable:
    """Numbers and words of a real deck, and names and reasons that nobody means well with."""
    plain = spread_table(
        failed=[3, 7, 11], reason=HOSTILE, about={"deck": HOSTILE, "digest": "0" * 64, "points": 90}
    )
    words = np.array([HOSTILE, "日本", "=1+1"], dtype=object)[np.arange(60) % 3]
    columns = [replace(c, name=f"{HOSTILE} 2") if c.name == "error" else c for c in plain.columns]
    columns.insert(4, replace(plain.column(RUBBER), name="ask.a,b `c`"))
    values = {**plain.values, f"{HOSTILE} 2": plain.values["error"], "ask.a,b `c`": words}
    return SweepTable(tuple(columns), values, plain.about, plain.decks)


@pytest.fixture(scope="module")
def written(table: SweepTable, tmp_path_factory: pytest.TempPathFactory) -> SweepPage:
    both = (Preference.smaller(f"{HOSTILE} 2"), Preference.smaller("mass"))
    limit = float(np.nanquantile(table.values["mass"], 0.9))
    folder = tmp_path_factory.mktemp("page")
    return write_sweep_report(
        table,
        folder,
        preferences=both,
        requirements=[Requirement.at_most("mass", limit)],
        source="out/some sweep",
    )


@pytest.fixture(scope="module")
def page(written: SweepPage) -> str:
    return written.page.read_text(encoding="utf-8")


def test_what_was_asked_failures_and_front_stand_on_the_page(
    table: SweepTable, written: SweepPage, page: str
) -> None:
    for text in ("of 60 so far; 90 are asked for", "3 of 60 points failed", "smaller is better", "0" * 12):
        assert text in page
    good = np.flatnonzero(table.done & (table.values["mass"] <= np.nanquantile(table.values["mass"], 0.9)))
    costs = np.array([table.values[name][good] for name in (f"{HOSTILE} 2", "mass")]).T
    assert set(written.front) == set(good[nondominated(costs)].tolist())
    assert linked(page) == set(range(60))
    rows = rows_of(page)
    assert {k for k, row in rows["rows"].items() if row.get("status") == "failed"} == {"3", "7", "11"}
    assert rows["rows"]["7"]["values"][-2:] == [None, None]
    assert rows["rows"][str(written.front[0])]["note"] == "On the front."
    missed = np.flatnonzero(table.values["mass"] > np.nanquantile(table.values["mass"], 0.9))
    noted = {k for k, row in rows["rows"].items() if row.get("note") == "Misses a requirement."}
    assert noted == set(map(str, missed))
    assert not set(missed.tolist()) & set(written.front)
    assert rows["command"] == f"nlsdesign report 'out/some sweep' --deck-of POINT --out {written.page.parent}"
    assert set(map(int, rows["decks"])) == set(written.front) == set(written.decks)
    for number in written.front:
        assert f'<tr id="point-{number}">' in page
        assert (written.page.parent / rows["decks"][str(number)]).is_file()


def test_hostile_names_and_reasons_stay_text(written: SweepPage, page: str) -> None:
    assert "document.title=&#34;broken" in page
    assert '<script>document.title="broken"' not in page
    assert page.count("<script") == page.count("</script>") == 2
    assert "\x1b" not in page
    rows = rows_of(page)
    assert any(name.startswith('<script>document.title="broken"') for name, _ in rows["columns"])
    assert rows["rows"]["3"]["reason"].startswith('<script>document.title="broken"')
    for path in written.decks.values():
        assert declare(load_deck(path)).name == "austin2015_as_printed"


def test_all_numbers_stand_in_the_file_beside_the_page_in_si(table: SweepTable, written: SweepPage) -> None:
    with written.points.open(encoding="utf-8", newline="") as stream:
        head, *rows = list(csv.reader(stream))
    assert head[:5] == ["point", f"{AREA} [m^2]", f"{INERTIA} [kg*m^2]", RUBBER, "ask.a,b `c`"]
    assert len(rows) == len(table)
    assert [float(row[1]) for row in rows] == pytest.approx(table.values[AREA].tolist(), rel=1e-8)
    assert rows[3][-2] == "failed"
    assert np.isnan(float(rows[3][head.index("mass [N*m]")]))
    assert rows[2][4] == "=1+1"


def test_the_deck_of_a_point_is_the_machine_with_its_numbers(tmp_path: Path) -> None:
    table = spread_table()
    for number, text in point_deck_texts(table, [5, 17]):
        assert isinstance(text, str)
        assert text == point_deck_text(table, number)
        assert text.startswith(f"# Point {number} of a sweep of austin2015_as_printed")
        (tmp_path / "point.toml").write_text(text, encoding="utf-8")
        quantities = declare(load_deck(tmp_path / "point.toml")).quantities()
        assert quantities[AREA].number == pytest.approx(table.values[AREA][number], rel=1e-12)
        assert quantities[INERTIA].number == pytest.approx(table.values[INERTIA][number], rel=1e-12)
        assert f"{table.values[RUBBER][number]}, " in text


def test_a_point_without_a_deck_says_why() -> None:
    table = spread_table(4)
    table.values[AREA][1] = -1.0
    table.values[RUBBER][2] = "no such rubber"
    texts = dict(point_deck_texts(table, range(4)))
    assert [isinstance(text, str) for text in texts.values()] == [True, False, False, True]
    assert "no such rubber" in str(texts[2])
    bare = SweepTable(table.columns, table.values, table.about)
    assert "has no deck" in str(dict(point_deck_texts(bare, [0]))[0])
    with pytest.raises(UnknownNameError, match="point '9'"):
        point_deck_text(table, 9)


def test_without_a_direction_nothing_is_best_and_odd_numbers_are_counted(tmp_path: Path) -> None:
    steps = np.linspace(1e-6, 2e-6, 30)
    answers = {"error": steps * 1e6, "mass": np.full(30, 0.5)}
    table = table_of({AREA: np.full(30, 1e-4), INERTIA: steps}, answers)
    table.values["error"][[4, 5, 6]] = np.inf, -np.inf, np.nan
    written = write_sweep_report(table, tmp_path)
    page = written.page.read_text(encoding="utf-8")
    assert written.front == ()
    assert "No direction was stated" in page
    assert "On the front" not in page
    assert "Best points" not in page
    assert "least error" in page
    assert "2 times infinite" in page
    assert "1 times not a number" in page
    assert "The same at all points: " in page
    assert "is 0.500 N·m at all points" in page
    assert "the answer is the same at all points" in page
    rows = rows_of(page)["rows"]
    assert [rows[k]["values"][2] for k in "456"] == ["∞", "−∞", None]


def test_a_design_that_has_not_met_its_target_is_a_miss() -> None:
    table = table_of({AREA: [1e-4, 2e-4]}, {"met": [0.0, 1.0], "error": [0.1, 0.2]})
    kept = rank_points(table.values, table.done, preferences=BOTH[:1], requirements=usual_requirements(table))
    assert kept.front.tolist() == [1]
    assert kept.missed.tolist() == [True, False]
    assert rank_points(table.values, table.done, preferences=BOTH[:1]).front.tolist() == [0]
    assert usual_requirements(spread_table(2)) == []


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_points_are_a_page(tmp_path: Path, count: int) -> None:
    written = write_sweep_report(spread_table(count), tmp_path, preferences=BOTH)
    assert written.front == tuple(range(count))
    assert linked(written.page.read_text(encoding="utf-8")) == set(range(count))


def test_all_failed_is_a_page_without_a_result(tmp_path: Path) -> None:
    page = page_of(spread_table(12, failed=range(12)), tmp_path, preferences=BOTH)
    assert "12 of 12 points failed" in page
    assert "No point has answers that can be compared" in page
    assert "no point has a finite answer" in page
    assert "quantiles" not in page
    assert linked(page) == set(range(12))


def test_a_direction_for_an_answer_that_does_not_exist_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'error'"):
        write_sweep_report(spread_table(), tmp_path / "page", preferences=[Preference.smaller("eror")])
    assert not (tmp_path / "page").exists()


# --- which points are drawn -----------------------------------------------------------------------


def test_thinning_keeps_failures_front_and_ends_and_states_its_rule() -> None:
    table = spread_table(10_000, failed=range(0, 10_000, 20))
    ranked = rank_points(table.values, table.done, preferences=BOTH)
    shown = shown_points(table, ranked)
    drawn = set(shown.rows.tolist())
    ends = {int(f(table.values[c])) for c in (AREA, INERTIA) for f in (np.argmin, np.argmax)}
    assert set(range(0, 10_000, 20)) | set(ranked.front.tolist()) | ends <= drawn
    assert 500 + MOST_OTHERS <= len(drawn) <= 500 + MOST_OTHERS + len(ranked.front) + 8
    assert f"Of 10000 points {len(drawn)} are drawn" in shown.rule
    assert shown.rows.tolist() == shown_points(table, ranked).rows.tolist()
    assert shown.kinds.failed.sum() == 500
    assert shown.kinds.front.sum() == len(ranked.front)
    small = spread_table(100)
    assert shown_points(small, rank_points(small.values, small.done)).rule == ""


def test_more_failures_than_a_page_holds_are_counted_and_the_front_stays() -> None:
    table = spread_table(MOST_KEPT + 500, failed=range(50, MOST_KEPT + 500))
    ranked = rank_points(table.values, table.done, preferences=BOTH)
    shown = shown_points(table, ranked)
    assert set(ranked.front.tolist()) <= set(shown.rows.tolist())
    assert "failures are not drawn" in shown.rule
    assert len(shown.rows) <= MOST_KEPT + MOST_OTHERS


@pytest.mark.slow
@pytest.mark.parametrize("failed", [300, 10_000])
def test_the_page_of_ten_thousand_points_is_light(tmp_path: Path, failed: int) -> None:
    table = spread_table(10_000, failed=range(failed))
    written = write_sweep_report(table, tmp_path, preferences=BOTH)
    assert written.page.stat().st_size < 3e6
    assert set(range(failed)) <= linked(written.page.read_text(encoding="utf-8"))
