"""Ties: an element and the bodies at its ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from .element import Element
from .part import Part


@dataclass(frozen=True, kw_only=True)
class Tie(Part):
    """An element between two bodies; its motion is that of the first minus that of the second.

    Parameters
    ----------
    element
        What relates motion and effort.
    between
        Names of the two bodies; one name means: against the resting frame.

    Raises
    ------
    ArrangementError
        If what is tied is no element, or there are not one or two ends.
    """

    element: Element
    between: tuple[str, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.element, Element):
            raise ArrangementError("tie", f"holds an element, not a {type(self.element).__name__}")
        if not 1 <= len(self.between) <= 2:
            raise ArrangementError(
                "tie", f"has {len(self.between)} ends; an element has two", next_step="name one or two bodies"
            )

    def children(self) -> Mapping[str, Part]:
        """Return the parts of the element: the tie adds no level to the names."""
        return self.element.children()

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other parts in the element."""
        return replace(self, element=self.element.with_children(children))

    def around(self, part: Part) -> Self:
        """Return a copy around another element.

        Parameters
        ----------
        part
            The element.

        Raises
        ------
        ArrangementError
            If the part is not an element.
        """
        # The kind is checked where the copy is made.
        return replace(self, element=part)  # type: ignore[arg-type]

    def parameters(self) -> dict[str, Quantity]:
        """Return the numbers of the element."""
        return self.element.parameters()


def tie(element: Element, *between: str) -> Tie:
    """Tie an element between two bodies, or between one body and the resting frame.

    Parameters
    ----------
    element
        For instance a spring.
    *between
        One or two names of bodies.
    """
    return Tie(element=element, between=between)
