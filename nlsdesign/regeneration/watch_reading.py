"""What the evidence of a monitor says: which number changed, how probably, or that nothing can be said.

The sums of a monitor give what each change seems to be, δ̂ with a covariance C. Each cause says how the true
δ lie: nothing changed, one number changed, two did, or something else did. Each has a normal density of δ̂,
and Bayes' rule does the rest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..foundation.arrays import Array

if TYPE_CHECKING:
    from ..export import WatchedBlock, WatchPlan

TOLERANCE = 0.2
"""Standard deviation, in changes to be noticed, of what a machine that fits its deck shows for lack of
exactness."""
USUAL = 2.0
"""Standard deviation of a change that happened, in changes to be noticed."""
LOST, WIDE = 1e-6, 30.0
"""Share of its square by which a change is held, and its standard deviation before anything was seen."""
SURE = 0.9
"""Least probability of a name."""
MOST = 0.99
"""No more is stated, as in a diagnosis."""
NOTHING, ONE, TWO, OTHER = 0.35, 0.5, 0.1, 0.05
"""Probability before anything was seen: nothing changed, one number, two, something else."""
OTHERS = ("something else",)
LEAST_SHARE, LARGEST_SHARE = -0.9, 2.0
"""Shares between which a number can have changed: beyond, a reading has another sign, unit or scale."""
CERTAIN = 0.5
"""Largest standard error of a change that is named, as a share of it."""
TOO_LITTLE = 2
"""Bit of the monitor's word: of late there was too little to judge by."""
ONE_MOTION = 32
"""Bit of the monitor's word: the motion was too much alike, and the machine is not held against itself."""
TORQUE_CONSTANT = "motor.torque_constant"
EFFECTS = {
    "friction": "coulomb_friction",
    "delay": "drive_delay",
    "damping": "viscous_friction",
    "load": "gravity_load",
}
"""Effects of the catalogue of a diagnosis that a change of a number amounts to."""


@dataclass(frozen=True)
class WatchedChange:
    """A number that may have changed.

    Parameters
    ----------
    name
        Part and kind of the number.
    effect
        What a diagnosis calls it; empty for a declared number without an effect.
    size, error
        Change and its standard error: shares of the number, or s for a delay.
    unit
        Unit of both, empty for a share.
    probability
        That it changed.
    aliases
        Numbers that these sums cannot tell from it; the probability of the verdict is that of all together.
    """

    name: str
    effect: str
    size: float
    error: float
    unit: str
    probability: float
    aliases: tuple[str, ...] = ()

    @property
    def is_implausible(self) -> bool:
        """Whether no number of a machine changes so."""
        return not self.unit and not LEAST_SHARE <= self.size <= LARGEST_SHARE

    def words(self) -> str:
        """Return it as a sentence."""
        many = (1e3, "ms") if self.unit else (100.0, "%")
        size = f"{many[0] * self.size:+.2g} ± {many[0] * self.error:.1g} {many[1]}"
        also = f" ({self.effect})" if self.effect else ""
        return f"{self.name}{also}: {size}, probability {self.probability:.2g}" + (
            f"; or {', '.join(self.aliases)}, which cannot be told from it" if self.aliases else ""
        )


@dataclass(frozen=True)
class WatchVerdict:
    """What the evidence of a monitor says.

    Parameters
    ----------
    verdict
        ``none``, ``named``, ``undecidable`` (several causes would do), ``unknown`` (none does),
        ``implausible`` (what the numbers would have to be, none is), ``too_little``, or ``one_motion``.
    changes
        All numbers that may have changed, the likeliest first.
    probability
        Of the verdict.
    means
        How many means of residuals stand behind it.
    is_of_before
        Whether the monitor saw too little when it last judged: what is said is of the time before.
    """

    verdict: str
    changes: tuple[WatchedChange, ...]
    probability: float
    means: float
    is_of_before: bool = False

    @property
    def named(self) -> tuple[WatchedChange, ...]:
        """The changes that are named."""
        if self.verdict != "named":
            return ()
        return tuple(c for c in self.changes if c.probability >= SURE) or self.changes[:1]

    def words(self) -> list[str]:
        """Return what it says in sentences."""
        named = self.named
        lines = [HEADLINES[self.verdict].format(n=len(named), p=self.probability, means=self.means)]
        shown = named
        if self.verdict not in ("none", "implausible"):
            shown = named or tuple(c for c in self.changes if c.probability > 1.0 - SURE)
        if self.is_of_before:
            lines.append(
                "That is of the time before: the last look saw too little, or readings that it refused."
            )
        return [*lines, *(f"  {change.words()}" for change in shown)]


HEADLINES = {
    "none": "The machine is as its deck says: no change, probability {p:.2g}, from {means:.0f} means.",
    "named": "The machine has changed, from {means:.0f} means:",
    "undecidable": "Something has changed, or may have, and these sums do not tell what:",
    "unknown": "Something has changed that is no number watched: record some motions and diagnose them.",
    "implausible": "Something has changed, and no number of a machine changes so much: check sign, unit and "
    "scale of each reading, and whether samples are lost or come twice.",
    "one_motion": "The motion was too much alike to tell a change from what any model lacks: let the machine "
    "move at several speeds and loads, or call commission and go on with this motion.",
    "too_little": "Too little motion was seen, {means:.0f} means: let the machine be used for some minutes.",
}
"""What a verdict says in one line."""


def read_watch(record: np.ndarray[Any, Any], plan: WatchPlan) -> WatchVerdict:
    """Return what the evidence of a monitor says.

    Parameters
    ----------
    record
        As :func:`~nlsdesign.export.read_watch_record` returns it.
    plan
        What was watched.

    Returns
    -------
    WatchVerdict
        Names with probabilities, or an abstention.
    """
    means, change, base = _estimated(record["bins"], plan)
    if means < plan.least:
        return WatchVerdict("too_little", (), math.nan, means)
    if int(record["word"]) & ONE_MOTION:
        return WatchVerdict("one_motion", (), math.nan, means)
    directions = _directions(plan.blocks)
    noticed = {TORQUE_CONSTANT: (0.05, "")}
    for block in plan.blocks[::-1]:
        noticed |= dict(zip(block.changes, zip(block.noticed, block.units, strict=True), strict=True))
    causes = dict(_causes(directions, change, base))
    total = np.logaddexp.reduce(list(causes.values()))
    chances = {names: math.exp(value - total) for names, value in causes.items()}
    best = max(chances, key=lambda names: chances[names])
    changes = []
    for name, direction in directions.items():
        chance = sum(p for names, p in chances.items() if name in names)
        # How far the change goes along this direction, beside those of the likeliest cause.
        others = [directions[n] for n in best if n != name and n in directions]
        matrix = np.column_stack([direction, *others])
        weighted = np.linalg.solve(base, matrix)
        inverse = np.linalg.pinv(matrix.T @ weighted)
        size, error = float((inverse @ (weighted.T @ change))[0]), math.sqrt(max(inverse[0, 0], 0.0))
        share, unit = noticed[name]
        effect = EFFECTS.get(name.rpartition(".")[2], "")
        changes.append(WatchedChange(name, effect, size * share, error * share, unit, min(chance, MOST)))
    changes.sort(key=lambda c: -c.probability)
    likely = list(itertools.takewhile(lambda c: c.probability > 1.0 - SURE, changes))
    sure = [c for c in likely if c.probability >= SURE]
    # One of two numbers, or both, whichever motion could tell them apart.
    both = sum(p for cause, p in chances.items() if cause and set(cause) <= {c.name for c in likely})
    chance = chances[best]
    if best in ((), OTHERS):
        verdict = "none" if best == () else "unknown"
    elif sure and len(sure) == len(best):
        verdict, chance = "named", min(c.probability for c in sure)
    elif len(best) == 1 and len(likely) == 2 and both >= SURE:
        verdict, chance = "named", both
        changes[:2] = [
            replace(c, aliases=(other.name,)) for c, other in zip(likely, likely[::-1], strict=True)
        ]
    else:
        verdict = "undecidable"
    if verdict == "named" and any(c.error > CERTAIN * abs(c.size) for c in likely if c.name in best):
        verdict, chance = "undecidable", chances[best]
    if verdict != "none" and any(c.is_implausible for c in likely):
        verdict = "implausible"
    old = bool(int(record["word"]) & TOO_LITTLE)
    return WatchVerdict(verdict, tuple(changes), min(chance, MOST), means, old)


def _estimated(bins: Any, plan: WatchPlan) -> tuple[float, Array, Array]:
    """Return how many means there are, the change that each number seems to have, and the covariance."""
    counts, changes = [], []
    size = sum(len(block.changes) for block in plan.blocks)
    covariance, first = np.zeros((size, size)), 0
    i, j = np.tril_indices(plan.most + 1)
    for block, sums in zip(plan.blocks, bins, strict=True):
        k, count = len(block.changes), float(sums["count"].sum())
        full = np.zeros((plan.most + 1, plan.most + 1))
        full[i, j] = full[j, i] = sums["products"].astype(float).sum(axis=0)
        matrix, vector, square = full[:k, :k], full[:k, -1], full[-1, -1]
        # What single precision has lost is not to be seen as known.
        normal = matrix + np.diag(LOST * np.diag(matrix) + square / (count + 1.0) / WIDE**2 + 1e-30)
        change = np.linalg.solve(normal, vector)
        variance = max(square - change @ vector, 0.0) / max(count - k, 1.0)
        covariance[first : first + k, first : first + k] = variance * np.linalg.inv(normal)
        first += k
        counts.append(count)
        changes.append(change)
    return min(counts), np.concatenate(changes), covariance + TOLERANCE**2 * np.eye(size)


def _directions(blocks: Sequence[WatchedBlock]) -> dict[str, Array]:
    """Return how a change of each number, as large as is to be noticed, shows in all blocks."""
    names = [name for block in blocks for name in block.changes]
    size = len(names)
    shares = np.array(
        [n if not u else math.inf for b in blocks for n, u in zip(b.noticed, b.units, strict=True)]
    )
    directions = {name: np.array([float(name == each) for each in names]) for name in dict.fromkeys(names)}
    first = 0
    for block in blocks:
        part = slice(first, first + len(block.changes))
        first += len(block.changes)
        # More torque per ampere, or a stiffer spring that measures the efforts, makes all others seem less.
        driven = any(block.units)
        less = np.zeros(size)
        less[part] = -0.05 / shares[part]
        if driven:
            directions[TORQUE_CONSTANT] = less
        for name in [n for n in directions if n.endswith(".stiffness") and not driven]:
            directions[name] = directions[name] + less
    return directions


def _causes(
    directions: Mapping[str, Array], change: Array, base: Array
) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yield what may have happened: names, and the logarithm of how probable it is with what was seen."""
    pairs = list(itertools.combinations(directions, 2))
    causes: list[tuple[tuple[str, ...], float, list[Array]]] = [
        ((), NOTHING, []),
        *[((name,), ONE / len(directions), [direction]) for name, direction in directions.items()],
        *[(pair, TWO / len(pairs), [directions[name] for name in pair]) for pair in pairs],
        (OTHERS, OTHER, list(np.eye(len(change)))),
    ]
    for names, chance, rows in causes:
        # The normal density of what was seen, where the change lies along these directions.
        covariance = base + USUAL**2 * sum((np.outer(row, row) for row in rows), start=np.zeros_like(base))
        size = float(np.linalg.slogdet(covariance)[1] + change @ np.linalg.solve(covariance, change))
        yield names, math.log(chance) - 0.5 * size
