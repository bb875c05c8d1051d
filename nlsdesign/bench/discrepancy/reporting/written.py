"""Tables of a verdict as data frames."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from ....foundation.data_frames import Axis, data_frame
from .fitted_numbers import FittedNumber, fitted_numbers
from .verdict import RecordGap, Verdict


def verdict_frames(verdict: Verdict) -> dict[str, Any]:
    """Return the tables of a verdict as ``pandas.DataFrame`` objects by name; needs pandas.

    Parameters
    ----------
    verdict
        Of a diagnosis.

    Returns
    -------
    dict
        ``gaps``: the error of each block on each record before and after; ``numbers``: the refitted numbers
        with standard errors; ``effects``: each number of each effect that was named; ``course``: the record
        over time.

    Raises
    ------
    MissingLibraryError
        If pandas is not installed, with the command that installs it.
    """
    effects = [
        (effect.name, name, value, unit, error)
        for effect in verdict.effects
        for name, (value, unit, error) in effect.parameters.items()
    ]
    heads = ("effect", "number", "value", "unit", "standard_error")
    numbers = fitted_numbers(verdict.fits)
    course = verdict.course
    over = {"measured": course.measured, "before": course.before, "after": course.after}
    return {
        "gaps": data_frame({f.name: [getattr(g, f.name) for g in verdict.gaps] for f in fields(RecordGap)}),
        "numbers": data_frame({f: [getattr(n, f) for n in numbers] for f in FittedNumber._fields}),
        "effects": data_frame({head: [row[k] for row in effects] for k, head in enumerate(heads)}),
        "course": data_frame(
            over, units=dict.fromkeys(over, course.unit), index=Axis("time", "s", course.time)
        ),
    }
