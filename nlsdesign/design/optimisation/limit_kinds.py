"""The limits that have one number, as a designer sets them: name, unit, side."""

from __future__ import annotations

from dataclasses import dataclass

from ...foundation.errors import ValueRangeError
from ...foundation.written_numbers import in_unit
from ..curves.numbers import plain
from .limits import Limit, OneNumber


@dataclass(frozen=True)
class LimitKind:
    """A limit with one number.

    Parameters
    ----------
    kind
        Its class.
    described
        What the class says of its number.
    """

    kind: type[Limit]
    described: OneNumber

    @property
    def words(self) -> str:
        """What is limited."""
        return self.described.words

    @property
    def unit(self) -> str:
        """SI unit of the number."""
        return self.described.unit

    @property
    def shown_unit(self) -> str:
        """Unit in which people read it."""
        return self.described.shown_unit

    @property
    def upper(self) -> bool:
        """Whether the number is the largest that is allowed, or the least."""
        return self.described.upper

    @property
    def of_shape(self) -> bool:
        """Whether the contour alone decides it."""
        return self.described.of_shape

    @property
    def name(self) -> str:
        """Name of the class."""
        return self.kind.__name__

    @property
    def title(self) -> str:
        """What it limits, and to which side."""
        return f"{'largest' if self.upper else 'least'} {self.words}"

    def shown(self, value: float) -> str:
        """Return a number in the unit in which people read it."""
        if self.shown_unit == "%":
            return f"{100.0 * value:.4g} %"
        return in_unit(value, self.shown_unit)

    @property
    def read_unit(self) -> str:
        """SI unit, or "%" for a ratio that is read in per cent."""
        return self.shown_unit if self.shown_unit == "%" else self.unit

    def limit(self, value: float) -> Limit:
        """Return the limit."""
        if not abs(value) < float("inf"):
            raise ValueRangeError(f"{self.title} = {value:g}", "is no finite number")
        return self.kind(**{self.described.field: value})

    def value_of(self, limit: Limit) -> float:
        """Return the number of a limit of this kind in SI: what is allowed, with its safety factor."""
        return plain(getattr(limit, self.described.field)) / float(getattr(limit, "safety_factor", 1.0))


def limit_kinds() -> dict[str, LimitKind]:
    """Return the limits with one number by name, those of other packages that are loaded among them."""
    known: dict[str, LimitKind] = {}
    classes = list(Limit.__subclasses__())
    while classes:
        kind = classes.pop(0)
        if kind.described is not None:
            known[kind.__name__] = LimitKind(kind, kind.described)
        classes += kind.__subclasses__()
    return known
