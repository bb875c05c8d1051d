"""The bench records beside the study are those that the rig simulation makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.rig.published import HIDDEN, PUBLISHED, SEED, record_name, study_table
from tests.rig.records import make_records


def test_record_is_the_rigs(root: Path) -> None:
    name = "sine_15deg_5.0Hz"
    table = make_records(PUBLISHED, HIDDEN, seed=SEED, only=(name,))[name] * np.array([1.0, 1.0, 1.0, 0.5])
    kept = (root / "studies" / "austin2015_bench" / f"{record_name(name)}.csv").read_text(encoding="utf8")
    made = study_table(table)
    assert made.splitlines()[0] == kept.splitlines()[0]
    # One unit of the last digit: another platform may round the last bit of a sine the other way.
    last_digit = np.array([1e-3, 1e-6, 1e-3, 1e-2])
    difference = np.abs(numbers(made) - numbers(kept))
    assert np.all(difference <= 1.01 * last_digit)


def numbers(text: str) -> np.ndarray:
    return np.array([[float(cell) for cell in line.split(",")] for line in text.splitlines()[1:]])
