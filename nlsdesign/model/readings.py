"""What measured signals show, and how the value behind a reading follows from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..components.assembly.named_parts import Assembly
from ..components.sensing.sensors import Sensor
from ..foundation.symbolic import Expression


@dataclass(frozen=True)
class ReadingNames:
    """What a measured signal shows, through which chain of sensors."""

    signal: str  # name of the reading; of a signal that is measured without a sensor, its own
    measured: str  # name of the state, input or signal that it shows
    sensors: tuple[str, ...] = ()  # names of the sensors between, the one that gives the reading first
    laws: tuple[Sensor, ...] = ()  # the sensors themselves, in the same order

    @property
    def delays(self) -> tuple[str, ...]:
        """Names of the parameters whose sum says by how many seconds the reading is late."""
        pairs = zip(self.sensors, self.laws, strict=True)
        return tuple(f"{name}.{law.late_by}" for name, law in pairs if law.late_by)

    @property
    def stretches(self) -> tuple[str, ...]:
        """Names of the parameters whose sum says by how much per time the reading becomes late."""
        pairs = zip(self.sensors, self.laws, strict=True)
        return tuple(f"{name}.{law.stretched_by}" for name, law in pairs if law.stretched_by)

    @property
    def shows_value(self) -> bool:
        """Whether what is measured can be inferred from the reading."""
        return all(law.shows_value for law in self.laws)

    def inferred(self, reading: Expression, known: Mapping[str, Expression]) -> Expression:
        """Return the value behind a reading: the inverse of each sensor, the last one first."""
        for name, law in zip(self.sensors, self.laws, strict=True):
            reading = law.infer(_NumbersOf(name, known), reading)
        return reading


class _NumbersOf:
    """The parameters and states of one sensor among those of a model."""

    def __init__(self, sensor: str, known: Mapping[str, Expression]) -> None:
        self._sensor, self._known = sensor, known

    def parameter(self, name: str) -> Expression:
        """Return one of its numbers."""
        return self._known[f"{self._sensor}.{name}"]

    def memory(self, name: str) -> Expression:
        """Return one of its states."""
        return self._known[f"{self._sensor}.{name}"]


def reading_of(readings: Sequence[ReadingNames], signal: str) -> ReadingNames:
    """Return what a signal shows; one that is not the reading of a sensor shows itself."""
    return next((r for r in readings if r.signal == signal), ReadingNames(signal, signal))


def readings_of(assembly: Assembly) -> tuple[ReadingNames, ...]:
    """Return what each sensor of an assembly shows, through which chain of sensors."""
    sensors, readings = assembly.sensors(), []
    for name in sensors:
        measured, chain = assembly.measured(f"{name}.reading")
        laws = tuple(sensors[each] for each in chain)
        readings.append(ReadingNames(f"{name}.reading", measured, chain, laws))
    return tuple(readings)
