"""Wires between FMUs: which output an input reads, with which gain, and how late."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ...foundation.errors import ExportError, UnitError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity, parse_unit
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
