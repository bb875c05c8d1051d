"""The live page in a browser: by mouse, by keys alone, on a small screen, beside others, and under attack."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.browser import OUT_OF_SIGHT, Tab, browser, chromium
from tests.live_server import Server, running

pytest.importorskip("uvicorn")
pytest.importorskip("starlette")
pytest.importorskip("websockets")
pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")

STATE = "document.getElementById('state-name').textContent"
GOOD = ["quick answer", "checked answer", "checked, with remarks", "misses its target"]
ANSWERED = f"{GOOD}.includes({STATE}) && {STATE}"
POINT = "document.querySelectorAll('.point:not(.names)')[{0}].querySelectorAll('input')[1].value"
HANDLE = """(() => {{
  window.scrollTo(0, 0);
  const box = document.querySelectorAll('.handle')[{0}].querySelector('.knob').getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()"""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running() as one:
        yield one


@contextmanager
def answered(server: Server, **patience: float) -> Iterator[Tab]:
    """A browser whose first tab shows the page; what it asked for and wrote is kept."""
    with browser() as tab:
        tab.look(1400)
        tab.visit(server.address)
        tab.until(f"{ANSWERED} && !document.getElementById('gallery').disabled", **patience)
        yield tab


@pytest.fixture(scope="module")
def opened(server: Server) -> Iterator[Tab]:
    with answered(server) as tab:
        yield tab


@pytest.fixture
def tab(opened: Tab) -> Tab:
    opened.look(1400)
    opened.until(f"{ANSWERED} && !document.querySelector('#torque.stale')")
    return opened


def settled(tab: Tab, change: str, before: object) -> object:
    """Wait until something on the page is another than before."""
    return tab.until(
        f"(() => {{ const now = {change}; return now !== {before!r} && now; }})()".replace("None", "null")
    )


def resting(tab: Tab) -> None:
    """Wait until everything that was asked is answered and shown."""
    tab.until("document.body.dataset.busy === 'false'")
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")


def session_of(tab: Tab) -> str:
    return str(tab.evaluate("sessionStorage.getItem('session')"))


# --- what a designer does -------------------------------------------------------------------------


def test_the_page_shows_a_design_asks_nobody_else_and_says_nothing_on_the_console(
    tab: Tab, server: Server
) -> None:
    assert tab.evaluate("document.querySelectorAll('#panels .card:not([hidden]) path.line').length") >= 7
    assert tab.evaluate("document.querySelectorAll('.mechanism .cable').length") >= 1
    foreign = [
        each
        for each in tab.requests
        if not each.startswith((server.origin, server.origin.replace("http", "ws")))
    ]
    assert foreign == []
    assert tab.messages == []
    assert tab.evaluate("location.href") == f"{server.origin}/", "the token stays in the address"
    words = tab.evaluate("document.getElementById('angle-words').textContent")
    assert all(unit in words for unit in ("°", "N·m", "mm", "N·m/rad"))


# --- who does not see the page ---------------------------------------------------------------------

NAMED = {
    "button",
    "textbox",
    "slider",
    "combobox",
    "checkbox",
    "link",
    "image",
    "heading",
    "DisclosureTriangle",
}


def test_every_control_has_a_name_of_its_own_and_every_figure_its_numbers(tab: Tab) -> None:
    tab.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
    poles = "document.querySelector('#linear-row svg.chart:not(.empty)')?.getAttribute('aria-label')"
    tab.until(f"{poles}.includes('in 1/s')")
    found = tab.accessible()
    assert [each for each in found if each[0] in NAMED and not each[1].strip()] == []
    controls = [each for each in found if each[0] in NAMED - {"image", "heading", "link"}]
    assert len(controls) > 40
    assert {each for each in controls if controls.count(each) > 1} == set()
    assert ("textbox", "spring.rubber.rest_length in mm") in controls
    figures = [name for role, name in found if role == "image"]
    figures += [name for role, name in found if role == "group" and name.startswith("Torque")]
    assert len(figures) >= 10
    for name in figures:
        assert sum(each.isdigit() for each in name) >= 4, name
    (torque,) = [name for name in figures if name.startswith("Torque over angle")]
    assert "design from 0 N·m at 0° to 0.589 N·m at 60°" in torque
    tab.evaluate("for (const each of document.querySelectorAll('.more, .menu')) each.open = false")


# It waits for several whole designs.
@pytest.mark.slow
def test_a_drag_is_said_once_and_a_slide_by_its_slider_alone(tab: Tab) -> None:
    words = "document.getElementById('state-words').textContent"
    tab.until(f"!{STATE}.includes('quick') && !/^Quick|The check runs/.test({words})")
    tab.evaluate("new Promise((done) => setTimeout(done, 500))")
    tab.listen()
    x, y = tab.evaluate(HANDLE.format(3))
    tab.mouse("Pressed", x, y)
    for step in range(1, 13, 3):
        tab.mouse("Moved", x, y - step)
        resting(tab)
    assert tab.evaluate("window.heard") == [], "said while the hand moves"
    tab.mouse("Released", x, y - 12)
    tab.until("window.heard.length > 0")
    slide = "((e) => { e.value = e.max / 3; e.dispatchEvent(new Event('input')); })"
    tab.evaluate(f"{slide}(document.getElementById('angle'))")
    resting(tab)
    tab.evaluate("new Promise((done) => setTimeout(done, 500))")
    (heard,) = tab.evaluate("window.heard")
    assert heard.startswith(("checked", "misses its target"))
    tab.press("z", control=True)
    resting(tab)


CLASSES = """(() => {
  const titles = [...document.querySelectorAll("[title]")].map((each) => each.title);
  return [document.body.textContent, ...titles].join(" ").match(/M(ax|in)imum[A-Z]\\w*/g) ?? [];
})()"""


def test_a_contradiction_is_said_once_in_words_and_files_say_whose_they_are(tab: Tab) -> None:
    note = "document.getElementById('files-earlier')"
    assert tab.evaluate(f"{note}.hidden")
    fields = "[...document.querySelectorAll('#limits input[type=text]')]"
    field = f"{fields}.find((each) => each.ariaLabel.includes('stress'))"
    typed(tab, field, "0.002")
    tab.until(f"{STATE} === 'infeasible'")
    words = tab.evaluate("document.getElementById('state-words').textContent")
    assert words.count("contradict") + words.count("cannot be kept") == 1
    assert words.startswith("No design keeps all limits. Largest nominal stress of the rubber (0.002 MPa)")
    assert not tab.evaluate(f"{note}.hidden")
    assert "those of the last good design" in tab.evaluate(f"{note}.textContent")
    assert tab.evaluate(CLASSES) == []
    tab.press("z", control=True)
    tab.until(f"{note}.hidden && {ANSWERED}")


def test_a_point_follows_the_mouse_the_design_follows_the_point_and_both_go_back(tab: Tab) -> None:
    point = POINT.format(3)
    before, curve = (
        tab.evaluate(point),
        tab.evaluate("document.querySelector('#torque .line.blue').getAttribute('d')"),
    )
    x, y = tab.evaluate(HANDLE.format(3))
    tab.mouse("Pressed", x, y)
    for step in range(1, 13):
        tab.mouse("Moved", x, y - step)
    tab.mouse("Released", x, y - 12)
    resting(tab)
    after = settled(tab, point, before)
    assert float(str(after)) > float(before)
    settled(tab, "document.querySelector('#torque .line.blue').getAttribute('d')", curve)
    tab.until(ANSWERED)
    assert tab.evaluate("performance.getEntriesByName('drag to drawn').length") >= 1
    tab.evaluate("document.activeElement.blur()")
    tab.press("z", control=True)
    assert settled(tab, point, after) == before, "one drag is one step back"
    tab.press("z", control=True, shift=True)
    assert settled(tab, point, before) == after
    tab.press("z", control=True)
    settled(tab, point, after)


def test_a_finger_drags_a_point_and_the_slider(tab: Tab) -> None:
    point, at = POINT.format(2), "document.getElementById('linear-angle').textContent"
    before, angle = tab.evaluate(point), tab.evaluate(at)
    x, y = tab.evaluate(HANDLE.format(2))
    tab.evaluate(
        """document.querySelectorAll(".handle")[2].addEventListener(
          "pointermove", (event) => { window.pointer = event.pointerType; })"""
    )
    tab.touch((x, y), *((x, y - step) for step in range(2, 14, 2)))
    resting(tab)
    after = settled(tab, point, before)
    assert float(str(after)) > float(before)
    assert tab.evaluate("window.pointer") == "touch"
    box = tab.evaluate(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.getElementById('angle').getBoundingClientRect())"
    )
    middle = box[1] + box[3] / 2
    tab.touch(*((box[0] + share * box[2], middle) for share in (0.6, 0.5, 0.4, 0.3)))
    settled(tab, at, angle)
    assert tab.evaluate("(({value, max}) => value / max)(document.getElementById('angle'))") == pytest.approx(
        0.3, abs=0.04
    )
    tab.evaluate("document.activeElement.blur()")
    tab.press("z", control=True)
    assert settled(tab, point, after) == before, "a finger's drag is one step back"


def test_everything_is_reached_and_moved_by_keys_alone(tab: Tab) -> None:
    reached: list[str] = []
    tab.evaluate("document.querySelector('.skip').focus()")
    for _ in range(90):
        tab.press("Tab")
        reached.append(
            tab.evaluate("((e) => `${e.getAttribute('class') ?? ''}#${e.id}`)(document.activeElement)")
        )
        if reached[-1] == "#angle":
            break
    assert [each for each in reached if each.startswith("handle")], reached
    for name in ("#gallery", "#keep", "#material", "#tolerance-run", "#angle"):
        assert name in reached, name
    tab.evaluate("document.querySelectorAll('.handle')[2].focus()")
    assert tab.evaluate("getComputedStyle(document.activeElement.querySelector('.ring')).stroke") != "none"
    value = "document.querySelectorAll('.handle')[2].getAttribute('aria-valuetext')"
    before = tab.evaluate(value)
    tab.press("ArrowUp")
    fine = settled(tab, value, before)
    tab.press("ArrowUp", shift=True)
    coarse = settled(tab, value, fine)
    numbers = [
        float(str(each).split()[0]) * (1e-3 if " mN" in str(each) else 1.0) for each in (before, fine, coarse)
    ]
    assert numbers[2] - numbers[1] == pytest.approx(10.0 * (numbers[1] - numbers[0]), rel=0.1)
    said = "document.getElementById('said').textContent"
    tab.until(f"{said}.includes('rms error') && {said}.startsWith({str(coarse).split()[0]!r})")
    count = tab.evaluate("document.querySelectorAll('.handle').length")
    tab.press("Insert")
    tab.until(f"document.querySelectorAll('.handle').length === {count + 1}")
    tab.evaluate("document.querySelectorAll('.handle')[3].focus()")
    tab.press("Delete")
    tab.until(f"document.querySelectorAll('.handle').length === {count}")
    tab.evaluate("document.getElementById('angle').focus()")
    at = tab.evaluate("document.getElementById('linear-angle').textContent")
    tab.press("ArrowLeft")
    settled(tab, "document.getElementById('linear-angle').textContent", at)


def typed(tab: Tab, field: str, words: str) -> None:
    """Give a field words as a hand does that leaves it afterwards."""
    change = f"{field}.value = {words!r}; {field}.dispatchEvent(new Event('change'))"
    tab.evaluate(f"{field}.focus(); {change}; {field}.blur()")


def test_what_is_typed_is_one_step_each_and_what_is_no_number_is_answered_there(tab: Tab) -> None:
    field = POINT.format(2).removesuffix(".value")
    before = float(tab.evaluate(f"{field}.value"))
    wrong = "document.getElementById('points-wrong').textContent"
    for words in ("3 mm", "1e400", ""):
        typed(tab, field, words)
        assert tab.evaluate(wrong).startswith("Point 3: the torque is no number"), words
    numbers = [f"{before * factor:.5g}" for factor in (1.005, 1.01)]
    for number in numbers:
        typed(tab, field, number)
        resting(tab)
        tab.until(f"{field}.value === {number!r} && {ANSWERED}")
        assert tab.evaluate(wrong) == ""
    typed(tab, field, "-5")
    tab.until("document.getElementById('notice').textContent.startsWith('torque of point 3 = -5 N·m')")
    for number in (numbers[0], f"{before:.5g}"):
        tab.press("z", control=True)
        tab.until(f"Number({field}.value) === {float(number)}")
    resting(tab)


def test_what_belongs_to_another_angle_is_greyed_and_poles_are_read_as_numbers(tab: Tab) -> None:
    words = "document.querySelectorAll('#linear-row .job')[1].textContent"
    stale = "document.getElementById('linear').classList.contains('stale')"
    tab.until(f"!({stale}) && {words}.includes('i in 1/s')")
    before = tab.evaluate(words)
    # Far from where an earlier test has left it: the stiffness there is another.
    slide = """((e) => { e.value = 0.9 * e.max; e.dispatchEvent(new Event("input")); })"""
    assert tab.evaluate(f"({slide}(document.getElementById('angle')), {stale})"), "poles of another angle"
    tab.until(f"!({stale})")
    assert tab.evaluate(words) != before


@pytest.mark.parametrize("width", [390, 320])
def test_nothing_is_wider_than_a_small_screen_and_points_are_large_enough_to_touch(
    tab: Tab, width: int
) -> None:
    tab.look(width)
    tab.evaluate("document.getElementById('keep').click()")
    tab.until("document.querySelectorAll('#compare-table td').length > 10")
    tab.until("document.querySelector('#torque svg').getBoundingClientRect().width < 400")
    assert tab.evaluate(OUT_OF_SIGHT) == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    reach = tab.evaluate("document.querySelector('.handle:not(.fixed) .reach').getBoundingClientRect().width")
    assert reach >= 36.0


def test_a_number_that_is_none_is_answered_beside_its_field(tab: Tab) -> None:
    field = "document.querySelector('#limits input[type=text]')"
    before = tab.evaluate(f"{field}.value")
    tab.evaluate(f"{field}.focus(); {field}.value = 'a lot'; {field}.dispatchEvent(new Event('change'))")
    assert "no number" in tab.evaluate("document.querySelector('#limits .wrong').textContent")
    tab.evaluate(f"{field}.value = '-5'; {field}.dispatchEvent(new Event('change'))")
    tab.until("!document.getElementById('notice').hidden")
    assert "largest tension of a cable = -5 N" in tab.evaluate(
        "document.getElementById('notice').textContent"
    )
    tab.evaluate(f"{field}.value = {before!r}; {field}.dispatchEvent(new Event('change')); {field}.blur()")
    tab.until("document.getElementById('notice').hidden")


COUNT = """(() => {
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (words) {
    sessionStorage.setItem("asked", JSON.parse(words).number);
    return send.call(this, words);
  };
})()"""


def test_a_page_that_is_loaded_again_in_the_middle_comes_back_to_its_design(tab: Tab) -> None:
    session, point = session_of(tab), POINT.format(4)
    before = tab.evaluate(point)
    tab.evaluate(COUNT)
    x, y = tab.evaluate(HANDLE.format(4))
    tab.mouse("Pressed", x, y)
    tab.mouse("Moved", x, y - 9)
    tab.mouse("Released", x, y - 9)
    tab.happened.clear()
    tab.ask("Page.reload")
    tab.until("document.readyState === 'complete' && document.querySelectorAll('.point').length > 3")
    assert settled(tab, point, before)
    assert session_of(tab) == session
    tab.until(ANSWERED)
    asked = tab.evaluate("Number(sessionStorage.getItem('asked'))")
    tab.evaluate(COUNT)
    tab.press("z", control=True)
    tab.until(f"{point} === {before!r}")
    # Answers to the page before its reload must not count as later ones.
    assert tab.evaluate("Number(sessionStorage.getItem('asked'))") > asked > 0
    assert tab.messages == []


def test_an_address_that_is_pasted_into_the_open_page_is_taken(tab: Tab, server: Server) -> None:
    session = session_of(tab)
    tab.happened.clear()
    tab.evaluate(f"location.hash = '#token={server.token}'")
    tab.until("location.hash === '' && document.readyState === 'complete'")
    tab.until(f"{ANSWERED} && document.querySelectorAll('.point').length > 3")
    assert "Page.loadEventFired" in tab.happened
    assert session_of(tab) == session


def test_a_page_without_a_token_says_that_it_is_not_connected(tab: Tab, server: Server) -> None:
    stranger = tab.beside(another_person=True)
    stranger.visit(server.origin + "/")
    stranger.until("document.getElementById('connection').textContent.includes('token')")
    assert stranger.evaluate(STATE) == "not connected"


# --- others ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_another_tab_and_another_person_have_designs_of_their_own(tab: Tab, server: Server) -> None:
    point = POINT.format(2)
    before = tab.evaluate(point)
    for another_person in (False, True):
        other = tab.beside(another_person=another_person)
        other.look(1400)
        other.visit(server.address)
        other.until(ANSWERED)
        assert session_of(other) != session_of(tab)
        x, y = other.evaluate(HANDLE.format(2))
        other.mouse("Pressed", x, y)
        other.mouse("Moved", x, y - 8)
        other.mouse("Released", x, y - 8)
        settled(other, point, before)
        assert tab.evaluate(point) == before
        assert other.messages == []
    stranger = tab.beside(another_person=True)
    stranger.visit(server.origin + "/")
    stranger.until("document.getElementById('connection').textContent.includes('token')")
    assert stranger.evaluate("document.querySelectorAll('.point:not(.names)').length") == 0


HOSTILE = """
(async () => {{
  const origin = "{origin}", told = [];
  const socket = (protocols) => new Promise((done) => {{
    const one = new WebSocket(origin.replace("http", "ws") + "/api/design", protocols);
    one.onopen = () => done("open"); one.onerror = () => done("refused");
  }});
  told.push(await socket(["nlsdesign", "{token}"]), await socket(["nlsdesign", "x"]));
  for (const path of ["/api/open", "/api/records?name=a.csv", "/api/file/deck"])
    for (const headers of [{{}}, {{ Authorization: "Bearer {token}" }}])
      told.push(await fetch(origin + path, {{ method: "POST", headers, body: "x" }})
        .then(() => "answered", () => "refused"));
  told.push(await fetch(origin + "/", {{ mode: "no-cors" }})
    .then((answer) => (answer.type === "opaque" ? "refused" : "answered"), () => "refused"));
  told.push(await new Promise((done) => {{
    const script = document.createElement("script");
    script.type = "module"; script.src = origin + "/page/units.js";
    script.onload = () => done("loaded"); script.onerror = () => done("refused");
    document.head.append(script);
  }}));
  const frame = document.createElement("iframe");
  frame.src = origin + "/";
  document.body.append(frame);
  await new Promise((done) => {{ frame.onload = done; setTimeout(done, 3000); }});
  let inner = null;
  try {{ inner = frame.contentDocument; }} catch {{ /* of another origin */ }}
  told.push(inner === null ? "refused" : "framed");
  return told;
}})()"""


def test_a_hostile_page_drives_nothing_even_if_it_knew_the_token(
    opened: Tab, server: Server, tmp_path: Path
) -> None:
    (tmp_path / "index.html").write_text("<!doctype html><title>hostile</title><p>hostile</p>")
    quiet = type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None})
    elsewhere = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(quiet, directory=str(tmp_path))
    )
    threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
    try:
        other = opened.beside()
        other.visit(f"http://127.0.0.1:{elsewhere.server_address[1]}/")
        outcome = other.evaluate(HOSTILE.format(origin=server.origin, token=server.token))
        assert set(outcome) == {"refused"}, outcome
        assert len(outcome) == 11
    finally:
        elsewhere.shutdown()
        elsewhere.server_close()


ASK = """fetch("{path}", {{
  method: "POST", body: {body},
  headers: {{
    Authorization: "Bearer " + sessionStorage.getItem("token"),
    "X-Session": sessionStorage.getItem("session"),
  }},
}}).then(async (answer) => [answer.status, await answer.text()])"""


def test_hostile_names_stay_words(tab: Tab) -> None:
    name = "<img src=x onerror=window.hit=1>"
    text = f"[deck]\\nname = '{name}'\\n['{name}']\\ncomponent = '{name}'\\n"
    status, words = tab.evaluate(ASK.format(path="/api/open", body=f'"{text}"'))
    assert status == 422
    assert "onerror" in words
    tab.evaluate(
        f"""(() => {{
          const files = new DataTransfer(), input = document.getElementById("open");
          files.items.add(new File(["{text}"], "{name}.toml"));
          input.files = files.files;
          input.dispatchEvent(new Event("change"));
        }})()"""
    )
    tab.until("document.getElementById('notice').textContent.includes('onerror')")
    tab.evaluate(
        f"""(() => {{
          const files = new DataTransfer(), input = document.getElementById("records");
          files.items.add(new File(["time [s]\\n0\\n"], "{name}.csv"));
          input.files = files.files;
          input.dispatchEvent(new Event("change"));
        }})()"""
    )
    tab.until("document.getElementById('diagnosis-state').textContent.includes('onerror')")
    assert tab.evaluate("[document.querySelectorAll('img').length, window.hit ?? null]") == [0, None]


@pytest.mark.slow
def test_uploads_that_are_too_large_are_refused_in_words_and_the_page_lives_on(tab: Tab) -> None:
    status, words = tab.evaluate(ASK.format(path="/api/open", body='"x".repeat(1100000)'))
    assert status == 413
    assert "1 MiB" in words
    status, words = tab.evaluate(ASK.format(path="/api/records?name=run.exe", body='"x"'))
    assert status == 422
    assert ".csv" in words
    assert tab.evaluate(ANSWERED)
