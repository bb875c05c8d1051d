"""Work shared among workers: every point has one outcome, whatever becomes of the workers."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from nlsdesign.foundation.errors import ValueRangeError, WorkSharingError
from nlsdesign.foundation.work_sharing import (
    CodeIdentity,
    DaskScheduler,
    Executor,
    InThisProcess,
    PointOutcome,
    Processes,
    code_identity,
    parallel_map,
    shared_map,
)
from nlsdesign.foundation.work_sharing.chunks import (
    Chunk,
    WorkerRefusal,
    computed_elsewhere,
    refused,
    sendable,
)
from nlsdesign.foundation.work_sharing.shared_map import ChunkSizes
from nlsdesign.foundation.work_sharing.teams import FuturesTeam


def square(number: int) -> int:
    if number == 7:
        raise ValueError("no seven")
    if number == 8:
        raise SystemExit(3)
    return number * number


def outcomes(
    work: Callable[[int], Any], executor: Executor, points: Iterator[int]
) -> dict[int, PointOutcome]:
    collected: dict[int, PointOutcome] = {}
    for batch in shared_map(work, ((k, k) for k in points), executor):
        for each in batch:
            assert each.number not in collected, "a point came twice"
            collected[each.number] = each
    return collected


@pytest.mark.parametrize("executor", [InThisProcess(), Processes(2)])
def test_every_point_is_answered_once_and_failures_say_why(executor: Executor) -> None:
    got = outcomes(square, executor, iter(range(60)))
    assert sorted(got) == list(range(60))
    assert all(got[k].value == k * k for k in range(60) if k not in (7, 8))
    assert got[7].value is None
    assert got[7].reason.startswith("ValueError: no seven (test_work_sharing.py, line")
    assert got[8].reason.startswith("SystemExit: 3")


def test_points_are_taken_only_when_a_worker_is_free() -> None:
    taken, ahead = 0, 0

    def points() -> Iterator[int]:
        nonlocal taken
        for k in range(5000):
            taken += 1
            yield k

    seen = 0
    sizes = ChunkSizes(seconds=1e-3, largest=50)
    for batch in shared_map(square, ((k, k) for k in points()), Processes(2), sizes=sizes):
        seen += len(batch)
        ahead = max(ahead, taken - seen)
    assert seen == 5000
    assert ahead <= 2 * 50


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    def slow(number: int) -> int:
        (tmp_path / str(os.getpid())).touch()
        time.sleep(0.01)
        return number

    got: list[int] = []
    killed = None
    for batch in shared_map(slow, ((k, k) for k in range(150)), Processes(2)):
        got += [each.value for each in batch]
        if killed is None and len(got) > 10:
            killed = int(next(tmp_path.iterdir()).name)
            os.kill(killed, signal.SIGKILL)
    assert sorted(got) == list(range(150))
    assert killed is not None
    assert len(list(tmp_path.iterdir())) == 3, "one worker more took the place of the killed one"


def test_a_point_that_kills_its_workers_is_given_up_and_its_neighbours_are_not() -> None:
    def deadly(number: int) -> int:
        if number in (20, 21):
            os.kill(os.getpid(), signal.SIGKILL)
        if number == 40:
            os._exit(5)
        return number

    got = outcomes(deadly, Processes(2), iter(range(80)))
    assert [k for k in range(80) if got[k].value != k] == [20, 21, 40]
    assert "given up after 2 workers" in got[20].reason
    assert "signal 9 (SIGKILL): killed, often because memory ran out" in got[20].reason
    assert "exit status 5" in got[40].reason


def test_an_answer_that_cannot_be_sent_is_the_failure_of_its_point_alone() -> None:
    got = outcomes(lambda k: threading.Lock() if k == 3 else k, Processes(1), iter(range(6)))
    assert "the answer cannot be sent back" in got[3].reason
    assert [k for k in range(6) if got[k].reason == ""] == [0, 1, 2, 4, 5]


def test_who_stops_listening_ends_the_workers() -> None:
    running = shared_map(lambda _: time.sleep(60), ((k, k) for k in range(4)), Processes(2))
    next(running)
    workers = multiprocessing.active_children()
    assert len(workers) == 2
    running.close()  # type: ignore[attr-defined]
    assert not any(each.is_alive() for each in workers)


def test_a_map_within_a_worker_forks_no_further_processes() -> None:
    got = outcomes(lambda k: len(set(parallel_map(lambda _: os.getpid(), 4))), Processes(1), iter(range(2)))
    assert [each.value for each in got.values()] == [1, 1]


def test_an_executor_of_the_standard_library_is_a_crew() -> None:
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        team = FuturesTeam(pool, square, 2)
        assert (team.workers(), team.free()) == (2, 4)
        team.submit(Chunk(((5, 5), (7, 7))))
        ((chunk, outcome),) = team.finished(10.0)
    assert isinstance(outcome, list)
    assert [each.value for each in outcome] == [25, None]
    assert chunk.points == ((5, 5), (7, 7))


def test_other_code_is_refused_and_both_are_named() -> None:
    other = CodeIdentity("9.9.9", "f" * 64)
    answer = computed_elsewhere(pickle.dumps(square), Chunk(((1, 1),)), other)
    assert isinstance(answer, WorkerRefusal)
    assert answer.identity == code_identity()
    words = str(refused(WorkerRefusal("tcp://a:1", other)))
    assert "tcp://a:1" in words
    assert "nlsdesign 9.9.9 (code ffffffffffff)" in words
    assert str(code_identity()) in words


def test_the_digest_follows_what_computes_and_not_what_shows(tmp_path: Path) -> None:
    package = tmp_path / "nlsdesign"
    for room in ("design", "cli"):
        (package / room).mkdir(parents=True)
        (package / room / "one.py").write_text("a = 1\n", encoding="utf-8")
    (package / "_bundled" / "models").mkdir(parents=True)
    before = code_identity(package).digest
    (package / "cli" / "one.py").write_text("a = 2\n", encoding="utf-8")
    code_identity.cache_clear()
    assert code_identity(package).digest == before
    (package / "design" / "one.py").write_text("a = 2\n", encoding="utf-8")
    code_identity.cache_clear()
    changed = code_identity(package)
    assert changed.digest != before
    assert set(changed.files) == {"nlsdesign/design/one.py"}
    code_identity.cache_clear()


def test_work_that_cannot_be_sent_is_refused_before_anything_runs() -> None:
    lock = threading.Lock()
    with pytest.raises(WorkSharingError, match="cannot be sent to workers"):
        sendable(lambda _: lock)


def test_executors_refuse_what_they_cannot_be() -> None:
    with pytest.raises(ValueRangeError, match="0 workers"):
        Processes(0)
    with pytest.raises(ValueRangeError, match="address or a file"):
        DaskScheduler()
    with pytest.raises(ValueRangeError, match="address or a file"):
        DaskScheduler("tcp://a:1", file=Path("b"))
