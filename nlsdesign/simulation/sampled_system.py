"""A continuous plant and discrete blocks that are wired by name and sampled together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from ..foundation.errors import ValueRangeError
from ..model import FlatModel

PLANT = "plant"


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledSystem:
    """A continuous plant and discrete blocks, wired by name.

    Parameters
    ----------
    plant
        Continuous; its variables are called ``plant.NAME``.
    blocks
        Discrete models by name, sampled alike, in the order in which they are evaluated.
    sources
        For each input of a block, by full name, the full name of what it gets: a variable of the plant, an
        output of an earlier block, or its own name where it is an open input.
    driven
        Name of the plant's input that is driven by the first output of the last block, or ``None``.
    delay
        Samples between the computation of the driven input and its effect.
    substeps
        Runge–Kutta steps of the plant per sample. The product of the fastest eigenvalue and the step should
        stay below about 0.3.

    Raises
    ------
    ValueRangeError
        If the plant is discrete or has laws that jump, the blocks are not sampled alike, or delay or
        substeps is too small.
    """

    plant: FlatModel
    blocks: Mapping[str, FlatModel]
    sources: Mapping[str, str]
    driven: str | None
    delay: int = 1
    substeps: int = 10

    def __post_init__(self) -> None:
        if self.plant.sample_time is not None:
            raise ValueRangeError(f"model '{self.plant.name}'", "is discrete; the plant must be continuous")
        jumps = self.plant.switching.jumps if self.plant.switching is not None else ()
        if jumps:
            raise ValueRangeError(
                f"model '{self.plant.name}' with the sharp laws {', '.join(jumps)}",
                "cannot be the plant of a sampled loop, whose fixed steps locate no events",
                next_step="take the smooth form of the laws: flatten(smoothed(assembly))",
            )
        times = {block.sample_time for block in self.blocks.values()}
        if len(times) != 1 or None in times:
            raise ValueRangeError(f"sample times {times} s", "all blocks must be discrete and sampled alike")
        if self.delay < 0 or self.substeps < 1:
            raise ValueRangeError(f"delay {self.delay}, substeps {self.substeps}", "must be at least 0 and 1")

    @property
    def sample_time(self) -> float:
        """Sample time in s."""
        return float(next(iter(self.blocks.values())).sample_time or 0.0)

    @cached_property
    def owners(self) -> dict[str, FlatModel]:
        """Plant and blocks by name."""
        return {PLANT: self.plant, **self.blocks}

    @cached_property
    def open_inputs(self) -> tuple[str, ...]:
        """Full names of the inputs that are driven from outside, those of the plant first."""
        plant = [f"{PLANT}.{v.name}" for v in self.plant.inputs if v.name != self.driven]
        return (*plant, *(name for name, source in self.sources.items() if name == source))

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Full names of all states, and of the values of the driven input that wait for their sample."""
        names = [f"{owner}.{v.name}" for owner, model in self.owners.items() for v in model.states]
        waiting = self.delay if self.driven is not None else 0
        return (*names, *(f"{PLANT}.{self.driven}.waiting[{i + 1}]" for i in range(waiting)))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Full names of all parameters."""
        return tuple(f"{owner}.{v.name}" for owner, model in self.owners.items() for v in model.parameters)
