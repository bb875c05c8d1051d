"""Numbers after a fit: how well they are known, how far each has moved, and what their source says now."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ....components.assembly.named_parts import Assembly
from ....foundation.quantity import to_resolution, with_unit
from ....model.origin import named_by_content
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter
from ..effects.effect import SOURCE


class FittedNumber(NamedTuple):
    """One refitted number."""

    # name, unit: full name and SI unit
    name: str
    unit: str
    # declared, fitted, standard_error: in SI
    declared: float
    fitted: float
    standard_error: float
    strain: float  # how far it went, in declared standard deviations; the fit stops at 3
    spread: float | str = 0.0  # as declared: 0.15 means ± 15 %; with its unit where it is not relative

    @property
    def at_end(self) -> bool:
        """Whether the fit stopped at the end of what was declared, where an error says nothing."""
        return not math.isfinite(self.standard_error)


def fitted_numbers(fits: Sequence[Fit]) -> tuple[FittedNumber, ...]:
    """Return the refitted numbers of which something was declared, in the order of the fits."""
    return tuple(_number(fit, p) for fit in fits for p in fit.parameters if p.known)


def _number(fit: Fit, parameter: Parameter) -> FittedNumber:
    value = fit.values[parameter.name]
    moved = parameter.inward(value) - parameter.inward(parameter.centre)
    error = fit.standard_error(parameter.name)
    return FittedNumber(
        parameter.name,
        parameter.unit,
        parameter.centre,
        to_resolution(value, error),
        math.nan if parameter.at_end(value) else error,
        moved / (parameter.sigma if math.isfinite(parameter.sigma) else 1.0),
        parameter.spread.data(lambda v: with_unit(f"{v:.4g}", parameter.unit)),
    )


_SHOWN = 3
_DECLARED = "; declared: "


def with_records_named(assembly: Assembly, folder: str, names: Sequence[str], *, day: str) -> Assembly:
    """Return a copy whose fitted numbers name in their source the records that they were fitted to.

    A number that was fitted in March and again in April is then, for instance, from
    ``fitted to bench records sine_2Hz, hold in bench/april, 2026-04-20; declared: data sheet``.
    """
    shown = ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
    sourced = {
        name: number.with_value(number.value, _source(number.source, f"{shown} in {folder}, {day}"))
        for name, number in assembly.quantities().items()
        if number.source == SOURCE or number.source.startswith((f"{SOURCE};", f"{SOURCE},"))
    }
    # Sources are a part of the content that names a derived deck.
    return named_by_content(assembly.with_values(sourced))


def _source(before: str, records: str) -> str:
    # Of a number that was fitted before, what was declared at first says more than a chain of fits.
    rest, *declared = before.removeprefix(SOURCE).split(_DECLARED)
    rest += _DECLARED + declared[-1] if declared else ""
    return f"{SOURCE} {records}{rest}"
