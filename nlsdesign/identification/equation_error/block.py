"""A piece of a model that is driven by measured signals and has a residual of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ...model import FlatModel


class Drive(NamedTuple):
    """How an input of a block follows from a record.

    Parameters
    ----------
    signal
        Full name of the measured signal.
    order
        0 for its value, 1 for its rate, 2 for the derivative of that.
    late_by
        Names of the parameters whose sum says by how much the signal comes late.
    """

    signal: str
    order: int = 0
    late_by: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Block:
    """A model whose inputs are measured, and what its output must equal.

    Parameters
    ----------
    name
        Where it is, for instance ``"spring"``.
    model
        All inputs that are not driven rest at their start value.
    drives
        By name of the input.
    output
        Name of the model's only output.
    target
        Full name of the measured signal that the output must equal; ``None`` if it must vanish.
    moving
        Name of the input that must be well away from zero for the block to say anything (dry friction at
        rest can be anything); ``None`` if there is no such input.
    """

    name: str
    model: FlatModel
    drives: Mapping[str, Drive]
    output: str
    target: str | None
    moving: str | None = None

    @property
    def unit(self) -> str:
        """Unit of the residual."""
        return self.model.outputs[0].unit
