"""Numbers that a designer gives: bare in SI or with a unit, checked where they enter."""

from __future__ import annotations

from ...foundation.errors import UnitError, ValueRangeError
from ...foundation.quantity import Quantity, degrees, parse_unit, same_dimension, with_unit

_SLIPS = {
    "m": (("mm", 1e-3), ("cm", 1e-2)),
    "m^2": (("mm^2", 1e-6), ("cm^2", 1e-4)),
    "Pa": (("MPa", 1e6),),
    "kg/m^3": (("g/cm^3", 1e3),),
}


def in_si(
    name: str, given: Quantity | float, unit: str, *, minimum: float = 0.0, maximum: float = float("inf")
) -> float:
    """Return a number in SI.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> in_si("radius", quantity(3.0, "mm"), "m")
    0.003
    """
    if isinstance(given, Quantity):
        if not same_dimension(given.unit, unit):
            raise UnitError(
                f"{name} = {given}",
                "has no unit" if given.unit == "1" else f"'{given.unit}' is no unit of it",
                next_step=f"give it in a unit like '{unit}'",
            )
        value = given.number
    else:
        value = float(given)
    if not minimum <= value <= maximum:
        raise ValueRangeError(
            f"{name} = {with_unit(f'{value:g}', unit)}",
            "must lie in " + with_unit(f"[{minimum:g}, {maximum:g}]", unit),
            next_step=_slip(value, unit, minimum, maximum),
        )
    return value


def hold_in_si(
    owner: object,
    name: str,
    unit: str,
    *,
    minimum: float = 0.0,
    maximum: float = float("inf"),
    with_class: bool = False,
) -> None:
    """Hold a field of a frozen object as a number in SI, checked; for ``__post_init__``.

    ``with_class``: whether the class stands before the name where it is refused.
    """
    what = f"{type(owner).__name__}: {name}" if with_class else name
    value = in_si(what, getattr(owner, name), unit, minimum=minimum, maximum=maximum)
    object.__setattr__(owner, name, value)


def _slip(value: float, unit: str, minimum: float, maximum: float) -> str | None:
    if unit == "rad" and minimum <= degrees(value) <= maximum:
        return f"were degrees meant? degrees({value:g}) is in the range"
    for name, factor in _SLIPS.get(unit, ()):
        if minimum <= value * factor <= maximum:
            return f"was '{name}' meant? quantity({value:g}, '{name}') is in the range"
    return None


def plain(given: Quantity | float) -> float:
    """Return the number in SI of a field that :func:`in_si` has checked."""
    return given.number if isinstance(given, Quantity) else given


def in_unit(value: float, unit: str, digits: int = 4) -> str:
    """Return a number in SI as text in another unit, for people."""
    return with_unit(f"{value / parse_unit(unit).factor:.{digits}g}", unit)
