"""A canonical order of records, which depends on their content and not on file names."""

from __future__ import annotations

from dataclasses import replace

from .held_out import content_digest
from .measurement import Record, RecordSet
from .quality import Finding


def in_canonical_order(records: RecordSet) -> RecordSet:
    """Return the same records and findings, ordered by the content of the records.

    Rounding of sums and choices among equals depend on the order of records. In canonical order results do
    not depend on the names of files.
    """
    ordered = tuple(sorted(records.records, key=_content))
    findings, remarks = (
        tuple(sorted(group, key=lambda finding: (_place(finding, ordered), finding.text)))
        for group in (records.findings, records.remarks)
    )
    return replace(records, records=ordered, findings=findings, remarks=remarks)


def _content(record: Record) -> tuple[int, str, str]:
    """Return number of samples, a digest of time and signals, and the role."""
    return len(record.trace), content_digest(record.trace), record.role


def _place(finding: Finding, ordered: tuple[Record, ...]) -> int:
    """Return the index of the record of a finding; the number of records if it belongs to none."""
    file = finding.place.partition(":")[0]
    known = [k for k, record in enumerate(ordered) if (record.source or record.name).startswith(file)]
    return known[0] if known else len(ordered)
