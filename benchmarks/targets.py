"""Cost on Cortex-M, self-tests and faults of every kind of generated code: ``python -m benchmarks.targets``.

Writes the tables of ``docs/targets.md`` anew; needs ``qemu-system-arm``. With ``--check`` nothing is written,
and the exit status says whether the goals are met.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np

from benchmarks._faults import Forgotten, forgotten
from benchmarks._generated import every_kind, machine, self_test_passes, written
from nlsdesign.export import CORTEX_M4F, PROCESSORS, CSource, Processor, export_c, measure_on_target
from nlsdesign.export.compilation.target_run import TargetMeasurement
from nlsdesign.model import FlatModel, Variable
from tests.unguarded import unguarded

PAGE = Path(__file__).parents[1] / "docs" / "targets.md"
BEGIN, END = "<!-- begin: {} -->", "<!-- end: {} -->"
FUNCTIONS = ("exp", "expm1", "log", "log1p", "tanh", "erf", "sin", "atan", "sqrt")


@dataclass(frozen=True)
class Goal:
    """Most instructions of an ordinary step on a Cortex-M4F in float, and most flash in bytes."""

    instructions: int
    flash: int


GOALS = {
    "cascade observer": Goal(440, 16_384), "cascade observer and controller": Goal(700, 16_384),
    "corrected observer": Goal(1500, 12_288),
}  # fmt: skip


class Row(NamedTuple):
    """What was measured of a kind of code in a number type on a processor."""

    name: str
    real: str
    processor: Processor
    cost: TargetMeasurement
    passes: bool  # its self-test
    faults: Forgotten | None = None

    def cells(self) -> str:
        """Return it as a row of the table."""
        run = self.cost.run
        assert run is not None
        return (
            f"| {self.name} | {self.processor.name} | {self.real} | {np.median(run.instructions):,.0f} | "
            f"{run.instructions.max():,} | {self.cost.flash:,} | {self.cost.memory:,} | "
            f"{run.stack.max():,} | {'passes' if self.passes else 'FAILS'} | "
            f"{self.faults.cells() if self.faults else '| | | |'} |"
        )


def costs_of(source: CSource, processor: Processor) -> TargetMeasurement:
    """Compile and run; what differs from this machine ends the benchmark."""
    cost = measure_on_target(source, processor)
    if cost.run is None:
        raise SystemExit(f"not measured: {cost.reason}")
    if not cost.run.same:
        raise SystemExit(f"{source.name} in {source.real}: {processor.name} and this machine differ in bits")
    return cost


def measured(model: FlatModel, real: str, processor: Processor) -> TargetMeasurement:
    """Export, compile, run."""
    with tempfile.TemporaryDirectory() as folder:
        return costs_of(export_c(model, folder, real=real, name="step"), processor)


def rows(chosen: dict[str, FlatModel], faults: int) -> Iterator[Row]:
    """Measure every kind; faults are run in each number type once, for both processors give the same bits."""
    plant = machine()
    for name, model in chosen.items():
        for real in ("float", "double"):
            with tempfile.TemporaryDirectory() as folder:
                source = written(name, model, Path(folder), real)
                used = written(name, model, Path(folder) / "used", real, quick_monitor=False)
                after = forgotten(used, plant, faults) if faults else None
                passes = self_test_passes(source)
                for processor in PROCESSORS:
                    row = Row(name, real, processor, costs_of(source, processor), passes, after)
                    print(row.cells(), flush=True)
                    yield row


HEAD = [
    "| | processor | number type | instructions, usual | at most | flash, B | memory, B | stack, B "
    "| self-test | faults | left after 0.3 s, % | beyond 1 % | of these unflagged | samples not finite |",
    "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: |",
]


def parts(cascade: FlatModel) -> list[str]:
    """Where the instructions of the cascade observer go."""
    steps = {
        "equations, table and finite checks": unguarded(cascade),
        "guards of readings, command and table": cascade,
    }
    lines = ["| part | instructions, usual |", "| --- | ---: |"]
    before = 0.0
    for name, model in steps.items():
        run = measured(model, "float", CORTEX_M4F).run
        assert run is not None
        usual = float(np.median(run.instructions))
        lines.append(f"| {name} | {usual - before:.0f} |")
        before = usual
    return [*lines, f"| together | {before:.0f} |"]


def one_function(name: str) -> FlatModel:
    """A model whose output is a function of its input; ``""`` for the input itself."""
    u, none = ca.SX.sym("u"), ca.SX(0, 1)
    y = getattr(ca, name)(ca.fabs(u)) if name else ca.fabs(u)
    arguments = [ca.SX.sym("t"), ca.SX.sym("x", 0), u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)]
    equations = ca.Function("e", arguments, [none, y, none, none])
    inputs, outputs = (Variable("u", "1", "Argument", nominal=3.0),), (Variable("y", "1", "Value"),)
    return FlatModel(name or "nothing", "One function", (), inputs, (), outputs, (), equations, 1e-3)


def functions() -> list[str]:
    lines = ["| | " + " | ".join(f"{p.name}, {r}" for p in PROCESSORS for r in ("float", "double")) + " |"]
    lines.append("| --- |" + " ---: |" * 2 * len(PROCESSORS))
    usual = {
        (name, processor.name, real): np.median(_instructions(one_function(name), real, processor))
        for name in ("", *FUNCTIONS)
        for processor in PROCESSORS
        for real in ("float", "double")
    }
    for name in FUNCTIONS:
        more = [
            f"{usual[name, processor.name, real] - usual['', processor.name, real]:.0f}"
            for processor in PROCESSORS
            for real in ("float", "double")
        ]
        lines.append(f"| `{name}` | {' | '.join(more)} |")
    return lines


def _instructions(model: FlatModel, real: str, processor: Processor) -> np.ndarray:
    run = measured(model, real, processor).run
    assert run is not None
    return run.instructions


def missed(measured: Iterable[Row]) -> list[str]:
    """Goals that are not met, each as a sentence."""
    sentences = []
    for name, real, processor, cost, passes, faults in measured:
        if not passes:
            sentences.append(f"{name} in {real}: the self-test fails")
        if faults is not None and (faults.unflagged or faults.not_finite):
            sentences.append(f"{name} in {real}: a fault is neither forgotten after 0.3 s nor flagged")
        goal = GOALS.get(name)
        if goal is None or real != "float" or processor is not CORTEX_M4F or cost.run is None:
            continue
        usual = float(np.median(cost.run.instructions))
        if usual > goal.instructions:
            sentences.append(f"{name}: {usual:.0f} instructions, the goal is {goal.instructions}")
        if cost.flash > goal.flash:
            sentences.append(f"{name}: {cost.flash} B of flash, the goal is {goal.flash}")
    return list(dict.fromkeys(sentences))


def replaced(page: str, tables: dict[str, list[str]]) -> str:
    """The page with what stands between its marks replaced."""
    for name, lines in tables.items():
        begin, end = BEGIN.format(name), END.format(name)
        before, _, rest = page.partition(begin)
        _, found, after = rest.partition(end)
        if not found:
            raise SystemExit(f"the marks of '{name}' are missing in the page")
        page = f"{before}{begin}\n" + "\n".join(lines) + f"\n{end}{after}"
    return page


def with_rows(page: str, table: str, order: list[str], new: list[str]) -> str:
    """Return the page with these rows, in the order of their first cells; rows of others stay."""
    between = page.partition(BEGIN.format(table))[2].partition(END.format(table))[0]
    top, ruler, *old = between.strip().splitlines()
    known = {first: row for row in (*old, *new) for first in order if row.startswith(first)}
    return replaced(page, {table: [top, ruler, *(known[first] for first in order if first in known)]})


def main() -> int:
    """Measure, and write or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing")
    parser.add_argument("--faults", type=int, default=60, help="for each kind and number type; 0 for none")
    given = parser.parse_args()
    chosen = every_kind()
    table = list(rows(chosen, given.faults))
    lines = [*HEAD, *(row.cells() for row in table)]
    tables = {"costs": lines, "parts": parts(chosen["cascade observer"]), "functions": functions()}
    if not given.check:
        PAGE.write_text(replaced(PAGE.read_text(encoding="utf8"), tables), encoding="utf8")
    sentences = missed(table)
    print("\n".join(sentences) or "all goals are met")
    return int(bool(sentences))


if __name__ == "__main__":
    sys.exit(main())
