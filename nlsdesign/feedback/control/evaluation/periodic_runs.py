"""Many runs of a closed loop on periodic drives at once, each until its answer repeats itself.

Runs whose windows are of similar length share a batch. Every batch first runs through its transient, then
window after window until the fundamental of the torque is the same in two that follow each other, or until
the longest time that is allowed. The last two windows are what is evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ....simulation.buffered import Translate, as_it_is
from ....simulation.sampled_batch import run_batch
from ..loop.closed_loop import ClosedLoop
from .loop_verdict import UNSETTLED, LoopJudge, LoopVerdict, without_harmonics

Array = NDArray[np.float64]
Drives = Callable[[Array, NDArray[np.intp]], Mapping[str, Array | float]]
"""Takes times, shape (T,), and the numbers of the runs; returns open inputs, shape (runs, T) or numbers."""

TRANSIENT = 0.5
"""Shortest time in s before the first window."""
WINDOWS, LONGEST = 6, 4.0
"""Windows and time in s after both of which a run that still changes is given up."""
_SAME = 0.005
"""Change of the fundamental from window to window below which the answer counts as periodic."""
_SHARE_OF_COUNT = 0.2
"""Change of the fundamental that counts alone make, in counts; a held torque may wander by a whole one."""
_SIMILAR = 1.5
_SHORTEST = 0.25
"""Shortest window in s: three swings of whatever oscillates faster than 12 Hz."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PeriodicDrive:
    """Which runs are made.

    Parameters
    ----------
    frequencies
        In Hz, one per run, shape (runs,); rounded so that whole cycles fill whole samples. Zero is a
        constant drive, whose windows last half a second.
    drives
        Open inputs over time.
    parameters
        Parameters of the loop by full name, numbers or shape (runs,).
    cycles
        Cycles in a window; by default as many as make a quarter of a second, and at least one.
    """

    frequencies: Array
    drives: Drives
    parameters: Mapping[str, Array | float] = field(default_factory=dict)
    cycles: int | None = None

    def windows(self, sample_time: float) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """Return samples and cycles of the window of each run, and the frequencies that fit them.

        Parameters
        ----------
        sample_time
            In s.

        Raises
        ------
        ValueRangeError
            If a frequency is not between zero and half the sampling frequency.
        """
        for f in self.frequencies:
            if not 0.0 <= f < 0.5 / sample_time:
                raise ValueRangeError(
                    f"frequency {f:g} Hz", f"must lie between 0 and {0.5 / sample_time:g} Hz"
                )
        held = self.frequencies == 0.0
        wanted = np.ceil(_SHORTEST * self.frequencies - 1e-9) if self.cycles is None else self.cycles
        cycles = np.where(held, 0.0, np.maximum(wanted, 1.0) * np.ones(len(self.frequencies)))
        length = np.where(held, TRANSIENT, cycles / np.where(held, 1.0, self.frequencies))
        samples = np.round(length / sample_time)
        return samples.astype(np.intp), cycles.astype(np.intp), cycles / (samples * sample_time)


@dataclass(frozen=True, eq=False)
class PeriodicRun:
    """The last two windows of a run.

    Parameters
    ----------
    frequency
        Of the drive in Hz.
    cycles
        In both windows together.
    time
        In s, shape (n,).
    signals
        By full name, shape (n,).
    verdict
        What the run turned out to be.
    """

    frequency: float
    cycles: int
    time: Array
    signals: Mapping[str, Array]
    verdict: LoopVerdict

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (n,).

        Parameters
        ----------
        name
            Full name.
        """
        return self.signals[name]

    def fundamental(self, name: str) -> complex:
        """Return c of the fundamental Re(c·e^(jωt)) of a signal.

        Parameters
        ----------
        name
            Full name.
        """
        turn = np.exp(-2j * math.pi * self.frequency * self.time)
        return complex(2.0 * np.mean(self.signals[name] * turn))

    def rms(self, name: str) -> float:
        """Return the root mean square of a signal.

        Parameters
        ----------
        name
            Full name.
        """
        return float(np.sqrt(np.mean(np.square(self.signals[name]))))


def run_periodic(
    loop: ClosedLoop, drive: PeriodicDrive, *, keep: Sequence[str] = (), translate: Translate = as_it_is
) -> list[PeriodicRun]:
    """Run a loop on periodic drives until it repeats itself, or diverges, or time is up.

    Parameters
    ----------
    loop
        Closed loop.
    drive
        Which runs.
    keep
        Further signals to keep, by full name.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ValueRangeError
        If a frequency is not between zero and half the sampling frequency.
    """
    samples, cycles, used = drive.windows(loop.sample_time)
    order, runs = np.argsort(samples), {}
    setup = _Setup(loop, drive, keep)
    while len(order):
        group = order[samples[order] <= _SIMILAR * samples[order[0]]]
        runs.update(_Group(setup, group).run(samples, cycles, used, translate))
        order = order[len(group) :]
    return [runs[i] for i in range(len(samples))]


class _Setup:
    """What all runs share."""

    def __init__(self, loop: ClosedLoop, drive: PeriodicDrive, keep: Sequence[str]) -> None:
        self.drive, self.judge = drive, LoopJudge(loop)
        self.keep = tuple(dict.fromkeys([*self.judge.keep, *keep]))
        self.system = loop.system(drive.drives(np.zeros(1), np.zeros(1, dtype=np.intp)))


class _Group:
    """Runs of similar length, advanced together."""

    def __init__(self, setup: _Setup, group: NDArray[np.intp]) -> None:
        self.loop, self.drive, self.group, self.judge = setup.judge.loop, setup.drive, group, setup.judge
        self.keep, self.system = setup.keep, setup.system
        self.parameters = {
            n: v[group] if isinstance(v, np.ndarray) and v.ndim else v
            for n, v in setup.drive.parameters.items()
        }

    def run(
        self,
        samples: NDArray[np.intp],
        cycles: NDArray[np.intp],
        used: Array,
        translate: Translate,
    ) -> dict[int, PeriodicRun]:
        step, group = self.loop.sample_time, self.group
        length = int(np.max(samples[group]))
        begin, state = 0, None
        shown = {name: np.zeros((len(group), 0)) for name in self.keep}
        result: list[PeriodicRun] = []
        for window in count(1):
            # The transient comes with the first two windows, which are the least that is needed.
            more = 2 * length + round(TRANSIENT / step) if window == 1 else length
            time = step * (begin + np.arange(more + 1.0))
            batch = run_batch(
                self.system, (more - 1) * step, inputs=self.drive.drives(time, group),
                parameters=self.parameters, start=state, keep=self.keep, translate=translate,
            )  # fmt: skip
            state = {name: batch.final[:, i] for i, name in enumerate(self.system.states)}
            begin += more
            shown = {n: np.concatenate([v, batch[n]], axis=1)[:, -2 * length :] for n, v in shown.items()}
            result = [
                self._evaluated({n: v[k, -2 * int(samples[i]) :] for n, v in shown.items()},
                                int(cycles[i]), float(used[i]), step * begin)
                for k, i in enumerate(group)
            ]  # fmt: skip
            if (window >= WINDOWS - 1 and step * begin >= LONGEST) or all(
                run.verdict.state != UNSETTLED for run in result
            ):
                break
        return {int(i): run for i, run in zip(group, result, strict=True)}

    def _evaluated(
        self, signals: Mapping[str, Array], cycles: int, frequency: float, end: float
    ) -> PeriodicRun:
        length = len(signals[self.loop.torque])
        steady = self._steady(signals[self.loop.torque], signals[self.judge.angle], 2 * cycles)
        verdict = self.judge.judged(signals, cycles=2 * cycles, steady=steady)
        time = end + self.loop.sample_time * np.arange(-float(length), 0.0)
        return PeriodicRun(frequency, 2 * cycles, time, signals, verdict)

    def _steady(self, torque: Array, angle: Array, cycles: int) -> bool:
        """Tell whether the last window is like the one before, and what the drive leaves does not grow."""
        n = len(torque) // 2
        if not np.all(np.isfinite(torque)):
            return True
        threshold = self.judge.threshold(angle, torque)
        before, after = (np.fft.rfft(half)[1:] / n for half in (torque[:n], torque[n:]))
        number = int(np.argmax(np.abs(after)))
        change, size = 2.0 * abs(after[number] - before[number]), 2.0 * abs(after[number])
        rest = without_harmonics(torque, cycles)
        earlier, later = (float(np.sqrt(np.mean(part**2))) for part in (rest[:n], rest[n:]))
        grows = later > 1.2 * earlier and later > 0.1 * threshold
        noise = (_SHARE_OF_COUNT if cycles else 1.0) * self.judge.torque_of_count(angle)
        return bool(change <= _SAME * size + noise and not grows)
