"""False alarms of ``INNOVATION_LARGE`` and time to it: ``python -m benchmarks.innovation_bit``.

Machines with numbers drawn from the spreads of the published deck, in C that shares nothing with the
package (``default_machine.c``), are moved by currents as ``benchmarks.watch_motions`` draws them, a minute
each; observers are those of the deck. In ten hours nothing is wrong. In a hundred other records something
goes wrong ten seconds after the start. The same again for a deck whose spreads are a tenth, as after a
calibration, and machines drawn from these. Beside the bit stands the simplest alternative: the mean of the
squared innovation over the same window against one number, the highest that those ten hours reach. Writes a
table of ``docs/controller_code.md``.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from scipy.signal import lfilter

from benchmarks._default_machines import numbers, pointer, program
from benchmarks._generated import machine
from benchmarks.targets import replaced
from benchmarks.watch_motions import MOTIONS, QUANTUM, SAMPLE_TIME, TIMES
from nlsdesign.export import export_c
from nlsdesign.feedback.observer import designed_observer
from nlsdesign.feedback.observer.spread.innovation_alarm import WINDOW
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import FlatModel
from nlsdesign.simulation import declared_prior
from tests.compiling import compile_program

PAGE: Final = Path(__file__).parents[1] / "docs" / "controller_code.md"
QUIET, RECORDS, BEGIN = 600, 100, 10.0
"""Records of a minute without and with a fault, each of its own machine, and the s at which that begins."""
KINDS: Final = ("cascade", "corrected")
BIT: Final = 1 << 15
PROGRAM: Final = """#include <stdio.h>
#include "step.h"
int main(void)
{
    static step_state state;
    double row[2];
    (void)step_init(&state, NULL);
    while (fread(row, sizeof row, 1, stdin) == 1) {
        const step_inputs inputs = {.motor.angle = (float)row[0], .motor.current = (float)row[1]};
        step_outputs outputs;
        const float word = (float)(step_step(&state, &inputs, &outputs) & 0xffffu);
        const float both[2] = {word, outputs.motor.angle.innovation};
        (void)fwrite(both, sizeof both, 1, stdout);
    }
    return 0;
}
"""
Fault = Callable[[Array, Array], tuple[Array, Array]]
"""From angle and current to what the observer is given."""
SINCE: Final[Array] = np.maximum(TIMES - BEGIN, 0.0)
"""Time in s since it went wrong."""
FAULTS: Final[Mapping[str, Fault]] = {
    "scale of the encoder +2 %": lambda angle, current: (angle * (1.0 + 0.02 * (SINCE > 0.0)), current),
    "scale of the encoder +5 %": lambda angle, current: (angle * (1.0 + 0.05 * (SINCE > 0.0)), current),
    "encoder drifts by 0.1 rad/min": lambda angle, current: (angle + 0.1 / 60.0 * SINCE, current),
    "current 10 % less than is said": lambda angle, current: (angle, current * (1.0 + (SINCE > 0.0) / 9.0)),
}
SOFTER: Final = "spring 10 % softer, from the start"


def with_spreads(model: FlatModel, share: float) -> FlatModel:
    """Return a machine whose numbers are known that much better."""
    parameters = tuple(
        replace(v, spread=v.spread.narrowed(share)) if v.uncertain else v for v in model.parameters
    )
    return replace(model, parameters=parameters)


def records(model: FlatModel, seed: int, count: int, softer: float = 1.0) -> Iterator[tuple[Array, Array]]:
    """Give angle and current of drawn machines, each under a motion of its own."""
    drawn, motions = declared_prior(model).draws(count, seed), list(MOTIONS.values())
    with tempfile.TemporaryDirectory() as folder:
        library = program(Path(folder))
        for i in range(count):
            values = model.values | {name: float(column[i]) for name, column in drawn.items()}
            values |= {n: v * softer for n, v in values.items() if ".modulus" in n}
            given = numbers(values | {"motor_encoder.quantum": 0.0})
            current = motions[i % len(motions)](np.random.default_rng([seed, i]))
            angle, torque, unused = np.zeros_like(current), np.zeros_like(current), np.zeros(3)
            library.run(
                pointer(given), len(current), ctypes.c_double(SAMPLE_TIME), 10, ctypes.c_double(0.0),
                ctypes.c_double(1.0), pointer(unused), pointer(angle), pointer(current), pointer(torque),
            )  # fmt: skip
            yield angle, current


@dataclass(frozen=True, eq=False)
class Seen:
    """What an observer made of a record: whether the bit was set, and the mean of e², shape (samples,)."""

    bit: Array
    mean: Array


def observed(step: Path, angle: Array, current: Array) -> Seen:
    """Run generated code over a record; angles are counted."""
    rows = np.column_stack([QUANTUM * np.round(angle / QUANTUM), current])
    done = subprocess.run([str(step)], input=rows.tobytes(), capture_output=True, check=True)
    given = np.frombuffer(done.stdout, dtype=np.float32).reshape(len(rows), 2).astype(float)
    pace = SAMPLE_TIME / WINDOW
    return Seen((given[:, 0].astype(int) & BIT) > 0, lfilter([pace], [1.0, pace - 1.0], given[:, 1] ** 2))


def compiled(model: FlatModel, kind: str, folder: Path) -> Path:
    """Return the observer of a deck as a program, in float."""
    source = export_c(designed_observer(model, kind=kind).model, folder, real="float", name="step")
    (folder / "main.c").write_text(PROGRAM, encoding="utf-8")
    return compile_program([folder / "main.c", source.source], folder / "run", flags=["-I", str(folder)])


def times_to(alarms: list[Array], begin: float) -> str:
    """Return in how many of the records there was an alarm, and the usual time to it."""
    times = [float(TIMES[np.argmax(a)]) - begin for a in alarms if a.any()]
    usual = f"{np.median(times):.1f}" if times else "–"
    return f"{len(times)} | {usual}"


def rows(model: FlatModel, words: str, folder: Path) -> list[str]:
    """Return the rows of a deck: each fault with the bit of both kinds and with the plain threshold."""
    steps = {kind: compiled(model, kind, folder / kind) for kind in KINDS}
    alarms, most = dict.fromkeys(KINDS, 0), 0.0
    for record in records(model, 12, QUIET):
        seen = {kind: observed(step, *record) for kind, step in steps.items()}
        alarms = {kind: alarms[kind] + bool(s.bit.any()) for kind, s in seen.items()}
        most = max(most, float(seen["cascade"].mean.max()))
    counts = " | ".join(f"{count} of {QUIET} | –" for count in (*alarms.values(), 0))
    lines = [f"| {words} | none | {counts} |"]
    print(lines[0], f"plain threshold {most:.3g} rad²", flush=True)
    quiet = list(records(model, 11, RECORDS))
    cases = {name: [fault(*each) for each in quiet] for name, fault in FAULTS.items()}
    cases[SOFTER] = list(records(model, 11, RECORDS, softer=0.9))
    for name, given in cases.items():
        begin = 0.0 if name == SOFTER else BEGIN
        late = begin <= TIMES
        runs = {kind: [observed(step, *each) for each in given] for kind, step in steps.items()}
        cells = [times_to([s.bit & late for s in runs[kind]], begin) for kind in KINDS]
        cells.append(times_to([(s.mean > most) & late for s in runs["cascade"]], begin))
        lines.append(f"| {words} | {name} | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    return lines


def main() -> None:
    """Count, and write the table."""
    declared = machine()
    head = [
        "| spreads | what goes wrong | cascade: records with the bit, of 100 | usual time to it, s "
        "| corrected: records | usual time, s | plain threshold: records | usual time, s |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for share, words in ((1.0, "as declared"), (0.1, "a tenth of them")):
            own = Path(folder) / words.replace(" ", "_")
            head += rows(with_spreads(declared, share) if share != 1.0 else declared, words, own)
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), {"innovation": head}), encoding="utf-8")


if __name__ == "__main__":
    main()
