"""False alarms of the monitor on decks as they are: ``python -m benchmarks.watch_motions DRAWS``.

Each machine is the published deck with its numbers drawn from their declared spread, and its monitor is that
of the drawn deck. The machine is simulated as it is declared, with stiction, under a current that is held
from sample to sample: at rest, and in nine motions, a minute each. Writes a table of
``docs/how_to/watch_in_use.md``.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.components import smoothed
from nlsdesign.export import export_watch, natively
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import FlatModel
from nlsdesign.regeneration import watch_plan
from nlsdesign.simulation import declared_prior, simulate
from tests.compiling import compile_program

PAGE = Path(__file__).parents[1] / "docs" / "how_to" / "watch_in_use.md"
DECK, SAMPLE_TIME, SECONDS = "austin2015_figure_consistent", 1e-3, 60.0
QUANTUM = 0.767e-3
"""Count of the encoder, rad."""
TIMES: Array = np.arange(0.0, SECONDS, SAMPLE_TIME)
Motion = Callable[[np.random.Generator], Array]
PROGRAM = """#include <stdio.h>
#include "watch.h"
int main(void)
{
    static watch_state state;
    double row[2];
    unsigned judged = 0u;
    watch_init(&state);
    while (fread(row, sizeof row, 1, stdin) == 1) {
        watch_residuals_inputs inputs;
        inputs.motor_encoder.reading = (float)row[0];
        inputs.motor.current = (float)row[1];
        const unsigned word = (unsigned)watch_step(&state, &inputs, 0.0f);
        if (state.record.judged != judged) {
            judged = (unsigned)state.record.judged;
            (void)printf("%u ", word);
        }
    }
    return 0;
}
"""


def levels(size: float, seconds: float) -> Motion:
    """A current that is drawn anew every so many seconds."""
    return lambda draw: np.repeat(
        draw.uniform(-size, size, round(SECONDS / seconds)), round(seconds / SAMPLE_TIME)
    )


def sine(size: float) -> Motion:
    """A sine of a frequency that is drawn from 0.5 to 4 Hz."""
    return lambda draw: size * np.sin(2.0 * np.pi * 0.5 * 8.0 ** draw.uniform() * TIMES)


def chirp(draw: np.random.Generator) -> Array:
    """Sines that rise from 0.2 to 4 Hz in half a minute."""
    within = TIMES % 30.0
    return 3.0 * np.sin(2.0 * np.pi * (0.2 + 3.8 / 60.0 * within) * within + draw.uniform(0.0, 6.0))


MOTIONS: dict[str, Motion] = {
    "rest": lambda draw: np.zeros(len(TIMES)),
    **{f"sine of {size} A": sine(float(size)) for size in (1, 2, 3, 4)},
    "steps within 3 A": levels(3.0, 1.0),
    "quick steps within 3 A": levels(3.0, 0.2),
    "noise within 3 A": levels(3.0, 0.05),
    "chirp of 3 A, 0.2 to 4 Hz": chirp,
    "two sines of 2 A": lambda draw: sine(2.0)(draw) + sine(2.0)(draw),
}


def machines(draws: int) -> Iterator[tuple[FlatModel, FlatModel]]:
    """Each machine as it is declared, and in the smooth form that its monitor is made from."""
    assembly = nls.declare(nls.load_deck(DECK))
    sharp, smooth = nls.flatten(assembly), nls.flatten(smoothed(assembly))
    drawn = declared_prior(sharp).draws(draws, 7)
    for i in range(draws):
        values = {name: float(column[i]) for name, column in drawn.items()} if i else {}
        yield sharp.with_values(values), smooth.with_values(values)


def readings(machine: FlatModel, motion: Motion, seed: list[int]) -> Array:
    """Angle in counts and current of a machine that moves so, shape (samples, 2)."""
    current = motion(np.random.default_rng(seed))
    seen = simulate(machine, TIMES, inputs={"motor.current": current}, hold=True, translate=natively)
    return np.column_stack([QUANTUM * np.round(seen["motor.angle"] / QUANTUM), current])


def monitor(smooth: FlatModel, folder: Path) -> Path:
    """The monitor of a machine as a program that reads samples and prints the word of each judgement."""
    source = export_watch(watch_plan(smooth, SAMPLE_TIME), folder, real="float")
    (folder / "main.c").write_text(PROGRAM, encoding="utf-8")
    files = [folder / "main.c", source.source, source.residuals.source]
    return compile_program(files, folder / "monitor", flags=["-I", str(folder)])


def words(program: Path, rows: Array) -> list[int]:
    """Return the word of each judgement."""
    done = subprocess.run([str(program)], input=rows.tobytes(), capture_output=True, check=True)
    return [int(word) for word in done.stdout.split()]


def main() -> None:
    """Count, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("draws", type=int)
    draws, counted = parser.parse_args().draws, dict[str, list[list[int]]]()
    with tempfile.TemporaryDirectory() as name:
        for i, (sharp, smooth) in enumerate(machines(draws)):
            folder = Path(name) / str(i)
            folder.mkdir()
            program = monitor(smooth, folder)
            for number, (motion, current) in enumerate(MOTIONS.items()):
                rows = readings(sharp, current, [2026, i, number])
                counted.setdefault(motion, []).append(words(program, rows))
    lines = []
    for motion, runs in counted.items():
        judged = [word for run in runs for word in run]
        enough = sum(not word & 2 for word in judged)
        alarms = sum(any(word & 1 for word in run) for run in runs)
        lines.append(f"| {motion} | {len(runs)} | {enough} of {len(judged)} | {alarms} |")
    print("\n".join(lines))
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition("<!-- begin: motions -->\n")
    head, _, after = rest.partition("<!-- end: motions -->")
    table = "\n".join([*head.splitlines()[:2], *lines])
    PAGE.write_text(
        f"{before}<!-- begin: motions -->\n{table}\n<!-- end: motions -->{after}", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
