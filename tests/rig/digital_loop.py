"""A position controller that samples, holds its current, and logs: what stands between plant and records.

At each of its ticks it reads the encoder of the driven body in counts, takes the speed from filtered
differences, and sets a current that it holds until the next tick. A row of the log is what was read at a
tick and the current that is held from then on; a slow log keeps every so many of the rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, exp
from typing import Protocol

import numpy as np
from scipy.interpolate import make_interp_spline

from .conditions import first_order_noise
from .two_bodies import STEP, Missing


class World(Protocol):
    """A plant in time, whichever simulator advances it."""

    place: float
    load_place: float

    def advance(self, efforts: list[float], payload: float = 0.0) -> None:
        """Go on by one step for each effort."""


@dataclass(frozen=True)
class Controller:
    """Gains in A/rad (A/m) and so on, and the rate of the loop."""

    rate: float  # Hz
    proportional: float
    derivative: float
    integral: float
    limit: float  # A
    counts: float  # rad or m, of the encoder that it reads
    feed: float = 0.0  # A·s²/rad, times the wanted acceleration
    lag: float = 0.0  # s, of the current behind the command

    def begun(self) -> Callable[[float, float, float, float], float]:
        """Return what gives the current at each tick for goal, its speed and acceleration, and the place."""
        period, integral, filtered, before = 1.0 / self.rate, 0.0, 0.0, None
        smooth = 1.0 - np.exp(-2.0 * np.pi * 60.0 * period)

        def current(goal: float, pace: float, bend: float, place: float) -> float:
            nonlocal integral, filtered, before
            read = self.counts * round(place / self.counts)
            filtered += smooth * (0.0 if before is None else (read - before) / period - filtered)
            before = read
            wanted = self.proportional * (goal - read) + self.derivative * (pace - filtered)
            wanted += integral + self.feed * bend
            if -self.limit <= wanted <= self.limit:
                integral += period * self.integral * (goal - read)
            else:
                wanted = self.limit if wanted > 0.0 else -self.limit
            return wanted

        return current


class Loop(Protocol):
    """A controller that samples: that of this module, or a cascade."""

    @property
    def rate(self) -> float:
        """Ticks per second."""

    @property
    def lag(self) -> float:
        """Time constant of the current behind the command, s."""

    def begun(self) -> Callable[[float, float, float, float], float]:
        """Return what gives the current at each tick."""


@dataclass(frozen=True)
class Wanted:
    """Place and its two derivatives at every tick."""

    time: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class Ticks:
    """True signals at every tick, shape (n,); the current is held from the tick on."""

    time: np.ndarray
    place: np.ndarray
    load_place: np.ndarray
    current: np.ndarray


def acting(missing: Missing) -> Callable[[float], float]:
    """Return what makes of a current the one that acts."""
    zone, bend = missing.dead_zone, missing.saturation

    def act(current: float) -> float:
        if zone:
            current = max(current - zone, 0.0) + min(current + zone, 0.0)
        return atan(bend * current) / bend if bend else current

    return act


def pushes(missing: Missing, time: np.ndarray) -> np.ndarray:
    """Return the effort on the driven body that goes with time alone."""
    turns = 2.0 * np.pi * missing.disturbance_frequency * time + missing.disturbance_phase
    push = missing.constant_effort + missing.disturbance * np.sin(turns)
    since = (time - missing.push_place * time[-1]) / missing.push_time
    return push + missing.push * np.where((since > 0.0) & (since < 1.0), np.sin(np.pi * since), 0.0)


def eccentric(place: float, missing: Missing) -> float:
    """Return what an encoder with its disc off the shaft shows."""
    return place + missing.eccentricity * float(
        np.sin(place + missing.disc_phase) - np.sin(missing.disc_phase)
    )


def run(
    world: World, controller: Loop, wanted: Wanted, effort_per_ampere: float, missing: Missing,
    *, step: float = STEP, disc_on_motor: bool = True,
) -> Ticks:  # fmt: skip
    """Run one record from rest.

    Parameters
    ----------
    world
        At rest.
    controller, wanted
        What is told to it.
    effort_per_ampere, missing
        Of the machine as built.
    step
        Of the world, s; a period of the loop is a multiple of it.
    disc_on_motor
        Whether an eccentric disc is the one that the loop reads.
    """
    steps = round(1.0 / (controller.rate * step))
    late, act = round(missing.drive_delay / step), acting(missing)
    push = pushes(missing, np.arange(len(wanted.time) * steps) * step)
    commands: list[float] = [0.0] * (late // steps + 2)
    rows: list[tuple[float, float, float]] = []
    whole, part = divmod(late, steps)
    following, flowing = controller.begun(), 0.0
    share = 1.0 - exp(-step / controller.lag) if controller.lag else 0.0
    effort_per_ampere = float(effort_per_ampere)
    for tick, (goal, pace, bend) in enumerate(
        zip(wanted.place.tolist(), wanted.speed.tolist(), wanted.acceleration.tolist(), strict=True)
    ):
        shown = eccentric(world.place, missing) if missing.eccentricity and disc_on_motor else world.place
        commands.append(float(following(goal, pace, bend, shown)))
        rows.append((world.place, world.load_place, commands[-1]))
        older, newer = commands[-2 - whole], commands[-1 - whole]
        beside = push[tick * steps : (tick + 1) * steps].tolist()
        efforts = []
        for number, pushed in enumerate(beside):
            told = older if number < part else newer
            flowing = flowing + share * (told - flowing) if share else told
            efforts.append(effort_per_ampere * act(flowing) + pushed)
        world.advance(efforts, missing.payload if 2 * tick > len(wanted.time) else 0.0)
    return Ticks(wanted.time, *np.array(rows).T)


@dataclass(frozen=True)
class Logger:
    """Sensors and log; quanta in rad or m."""

    every: int = 1  # ticks of the loop per row
    quantum: float = 1e-5
    load_quantum: float = 0.0  # 0: there is no encoder on the second body
    current_noise: float = 0.01  # A
    coloured: float = 0.0  # of the current, as a multiple of its noise
    averaged: bool = (
        False  # whether a row has the mean current since the row before, and not the one from now on
    )


def logged(
    ticks: Ticks, logger: Logger, missing: Missing, draw: np.random.Generator, *, disc_on_motor: bool = True
) -> np.ndarray:
    """Return the rows of a log: time, place, place of the second body if it is read, current."""
    disc = missing.eccentricity * (np.sin(ticks.place + missing.disc_phase) - np.sin(missing.disc_phase))
    place = ticks.place + (disc if disc_on_motor else 0.0)
    columns = [ticks.time, _counted(place, logger.quantum)]
    if logger.load_quantum:
        load = ticks.load_place
        if not disc_on_motor:
            turn = np.sin(load + missing.disc_phase) - np.sin(missing.disc_phase)
            load = load + missing.eccentricity * turn
        if missing.encoder_delay:
            # A straight line between ticks would be no encoder that is read earlier, but a blurred one.
            earlier = np.maximum(ticks.time - missing.encoder_delay, ticks.time[0])
            load = make_interp_spline(ticks.time, load, k=5)(earlier)
        columns.append(_counted(load + missing.encoder_bias, logger.load_quantum))
    current = ticks.current + missing.current_bias
    if logger.averaged:
        past = np.concatenate([np.full(logger.every, current[0]), current[:-1]])
        current = np.convolve(past, np.full(logger.every, 1.0 / logger.every))[logger.every - 1 :]
        current = current[: len(ticks.current)]
    columns.append(current)
    table = np.column_stack(columns)[:: logger.every]
    table[:, -1] += logger.current_noise * draw.standard_normal(len(table))
    if logger.coloured:
        time = 0.005 * 20.0 ** draw.uniform()
        steps = max(time / (table[1, 0] - table[0, 0]), 1e-3)
        table[:, -1] += logger.coloured * logger.current_noise * first_order_noise(len(table), steps, draw)
    return table


def _counted(place: np.ndarray, quantum: float) -> np.ndarray:
    counted: np.ndarray = quantum * np.round(place / quantum)
    return counted
