"""Ctrl-C and requests to end: status, words, and nothing left, also where the interrupt is swallowed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals as POSIX has them")

HEAD = """
import os, subprocess, sys, tempfile, time
from pathlib import Path
from nlsdesign.foundation.processes import guarded
from nlsdesign.foundation.text_files import draft

def begun():
    Path("begun").write_text("")

"""
SWALLOWED = """begun()
    for _ in range(60):
        try: time.sleep(1)
        except KeyboardInterrupt: pass
"""
REPLACED = """begun()
    try: time.sleep(60)
    except KeyboardInterrupt: raise RuntimeError('stopped')
"""
PROGRAMS = {
    "it waits": "begun(); time.sleep(60)",
    "it holds a folder": "with tempfile.TemporaryDirectory(): begun(); time.sleep(60)",
    "a folder that nobody removes": "tempfile.mkdtemp(); begun(); time.sleep(60)",
    "a draft": "with draft(Path('whole.txt')) as name: name.write_text('half'); begun(); time.sleep(60)",
    "the interrupt is swallowed": SWALLOWED,
    "it becomes another error": REPLACED,
    "a program that it has started": "subprocess.Popen(['sleep', '61.25']); begun(); time.sleep(60)",
}


@pytest.mark.long_cases(
    "a program that it has started-15", "the interrupt is swallowed-15", "it becomes another error-15",
    "a folder that nobody removes-2",
)  # fmt: skip
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", PROGRAMS)
def test_an_interrupt_ends_the_program_and_leaves_nothing(
    name: str, number: signal.Signals, tmp_path: Path, root: Path
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    program = f"{HEAD}def run():\n    {PROGRAMS[name]}\n\nguarded(run)\n"
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(root), "TMPDIR": str(temporary)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )  # fmt: skip
    while not (tmp_path / "begun").exists():
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(process.pid, number)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == {signal.SIGINT: 130, signal.SIGTERM: 143}[number]
    assert errors == "interrupted\n"
    assert list(temporary.iterdir()) == []
    assert sorted(each.name for each in tmp_path.iterdir()) == ["begun", "temporary"]
    until = time.monotonic() + 2.0
    while _group_lives(process.pid) and time.monotonic() < until:
        time.sleep(0.02)
    assert not _group_lives(process.pid)


def _group_lives(number: int) -> bool:
    try:
        os.killpg(number, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_program_that_ends_by_itself_keeps_its_status_and_leaves_nothing(
    tmp_path: Path, root: Path
) -> None:
    program = f"{HEAD}def run():\n    tempfile.mkdtemp()\n    sys.exit(1)\n\nguarded(run)\n"
    environment = {**os.environ, "PYTHONPATH": str(root), "TMPDIR": str(tmp_path)}
    ended = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, check=False)
    assert (ended.returncode, ended.stderr) == (1, b"")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_while_python_itself_ends_changes_nothing(
    number: signal.Signals, tmp_path: Path, root: Path
) -> None:
    late = f"class Late:\n    def __del__(self, kill=os.kill, own=os.getpid()): kill(own, {int(number)})\n\n"
    program = f"{HEAD}{late}late = Late()\nguarded(lambda: sys.exit(1))\n"
    environment = {**os.environ, "PYTHONPATH": str(root), "TMPDIR": str(tmp_path)}
    ended = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, check=False,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (1, b"")
