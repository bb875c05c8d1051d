"""Score of the diagnosis on records of the rig in ``tests/rig``, with yardsticks on the same records.

The rig shares no model code with the package. A method gets the files that a bench would leave and nothing
else; labels are read after it has decided. Set thresholds on seeds below 100 and report seeds from 100 on.

    python -m benchmarks.discrepancy_score --seeds 100-110 --out score.jsonl
    python -m benchmarks.discrepancy_score --sample 4 --strengths strong --seeds 100-104 --out score.jsonl
    python -m benchmarks.discrepancy_score --out score.jsonl --table docs/discrepancy.md

Each result is one line of JSON, written as soon as it is there; a run goes on where it was interrupted. A
case that fails is a line with the reason.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from benchmarks._score_cases import Case, cases, sample
from benchmarks._score_run import run
from benchmarks._score_table import table
from tests.rig import STRENGTHS


def main() -> None:
    """Run the cases that have no result yet, and write the table."""
    given = _arguments()
    results = _read(given.out)
    todo = [case for case in _wanted(given) if case.name not in {r["case"] for r in results}]
    if todo:
        print(f"{len(todo)} cases to run, {len(results)} are there", flush=True)
    with given.out.open("a", encoding="utf8") as file:
        for result in _results(todo, given):
            file.write(json.dumps(result) + "\n")
            file.flush()
            results.append(result)
            said = result.get("error") or f"{result['verdict']} {'+'.join(result['named'])}"
            print(f"{result['case']}: {said} ({result['seconds']:.0f} s)", flush=True)
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
    parser.add_argument("--seeds", type=_seeds, default=[], help="for instance 100-110 or 100,105")
    parser.add_argument("--cases", nargs="*", default=[], help="kinds, or effects that must be hidden; all")
    parser.add_argument("--strengths", nargs="*", default=list(STRENGTHS), choices=list(STRENGTHS))
    parser.add_argument("--sample", type=int, help="each effect once, and so many of each other kind")
    parser.add_argument("--out", type=Path, required=True, help="results, one JSON a line")
    parser.add_argument("--table", type=Path, help="Markdown file for the table; its head is kept")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--limit", type=int, default=0, help="seconds after which a case is given up")
    parser.add_argument("--no-yardsticks", action="store_true")
    return parser.parse_args()


def _seeds(text: str) -> list[int]:
    found: list[int] = []
    for piece in text.split(","):
        first, _, last = piece.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def _wanted(given: argparse.Namespace) -> list[Case]:
    if not given.seeds:
        return []
    if given.sample is not None:
        found = sample(given.seeds, given.strengths[-1], given.sample)
    else:
        found = cases(given.seeds, strengths=given.strengths)
    words = set(given.cases)
    return [c for c in found if not words or words & {c.kind, *c.effects}]


def _read(file: Path) -> list[dict[str, Any]]:
    if not file.exists():
        return []
    return [json.loads(line) for line in file.read_text(encoding="utf8").splitlines() if line.strip()]


def _results(todo: list[Case], given: argparse.Namespace) -> Iterator[dict[str, Any]]:
    ask = given.limit, not given.no_yardsticks
    if given.processes == 1:
        for case in todo:
            yield run(case, *ask)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(given.processes, mp_context=context) as pool:
        for done in as_completed([pool.submit(run, case, *ask) for case in todo]):
            yield done.result()


if __name__ == "__main__":
    main()
