"""The monitor in use: false alarms, time to notice, names; ``python -m benchmarks.watch HOURS``.

Machines are those of `tests.watched`, which share no model code with the package. Each of two machines is
used HOURS hours without a change; every other figure is quick. Writes the tables of
``docs/how_to/watch_in_use.md``.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import nlsdesign as nls
from nlsdesign.components import smoothed
from nlsdesign.export import WatchPlan, export_c, export_watch, read_watch_record
from nlsdesign.regeneration import read_watch, watch_plan
from tests.watched import Use, build, build_watched, joint_deck, use

PAGE = Path(__file__).parents[1] / "docs" / "how_to" / "watch_in_use.md"
DECKS = {"published": ("austin2015_figure_consistent", 1e-3), "joint": ("", 2e-3)}
CHANGES = {
    "friction +10 %": {"friction": 1.1},
    "friction -10 %": {"friction": 0.9},
    "stiffness -5 %": {"stiffness": 0.95},
    "delay 2 ms": {"delay": 2e-3},
}
NAMES = {
    "friction": ("dry_friction.friction", 0.1),
    "stiffness": ("spring.stiffness", 0.05),
    "delay": ("motor.delay", 2e-3),
    "torque": ("motor.torque_constant", 0.05),
    "inertia": ("motor.inertia", 0.1),
    "weight": ("arm.load", 0.05),
    "damping": ("bearing.damping", 0.5),
}
KNOWN = {"published": ("friction", "stiffness", "delay", "torque"), "joint": tuple(NAMES)}
SEGMENT = 50.0
"""Hours of one run."""


class Watched(NamedTuple):
    """A machine with its monitor beside the loop."""

    name: str
    plan: WatchPlan
    program: Path


def machines(folder: Path) -> Iterator[Watched]:
    """The published actuator and the elastic joint."""
    for name, (deck, sample_time) in DECKS.items():
        file = folder / "joint.toml"
        file.write_text(joint_deck(), encoding="utf-8")
        plan = watch_plan(nls.flatten(smoothed(nls.declare(nls.load_deck(deck or file)))), sample_time)
        yield Watched(name, plan, build_watched(name, export_watch(plan, folder / name, real="float")))


def quiet(each: Watched, hours: float) -> str:
    """A row of false alarms."""
    count = max(1, round(hours / SEGMENT))
    runs = [use(each.program, 100 + k, 3600.0 * min(hours, SEGMENT)) for k in range(count)]
    total = count * min(hours, SEGMENT)
    judged, alarms = sum(run.judged for run in runs), sum(run.alarms for run in runs)
    return f"| {each.name} | {total:,.0f} | {judged:,} | {alarms} |"


def times(runs: list[Use], change_at: float) -> str:
    """Median and longest time to notice, and how many runs noticed within a minute."""
    late = np.array([run.first for run in runs]) - change_at
    words = [f"{value:.0f}" if np.isfinite(value) else "never" for value in (np.median(late), late.max())]
    return f"{' | '.join(words)} | {(late <= 60.5).sum()} of {len(late)}"


def noticed(each: Watched, runs: int, program: Path | None = None) -> Iterator[str]:
    """Rows of the time to notice."""
    for words, after in CHANGES.items():
        done = [
            use(program or each.program, 1000 + k, 1200.0, change_at=603.7, after=after) for k in range(runs)
        ]
        yield f"| {each.name} | {words} | {times(done, 603.7)} |"


def names(each: Watched, cases: int, folder: Path) -> str:
    """A row of what was named after five minutes of changes that were drawn."""
    draw, known = np.random.default_rng([2026, len(each.name)]), KNOWN[each.name]
    right = wrong = silent = quiet_right = quiet_wrong = 0
    for case in range(cases):
        changed = case % 5 != 4
        what = known[int(draw.integers(len(known)))]
        name, size = NAMES[what]
        share = (
            float(draw.uniform(1.0, 2.5)) * size * (1.0 if what == "delay" or draw.uniform() < 0.5 else -1.0)
        )
        value = round(share / 4e-4) * 4e-4 if what == "delay" else 1.0 + share
        use(each.program, 2000 + case, 900.0, change_at=600.0, after={what: value} if changed else {},
            record=folder / "watch.bin")  # fmt: skip
        verdict = read_watch(read_watch_record(folder / "watch.bin", each.plan), each.plan)
        said = [{change.name, *change.aliases} for change in verdict.named]
        if not changed:
            quiet_right, quiet_wrong = quiet_right + (not said), quiet_wrong + bool(said)
        elif said:
            fits = len(said) == 1 and name in said[0]
            right, wrong = right + fits, wrong + (not fits)
        else:
            silent += 1
    counts = f"{right + wrong + silent} | {right} | {wrong} | {silent}"
    return f"| {each.name} | {counts} | {quiet_right} of {quiet_right + quiet_wrong} |"


LOOK = """#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "simple.h"
#define EVERY @every@
typedef struct { double motor, load, current; } reading;
static simple_state state; static double sum, limit, first = INFINITY, most; static long count, alarms,
judged; void look_begin(int argc, char **argv) { (void)argc; (void)argv; simple_init(&state, NULL);
    limit = atof(getenv("SIMPLE_LIMIT")); }
void look(double time, const reading *read) {
    simple_inputs in; simple_outputs out;
    @readings@
    (void)simple_step(&state, &in, &out);
    sum += (double)out.@innovation@ * (double)out.@innovation@;
    if (++count == EVERY) {
        const double rms = sqrt(sum / EVERY);
        most = (rms > most && time > 60.0) ? rms : most;
        if (rms > limit && time > 60.0) { ++alarms; first = time < first ? time : first; }
        sum = 0.0; count = 0; ++judged; } }
void look_end(void) { (void)printf("%.3f 0 %ld %ld %ld\\n", first, alarms, judged, judged);
(void)fprintf(stderr, "%.9g\\n", most); }
"""


def innovation_alone(each: Watched, folder: Path, hours: float) -> tuple[Path, float]:
    """The simplest other monitor: rms of the innovation of the cascade observer over 10 s, and its largest
    without a change."""
    import os
    import subprocess

    from nlsdesign.feedback.observer import CascadeGain
    from tests.watched import values

    plant = nls.flatten(nls.declare(nls.load_deck(DECKS[each.name][0])))
    source = export_c(nls.design_observer(plant, gain=CascadeGain()), folder / "simple", name="simple")
    paths = source.writer.paths
    innovation = next(p for p in paths.outputs if "innovation" in p)
    wires = [f"in.{p} = {'read->current' if 'current' in p else 'read->motor'};" for p in paths.inputs]
    text = (
        LOOK.replace("@every@", "10000")
        .replace("@readings@", " ".join(wires))
        .replace("@innovation@", innovation)
    )
    (folder / "simple" / "look.c").write_text(text, encoding="utf-8")
    program = build(each.name, folder / "simple", look=folder / "simple" / "look.c", code=[source.source])
    os.environ["SIMPLE_LIMIT"] = "inf"
    rows = [*map(str, values()), *map(str, values())]
    done = subprocess.run(
        [str(program), "99", str(3600.0 * hours), "1e12", *rows], capture_output=True, text=True, check=True
    )
    limit = float(done.stderr)
    os.environ["SIMPLE_LIMIT"] = repr(1.05 * limit)
    return program, limit


def main() -> None:
    """Run everything and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("hours", type=float)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--cases", type=int, default=50)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tables: dict[str, list[str]] = {"noticed": [], "names": [], "quiet": [], "simple": []}
        for each in machines(folder):
            tables["noticed"] += noticed(each, given.runs)
            tables["names"].append(names(each, given.cases, folder))
            if each.name == "published":
                program, _ = innovation_alone(each, folder, 20.0)
                tables["simple"] += noticed(each, given.runs, program)
            if given.hours:
                tables["quiet"].append(quiet(each, given.hours))
            for rows in tables.values():
                print("\n".join(rows), flush=True)
    text = PAGE.read_text(encoding="utf-8")
    for name, rows in tables.items():
        before, _, rest = text.partition(f"<!-- begin: {name} -->\n")
        head, _, after = rest.partition(f"<!-- end: {name} -->")
        kept = head.splitlines()[:2]
        if rows:
            text = (
                f"{before}<!-- begin: {name} -->\n"
                + "\n".join([*kept, *rows])
                + f"\n<!-- end: {name} -->{after}"
            )
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
