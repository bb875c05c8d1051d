"""Gains of a torque loop, chosen under margins and limits; no run is simulated here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError, ValueRangeError
from ...simulation.buffered import Translate, as_it_is
from .closed_loop import ClosedLoop
from .evaluation.margins import loop_margins, output_impedance
from .evaluation.onset import checked_gains
from .evaluation.responses import sine_response
from .evaluation.spread_margins import on_drawn_machines

_TRIED = 9


@dataclass(frozen=True, kw_only=True)
class LoopLimits:
    """What a loop has to keep.

    Parameters
    ----------
    gain_margin
        In dB, of the torque controller (cut where desired and estimated torque are compared).
    phase_margin
        In degrees, at the same place.
    amplitude
        Of a sine of the desired torque in N·m at which simulated runs have to settle; none with zero.
    frequencies
        Of those runs in Hz.
    saturated
        Largest share of the time at the current limit in those runs, 1.
    """

    gain_margin: float = 6.0
    phase_margin: float = 30.0
    amplitude: float = 0.0
    frequencies: tuple[float, ...] = (1.0, 5.0)
    saturated: float = 0.0


@dataclass(frozen=True, eq=False)
class TunedLoop:
    """A loop with the largest gain that keeps its limits."""

    loop: ClosedLoop  # with that gain
    gain: str  # name of the parameter
    value: float
    # limited_by: what a slightly larger gain would break, in words; empty where the end of the range was
    # reached
    limited_by: str


def largest_gain(
    loop: ClosedLoop,
    gain: str,
    *,
    between: tuple[float, float],
    angles: Sequence[float] | Array,
    limits: LoopLimits | None = None,
    draws: int = 0,
    translate: Translate = as_it_is,
) -> TunedLoop:
    """Return the loop with the largest gain that keeps its limits at all angles and for all draws.

    Observer and controller keep what they were designed with; a draw changes the plant alone. Nine gains are
    tried from the largest down, then it is refined between the first admissible one and its neighbour.

    Parameters
    ----------
    loop
        Closed loop.
    gain
        Name of a parameter of the controller.
    between
        Smallest and largest gain that are looked at.
    angles
        At which the margins are kept, shape (n,), in rad.
    limits
        What is kept.
    draws
        Number of draws of the plant's spread, besides its declared numbers; seed 1.
    translate
        For the simulated runs, for instance :func:`~nlsdesign.export.natively`.

    Raises
    ------
    UnknownNameError
        If the controller has no such parameter.
    ValueRangeError
        If the range is empty.
    InfeasibleError
        If each gain that was tried breaks a limit; it is named.
    """
    low, high = checked_gains(loop, gain, between)
    limits, at = limits or LoopLimits(), np.asarray(angles, dtype=float)
    plants = on_drawn_machines(loop, draws)

    def broken(value: float) -> str:
        return _broken([_with_gain(each, gain, value) for each in plants], at, limits, translate)

    # From above: a small gain may break a limit too, beside an integrator that is then too strong.
    reasons = [broken(high)]
    if not reasons[0]:
        return TunedLoop(_with_gain(loop, gain, high), gain, high, "")
    tried = [float(value) for value in np.geomspace(low, high, _TRIED)]
    for smaller, larger in zip(tried[-2::-1], tried[:0:-1], strict=True):
        reasons.append(broken(smaller))
        if not reasons[-1]:
            low, high = smaller, larger
            break
    else:
        raise InfeasibleError(
            f"{gain} from {low:g} to {high:g}",
            f"breaks a limit everywhere: at the smallest {reasons[-1]}, at the largest {reasons[0]}",
            next_step="look at smaller gains, change the integral gain or the velocity loop, or ask for less",
        )
    words = reasons[-2]
    while high > 1.01 * low:
        middle = math.sqrt(low * high)
        breaks = broken(middle)
        low, high, words = (low, middle, breaks) if breaks else (middle, high, words)
    return TunedLoop(_with_gain(loop, gain, low), gain, low, words)


def _with_gain(loop: ClosedLoop, gain: str, value: float) -> ClosedLoop:
    return replace(loop, controller=loop.controller.with_values({gain: value}))


def _broken(loops: Sequence[ClosedLoop], angles: Array, limits: LoopLimits, translate: Translate) -> str:
    """Return in words the first limit that one of the loops breaks, declared numbers first."""
    for number, loop in enumerate(loops):
        which = f"draw {number}, " if number else ""
        margins = loop_margins(loop, angles, opening=loop.desired)
        reached = margins.linear.reached
        held = np.abs(margins.linear.current) < loop.controller.outputs[0].maximum
        if not np.any(held):
            return f"{which}the current limit lets the loop hold none of the angles"
        if not np.all(reached[held]):
            lost = angles[held & ~reached][0]
            return f"{which}no rest inside the limits of the controller at {np.degrees(lost):.3g}°"
        if not np.all(margins.linear.stable()[reached]):
            return f"{which}the linear loop is unstable at an angle"
        for name, unit, values, least in (
            ("gain margin", "dB", margins.gain, limits.gain_margin),
            ("phase margin", "degrees", margins.phase, limits.phase_margin),
        ):
            worst = int(np.argmin(np.where(reached, values, np.inf)))
            if values[worst] < least:
                return f"{which}{name} {values[worst]:.3g} {unit} at {np.degrees(angles[worst]):.3g}°"
    if limits.amplitude > 0.0:
        runs = sine_response(
            loops[0], amplitude=limits.amplitude, frequencies=limits.frequencies, translate=translate
        )
        for frequency, verdict in zip(runs.frequency, runs.verdicts, strict=True):
            if not verdict.holds or verdict.saturated > limits.saturated:
                return f"±{limits.amplitude:g} N·m at {frequency:.3g} Hz: {verdict}"
    return ""


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
