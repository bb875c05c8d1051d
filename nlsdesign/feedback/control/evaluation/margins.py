"""Gain, phase and delay margins of the linearised sampled loop over the angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....simulation.sampled_batch import PLANT
from ..laws.law_writer import GAIN
from ..loop.closed_loop import ClosedLoop
from .linear_loop import Complex, LinearLoop, linear_loop
from .linear_parts import LinearMode, TableSlope

Array = NDArray[np.float64]

_POINTS = 600

FEEDFORWARD = f"{GAIN}.feedforward"
"""Setting of a law: share of what it feeds forward from the desired torque."""


@dataclass(frozen=True, eq=False)
class LoopMargins:
    """Margins at one opening of the loop over the angle; not a number where the closed loop is unstable.

    Parameters
    ----------
    opening
        Full name of the input at which the loop was cut.
    linear
        The closed loop.
    gain
        Factor in dB by which the gain at the opening may grow, shape (n,); infinite where any growth is
        allowed.
    gain_down
        Factor in dB, negative, by which it may fall; minus infinity where any fall is allowed.
    phase
        In degrees, the least over all crossovers.
    delay
        In s, the least over all crossovers.
    crossover
        Highest frequency in Hz at which the loop gain is one; not a number where there is none.
    """

    opening: str
    linear: LinearLoop
    gain: Array
    gain_down: Array
    phase: Array
    delay: Array
    crossover: Array


def loop_margins(
    loop: ClosedLoop,
    angles: Sequence[float] | Array,
    *,
    opening: str | None = None,
    mode: LinearMode | None = None,
    tables: TableSlope | None = None,
) -> LoopMargins:
    """Return gain, phase and delay margins at rest at many angles.

    Parameters
    ----------
    loop
        Closed loop.
    angles
        Of the driven body with the load at zero, shape (n,), in rad.
    opening
        Where the loop is cut: by default the current of the plant, which every loop passes.
        ``loop.desired`` cuts where desired and estimated torque are compared, so that the gain is that of the
        whole torque controller while its compensation and velocity loop stay closed. What a law feeds forward
        from the desired torque passes beside that comparison and takes no part.
    mode
        Of the plant's dry friction; sliding by default.
    tables
        How looked-up tables take part; with their slopes by default.

    Raises
    ------
    UnknownNameError
        If the opening is no input of the loop.
    """
    closed = linear_loop(loop, angles, mode=mode, tables=tables)
    frequencies = np.geomspace(0.02, 0.5 / loop.sample_time, _POINTS)
    current = f"{PLANT}.{loop.names.current}"
    opening = opening or current
    if opening == loop.desired:
        compared = _compared_only(loop)
        plain = closed if compared is loop else linear_loop(compared, angles, mode=mode, tables=tables)
        followed = plain.response(loop.estimate, loop.desired, frequencies)
        followed[~closed.stable()] = 0.0  # has no margins; neither has a loop that does not rest
        gain = followed / (1.0 - followed)
    else:
        opened = linear_loop(loop, angles, opened=(opening,), mode=mode, tables=tables)
        system = loop.system([loop.desired])
        last = list(system.blocks)[-1]
        source = f"{last}.{system.blocks[last].outputs[0].name}"
        gain = -opened.response(
            source if opening == current else system.sources[opening], opening, frequencies
        )
        if opening == current:
            # The opening lies behind the samples in which a computed current waits.
            gain *= np.exp(-2j * math.pi * frequencies * loop.sample_time * loop.delay)
    rows = np.full((len(gain), 5), math.nan)
    for k in np.flatnonzero(closed.stable()):
        rows[k] = _margins(gain[k], frequencies)
    return LoopMargins(opening, closed, *rows.T)


def _compared_only(loop: ClosedLoop) -> ClosedLoop:
    """Return the loop with nothing fed forward: T̂/T_d = L/(1 + L) holds only without."""
    if not loop.controller.values.get(FEEDFORWARD, 0.0):
        return loop
    return replace(loop, controller=loop.controller.with_values({FEEDFORWARD: 0.0}))


def _margins(gain: Complex, frequencies: Array) -> tuple[float, float, float, float, float]:
    if not np.all(np.isfinite(gain)):
        # Nothing rests at that angle, so there is no loop to be cut.
        return math.nan, math.nan, math.nan, math.nan, math.nan
    size, phase = np.abs(gain), np.unwrap(np.angle(gain))
    up, down = math.inf, -math.inf
    # Where the phase passes −180° (mod 360°): the loop gain crosses the negative real axis.
    turned = (phase + math.pi) / (2.0 * math.pi)
    for k in np.flatnonzero(np.floor(turned[:-1]) != np.floor(turned[1:])):
        edge = max(math.floor(turned[k]), math.floor(turned[k + 1]))
        share = (edge - turned[k]) / (turned[k + 1] - turned[k])
        level = -20.0 * ((1.0 - share) * math.log10(size[k]) + share * math.log10(size[k + 1]))
        if level > 0.0:
            up = min(up, level)
        else:
            down = max(down, level)
    if gain[-1].real < 0.0 and abs(gain[-1].imag) < 1e-6 * size[-1]:
        # At half the sampling frequency the loop gain is real.
        level = -20.0 * math.log10(size[-1])
        up, down = (min(up, level), down) if level > 0.0 else (up, max(down, level))
    crossings = np.flatnonzero((size[:-1] - 1.0) * (size[1:] - 1.0) < 0.0)
    least, delay, last = math.inf, math.inf, math.nan
    for k in crossings:
        a, b = math.log(size[k]), math.log(size[k + 1])
        share = a / (a - b)
        at = (1.0 - share) * phase[k] + share * phase[k + 1]
        frequency = frequencies[k] * (frequencies[k + 1] / frequencies[k]) ** share
        margin = (at + math.pi) % (2.0 * math.pi)
        least = min(least, margin, 2.0 * math.pi - margin)
        delay, last = min(delay, margin / (2.0 * math.pi * frequency)), float(frequency)
    return up, down, math.degrees(least), delay, last
