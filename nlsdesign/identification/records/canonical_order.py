"""A canonical order of records, which depends on their content and not on file names."""

from __future__ import annotations

import hashlib
from dataclasses import replace

from .measurement import Record, RecordSet
from .quality import Finding


def in_canonical_order(records: RecordSet) -> RecordSet:
    """Return the same records and findings, ordered by the content of the records.

    Rounding of sums and choices among equals depend on the order of records. In canonical order results do
    not depend on the names of files.

    Parameters
    ----------
    records
        In any order.
    """
    ordered = tuple(sorted(records.records, key=_content))
    findings = sorted(records.findings, key=lambda finding: (_place(finding, ordered), finding.text))
    return replace(records, records=ordered, findings=tuple(findings))


def _content(record: Record) -> tuple[int, str, str]:
    """Return number of samples, a digest of time and signals, and the role."""
    digest = hashlib.sha256(record.trace.time.tobytes())
    for name in sorted(record.trace.signals):
        digest.update(record.trace.signals[name].tobytes())
    return len(record.trace), digest.hexdigest(), record.role


def _place(finding: Finding, ordered: tuple[Record, ...]) -> int:
    """Return the index of the record of a finding; the number of records if it belongs to none."""
    file = finding.place.partition(":")[0]
    known = [k for k, record in enumerate(ordered) if (record.source or record.name).startswith(file)]
    return known[0] if known else len(ordered)
