"""The labelled practice records through the command line, one command per set, and a table of what it said.

    NLSDESIGN_SHARED=/path/to/folder python -m benchmarks.practice --out out/practice --table practice.md

The folder holds ``practice/``: ``rig.toml``, ``cam.csv``, ``labels.json`` and a folder for each set. Labels
are read after the verdict was written. Memory is that of the largest process of the command.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks._tools import run_tool
from nlsdesign.bench.discrepancy.effects import ALL

CATALOGUE = {effect.__name__ for effect in ALL}
COMMAND = (sys.executable, "-m", "nlsdesign")


def main() -> int:
    """Diagnose each set; the exit status counts wrong verdicts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for decks, verdicts and reports")
    parser.add_argument("--table", type=Path, help="Markdown file to write")
    parser.add_argument("sets", nargs="*", help="names of sets; all")
    given = parser.parse_args()
    if "NLSDESIGN_SHARED" not in os.environ:
        parser.error("set NLSDESIGN_SHARED to the folder that holds practice/")
    folder = Path(os.environ["NLSDESIGN_SHARED"]) / "practice"
    names = given.sets or sorted(f.name for f in folder.iterdir() if f.is_dir())
    given.out.mkdir(parents=True, exist_ok=True)
    deck = given.out / "rig.toml"
    make_deck = [*COMMAND, "deck", "from-rig", str(folder / "rig.toml"), str(folder / "cam.csv")]
    run_tool([*make_deck, "--out", str(deck)])
    rows = [_diagnosed(deck, folder / name, given.out / name) for name in names]
    labels = json.loads((folder / "labels.json").read_text(encoding="utf8"))
    text, wrong = _table(rows, labels)
    print(text)
    if given.table:
        given.table.write_text(text, encoding="utf8")
    return wrong


def _diagnosed(deck: Path, records: Path, out: Path) -> dict[str, Any]:
    begin = time.perf_counter()
    asked = [*COMMAND, "diagnose", "--deck", str(deck), "--records", str(records), "--out", str(out)]
    run_tool(asked)
    seconds = time.perf_counter() - begin
    found = json.loads((out / "verdict.json").read_text(encoding="utf8"))
    return {"set": records.name, "seconds": seconds, **found}


def _table(rows: list[dict[str, Any]], labels: dict[str, list[str]]) -> tuple[str, int]:
    lines = [
        "| set | hidden | verdict | named | held-out error / noise, before | after | seconds |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    wrong = 0
    for row in rows:
        named, error = [e["name"] for e in row["effects"]], row["error"]
        held = error["held_out"]
        before, after = (held[k] / error["noise_floor"] for k in ("before", "after"))
        hidden = labels[row["set"]]
        right = _is_right(hidden, row["verdict"], named)
        wrong += not right
        lines.append(
            f"| {row['set']} | {', '.join(hidden) or '–'} | {row['verdict']}{'' if right else ' (wrong)'} | "
            f"{', '.join(named) or '–'} | {before:.2f} | {after:.2f} | {row['seconds']:.0f} |"
        )
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    lines.append(f"\n{len(rows) - wrong} of {len(rows)} right. Largest process: {memory:.0f} MB.")
    return "\n".join(lines) + "\n", wrong


def _is_right(hidden: list[str], verdict: str, named: list[str]) -> bool:
    if not hidden:
        return verdict == "none" and not named
    if any(effect not in CATALOGUE for effect in hidden):
        return verdict == "unknown" and not named
    return verdict == "named" and sorted(named) == sorted(hidden)


if __name__ == "__main__":
    sys.exit(main())
