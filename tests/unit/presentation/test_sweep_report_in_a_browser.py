"""The page of a sweep as a reader has it: by mouse, by keyboard, on a telephone, in the dark, on paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from nlsdesign.presentation.sweep_report import write_sweep_report
from nlsdesign.sweeps import Preference
from nlsdesign.sweeps.sweep_table import SweepTable
from tests.browser import OUT_OF_SIGHT, Tab, chromium
from tests.sweep_tables import HOSTILE, spread_table

pytest.importorskip("SALib")
pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")

KEYS = {"Tab": 9, "Enter": 13, "Escape": 27, "End": 35, "Home": 36, "ArrowLeft": 37, "ArrowRight": 39}
CHOSEN = "document.querySelector('aside.chosen')"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    table = spread_table(40, failed=[5], reason=HOSTILE, about={"deck": HOSTILE, "points": 40})
    columns = tuple(replace(c, name=HOSTILE) if c.name == "error" else c for c in table.columns)
    values = {**table.values, HOSTILE: table.values["error"]}
    named = SweepTable(columns, values, table.about, table.decks)
    both = (Preference.smaller(HOSTILE), Preference.smaller("mass"))
    return write_sweep_report(named, tmp_path_factory.mktemp("page"), preferences=both).page


@pytest.fixture
def opened(tab: Tab, page: Path) -> Tab:
    tab.look(1280)
    tab.open(page)
    return tab


def press(tab: Tab, key: str) -> None:
    text = {"text": "\r"} if key == "Enter" else {}
    tab.ask(
        "Input.dispatchKeyEvent", type="keyDown", key=key, code=key, windowsVirtualKeyCode=KEYS[key], **text
    )
    tab.ask("Input.dispatchKeyEvent", type="keyUp", key=key, code=key, windowsVirtualKeyCode=KEYS[key])


def focused(tab: Tab) -> str:
    return str(
        tab.evaluate("document.activeElement.getAttribute('href') || document.activeElement.className")
    )


def first_link(figure: int) -> str:
    return f"[...document.querySelectorAll('figure')][{figure}].querySelector('svg a[tabindex=\"0\"]')"


def test_hostile_names_stay_text_and_nothing_is_asked_of_a_network(opened: Tab, page: Path) -> None:
    opened.evaluate("document.querySelectorAll('svg a').forEach((each) => each.focus())")
    opened.evaluate("location.hash = '#point-5'; new Promise((done) => setTimeout(done, 50))")
    assert opened.evaluate(f"{CHOSEN}.innerText.includes('Failed: <script>')")
    assert opened.evaluate("document.title") != "broken"
    assert opened.requests == [page.as_uri()]
    assert opened.messages == []


def test_a_point_is_chosen_by_mouse_and_marked_in_all_figures(opened: Tab) -> None:
    # A point of the front is on top of others, so what lies at its place is the point itself.
    opened.evaluate(f"{first_link(0)}.scrollIntoView({{behavior: 'instant', block: 'center'}})")
    x, y, point = opened.evaluate(
        f"(() => {{ const mark = {first_link(0)}, box = mark.getBoundingClientRect(); return ["
        "box.left + box.width / 2, box.top + box.height / 2, mark.getAttribute('href').slice(7)]; })()"
    )
    for kind in ("mousePressed", "mouseReleased"):
        opened.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
    assert opened.evaluate(f"{CHOSEN}.querySelector('h3').textContent") == f"Point {point}"
    figures = (
        "[...document.querySelectorAll('figure')].filter((each) => each.querySelector('a.is-chosen')).length"
    )
    assert opened.evaluate(figures) >= 2
    assert (
        opened.evaluate(f"{CHOSEN}.querySelector('.deck a').getAttribute('href')")
        == f"point_decks/point_{point}.toml"
    )
    assert opened.evaluate("location.hash") == f"#point-{point}"
    opened.evaluate(f"{CHOSEN}.querySelector('button').click()")
    assert opened.evaluate(f"{CHOSEN}.hidden")
    assert opened.evaluate("document.querySelectorAll('a.is-chosen').length") == 0


def test_the_keyboard_reaches_every_point_of_a_figure(opened: Tab) -> None:
    opened.evaluate("document.querySelector('form.choose button').focus()")
    press(opened, "Tab")
    press(opened, "Tab")
    first = focused(opened)
    assert first.startswith("#point-")
    press(opened, "Home")
    seen = [focused(opened)]
    for _ in range(45):
        press(opened, "ArrowRight")
        seen.append(focused(opened))
    assert len(set(seen)) == 39  # all but the one that failed
    press(opened, "Enter")
    assert not opened.evaluate(f"{CHOSEN}.hidden")
    assert opened.evaluate(f"{CHOSEN}.querySelector('h3').textContent") == f"Point {seen[-1][7:]}"
    press(opened, "Escape")
    assert opened.evaluate(f"{CHOSEN}.hidden")
    assert focused(opened) == seen[-1]
    press(opened, "Tab")
    assert not focused(opened).startswith("#point-")  # one stop for the whole figure


def test_a_number_that_is_typed_gives_its_row_or_says_where_it_stands(opened: Tab) -> None:
    typed = (
        "(() => {{ const form = document.querySelector('form.choose');"
        "form.querySelector('input').value = '{}';"
        "form.requestSubmit(); return " + CHOSEN + ".innerText; }})()"
    )
    assert "mass" in opened.evaluate(typed.format("7"))
    assert "All rows stand in points.csv" in opened.evaluate(typed.format("4711"))
    assert "--deck-of 4711" in opened.evaluate(f"{CHOSEN}.innerText")


@pytest.mark.long_cases("320-light", "1280-dark")
@pytest.mark.parametrize(("width", "theme"), [(320, "light"), (390, "dark"), (1280, "dark")])
def test_the_page_is_no_wider_than_its_screen_also_with_a_row_open(
    tab: Tab, page: Path, width: int, theme: str
) -> None:
    tab.look(width, theme=theme)
    tab.open(page)
    tab.evaluate("document.querySelector('svg a').dispatchEvent(new MouseEvent('click', {bubbles: true}))")
    assert not tab.evaluate(f"{CHOSEN}.hidden")
    assert tab.evaluate(OUT_OF_SIGHT) == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


# Quicker: the printed page in test_report_in_a_browser.py
@pytest.mark.slow
def test_paper_has_the_figures_and_no_controls(opened: Tab) -> None:
    opened.evaluate("document.querySelector('svg a').dispatchEvent(new MouseEvent('click', {bubbles: true}))")
    opened.ask("Emulation.setEmulatedMedia", media="print")
    for gone in ("aside.chosen", "form.choose", "p.choose", "#theme"):
        assert opened.evaluate(f"getComputedStyle(document.querySelector('{gone}')).display") == "none"
    assert opened.evaluate("document.querySelector('figure svg').getBoundingClientRect().height") > 100
    assert opened.paper().startswith(b"%PDF")
