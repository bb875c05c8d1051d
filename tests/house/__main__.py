"""Prints the figures of the house, or the places behind them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.house import budget
from tests.house.counts import DEFINITIONS, counted, plan
from tests.house.findings import findings
from tests.house.modules import Module, exported_by, modules
from tests.house.repetitions import pairs, sources
from tests.house.walks import Names, stays


def main() -> None:
    reader = argparse.ArgumentParser(prog="python -m tests.house", description=__doc__)
    reader.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[2], help="the checkout")
    reader.add_argument("--room", help="list the places in this room, or below this path")
    reader.add_argument(
        "--walks", nargs="?", const="", help="the journeys; with PART of a title, every step", metavar="PART"
    )
    reader.add_argument("--budget", action="store_true", help="write today's figures into the budget")
    given = reader.parse_args()
    root = given.root.resolve()
    bounds = budget.read(root)
    package = root / bounds["package"]
    every = modules(package)
    if given.budget:
        figures = budget.lowered(budget.measured(root, bounds), bounds["figures"])
        text = (root / budget.FILE).read_text(encoding="utf-8")
        (root / budget.FILE).write_text(budget.written(figures, text), encoding="utf-8")
    elif given.walks is not None:
        _print_walks(Names(every), bounds["walk"], given.walks)
    elif given.room:
        print(*findings(root, every, given.room), sep="\n")
    else:
        _print_figures(root, package, every)


def _print_walks(names: Names, walks: Sequence[Mapping[str, Any]], part: str) -> None:
    for walk in walks:
        steps = names.journey(walk["start"], walk["parameter"], walk["through"])
        files, entered = stays(steps), set(stays(steps))
        print(
            f"{walk['title']}: {len(files)} stays, {len(entered)} files, {len(files) - len(entered)} returns"
        )
        if part and part in walk["title"]:
            print(*(f"    {file} {name}" for file, name in steps), sep="\n")


def _print_figures(root: Path, package: Path, every: list[Module]) -> None:
    exported = exported_by(every)
    total = counted(every, exported)
    for name, text in DEFINITIONS.items():
        print(f"{name:12} {total[name]:7,}  {text}")
    rooms, arrows, floors = plan(package)
    print(f"{'rooms':12} {rooms:7,}  folders and modules below the package; {arrows} arrows, {floors} floors")
    everywhere, inside = len(pairs(sources(root))), len(pairs(sources(root, package.name)))
    print(f"{'twice':12} {everywhere:7,}  places written twice to the letter, {inside} in the package")
    columns = [name for name in DEFINITIONS if name != "dataclasses"]
    print("\nroom".ljust(18), *(name.rjust(len(name) + 2) for name in columns))
    for room in sorted({module.room for module in every}):
        row = counted([module for module in every if module.room == room], exported)
        print(room.ljust(17), *(f"{row[name]:{len(name) + 2},}" for name in columns))


if __name__ == "__main__":
    main()
