"""What a run is made of: instances, wires with their numbers, signals from outside, communication points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...foundation.arrays import Array
from .communication_points import communication_points
from .coupling import Coupling
from .fmu_description import FmuDescription
from .wires import split_name


@dataclass(frozen=True)
class Link:
    """A wire with its numbers.

    Parameters
    ----------
    target, source
        ``instance.variable``.
    gain
        Factor between the numbers of both ends.
    delay
        In s.
    fresh
        Whether a sampled source has computed already when its target reads at the same time.
    """

    target: str
    source: str
    gain: float
    delay: float
    fresh: bool


@dataclass(frozen=True, eq=False)
class Given:
    """A signal from outside at the communication points.

    Parameters
    ----------
    values, left, middle
        At each point, just before it, and in the middle of the step from it.
    """

    values: Array
    left: Array
    middle: Array


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a run needs to know."""

    descriptions: Mapping[str, FmuDescription]
    links: tuple[Link, ...]
    signals: Mapping[str, Given]
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
