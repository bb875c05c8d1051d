"""The source of a fitted number: which records, on which day, and what was declared before any fit."""

from __future__ import annotations

from collections.abc import Sequence

from ....components.assembly.named_parts import Assembly
from ....model.derived_deck import named_by_content
from ..effects.candidate import SOURCE

_SHOWN = 3
_DECLARED = "; declared: "


def with_records_named(assembly: Assembly, folder: str, names: Sequence[str], *, day: str) -> Assembly:
    """Return a copy whose fitted numbers name in their source the records that they were fitted to.

    Parameters
    ----------
    assembly
        With numbers that a fit or a diagnosis has marked as fitted.
    folder
        Of the records.
    names
        Of the records that were fitted to.
    day
        Of the fit, ISO 8601.

    Examples
    --------
    A number that was fitted in March and again in April is then, for instance, from
    ``fitted to bench records sine_2Hz, hold in bench/april, 2026-04-20; declared: data sheet``.
    """
    shown = ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
    sourced = {
        name: number.with_value(number.value, _source(number.source, f"{shown} in {folder}, {day}"))
        for name, number in assembly.quantities().items()
        if number.source == SOURCE or number.source.startswith(f"{SOURCE};")
    }
    # Sources are a part of the content that names a derived deck.
    return named_by_content(assembly.with_values(sourced))


def _source(before: str, records: str) -> str:
    rest = before.removeprefix(SOURCE)
    if rest.startswith(_DECLARED):
        # Of a number that was fitted before, what was declared at first says more than a chain of fits.
        rest = _DECLARED + rest.split(_DECLARED)[-1]
    return f"{SOURCE} {records}{rest}"
