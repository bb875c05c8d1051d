"""The driver of a sweep holds what its docs say and no more, however many points there are."""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.foundation.progress import Quiet
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.work_sharing import PointOutcome
from nlsdesign.foundation.work_sharing.chunks import Chunk
from nlsdesign.sweeps import GridAxis, run_sweep
from nlsdesign.sweeps.run_sweep import SweepSettings, run_task, sweep_task
from nlsdesign.sweeps.sweep_columns import arrow_column, libraries, numpy_column, read_columns

INERTIA = "wheel.inertia"
PER_POINT = 220.0
"""Bytes for each point at the peak: the table that is given back (48) and what sorting it takes."""


class Instant:
    """Workers that answer at once, so that nothing but the driver is measured."""

    def __init__(self) -> None:
        self._waiting: list[Chunk] = []

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Instant]:
        del work
        yield self

    def free(self) -> int:
        return 1 - len(self._waiting)

    def workers(self) -> int:
        return 1

    def submit(self, chunk: Chunk) -> None:
        self._waiting.append(chunk)

    def finished(self, seconds: float) -> list[tuple[Chunk, list[PointOutcome]]]:
        del seconds
        chunks, self._waiting = self._waiting, []
        return [
            (chunk, [PointOutcome(k, (2.0 * p[0],), "", 0.01, f"somewhere:{k}") for k, p in chunk.points])
            for chunk in chunks
        ]


def doubled(made: Any) -> dict[str, float]:
    return {"doubled": 2.0 * made.quantities()[INERTIA].number}


def most_bytes(folder: Path, count: int) -> int:
    """Return the most that the driver has held at once during a run of so many points."""
    wheel = nls.assembly("wheel", wheel=nls.Inertia(inertia=quantity(1e-3, "kg*m^2", source="assumed")))
    ask = nls.sweeps.FunctionQuestion(doubled, {"doubled": "kg*m^2"})
    task = sweep_task(wheel, axes=[GridAxis(INERTIA, 1e-3, 2e-3, count)], ask=ask)
    tracemalloc.start()
    try:
        table = run_task(task, folder, executor=Instant(), settings=SweepSettings(), progress=Quiet())
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(table.values["doubled"], 2.0 * table.values[INERTIA])
    return most


@pytest.mark.slow
def test_the_driver_holds_no_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_sweep, "_MOST_ROWS", 256)
    most_bytes(tmp_path / "loaded", 600)
    few, many = most_bytes(tmp_path / "few", 1000), most_bytes(tmp_path / "many", 4000)
    assert many - few < 3000 * PER_POINT


@pytest.mark.slow
def test_the_driver_holds_no_results_of_a_hundred_thousand_points(tmp_path: Path) -> None:
    most_bytes(tmp_path / "loaded", 10_000)
    few, many = most_bytes(tmp_path / "few", 10_000), most_bytes(tmp_path / "many", 100_000)
    assert many - few < 90_000 * PER_POINT
    assert many < 40e6


@pytest.mark.slow
def test_a_driver_does_not_load_pandas(tmp_path: Path) -> None:
    program = (
        "import sys; from tests.unit.sweeps.test_memory import most_bytes; from pathlib import Path; "
        "most_bytes(Path(sys.argv[1]), 3000); print('pandas' in sys.modules)"
    )
    root = Path(__file__).parents[3]
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "out")], cwd=root, capture_output=True, text=True,
        timeout=120, check=False,
    )  # fmt: skip
    assert done.stdout == "False\n", done.stderr


def test_columns_go_through_arrow_unchanged(tmp_path: Path) -> None:
    pyarrow, parquet = libraries()
    columns = {
        "i": ([3, -1], pyarrow.int64()),
        "f": ([float("nan"), -0.0], pyarrow.float64()),
        "s": (["", "\u00fc\x00"], pyarrow.string()),
    }
    arrays = [arrow_column(*each) for each in columns.values()]
    table = pyarrow.Table.from_arrays(arrays, names=list(columns))
    table.validate(full=True)
    parquet.write_table(table, tmp_path / "columns.parquet")
    for name, (values, _) in columns.items():
        back = numpy_column(read_columns(tmp_path / "columns.parquet").column(name))
        assert list(map(repr, back.tolist())) == list(map(repr, values))


def test_what_others_have_written_is_read_too() -> None:
    """A table that was opened and saved by another program: 32 bits, and nothing in place of not a number."""
    pyarrow, _ = libraries()
    floats, words = pyarrow.array([1.5, None], pyarrow.float32()), pyarrow.array(["a", None])
    table = pyarrow.table({"f": floats, "s": words.cast("large_string"), "i": pyarrow.array([4, None])})
    parts = pyarrow.concat_tables([table, table.slice(1), table.slice(0, 1)])
    assert np.array_equal(numpy_column(parts.column("f")), [1.5, np.nan, np.nan, 1.5], equal_nan=True)
    assert np.array_equal(numpy_column(parts.column("i")), [4.0, np.nan, np.nan, 4.0], equal_nan=True)
    assert numpy_column(parts.column("s")).tolist() == ["a", "", "", "a"]
    assert len(numpy_column(parts.slice(0, 0).column("s"))) == 0
    assert arrow_column([], pyarrow.string()).to_pylist() == []
