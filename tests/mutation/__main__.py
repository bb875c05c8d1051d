"""Mutation run: break the package one spot at a time, run the tests that reach the spot, list what they miss.

    python -m tests.mutation nlsdesign/model nlsdesign/feedback/observer --count 100 --seed 1 --out
    out/mutation

The first step runs the quick tests once with coverage, to know which tests reach which line; the second
breaks one spot after the other in a copy of the project and runs those tests until one fails. What was tried
stands in ``tried.jsonl`` and is not tried again, so a run can be stopped and goes on where it was. Survivors
are listed at the end, apart from those that no test reaches; each is to be killed by a test, or argued. All
work is done on one core, so that no line is reached unseen, in another process. Needs
``pip install .[mutation]``.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path

from .mutants import Mutant, broken, mutants_of

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("nlsdesign", "models", "studies", "tests", "benchmarks", "docs", "requirements")
MOST_TESTS = 60
"""So many tests are run for a mutant, those that reach the fewest lines first: they are the most direct."""
LONGEST = 300.0
"""Seconds after which a mutant counts as noticed: it does not end."""


def main() -> int:
    """Run, and return how many changes no test noticed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("places", nargs="+", help="files or folders of the package")
    parser.add_argument("--count", type=int, default=0, help="so many mutants, drawn by chance; 0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/mutation"))
    parser.add_argument("--tests", nargs="*", default=["tests/unit", "tests/physics"])
    given = parser.parse_args()
    _on_one_core()
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    copy = _copied(out / "copy")
    reach = _reach(copy, out / "reach.json", given.tests)
    mutants = [m for place in given.places for file in _files(place) for m in mutants_of(copy, file)]
    if given.count:
        mutants = random.Random(given.seed).sample(mutants, min(given.count, len(mutants)))
    outcomes = {m: _outcome(copy, out / "tried.jsonl", m, reach) for m in mutants}
    missed = [(outcome, m) for m, outcome in outcomes.items() if outcome != "noticed"]
    print(f"{len(mutants)} mutants, {len(missed)} not noticed")
    for outcome, mutant in sorted(missed, key=lambda pair: (pair[0], pair[1].file, pair[1].line)):
        print(f"{outcome}: {mutant}")
    return len(missed)


def _on_one_core() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {random.choice(sorted(os.sched_getaffinity(0)))})


def _copied(copy: Path) -> Path:
    """Copy the project, so that the checkout is never broken."""
    for folder in COPIED:
        shutil.copytree(
            ROOT / folder, copy / folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
        )
    for file in ROOT.iterdir():
        if file.is_file():
            shutil.copy2(file, copy / file.name)
    return copy


def _files(place: str) -> list[str]:
    where = ROOT / place
    files = sorted(where.rglob("*.py")) if where.is_dir() else [where]
    return [file.relative_to(ROOT).as_posix() for file in files if file.name != "__init__.py"]


def _environment(copy: Path) -> dict[str, str]:
    path = os.pathsep.join([str(copy), os.environ.get("PYTHONPATH", "")])
    return os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}


def _reach(copy: Path, kept: Path, tests: list[str]) -> dict[str, dict[int, list[str]]]:
    """Return the tests that reach each line of each file, the most direct first."""
    if not kept.exists():
        settings = copy / "coverage.ini"
        settings.write_text("[run]\ndynamic_context = test_function\nsource = nlsdesign\n", encoding="utf8")
        command = [sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest", "-q"]
        subprocess.run([*command, "-m", "not slow", *tests], cwd=copy, env=_environment(copy), check=True)
        kept.write_text(json.dumps(_read_reach(copy)), encoding="utf8")
    raw = json.loads(kept.read_text(encoding="utf8"))
    return {file: {int(line): names for line, names in lines.items()} for file, lines in raw.items()}


def _read_reach(copy: Path) -> dict[str, dict[int, list[str]]]:
    from coverage import CoverageData

    data = CoverageData(str(copy / ".coverage"))
    data.read()
    lines: dict[str, dict[int, list[str]]] = {}
    size: dict[str, int] = defaultdict(int)
    for file in data.measured_files():
        name = Path(file).relative_to(copy).as_posix()
        reached = data.contexts_by_lineno(file)
        every = sorted({c for contexts in reached.values() for c in contexts if c})
        # What runs at import, or in the set-up of tests, is seen by any test of the file.
        lines[name] = {line: [c for c in contexts if c] or every for line, contexts in reached.items()}
        for contexts in lines[name].values():
            for context in contexts:
                size[context] += 1
    return {
        file: {line: sorted(names, key=lambda n: (size[n], n))[:MOST_TESTS] for line, names in found.items()}
        for file, found in lines.items()
    }


def _node(context: str, copy: Path) -> str:
    """Return the name by which pytest runs what coverage calls ``tests.unit.test_a.test_b``."""
    parts = context.split(".")
    for end in range(len(parts) - 1, 0, -1):
        file = Path(*parts[:end]).with_suffix(".py")
        if (copy / file).exists():
            return "::".join([file.as_posix(), *parts[end:]])
    return ""


def _outcome(copy: Path, tried: Path, mutant: Mutant, reach: dict[str, dict[int, list[str]]]) -> str:
    """Return ``noticed``, ``survived`` or ``unreached``, from the file of what was tried if it is there."""
    known = [json.loads(line) for line in tried.read_text().splitlines()] if tried.exists() else []
    for each in known:
        if {k: each[k] for k in asdict(mutant)} == asdict(mutant):
            return str(each["outcome"])
    lines = reach.get(mutant.file, {})
    contexts = [c for k in range(mutant.first, mutant.last + 1) for c in lines.get(k, [])]
    tests = [n for c in dict.fromkeys(contexts) if (n := _node(c, copy))]
    outcome = _judged(copy, mutant, tests) if tests else "unreached"
    print(f"{outcome}: {mutant}", flush=True)
    with tried.open("a", encoding="utf8") as stream:
        stream.write(json.dumps(asdict(mutant) | {"outcome": outcome, "tests": len(tests)}) + "\n")
    return outcome


def _judged(copy: Path, mutant: Mutant, tests: list[str]) -> str:
    place = copy / mutant.file
    whole = place.read_text(encoding="utf8")
    place.write_text(broken(copy, mutant), encoding="utf8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        run = subprocess.run(
            command, cwd=copy, env=_environment(copy), timeout=LONGEST, capture_output=True, check=False
        )
    except subprocess.TimeoutExpired:
        return "noticed"
    finally:
        place.write_text(whole, encoding="utf8")
    return "noticed" if run.returncode else "survived"


if __name__ == "__main__":
    sys.exit(min(main(), 125))
