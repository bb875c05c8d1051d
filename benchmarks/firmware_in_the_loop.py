"""The example firmware on an emulated Cortex-M, in the loop with its machine's FMU.

``python -m benchmarks.firmware_in_the_loop`` writes the tables of ``docs/firmware.md`` anew, each row as soon
as it is there; it needs ``qemu-system-arm``. With the names of some rows only these are written. With
``--check`` nothing is written. The exit status says whether all holds.
"""

from __future__ import annotations

import argparse
import math
import struct
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

import nlsdesign as nls
from benchmarks._emulated_board import Cells, EmulatedBoard
from benchmarks.targets import with_rows
from nlsdesign.export import CORTEX_M4F, CSource, Processor, export_c, export_fmu, write_examples
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.export.compilation.cross_compiler import run_compiler
from nlsdesign.export.compilation.processors import PROCESSORS
from nlsdesign.export.files import template
from nlsdesign.feedback.control import joined
from nlsdesign.feedback.observer import designed_observer

PAGE: Final = Path(__file__).parents[1] / "docs" / "firmware.md"
BOARD: Final = Path(__file__).parent / "firmware"
DECK: Final = "austin2015_figure_consistent"
STEP: Final = 1e-3
"""Sample time in s."""
SPAN: Final = 4.0
"""N·m at the end of the converter's range, of the wish."""
MIDDLE: Final = 2048
"""Counts of the converter at no wish."""
FLAGS: Final = (
    *("-std=gnu99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-sanitize=undefined"),
    *("-ffunction-sections", "-fdata-sections", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables"),
    *("-DCORE_CLOCK=25000000u", "-Wl,--gc-sections", "-Wl,-e,start"),
)  # fmt: skip


def wish(k: int) -> int:
    """Return the counts of the wished torque at a sample: two sines and a step every two seconds."""
    t = k * STEP
    torque = (
        1.2 * np.sin(2 * np.pi * t) + 0.5 * np.sin(2 * np.pi * 4.3 * t) + (0.8 if t % 4.0 > 2.0 else -0.8)
    )
    return MIDDLE + round(torque / SPAN * MIDDLE)


def wished(counts: int) -> float:
    """Return the torque in N·m that the firmware reads from counts of its converter."""
    return -SPAN + counts * (SPAN / MIDDLE)


class Unit:
    """An FMU that FMPy steps by one sample."""

    def __init__(self, path: Path, folder: Path) -> None:
        description = fmpy.read_model_description(path)
        self._numbers = {v.name: v.valueReference for v in description.modelVariables}
        self._slave: Any = FMU2Slave(
            guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=fmpy.extract(str(path), str(folder / path.stem)), instanceName=path.stem,
        )  # fmt: skip
        self._slave.instantiate()
        self._slave.setupExperiment(startTime=0.0)
        self._slave.enterInitializationMode()
        self._slave.exitInitializationMode()
        self._samples = 0

    def give(self, **values: float) -> None:
        """Set inputs; a dot in a name is written as two underscores."""
        names = [name.replace("__", ".") for name in values]
        self._slave.setReal([self._numbers[name] for name in names], list(values.values()))

    def step(self) -> None:
        """Go on by one sample."""
        self._slave.doStep(currentCommunicationPoint=self._samples * STEP, communicationStepSize=STEP)
        self._samples += 1

    def get(self, name: str) -> float:
        """Return a number."""
        return float(self._slave.getReal([self._numbers[name]])[0])

    def end(self) -> None:
        """Free what it holds."""
        self._slave.terminate()
        self._slave.freeInstance()


@dataclass(frozen=True)
class Firmware:
    """An image, and what it was made from."""

    source: CSource
    image: Path
    plant: Path  # FMU
    controller: Path  # FMU of the same step, in double
    quantum: float  # rad in one count of the encoder
    limit: float  # A
    shift: int = 5  # an instruction of the emulator takes 2**shift ns

    def counts(self, plant: Unit) -> int:
        """Return what the encoder counts."""
        return round(plant.get("motor_encoder.reading") / self.quantum)


def made(processor: Processor, real: str, folder: Path, *, corrected: bool = False) -> Firmware:
    """Export the machine and its controller, and compile the example program as it was generated."""
    actuator = nls.declare(nls.load_deck(DECK))
    plant = nls.flatten(actuator, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
    observer = designed_observer(plant, kind="corrected" if corrected else "cascade").model
    both = joined(observer, nls.torque_controller(plant, law=nls.control.ScheduledTorque()))
    source = export_c(both, folder, real=real, name="torque_loop")
    write_examples(source)
    (quantum,) = (each.start for each in plant.parameters if each.name == "motor_encoder.quantum")
    (limit,) = (each.maximum for each in both.outputs if each.name == "motor.current")
    units = [export_fmu(model, folder / f"{name}.fmu", version="2.0")
             for name, model in (("plant", plant), ("controller", both))]  # fmt: skip
    # In software a step takes longer than a sample at 32 ns an instruction.
    shift = 3 if in_software(processor, real) else 5
    file = image(source, processor, quantum)
    return Firmware(source, file, units[0], units[1], quantum, float(limit), shift)


def in_software(processor: Processor, real: str) -> bool:
    """Tell whether numbers are computed by functions of the compiler."""
    return processor is CORTEX_M4F and real == "double"


def image(source: CSource, processor: Processor, quantum: float, board: Path = BOARD / "board.h") -> Path:
    """Compile step, example program and start-up with the functions of a board."""
    folder = source.source.parent
    for name in ("math.h", "string.h", "link.ld"):
        (folder / name).write_text(template(f"target_{name}"), encoding="utf-8")
    target = folder / f"{board.stem}.elf"
    files = [BOARD / "start.c", source.source, folder / "torque_loop_example_cortex_m.c"]
    numbers = [f"-DREAL={source.real}", f"-DENCODER_QUANTUM={quantum!r}", f"-DWISH_SPAN={SPAN!r}"]
    numbers += ["-DSOFT_NUMBERS"] if in_software(processor, source.real) else []
    include = ["-isystem", folder, "-I", folder, "-I", board.parent, f'-DBOARD="{board.name}"']
    run_compiler(
        ["-target", processor.target, f"-mcpu={processor.features}", *FLAGS, *numbers, *include, *files,
         "-T", folder / "link.ld", "-o", target],
        about="the example firmware",
    )  # fmt: skip
    return target


Step = Callable[[int, int], tuple[float, float]]
"""From counts of encoder and converter to current in A and estimated torque in N·m."""


@contextmanager
def reference(firmware: Firmware, folder: Path) -> Iterator[Step]:
    """Yield the same step without a board: the FMU in FMPy for double, the C of this machine for float."""
    if firmware.source.real == "double":
        unit = Unit(firmware.controller, folder)

        def of_fmu(encoder: int, converter: int) -> tuple[float, float]:
            unit.give(motor__angle=encoder * firmware.quantum, spring__torque__desired=wished(converter))
            unit.step()
            return unit.get("motor.current"), unit.get("spring.torque")

        yield of_fmu
        unit.end()
        return
    step, names = CompiledStep(firmware.source), [each.name for each in firmware.source.model.outputs]

    def of_code(encoder: int, converter: int) -> tuple[float, float]:
        outputs, _ = step([encoder * firmware.quantum, wished(converter)])
        return float(outputs[names.index("motor.current")]), float(outputs[names.index("spring.torque")])

    yield of_code


@dataclass(frozen=True)
class SameRun:
    """A run of both, each with a machine of its own."""

    samples: int
    differing: int  # samples at which a bit of current or torque differs
    first: int  # of these; -1 where there is none
    largest_torque: float  # of the machine's spring, N·m
    tracking: float  # rms of wished minus true torque, N·m
    faults: int  # of the processor
    instructions: tuple[int, int]  # from the interrupt to the end of the step: usual, most


def run_both(firmware: Firmware, processor: Processor, samples: int, folder: Path) -> SameRun:
    """Run firmware and reference, and compare each sample bit by bit."""
    plants = [Unit(firmware.plant, folder / str(k)) for k in range(2)]
    currents = [0.0, 0.0]
    differing, first, cycles, torques, misses = 0, -1, [], [], []
    with (
        EmulatedBoard(firmware.image, processor, firmware.shift) as board,
        reference(firmware, folder) as step,
    ):
        for k in range(samples):
            cells = board.sample(firmware.counts(plants[0]), wish(k))
            expected = step(firmware.counts(plants[1]), wish(k))
            if struct.pack("<dd", cells.current, cells.torque) != struct.pack("<dd", *expected):
                differing, first = differing + 1, first if differing else k
            cycles.append(round(25e6 * STEP) - cells.clock)
            torques.append(plants[0].get("spring.torque"))
            misses.append(wished(wish(k)) - torques[-1])
            # The current of a sample acts in the next one.
            for plant, current in zip(plants, currents, strict=True):
                plant.give(motor__current=current)
                plant.step()
            currents = [cells.current, expected[0]]
    for plant in plants:
        plant.end()
    usual, most = (round(count * 40 / 2**firmware.shift) for count in (np.median(cycles), max(cycles)))
    rms = float(np.sqrt(np.mean(np.square(misses))))
    return SameRun(
        samples, differing, first, float(np.max(np.abs(torques))), rms, cells.faults, (usual, most)
    )


@dataclass(frozen=True)
class FaultyRun:
    """A run with late interrupts, lost frames, wrong counts and brown-outs."""

    samples: int
    given: dict[str, int]  # how many faults of each kind
    processor_faults: int
    restarts: int  # without a brown-out
    lost: int  # samples that the program did not end
    beyond: int  # currents that are not finite or beyond the limit
    unflagged: (
        int  # of the samples from 0.3 s after a fault: beyond 1 % of the largest torque, and not flagged
    )
    worst: float  # error of the estimate then, N·m


class _Faults:
    """A machine and its board, with what can go wrong between them."""

    def __init__(self, firmware: Firmware, board: EmulatedBoard, plant: Unit, seed: int) -> None:
        self._firmware, self._board, self._plant = firmware, board, plant
        self._current = 0.0
        self.draw = np.random.default_rng(seed)
        self.samples = 0
        self.cells: Cells

    def sample(self, *, wrong: int = 0, fresh: bool = True, held: int | None = None) -> float:
        """Take one sample; return the error of the estimate in N·m."""
        counts = self._firmware.counts(self._plant) + wrong if held is None else held
        truth = self._plant.get("spring.torque")
        self.cells = self._board.sample(counts, wish(self.samples), fresh=fresh)
        self.advance(1)
        self._current = self.cells.current
        self.samples += 1
        return abs(self.cells.torque - truth)

    def advance(self, periods: int) -> None:
        """Let the machine go on with the current that the amplifier has."""
        self._plant.give(motor__current=self._current)
        for _ in range(periods):
            self._plant.step()

    def late(self) -> None:
        """One to five interrupts do not come."""
        self.advance(int(self.draw.integers(1, 6)))

    def lost_frames(self) -> None:
        """Up to 150 frames of the encoder do not come."""
        for _ in range(int(self.draw.integers(1, 151))):
            self.sample(fresh=False)

    def wrong_counts(self) -> None:
        """One to three readings are wrong by up to a turn."""
        for _ in range(int(self.draw.integers(1, 4))):
            self.sample(wrong=int(self.draw.integers(-8192, 8192)))

    def frozen(self) -> None:
        """The encoder stands for up to 50 samples."""
        counts = self._firmware.counts(self._plant)
        for _ in range(int(self.draw.integers(1, 51))):
            self.sample(held=counts)

    def brown_out(self) -> None:
        """The supply fails within an interrupt, for up to 20 ms."""
        self._board.brown_out(int(self.draw.integers(0, 400)))
        self._current = 0.0
        self.advance(int(self.draw.integers(1, 21)))


KINDS: Final = (_Faults.late, _Faults.lost_frames, _Faults.wrong_counts, _Faults.frozen, _Faults.brown_out)


def run_faults(
    firmware: Firmware, processor: Processor, samples: int, folder: Path, *, seed: int
) -> FaultyRun:
    """Run the firmware with a fault every half second, drawn by chance."""
    plant = Unit(firmware.plant, folder / "faults")
    given = {kind.__name__.strip("_").replace("_", " "): 0 for kind in KINDS}
    lost = beyond = unflagged = 0
    worst = 0.0
    with EmulatedBoard(firmware.image, processor, firmware.shift) as board:
        run = _Faults(firmware, board, plant, seed)
        run.sample()
        while run.samples < samples:
            kind = KINDS[int(run.draw.integers(len(KINDS)))]
            kind(run)
            given[kind.__name__.replace("_", " ")] += 1
            for k in range(500):
                before = run.cells.samples
                error = run.sample()
                lost += run.cells.samples != before + 1 and k > 0
                beyond += not (math.isfinite(run.cells.current) and abs(run.cells.current) <= firmware.limit)
                if k >= 300:
                    worst = max(worst, error)
                    unflagged += error > 0.01 * SPAN and run.cells.status == 0
        cells = run.cells
    plant.end()
    restarts = cells.starts - 1 - given["brown out"]
    return FaultyRun(run.samples, given, cells.faults, restarts, lost, beyond, unflagged, worst)


ROWS: Final = {
    f"{kind}/{processor.name.removeprefix('Cortex-')}/{real}": (kind, processor, real)
    for kind in ("cascade", "corrected")
    for real in ("float", "double")
    for processor in PROCESSORS
}


def head(kind: str, processor: Processor, real: str) -> str:
    """Return the first cells of a row."""
    return f"| {kind} observer and scheduled controller | {processor.name} | {real} |"


def measured(name: str, seconds: float, faulty: int) -> tuple[dict[str, list[str]], bool]:
    """Return a row of both tables, and whether all holds."""
    kind, processor, real = ROWS[name]
    with tempfile.TemporaryDirectory() as made_in:
        folder = Path(made_in)
        firmware = made(processor, real, folder, corrected=kind == "corrected")
        begin = time.monotonic()
        run = run_both(firmware, processor, round(seconds / STEP), folder)
        print(f"{name}: {run} in {time.monotonic() - begin:.0f} s", flush=True)
        broken = run_faults(firmware, processor, faulty, folder, seed=1)
        print(f"{name}: {broken} in {time.monotonic() - begin:.0f} s", flush=True)
    first = head(kind, processor, real)
    peer = "FMU in FMPy" if real == "double" else "C on this machine"
    faults = ", ".join(f"{count} {fault}" for fault, count in broken.given.items())
    counts = (broken.processor_faults, broken.restarts, broken.lost, broken.beyond, broken.unflagged)
    same = (
        f"{first} {peer} | {run.samples:,} | {run.differing or 'none'} | {1e3 * run.tracking:.0f} | "
        f"{run.instructions[0]:,} | {run.instructions[1]:,} |"
    )
    wrong = f"{first} {broken.samples:,} | {faults} | {' | '.join(str(n or 'none') for n in counts)} |"
    return {"same": [same], "faults": [wrong]}, not run.differing and not any(counts)


def main() -> int:
    """Run, and write or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("rows", nargs="*", help=f"of {', '.join(ROWS)}; all by default")
    parser.add_argument("--check", action="store_true", help="write nothing")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the comparison")
    parser.add_argument("--faulty", type=int, default=100_000, help="samples with faults")
    given = parser.parse_args()
    if unknown := [name for name in given.rows if name not in ROWS]:
        parser.error(f"there is no row {unknown[0]!r}; rows are {', '.join(ROWS)}")
    order, holds = [head(*row) for row in ROWS.values()], True
    for name in given.rows or ROWS:
        rows, held = measured(name, given.seconds, given.faulty)
        holds &= held
        if not given.check:
            page = PAGE.read_text(encoding="utf8")
            for table, new in rows.items():
                page = with_rows(page, table, order, new)
            PAGE.write_text(page, encoding="utf8")
    return int(not holds)


if __name__ == "__main__":
    raise SystemExit(main())
