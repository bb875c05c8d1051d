"""Diagnosis of the bench records of the published actuator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Effect, Verdict, effects
from nlsdesign.foundation.progress import Progress

from .._published import bench_records, with_bench_sensors

NAMED = (effects.second_relaxation,)
"""What the whole catalogue names: all that the fast way asks for."""
SLOWEST = ("sine_0.1Hz",)
"""What the fast way leaves out of the records: a quarter of the samples, which no other motion needs."""


def diagnose_bench(
    actuator: nls.Assembly, out: Path, progress: Progress, catalogue: Sequence[Effect] | None = None,
    *, without: Sequence[str] = (),
) -> Verdict:  # fmt: skip
    """Name what the records show and the declared actuator lacks; write verdict and better deck.

    ``without``: names of records that are left out.
    """
    bench = with_bench_sensors(actuator)
    whole = bench_records(bench)
    records = replace(whole, records=tuple(r for r in whole.records if r.name not in without))
    verdict = nls.diagnose(bench, records, catalogue=catalogue, progress=progress.note)
    nls.write_verdict(verdict, out / "diagnosis")
    return verdict
