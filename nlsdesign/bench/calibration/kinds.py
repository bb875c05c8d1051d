"""The kinds of calibration by name, the files of a plan, and what was found in the records."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...foundation.text_files import write_text
from .bench_test import CalibrationTest, FreeRunTest, HungWeightTest, LoadCellTest
from .estimate import CalibrationRecords
from .plan import CalibrationPlan

KINDS: Mapping[str, CalibrationTest] = {
    "hung_weight": HungWeightTest(),
    "load_cell": LoadCellTest(),
    "free_run": FreeRunTest(),
}
"""The kinds of calibration by the names that commands and files give them."""


def write_plan(plan: CalibrationPlan, folder: Path) -> Path:
    """Write the plan as ``plan.json``.

    Parameters
    ----------
    plan
        From :func:`~nlsdesign.bench.calibration.what_calibration_buys`.
    folder
        Is made where it does not exist.
    """
    file = folder / "plan.json"
    write_text(file, json.dumps(plan.to_dict(), indent=2, ensure_ascii=False) + "\n")
    return file


def record_findings(tests: Sequence[CalibrationRecords]) -> list[str]:
    """Return in sentences what was found in the files: what is suspect, and remarks.

    Parameters
    ----------
    tests
        Records of calibrations as they were read.
    """
    suspect = [f"suspect: {finding}" for test in tests for finding in test.records.findings]
    return suspect + [str(remark) for test in tests for remark in test.records.remarks]
