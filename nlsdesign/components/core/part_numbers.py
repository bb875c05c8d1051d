"""Numbers of parts: unit, range and meaning of each, for every domain in which the part can be."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeAlias

from ...foundation.errors import ArrangementError, UnitError, ValueRangeError
from ...foundation.quantity import Quantity, parse_unit, same_dimension, with_unit
from .domain import Domain

Given: TypeAlias = Quantity | float | tuple[float, ...] | list[float]
"""What may be given for a number: a quantity, or bare number(s) in SI."""

_SHOWN = 4
"""How many numbers of a row a message shows."""

PerDomain: TypeAlias = float | Mapping[Domain, float]
"""One number, or one for each domain."""


@dataclass(frozen=True)
class ParameterInfo:
    """What a part says of one of its numbers."""

    unit: str  # SI unit
    description: str  # meaning in words
    # minimum, maximum: range in which the law holds and beyond which a number is taken for a slip of units;
    # inclusive
    minimum: float
    maximum: float
    row: bool = False  # whether it may be a row of numbers
    domain: str = ""  # name of the domain that the unit is of; empty where there is but one
    whole: bool = False  # whether it counts something, so that only whole numbers make sense

    def checked(self, name: str, given: Given) -> Quantity:
        """Return the number as a quantity of the right dimension and size."""
        result = given if isinstance(given, Quantity) else Quantity(given, self.unit)  # type: ignore[arg-type]
        if isinstance(result.value, tuple) and not self.row:
            raise ValueRangeError(
                f"{name} = {result}",
                f"is a row of {len(result.values)} numbers; {self.description} is one number",
                next_step="give one number without brackets",
            )
        if not same_dimension(result.unit, self.unit):
            raise UnitError(
                f"{name} = {result}",
                f"'{result.unit}' does not measure {self.description}"
                + (f" in {self.domain}" if self.domain else ""),
                next_step=f"give it in a unit like '{self.unit}'",
            )
        for value in result.values:
            if not self.minimum <= value <= self.maximum:
                raise ValueRangeError(
                    f"{name} = {result}",
                    f"{self.description} must lie in "
                    + with_unit(f"[{self.minimum:g}, {self.maximum:g}]", self.unit),
                    next_step=self._slip(result, value),
                )
            if self.whole and value != round(value):
                raise ValueRangeError(
                    f"{name} = {result}", f"{self.description} must be a whole number",
                    next_step=f"write {math.floor(value)} or {math.ceil(value)}",
                )  # fmt: skip
        return result

    def _slip(self, given: Quantity, value: float) -> str | None:
        number = value / parse_unit(given.unit).factor
        # An angle in degrees that is written as radians is likelier than a prefix left out.
        degrees = [f"deg{given.unit[3:]}"] if re.match(r"rad\b", given.unit) else []
        for unit in [*degrees, *(prefix + given.unit for prefix in ("m", "k", "M", "c")), "%"]:
            try:
                factor = parse_unit(unit).factor
            except UnitError:
                continue
            if same_dimension(unit, self.unit) and self.minimum <= number * factor <= self.maximum:
                return f"was '{unit}' meant? {with_unit(f'{number:g}', unit)} is in the range"
        # The next step where numbers in the shown unit were taken for numbers in SI.
        of_unit = parse_unit(given.unit).factor
        if of_unit == 1.0 or not all(self.minimum <= v * of_unit <= self.maximum for v in given.values):
            return None
        numbers = [f"{v:g}" for v in given.values[:_SHOWN]] + ["..."] * (len(given.values) > _SHOWN)
        row = ", ".join(numbers)
        text = f"({row})" if isinstance(given.value, tuple) else row
        return (
            f'was {with_unit(text, given.unit)} meant? write quantity({text}, "{given.unit}"); '
            f"Quantity takes its number in SI and is only shown in '{given.unit}'"
        )


@dataclass(frozen=True)
class Template:
    """What a class says of one of its numbers, for every domain."""

    unit: str  # SI unit; {motion}, {rate}, {effort} and {inertia} in it stand for those of a domain
    # description, minimum, maximum, row, whole: as in ParameterInfo; the range may differ between domains
    description: str
    minimum: PerDomain
    maximum: PerDomain
    row: bool = False
    whole: bool = False

    def within(self, domain: Domain | None) -> ParameterInfo:
        """Return what is said of the number in a domain.

        ``domain``: of the part; ``None`` where it has none and the unit is the same everywhere.
        """
        if domain is None:
            least, most = _of(self.minimum), _of(self.maximum)
            return ParameterInfo(self.unit, self.description, least, most, self.row, whole=self.whole)
        return ParameterInfo(
            domain.unit(self.unit), self.description, _of(self.minimum, domain), _of(self.maximum, domain),
            self.row, domain.name if "{" in self.unit else "", self.whole,
        )  # fmt: skip


def _of(value: PerDomain, domain: Domain | None = None) -> float:
    if not isinstance(value, Mapping):
        return value
    return value[domain] if domain is not None and domain in value else next(iter(value.values()))


def parameter(
    unit: str,
    description: str,
    *,
    minimum: PerDomain = 0.0,
    maximum: PerDomain = math.inf,
    default: float | tuple[float, ...] | None = None,
    row: bool = False,
    whole: bool = False,
) -> Any:
    """Declare a number of a part as a dataclass field.

    ``unit``: SI unit; in a law of several domains a template, for instance ``"{effort}/{motion}"``.
    ``default``: value in SI where there is a natural one; such a value is marked as assumed. Not for a
    template.
    """
    template = Template(unit, description, minimum, maximum, row, whole)
    if default is None:
        return dataclasses.field(metadata={"parameter": template})
    value = Quantity(default, unit, "assumed: default of the component")
    return dataclasses.field(default=value, metadata={"parameter": template})


def templates(kind: type) -> dict[str, Template]:
    """Return what a class says of each of its own numbers, by field name."""
    return {f.name: f.metadata["parameter"] for f in dataclasses.fields(kind) if "parameter" in f.metadata}


@dataclass(frozen=True)
class Reading:
    """Base of small objects in a part that say how its law is read; they choose behaviour.

    Their numbers are named as if they were the part's own: ``friction.creep_speed``, in decks and in models.
    """

    takes: ClassVar[tuple[Domain, ...]] = ()
    """Domains of the parts that it can be in; empty where it can be in any."""

    placing: ClassVar[str | None] = None
    """Where to put the part instead, when it is in another domain."""

    def within(self, domain: Domain | None) -> Self:
        """Return a copy whose numbers are checked, with the units of a domain.

        Parameters
        ----------
        domain
            Of the part.

        Raises
        ------
        ArrangementError
            If the reading cannot be in the domain.
        """
        if self.takes and domain not in self.takes:
            pairs = " or ".join(f"{each.motion} and {each.effort}" for each in self.takes)
            raise ArrangementError(type(self).__name__, f"acts on {pairs}", next_step=self.placing)
        infos = {name: template.within(domain) for name, template in templates(type(self)).items()}
        return dataclasses.replace(self, **{n: i.checked(n, getattr(self, n)) for n, i in infos.items()})


@dataclass(frozen=True)
class NotDeclared(Reading):
    """Numbers that a part can have and this one has not; what asks for them says so."""


def read_as(*kinds: type[Reading], default: Reading | None = None) -> Any:
    """Declare the field of a part that holds one of several readings.

    ``kinds``: classes that may stand there; none has a number of the same name as another.
    """
    if default is None:
        return dataclasses.field(metadata={"readings": kinds})
    return dataclasses.field(default=default, metadata={"readings": kinds})


def readings(kind: type) -> dict[str, tuple[type[Reading], ...]]:
    """Return the classes of readings that each field of a class may hold, by field name."""
    return {f.name: f.metadata["readings"] for f in dataclasses.fields(kind) if "readings" in f.metadata}


def one_of(*domains: Domain) -> Any:
    """Declare the field ``domain`` of a part that can be in several.

    Where none is given the units of the numbers tell it, and where no number has a unit it is the first.
    """
    return dataclasses.field(default=None, metadata={"domains": domains})


def domain_by_units(
    domains: Sequence[Domain], named: Mapping[str, Template], given: Mapping[str, object]
) -> Domain:
    """Return the domain whose units most of the given quantities have; the first of several.

    A number that then does not fit is refused where it is checked.
    """
    units = {n: q.unit for n, q in given.items() if isinstance(q, Quantity)}

    def fitting(domain: Domain) -> int:
        return sum(same_dimension(unit, named[n].within(domain).unit) for n, unit in units.items())

    return max(domains, key=fitting)
