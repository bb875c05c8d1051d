"""A headless Chromium without any library: its debugging protocol over two pipes.

Pages are looked at as a reader has them: at a width, in a theme, on paper. Requests and messages of the
console are collected.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def chromium() -> str | None:
    """Return the program, or nothing where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


OUT_OF_SIGHT = """(() => {
  const width = screen.width, frames = new Set();
  const beyond = [...document.querySelectorAll('body *')].filter((each) => {
    const box = each.getBoundingClientRect();
    if (box.right <= width + 1 || !box.height || each.closest('.skip, aside.toc-drawer')) return false;
    for (let around = each.parentElement; around && around !== document.body; around = around.parentElement)
      if (['auto', 'scroll', 'hidden'].includes(getComputedStyle(around).overflowX)) {
        frames.add(around);
        return false;
      }
    return true;
  });
  const lost = [...document.querySelectorAll('table')].filter((table) => {
    const frame = [...frames].find((each) => each.contains(table)), first = table.querySelector('td, th');
    if (!frame || !first) return false;
    frame.scrollTo({ left: frame.scrollWidth, behavior: 'instant' });
    const [outer, inner] = [frame, first].map((each) => each.getBoundingClientRect());
    frame.scrollTo({ left: 0, behavior: 'instant' });
    return inner.left < outer.left - 1 || inner.right > outer.right - 0.3 * outer.width;
  });
  return [...beyond, ...lost].map((e) => `${e.tagName} ${e.className} ${(e.textContent || '').slice(0, 40)}`);
})()"""
"""What reaches beyond the screen and cannot be moved into sight, and tables whose first column leaves
the sight when they are moved, or leaves less than a third of it to the others."""


class NavigatedError(Exception):
    """The page was left while it was asked."""


@dataclass
class Tab:
    """One page of a browser.

    Parameters
    ----------
    commands, answers
        Pipes to and from the browser; messages end with a null byte.
    tabs
        All tabs of the browser by their session.
    context
        The profile that it belongs to, that of the browser where it is empty.
    """

    commands: IO[bytes]
    answers: IO[bytes]
    tabs: dict[str, Tab] = field(default_factory=dict)
    context: str = ""
    session: str = ""
    requests: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    happened: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        # No number is used by two tabs, since they read answers from one pipe.
        self._numbers = itertools.count(1 + 10_000_000 * len(self.tabs))
        profile = {"browserContextId": self.context} if self.context else {}
        target = self.ask("Target.createTarget", url="about:blank", **profile)["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.tabs[self.session] = self
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, /, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        # Profiles are made by the browser itself, not by a tab.
        if self.session and method != "Target.createBrowserContext":
            message["sessionId"] = self.session
        self.commands.write(json.dumps(message).encode() + b"\0")
        self.commands.flush()
        while True:
            answer = self._next()
            if answer.get("id") == number:
                if "navigated" in answer.get("error", {}).get("message", ""):
                    raise NavigatedError(method)
                assert "error" not in answer, f"{method}: {answer['error']}"
                return dict(answer["result"])

    def beside(self, *, another_person: bool = False) -> Tab:
        """Open another tab, in a profile of its own for another person."""
        context = str(self.ask("Target.createBrowserContext")["browserContextId"]) if another_person else ""
        return Tab(self.commands, self.answers, self.tabs, context or self.context)

    def open(self, path: Path) -> None:
        """Load a file and wait for it."""
        self.visit(path.absolute().as_uri())

    def visit(self, address: str) -> None:
        """Load a page and wait for it."""
        self.requests.clear()
        self.messages.clear()
        self.happened.clear()
        self.ask("Page.navigate", url=address)
        while "Page.loadEventFired" not in self.happened:
            self._next()
        self.evaluate("document.fonts.ready.then(() => 1)")

    def look(self, width: int, *, height: int = 800, theme: str = "light") -> None:
        """Show the page on a screen of a width in CSS pixels."""
        self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
            screenWidth=width, screenHeight=height,
            mobile=width < 600,
        )  # fmt: skip
        wanted = [{"name": "prefers-color-scheme", "value": theme}]
        self.ask("Emulation.setEmulatedMedia", media="screen", features=wanted)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, expression: str, *, seconds: float = 30.0) -> Any:
        """Return the value of an expression once it is true."""
        last = time.monotonic() + seconds
        while True:
            try:
                if value := self.evaluate(expression):
                    return value
            except NavigatedError:
                pass  # the next page is asked
            assert time.monotonic() < last, f"never came true: {expression}"
            time.sleep(0.02)

    def accessible(self) -> list[tuple[str, str]]:
        """Return role and name of all that a screen reader is given."""
        self.ask("Accessibility.enable")
        nodes = self.ask("Accessibility.getFullAXTree")["nodes"]
        kept = [each for each in nodes if not each["ignored"] and "role" in each]
        return [(each["role"]["value"], each.get("name", {}).get("value", "")) for each in kept]

    def listen(self) -> None:
        """Keep in ``window.heard`` what a screen reader says from now on by itself."""
        self.evaluate(
            """(() => {
              window.heard = [];
              const said = "[aria-live]:not([aria-live=off]), [role=status], [role=alert], output";
              for (const place of document.querySelectorAll(said)) new MutationObserver(() => {
                const words = place.textContent;
                if (words && words !== window.heard.at(-1)) window.heard.push(words);
              }).observe(place, { childList: true, characterData: true, subtree: true });
            })()"""
        )

    def press(self, key: str, *, shift: bool = False, control: bool = False) -> None:
        """Press a key and let it go."""
        codes = {"Tab": 9, "Delete": 46, "Insert": 45, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39,
                 "ArrowDown": 40, "Enter": 13, "z": 90}  # fmt: skip
        given = {"key": key, "code": key, "windowsVirtualKeyCode": codes[key],
                 "modifiers": 8 * shift + 2 * control}  # fmt: skip
        self.ask("Input.dispatchKeyEvent", type="rawKeyDown", **given)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **given)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the left button at a place in CSS pixels."""
        self.ask(
            "Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left", buttons=1, clickCount=1
        )

    def touch(self, *places: tuple[float, float]) -> None:
        """Put a finger at the first place, lead it over the others and lift it."""
        self.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=1)
        for number, (x, y) in enumerate(places):
            kind = "touchMove" if number else "touchStart"
            self.ask("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y}])
        self.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        self.ask("Emulation.setTouchEmulationEnabled", enabled=False)

    def choose(self, name: str, *files: Path) -> None:
        """Choose files in the field of an id, as the dialog of the system would."""
        expression = f"document.getElementById({name!r})"
        field = self.ask("Runtime.evaluate", expression=expression)["result"]["objectId"]
        self.ask("DOM.setFileInputFiles", objectId=field, files=[str(each) for each in files])

    def downloads_to(self, folder: Path) -> None:
        """Let what is saved appear in a folder."""
        self.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def picture(self, path: Path) -> Path:
        """Write the whole page as PNG."""
        data = self.ask("Page.captureScreenshot", captureBeyondViewport=True)["data"]
        path.write_bytes(base64.b64decode(data))
        return path

    def paper(self) -> bytes:
        """Return the page as PDF, on A4."""
        options = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": True}
        self.ask("Emulation.setEmulatedMedia", media="")
        return base64.b64decode(self.ask("Page.printToPDF", printBackground=True, **options)["data"])

    def _next(self) -> dict[str, Any]:
        text = bytearray()
        while (letter := self.answers.read(1)) != b"\0":
            assert letter, "the browser has ended"
            text += letter
        answer: dict[str, Any] = json.loads(text)
        return self.tabs.get(answer.get("sessionId", ""), self)._noted(answer)

    def _noted(self, answer: dict[str, Any]) -> dict[str, Any]:
        """Keep what an event says."""
        method, given = answer.get("method", ""), answer.get("params", {})
        self.happened.append(method)
        if method == "Network.requestWillBeSent":
            self.requests.append(given["request"]["url"])
        elif method == "Runtime.consoleAPICalled":
            self.messages.append(" ".join(str(each.get("value")) for each in given["args"]))
        elif method == "Runtime.exceptionThrown":
            self.messages.append(str(given["exceptionDetails"]))
        elif method == "Log.entryAdded":
            self.messages.append(given["entry"]["text"])
        return answer


# The browser listens at 3 and answers at 4. Which numbers are free here changes while other threads, and
# the collection of what was forgotten, close files: a helper that has nothing else open puts the ends there.
_PLACE = """
import os, sys
ends = [int(each) for each in sys.argv[1:3]]
for end, number in zip(ends, (3, 4)):
    os.dup2(end, number)
for end in ends:
    os.close(end)
os.execv(sys.argv[3], sys.argv[3:])
"""


@contextmanager
def browser() -> Iterator[Tab]:
    """Start a browser with an empty profile; it has ended on leaving.

    Where this process is killed, the browser ends with the pipes.
    """
    program = chromium()
    assert program is not None
    with contextlib.ExitStack() as left:
        profile = left.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        options = [
            "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe",
            "--disable-dev-shm-usage", "--disable-background-networking", "--no-first-run",
            f"--user-data-dir={profile}",
        ]  # fmt: skip
        started, commands, answers = _started([program, *options])
        left.callback(answers.close)
        left.callback(_closed, commands)
        left.callback(_ended, started)
        yield Tab(commands, answers, {})


def _started(words: list[str]) -> tuple[subprocess.Popen[bytes], IO[bytes], IO[bytes]]:
    """Start a browser and return it with our ends of its two pipes."""
    command_end, our_commands = os.pipe()
    our_answers, answer_end = os.pipe()
    # Far above 3 and 4, so that the helper can put one there before it has read the other.
    ends = [fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, 64) for each in (command_end, answer_end)]
    try:
        helper = [sys.executable, "-I", "-S", "-c", _PLACE, *map(str, ends)]
        started = subprocess.Popen(
            [*helper, *words], pass_fds=ends, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    except BaseException:
        os.close(our_commands)
        os.close(our_answers)
        raise
    finally:
        for end in (*ends, command_end, answer_end):
            os.close(end)
    return started, os.fdopen(our_commands, "wb"), os.fdopen(our_answers, "rb", 1 << 20)


def _closed(commands: IO[bytes]) -> None:
    with contextlib.suppress(BrokenPipeError):  # it has ended before it read everything
        commands.close()


def _ended(started: subprocess.Popen[bytes]) -> None:
    started.terminate()
    try:
        started.wait(20)
    except subprocess.TimeoutExpired:
        started.kill()
        started.wait(20)
