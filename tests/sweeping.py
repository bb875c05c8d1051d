"""A sweep for tests of its engine: a cheap question of known answers, run here or in a process of its own."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import pyarrow.parquet as pq

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.work_sharing import DaskScheduler, Executor, InThisProcess, Processes
from nlsdesign.sweeps import FunctionQuestion, GridAxis, SobolSample, SweepTable, sweep
from nlsdesign.sweeps.run_sweep import SweepSettings

ROOT = Path(__file__).parent.parent
AREA, INERTIA = "spring.rubber.area", "motor.inertia"
COST = "NLSDESIGN_TEST_COST"
REFUSED = 3.9e-5
"""Area in m² from which on the question refuses."""


@functools.cache
def actuator() -> Assembly:
    return declare(load_deck("austin2015_as_printed"))


def product(made: Assembly) -> Mapping[str, float]:
    """Area times inertia, after as many seconds as ``COST`` says; too large an area is refused."""
    end = time.perf_counter() + float(os.environ.get(COST, "0"))
    while time.perf_counter() < end:
        pass
    numbers = made.quantities()
    if numbers[AREA].number > REFUSED:
        raise ValueError("the area is too large")
    return {"product": numbers[AREA].number * numbers[INERTIA].number}


def question() -> FunctionQuestion:
    return FunctionQuestion(product, {"product": "kg*m^4"})


def run(out: Path, count: int, executor: Executor, *, settings: SweepSettings | None = None) -> SweepTable:
    """Sweep ``2 count`` points."""
    axes = [
        SobolSample({AREA: ("0.1 cm^2", "0.4 cm^2")}, count, seed=3),
        GridAxis(INERTIA, "1e-6 kg*m^2", "2e-6 kg*m^2", 2),
    ]
    return sweep(
        actuator(), axes=axes, ask=question(), out=out, executor=executor,
        settings=settings or SweepSettings(),
    )  # fmt: skip


def rows_in_parts(out: Path) -> list[int]:
    """The points that stand on disk, one for each row; a part that is being replaced counts as none."""
    points: list[int] = []
    for path in sorted((out / "parts").glob("[0-9]*.parquet")):
        with contextlib.suppress(OSError):
            points += pq.read_table(path, columns=["point"]).column("point").to_pylist()
    return points


def wait_for_rows(out: Path, count: int, seconds: float = 180.0) -> int:
    """Wait until that many points stand on disk; return how many do."""
    end = time.monotonic() + seconds
    while (standing := len(rows_in_parts(out))) < count:
        assert time.monotonic() < end, f"only {standing} points after {seconds} s"
        time.sleep(0.05)
    return standing


@contextlib.contextmanager
def program(*words: str, cost: float = 0.0) -> Iterator[subprocess.Popen[str]]:
    """A Python program in a group of its own, which is killed whole at the end."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", COST: str(cost)}
    process = subprocess.Popen(
        [sys.executable, *words], cwd=ROOT, env=environment, start_new_session=True, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def driver(
    out: Path, count: int, cost: float, where: str
) -> contextlib.AbstractContextManager[subprocess.Popen[str]]:
    """The sweep of :func:`run` in a process of its own; ``where`` is a number of workers or an address."""
    return program("-m", "tests.sweeping", str(out), str(count), where, cost=cost)


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    path = Path(f"/proc/{process}/task/{process}/children")
    return [int(each) for each in path.read_text().split()] if path.exists() else []


def runs(process: int) -> bool:
    """Tell whether a process is there and not only its entry, which waits for a parent that collects it."""
    try:
        text = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
    return text.rpartition(")")[2].split()[0] != "Z"


def same_table(out: Path, count: int, folder: Path) -> bool:
    """Tell whether a sweep has the bytes of the one that this process computes alone."""
    run(folder, count, InThisProcess())
    return (out / "results.parquet").read_bytes() == (folder / "results.parquet").read_bytes()


if __name__ == "__main__":
    # Under the name by which tests import it, so that the question has the same source.
    from tests.sweeping import run as same_run

    place, points, where = sys.argv[1:]
    chosen: Executor = DaskScheduler(where) if "://" in where else Processes(int(where))
    from nlsdesign.foundation.processes import guarded

    guarded(lambda: print(len(same_run(Path(place), int(points), chosen))))
