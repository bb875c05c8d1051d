"""False alarms of ``INNOVATION_LARGE`` and time to it: ``python -m benchmarks.innovation_bit``.

Machines with numbers drawn from the spreads of the published deck, in C that shares nothing with the
package (``default_machine.c``), are moved by currents as ``benchmarks.watch_motions`` draws them, a minute
each; observers are those of the deck. Ten seconds after the start something goes wrong. The same again for a
deck whose spreads are a tenth, as after a calibration, and machines drawn from these. Writes a table of
``docs/controller_code.md``.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks._default_machines import numbers, pointer, program
from benchmarks._generated import machine
from benchmarks.targets import replaced
from benchmarks.watch_motions import MOTIONS, QUANTUM, SAMPLE_TIME, TIMES
from nlsdesign.export import export_c
from nlsdesign.feedback.observer import designed_observer
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import FlatModel
from nlsdesign.simulation import declared_prior
from tests.compiling import compile_program

PAGE: Final = Path(__file__).parents[1] / "docs" / "controller_code.md"
RECORDS, BEGIN = 100, 10.0
"""Records, each of a machine of its own, and the time in s at which something goes wrong."""
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
    "none": lambda angle, current: (angle, current),
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


def records(model: FlatModel, seed: int, softer: float = 1.0) -> list[tuple[Array, Array]]:
    """Return angle and current of drawn machines, each under a motion of its own."""
    drawn, motions, runs = declared_prior(model).draws(RECORDS, seed), list(MOTIONS.values()), []
    with tempfile.TemporaryDirectory() as folder:
        library = program(Path(folder))
        for i in range(RECORDS):
            values = model.values | {name: float(column[i]) for name, column in drawn.items()}
            values |= {n: v * softer for n, v in values.items() if ".modulus" in n}
            given = numbers(values | {"motor_encoder.quantum": 0.0})
            current = motions[i % len(motions)](np.random.default_rng([seed, i]))
            angle, torque, unused = np.zeros_like(current), np.zeros_like(current), np.zeros(3)
            library.run(
                pointer(given), len(current), ctypes.c_double(SAMPLE_TIME), 10, ctypes.c_double(0.0),
                ctypes.c_double(1.0), pointer(unused), pointer(angle), pointer(current), pointer(torque),
            )  # fmt: skip
            runs.append((angle, current))
    return runs


@dataclass(frozen=True, eq=False)
class Seen:
    """What an observer made of a record: whether the bit was set, and the innovation, shape (samples,)."""

    bit: Array
    innovation: Array


def observed(step: Path, angle: Array, current: Array) -> Seen:
    """Run generated code over a record; angles are counted."""
    rows = np.column_stack([QUANTUM * np.round(angle / QUANTUM), current])
    done = subprocess.run([str(step)], input=rows.tobytes(), capture_output=True, check=True)
    given = np.frombuffer(done.stdout, dtype=np.float32).reshape(len(rows), 2)
    return Seen((given[:, 0].astype(int) & BIT) > 0, np.abs(given[:, 1]))


def compiled(model: FlatModel, kind: str, folder: Path) -> Path:
    """Return the observer of a deck as a program, in float."""
    source = export_c(designed_observer(model, kind=kind).model, folder, real="float", name="step")
    (folder / "main.c").write_text(PROGRAM, encoding="utf-8")
    return compile_program([folder / "main.c", source.source], folder / "run", flags=["-I", str(folder)])


def times_to(alarms: list[Array], begin: float) -> str:
    """Return in how many of the moved records there was an alarm, and the usual time to it."""
    times = [float(TIMES[np.argmax(a)]) - begin for a in alarms if a.any()]
    usual = f"{np.median(times):.1f}" if times else "–"
    return f"{len(times)} | {usual}"


def rows(model: FlatModel, words: str, folder: Path) -> list[str]:
    """Return the rows of a deck: each fault with bit and threshold."""
    quiet, other = records(model, 11), records(model, 12)
    steps = {kind: compiled(model, kind, folder / kind) for kind in KINDS}
    # The lowest threshold on the innovation that other machines of the same deck never reach.
    most = max(float(observed(steps["cascade"], *each).innovation.max()) for each in other)
    cases = {name: [fault(*each) for each in quiet] for name, fault in FAULTS.items()}
    cases[SOFTER] = records(model, 11, softer=0.9)
    lines = []
    for name, given in cases.items():
        begin = 0.0 if name in ("none", SOFTER) else BEGIN
        late = begin <= TIMES
        seen = {kind: [observed(step, *each) for each in given] for kind, step in steps.items()}
        cells = [times_to([s.bit & late for s in seen[kind]], begin) for kind in KINDS]
        cells.append(times_to([(s.innovation > most) & late for s in seen["cascade"]], begin))
        lines.append(f"| {words} | {name} | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    return lines


def main() -> None:
    """Count, and write the table."""
    declared = machine()
    head = [
        "| spreads | what goes wrong | cascade: records with the bit, of 100 | usual time to it, s "
        "| corrected: records | usual time, s | bare threshold: records | usual time, s |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for share, words in ((1.0, "as declared"), (0.1, "a tenth of them")):
            own = Path(folder) / words.replace(" ", "_")
            head += rows(with_spreads(declared, share) if share != 1.0 else declared, words, own)
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), {"innovation": head}), encoding="utf-8")


if __name__ == "__main__":
    main()
