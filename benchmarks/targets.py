"""Instructions, flash, memory and stack on Cortex-M: ``python -m benchmarks.targets``.

Writes the tables of ``docs/targets.md`` anew; needs ``qemu-system-arm``. With ``--check`` nothing is written,
and the exit status says whether the goals are met.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

import nlsdesign as nls
from nlsdesign.export import CORTEX_M4F, PROCESSORS, Processor, export_c, measure_on_target
from nlsdesign.export.compilation.target_run import TargetMeasurement
from nlsdesign.feedback.control import joined
from nlsdesign.feedback.observer import (
    design_corrected_observer,
    design_observer_with_details,
)
from nlsdesign.model import FlatModel, Variable
from tests.unguarded import unguarded

DECK = "austin2015_figure_consistent"
PAGE = Path(__file__).parents[1] / "docs" / "targets.md"
BEGIN, END = "<!-- begin: {} -->", "<!-- end: {} -->"
FUNCTIONS = ("exp", "expm1", "log", "log1p", "tanh", "erf", "sin", "atan", "sqrt")


@dataclass(frozen=True)
class Goal:
    """Most instructions of an ordinary step on a Cortex-M4F in float, and most flash in bytes."""

    instructions: int
    flash: int


GOALS = {
    "cascade observer": Goal(400, 16_384), "cascade observer and controller": Goal(700, 16_384),
    "corrected observer": Goal(1500, 12_288),
}  # fmt: skip


def models() -> dict[str, FlatModel]:
    """What runs on the controller, from the bundled deck."""
    plant = nls.flatten(nls.declare(nls.load_deck(DECK)))
    cascade = design_observer_with_details(plant).model
    corrected = design_corrected_observer(plant).model
    controller = nls.torque_controller(plant, law=nls.control.PidTorque())
    scheduled = nls.torque_controller(plant, law=nls.control.ScheduledTorque())
    return {
        "cascade observer": cascade,
        "controller": controller,
        "scheduled controller": scheduled,
        "cascade observer and controller": joined(cascade, controller),
        "cascade observer and scheduled controller": joined(cascade, scheduled),
        "corrected observer": corrected,
        "corrected observer and controller": joined(corrected, controller),
        "corrected observer and scheduled controller": joined(corrected, scheduled),
    }


def measured(model: FlatModel, real: str, processor: Processor) -> TargetMeasurement:
    """Export, compile, run."""
    with tempfile.TemporaryDirectory() as folder:
        cost = measure_on_target(export_c(model, folder, real=real, name="step"), processor)
    if cost.run is None:
        raise SystemExit(f"not measured: {cost.reason}")
    if not cost.run.same:
        raise SystemExit(f"{model.name} in {real}: {processor.name} and this machine differ in their bits")
    return cost


def cost_rows(chosen: dict[str, FlatModel]) -> Iterator[tuple[str, str, Processor, TargetMeasurement]]:
    for name, model in chosen.items():
        for processor in PROCESSORS:
            for real in ("float", "double"):
                yield name, real, processor, measured(model, real, processor)


def costs(rows: list[tuple[str, str, Processor, TargetMeasurement]]) -> list[str]:
    lines = [
        "| | processor | number type | instructions, usual | at most | flash, B | memory, B | stack, B |",
        "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, real, processor, cost in rows:
        run = cost.run
        assert run is not None
        lines.append(
            f"| {name} | {processor.name} | {real} | {np.median(run.instructions):,.0f} | "
            f"{run.instructions.max():,} | {cost.flash:,} | {cost.memory:,} | {run.stack.max():,} |"
        )
    return lines


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


def missed(rows: list[tuple[str, str, Processor, TargetMeasurement]]) -> list[str]:
    """Goals that are not met, each as a sentence."""
    sentences = []
    for name, real, processor, cost in rows:
        goal = GOALS.get(name)
        if goal is None or real != "float" or processor is not CORTEX_M4F or cost.run is None:
            continue
        usual = float(np.median(cost.run.instructions))
        if usual > goal.instructions:
            sentences.append(f"{name}: {usual:.0f} instructions, the goal is {goal.instructions}")
        if cost.flash > goal.flash:
            sentences.append(f"{name}: {cost.flash} B of flash, the goal is {goal.flash}")
    return sentences


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


def main() -> int:
    """Measure, and write or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing")
    given = parser.parse_args()
    chosen = models()
    rows = list(cost_rows(chosen))
    tables = {"costs": costs(rows), "parts": parts(chosen["cascade observer"]), "functions": functions()}
    for lines in tables.values():
        print("\n".join(lines), end="\n\n")
    if not given.check:
        PAGE.write_text(replaced(PAGE.read_text(encoding="utf8"), tables), encoding="utf8")
    sentences = missed(rows)
    print("\n".join(sentences) or "all goals are met")
    return int(bool(sentences))


if __name__ == "__main__":
    sys.exit(main())
