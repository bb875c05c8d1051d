"""Fifty random targets: met at once, met after the advice is followed, or not.

Each is designed as a new user would: contour, pretension and area of the rubber free, cam radius up to 20 mm,
all else by default. What misses by more than 1 % rms says what to free or which limit to move; the first
advice is followed to the letter and the design is made again. Targets know nothing of cam or rubber: smooth
monotone ones, or with ``--wild`` curves with a dead zone, a plateau, hills, a maximum or a fall to zero, over
20 to 100 degrees. Printed, not asserted: ``python -m benchmarks.random_targets``.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign import design as design_room
from nlsdesign.design import CamDesign, DesignSettings, Limit
from nlsdesign.design.optimisation.loosening import Freed, Give
from nlsdesign.design.optimisation.remedies import OtherSpring
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import NlsError

DECKS = ("austin2015_figure_consistent", "austin2015_as_printed")
FREE = ("spring.cam.contour", "spring.pretension", "spring.rubber.area")
KEEP: tuple[Limit, ...] = (nls.MaximumCamRadius(20e-3),)
SETTINGS = DesignSettings(look_for_size_ranges=False, draws=0)
"""Neither tolerances nor ranges of sizes that cost nothing change the design."""
_POINTS = 41
_LIMITS: dict[str, type] = {
    each.__name__: each
    for each in (
        design_room.MaximumCamRadius,
        design_room.MaximumCableTension,
        design_room.MaximumLastingStrain,
        design_room.MaximumPressureAngle,
        design_room.MaximumStrain,
        design_room.MaximumStress,
        design_room.MinimumHollowRadius,
        design_room.MinimumRadiusOfCurvature,
    )
}


def random_target(seed: int) -> design_room.TabulatedTorque:
    """Return a smooth strictly monotone torque curve: 3 to 6 N·m at 40 to 60 degrees.

    The stiffness is positive and has one of five shapes in turn: the exponential of three random cosines, or
    of a straight line; a power of the angle; a smooth step up or down; a sum of powers.

    Parameters
    ----------
    seed
        Of all that is random in it.
    """
    draw = np.random.default_rng(seed)
    last, largest = np.radians(draw.uniform(40.0, 60.0)), draw.uniform(3.0, 6.0)
    share = np.linspace(0.0, 1.0, 2001)
    stiffness = _stiffness(seed % 5, share, draw)
    torque = np.concatenate([[0.0], np.cumsum((stiffness[1:] + stiffness[:-1]) / 2)]) * (share[1] * last)
    factor = largest / torque[-1]
    at = np.linspace(0, len(share) - 1, _POINTS).astype(int)
    return design_room.TabulatedTorque(
        angles=tuple(share[at] * last),
        torques=tuple(factor * torque[at]),
        slopes=tuple(factor * stiffness[at]),
    )


def _stiffness(shape: int, share: Array, draw: np.random.Generator) -> Array:
    if shape == 0:
        waves = [draw.normal(0.0, 0.5 / k) * np.cos(np.pi * k * share) for k in (1, 2, 3)]
        return np.exp(np.sum(waves, axis=0))
    if shape == 1:
        return np.exp(draw.uniform(-1.5, 3.0) * share)
    if shape == 2:
        return np.asarray(0.05 + share ** draw.uniform(0.2, 2.0))
    if shape == 3:
        step = draw.uniform(-0.7, 2.0) * np.tanh((share - draw.uniform(0.3, 0.7)) / draw.uniform(0.15, 0.4))
        return np.asarray(np.exp(step))
    weights = draw.dirichlet(np.ones(4))
    return np.asarray(0.05 + sum(weights[k] * (k + 1) * share**k for k in range(4)))


def wild_target(seed: int) -> design_room.TabulatedTorque:
    """Return a torque curve of one of five wilder shapes in turn: up to 1 to 8 N·m, over 20 to 100 degrees.

    A dead zone and a steep rise; a plateau between two rises; a line with hills and valleys; a maximum with a
    fall behind it; a fall to zero at the end.

    Parameters
    ----------
    seed
        Of all that is random in it.
    """
    draw = np.random.default_rng(1000 + seed)
    last, largest = np.radians(draw.uniform(20.0, 100.0)), draw.uniform(1.0, 8.0)
    share = np.linspace(0.0, 1.0, _POINTS)
    shape = seed % 5
    if shape == 0:
        torque = share ** draw.uniform(2.0, 5.0)
    elif shape == 1:
        steps = [np.tanh((share - at) / 0.12) for at in (draw.uniform(0.1, 0.3), draw.uniform(0.7, 0.9))]
        torque = np.sum(steps, axis=0) - steps[0][0] - steps[1][0]
    elif shape == 2:
        torque = share + draw.uniform(0.02, 0.12) * np.sin(2 * np.pi * draw.integers(1, 4) * share)
    elif shape == 3:
        torque = np.sin(np.pi * share * draw.uniform(0.5, 0.8))
    else:
        torque = np.sin(np.pi * share) * (1.0 + draw.uniform(-0.5, 0.5) * share)
    torque = np.maximum(largest * (torque - torque[0]) / np.max(torque), 0.0)
    return design_room.TabulatedTorque(angles=tuple(share * last), torques=tuple(torque))


Advice = Freed | tuple[Give, Freed | None] | OtherSpring


@dataclass(frozen=True)
class Try:
    """One design: relative rms error (None for an error message), words, seconds, advice to follow."""

    error: float | None
    words: str
    seconds: float
    advice: tuple[Advice, ...]


def attempt(
    actuator: nls.Assembly, target: design_room.Target, free: Sequence[str], keep: Sequence[Limit]
) -> Try:
    """Return what a user gets from one call.

    Parameters
    ----------
    actuator, target, free, keep
        As for ``design_cam``.
    """
    begin = _cpu_seconds()
    try:
        design = nls.design_cam(actuator, target=target, free=free, keep=keep, settings=SETTINGS)
    except NlsError as error:
        # A message instead of a design is an outcome that is counted.
        return Try(None, f"{type(error).__name__}: {error}", _cpu_seconds() - begin, ())
    return Try(design.rms / target.largest, _words(design), _cpu_seconds() - begin, _advice(design))


def _cpu_seconds() -> float:
    """Of this process and of those that it has started."""
    return sum(os.times()[:4])


def _words(design: CamDesign) -> str:
    return "" if design.miss is None else "; ".join([str(design.miss), *design.miss.advice])


def _advice(design: CamDesign) -> tuple[Advice, ...]:
    if design.miss is None or design.miss.remedies is None:
        return ()
    remedies, allowed = design.miss.remedies, SETTINGS.largest_error * design.target.largest
    others = [one for one in remedies.others if one.error <= allowed]
    return (*remedies.enough, *remedies.gives, *others)


def followed(
    actuator: nls.Assembly, advice: Advice, free: Sequence[str], keep: Sequence[Limit]
) -> tuple[nls.Assembly, list[str], list[Limit]]:
    """Return actuator, free names and limits after an advice is followed to the letter.

    Parameters
    ----------
    actuator
        As it was.
    advice
        Names to free, or a limit to move with names to free besides, or another spring with both.
    free, keep
        So far.
    """
    gives: tuple[Give, ...] = ()
    if isinstance(advice, OtherSpring):
        actuator, freed, gives = advice.machine, advice.freed, advice.gives
    elif isinstance(advice, Freed):
        freed = advice
    else:
        gives, freed = advice[:1], advice[1]
    moved = {_LIMITS[give.bound.limit]: give.moved for give in gives}
    names = [*free, *(freed.names if freed is not None else ())]
    kept = [each for each in keep if type(each) not in moved]
    return actuator, names, [*kept, *(kind(end) for kind, end in moved.items())]


@dataclass(frozen=True)
class Line:
    """What became of one target on one deck."""

    deck: str
    seed: int
    first: Try
    second: Try | None

    @property
    def verdict(self) -> str:
        """One of four."""
        if _met(self.first):
            return "met at once"
        if self.second is not None and _met(self.second):
            return "met after the first advice"
        # A miss without a word of what holds it, or of what was tried, would be silent.
        said = "held by" in self.first.words or " -> " in self.first.words
        return "not met" if said else "not met, silent"


def _met(attempted: Try) -> bool:
    return attempted.error is not None and attempted.error <= SETTINGS.largest_error


def lines(
    decks: Sequence[str],
    seeds: Sequence[int],
    made: Callable[[int], design_room.TabulatedTorque] = random_target,
) -> Iterator[Line]:
    """Yield what becomes of each target.

    Parameters
    ----------
    decks
        Names of bundled decks.
    seeds
        Of the targets.
    made
        Target of a seed.
    """
    for deck in decks:
        actuator = nls.models.cam_rubber_actuator(nls.load_deck(deck))
        for seed in seeds:
            target, second = made(seed), None
            first = attempt(actuator, target, FREE, KEEP)
            if first.advice:
                machine, free, keep = followed(actuator, first.advice[0], FREE, KEEP)
                second = attempt(machine, target, free, keep)
            yield Line(deck, seed, first, second)


def main() -> None:
    """Print one line for each target, and the counts."""
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--decks", nargs="+", default=DECKS)
    reader.add_argument("--first", type=int, default=1, help="first seed")
    reader.add_argument("--last", type=int, default=50, help="last seed")
    reader.add_argument("--wild", action="store_true", help="wilder targets, which need not rise")
    reader.add_argument("--words", action="store_true", help="print the message of each miss")
    given = reader.parse_args()
    counts: dict[tuple[str, str], int] = {}
    made = wild_target if given.wild else random_target
    for line in lines(given.decks, range(given.first, given.last + 1), made):
        counts[line.deck, line.verdict] = counts.get((line.deck, line.verdict), 0) + 1
        shown = [_shown(each) for each in (line.first, line.second) if each is not None]
        print(f"{line.deck} {line.seed:3d}: {line.verdict:27s} {' -> '.join(shown)}", flush=True)
        if given.words and not _met(line.first):
            print(f"    {line.first.words}", flush=True)
            if line.verdict == "not met" and line.second is not None:
                print(f"    then: {line.second.words}", flush=True)
    for (deck, verdict), count in sorted(counts.items()):
        print(f"{deck}: {verdict}: {count}")


def _shown(attempted: Try) -> str:
    error = "no design" if attempted.error is None else f"{100.0 * attempted.error:.3g} %"
    return f"{error} in {attempted.seconds:.1f} s"


if __name__ == "__main__":
    main()
