"""Commands that are interrupted at a random moment: they end at once, and leave nothing behind."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from nlsdesign.export import export_fmu
from nlsdesign.foundation.text_files import LIST_NAME

from ..hand_built import controller
from .cases import ACCEPTED, REFUSED, Case, Outcome
from .records import Records

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 2.0
"""Seconds between the interrupt and the end of the command, and of everything that it has started."""
DECK = "austin2015_figure_consistent"
COMMANDS: dict[str, tuple[float, tuple[str, ...]]] = {
    "design": (4.0, ("design", "--deck", DECK, "--maximum", "5 N*m", "--angle", "53 deg", "--out", "out")),
    "diagnose": (8.0, ("diagnose", "--deck", "test_rig", "--records", "records", "--out", "out")),
    "observer": (5.0, ("observer", "--deck", DECK, "--errors", "--draws", "40", "--out", "out")),
    "export c": (4.0, ("export", "c", "--deck", DECK, "--kind", "cascade", "--out", "out")),
    "export fmu": (6.0, ("export", "fmu", "--deck", DECK, "--kind", "cascade", "--out", "out")),
    "cosimulate": (4.0, ("cosimulate", "--fmu", "c=one.fmu", "--stop", "100 s", "--out", "out/run.csv")),
    "simulate": (2.5, ("simulate", "--deck", "test_rig", "--record", "records/a.csv", "--out", "out/p.csv")),
    "study run": (8.0, ("study", "run", "hello", "--fast", "--out", "out")),
}
"""How long each works at least, in s, and its words."""


class Interrupts:
    """SIGINT to the whole group, as a terminal sends it, or SIGTERM to the command alone."""

    limit = 60.0

    def __init__(self, *, fmu: bool = True) -> None:
        csv = Records().long_csv()
        self.files = {f"records/{name}.csv": csv for name in "abcd"}
        if fmu:
            with tempfile.TemporaryDirectory() as folder:
                self.files["one.fmu"] = export_fmu(controller(), Path(folder) / "one.fmu").read_bytes()

    def made(self, random: random.Random, number: int) -> Case:
        name = tuple(COMMANDS)[number % len(COMMANDS)]
        length = COMMANDS[name][0]
        # Half of the moments lie in the imports.
        after = random.uniform(0.0, 1.5 if random.random() < 0.4 else length)
        kind = "SIGTERM" if random.random() < 0.3 else "SIGINT"
        return Case(self.files, (name, f"{after:.4f}", kind), f"{kind} after {after:.3f} s of {name}")

    def judged(self, case: Case, folder: Path) -> Outcome:
        name, after, kind = case.words
        place = folder / "temporary"
        place.mkdir()
        environment = {**os.environ, "TMPDIR": str(place), "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
        process = subprocess.Popen(
            [sys.executable, "-m", "nlsdesign", *COMMANDS[name][1]], cwd=folder, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True, text=True,
            preexec_fn=_as_in_a_terminal,
        )  # fmt: skip
        try:
            _wait_for_handlers(process)
            time.sleep(float(after))
            early = process.poll() is not None
            begun = time.monotonic()
            with contextlib.suppress(ProcessLookupError):
                if kind == "SIGINT":
                    os.killpg(process.pid, signal.SIGINT)
                else:
                    process.terminate()
            try:
                _, errors = process.communicate(timeout=3.0 * PATIENCE)
            except subprocess.TimeoutExpired:
                return Outcome("too long", f"{kind} hangs {name}")
            return _judged(
                f"{kind}, {name}", process.returncode, errors, folder, time.monotonic() - begun, early
            )
        finally:
            left = _session(process.pid)
            for each in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(each, signal.SIGKILL)
            process.wait()


def _wait_for_handlers(process: subprocess.Popen[str]) -> None:
    """Wait until the project handles signals: while the interpreter itself begins, it answers by itself."""
    while process.poll() is None:
        status = Path(f"/proc/{process.pid}/status").read_text(encoding="utf8")
        caught = next((line.split()[1] for line in status.splitlines() if line.startswith("SigCgt")), "0")
        if int(caught, 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.002)


def _judged(what: str, status: int, errors: str, folder: Path, seconds: float, early: bool) -> Outcome:
    wanted = 130 if what.startswith("SIGINT") else 143
    if status not in (0, 1, wanted) or "Traceback" in errors:
        last = (errors.strip().splitlines() or [""])[-1]
        return Outcome("traceback", f"{what}: status {status}, {last[:60]}")
    if status == wanted and "interrupted" not in errors:
        return Outcome("unreadable message", f"{what}: {errors[-60:]}")
    if seconds > PATIENCE and status == wanted:
        return Outcome("too long", f"{what}: over {PATIENCE:g} s")
    # The compiler keeps what it has built; everything else is gone.
    left = [e.name for e in (folder / "temporary").iterdir() if e.name != f"nlsdesign-{os.getuid()}"]
    hidden = (folder / "out").rglob(".*") if (folder / "out").is_dir() else ()
    half = [e.name for e in hidden if e.name != LIST_NAME]
    if left or half:
        return Outcome("left over", f"{what}: {(left + half)[0][:16]}")
    time.sleep(0.05)
    return Outcome(ACCEPTED if early or status != wanted else REFUSED)


def _as_in_a_terminal() -> None:
    """Give the command the handlers of a shell in front: whoever runs this may ignore interrupts."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, [])


def _session(leader: int) -> list[int]:
    """Return the processes that a command has left in its session."""
    left = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                fields = (entry / "stat").read_text(encoding="utf8").rpartition(")")[2].split()
                if int(fields[3]) == leader and fields[0] != "Z":
                    left.append(int(entry.name))
    return left
