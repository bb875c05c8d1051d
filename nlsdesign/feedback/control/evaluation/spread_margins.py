"""Whether a gain has a margin that one would sign: over angle and spread of the deck, and after a kick."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.arrays import Array
from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import declared_prior
from ..closed_loop import ClosedLoop
from ..laws.known_drive import largest_torque, only_side
from .loop_verdict import DIVERGED, LIMIT_CYCLE
from .margins import loop_margins
from .onset import LoopSpread, loop_over_spread

GAIN_MARGIN, PHASE_MARGIN = 6.0, 30.0
"""Least margins in dB and degrees, cut where desired and estimated torque are compared."""
SHARE = 0.95
"""Share of the drawn machines that keep them."""
DRAWS, KICKED = 20, 40
"""Machines drawn for the margins, and for the kick."""
LARGEST, KICK = 0.8, 1.0
"""Held torque as a share of what the drive can hold, and what is wanted besides for 10 ms, in N·m at most."""
_STEEPEST = 0.3
_TRIED = 8


@dataclass(frozen=True, eq=False)
class SpreadMargins:
    """Margins of a gain, and the gain that has enough of them."""

    # gain, value: name of the parameter, and its value
    gain: str
    value: float
    # least: gain margin in dB and phase margin in degrees of the declared machine, the worst angle
    least: tuple[float, float]
    # spread: those that 95 % of the drawn machines keep; of the declared one where nothing has a spread
    spread: tuple[float, float]
    # enough: largest value below that has 6 dB and 30° in 95 % of the machines; the value itself where it has
    # them, not a number where none was found
    enough: float
    # kicked: machines that hold four fifths of what the drive can after a kick; None where nothing has a
    # spread, or none was kicked
    kicked: LoopSpread | None

    @property
    def kept(self) -> bool:
        """Whether the value has the margins."""
        return self.enough >= self.value

    @property
    def cycling(self) -> float:
        """Share of the kicked machines that limit-cycle or diverge; zero where none was kicked."""
        if self.kicked is None:
            return 0.0
        return float(np.mean([v.state in (LIMIT_CYCLE, DIVERGED) for v in self.kicked.verdicts]))

    def margins(self) -> str:
        """Return in a sentence what the gain has."""
        gain, phase = self.spread
        has = f"has {gain:.2g} dB and {phase:.2g}° in" if math.isfinite(gain) else "is not stable in"
        return (
            f"{self.gain} {self.value:.3g} {has} 95 % of the machines of the spread (declared numbers: "
            f"{self.least[0]:.2g} dB, {self.least[1]:.2g}°)"
        )

    def words(self) -> list[str]:
        """Return in a sentence which share of the machines settles after the kick, if any was kicked."""
        if self.kicked is None:
            return []
        count, torque = len(self.kicked.verdicts), abs(self.kicked.amplitude)
        return [f"after a kick at {torque:.3g} N·m {100 * self.kicked.held:.0f} % of {count} machines settle"]

    def findings(self) -> list[str]:
        """Return sentences on what a careful engineer would not sign; none where all is kept."""
        result = []
        if not self.kept:
            better = f"{self.enough:.3g} has both" if math.isfinite(self.enough) else "none below was found"
            result.append(f"{self.margins()}; {GAIN_MARGIN:g} dB, {PHASE_MARGIN:g}° are asked for: {better}")
        if self.kicked is not None and self.cycling > 1.0 - SHARE:
            result.append(
                f"{100 * self.cycling:.0f} % of {len(self.kicked.verdicts)} machines of the spread "
                f"limit-cycle at {abs(self.kicked.amplitude):.3g} N·m after a step and a kick of 10 ms"
            )
        return result


def spread_margins(
    loop: ClosedLoop, gain: str, *, last: float, translate: Translate = as_it_is
) -> SpreadMargins:
    """Return :func:`margins_alone`, and which machines settle after a kick."""
    margins = margins_alone(loop, gain, last=last)
    if not declared_prior(loop.plant).names:
        return margins
    side = only_side(loop.plant) or 1.0
    held = LARGEST * largest_torque(loop.plant)
    kicked = loop_over_spread(
        loop, amplitude=side * held, frequency=0.0, draws=KICKED, kick=side * min(KICK, 0.3 * held),
        translate=translate,
    )  # fmt: skip
    return replace(margins, kicked=kicked)


def margins_alone(loop: ClosedLoop, gain: str, *, last: float) -> SpreadMargins:
    """Return the margins of a loop over the angle and the spread of its deck, and the gain that has enough.

    ``last``: angle to which they are taken, in rad; the first is a twentieth of it, since where the spring
    has no stiffness the loop hardly acts and its phase says nothing.
    """
    angles = np.linspace(0.05, 1.0, 11) * last
    plants = on_drawn_machines(loop, DRAWS)
    value = loop.controller.values[gain]
    worst = _worst(loop, plants, angles)
    enough = value
    for _ in range(_TRIED):
        changed = replace(loop, controller=loop.controller.with_values({gain: enough}))
        tried = worst if enough == value else _worst(changed, plants, angles)
        have = _kept_by_most(tried)
        if have[0] >= GAIN_MARGIN and have[1] >= PHASE_MARGIN:
            break
        lacking = max((GAIN_MARGIN - have[0]) / 20.0, 0.02) if math.isfinite(have[0]) else _STEEPEST
        enough *= 10.0 ** -min(lacking + 0.005, _STEEPEST)
    else:
        enough = math.nan
    least = (float(worst[0, 0]), float(worst[0, 1]))
    return SpreadMargins(gain, value, least, _kept_by_most(worst), enough, None)


def on_drawn_machines(loop: ClosedLoop, draws: int) -> list[ClosedLoop]:
    """Return the loop as declared, and on machines drawn from the spread of the deck, if it has one."""
    known = declared_prior(loop.plant)
    if not known.names or not draws:
        return [loop]
    drawn = known.draws(draws, 1)
    changed = [{n: float(v[k]) for n, v in drawn.items()} for k in range(draws)]
    return [loop, *(replace(loop, plant=loop.plant.with_values(numbers)) for numbers in changed)]


def _worst(loop: ClosedLoop, machines: list[ClosedLoop], angles: Array) -> Array:
    """Return least gain and phase margin of each machine, shape (machines, 2); minus infinity if unstable."""
    rows = []
    for each in machines:
        margins = loop_margins(replace(loop, plant=each.plant), angles, opening=loop.desired)
        linear = margins.linear
        limit = min(
            [loop.controller.outputs[0].maximum]
            + [each.plant.values[b.motor.current_limit] for b in each.plant.bodies
               if b.motor is not None and b.motor.current_limit is not None]
        )  # fmt: skip
        # At its limit a drive answers nothing, so there is no loop.
        held = linear.reached & (np.abs(linear.current) < 0.999 * limit)
        pairs = np.array([margins.gain, margins.phase])[:, held]
        pairs = np.where(np.isfinite(pairs) | (pairs > 0.0), pairs, -np.inf)
        rows.append(np.min(pairs, axis=1, initial=np.inf))
    return np.array(rows)


def _kept_by_most(worst: Array) -> tuple[float, float]:
    """Return what 95 % of the drawn machines keep; the declared one alone where none was drawn."""
    rows = worst[1:] if len(worst) > 1 else worst
    ranked = np.sort(rows, axis=0)
    gain, phase = ranked[math.floor((1.0 - SHARE) * len(rows))]
    return float(gain), float(phase)
