"""A fit and a diagnosis with the circumstances of their run, and what is to be known of them."""

from __future__ import annotations

from dataclasses import replace

from ....foundation.errors import NlsError
from ....foundation.locations import version
from ...identification.records.measurement import RecordSet
from ..block_prediction import ranges_left
from .circumstances import DiagnosisRun, records_of_run
from .fitted_numbers import with_records_named
from .refit import Refit
from .verdict import Verdict


def refit_of_run(result: Refit, records: RecordSet, *, folder: str, day: str) -> Refit:
    """Return a fit whose numbers name in their source the records that they were fitted to.

    Parameters
    ----------
    result
        Of the fit.
    records
        That it was made with.
    folder
        Of the records.
    day
        Of the fit, ISO 8601.
    """
    names = [record.name for record in records.of("fit")]
    return replace(result, actuator=with_records_named(result.actuator, folder, names, day=day))


def verdict_of_run(
    verdict: Verdict, records: RecordSet, *, deck: str, folder: str, command: str, date: str
) -> Verdict:
    """Return a diagnosis that says under which circumstances it was made, also in its better model.

    Parameters
    ----------
    verdict
        Of the diagnosis.
    records
        That it was made with.
    deck, folder
        Deck and folder of records, as given.
    command
        Command line that repeats it.
    date
        Day and time, ISO 8601.
    """
    names = [record.name for record in records.of("fit")]
    run = DiagnosisRun(deck, folder, date, command, version(), records_of_run(records))
    better = with_records_named(verdict.actuator, folder, names, day=date[:10])
    return replace(verdict, run=run, actuator=better)


def range_findings(verdict: Verdict, records: RecordSet) -> list[str]:
    """Return which laws of the better model the records take out of their stated range, each in a sentence.

    Parameters
    ----------
    verdict
        Of the diagnosis.
    records
        That it was made with.
    """
    try:
        left_ranges = ranges_left(verdict.actuator, records)
    except NlsError:  # the verdict stands, and says itself what cannot be simulated
        return []
    step = "take a law that is stated to hold so far, or leave such motions out of the records"
    return [f"record {name}: {warning} -> {step}" for name, warning in left_ranges]
