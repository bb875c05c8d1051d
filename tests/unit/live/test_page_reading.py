"""What the live page shows is read at a glance: a bar that keeps its place, round numbers, reasons once."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from nlsdesign.live.gallery import gallery_cards
from tests.browser import Tab, browser, chromium
from tests.live_server import running
from tests.unit.live.test_page_in_a_browser import ANSWERED

pytest.importorskip("uvicorn")
pytest.importorskip("starlette")
pytest.importorskip("websockets")
# Quicker: test_page_in_a_browser.py drives the same page; a second server and browser take ten seconds.
pytestmark = [pytest.mark.slow, pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")]


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with running() as server, browser() as one:
        one.look(1400, height=950)
        one.visit(server.address)
        one.until(f"{ANSWERED} && !document.getElementById('gallery').disabled", seconds=180)
        yield one


WORDS = "document.getElementById('state-words')"
PLACES = """(() => ["state", "desk"].map((name) => {
  const box = document.getElementById(name).getBoundingClientRect();
  return [box.top, box.height].map(Math.round)[name === "state" ? 1 : 0];
}))()"""
LONG = "' No limit binds, and the check runs.'.repeat(30)"
CHECKED = "document.getElementById('state-name').textContent.startsWith('checked')"
RESTED = "new Promise((done) => setTimeout(done, 300))"


@pytest.mark.parametrize("width", [1400, 390])
def test_the_status_has_one_height_and_what_is_cut_is_there_whole(tab: Tab, width: int) -> None:
    tab.look(width, height=850)
    # While the check runs, its news would replace the words of the test.
    tab.until(CHECKED, seconds=120)
    tab.until(f"{ANSWERED} && document.body.dataset.busy === 'false'")
    before = tab.evaluate(WORDS + ".textContent")
    seen = []
    for words in ("'Short.'", LONG):
        tab.evaluate(f"{WORDS}.textContent = {words}; dispatchEvent(new Event('resize')); {RESTED}")
        seen.append((tab.evaluate(PLACES), tab.evaluate(WORDS + ".title"), tab.evaluate(WORDS + ".tabIndex")))
    tab.evaluate(f"{WORDS}.textContent = {before!r}")
    (short, no_title, unreached), (long, title, reached) = seen
    assert short == long, "the page moves with the length of the status"
    assert (no_title, unreached) == ("", -1)
    assert (title, reached) == (tab.evaluate(LONG), 0)


def test_words_that_are_cut_are_shown_whole_over_the_page(tab: Tab) -> None:
    tab.look(390, height=850)
    tab.evaluate(f"{WORDS}.textContent = {LONG}; dispatchEvent(new Event('resize')); {RESTED}")
    closed = tab.evaluate(PLACES)
    tab.evaluate(f"{WORDS}.focus()")
    assert tab.evaluate(f"{WORDS}.scrollHeight <= {WORDS}.clientHeight + 1")
    assert tab.evaluate(PLACES) == closed
    tab.evaluate(f"{WORDS}.blur()")


def test_poles_stand_on_a_scale_of_powers_on_both_sides_of_zero(tab: Tab) -> None:
    tab.look(1400, height=950)
    chart = "document.querySelector('#linear-row svg.chart:not(.empty)')"
    tab.until(f"{chart}?.getAttribute('aria-label')?.includes('in 1/s')")
    labels = tab.evaluate(f"[...{chart}.querySelectorAll('text:not(.axis)')].map((each) => each.textContent)")
    assert {"0", "10⁰", "10¹", "−10⁰", "−10¹"} <= set(labels)
    assert [each for each in labels if not re.fullmatch("0|−?10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", each)] == []
    assert tab.evaluate(f"{chart}.querySelectorAll('.minor').length") >= 16, "no fine lines between powers"


POWERS = """import("/page/chart.js").then(({{ powers }}) => {{
  const folded = (v) => Math.sign(v) * Math.log10(1 + Math.abs(v));
  return powers([{0}, {1}], (v) => {2} * ({3}), {4});
}})"""


@pytest.mark.parametrize(
    ("low", "high", "scale", "place", "expected"),
    [
        (0.1, 1000.0, 60.0, "Math.log10(v)", [0.1, 1, 10, 100, 1000]),
        (0.1, 1000.0, 20.0, "Math.log10(v)", [0.1, 10, 1000]),
        (-12.0, 12.0, 70.0, "folded(v)", [0, 1, 10, -1, -10]),
        (-12000.0, 12.0, 20.0, "folded(v)", [0, 10, -10, -100, -1000, -10000]),
    ],
)
def test_powers_are_as_far_apart_as_their_labels(
    tab: Tab, low: float, high: float, scale: float, place: str, expected: list[float]
) -> None:
    room = 28 if low > 0 else 15
    found = tab.evaluate(POWERS.format(low, high, scale, place, room))
    assert found == pytest.approx(expected)


def test_numbers_have_three_digits_and_a_unit_that_suits_them(tab: Tab) -> None:
    shown = "import('/page/units.js').then(({{ withUnit }}) => withUnit({0}, {1!r}))"
    for value, unit, words in (
        (2.03112e-5, "N*m", "20.3 µN·m"),
        (0.0123456, "N*m", "12.3 mN·m"),
        (0.284213, "N*m", "0.284 N·m"),
        (0.00303512, "m", "3.04 mm"),
    ):
        assert tab.evaluate(shown.format(value, unit)) == words
    now = tab.evaluate("[...document.querySelectorAll('.now, #numbers dd')].map((each) => each.textContent)")
    now += tab.evaluate(
        "[...document.querySelectorAll('#limits input[type=text]')].map((each) => each.value)"
    )
    numbers = [one for words in now for one in re.findall(r"\d+(?:\.\d+)?", words)]
    assert len(numbers) > 12
    assert [one for one in numbers if len(one.replace(".", "").lstrip("0")) > 3] == []


def test_points_of_the_first_target_stand_at_round_angles(tab: Tab) -> None:
    angles = tab.evaluate(
        "[...document.querySelectorAll('.point:not(.names):not(.scale)')]"
        ".map((each) => each.querySelector('input').value)"
    )
    assert angles == ["0", "12", "24", "36", "48", "60"]


def test_the_list_says_once_why_some_decks_are_not_opened(tab: Tab) -> None:
    names = {card.name for card in gallery_cards()}
    options = tab.evaluate(
        "[...document.querySelectorAll('#gallery option')].map((each) => each.textContent)"
    )
    assert names == set(options[1:])
    closed = {
        reason: {card.name for card in gallery_cards() if card.reason == reason}
        for reason in (
            "no cam spring, whose curve is designed here",
            "has a roller, which the live page does not design yet",
            "has two contours, and a target is for one",
        )
    }
    assert sum(map(len, closed.values())) == sum(bool(card.reason) for card in gallery_cards()) >= 8
    groups = tab.evaluate(
        "[...document.querySelectorAll('#gallery optgroup')].map((each) => "
        "[each.label, [...each.children].filter((one) => one.disabled).map((one) => one.value)])"
    )
    said = [(label, set(disabled)) for label, disabled in groups if disabled]
    assert sorted(said) == sorted((f"cannot be opened: {reason}", names) for reason, names in closed.items())


LIGHTS = "[...document.querySelectorAll('#lights li')].map((each) => [each.className, each.textContent])"
CHOOSE = """(() => {{
  const select = document.querySelectorAll('.task select')[{0}];
  select.value = {1!r};
  select.dispatchEvent(new Event('change'));
}})()"""
CELLS = "(row) => [...row.children].map((cell) => cell.textContent)"
PAID = f"[...document.querySelectorAll('.paid tbody tr')].map({CELLS})"
TYPED = """(() => {{
  const field = document.querySelector('[aria-label^="{0}"]');
  field.value = {1!r};
  field.dispatchEvent(new Event('change'));
}})()"""


@pytest.mark.parametrize("width", [1400, 390])
def test_one_light_of_three_questions_stands_at_one_place_before_the_check_and_after(
    tab: Tab, width: int
) -> None:
    tab.look(width, height=850)
    tab.until(CHECKED, seconds=120)
    tab.until(f"{LIGHTS}.every((each) => each[0] === 'yes')")
    place = "['top', 'height'].map((side) => document.getElementById('lights').getBoundingClientRect()[side])"
    checked = tab.evaluate(place)
    assert [words for _, words in tab.evaluate(LIGHTS)] == ["✓can be made", "✓will hold", "✓will be known"]
    assert tab.evaluate("document.getElementById('lights').classList.contains('yes')")
    assert "bench" in tab.evaluate("document.getElementById('reasons').textContent")
    before = tab.evaluate("document.querySelectorAll('.point:not(.names):not(.scale) input')[3].value")
    tab.evaluate(TYPED.format("Point 2: torque", "0.079"))
    tab.until(f"{LIGHTS}.every((each) => each[0] === 'open')")
    assert tab.evaluate("document.getElementById('lights').classList.contains('open')")
    assert tab.evaluate(place) == checked
    cut = "[...document.querySelectorAll('#lights li')].some((each) => each.scrollWidth > each.clientWidth)"
    assert not tab.evaluate(cut)
    tab.evaluate(TYPED.format("Point 2: torque", before))
    tab.until(CHECKED, seconds=120)


def test_a_joint_is_chosen_and_what_the_motor_pays_stands_beside_the_curve(tab: Tab) -> None:
    tab.look(1400, height=850)
    assert tab.evaluate("document.querySelector('.paid').parentElement.hidden")
    tab.evaluate(CHOOSE.format(0, "ankle"))
    tab.until(f"{PAID}.length === 5", seconds=60)
    assert all(row[1] == "–" for row in tab.evaluate(PAID) if len(row) == 4)
    assert "no resistance" in tab.evaluate(
        "document.querySelector('#task .row > :last-child .job').textContent"
    )
    tab.evaluate(TYPED.format("Motor: winding resistance", "0,3"))
    tab.until(f"{PAID}.some((row) => Number(row[1]) > 0)", seconds=60)
    tab.evaluate(
        "[...document.querySelectorAll('#task button')].find((b) => b.textContent.startsWith('Take')).click()"
    )
    tab.until("document.querySelectorAll('.point:not(.names):not(.scale)').length > 7", seconds=60)
    tab.until(f"{PAID}.at(-1).length === 4 && Number({PAID}.at(-1)[1]) > 0", seconds=60)
    rows = {name: [float(each) for each in numbers] for name, *numbers in tab.evaluate(PAID)}
    assert rows["least heat"][0] <= rows["this design"][0] < rows["no spring"][0]
    assert "least heat for the task" in tab.evaluate("document.querySelector('#torque .key').textContent")
    tab.evaluate(TYPED.format("Task 1: assistance", "much"))
    assert "no number" in tab.evaluate("document.querySelector('#task .wrong').textContent")
    tab.evaluate(CHOOSE.format(1, "knee"))
    tab.until("document.querySelectorAll('.task').length === 3", seconds=60)
    tab.look(390, height=850)
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    tab.look(1400, height=850)
    for _ in range(2):
        tab.evaluate("document.querySelector('.task button').click()")
        tab.until("document.body.dataset.busy === 'false'")
    tab.until("document.querySelectorAll('.task').length === 1")
    assert tab.evaluate("document.querySelector('.paid').parentElement.hidden")
