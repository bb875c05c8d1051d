"""The live page in a headless Chromium: first paint after the start, and the time from mouse to picture.

``python -m benchmarks.live_page``. A hand is imitated by some hundred moves of the mouse, sixty a second, on
several points; for each of them the time is taken until an answer at least as new as it has been painted.
Moves that a newer one has overtaken count with the answer to the newer one, as they do for whoever looks.
What the design itself took of it stands beside. Needs Chromium and the extra ``live``.
"""

from __future__ import annotations

import argparse
import math
import os
import time

import numpy as np

from tests.browser import Tab, browser
from tests.live_server import running

DECKS = ("cam-actuator", "test_rig", "one-sided-finger")
HANDLE = """(() => {{
  window.scrollTo(0, 0);
  const box = document.querySelectorAll('.handle')[{0}].querySelector('.knob').getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()"""
SHOWN = "document.querySelector('#torque .line.blue') && !document.getElementById('gallery').disabled"


def painted(tab: Tab) -> float:
    """Return when something was first painted, in seconds of the epoch."""
    paint = "performance.getEntriesByName('first-contentful-paint')[0]"
    tab.until(f"{paint} !== undefined")
    return 1e-3 * float(tab.evaluate(f"performance.timeOrigin + {paint}.startTime"))


def dragged(tab: Tab, point: int, moves: int, *, pause: float) -> None:
    """Move a point up and down in small steps, as a hand does."""
    x, y = tab.evaluate(HANDLE.format(point))
    tab.mouse("Pressed", x, y)
    for k in range(moves):
        tab.mouse("Moved", x + 3.0 * math.sin(0.21 * k), y - 12.0 * math.sin(0.09 * k))
        time.sleep(pause)
    tab.mouse("Released", x, y)
    tab.until("document.body.dataset.busy === 'false'", seconds=120.0)
    time.sleep(0.3)


def measured(deck: str, moves: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the first paint after the start in s, the whole time of each move, and that of each design."""
    with browser() as tab:
        began = time.time()
        with running(deck) as server:
            tab.look(1400, height=900)
            tab.visit(server.address)
            first = painted(tab) - began
            tab.until(SHOWN, seconds=120.0)
            time.sleep(2.0)
            tab.evaluate("performance.clearMeasures()")
            for point in (2, 3, 4):
                dragged(tab, point, moves // 3, pause=1.0 / 60.0)
            entries = "performance.getEntriesByName('{0}').map((each) => each.duration)"
            whole, computed = (
                np.array(tab.evaluate(entries.format(name)), dtype=float)
                for name in ("drag to drawn", "computed")
            )
    return first, whole, computed


def _row(name: str, values: np.ndarray) -> str:
    middle, most = np.quantile(values, [0.5, 0.95])
    return f"{name:<28} {len(values):>7} {middle:>11.0f} {most:>9.0f} {values.max():>9.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=300, help="of the mouse, for each deck")
    parser.add_argument("decks", nargs="*", default=DECKS)
    given = parser.parse_args()
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    print(f"live page, {os.cpu_count()} cores, load before {load}; times in ms")
    print(f"{'':<28} {'number':>7} {'median':>11} {'95 %':>9} {'worst':>9}")
    for deck in given.decks:
        first, whole, computed = measured(deck, given.moves)
        print(f"{deck}: first paint {first:.2f} s after the start of the command")
        print(_row("  from mouse to picture", whole))
        print(_row("  of that the design", computed))


if __name__ == "__main__":
    main()
