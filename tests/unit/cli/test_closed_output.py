"""A reader that has seen enough, such as ``head``, is no finding of a command."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(os.name == "nt", reason="Windows reports a closed pipe by another error, without SIGPIPE")
def test_a_closed_pipe_is_no_finding(root: Path) -> None:
    words = [sys.executable, "-m", "nlsdesign", "docs", "known_gaps", "--print"]
    begun = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(root)}
    )
    assert begun.stdout is not None
    begun.stdout.close()  # before anything is written
    assert begun.stderr is not None
    said = begun.stderr.read()
    begun.stderr.close()
    assert (begun.wait(timeout=60), said) == (141, b"")
