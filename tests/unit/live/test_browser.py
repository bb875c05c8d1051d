"""The browser of the tests starts whatever this process has open, and has ended with it."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("fcntl")

STARTS_WHILE_NUMBERS_ARE_FREED = """
import os, subprocess, sys
from tests import browser

low = [os.open(os.devnull, os.O_RDONLY) for _ in range(2)]
assert low == [3, 4], low
fork = subprocess._fork_exec

def beside_a_thread_that_closes_files(*words):
    for each in low:
        os.close(each)
    return fork(*words)

subprocess._fork_exec = beside_a_thread_that_closes_files
answer = [sys.executable, "-c", "import os; os.write(4, os.read(3, 5)[::-1])"]
started, commands, answers = browser._started(answer)
commands.write(b"hello")
commands.close()
print(answers.read().decode(), started.wait(20))
"""


def test_a_browser_starts_also_where_files_are_closed_meanwhile() -> None:
    """Its ends are 3 and 4; here these numbers belong to somebody else until just before it is started."""
    words = [sys.executable, "-c", STARTS_WHILE_NUMBERS_ARE_FREED]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.split() == ["olleh", "0"], done.stderr
