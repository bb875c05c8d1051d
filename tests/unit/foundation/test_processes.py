"""Parallel map: same results, same order, no process left behind."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nlsdesign.foundation.work_sharing import parallel_map

# Where the suite itself was begun in the background, children inherit that interrupts are ignored.
ENDLESS = """
import signal
import time
from nlsdesign.foundation.work_sharing import parallel_map

def work(number):
    print("at work", flush=True)
    time.sleep(60)

signal.signal(signal.SIGINT, signal.default_int_handler)
list(parallel_map(work, 4))
"""


def test_results_come_in_order_and_see_what_the_work_refers_to() -> None:
    offset = 7
    assert list(parallel_map(lambda k: offset + k * k, 20)) == [7 + k * k for k in range(20)]
    assert list(parallel_map(lambda k: k, 0)) == []


def test_what_a_piece_raises_is_raised_here() -> None:
    def work(number: int) -> float:
        return 1.0 / number

    with pytest.raises(ZeroDivisionError):
        list(parallel_map(work, 3))


# Process lists are those of /proc, which other systems do not have.
@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes as Linux lists them")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_helpers_end_with_the_process_that_waits(ending: signal.Signals) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout is not None
    process.stdout.readline()
    helpers = [int(f.name) for f in Path("/proc").iterdir() if f.name.isdigit() and _parent(f) == process.pid]
    assert helpers
    process.send_signal(ending)
    process.wait(timeout=30)
    waited = 0
    while any(map(_running, helpers)) and waited < 100:
        time.sleep(0.1)
        waited += 1
    assert not [pid for pid in helpers if _running(pid)]


LATE = """
import os
import sys
import time
from nlsdesign.foundation.processes import ready_as_helper

parent = os.getpid()
if os.fork() == 0:
    while os.getppid() == parent:
        time.sleep(0.01)
    ready_as_helper(parent)
    open(sys.argv[1], "w").close()
    os._exit(0)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere no signal tells of the death of a parent")
def test_a_helper_whose_parent_ended_before_it_was_ready_ends_too(tmp_path: Path) -> None:
    # The pipe stays open as long as the helper lives.
    subprocess.run(
        [sys.executable, "-c", LATE, str(tmp_path / "went_on")],
        stdout=subprocess.PIPE,
        check=True,
        timeout=60,
    )
    assert not (tmp_path / "went_on").exists()


def _parent(process: Path) -> int:
    try:
        return int((process / "stat").read_text(encoding="utf8").rpartition(")")[2].split()[1])
    except OSError:
        return 0  # it has ended in between


def _running(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="utf8") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


INTERRUPTED_WHILE_FORKING = """
import os
import signal
from nlsdesign.foundation.work_sharing import parallel_map

signal.signal(signal.SIGINT, signal.default_int_handler)
os.register_at_fork(after_in_child=lambda: os.kill(os.getpid(), signal.SIGINT))
print(list(parallel_map(abs, 6)), flush=True)
"""

INTERRUPTED_WHILE_STARTING = """
import os
import signal
from nlsdesign.foundation.work_sharing import parallel_map

signal.signal(signal.SIGINT, signal.default_int_handler)
os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), signal.SIGINT))
try:
    list(parallel_map(abs, 6))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


# Elsewhere workers are spawned, and no handler is inherited that could end them.
@pytest.mark.skipif(sys.platform != "linux", reason="counts on fork")
@pytest.mark.parametrize(
    ("program", "expected"),
    [(INTERRUPTED_WHILE_FORKING, "[0, 1, 2, 3, 4, 5]"), (INTERRUPTED_WHILE_STARTING, "interrupted")],
)
def test_an_interrupt_at_the_moment_of_the_fork_leaves_nobody_waiting(program: str, expected: str) -> None:
    """In the helper it is ignored; in the waiting process it is delivered once all helpers ignore it."""
    cores = "import os; os.sched_getaffinity = lambda _: {0, 1}\n"
    ended = subprocess.run(
        [sys.executable, "-c", cores + program], capture_output=True, text=True, timeout=120, check=False
    )
    assert ended.stdout.strip() == expected
    assert "Traceback" not in ended.stderr


ASKED_TO_END_WHILE_FORKING = """
import signal
import sys
from nlsdesign.foundation.work_sharing import parallel_map

signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(number))
for _ in range(int(sys.argv[1])):
    assert list(parallel_map(abs, 2)) == [0, 1]
print("done")
"""


@pytest.mark.slow
@pytest.mark.long_cases("300")
@pytest.mark.parametrize("times", ["100", "300"])
def test_short_maps_end_where_the_process_handles_requests_to_end(times: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", ASKED_TO_END_WHILE_FORKING, times], capture_output=True, text=True, timeout=120
    )
    assert ended.stdout == "done\n", ended.stderr
