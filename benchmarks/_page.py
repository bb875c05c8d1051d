"""The page of ``make bench``: a table of promises, and what each benchmark printed."""

from __future__ import annotations

import math
import os
import platform
import re
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks._suite import ELSEWHERE, SUITE, Benchmark, Promise

LIBRARIES = ("casadi", "numpy", "scipy", "control", "clarabel", "cma", "ziglang")


def machine() -> str:
    """Processor, cores, system and versions, in one sentence."""
    try:
        known = re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(), flags=re.MULTILINE)
    except OSError:
        known = None
    processor = known[1].strip() if known else platform.processor() or platform.machine()
    installed = []
    for name in LIBRARIES:
        try:
            installed.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            installed.append(f"no {name}")
    return (
        f"{processor} ({platform.machine()}), {os.cpu_count()} cores, {platform.system()}, "
        f"Python {platform.python_version()}, {', '.join(installed)}"
    )


def page(results: Mapping[str, Mapping[str, Any]]) -> str:
    """The whole page, from the results by name; a result has ``output``, ``reason`` and more."""
    lines = [
        "# Benchmarks", "",
        "Written by `make bench`; do not edit. A ratio above one says how many times as long the peer takes, or how much",
        "more it costs, unless the row says otherwise. Times are those of the processor, not of the clock, but on a busy",
        "machine they are longer and ratios of short times blur; counted instructions and costs do not.", "",
        "| what | promised | measured | kept |", "| --- | --- | --- | --- |",
    ]  # fmt: skip
    for each in SUITE:
        lines += [_row(each, promise, results.get(each.name)) for promise in each.promises]
    for each in SUITE:
        lines += ["", *_section(each, results.get(each.name))]
    lines += ["", "## On pages of their own", ""]
    lines += [f"- {title}: [{file}]({file}), written by `{command}`." for title, file, command in ELSEWHERE]
    return "\n".join(lines) + "\n"


def _row(benchmark: Benchmark, promise: Promise, result: Mapping[str, Any] | None) -> str:
    numbers = promise.measured(result["output"]) if result else []
    kept = {True: "yes", False: "NO", None: ""}[promise.met(numbers)]
    shown = _range(numbers) if numbers else (result["reason"] if result else "") or "not measured"
    return f"| {benchmark.title}: {promise.words} | {promise.promised()} | {shown} | {kept} |"


def _range(numbers: list[float]) -> str:
    least, most = min(numbers), max(numbers)
    texts = ["never" if math.isinf(n) else f"{n:.4g}" for n in (least, most)]
    return texts[0] if least == most else f"{texts[0]} to {texts[1]}"


def _section(benchmark: Benchmark, result: Mapping[str, Any] | None) -> list[str]:
    lines = [f"## {benchmark.title}", "", f"Peer: {benchmark.peers}. Command: `{benchmark.command}`.", ""]
    if result is None:
        return [*lines, "Not run."]
    if result["reason"]:
        lines += [f"Not measured: {result['reason']}.", ""]
    if result["output"]:
        lines += ["```text", *(line.rstrip() for line in result["output"].strip().splitlines()), "```", ""]
    when = f"{result['date']}, {result['seconds']:.0f} s, load {result['load']:.1f} at the beginning"
    return [*lines, f"{when}. {result['machine']}."]
