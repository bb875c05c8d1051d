"""Jobs are run in a fixed environment, and what differs from run to run is taken out."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .dumps import OWN
from .jobs import CHECKOUT, SHARED, Job, jobs

FIXED = {
    "SOURCE_DATE_EPOCH": "1760000000",
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NO_COLOR"), "1"),
    "COLUMNS": "160",
    "TZ": "UTC",
    "PYTHONPATH": str(CHECKOUT),
    "PYTHONHASHSEED": "0",
}
# What is left out of a record, or replaced in it, and why.
LEFT_OUT = {
    ".nlsdesign.json": "digests of files that are compared themselves",
    "code.json": "digest of the sources, which is what changed",
    ".parquet": "the table stands beside it as CSV; the file names the version of its writer",
    ".running": "process that holds the folder",
}
REPLACED = (
    (
        r'("(?:code|asked)": "|>(?:code|question, digest)</td><td class="long">)[0-9a-f]{64}',
        r"\1<sources>",
        "a sweep holds digests of the sources, of which a question is made too",
    ),
)


def record(out: Path, only: list[str], quick: bool, workers: int) -> int:
    """Run the jobs that are not done yet; 1 if one of them could not be recorded."""
    chosen = [
        job for job in jobs() if (not only or job.name.startswith(tuple(only))) and (job.quick or not quick)
    ]
    if not (SHARED / "practice").is_dir():
        print("practice records are left out: set NLSDESIGN_SHARED to the folder that holds practice/")
    waiting = [job for job in chosen if not (out / job.name / ".done").exists()]
    print(f"{len(chosen)} jobs, {len(chosen) - len(waiting)} of them done before", flush=True)
    failed = 0
    with ThreadPoolExecutor(workers) as pool:
        outcomes = pool.map(lambda job: _run(job, out), waiting)
        for number, (job, outcome) in enumerate(zip(waiting, outcomes, strict=True), start=1):
            failed += outcome.startswith("FAILED")
            print(f"[{number}/{len(waiting)}] {job.name}: {outcome}", flush=True)
    used = os.times()
    print(f"{used.children_user + used.children_system:.0f} s of processor, {failed} jobs failed")
    return int(failed > 0)


def _run(job: Job, out: Path) -> str:
    """Run one job and return its duration, or why it failed."""
    folder = (out / job.name).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, text in job.files.items():
        (folder / name).write_text(text, encoding="utf8")
    begin, statuses = time.perf_counter(), []
    for number, command in enumerate(job.commands):
        words = shlex.split(command)
        name = f"{number}_{'_'.join(word for word in words[:2] if word.isalnum())}"
        if words and words[0] in ("diagnose", "fit"):
            words.insert(0, "at_fixed_time")
        program = "tests.same_outputs" if words and words[0] in OWN else "nlsdesign"
        done = subprocess.run(
            [sys.executable, "-m", program, *words],
            cwd=folder,
            env=os.environ | FIXED,
            capture_output=True,
            check=False,
        )
        statuses.append(done.returncode)
        ending = ".json" if "--json" in words else ".txt"
        (folder / f"{name}{ending}").write_bytes(done.stdout)
        (folder / f"{name}.stderr.txt").write_bytes(done.stderr)
        if done.returncode not in (0, 1) or b"Traceback" in done.stderr:
            return f"FAILED, status {done.returncode} of: {command}\n{done.stderr.decode()[-600:]}"
    (folder / "exit_status.json").write_text(json.dumps(statuses), encoding="utf8")
    _normalise(folder)
    seconds = f"{time.perf_counter() - begin:.1f} s"
    (folder / ".done").write_text(seconds, encoding="utf8")
    return seconds


def _normalise(folder: Path) -> None:
    """Unpack archives, take figures out of pages, and take out what differs from run to run."""
    for archives in ("*.ssp", "*.fmu"):  # in this order: the first holds the second
        for file in list(folder.rglob(archives)):
            with zipfile.ZipFile(file) as archive:
                archive.extractall(file.with_name(file.name + ".members"))
            file.unlink()
    places = {str(folder): "<folder>", str(CHECKOUT): "<checkout>", str(SHARED): "<shared>"}
    for file in sorted(file for file in folder.rglob("*") if file.is_file()):
        if file.name in LEFT_OUT or file.suffix in LEFT_OUT:
            file.unlink()
            continue
        try:
            text = file.read_bytes().decode("utf8")
        except UnicodeDecodeError:
            continue
        for place, instead in places.items():
            text = text.replace(place, instead)
        for pattern, instead, _why in REPLACED:
            text = re.sub(pattern, instead, text)
        if file.suffix == ".html":
            figures = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
            text = re.sub(r"<svg.*?</svg>", "<svg/>", text, flags=re.DOTALL)
            if figures:
                file.with_suffix(".figures.svg").write_text("\n".join(figures), encoding="utf8")
        file.write_bytes(text.encode("utf8"))
