"""What is made of a verdict after the diagnosis: with its circumstances, in sentences, as data frames."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from ....foundation.csv_tables import Axis, data_frame
from ....foundation.errors import NlsError
from ....foundation.locations import version
from ...identification.records.measurement import RecordSet
from ..block_prediction import ranges_left
from .circumstances import DiagnosisRun, records_of_run
from .fitted_numbers import FittedNumber, fitted_numbers, with_records_named
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


def verdict_of_run(
    verdict: Verdict, records: RecordSet, *, deck: str, folder: str, command: str, date: str
) -> Verdict:
    """Return a diagnosis that says under which circumstances it was made, also in its better model.

    Deck and folder of records as given, the command that repeats it, day and time as ISO 8601.
    """
    names = [record.name for record in records.of("fit")]
    run = DiagnosisRun(deck, folder, date, command, version(), records_of_run(records))
    better = with_records_named(verdict.actuator, folder, names, day=date[:10])
    return replace(verdict, run=run, actuator=better)


def range_findings(verdict: Verdict, records: RecordSet) -> list[str]:
    """Return in sentences which laws of the better model the records take out of their stated range."""
    try:
        left_ranges = ranges_left(verdict.actuator, records)
    except NlsError:  # the verdict stands, and says itself what cannot be simulated
        return []
    step = "take a law that is stated to hold so far, or leave such motions out of the records"
    return [f"record {name}: {warning} -> {step}" for name, warning in left_ranges]
