"""What a run is made of: instances, wires with their numbers, given signals, communication points.

Instances exchange values at every sample of every sampled instance, and in between as often as asked.

Wires between FMUs: which output an input reads, with which gain, and how late.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ExportError, UnitError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity, parse_unit
from .coupling import Coupling, GivenFeed
from .fmu_description import FmuDescription


def split_name(name: str) -> tuple[str, str]:
    """Return instance and variable of ``instance.variable``."""
    instance, _, variable = name.partition(".")
    return instance, variable


@dataclass(frozen=True)
class SamplesOf:
    """A delay in samples.

    Parameters
    ----------
    instance
        Sampled instance whose samples count; by default that which computes the value.
    count
        Number of samples.

    Raises
    ------
    ValueRangeError
        If the count is negative or not finite.
    """

    instance: str | None = None
    count: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.count) and self.count >= 0.0):
            raise ValueRangeError(f"delay of {self.count} samples", "must be a finite number, at least 0")


@dataclass(frozen=True)
class Wire:
    """Where an input comes from: target(t) = gain · source(t − delay).

    Before the first value arrives through a delay, the input keeps its start value.

    Parameters
    ----------
    source
        Output as ``instance.variable``.
    gain
        A number, −1 to turn the sign, or a quantity where the units differ, for instance
        ``nls.quantity(0.02, "m/rad")`` from an angle to a position.
    delay
        In s, or in samples of an instance, see :class:`SamplesOf`.

    Raises
    ------
    ValueRangeError
        If the gain is not finite, or the delay negative or not finite.
    """

    source: str
    gain: float | Quantity = 1.0
    delay: float | SamplesOf = 0.0

    def __post_init__(self) -> None:
        number = self.gain.number if isinstance(self.gain, Quantity) else self.gain
        if not math.isfinite(number):
            raise ValueRangeError(f"wire from '{self.source}' with gain {number}", "a gain must be finite")
        if isinstance(self.delay, SamplesOf):
            return
        if not (math.isfinite(self.delay) and self.delay >= 0.0):
            raise ValueRangeError(
                f"wire from '{self.source}' with a delay of {self.delay} s",
                "must be a finite number of seconds, at least 0",
            )


class Late(Wire):
    """A wire that is late by one sample of the instance that computes the value.

    Parameters
    ----------
    source
        Output of a sampled instance as ``instance.variable``.
    gain
        As in :class:`Wire`.
    """

    def __init__(self, source: str, gain: float | Quantity = 1.0) -> None:
        super().__init__(source, gain, SamplesOf())


def as_wire(source: str | Wire) -> Wire:
    """Return a wire for a source that may be a plain name."""
    return source if isinstance(source, Wire) else Wire(source)


def check_wires(descriptions: Mapping[str, FmuDescription], wires: Mapping[str, Wire]) -> None:
    """Check both ends, the units and the delay of each wire."""
    inputs, outputs = (ends(descriptions, causality) for causality in ("input", "output"))
    for target, wire in wires.items():
        if target not in inputs:
            raise unknown_name("wire to input", target, inputs)
        if wire.source not in outputs:
            raise unknown_name("wire from output", wire.source, outputs)
        gain_to(descriptions, target, wire)
        delay_of(descriptions, wire)


def ends(descriptions: Mapping[str, FmuDescription], causality: str | None = None) -> list[str]:
    """Return ``instance.variable`` of all variables of a causality.

    ``causality``: for instance ``"input"``; ``None`` for all.
    """
    return [
        f"{name}.{variable.name}"
        for name, description in descriptions.items()
        for variable in description.variables.values()
        if causality in (None, variable.causality)
    ]


def delay_of(descriptions: Mapping[str, FmuDescription], wire: Wire) -> float:
    """Return the stated delay of a wire in s."""
    if not isinstance(wire.delay, SamplesOf):
        return float(wire.delay)
    counted = wire.delay.instance or split_name(wire.source)[0]
    if counted not in descriptions:
        raise unknown_name("instance whose samples a delay counts", counted, descriptions)
    period = descriptions[counted].sample_time
    if period is None:
        raise ExportError(
            f"wire from '{wire.source}'",
            f"is late by samples of '{counted}', which is not sampled",
            next_step="give the delay in seconds, or in samples of a sampled instance",
        )
    return wire.delay.count * period


def gain_to(descriptions: Mapping[str, FmuDescription], target: str, wire: Wire) -> float:
    """Return the factor between the numbers of both ends, each in the unit that its FMU states."""
    number = wire.gain.number if isinstance(wire.gain, Quantity) else float(wire.gain)
    ends = (split_name(end) for end in (target, wire.source))
    names = [descriptions[instance].variables[variable].unit for instance, variable in ends]
    if None in names:
        return number
    try:
        to, of = (parse_unit(name or "1") for name in names)
    except UnitError:
        return number  # a unit of a foreign FMU that cannot be read here
    if not isinstance(wire.gain, Quantity):
        if (to.factor, to.mechanical) != (of.factor, of.mechanical):
            unit = f"{names[0] or 1}/{(names[1] or '1').replace('*', '/').replace('.', '/')}"
            hint = (
                f"give the gain a unit: '{target}={wire.source}*1 {unit}' behind --wire, "
                f"nls.quantity(1, '{unit}') in Python"
            )
            raise _apart(target, wire.source, names, hint)
        return number
    by = parse_unit(wire.gain.unit)
    if tuple(a + b for a, b in zip(of.mechanical, by.mechanical, strict=True)) != to.mechanical:
        raise _apart(
            target, wire.source, names, f"the gain in {wire.gain.unit} does not lead from one to the other"
        )
    return number * of.factor / to.factor


def _apart(target: str, source: str, units: list[str | None], hint: str) -> UnitError:
    return UnitError(
        f"wire '{target}' [{units[0]}]", f"reads '{source}', which is in [{units[1]}]", next_step=hint
    )


MOST_POINTS = 20_000_000
"""Communication points of one run; a run with a hundred signals then fills 16 GB."""
_SAME = 1e-9
"""Times closer than this part of the step are one."""


def sample_times(period: float, stop: float) -> Array:
    """Return the samples of an instance from 0 to the end."""
    return np.arange(math.floor(stop / period + 1e-6) + 1.0) * period


def communication_points(
    stop: float,
    step: float,
    *,
    periods: Iterable[float],
    changes: Iterable[tuple[float, float]],
    parts: int = 1,
) -> Array:
    """Return the communication points in s, from 0 to the end.

    What lies between two samples is divided into equal steps no longer than asked for, so step and sample
    times are independent; sample times need not be multiples of each other.
    """
    rhythms = [(period, 0.0) for period in sorted(set(periods))] + sorted(set(changes))
    expected = parts * (stop / step + sum(stop / period for period, _ in rhythms))
    if not expected <= MOST_POINTS:
        raise ValueRangeError(
            f"stop={stop:g} s in steps of at most {step:g} s",
            f"makes {expected:.3g} communication points, at most {MOST_POINTS} are possible",
            next_step="take a longer step or an earlier end",
        )
    breaks = [np.array([0.0, stop])]
    breaks += [sample_times(period, stop) + delay % period for period, delay in rhythms]
    if not rhythms:
        breaks.append(step * np.arange(math.floor(stop / step + 1e-6) + 1.0))
    # Ascending times up to the end, those that are one by rounding taken once.
    times = np.concatenate(breaks)
    same = _SAME * min([step, *(period for period, _ in rhythms)])
    ascending = np.unique(times[times <= stop + same])
    merged: Array = ascending[np.append(True, np.diff(ascending) > same)]
    if len(merged) > 1 and merged[-1] >= stop - same:
        merged[-1] = stop
    gaps = np.diff(merged)
    counts = parts * np.maximum(1, np.ceil(gaps / step - 1e-6).astype(int))
    starts, lengths = np.repeat(merged[:-1], counts), np.repeat(gaps / counts, counts)
    numbers = np.arange(len(starts)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(starts + numbers * lengths, merged[-1])


def rows_of(points: Array, times: Array) -> NDArray[np.int64]:
    """Return the numbers of the points that are nearest to times."""
    after = np.clip(np.searchsorted(points, times), 1, max(1, len(points) - 1))
    nearer = np.abs(points[after - 1] - times) <= np.abs(points[np.minimum(after, len(points) - 1)] - times)
    return np.where(nearer, after - 1, np.minimum(after, len(points) - 1))


@dataclass(frozen=True)
class Link:
    """A wire with its numbers."""

    # target, source: instance.variable
    target: str
    source: str
    gain: float  # factor between the numbers of both ends
    delay: float  # in s
    fresh: bool  # whether a sampled source has computed already when its target reads at the same time


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a run needs to know."""

    descriptions: Mapping[str, FmuDescription]
    links: tuple[Link, ...]
    signals: Mapping[str, GivenFeed]
    parameters: Mapping[str, float]
    order: tuple[str, ...]
    points: Array
    coupling: Coupling

    @property
    def columns(self) -> list[str]:
        """Names of what is recorded: outputs and inner signals, then driven inputs."""
        shown = [f"{name}.{v.name}" for name, each in self.descriptions.items() for v in each.shown]
        return [*shown, *(link.target for link in self.links), *self.signals]

    def sampled(self, name: str) -> bool:
        """Tell whether an instance, or the instance of a variable, is sampled."""
        return self.descriptions[split_name(name)[0]].sample_time is not None

    @property
    def coupling_links(self) -> list[Link]:
        """Wires between continuous instances."""
        return [link for link in self.links if self.curved(link) and not self.sampled(link.target)]

    @property
    def coupled(self) -> bool:
        """Whether there is an error of coupling: inputs of continuous instances that move between samples."""
        return bool(self.coupling_links) or any(not self.sampled(name) for name in self.signals)

    @property
    def acts_at_once(self) -> bool:
        """Whether something that is computed at a time acts on a continuous instance at that time."""
        return any(link.fresh and not link.delay and not self.sampled(link.target) for link in self.links)

    def curved(self, link: Link) -> bool:
        """Tell whether the source of a wire is continuous."""
        return not self.sampled(link.source)


def points_of(
    descriptions: Mapping[str, FmuDescription],
    links: Sequence[Link],
    stop: float,
    step: float,
    parts: int = 1,
) -> Array:
    """Return the communication points of a system in s."""
    periods = {name: each.sample_time for name, each in descriptions.items() if each.sample_time is not None}
    changes = {
        (periods[split_name(link.source)[0]], link.delay)
        for link in links
        if link.delay and split_name(link.source)[0] in periods and split_name(link.target)[0] not in periods
    }
    return communication_points(stop, step, periods=periods.values(), changes=changes, parts=parts)
