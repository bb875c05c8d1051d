"""Score of the diagnosis on records of the rig in ``tests/rig``, with yardsticks on the same records.

The rig shares no model code with the package. A method gets the files that a bench would leave and nothing
else; labels are read after it has decided. Criteria are calibrated on seeds 200 to 299; seeds from 300 on are
counted once.

    python -m benchmarks.discrepancy_score --seeds 200-219 --sample 60 --out calibration.jsonl
    python -m benchmarks.discrepancy_score --seeds 300-309 --processes 2 --limit 300 --out score.jsonl
    python -m benchmarks.discrepancy_score --seeds 300-309 --tier pair --tier triple --out score.jsonl
    python -m benchmarks.discrepancy_score --out score.jsonl --table docs/discrepancy.md
    python -m benchmarks.discrepancy_score --kinds all --seeds 0:20 --out kinds.jsonl --table docs/scores.md

With ``--kinds`` the machines are those of ``tests/rig/kinds.py``, under a digital loop that holds its
current, some of them in MuJoCo. Each result is one line of JSON, written as soon as it is there; a run goes
on where it was interrupted. A line that was counted with other code is no result any more: its case is run
again. A case that fails is a line with the reason. Every case runs in one process.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks._score_cases import KIND_TIERS, TIERS, Case, cases, sample
from benchmarks._score_digest import digest
from benchmarks._score_kinds import all_kinds, codes, kind_cases, kind_table
from benchmarks._score_run import run
from benchmarks._score_table import Result, table
from nlsdesign.foundation.work_sharing import DaskScheduler, PointOutcome, Processes, shared_map
from nlsdesign.foundation.work_sharing.shared_map import ChunkSizes


def main() -> None:
    """Run the cases that have no result yet, and write the table."""
    given = _arguments()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(number))  # and the workers end with it
    results, wanted = _read(given.out), _wanted(given)
    if wanted:
        today = digest()
        older = [r for r in results if r.get("code") != today]
        results = [r for r in results if r.get("code") == today]
        if older:
            print(f"{len(older)} cases were counted with other code and do not count", flush=True)
    done = {r["case"] for r in results}
    todo = [case for case in wanted if case.name not in done]
    if todo:
        print(f"{len(todo)} cases to run, {len(results)} are there", flush=True)
    begin = time.perf_counter()
    number = 0
    with given.out.open("a", encoding="utf8") as file:
        for result in _results(todo, given):
            file.write(json.dumps(result) + "\n")
            file.flush()
            results.append(result)
            outcome = result.get("error") or f"{result['verdict']} {'+'.join(result['named'])}"
            number += 1
            rest = (time.perf_counter() - begin) / number * (len(todo) - number) / 60.0
            print(
                f"{number}/{len(todo)} {result['case']}: {outcome} "
                f"({result['seconds']:.0f} s; {rest:.0f} min left)",
                flush=True,
            )
    text = page(results)
    if given.table:
        head = given.table.read_text(encoding="utf8") if given.table.exists() else ""
        head = head.partition(MARK)[0].rstrip() + f"\n\n{MARK}\n" if MARK in head else f"{MARK}\n"
        beside = given.table.with_suffix(".tmp")
        beside.write_text(head + "\n" + text, encoding="utf8")
        os.replace(beside, given.table)
    print(text)


def page(results: list[Result]) -> str:
    """Return what is written behind the mark: the code that was counted, then the tables.

    Parameters
    ----------
    results
        As read from the JSON lines.
    """
    counted = [f"Counted with the code `{code}`: {n} cases.  " for code, n in codes(results).items()]
    cam = [r for r in results if r["tier"] not in KIND_TIERS]
    tables = [table(cam)] if cam else []
    return "\n".join([*counted, "", *tables, *kind_table(results)]).rstrip() + "\n"


MARK = "<!-- written by benchmarks.discrepancy_score from here on -->"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--seeds", type=seeds_of, default=[], help="200-210 with 210, 0:20 without 20, or 200,205"
    )
    parser.add_argument("--kinds", help="kinds of machines in place of the cam rig, with commas; or: all")
    parser.add_argument("--cascaded", action="store_true", help="kinds of machines under a robot's cascade")
    parser.add_argument("--tier", action="append", choices=(*TIERS, *KIND_TIERS), help="may be repeated; all")
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
    """Return the seeds that a text like ``200-202,7`` or ``0:20`` means; the latter is without 20.

    Parameters
    ----------
    text
        Numbers and ranges, separated by commas.
    """
    seeds: list[int] = []
    for piece in text.split(","):
        if ":" in piece:
            seeds += range(*map(int, piece.split(":")))
            continue
        first, _, last = piece.partition("-")
        seeds += range(int(first), int(last or first) + 1)
    return seeds


def _wanted(given: argparse.Namespace) -> list[Case]:
    if given.kinds:
        kinds = all_kinds() if given.kinds == "all" else given.kinds.split(",")
        pool = [
            c
            for c in kind_cases(given.seeds, kinds, cascaded=given.cascaded)
            if c.tier in (given.tier or KIND_TIERS)
        ]
    else:
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
    work = partial(run, limit=given.limit, yardsticks=not (given.no_yardsticks or given.kinds))
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
        "code": digest(), "seconds": outcome.seconds, "cpu_seconds": outcome.seconds,
        "error": outcome.reason, "trace": "",
    }  # fmt: skip


if __name__ == "__main__":
    main()
