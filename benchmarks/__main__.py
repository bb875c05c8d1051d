"""Run all benchmarks and write ``docs/benchmarks.md``: ``python -m benchmarks [NAME ...]``.

Each runs in a process of its own. What was measured is kept in a folder, so a run that is interrupted goes on
where it stopped; a result of other code or of another machine is measured again, and so is all with --again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchmarks import _page, _suite

ROOT = Path(__file__).resolve().parent.parent
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Return how many benchmarks failed, missed their goal, or broke a promise; 130 if interrupted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=", ".join(each.name for each in _suite.SUITE)
    )
    parser.add_argument("--again", action="store_true", help="measure also what has a result")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds of the clock for each")
    parser.add_argument("--results", type=Path, default=ROOT / "out" / "benchmarks", help="folder")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "benchmarks.md", help="file to write")
    given = parser.parse_args(arguments)
    known = {each.name: each for each in _suite.SUITE}
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"no benchmark '{unknown[0]}'; there are {', '.join(known)}")
    given.results.mkdir(parents=True, exist_ok=True)
    failed = 0
    try:
        for each in [known[name] for name in given.names] or _suite.SUITE:
            failed += not measured(each, given.results, again=given.again, limit=given.limit)
    except KeyboardInterrupt:
        print(f"\ninterrupted; what was measured is in {given.results}, the same command goes on")
        return INTERRUPTED
    results = {name: found for name in known if (found := kept(given.results / f"{name}.json"))}
    given.page.write_text(_page.page(results), encoding="utf-8")
    print(f"written: {given.page}")
    return failed


def measured(benchmark: _suite.Benchmark, folder: Path, *, again: bool, limit: float) -> bool:
    """Run one benchmark unless its result is there; whether it kept what is promised, or could not be run."""
    print(f"== {benchmark.name}", flush=True)
    file, key = folder / f"{benchmark.name}.json", fingerprint(benchmark)
    if lacking := benchmark.lacking():
        print(f"passed over: {lacking}")
        write(file, result("", lacking, 0.0, ""))
        return True
    found = kept(file)
    if found is None or again or found["key"] != key:
        found = run(benchmark, limit, key)
        write(file, found)
    else:
        print(found["output"] + "(measured before)", flush=True)
    if found["reason"]:
        print(found["reason"])
        return False
    broken = [p.words for p in benchmark.promises if p.met(p.measured(found["output"])) is False]
    for words in broken:
        print(f"NOT KEPT: {words}")
    return not broken


def run(benchmark: _suite.Benchmark, limit: float, key: str) -> dict[str, Any]:
    """Run a benchmark to its end, or for as long as it may."""
    begin, output = time.monotonic(), ""
    command = [sys.executable, "-u", "-m", f"benchmarks.{benchmark.name}", *benchmark.arguments]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            output, errors = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            process.kill()
            output, _ = process.communicate()
            errors = f"stopped after {limit:g} s"
        except BaseException:
            process.kill()
            raise
    print(output, end="", flush=True)
    said = [line.strip() for line in errors.splitlines() if line.strip()]
    # A benchmark that misses its own goal ends with 1 and says nothing there.
    reason = said[-1] if process.returncode and said else ""
    return result(output, reason, time.monotonic() - begin, key)


def result(output: str, reason: str, seconds: float, key: str) -> dict[str, Any]:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return {"output": output, "reason": reason, "seconds": seconds, "key": key, "load": load,
            "date": f"{datetime.now(UTC):%Y-%m-%d}", "machine": _page.machine()}  # fmt: skip


def kept(file: Path) -> dict[str, Any] | None:
    """The result in a file; None where there is none that can be read."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and "key" in found else None


def write(file: Path, found: dict[str, Any]) -> None:
    """Write a result whole or not at all."""
    draft = file.with_suffix(".part")
    draft.write_text(json.dumps(found, indent=1), encoding="utf-8")
    draft.replace(file)


def fingerprint(benchmark: _suite.Benchmark) -> str:
    """Stands for code, command and machine: another one is measured again."""
    digest = hashlib.sha256(f"{benchmark.command}\n{_page.machine()}".encode())
    own = [ROOT / "benchmarks" / f"{benchmark.name}.py"]
    for file in [*own, *sorted((ROOT / "nlsdesign").rglob("*.py"))]:
        digest.update(file.read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    sys.exit(main())
