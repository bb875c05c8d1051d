"""What a sweep costs besides its points: overhead, memory of the driver, what a kill costs, size of results.

Each run is a process of its own. The yardstick is the processor time of the same points computed one after
the other without any of the engine, by as many processes at once as there are workers: two cores that both
work are slower than one that works alone. Two overheads are given: processor time of driver and
workers together over that of the points, and time of the workers in which no point was computed. Printed, not
asserted; ``--write`` puts the table into ``docs/scale.md``:

    python -m benchmarks.sweeps --points 10000 --write docs/scale.md
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

WORKERS = 2
YARDSTICK = 1000
MARK = "<!-- written by benchmarks.sweeps from here on -->"
COUNTED = "NLSDESIGN_COUNTED_POINTS"


def main() -> None:
    """Run all measurements, or one of them in this process."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--write", type=Path, help="Markdown file for the table; its head is kept")
    parser.add_argument("--one", choices=MEASURED, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(MEASURED[given.one](given.points, given.out)), flush=True)
        return
    text = table(given.points)
    print(text)
    if given.write:
        head = given.write.read_text(encoding="utf8").partition(MARK)[0].rstrip()
        given.write.write_text(f"{head}\n\n{MARK}\n\n{text}", encoding="utf8")


def table(points: int) -> str:
    """Return all measurements as Markdown."""
    load = os.getloadavg()[0]
    before = cost_of_a_point()
    runs = {name: one(name, points) for name in ("processes", "dask")}
    after = cost_of_a_point()
    cost = 0.5 * (before + after)
    lines = [
        f"{points} points of {1e3 * cost:.1f} ms each ({1e3 * before:.1f} before, {1e3 * after:.1f} after; "
        f"the changed deck is written and read back), {WORKERS} workers, {os.cpu_count()} cores, load at the "
        f"start {load:.1f}; `python -m benchmarks.sweeps --points {points}`.",
        "",
        "| workers | wall s | processor time over that of the points | workers without a point | "
        "driver's memory: at first, most MiB | results bytes per point |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, run in runs.items():
        processor = run["processor"] / (points * cost) - 1.0
        idle = 1.0 - run["point_seconds"] / (WORKERS * run["wall"])
        lines.append(
            f"| {name} | {run['wall']:.0f} | {100 * processor:+.1f} % | {100 * idle:.1f} % | "
            f"{run['first']:.0f}, {run['most']:.0f} | {run['bytes'] / points:.0f} |"
        )
    lines += ["", "Memory of the driver over the number of points, which are over at once:", ""]
    lines += ["| points | most MiB | wall s | results MB |", "| --- | --- | --- | --- |"]
    for count in (1_000, 10_000, 100_000):
        run = one("memory", count)
        cells = (f"{count}", f"{run['most']:.0f}", f"{run['wall']:.0f}", f"{run['bytes'] / 1e6:.2f}")
        lines.append(f"| {' | '.join(cells)} |")
    killed = kill_and_resume()
    lines += ["", (
        f"Driver killed (signal 9) after {killed['after']:.0f} s: {killed['computed']} points had been begun "
        f"over both runs for a table of {killed['points']}; {killed['lost']} were computed twice, "
        f"{killed['seconds']:.1f} s of one core."
    ), ""]  # fmt: skip
    return "\n".join(lines)


def cost_of_a_point() -> float:
    """Return the processor time of a point without the engine, as many processes at once as workers."""
    return sum(each["cost"] for each in at_once("yardstick", YARDSTICK, WORKERS)) / WORKERS


def one(name: str, points: int) -> dict[str, Any]:
    """Return what one measurement gives in a process of its own."""
    return at_once(name, points, 1)[0]


def at_once(name: str, points: int, count: int) -> list[dict[str, Any]]:
    """Return what a measurement gives in each of several processes that run at once."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    words = [sys.executable, "-m", "benchmarks.sweeps", "--one", name, "--points", str(points), "--out"]
    with tempfile.TemporaryDirectory() as folder:
        begun = [
            subprocess.Popen([*words, f"{folder}/{k}"], stdout=subprocess.PIPE, text=True, env=environment)
            for k in range(count)
        ]
        shown = [each.communicate()[0] for each in begun]
        if any(each.returncode for each in begun):
            raise RuntimeError(f"{name}: a process of the measurement failed, see above")
    return [json.loads(each.splitlines()[-1]) for each in shown]


def asked(points: int) -> dict[str, Any]:
    """Return the arguments of the sweep that is measured."""
    import nlsdesign as nls

    axes = nls.sweeps.SobolSample({"motor.inertia": (1e-6, 1e-5), "spring.rubber.area": (2e-5, 8e-5)}, points)
    return {
        "actuator": nls.declare(nls.load_deck("austin2015_figure_consistent")),
        "axes": [axes],
        "ask": nls.sweeps.FunctionQuestion(read_again, {"numbers": "", "inertia": "kg*m^2"}),
    }  # fmt: skip


def read_again(made: Any) -> Mapping[str, float]:
    """Return numbers of an assembly that was written as a deck and read back: a cheap point."""
    from nlsdesign.components.assembly.deck_writer import deck_text, declare
    from nlsdesign.foundation.deck import read_deck

    back = declare(read_deck(deck_text(made), Path("point.toml")))
    numbers = back.quantities()
    return {"numbers": float(len(numbers)), "inertia": numbers["motor.inertia"].number}


def yardstick(points: int, _: Path) -> dict[str, Any]:
    """Return the processor time of a point, one after the other, without the engine."""
    from nlsdesign.sweeps.run_sweep import sweep_task

    given = asked(points)
    task = sweep_task(given["actuator"], axes=given["axes"], ask=given["ask"])
    work = task.work
    work(task.plan.point(0))
    begin = time.process_time()
    for _number, point in task.plan.points():
        work(point)
    return {"cost": (time.process_time() - begin) / points}


def processes(points: int, out: Path) -> dict[str, Any]:
    """Return what a sweep over processes costs."""
    from nlsdesign.foundation.work_sharing import Processes

    return run_of(points, out, Processes(WORKERS), children)


def dask(points: int, out: Path) -> dict[str, Any]:
    """Return what a sweep over a scheduler costs; starting scheduler and workers is no part of it."""
    from nlsdesign.foundation.work_sharing import DaskScheduler

    with cluster(out.parent / "scheduler.json") as (file, numbers):
        started = sum(map(processor_of, numbers()))
        return run_of(
            points, out, DaskScheduler(file=file), lambda: sum(map(processor_of, numbers())) - started
        )


def run_of(points: int, out: Path, executor: Any, others: Callable[[], float]) -> dict[str, Any]:
    """Return wall time, processor time and memory of one sweep."""
    import pyarrow.parquet as pq

    import nlsdesign as nls

    given = asked(points)
    first, worked, begin = memory(), time.process_time(), time.perf_counter()
    actuator = given.pop("actuator")
    table_ = nls.sweep(actuator, out=out, executor=executor, **given)
    wall = time.perf_counter() - begin
    assert len(table_) == points
    return {
        "wall": wall,
        "processor": time.process_time() - worked + others(),
        "point_seconds": sum(pq.read_table(out / "timings.parquet").column("seconds").to_pylist()),
        "first": first,
        "most": most_memory(),
        "bytes": (out / "results.parquet").stat().st_size,
    }


def memory_of_driver(points: int, out: Path) -> dict[str, Any]:
    """Return the memory of a driver over many cheap points."""
    import nlsdesign as nls
    from nlsdesign.foundation.quantity import quantity

    wheel = nls.assembly("wheel", wheel=nls.Inertia(inertia=quantity(1e-3, "kg*m^2", source="assumed")))
    begin = time.perf_counter()
    nls.sweep(
        wheel, axes=[nls.sweeps.GridAxis("wheel.inertia", 1e-3, 2e-3, points)],
        ask=nls.sweeps.FunctionQuestion(doubled, {"doubled": "kg*m^2"}), out=out,
    )  # fmt: skip
    wall, size = time.perf_counter() - begin, (out / "results.parquet").stat().st_size
    return {"most": most_memory(), "wall": wall, "bytes": size}


def doubled(made: Any) -> Mapping[str, float]:
    """Return an answer at once, counted where a file is named."""
    if COUNTED in os.environ:
        time.sleep(0.02)
        with open(os.environ[COUNTED], "ab") as file:
            file.write(b".")
    return {"doubled": 2.0 * made.quantities()["wheel.inertia"].number}


def kill_and_resume() -> dict[str, Any]:
    """Return what the kill of a driver costs: points of 20 ms, killed after half a minute, run to the end."""
    points, after = 6000, 30.0
    with tempfile.TemporaryDirectory() as folder:
        counted = Path(folder) / "counted"
        environment = {**os.environ, COUNTED: str(counted), "OMP_NUM_THREADS": "1"}
        words = [sys.executable, "-m", "benchmarks.sweeps", "--one", "memory", "--points", str(points),
                 "--out", f"{folder}/out"]  # fmt: skip
        with subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL) as running:
            time.sleep(after)
            running.send_signal(signal.SIGKILL)
        subprocess.run(words, env=environment, check=True, stdout=subprocess.DEVNULL)
        computed = counted.stat().st_size
    lost = computed - points
    return {"after": after, "points": points, "computed": computed, "lost": lost, "seconds": 0.02 * lost}


@contextmanager
def cluster(file: Path) -> Iterator[tuple[Path, Callable[[], list[int]]]]:
    """A scheduler and its workers, each a process; its file and their numbers."""
    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
                 "--no-dashboard", "--scheduler-file", str(file)]  # fmt: skip
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file),
              "--nthreads", "1", "--nworkers", str(WORKERS), "--no-dashboard"]  # fmt: skip
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    with subprocess.Popen(scheduler, **quiet) as first:  # type: ignore[call-overload]
        while not file.exists():
            time.sleep(0.1)
        with subprocess.Popen(worker, **quiet) as second:  # type: ignore[call-overload]
            import distributed

            with distributed.Client(scheduler_file=str(file), set_as_default=False) as client:
                client.wait_for_workers(WORKERS)
                client.run(__import__, "nlsdesign.sweeps")
                numbers = [*client.run(os.getpid).values(), first.pid]
            try:
                yield file, lambda: numbers
            finally:
                for process in (second, first):
                    os.killpg(process.pid, signal.SIGKILL)


def processor_of(number: int) -> float:
    """Processor time in s of another process."""
    fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def children() -> float:
    """Processor time in s of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def memory() -> float:
    """Resident memory of this process in MiB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def most_memory() -> float:
    """Most resident memory that this process has had, in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


MEASURED = {
    "yardstick": yardstick,
    "processes": processes,
    "dask": dask,
    "memory": memory_of_driver,
}

if __name__ == "__main__":
    main()
