"""Diagnosis of the bench records of the published actuator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Effect, Verdict, effects
from nlsdesign.foundation.progress import Progress

from .._published import bench_records, with_bench_sensors

NAMED = (effects.second_relaxation,)
"""What the whole catalogue names: all that the fast way asks for."""


def diagnose_bench(
    actuator: nls.Assembly, out: Path, progress: Progress, catalogue: Sequence[Effect] | None = None
) -> Verdict:
    """Name what the records show and the declared actuator lacks; write verdict and better deck."""
    bench = with_bench_sensors(actuator)
    verdict = nls.diagnose(bench, bench_records(bench), catalogue=catalogue, progress=progress.note)
    nls.write_verdict(verdict, out / "diagnosis")
    return verdict
