"""Records that are held out choose nothing: whatever they hold, only the error that is reported changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import diagnose
from nlsdesign.bench.discrepancy.effects import coulomb_friction, quadratic_drag
from nlsdesign.bench.discrepancy.reporting.verdict import Verdict
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.records.quality import Finding
from nlsdesign.components import Assembly
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.simulation import Trace
from tests.hand_machines import Level, Machine, made

FEW = (quadratic_drag, coulomb_friction)
ALLOWED = {"error", "where", "records"}
"""Of ``verdict.json`` that may depend on records that are held out."""


@pytest.fixture(scope="module")
def rubbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, RecordSet]:
    """Three records of a motor with dry friction, some of which are held out by default."""
    level: Level = lambda rate, angle, load: 0.12  # noqa: E731
    return made(Machine(friction=level), tmp_path_factory.mktemp("rubbed"), records=3)


def changed(record: Record) -> Record:
    """A record of something else: noise many times as large, a drag, another clock of the force."""
    if record.role != "held_out":
        return record
    draw = np.random.default_rng(8)
    signals = {
        name: np.roll(3.0 * rows, 40) + 0.05 * float(np.std(rows)) * draw.standard_normal(len(rows))
        for name, rows in record.trace.signals.items()
    }
    return replace(record, trace=Trace(record.trace.time, signals, record.trace.units, record.trace.name))


def told(verdict: Verdict) -> dict[str, object]:
    return {key: value for key, value in verdict.to_dict().items() if key not in ALLOWED}


def test_only_the_reported_error_depends_on_held_out_records(rubbed: tuple[Assembly, RecordSet]) -> None:
    declared, records = rubbed
    assert any(r.role == "held_out" for r in records.records), "or the test would show nothing"
    plain = diagnose(declared, records, catalogue=FEW)
    other = replace(records, records=tuple(changed(r) for r in records.records))
    spoilt = diagnose(declared, other, catalogue=FEW)
    assert plain.verdict == "named"
    assert [e.name for e in plain.effects] == ["coulomb_friction"]
    assert told(spoilt) == told(plain)
    assert spoilt.findings == plain.findings
    assert spoilt.rms("after", "held_out") > 3.0 * plain.rms("after", "held_out")


def test_findings_about_held_out_records_do_not_make_the_others_suspect(
    rubbed: tuple[Assembly, RecordSet],
) -> None:
    _, records = rubbed
    held = next(r for r in records.records if r.role == "held_out")
    fitted = next(r for r in records.records if r.role == "fit")
    findings = tuple(Finding(f"{r.source or r.name}: column 'force_N'", "is clipped") for r in (held, fitted))
    kept = replace(records, findings=findings).without_held_out()
    assert kept.findings == (findings[1],)
    assert all(r.role != "held_out" for r in kept.records)


def test_records_that_are_all_held_out_cannot_choose(rubbed: tuple[Assembly, RecordSet]) -> None:
    _, records = rubbed
    held = tuple(replace(r, role="held_out") for r in records.records)
    with pytest.raises(MeasurementError, match="are all held out"):
        replace(records, records=held).without_held_out()
