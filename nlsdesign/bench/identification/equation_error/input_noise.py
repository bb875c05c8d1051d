"""The colour of the noise of an input, such as a current, that is no motion.

What drives a block varies for other reasons than noise, and at rest too, so neither rest nor repetition shows
its noise. Two other looks do, and both must show the same:

- *Above all motion.* From the frequency on from which no motion leaves the counts that it is between, what is
  in a signal moves nothing. A reading that flips between two counts has a variance of a quarter of their
  square, the most that it can have; what a signal may do there unseen follows from what a motion costs at
  least, per acceleration, where it is seen. Records in which that is more than the white noise are used where
  no other record tells, white or coloured, as on a drive without a gear, and three do: then the other look
  decides.
- *What is left of a block* that the signal drives, whatever its numbers are and whichever plain functions of
  the motion it lacks. It bounds the noise from above at the frequencies of the motion.

Noise is taken to be white noise and one first-order process, with a time of its own in each record. It is
accepted if this describes both, and if what is left of the block is then white, and as large in slow as in
fast motion, early as late: what a machine lacks goes with its motion, noise does not. Jumps of a current by
friction that sticks come with reversals. Where one record that shows its noise contradicts, or where nothing
is left of the block beyond white noise, noise counts as white.

Source: Söderström and Stoica 1989, chapter 11 (tests of whiteness and of independence).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ....foundation.arrays import Array
from ..filters import derivative
from ..records.measurement import Record, RecordSet
from .block import BlockNoise
from .inferred_sampling import freed, functions_of_motion, rows_of
from .noise import Band, Colour, Noise, NoisePart, Stretch, bands_of, fitted_at, is_white, scatter

_SURELY = 3.0
"""Standard errors of a band by which a motion stands out of its counts to be seen: by chance, one band in a
thousand does."""
_LEAST_BANDS, _LEAST_RECORDS = 4, 3
_SEEN = 9.0
"""Deviance by which a first-order process must describe the bands above all motion better than none does."""
_OPEN = 1.2
"""Mean square of what is left of a block, in that of white noise, up to which there is nothing to explain."""
_OWN = 0.5
"""Share of the floor of a block that comes from the noise of a signal, at least, for the block to show it."""
_BESIDE = (0.003, 0.03, 0.1)
"""Noise in the rows of a block beside that of the signal, in the variance of its white one: what is taken of
counts, and what a filter passes where it passes next to nothing. The likeliest is taken."""
_MOST_ROWS, _LEAST_ROWS, _TIMES = 400, 40, 12
_LONGEST = 0.1
"""Share of a record after which a process has forgotten all but 37 %, at most: what is slower is not seen."""


def with_colour_of_inputs(noise: Noise, records: RecordSet, seen: Sequence[BlockNoise]) -> Noise:
    """Return the noise with the colour of inputs of blocks that are no motions, where the records show it."""
    drives = [drive for each in seen for drive in each.block.drives.values()]
    moving = dict.fromkeys(d.signal for d in drives if d.order > 0)
    targets = {each.block.target for each in seen}
    counts = {name: math.sqrt(12.0) * noise.level[name] for name in moving if noise.rounded[name]}
    for signal in dict.fromkeys(d.signal for d in drives if d.signal not in {*moving, *targets}):
        if noise.rounded[signal] or noise.parts.get(signal):
            continue
        read = _Signal(signal, noise, tuple(records.deciding))
        # The bands above all motion of each record in which they show a colour.
        above = {record.name: read.above_motion(record, counts) for record in read.records}
        sure = {name: bands for name, (bands, hidden) in above.items() if bands and not hidden}
        shown = sure or {name: bands for name, (bands, _) in above.items() if bands}
        white = any(not bands and not hidden for bands, hidden in above.values())
        if not sure and (white or len(shown) < _LEAST_RECORDS):
            continue
        for each in seen if shown else ():
            colours = read.colours(each, shown)
            if colours:
                lengths = [r.step * len(r.trace) for r in read.records if r.name in colours]
                noise = noise.with_colours(signal, colours, lengths)
                break
    return noise


class _Rows(NamedTuple):
    """What is left of a block in some rows over its floor, and the share of a signal in that."""

    left: Array
    places: NDArray[np.int64]
    share: float
    width: float  # of the filter in s


class _Signal(NamedTuple):
    """A signal whose colour is looked for in records, with all noise as it is without that."""

    name: str
    noise: Noise
    records: tuple[Record, ...]

    def above_motion(self, record: Record, counts: Mapping[str, float]) -> tuple[list[Band], bool]:
        """Return the bands of the signal above all motion, none where they look white.

        Beside them, whether a motion that moves no count may be in them.
        """
        highest, hidden = 0.0, 0.0
        spent = bands_of([Stretch(record.trace[self.name], record.step, 0)])
        for name, count in counts.items():
            unseen = count**2 / 4.0
            moved = bands_of([Stretch(record.trace[name], record.step, 0)])
            costs = {
                own.frequency: own.density / (motion.density * own.frequency**4)
                for motion, own in zip(moved, spent, strict=True)
                if motion.density > unseen * math.exp(_SURELY * scatter(motion.number))
            }
            if costs:
                highest = max(highest, max(costs))
                hidden = max(hidden, unseen * min(costs.values()))
        above = [band for band in spent if band.frequency > highest][1:]  # the next band is partly below
        if not counts or len(above) < _LEAST_BANDS or not all(band.density for band in above):
            return [], True
        plain, *others = (fitted_at(time, above, record.step).deviance for time in (0.0, *_times(record)))
        moves = hidden * above[0].frequency ** 4 >= self.noise.level[self.name] ** 2
        return above if min(others) < plain - _SEEN else [], moves

    def colours(self, seen: BlockNoise, shown: Mapping[str, list[Band]]) -> dict[str, Colour]:
        """Return the colour of the signal in each record that shows it; none where one contradicts."""
        block, filters, floors = seen.block, seen.filters, seen.floors
        chosen = [record for record in self.records if record.name in floors]
        shares = {record.name: floors[record.name].shares.get(self.name, 0.0) for record in chosen}
        if not shares or float(np.mean(list(shares.values()))) < _OWN:
            return {}
        rows = rows_of(seen, chosen, [{}], functions_of_motion)
        left = freed(rows.residuals, np.column_stack([*rows.numbers.values(), rows.own]))[0][0]
        if float(np.mean(left**2)) < _OPEN:
            return {}
        motions = dict.fromkeys(d.signal for d in block.drives.values() if d.order > 0)
        colours, behind = dict[str, Colour](), 0
        for record in chosen:
            places = floors[record.name].places
            own, behind = left[behind : behind + len(places)], behind + len(places)
            if record.name in shown and len(own) >= _LEAST_ROWS:
                first = _Rows(own[:_MOST_ROWS], places[:_MOST_ROWS], shares[record.name], filters.width)
                colour, white = self.likeliest(record, first, shown[record.name])
                rates = (
                    derivative(record.trace[m], record.step, order=1, span=filters.span) for m in motions
                )
                if not all(is_white(white, np.abs(rate[first.places])) for rate in rates):
                    return {}
                colours[record.name] = colour
        return colours

    def likeliest(self, record: Record, rows: _Rows, bands: Sequence[Band]) -> tuple[Colour, Array]:
        """Return the colour by bands above all motion and rows of a block, and these rows whitened."""
        apart = np.abs(rows.places[:, None] - rows.places[None, :])
        count, behind = int(apart.max()), dict[float, Array]()
        for time in (0.0, *_times(record)):
            lags = self.noise.covariance(self.name, record.step, width=rows.width, time=time, count=count)
            behind[time] = lags[apart]
        level, others = self.noise.level[self.name] ** 2, 1.0 - min(rows.share, 1.0)
        best, result = -math.inf, (Colour(level, ()), rows.left)
        for time in _times(record):
            fit = fitted_at(time, bands, record.step)
            own = fit.white * behind[0.0] + fit.variance * behind[time]
            for beside in _BESIDE:
                whole = rows.share / (level * behind[0.0][0, 0]) * own + (others + beside) * np.eye(len(own))
                factor = np.linalg.cholesky(whole)
                whitened = scipy.linalg.solve_triangular(factor, rows.left, lower=True)
                likelihood = -0.5 * float(whitened @ whitened) - float(np.sum(np.log(np.diag(factor))))
                if likelihood - 0.5 * fit.deviance > best:
                    best = likelihood - 0.5 * fit.deviance
                    result = Colour(fit.white, (NoisePart(fit.variance, time),)), whitened
        return result


def _times(record: Record) -> list[float]:
    return [float(t) for t in np.geomspace(record.step, _LONGEST * record.step * len(record.trace), _TIMES)]
