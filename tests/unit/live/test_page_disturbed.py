"""The live page where no answer comes: limits in conflict, a session that has ended, a new server."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser import Tab, browser, chromium
from tests.live_server import processes_of, running
from tests.unit.live.test_page_in_a_browser import ANSWERED, HANDLE, STATE, resting, typed

pytest.importorskip("uvicorn")
pytest.importorskip("starlette")
pytest.importorskip("websockets")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]

OPACITY = "getComputedStyle(document.querySelector({0!r})).opacity"
NOTICE = "document.getElementById('notice').textContent"
FIELD = "document.getElementById({0!r})"


@pytest.fixture
def tab() -> Iterator[Tab]:
    with browser() as one:
        one.look(1400)
        yield one


def test_what_is_of_an_earlier_question_is_greyed_and_named_when_it_is_saved(tab: Tab) -> None:
    with running() as server:
        tab.visit(server.address)
        tab.until(ANSWERED)
        typed(tab, FIELD.format("limit-1-field"), "20")
        resting(tab)
        tab.evaluate("document.getElementById('size-1-free').click()")
        resting(tab)
        typed(tab, FIELD.format("size-1-field"), "45")
        tab.until(f"{STATE} === 'infeasible' && document.body.dataset.busy === 'false'")
        for place in ("#angle-words", "#limits .margin", "#panels .margin-row svg"):
            assert float(tab.evaluate(OPACITY.format(place))) < 0.5, place
        tab.evaluate("document.querySelector('[data-file=deck]').click()")
        tab.until(f"{NOTICE}.includes('the last good design, of an earlier question')")
        tab.evaluate("document.getElementById('undo').click()")
        tab.until(ANSWERED)
        for place in ("#angle-words", "#limits .margin", "#panels .margin-row svg"):
            tab.until(f"Number({OPACITY.format(place)}) === 1")


def test_a_page_whose_session_has_ended_never_says_computing_or_checked(tab: Tab) -> None:
    if not Path("/proc/self/stat").exists():
        pytest.skip("processes are found in /proc")
    with running() as server:
        before = processes_of(server.process.pid)
        tab.visit(server.address)
        tab.until(ANSWERED)
        sessions = [each for each in processes_of(server.process.pid) - before if _works(each)]
        assert sessions
        for each in sessions:
            os.kill(each, signal.SIGKILL)
        tab.until("document.getElementById('connection').textContent.includes('session has ended')")
        x, y = tab.evaluate(HANDLE.format(3))
        tab.mouse("Pressed", x, y)
        tab.mouse("Moved", x, y + 40)
        tab.mouse("Released", x, y + 40)
        tab.evaluate("new Promise((done) => setTimeout(done, 400))")
        assert tab.evaluate(STATE) == "not connected"
        tab.evaluate("document.querySelector('[data-file=deck]').click()")
        tab.until(f"{NOTICE}.includes('load the page again')")
        tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert tab.evaluate(STATE) == "not connected"
        assert tab.evaluate("document.getElementById('torque').classList.contains('stale')")


def test_the_address_of_a_new_server_is_taken_in_the_tab_of_the_old_one(tab: Tab) -> None:
    with running() as server:
        tab.visit(server.address)
        tab.until(ANSWERED)
        port = server.port
        server.end()
    tab.until("document.getElementById('connection').textContent.includes('was started anew')")
    assert tab.evaluate(STATE) == "not connected"
    with running("--port", str(port)) as server:
        # Nothing but what stands behind the # is new, so a browser loads nothing by itself.
        tab.ask("Page.navigate", url=server.address)
        tab.until(f"sessionStorage.getItem('token') === {server.token!r} && {ANSWERED}")


def _works(process: int) -> bool:
    return b"session_work" in Path(f"/proc/{process}/cmdline").read_bytes()
