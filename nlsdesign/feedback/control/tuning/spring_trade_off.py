"""Bandwidth against output impedance of several actuators, each with gains that keep its margins."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ..evaluation.impedance import output_impedance
from ..evaluation.margins import loop_margins
from ..loop.closed_loop import ClosedLoop
from .largest_gain import LoopLimits

Array = NDArray[np.float64]

_FREQUENCIES = np.geomspace(0.2, 200.0, 240)


@dataclass(frozen=True)
class LoopChoice:
    """One actuator with one gain.

    Parameters
    ----------
    name
        Of the actuator.
    gain
        Value of the gain.
    bandwidth
        Lowest frequency in Hz at which the linear response of the torque is down by 3 dB, the worst angle;
        zero where it is down at 0.2 Hz already, not a number where a loop is unstable or holds none.
    impedance
        Size of the output impedance in N·m·s/rad at the frequency asked for, the worst angle.
    admissible
        Whether the margins are kept at all angles.
    """

    name: str
    gain: float
    bandwidth: float
    impedance: float
    admissible: bool


def bandwidth_against_impedance(
    loops: Mapping[str, ClosedLoop],
    gain: str,
    gains: Sequence[float] | Array,
    *,
    angles: Mapping[str, Sequence[float] | Array],
    frequency: float = 2.0,
    limits: LoopLimits | None = None,
) -> tuple[LoopChoice, ...]:
    """Return bandwidth and impedance of each actuator with each gain.

    For spring and gains designed together, give the loop of each designed spring as one of the actuators.

    Parameters
    ----------
    loops
        By name; each plant has a load whose motion is prescribed.
    gain
        Name of a parameter of every controller.
    gains
        Its values.
    angles
        By name: angles of the spring, in rad, of which the worst counts, for instance those that hold the
        same torques.
    frequency
        Of the impedance in Hz.
    limits
        Margins that make a choice admissible.

    Raises
    ------
    ValueRangeError
        If angles are missing for an actuator.
    ArrangementError
        If a load is not moved.
    """
    limits, choices = limits or LoopLimits(), []
    for name, loop in loops.items():
        if name not in angles:
            raise ValueRangeError(f"angles of '{name}'", "are missing: every actuator needs its own")
        at = np.asarray(angles[name], dtype=float)
        for value in gains:
            changed = replace(loop, controller=loop.controller.with_values({gain: float(value)}))
            margins = loop_margins(changed, at, opening=loop.desired)
            kept = np.all((margins.gain >= limits.gain_margin) & (margins.phase >= limits.phase_margin))
            stable = bool(np.all(margins.linear.stable()))
            resisting = np.abs(output_impedance(changed, at, frequencies=[frequency]).impedance)
            followed = np.abs(margins.linear.response(loop.torque, loop.desired, _FREQUENCIES))
            bandwidth = min(_first_below(row) for row in followed) if stable else math.nan
            choices.append(
                LoopChoice(name, float(value), bandwidth, float(np.max(resisting)), bool(kept and stable))
            )
    return tuple(choices)


def best_choices(choices: Sequence[LoopChoice]) -> tuple[LoopChoice, ...]:
    """Return the admissible choices that no other admissible one beats in both bandwidth and impedance.

    Parameters
    ----------
    choices
        Of :func:`bandwidth_against_impedance`.
    """
    good = [choice for choice in choices if choice.admissible]
    kept = [
        one
        for one in good
        if not any(
            other.bandwidth >= one.bandwidth and other.impedance <= one.impedance
            and (other.bandwidth > one.bandwidth or other.impedance < one.impedance)
            for other in good
        )
    ]  # fmt: skip
    return tuple(sorted(kept, key=lambda choice: choice.bandwidth))


def _first_below(size: Array) -> float:
    below = np.flatnonzero(size < math.sqrt(0.5))
    if not len(below):
        return math.inf
    return float(_FREQUENCIES[below[0]]) if below[0] else 0.0
