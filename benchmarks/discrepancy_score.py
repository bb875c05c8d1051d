"""Score of the diagnosis on records of the rig in ``tests/rig``, with yardsticks on the same records.

The rig shares no model code with the package. A method gets the files that a bench would leave and nothing
else; labels are read after it has decided. Criteria are calibrated on seeds 200 to 299; seeds from 300 on are
counted once.

    python -m benchmarks.discrepancy_score --seeds 200-219 --sample 60 --out calibration.jsonl
    python -m benchmarks.discrepancy_score --seeds 300-309 --processes 2 --limit 300 --out score.jsonl
    python -m benchmarks.discrepancy_score --seeds 300-309 --tier pair --tier triple --out score.jsonl
    python -m benchmarks.discrepancy_score --out score.jsonl --table docs/discrepancy.md

Each result is one line of JSON, written as soon as it is there; a run goes on where it was interrupted. A
case that fails is a line with the reason. Every case runs in one process.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks._score_cases import TIERS, Case, cases, sample
from benchmarks._score_run import run
from benchmarks._score_table import Result, table
from nlsdesign.foundation.work_sharing import DaskScheduler, PointOutcome, Processes, shared_map
from nlsdesign.foundation.work_sharing.shared_map import ChunkSizes


def main() -> None:
    """Run the cases that have no result yet, and write the table."""
    given = _arguments()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(number))  # and the workers end with it
    results = _read(given.out)
    done = {r["case"] for r in results}
    todo = [case for case in _wanted(given) if case.name not in done]
    if todo:
        print(f"{len(todo)} cases to run, {len(results)} are there", flush=True)
    with given.out.open("a", encoding="utf8") as file:
        for result in _results(todo, given):
            file.write(json.dumps(result) + "\n")
            file.flush()
            results.append(result)
            outcome = result.get("error") or f"{result['verdict']} {'+'.join(result['named'])}"
            print(f"{result['case']}: {outcome} ({result['seconds']:.0f} s)", flush=True)
    text = table(results)
    if given.table:
        head = given.table.read_text(encoding="utf8") if given.table.exists() else ""
        head = head.partition(MARK)[0].rstrip() + f"\n\n{MARK}\n" if MARK in head else f"{MARK}\n"
        beside = given.table.with_suffix(".tmp")
        beside.write_text(head + "\n" + text, encoding="utf8")
        os.replace(beside, given.table)
    print(text)


MARK = "<!-- written by benchmarks.discrepancy_score from here on -->"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=seeds_of, default=[], help="for instance 200-210 or 200,205")
    parser.add_argument("--tier", action="append", choices=TIERS, help="may be repeated; all")
    parser.add_argument("--effect", action="append", help="only what hides this; may be repeated")
    parser.add_argument("--machine", action="append", help="only this machine; may be repeated")
    parser.add_argument("--sample", type=int, help="so many cases, spread evenly over all that is asked for")
    parser.add_argument("--out", type=Path, required=True, help="results, one JSON a line")
    parser.add_argument("--table", type=Path, help="Markdown file for the table; its head is kept")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, in place of processes")
    parser.add_argument(
        "--limit", type=int, default=0, help="seconds of the processor after which a case is given up"
    )
    parser.add_argument("--no-yardsticks", action="store_true")
    given = parser.parse_args()
    if given.scheduler and given.limit:
        parser.error("--limit needs a process of its own, not a Dask scheduler")
    return given


def seeds_of(text: str) -> list[int]:
    """Return the seeds that a text like ``200-202,7`` means.

    Parameters
    ----------
    text
        Numbers and ranges, separated by commas.
    """
    seeds: list[int] = []
    for piece in text.split(","):
        first, _, last = piece.partition("-")
        seeds += range(int(first), int(last or first) + 1)
    return seeds


def _wanted(given: argparse.Namespace) -> list[Case]:
    pool = cases(given.seeds, given.tier or TIERS)
    if given.effect:
        pool = [case for case in pool if set(given.effect) & set(case.effects)]
    if given.machine:
        pool = [case for case in pool if case.machine in given.machine]
    return pool if given.sample is None else sample(pool, given.sample)


def _read(file: Path) -> list[Result]:
    if not file.exists():
        return []
    return [json.loads(line) for line in file.read_text(encoding="utf8").splitlines() if line.strip()]


def _results(todo: list[Case], given: argparse.Namespace) -> Iterator[dict[str, Any]]:
    work = partial(run, limit=given.limit, yardsticks=not given.no_yardsticks)
    if given.processes < 1 and given.scheduler is None:
        yield from map(work, todo)
        return
    # One case is one core: numerical libraries of the workers start no threads, and workers of the engine
    # start no processes of their own. A case whose worker dies is tried again on its own.
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    executor = Processes(given.processes) if given.scheduler is None else DaskScheduler(given.scheduler)
    for batch in shared_map(work, enumerate(todo), executor, sizes=ChunkSizes(largest=1)):
        for each in batch:
            yield _lost(todo[each.number], each) if each.reason else each.value


def _lost(case: Case, outcome: PointOutcome) -> dict[str, Any]:
    """Return the line of a case that no worker could bring to an end."""
    return {
        "case": case.name, "tier": case.tier, "machine": case.machine, "hidden": list(case.effects),
        "strength": case.strength, "seed": case.seed, "noise": case.noise,
        "seconds": outcome.seconds, "cpu_seconds": outcome.seconds, "error": outcome.reason, "trace": "",
    }  # fmt: skip


if __name__ == "__main__":
    main()
