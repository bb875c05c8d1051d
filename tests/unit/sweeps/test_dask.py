"""A sweep on a Dask scheduler of several processes: kills of every kind, and the bytes of one process."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from nlsdesign.foundation.errors import WorkSharingError
from nlsdesign.foundation.work_sharing import CodeIdentity, DaskScheduler, Processes, shared_map
from nlsdesign.foundation.work_sharing.chunks import Chunk
from nlsdesign.sweeps import Listed
from nlsdesign.sweeps.run_sweep import SweepSettings, run_task, sweep_task
from tests import sweeping
from tests.light_work import square

distributed = pytest.importorskip("distributed")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def scheduler(port: int) -> Iterator[int]:
    """A scheduler in a process of its own; its number."""
    words = (
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--no-dashboard",
        "--port",
        str(port),
    )
    with sweeping.program(*words) as process:
        wait_for_port(port)
        yield process.pid


@contextlib.contextmanager
def workers(port: int, *, cost: float) -> Iterator[None]:
    words = ("-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1",
             "--nworkers", "2", "--no-dashboard")  # fmt: skip
    with sweeping.program(*words, cost=cost):
        yield


def wait_for_port(port: int) -> None:
    for _ in range(600):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise AssertionError(f"nobody listens at {port}")


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """Two worker processes; the address of their scheduler."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as running:
        yield running.scheduler_address


def numbers_of_workers(address: str) -> list[int]:
    with distributed.Client(address, set_as_default=False) as client:
        return list(client.run(os.getpid).values())


@pytest.mark.slow
def test_a_worker_that_is_killed_in_mid_run_changes_nothing(cluster: str) -> None:
    first, killed, got = numbers_of_workers(cluster)[0], False, []
    for batch in shared_map(square, ((k, k) for k in range(200)), DaskScheduler(cluster), count=200):
        got += batch
        if len(got) > 20 and not killed:
            os.kill(first, signal.SIGKILL)
            killed = True
    assert killed
    assert first not in numbers_of_workers(cluster)
    assert sorted(each.number for each in got) == list(range(200)), "nothing lost, nothing twice"
    assert all(each.value == each.number**2 for each in got if each.number != 55)
    assert [each.number for each in got if each.reason] == [55]


def test_workers_of_another_version_are_refused(cluster: str, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = CodeIdentity("9.9.9", "a" * 64)
    real = DaskScheduler(cluster)
    with real.team(square) as team:
        monkeypatch.setattr(team, "_expected", ours)
        team.submit(Chunk(((1, 1),)))
        with pytest.raises(WorkSharingError, match=r"runs nlsdesign .* and this program nlsdesign"):
            next(each for _ in range(60) for each in team.finished(1.0))
        # At the beginning all that are there are asked; later ones answer with their first chunk.
        with pytest.raises(WorkSharingError, match=r"worker tcp://.*: their answers must not be mixed"):
            team._checked(5.0)  # type: ignore[attr-defined]


def test_a_scheduler_that_is_not_there_is_named_within_seconds(tmp_path: Path) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    begin = time.monotonic()
    with pytest.raises(WorkSharingError, match=f"{address}: does not answer within 1 s.*dask scheduler"):
        sweeping.run(tmp_path, 2, DaskScheduler(address, connect_within=1.0))
    assert time.monotonic() - begin < 20.0
    with pytest.raises(WorkSharingError, match=r"none\.json: no such file"):
        sweeping.run(tmp_path, 2, DaskScheduler(file=tmp_path / "none.json"))


@pytest.mark.parametrize("content", ["{}", "no table", "[]", '{"address": 3}', ""])
def test_a_file_that_no_scheduler_wrote_is_refused_before_dask_begins(tmp_path: Path, content: str) -> None:
    file = tmp_path / "scheduler.json"
    file.write_text(content)
    with pytest.raises(WorkSharingError, match=r"scheduler\.json: is no file of a Dask scheduler"):
        DaskScheduler(file=file).connected(1.0)


@pytest.mark.slow
def test_a_sweep_survives_the_kill_of_a_worker(tmp_path: Path) -> None:
    port, out = free_port(), tmp_path / "worker"
    address = f"tcp://127.0.0.1:{port}"
    with contextlib.ExitStack() as stack:
        stack.enter_context(scheduler(port))
        stack.enter_context(workers(port, cost=0.03))
        driver = stack.enter_context(sweeping.driver(out, 300, 0.03, address))
        sweeping.wait_for_rows(out, 10)
        first = numbers_of_workers(address)[0]
        os.kill(first, signal.SIGKILL)
        text, _ = driver.communicate(timeout=240)
    assert driver.returncode == 0, text
    assert sorted(sweeping.rows_in_parts(out)) == list(range(600)), "nothing lost, nothing twice"
    assert sweeping.same_table(out, 300, tmp_path / "one")


@pytest.mark.slow
def test_a_scheduler_that_is_killed_and_started_again(tmp_path: Path) -> None:
    port, out = free_port(), tmp_path / "restarted"
    address = f"tcp://127.0.0.1:{port}"
    with contextlib.ExitStack() as stack:
        number = stack.enter_context(scheduler(port))
        stack.enter_context(workers(port, cost=0.03))
        driver = stack.enter_context(sweeping.driver(out, 300, 0.03, address))
        sweeping.wait_for_rows(out, 10)
        os.killpg(number, signal.SIGKILL)
        stack.enter_context(scheduler(port))
        stack.enter_context(workers(port, cost=0.03))
        text, _ = driver.communicate(timeout=240)
    assert driver.returncode == 0, text
    assert sorted(sweeping.rows_in_parts(out)) == list(range(600)), "nothing lost, nothing twice"
    assert sweeping.same_table(out, 300, tmp_path / "one")


@pytest.mark.slow
def test_a_scheduler_that_stays_away_ends_the_run_with_what_was_finished(tmp_path: Path) -> None:
    port, out = free_port(), tmp_path / "away"
    outcome: list[BaseException] = []
    with scheduler(port) as number, workers(port, cost=0.05):

        def swept() -> None:
            try:
                sweeping.run(out, 300, DaskScheduler(f"tcp://127.0.0.1:{port}", patience=3.0))
            except WorkSharingError as error:
                outcome.append(error)

        running = threading.Thread(target=swept)
        running.start()
        standing = sweeping.wait_for_rows(out, 5)
        os.killpg(number, signal.SIGKILL)
        running.join(120)
    assert "was lost and did not come back within 3 s" in str(outcome[0])
    assert "run the same command again" in str(outcome[0])
    assert len(sweeping.rows_in_parts(out)) >= standing
    sweeping.run(out, 300, Processes(2))
    assert sorted(sweeping.rows_in_parts(out)) == list(range(600)), "nothing lost, nothing twice"
    assert sweeping.same_table(out, 300, tmp_path / "one")


class Noted:
    """What a run says while it waits."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def note(self, text: str) -> None:
        self.texts.append(text)


@pytest.mark.slow
def test_a_driver_without_workers_says_so_and_since_when_before_it_ends(tmp_path: Path) -> None:
    port, noted = free_port(), Noted()
    axes = [Listed({sweeping.AREA: [1e-5, 2e-5]})]
    task = sweep_task(sweeping.actuator(), axes=axes, ask=sweeping.question())
    executor = DaskScheduler(f"tcp://127.0.0.1:{port}", connect_within=60.0, patience=2.0)
    with scheduler(port), pytest.raises(WorkSharingError, match="has had no worker for 2 s") as ended:
        run_task(task, tmp_path, executor=executor, settings=SweepSettings(), progress=noted)
    assert "start workers with 'dask worker'" in str(ended.value)
    assert re.fullmatch(r"0 of 2 points, no worker since \d\d:\d\d:\d\d", noted.texts[-1])
    assert not [each for each in noted.texts if " left" in each]


class Wire:
    """A wire to the scheduler that can be cut and mended."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._pairs: list[socket.socket] = []
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listening.accept()
                far = socket.create_connection(("127.0.0.1", self._port))
                self._pairs += [near, far]
                for source, target in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=(source, target), daemon=True).start()

    @staticmethod
    def _carry(source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                target.sendall(data)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def cut(self) -> None:
        for end in self._pairs:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        self._pairs.clear()


@pytest.mark.slow
def test_a_client_that_is_cut_off_connects_again(tmp_path: Path) -> None:
    port, out = free_port(), tmp_path / "cut"
    with contextlib.ExitStack() as stack:
        stack.enter_context(scheduler(port))
        stack.enter_context(workers(port, cost=0.03))
        wire = Wire(port)
        driver = stack.enter_context(sweeping.driver(out, 300, 0.03, f"tcp://127.0.0.1:{wire.port}"))
        sweeping.wait_for_rows(out, 10)
        wire.cut()
        standing = sweeping.wait_for_rows(out, 60)
        wire.cut()
        text, _ = driver.communicate(timeout=240)
    assert driver.returncode == 0, text
    assert standing < 600
    assert sorted(sweeping.rows_in_parts(out)) == list(range(600)), "nothing lost, nothing twice"
    assert sweeping.same_table(out, 300, tmp_path / "one")


@pytest.mark.slow
def test_a_driver_that_is_killed_on_a_scheduler_goes_on_later(tmp_path: Path) -> None:
    port, out = free_port(), tmp_path / "driver"
    address = f"tcp://127.0.0.1:{port}"
    with scheduler(port), workers(port, cost=0.03):
        with sweeping.driver(out, 300, 0.03, address) as first:
            standing = sweeping.wait_for_rows(out, 10)
            first.kill()
            first.wait()
        with sweeping.driver(out, 300, 0.03, address) as second:
            text, _ = second.communicate(timeout=240)
        assert second.returncode == 0, text
    assert 10 <= standing < 600
    assert sorted(sweeping.rows_in_parts(out)) == list(range(600)), "nothing lost, nothing twice"
    assert sweeping.same_table(out, 300, tmp_path / "one")
