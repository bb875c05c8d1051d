"""Figures of a report: one meaning per colour, units on every axis, captions, and the numbers behind each."""

from __future__ import annotations

import ast
import html
import json
import re
import urllib.parse
from pathlib import Path

import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from nlsdesign.foundation.errors import visible
from nlsdesign.presentation import figures, report
from nlsdesign.presentation.figures.before_after import CandidateShare, candidate_shares
from nlsdesign.presentation.figures.style import AFTER, BEFORE, HOLDS, LIMIT, TONES
from nlsdesign.presentation.figures.svg import figure_data
from nlsdesign.presentation.report.sections import KeyNumber, NumbersSection, report_text
from tests import figure_samples as samples

ROOT = Path(__file__).parents[3]
TABLES = {"TableSection", "FileSection", "comparison_table"}
UNIT = re.compile(r" in (%|1|\S*[A-Za-z°µ³²/·]+\S*)( rms)?$|^\|jω·Z\|")
WITHOUT_UNIT = {"rank", "condition number", "damping ratio"}
"""What has no unit."""
PICTURES = {"cam_positions"}
"""Pictures of the mechanism: their axes are lengths, and colours stand for parts."""


@pytest.mark.parametrize("name", sorted(set(samples.FIGURES) - PICTURES))
def test_every_axis_of_numbers_has_a_unit(name: str) -> None:
    figure = samples.drawn(name)
    for axes in figure.axes:
        across = next(
            (a.get_xlabel() for a in axes.get_shared_x_axes().get_siblings(axes) if a.get_xlabel()), ""
        )
        places = [axes.xaxis.get_major_locator(), axes.yaxis.get_major_locator()]
        for label, ticks in zip((across or axes.get_xlabel(), axes.get_ylabel()), places, strict=True):
            if isinstance(ticks, FixedLocator):
                continue  # names stand there
            assert label in WITHOUT_UNIT or UNIT.search(label), f"{name}: '{label}'"


def colour_of(figure: Figure, label: str) -> str:
    """Colour of what has a label that begins so."""
    for axes in figure.axes:
        for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
            if text.startswith(label):
                part = handle.patches[0].get_facecolor() if hasattr(handle, "patches") else handle.get_color()
                return to_hex(part)
    raise AssertionError(f"no '{label}'")


@pytest.mark.parametrize(
    ("name", "label", "tone"),
    [
        ("gap_bars", "before", BEFORE),
        ("gap_bars", "after", AFTER),
        ("held_out_series", "before", BEFORE),
        ("held_out_series", "after", AFTER),
        ("binned_errors", "before", BEFORE),
        ("binned_errors", "after", AFTER),
        ("torque_against_target", "cam of the deck", AFTER),
        ("torque_against_measured", "model", AFTER),
        ("torque_against_measured", "Hooke fit", BEFORE),
        ("motor_over_task", "this curve", AFTER),
        ("motor_over_task", "best linear", BEFORE),
        ("curve_of_task", "this curve", AFTER),
        ("curve_of_task", "best linear", BEFORE),
        ("closed_loop", "true", AFTER),
        ("closed_loop", "limit", LIMIT),
    ],
)
def test_a_colour_means_the_same_in_every_figure(name: str, label: str, tone: object) -> None:
    assert colour_of(samples.drawn(name), label) == str(tone)


def test_made_springs_go_from_before_to_after() -> None:
    bars = samples.drawn("tolerance_bars").axes[0].containers[0]
    built, trimmed = (to_hex(bar.get_facecolor()) for bar in bars.patches[:2])
    assert (built, trimmed) == (BEFORE.light, AFTER.light)


def test_the_four_meanings_have_four_colours_in_both_themes() -> None:
    meanings = (AFTER, BEFORE, HOLDS, LIMIT)
    assert len({tone.light for tone in meanings}) == len({tone.dark for tone in meanings}) == 4
    assert set(meanings) <= set(TONES)
    text = (ROOT / "docs" / "conventions.md").read_text(encoding="utf8")
    assert all(f"`{name}`" in text for name in ("AFTER", "BEFORE", "HOLDS", "LIMIT"))


def test_colours_are_taken_by_their_meaning() -> None:
    by_hue = {"BLUE", "VERMILLION", "GREEN", "ORANGE"}
    mechanism = {
        "style",
        "cam_frames",
        "cam_motion",
        "design_figures",
        "rolling_picture",
        "workshop_drawing",
    }
    for path in (ROOT / "nlsdesign" / "presentation" / "figures").glob("*.py"):
        names = {
            each.id
            for each in ast.walk(ast.parse(path.read_text(encoding="utf8")))
            if isinstance(each, ast.Name)
        }
        assert path.stem in mechanism or not names & by_hue, path.stem


def test_every_table_of_the_project_has_a_caption() -> None:
    seen, bare = 0, []
    for path in (*(ROOT / "nlsdesign").rglob("*.py"), *(ROOT / "studies").rglob("*.py")):
        text = path.read_text(encoding="utf8")
        if not any(f"{name}(" in text for name in TABLES):
            continue
        for call in ast.walk(ast.parse(text)):
            if isinstance(call, ast.Call) and ast.unparse(call.func).rpartition(".")[2] in TABLES:
                seen += 1
                if "caption" not in {word.arg for word in call.keywords}:
                    bare.append(f"{path.relative_to(ROOT)}:{call.lineno}")
    assert seen > 40
    assert not bare


def held_data(page: str) -> dict[str, object]:
    (link,) = re.findall(r'href="data:application/json;charset=utf-8,([^"]*)"', page)
    content: dict[str, object] = json.loads(urllib.parse.unquote(html.unescape(link)))
    return content


def test_the_numbers_behind_a_figure_come_with_it(tmp_path: Path) -> None:
    figure = samples.FIGURES["gap_bars"]()
    page = report_text(tmp_path, [report.FigureSection("Errors <of> each", figure, caption="c")], title="t")
    assert 'download="errors_of_each.json"' in page
    (panel,) = held_data(page)["panels"]
    assert panel["y"] == "rms error in N"
    before, after, floor = panel["series"]
    assert before == {"label": "before", "x": ["steps", "slow sine", "multisine"], "y": [1.4, 0.9, 1.25]}
    assert after["y"] == [0.15, 0.11, 0.13]
    assert (floor["label"], floor["y"][::2]) == ("noise floor", [0.09, 0.08, 0.085])


def test_the_numbers_of_lines_areas_and_limits_are_those_that_are_drawn() -> None:
    panel = figure_data(samples.against_target())["panels"][0]
    series = {each["label"]: each for each in panel["series"]}
    drawn = samples.against_target().axes[0].lines[1]
    assert series["cam of the deck"]["y"] == pytest.approx(drawn.get_ydata(), rel=1e-4)
    assert (panel["x"], panel["y"]) == ("angle in degrees", "torque in N·m")
    assert len(series["tolerance ± 50.0 mN·m"]["x"]) > 200
    current = figure_data(samples.FIGURES["closed_loop"]())["panels"][1]["series"]
    assert {"label": "limit", "y": [12.0]} in current
    assert figure_data(figures.Figure()) == {"panels": []}


def test_a_key_number_shows_what_was_before(tmp_path: Path) -> None:
    numbers = NumbersSection("Key", (KeyNumber("error", "0.96 × noise", "held out", before="23.7"),))
    page = report_text(tmp_path, [numbers], title="t")
    assert '<span class="before">23.7</span> → <span class="after">0.96 × noise</span>' in page


def test_control_characters_in_names_are_written_out(tmp_path: Path) -> None:
    evil = "name\x1b]0;title\x07\x9b31m\u202egnp"
    page = report_text(
        tmp_path, [report.TextSection(evil, evil, drawing=evil)], title=evil, facts={evil: evil}
    )
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e]", page)
    assert page.count(r"name\x1b]0;title\x07\x9b31m\u202egnp") >= 6
    assert visible("line\nand\ttab ± °") == "line\nand\ttab ± °"


def test_numbers_of_many_bars_stand_upright_and_no_share_is_minus_zero() -> None:
    many = [figures.RecordError(f"r{i}", 0.3, 0.02, 0.01, False) for i in range(12)]
    for errors, angle in ((many, 90.0), (many[:9], 0.0)):
        axes = figures.gap_bars(errors, unit="N").axes[0]
        assert {text.get_rotation() for text in axes.texts if text.get_text() == "0.300"} == {angle}
    shares = candidate_shares([CandidateShare("slack", -0.001, True)])
    assert [text.get_text() for text in shares.axes[0].texts] == ["0 %, added"]
