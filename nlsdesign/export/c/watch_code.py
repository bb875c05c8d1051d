"""The C of a monitor: residuals of the blocks as an exported step, and beside it the moments that are judged.

A mean over `LENGTH` samples is one residual r. With y = (φ₁ … φₖ, r) the sums of y·yᵀ are the evidence: r = Σ
δᵢ·φᵢ is solved from them by least squares, δᵢ in units of the change that is to be noticed.
:class:`WatchTwin` computes the same in Python, operation by operation.
"""

from __future__ import annotations

import hashlib
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...model.flat import FlatModel
from ..files import write_all
from .c_text import Real, comment, half_byte_sums, identifier, origin_lines, stamped
from .controller_code import export_c
from .writer import CSource

LENGTH = 20
"""Samples whose mean is one residual."""
PERIOD, MEMORY = 10.0, 150.0
"""Time between two judgements, and time constant of the evidence that is kept, s."""
RECENTLY = 0.75
"""Share of the recent evidence that is kept from one judgement to the next."""
LIMIT, SURE, LEAST = 0.5, 4.0, 200.0
"""Share of the change to be noticed at which it is reported; standard errors that it must have; means that
are needed."""
PRIOR = 1.0
"""Standard deviation of a change before anything was seen, in changes that are to be noticed."""
RIDGE = 1e-5
"""Share of its square by which a change is held, so that what no motion tells apart is solved in single
precision."""
SPEEDS, LOAD, WARM = (5.0, 25.0), 0.1, 35.0
"""Between bins: speeds as multiples of the least one, load as a share of the largest drive, temperature in
degrees Celsius."""
BINS = 12
KINDS, SOME = 4, 10.0
"""Bins of speed and load that a varied motion meets at least (2 where there is no dry friction, as speed is
not divided there), and how many means of each: where one motion repeats, rounding looks like a change."""
MISFIT, ONE_MOTION, FIRST_BIT = 16, 32, 8
"""Bits where more efforts are left than the usual load, and where the motion is too much alike; first bit of
a change."""
VERSION = 1
MAGIC = 0x57534C4E  # "NLSW"
CHECKED = 8  # bytes at the end that the checksum does not cover


@dataclass(frozen=True)
class WatchedBlock:
    """A block of a machine and the changes that its residual can tell.

    Parameters
    ----------
    name
        Body whose efforts it balances.
    changes
        Names of the changes, in the order of the outputs.
    noticed
        The change of each that is to be noticed: a share of the number, or what `units` says.
    units
        Unit of each; empty for a share of the number.
    least_speed
        Speed below which dry friction may stick, so that nothing is taken; 0 without friction.
    usual_load
        Load between the bins of little and much.
    """

    name: str
    changes: tuple[str, ...]
    noticed: tuple[float, ...]
    units: tuple[str, ...]
    least_speed: float
    usual_load: float


@dataclass(frozen=True, eq=False)
class WatchPlan:
    """What a monitor computes: residuals as a sampled model, and what its outputs are.

    Parameters
    ----------
    model
        Of each block in turn: what each change adds, the residual, speed and load.
    blocks
        In the order of the outputs.
    settling
        Time until the filters have settled, s.
    between
        Time between two judgements, s.
    least
        Means of late that a judgement needs.
    some
        Means in a bin from which on its kind of motion was seen.
    unseen
        Numbers of the machine that its readings do not show, so that they are not watched.
    """

    model: FlatModel
    blocks: tuple[WatchedBlock, ...]
    settling: float
    between: float = PERIOD
    least: float = LEAST
    some: float = SOME
    unseen: tuple[str, ...] = ()

    @property
    def most(self) -> int:
        """Changes of the block that has most."""
        return max(len(block.changes) for block in self.blocks)

    @property
    def period(self) -> int:
        """Means between two judgements."""
        return max(2, round(self.between / (LENGTH * float(self.model.sample_time or 1.0))))

    @property
    def digest(self) -> tuple[int, int, int, int]:
        """Two words of the deck, and two of what is watched."""
        deck = hashlib.sha256((self.model.origin.digest if self.model.origin else "").encode()).digest()
        settings = repr(
            (
                self.model.sample_time,
                self.blocks,
                LENGTH,
                self.between,
                MEMORY,
                RECENTLY,
                PRIOR,
                SPEEDS,
                LOAD,
                WARM,
            )
        )
        words = np.frombuffer(deck[:8] + hashlib.sha256(settings.encode()).digest()[:8], "<u4")
        return tuple(map(int, words))  # type: ignore[return-value]

    def layout(self, real: Real) -> np.dtype[Any]:
        """Return the record as it lies in memory."""
        number, blocks = ("<f4" if real is Real.FLOAT else "<f8"), len(self.blocks)
        moments = np.dtype(
            [("count", number), ("products", number, ((self.most + 1) * (self.most + 2) // 2,))]
        )
        words = [(name, "<u4") for name in ("magic", "version", "size", "real")]
        return np.dtype([
            *words, ("digest", "<u4", (4,)), ("judged", "<u4"), ("word", "<u4"),
            ("reference", number, (blocks, self.most)), ("recent", moments, (blocks,)),
            ("bins", moments, (blocks, BINS)), ("checksum", "<u4"), ("spare", "<u4"),
        ])  # fmt: skip

    def first_bit(self, number: int) -> int:
        """Return the bit of the first change of a block in the word."""
        return FIRST_BIT + sum(len(block.changes) for block in self.blocks[:number])


@dataclass(frozen=True, eq=False)
class WatchSource:
    """C files of a monitor.

    Parameters
    ----------
    plan
        What they compute.
    name, real
        Prefix of all C names, and the number type.
    residuals
        The step that gives the residuals.
    header, source, selftest
        Paths of the monitor and of the program that tests it.
    """

    plan: WatchPlan
    name: str
    real: Real
    residuals: CSource
    header: Path
    source: Path
    selftest: Path

    @property
    def files(self) -> tuple[Path, ...]:
        """All files."""
        own = (self.header, self.source, self.selftest)
        return (*own, self.residuals.header, self.residuals.source, self.residuals.selftest)


def export_watch(
    plan: WatchPlan, folder: str | Path, *, real: Real | str = Real.FLOAT, name: str = "watch"
) -> WatchSource:
    """Write the C of a monitor, with its self-test."""
    number, prefix = Real.named(real), identifier(name)
    if plan.first_bit(len(plan.blocks)) > 32:
        raise ExportError(f"deck '{plan.model.name}'", "has more numbers to watch than a word has bits",
                          next_step="watch a part of it: a deck with fewer readings")  # fmt: skip
    residuals = export_c(plan.model, folder, real=number, name=f"{prefix}_residuals")
    values = _values(plan, number, residuals)
    values |= {"name": prefix, "NAME": prefix.upper()}
    texts = {
        Path(folder) / f"{prefix}{ending}": residuals.writer.filled(template, values)
        for ending, template in ((".h", "watch.h"), (".c", "watch.c"), ("_selftest.c", "watch_selftest.c"))
    }
    write_all({path: stamped(text, plan.model) for path, text in texts.items()})
    return WatchSource(plan, prefix, number, residuals, *texts)


def _block_rows(plan: WatchPlan, real: Real, residuals: CSource) -> tuple[list[str], list[str], list[str]]:
    """Return for each block what its bits mean, its numbers, and the outputs that are given of it."""
    names, numbers, given = [], [], []
    paths = iter(residuals.writer.paths.outputs)
    for i, block in enumerate(plan.blocks):
        first = plan.first_bit(i)
        for k, (change, noticed, unit) in enumerate(
            zip(block.changes, block.noticed, block.units, strict=True)
        ):
            size = f"{noticed:g} {unit}" if unit else f"{100.0 * noticed:g} %"
            names.append(
                f"/* bit {first + k}: {comment(change)} has changed by some {size}, as "
                f"{comment(block.name)} shows */"
            )
        speeds = ", ".join(real.literal(s) for s in _bounds(block))
        load = real.literal(block.usual_load)
        numbers.append(
            f"{{{len(block.changes)}u, {first}u, {_kinds(block)}u, {real.literal(block.least_speed)}, "
            f"{{{speeds}}}, {load}}},"
        )
        cells = [f"outputs.{next(paths)}" for _ in range(len(block.changes) + 3)]
        cells[-3:-3] = [real.literal(0.0)] * (plan.most - len(block.changes))
        given.append(", ".join(cells) + ",")
    return names, numbers, given


def _values(plan: WatchPlan, real: Real, residuals: CSource) -> dict[str, str | list[str]]:
    names, numbers, given = _block_rows(plan, real, residuals)
    model, pairs = plan.model, (plan.most + 1) * (plan.most + 2) // 2
    title = [
        f"/* Monitor of {comment(model.name)}: whether the model holds in use.",
        f"   Sample time {model.sample_time!r} s; all numbers in SI units.", *origin_lines(model),
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]  # fmt: skip
    literals = {
        "one": 1.0,
        "prior": PRIOR**-2,
        "ridge": RIDGE,
        "tiny": 1e-30,
        "least": plan.least,
        "some": plan.some,
        "limit": LIMIT,
        "sure": SURE**2,
        "kept": _kept(plan),
        "recently": RECENTLY,
        "share": 1.0 / LENGTH,
        "warm": WARM,
        "enough": 5.0 * plan.least,
    }
    return {
        "title": title,
        "blocks": str(len(plan.blocks)),
        "most": str(plan.most),
        "pairs": str(pairs),
        "bins": str(BINS),
        "kinds": str(KINDS),
        "length": str(LENGTH),
        "period": str(plan.period),
        "memory": f"{MEMORY:g}",
        "names": names,
        "numbers": numbers,
        "fabs": real.function("fabs"),
        "settling": str(max(1, round(plan.settling / float(model.sample_time or 1.0)))),
        "given": given,
        "magic": f"0x{MAGIC:08x}u",
        "version": str(VERSION),
        "digest": ", ".join(f"0x{w:08x}u" for w in plan.digest),
        "half_bytes": half_byte_sums(),
        **{key: real.literal(value) for key, value in literals.items()},
        **_test_values(plan, real),
    }


def _bounds(block: WatchedBlock) -> tuple[float, float]:
    return SPEEDS[0] * block.least_speed, SPEEDS[1] * block.least_speed


def _kinds(block: WatchedBlock) -> int:
    return KINDS if block.least_speed > 0.0 else 2


def _kept(plan: WatchPlan) -> float:
    return math.exp(-plan.between / MEMORY)


class WatchTwin:
    """The monitor in Python from the residuals on, operation by operation as the C has it.

    ``plan``: what is watched. ``settling``: samples that are passed over, as the plan says by default.
    """

    def __init__(self, plan: WatchPlan, real: Real = Real.FLOAT) -> None:
        self.plan = plan
        self._r: Any = np.float32 if real is Real.FLOAT else np.float64
        self.record = np.zeros((), plan.layout(real))
        for name, value in (
            ("magic", MAGIC),
            ("version", VERSION),
            ("size", self.record.nbytes),
            ("word", 2),
        ):
            self.record[name] = value
        self.record["real"], self.record["digest"] = self._r(0).nbytes, plan.digest
        self._settling = max(1, round(plan.settling / float(plan.model.sample_time or 1.0)))
        self._sums: list[Any] = [[self._r(0)] * (plan.most + 3) for _ in plan.blocks]
        self._means: list[Any] = [[] for _ in plan.blocks]
        self._held: list[Any] = [(0, []) for _ in plan.blocks]
        self._ways = [[0, 0] for _ in plan.blocks]
        self._refused, self._forward, self._fresh = ([first] * len(plan.blocks) for first in (1, 0, 0))
        self._sample, self._mean_count, self._task, self._found, self.kinds = 0, 0, 0, 0, 0
        self._pairs = [(i, j) for i in range(plan.most + 1) for j in range(i + 1)]
        self.work: Any = np.zeros((plan.most + 1, plan.most + 1), self._r)

    def take(self, given: Sequence[Sequence[float]], usable: bool = True, temperature: float = 0.0) -> int:
        """Look at what the residuals give of one sample, for each block; return the word."""
        blocks, most = self.plan.blocks, self.plan.most
        self._settling, usable = max(0, self._settling - 1), usable and self._settling == 0
        for i, block in enumerate(blocks):
            row = [self._r(v) for v in given[i]]
            row = [*row[:-3], *[self._r(0)] * (most + 3 - len(row)), row[-3], abs(row[-2]), abs(row[-1])]
            self._sums[i] = [a + b for a, b in zip(self._sums[i], row, strict=True)]
            self._refused[i] += not (usable and row[most + 1] >= self._r(block.least_speed))
            self._forward[i] += given[i][-2] > 0.0
        if self._sample < len(blocks):
            self._finish(self._sample, temperature)
        elif self._sample < 2 * len(blocks):
            number = self._sample - len(blocks)
            if self._fresh[number]:
                self._add(self.record["recent"][number], self._means[number])
        elif self._task:
            self._go_on()
        self._sample = (self._sample + 1) % LENGTH
        if self._sample == 0:
            self._mean_count += 1
            if self._mean_count == self.plan.period:
                self._mean_count, self._task, self._found = 0, 1, 0
        return int(self.record["word"]) | (4 if self._refused[0] else 0)

    def _finish(self, number: int, temperature: float) -> None:
        block, r, most = self.plan.blocks[number], self._r, self.plan.most
        share, sums, way = r(1.0 / LENGTH), self._sums[number], 0 if self._refused[number] else 1
        if way and block.least_speed > 0.0:
            way = {0: 3, LENGTH: 2}.get(self._forward[number], 0)
        self._fresh[number] = int(bool(way) and self._ways[number] == [way, way])
        if self._fresh[number]:
            bin_, mean = self._held[number]
            for i in range(most):
                mean[most] -= self.record["reference"][number][i] * mean[i]
            self._means[number] = mean
            self._add(self.record["bins"][number][bin_], mean)
        self._ways[number] = [self._ways[number][1], way]
        speed = sums[most + 1] * share
        slow, fast = (r(s) for s in _bounds(block))
        bin_ = 2 if speed > fast else 1 if speed > slow else 0
        bin_ += 3 * (sums[most + 2] * share > r(block.usual_load)) + 6 * (r(temperature) > r(WARM))
        self._held[number] = bin_, [value * share for value in sums[: most + 1]]
        self._sums[number] = [r(0)] * (most + 3)
        self._refused[number] = self._forward[number] = 0

    def _add(self, moments: Any, mean: Sequence[Any]) -> None:
        moments["count"] += self._r(1)
        products = moments["products"]
        for at, (i, j) in enumerate(self._pairs):
            products[at] += mean[i] * mean[j]

    def _go_on(self) -> None:
        """Do one piece of the judgement: forget, fill a matrix, sweep it over a change, or judge."""
        each, r, work, most = BINS + 2 * self.plan.most + 2, self._r, self.work, self.plan.most
        number, piece = divmod(self._task - 1, each)
        k, recent = len(self.plan.blocks[number].changes), self.record["recent"][number]
        if piece < BINS:
            bins = self.record["bins"][number]
            # The twin is never commissioned.
            self.kinds = self.kinds if piece else 0
            seen = (
                piece < BINS // 2
                and bins["count"][piece] + bins["count"][piece + BINS // 2] >= self.plan.some
            )
            self.kinds += int(seen)
            _forget(bins[piece], r(_kept(self.plan)))
        elif piece == BINS:
            for value, (i, j) in zip(recent["products"], self._pairs, strict=True):
                work[i, j] = work[j, i] = value
            prior = (work[most, most] / (recent["count"] + r(1))) * r(PRIOR**-2) + r(1e-30)
            for i in range(most):
                work[i, i] += (work[i, i] * r(RIDGE)) + prior
        elif piece <= BINS + 2 * k and piece % 2 == BINS % 2:
            pivot = (piece - BINS) // 2 - 1
            inverse = r(1) / work[pivot, pivot]
            work[pivot] *= inverse
            work[pivot, pivot] = inverse
            for i in range(len(work)):
                if i != pivot:
                    factor = work[i, pivot]
                    work[i, pivot] = 0
                    work[i] -= factor * work[pivot]
        elif piece == each - 1:
            self._found |= self._judged(recent, number)
            _forget(recent, r(RECENTLY))
            if number == len(self.plan.blocks) - 1:
                self.record["word"], self._task = self._found, -1
                self.record["judged"] += 1
        self._task += 1

    def _judged(self, moments: Any, number: int) -> int:
        k, r, work = len(self.plan.blocks[number].changes), self._r, self.work
        if moments["count"] < r(self.plan.least):
            return 2
        if self.kinds < _kinds(self.plan.blocks[number]):
            return 2 | ONE_MOTION
        variance, bits = work[-1, -1] / (moments["count"] - r(k)), 0
        for i in range(k):
            change = work[i, -1]
            if (
                work[i, i] > 0
                and abs(change) > r(LIMIT)
                and change * change > r(SURE**2) * variance * work[i, i]
            ):
                bits |= 1 | 1 << (self.plan.first_bit(number) + i)
        load = r(self.plan.blocks[number].usual_load)
        return bits | (1 | MISFIT if variance > load * load else 0)


def _forget(moments: Any, kept: Any) -> None:
    moments["count"] *= kept
    moments["products"] *= kept


TEST_PERIODS = 2.2
"""Periods of the self-test."""


def drawn_rows(plan: WatchPlan, count: int) -> list[list[list[float]]]:
    """Return residuals of a machine whose first change of each block is as large as is to be noticed.

    Shape (count, blocks, changes + 3). Whole numbers over a power of two, which C makes again; speed and load
    are of another bin in each mean.
    """
    random, rows = 1, []
    for k in range(count):
        row, turn = [], k // LENGTH
        for block in plan.blocks:
            draws = []
            for _ in block.changes:
                random = (1664525 * random + 1013904223) & 0xFFFFFFFF
                draws.append(float((random >> 20) - 2048) / 4096.0)
            speeds, loads = _test_motion(block)
            row.append([*draws, draws[0], speeds[turn % 3], loads[turn % 2]])
        rows.append(row)
    return rows


def _test_motion(block: WatchedBlock) -> tuple[Sequence[float], Sequence[float]]:
    """Return speeds and loads of the self-test, of each bin one."""
    speed = block.least_speed or 1.0
    return [1.5 * speed, 10.0 * speed, 50.0 * speed], [0.5 * block.usual_load, 2.0 * block.usual_load]


def _test_values(plan: WatchPlan, real: Real) -> dict[str, str | list[str]]:
    """Return what the self-test compares with: word and evidence that the twin has after the same rows."""
    count = round(TEST_PERIODS * plan.period * LENGTH)
    twin = WatchTwin(replace(plan, settling=0.0), real)
    for row in drawn_rows(plan, count):
        twin.take(row)
    rows = [[float(v) for v in (m["count"], *m["products"])] for m in twin.record["recent"]]
    rows += [[float(v) for v in (m["count"].sum(), *m["products"].sum(axis=0))] for m in twin.record["bins"]]
    drawn, most = [], plan.most
    for first, block in zip(range(0, len(plan.blocks) * (most + 3), most + 3), plan.blocks, strict=True):
        for k in range(len(block.changes)):
            number = f"(({real})(word >> 20u) - {real.literal(2048.0)}) / {real.literal(4096.0)}"
            drawn += ["word = (1664525u * word) + 1013904223u;", f"given[{first + k}] = {number};"]
        (slow, middle, fast), (little, much) = (map(real.literal, row) for row in _test_motion(block))
        drawn += [
            f"given[{first + most}] = given[{first}];",
            f"given[{first + most + 1}] = "
            f"(turn % 3u == 0u) ? {slow} : ((turn % 3u == 1u) ? {middle} : {fast});",
            f"given[{first + most + 2}] = (turn % 2u == 0u) ? {little} : {much};",
        ]
    return {
        "test_samples": str(count),
        "expected": real.table("expected", rows),
        "drawn": drawn,
        "expected_word": f"0x{int(twin.record['word']):x}u",
        "tolerance": real.literal(2e-4 if real is Real.FLOAT else 1e-9),
    }


def read_watch_record(path: str | Path, plan: WatchPlan) -> np.ndarray[Any, Any]:
    """Return the evidence that a monitor has kept."""
    place = str(path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise ExportError(place, f"cannot be read: {error.strerror or error}") from None
    head = np.frombuffer(content[:32].ljust(32, b"\0"), "<u4")
    if head[0] != MAGIC:
        raise ExportError(
            place, "is no record of a monitor", next_step="write `state.record` to it after NAME_seal"
        )
    if head[1] != VERSION:
        raise ExportError(
            place,
            f"has version {head[1]} of the format, {VERSION} is read",
            next_step="export the monitor again",
        )
    if tuple(head[4:6]) != plan.digest[:2]:
        raise ExportError(
            place,
            f"is of another deck than {plan.model.origin.deck if plan.model.origin else 'this one'}",
            next_step="name the deck that the monitor was exported from, with --deck",
        )
    if tuple(head[6:8]) != plan.digest[2:]:
        raise ExportError(
            place,
            "is of another monitor of this deck: another sample time or another version of nlsdesign",
            next_step="give its --sample-time, or read it with the version that exported it",
        )
    layout = plan.layout(Real.FLOAT if head[3] == 4 else Real.DOUBLE)
    if len(content) != layout.itemsize or head[2] != layout.itemsize:
        raise ExportError(
            place,
            f"has {len(content)} bytes where a record has {layout.itemsize}: it was cut, or has more in it",
            next_step="write the whole of `state.record` to it after NAME_seal",
        )
    record = np.frombuffer(content, layout)[0:1].reshape(())
    if zlib.crc32(content[: layout.itemsize - CHECKED]) != int(record["checksum"]):
        raise ExportError(
            place, "is damaged: the checksum does not fit", next_step="seal the record and write it again"
        )
    if not all(
        np.all(np.isfinite(record[group][field]))
        for group in ("recent", "bins")
        for field in ("count", "products")
    ):
        raise ExportError(place, "holds numbers that are not finite", next_step="start the monitor anew")
    return record
