"""What a new user waits for, and what lies on the disk: ``python -m benchmarks.first_minute``.

Writes the tables of ``docs/install.md`` anew. Times of commands are of the processor, the median of several
calls, beside that of an interpreter that loads nothing. ``--install`` also makes an environment of its own,
installs the checkout without extras and with ``[export]``, and weighs both; it needs a package index.
``--study`` clones what is committed and runs ``make study`` there from nothing, then ``--fast`` once more.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.targets import replaced

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "install.md"
DECK = "austin2015_figure_consistent"
COMMANDS = (
    ("--help",), ("study", "list"), ("deck", "list"), ("parts",), ("materials",), ("deck", "check", DECK),
)  # fmt: skip


def processor_time(arguments: list[str], calls: int) -> float:
    """Return the median over calls of the processor time of a process and its children, in s."""
    times = []
    for _ in range(calls):
        before = os.times()
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True, cwd=ROOT)
        after = os.times()
        spent = after.children_user - before.children_user + after.children_system - before.children_system
        times.append(spent)
    return statistics.median(times)


def start_up(calls: int) -> list[str]:
    """Return the rows of the table of commands."""
    rows = ["| command | processor, s |", "| --- | ---: |"]
    rows.append(f"| *an interpreter that loads nothing* | {processor_time(['-c', ''], calls):.2f} |")
    for words in COMMANDS:
        spent = processor_time(["-m", "nlsdesign", *words], calls)
        rows.append(f"| `nlsdesign {' '.join(words)}` | {spent:.2f} |")
    return rows


def installed(*words: str) -> str:
    """Return the row of an installation into an environment of its own: clock and disk."""
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        python = next(p for p in Path(folder).glob("*/python*") if p.stem == "python")
        empty = _size(Path(folder))
        subprocess.run([python, "-m", "pip", "install", "--quiet", *words], check=True, cwd=ROOT)
        seconds = time.perf_counter() - begun
        size = _size(Path(folder)) - empty
    return f"| `pip install {' '.join(words)}` | {seconds:.0f} | {size / 1e6:.0f} |"


def studied() -> list[str]:
    """Return the rows of ``make study`` in a new clone: clock until each report stands, and processor."""
    rows = ["| command | first report, s | whole, s | processor, s | processes waiting |"]
    rows.append("| --- | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["git", "clone", "--quiet", ROOT, folder], check=True)
        fast = [".venv/bin/nlsdesign", "study", "run", "austin2015", "--fast", "--out", "out/fast"]
        for name, words, first in (
            ("make study", ["make", "study"], "out/hello/report.html"),
            ("nlsdesign study run austin2015 --fast", fast, "out/fast/report.html"),
        ):
            begun, before = time.perf_counter(), os.times()
            running = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL)
            seen, waiting = 0.0, []
            while running.poll() is None:
                time.sleep(0.5)
                waiting.append(os.getloadavg()[0])
                if not seen and Path(folder, first).exists():
                    seen = time.perf_counter() - begun
            whole, after = time.perf_counter() - begun, os.times()
            if running.returncode:
                raise subprocess.CalledProcessError(running.returncode, words)
            spent = (
                after.children_user + after.children_system - before.children_user - before.children_system
            )
            load = statistics.mean(waiting)
            rows.append(f"| `{name}` | {seen or whole:.0f} | {whole:.0f} | {spent:.0f} | {load:.1f} |")
    return rows


def _size(folder: Path) -> int:
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file())


def main() -> None:
    """Measure and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.first_minute", description=__doc__)
    parser.add_argument("--calls", type=int, default=5, help="of each command")
    parser.add_argument("--install", action="store_true", help="install into new environments too")
    parser.add_argument("--study", action="store_true", help="run make study in a new clone too")
    given = parser.parse_args()
    tables = {"start-up": start_up(given.calls)}
    if given.study:
        tables["study"] = studied()
    if given.install:
        rows = ["| installation | clock, s | disk without pip itself, MB |", "| --- | ---: | ---: |"]
        tables["sizes"] = [
            *rows,
            installed("."),
            installed(".[export]"),
            installed("-r", "requirements/study.txt"),
        ]
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf8"), tables), encoding="utf8")


if __name__ == "__main__":
    main()
