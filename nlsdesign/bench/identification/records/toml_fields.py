"""Fields of ``records.toml``: one of the wrong kind is one message with file, field, rule and next step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ....foundation.errors import MeasurementError


def table_at(file: str, field: str, given: Any, next_step: str) -> Mapping[str, Any]:
    """Return a field that must be a table."""
    if not isinstance(given, dict):
        raise MeasurementError(f"{file}: {field}", f"{_shown(given)} is not a table", next_step=next_step)
    return given


def text_at(where: str, field: str, given: Any) -> str:
    """Return a field that must be a text."""
    if not isinstance(given, str):
        raise MeasurementError(
            f"{where}.{field}", f"{_shown(given)} is not a text", next_step=f'write {field} = "..."'
        )
    return given


def number_at(where: str, field: str, given: Any, next_step: str, between: str = ": ") -> float:
    """Return a field that must be a finite number."""
    if isinstance(given, int | float) and not isinstance(given, bool):
        try:
            number = float(given)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if math.isfinite(number):
            return number
    raise MeasurementError(
        f"{where}{between}{field}", f"{_shown(given)} is not a finite number", next_step=next_step
    )


def globs_at(file: str, field: str, given: Any) -> tuple[str, ...]:
    """Return a field that must be a list of names of records."""
    if not isinstance(given, list) or not all(isinstance(each, str) for each in given):
        raise MeasurementError(
            f"{file}: {field}",
            f"{_shown(given)} is not a list of names of records",
            next_step=f'write {field} = ["multisine*"]',
        )
    return tuple(given)


def _shown(given: Any) -> str:
    try:
        text = repr(given)
    except ValueError:  # whole numbers beyond the limit of digits
        text = "the number"
    return text if len(text) <= 40 else f"{text[:37]}..."
