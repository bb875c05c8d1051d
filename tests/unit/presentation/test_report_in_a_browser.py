"""Pages in a browser: no wider than a small screen, nothing asked of a network, nothing on the console."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.components import ROTATION, Dashpot, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.model.flat import equations
from nlsdesign.presentation import report
from nlsdesign.presentation.report.diagnosis_sections import VerdictSection
from tests import figure_samples as samples
from tests.browser import OUT_OF_SIGHT, Tab, chromium

pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")

LONG = "austin2015_figure_consistent_designed_791be9e6_and_once_more_refitted"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every kind of section, with names that are longer than a small screen is wide."""
    folder = tmp_path_factory.mktemp("page")
    (folder / f"{LONG}.toml").write_text("")
    spring, damper = Spring(stiffness=2.0, domain=ROTATION), Dashpot(damping=0.01, domain=ROTATION)
    swing = assembly(
        "a_rather_long_name", flywheel_of_the_machine=Inertia(inertia=1e-3),
        spring=tie(spring, "flywheel_of_the_machine"), damper=tie(damper, "flywheel_of_the_machine"),
    )  # fmt: skip
    table = report.TableSection(
        LONG, ("name", "value", *"abcdefgh"), ((LONG, LONG, *"12345678"),), caption=LONG, marked={0}
    )
    figure = report.FigureSection("Gap", samples.FIGURES["gap_bars"](), caption=f"Before and after, {LONG}.")
    return report.write_report(
        folder / "report.html",
        report.NumbersSection("In short", (report.KeyNumber(LONG, "13.1 %", LONG, before="20 %"),)),
        report.Chapter(LONG, f"`{LONG}`"),
        report.TextSection("Assembly", LONG, drawing=f"{LONG} {LONG}"),
        report.EquationsSection("Equations", equations(flatten(swing)), "All of them."),
        report.CamSection("Cam", samples.motion(), caption="It turns."),
        table,
        VerdictSection("What is missing", "named", LONG, headline=LONG, parts=(table, figure)),
        report.FileSection("Files", {folder / f"{LONG}.toml": "deck"}, caption="Beside the page."),
        title=f"{LONG}: designed cam", abstract=LONG, facts={"deck": f"`{LONG}`"},
    )  # fmt: skip


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [320, 390, 1280])
def test_no_page_is_wider_than_its_screen(tab: Tab, page: Path, width: int, theme: str) -> None:
    tab.look(width, theme=theme)
    tab.open(page)
    assert tab.evaluate(OUT_OF_SIGHT) == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    # Figures have a drawing of their own for a telephone, and no entry of the contents lies beside its list.
    moved = (
        "[...document.querySelectorAll('.drawing, nav ul')].some((e) => e.scrollWidth > e.clientWidth + 1)"
    )
    assert not tab.evaluate(moved)


def test_a_page_that_is_too_wide_is_noticed(tab: Tab, page: Path, tmp_path: Path) -> None:
    wide = tmp_path / "wide.html"
    wide.write_text(page.read_text(encoding="utf8").replace("overflow-x: auto", "overflow-x: visible"))
    tab.look(375)
    tab.open(wide)
    assert tab.evaluate(OUT_OF_SIGHT)


def test_a_table_that_is_moved_sideways_keeps_the_names_of_its_rows(
    tab: Tab, page: Path, tmp_path: Path
) -> None:
    loose = tmp_path / "loose.html"
    loose.write_text(page.read_text(encoding="utf8").replace("position: sticky; left: 0", "left: 0"))
    tab.look(390)
    tab.open(loose)
    assert all(each.startswith("TABLE") for each in tab.evaluate(OUT_OF_SIGHT))
    assert len(tab.evaluate(OUT_OF_SIGHT)) >= 2
    tab.open(page)
    grounds = tab.evaluate(
        "[...document.querySelectorAll('.scroll :is(td, th):first-child')]"
        ".map((each) => getComputedStyle(each).backgroundColor)"
    )
    # What passes under the first column must not show through it.
    assert grounds
    assert not any("rgba" in each for each in grounds)


def test_nothing_is_asked_of_a_network_and_nothing_is_said_on_the_console(tab: Tab, page: Path) -> None:
    tab.look(1280)
    tab.open(page)
    tab.evaluate("document.querySelector('#theme').click()")
    tab.evaluate("document.querySelector('input').dispatchEvent(new Event('input'))")
    assert tab.requests == [page.as_uri()]
    assert tab.messages == []


def test_what_a_page_must_not_do_is_noticed(tab: Tab, page: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    text = page.read_text(encoding="utf8").replace("</body>", '<img src="picture.png"></body>')
    bad.write_text(text)
    tab.open(bad)
    assert any("picture.png" in message for message in tab.messages)


def test_colours_follow_the_theme_and_paper_is_light(tab: Tab, page: Path) -> None:
    ground = "getComputedStyle(document.body).backgroundColor"
    before = "getComputedStyle(document.querySelector('.numbers .before')).color"
    seen = []
    for theme in ("light", "dark"):
        tab.look(1280, theme=theme)
        tab.open(page)
        tab.evaluate("delete document.documentElement.dataset.theme")
        seen.append((tab.evaluate(ground), tab.evaluate(before)))
    assert seen == [("rgb(244, 246, 248)", "rgb(213, 94, 0)"), ("rgb(14, 18, 23)", "rgb(255, 139, 74)")]
    tab.ask("Emulation.setEmulatedMedia", media="print")
    assert tab.evaluate(before) == "rgb(213, 94, 0)"


def test_the_printed_page_is_several_sheets_with_everything_unfolded(tab: Tab, page: Path) -> None:
    tab.look(1280)
    tab.open(page)
    paper = tab.paper()
    assert paper.startswith(b"%PDF")
    assert 3 <= paper.count(b"/Type /Page\n") <= 20
    assert tab.evaluate("[...document.querySelectorAll('details')].every((each) => each.open)")


@pytest.mark.slow
def test_the_numbers_of_a_figure_can_be_saved(tab: Tab, page: Path) -> None:
    tab.open(page)
    saved = tab.evaluate(
        "JSON.parse(decodeURIComponent([...document.querySelectorAll('a[download]')].at(-1).href.split(',').slice(1)"
        ".join(',')))"
    )
    assert saved["panels"][0]["y"] == "rms error in N"
