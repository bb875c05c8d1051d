"""Margins of the linearised sampled loop over the angle, and what a load feels of it: impedance, stability.

Passivity is that of the samples: the torque between two samples is not looked at, so the statement holds
well below half the sampling frequency; frequencies up to 0.4 of the sampling frequency are shown.

Source: Colgate and Hogan 1988 (passive impedance and coupled stability).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ValueRangeError
from ....model.roles import moved_load, series_spring
from ....simulation.sampled_batch import PLANT
from ..closed_loop import ClosedLoop
from ..laws.law_writer import GAIN
from .linear_loop import Complex, LinearLoop, assembled, linear_loop, plant_of
from .linear_parts import SLIDING, LinearPlant, with_fine_counts

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
    speed: float = SLIDING,
    frozen_tables: bool = False,
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
    speed
        Of the driven body, at which the slopes of the plant are taken; zero for one stuck in its friction.
    frozen_tables
        Whether looked-up tables are held at the angle, where they follow it in the controller.

    Raises
    ------
    UnknownNameError
        If the opening is no input of the loop.
    """
    closed = linear_loop(loop, angles, speed=speed, frozen_tables=frozen_tables)
    frequencies = np.geomspace(0.02, 0.5 / loop.sample_time, _POINTS)
    current = f"{PLANT}.{loop.names.current}"
    opening = opening or current
    if opening == loop.desired:
        compared = _compared_only(loop)
        plain = closed
        if compared is not loop:
            plain = linear_loop(compared, angles, speed=speed, frozen_tables=frozen_tables)
        followed = plain.response(loop.estimate, loop.desired, frequencies)
        followed[~closed.stable()] = 0.0  # has no margins; neither has a loop that does not rest
        gain = followed / (1.0 - followed)
    else:
        opened = linear_loop(loop, angles, opened=(opening,), speed=speed, frozen_tables=frozen_tables)
        system = loop.system([loop.desired])
        last = list(system.blocks)[-1]
        command = f"{last}.{system.blocks[last].outputs[0].name}"
        source = command if opening == current else system.sources[opening]
        gain = -opened.response(source, opening, frequencies)
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


@dataclass(frozen=True, eq=False)
class OutputImpedance:
    """Torque that resists a moved load over its speed, Z(jω), over angle and frequency.

    Parameters
    ----------
    linear
        The closed loop with the load's motion as input.
    frequency
        In Hz, shape (m,).
    impedance
        In N·m·s/rad, shape (n, m); not a number where the loop is unstable with the load held.
    """

    linear: LinearLoop
    frequency: Array
    impedance: Complex

    @property
    def dynamic_stiffness(self) -> Complex:
        """Torque that resists over the angle of the load, jω·Z, in N·m/rad, shape (n, m)."""
        return self.impedance * 2j * math.pi * self.frequency

    def first_active(self) -> Array:
        """Return the lowest frequency in Hz at which Re Z < 0, shape (n,).

        Infinite where the loop is passive at all frequencies that were looked at, not a number where it is
        unstable already with the load held.
        """
        result = np.full(len(self.impedance), math.inf)
        for k, row in enumerate(self.impedance):
            if not np.all(np.isfinite(row)):
                result[k] = math.nan
                continue
            active = np.flatnonzero(row.real < -1e-9 * np.abs(row))
            if len(active):
                result[k] = self.frequency[active[0]]
        return result


def output_impedance(
    loop: ClosedLoop,
    angles: Sequence[float] | Array,
    *,
    frequencies: Sequence[float] | Array | None = None,
    load: str | None = None,
    speed: float = SLIDING,
    frozen_tables: bool = False,
) -> OutputImpedance:
    """Return the impedance that a load feels at many angles of the spring.

    Parameters
    ----------
    loop
        Its plant has a load whose motion is prescribed.
    angles
        Of the driven body with the load at zero, shape (n,), in rad.
    frequencies
        In Hz; by default 200 from 0.1 Hz to 0.4 of the sampling frequency.
    load
        Name of the load; decided from the structure of the plant if it is left out.
    speed, frozen_tables
        As :func:`loop_margins` takes them.

    Raises
    ------
    ArrangementError
        If the plant has no load whose motion is prescribed.
    ValueRangeError
        If a frequency is not between zero and half the sampling frequency.
    """
    moved = moved_load(loop.plant, load)
    if frequencies is None:
        frequencies = np.geomspace(0.1, 0.4 / loop.sample_time, 200)
    at = np.asarray(frequencies, dtype=float)
    if np.any(at <= 0.0) or np.any(at > 0.5 / loop.sample_time):
        raise ValueRangeError(
            f"frequencies {at.min():g} to {at.max():g} Hz",
            f"must lie between 0 and {0.5 / loop.sample_time:g} Hz",
        )
    linear = linear_loop(loop, angles, speed=speed, frozen_tables=frozen_tables)
    turn = 2j * math.pi * at
    torque = linear.response(loop.torque, f"{PLANT}.{moved.motion}", at)
    torque = torque + turn * linear.response(loop.torque, f"{PLANT}.{moved.rate}", at)
    impedance = -torque / turn
    impedance[~linear.stable()] = complex(math.nan, math.nan)
    return OutputImpedance(linear, at, impedance)


@dataclass(frozen=True, eq=False)
class CoupledStability:
    """Whether the loop stays stable on loads with inertia and a spring to the frame."""

    angle: float  # of the spring at rest, in rad
    inertias: Array  # of the load in kg·m², shape (i,)
    stiffnesses: Array  # of the spring between load and frame in N·m/rad, shape (s,)
    # radius: largest size of an eigenvalue per sample, shape (i, s); not a number where the loop cannot hold
    # the angle
    radius: Array
    frequency: Array  # of that eigenvalue in Hz, shape (i, s)

    @property
    def stable(self) -> Mask:
        """Where the coupled loop is stable or at its limit, shape (i, s)."""
        # A free load has a double eigenvalue at one, which rounding parts by 1e-8.
        return self.radius < 1.0 + 1e-6


def coupled_stability(
    loop: ClosedLoop,
    *,
    angle: float,
    inertias: Sequence[float] | Array,
    stiffnesses: Sequence[float] | Array,
) -> CoupledStability:
    """Return whether the loop is stable on each load of a range, at rest at one angle of the spring.

    ``loop``: its plant has a load whose motion is prescribed; here it moves freely instead. ``angle``: of the
    driven body in rad; the load rests at zero. ``inertias``: of the load in kg·m², shape (i,).
    ``stiffnesses``: of a spring between load and frame in N·m/rad, shape (s,); zero is a free load. A
    constant torque balances that of the actuator, so that the load rests. Nothing but the actuator damps it,
    and the driven body slides.
    """
    moved = moved_load(loop.plant)
    j, k = np.asarray(inertias, dtype=float), np.asarray(stiffnesses, dtype=float)
    if not np.all(j > 0.0) or not np.all(k >= 0.0):
        raise ValueRangeError("load", "needs positive inertias, and stiffnesses that are not negative")
    fine = replace(loop, plant=with_fine_counts(loop.plant))
    system = fine.system([loop.desired])
    plant = plant_of(system, np.array([angle]), SLIDING)
    masses, springs = (grid.ravel() for grid in np.meshgrid(j, k, indexing="ij"))
    names = (moved.motion, moved.rate, series_spring(loop.plant).effort)
    free = _on_load(plant, names, masses, springs)
    at = np.full(len(masses), angle)
    whole = assembled(system, free, at, cut=(), frozen_tables=False, speed=SLIDING)
    z = np.linalg.eigvals(whole.a)
    largest = np.take_along_axis(z, np.argmax(np.abs(z), axis=1)[:, None], axis=1)[:, 0]
    shape = (len(j), len(k))
    radius = np.where(whole.reached, np.abs(largest), np.nan).reshape(shape)
    frequency = np.abs(np.angle(largest)).reshape(shape) / (2.0 * math.pi * loop.sample_time)
    return CoupledStability(angle, j, k, radius, frequency)


def _on_load(
    plant: LinearPlant, names: tuple[str, str, str], inertias: Array, stiffnesses: Array
) -> LinearPlant:
    """Return the plant with the load's motion as states: J·ω̇ = T − k·θ."""
    n, states = len(inertias), len(plant.states)
    motion, rate = (plant.inputs.index(name) for name in names[:2])
    torque = plant.signals.index(names[2])
    kept = [i for i in range(len(plant.inputs)) if i not in (motion, rate)]
    a = np.zeros((n, states + 2, states + 2))
    a[:, :states, :states] = plant.a[0]
    a[:, :states, states], a[:, :states, states + 1] = plant.b[0][:, motion], plant.b[0][:, rate]
    a[:, states, states + 1] = 1.0
    a[:, states + 1, :states] = plant.c[0][torque] / inertias[:, None]
    a[:, states + 1, states] = (plant.d[0][torque, motion] - stiffnesses) / inertias
    a[:, states + 1, states + 1] = plant.d[0][torque, rate] / inertias
    b = np.zeros((n, states + 2, len(kept)))
    b[:, :states] = plant.b[0][:, kept]
    c = np.zeros((n, len(plant.signals), states + 2))
    c[:, :, :states] = plant.c[0]
    c[:, :, states], c[:, :, states + 1] = plant.d[0][:, motion], plant.d[0][:, rate]
    d = np.repeat(plant.d[:, :, kept], n, axis=0)
    repeated = (np.repeat(plant.values, n, axis=0), np.repeat(plant.drive, n))
    inputs = tuple(plant.inputs[i] for i in kept)
    return LinearPlant((*plant.states, *names[:2]), inputs, plant.signals, a, b, c, d, *repeated)
