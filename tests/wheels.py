"""Build wheel and sdist from what is committed, install each in fresh environments, and try it there.

``python -m tests.wheels`` takes minutes and a package index: every environment gets all dependencies. Pythons
are looked for on PATH and among those of pyenv; one that is missing is named and passed over.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VERSIONS = ("3.11", "3.12", "3.13")
COMMANDS = (
    ("--version",),
    ("docs",),
    ("deck", "list"),
    ("deck", "check", "austin2015_figure_consistent"),
    ("parts", "Inertia"),
    ("analyse", "--deck", "austin2015_soft_spring", "--json"),
    ("export", "modelica", "--deck", "dfki_pendulum", "--out", "plant.mo"),
    ("study", "run", "hello", "--out", "hello"),
)
"""What is run in an empty folder after each installation."""
_PROBE = "import sys; print('%d.%d' % sys.version_info[:2])"


def interpreter(version: str) -> Path | None:
    """A Python of that version that runs."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    beside = sorted(pyenv.glob(f"{version}*/bin/python"))
    for candidate in (shutil.which(f"python{version}"), *beside):
        if candidate is None:
            continue
        probe = subprocess.run([candidate, "-c", _PROBE], capture_output=True, text=True, check=False)
        if probe.returncode == 0 and probe.stdout.strip() == version:
            return Path(candidate)
    return None


def call(*words: str | Path, where: Path) -> None:
    """Run a command without anything of this checkout in its environment; its output is shown if it fails."""
    clean = {key: value for key, value in os.environ.items() if key not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    done = subprocess.run([str(w) for w in words], cwd=where, env=clean, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=False)  # fmt: skip
    if done.returncode:
        raise SystemExit(f"FAILED: {' '.join(map(str, words))}\n{done.stdout}{done.stderr}")


def build(work: Path) -> tuple[Path, Path]:
    """Wheel and sdist of what is committed, built in an environment of their own."""
    archive, tree, out = work / "tree.tar", work / "tree", work / "dist"
    call("git", "archive", "--output", archive, "HEAD", where=ROOT)
    with tarfile.open(archive) as members:
        members.extractall(tree, filter="data")
    python = environment(Path(sys.executable), work / "build")
    call(python, "-m", "pip", "install", "--quiet", "build", "twine", where=work)
    call(python, "-m", "build", "--outdir", out, tree, where=work)
    (wheel,), (sdist,) = out.glob("*.whl"), out.glob("*.tar.gz")
    call(python, "-m", "twine", "check", "--strict", wheel, sdist, where=work)
    return wheel, sdist


def environment(base: Path, place: Path) -> Path:
    """The Python of a fresh environment."""
    call(base, "-m", "venv", place, where=place.parent)
    return place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def try_out(python: Path, empty: Path) -> None:
    """Run the commands in an empty folder, and see that what they say they wrote is there."""
    empty.mkdir()
    for words in COMMANDS:
        call(python, "-m", "nlsdesign", *words, where=empty)
    for written in ("plant.mo", "hello"):
        if not (empty / written).exists():
            raise SystemExit(f"FAILED: {written} was not written")


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, install and try; 0 if all of it held, 1 if no Python was there to try it on."""
    parser = argparse.ArgumentParser(prog="python -m tests.wheels", description=__doc__)
    parser.add_argument("--python", dest="versions", action="append", choices=VERSIONS, help="Repeatable.")
    tried = 0
    versions = parser.parse_args(arguments).versions or VERSIONS
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        wheel, sdist = build(work)
        print(f"built and checked: {wheel.name}, {sdist.name}", flush=True)
        for version in versions:
            base = interpreter(version)
            if base is None:
                print(f"passed over: there is no Python {version} here")
                continue
            place = work / version
            place.mkdir()
            python = environment(base, place / "venv")
            call(python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", wheel, where=place)
            try_out(python, place / "wheel")
            print(f"Python {version}: the wheel is installed and runs", flush=True)
            # From here on the dependencies are there; the package is built anew from the sdist.
            call(python, "-m", "pip", "uninstall", "--quiet", "--yes", "nlsdesign", where=place)
            call(python, "-m", "pip", "install", "--quiet", "--no-deps", sdist, where=place)
            try_out(python, place / "sdist")
            print(f"Python {version}: the sdist is built, installed and runs", flush=True)
            shutil.rmtree(place)
            tried += 1
    return 0 if tried else 1


def supported() -> tuple[str, ...]:
    """Versions of Python that the metadata names."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    heads = [each.rpartition(" ")[2] for each in project["classifiers"] if "Python :: 3." in each]
    return tuple(heads)


if __name__ == "__main__":
    sys.exit(main())
