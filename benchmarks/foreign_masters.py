"""The FMUs of the published actuator in foreign masters, against the package's own simulation.

python -m benchmarks.foreign_masters [--environment FOLDER] [--out FOLDER] [--write docs/fmi_masters.md]

makes a virtual environment with the masters from PyPI where there is none, exports plant, observer and
controller in FMI 2.0 and 3.0 with their reference results, and runs each in each master, in a process of its
own: a master that dies is a row of the table, not the end of it.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import platform
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np

import nlsdesign as nls
from nlsdesign.export import write_reference
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.locations import version
from nlsdesign.model.flat import FlatModel

DECK = "austin2015_figure_consistent"
RUNNER = Path(__file__).with_name("_foreign_master_run.py")
PACKAGES = ("ecospy", "tbb", "libcosimpy", "fmuloader", "cofmupy", "fmu-manipulation-toolbox")
MASTERS = ("fmpy", "ecospy", "libcosimpy", "fmuloader", "cofmupy", "casadi")
OUR_OWN = ("fmpy", "casadi")  # they come with nlsdesign
VERSIONS = ("3.0", "2.0")
AGREES = 1e-6
"""Of the range of a variable: the tolerance that the reference results state."""
TOO_LONG = 120.0


@dataclass(frozen=True)
class Cell:
    """What one master made of one FMU.

    Parameters
    ----------
    deviation
        Worst over the variables that it shows, over their range; not a number where it did not run.
    said
        Why it did not run.
    """

    deviation: float
    said: str = ""

    def __str__(self) -> str:
        return self.said if np.isnan(self.deviation) else f"{self.deviation:.1e}"


def units(folder: Path) -> dict[tuple[str, str], tuple[Path, FlatModel]]:
    """Export the FMUs with their reference results.

    Parameters
    ----------
    folder
        Where to.
    """
    plant = nls.flatten(nls.declare(load_deck(DECK)))
    models = {
        "plant": plant,
        "observer": nls.design_observer(plant, gain=nls.observer.CascadeGain()),
        "controller": nls.torque_controller(plant),
    }
    made = {}
    for name, model in models.items():
        for kind in VERSIONS:
            file = nls.export_fmu(model, folder / f"{name}_{kind[0]}.fmu", version=kind)
            write_reference(model, file)
            made[name, kind] = file, model
    return made


def environment(folder: Path) -> Path:
    """Return the Python of an environment with the masters; it is made where it is missing.

    Parameters
    ----------
    folder
        Of the environment.
    """
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    # One by one: what is not to be had for this machine is a row of the table.
    for package in PACKAGES:
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", package], check=False)
    return python


def cell(python: Path, master: str, fmu: Path, model: FlatModel) -> Cell:
    """Run one FMU in one master.

    Parameters
    ----------
    python
        Of the environment with the master.
    master
        Its name.
    fmu
        The FMU, with its reference results beside it.
    model
        The model in it.
    """
    reference = fmpy.util.read_csv(str(fmu.with_name(f"{fmu.stem}_ref.csv")))
    names = list(reference.dtype.names[1:])
    results = fmu.with_name(f"{fmu.stem}_{master}.csv")
    results.unlink(missing_ok=True)
    given = fmu.with_name(f"{fmu.stem}_in.csv")
    command = [str(each) for each in (python, RUNNER, master, fmu, given, results, *names)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TOO_LONG, check=False)
    except subprocess.TimeoutExpired:
        return Cell(np.nan, f"not done after {TOO_LONG:g} s")
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        died = done.returncode < 0
        # Without folders, which differ from run to run, and without the name of the model.
        message = re.sub(r"\S*/(\S+?)(?=[\s:]|$)", "...", last).replace("|", "/")[:160]
        return Cell(np.nan, f"the master dies of signal {-done.returncode}" if died else message)
    with results.open(encoding="utf-8", newline="") as stream:
        head, *rows = list(csv.reader(stream))
    shown = dict(zip(head, np.array(rows, dtype=float).T, strict=True))
    return _compared(shown, {n: np.array(reference[n][1:]) for n in names}, model)


def _compared(shown: Mapping[str, np.ndarray], reference: Mapping[str, np.ndarray], model: FlatModel) -> Cell:
    worst, seen = 0.0, False
    for name, expected in reference.items():
        if np.all(np.isnan(shown[name])):
            continue  # the master does not show it
        off = np.abs(shown[name] - expected)
        seen = True
        for reading in model.readings:
            quantum = model.values.get(f"{reading.sensors[0]}.quantum") if reading.sensors else None
            if reading.signal == name and quantum:
                # On the edge of a count a reading may be one off.
                off = np.where((off > 0.5 * quantum) & (off < 1.5 * quantum), 0.0, off)
        worst = max(worst, float(np.max(off) / np.ptp(expected)))
    return Cell(worst if np.isfinite(worst) else np.inf) if seen else Cell(np.nan, "shows nothing")


def checked(python: Path, fmu: Path) -> str:
    """Return what fmutool says of an FMU.

    Parameters
    ----------
    python
        Of the environment.
    fmu
        The FMU.
    """
    command = [str(python.parent / "fmutool"), "-input", str(fmu), "-check"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TOO_LONG, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return "did not run"
    found = done.stdout + done.stderr
    clean = "seems to be compliant" in found and "No semantic error" in found
    return "compliant" if clean and done.returncode == 0 else "not compliant"


def releases(python: Path) -> dict[str, str]:
    """Return the versions of the masters.

    Parameters
    ----------
    python
        Of the environment.
    """
    said = subprocess.run(
        [str(python), "-m", "pip", "list", "--format", "freeze"], capture_output=True, text=True, check=False
    ).stdout
    listed = dict(line.split("==", 1) for line in said.splitlines() if "==" in line)
    return {name.lower().replace("_", "-"): release for name, release in listed.items()} | {
        "fmpy": fmpy.__version__,
        "casadi": ca.CasadiMeta.version(),
    }


def page(
    cells: Mapping[tuple[str, str, str], Cell], found: Mapping[str, str], tool: Mapping[str, str]
) -> str:
    """Return the page of the documentation.

    Parameters
    ----------
    cells
        By master, model and version of FMI.
    found
        Releases by package.
    tool
        What fmutool says, by FMU.
    """
    kinds = [(name, kind) for name in ("plant", "observer", "controller") for kind in VERSIONS]
    lines = list(_introduction(found))
    lines.append("| master | " + " | ".join(f"{name} {kind}" for name, kind in kinds) + " |")
    lines.append("| --- |" + " --- |" * len(kinds))
    notes: list[str] = []
    for master in MASTERS:
        row = [f"{master} {found.get(master, 'not installed')}"]
        for name, kind in kinds:
            each = cells[master, name, kind]
            if np.isnan(each.deviation):
                if each.said not in notes:
                    notes.append(each.said)
                row.append(f"– [{notes.index(each.said) + 1}]")
            else:
                row.append(str(each))
        lines.append("| " + " | ".join(row) + " |")
    lines.append(
        f"| fmutool -check {found.get('fmu-manipulation-toolbox', 'not installed')} | "
        + " | ".join(tool[f"{name}_{kind[0]}"] for name, kind in kinds)
        + " |"
    )
    lines += ["", *[f"{i + 1}. `{note}`" for i, note in enumerate(notes)], "", *_notes()]
    return "\n".join(lines) + "\n"


def _introduction(found: Mapping[str, str]) -> Iterator[str]:
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    casadi = ca.CasadiMeta.version()
    machine = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    yield f"""# The FMUs in foreign masters

Written by `python -m benchmarks.foreign_masters --write docs/fmi_masters.md` on {today}
(nlsdesign {version()}, CasADi {casadi}, {machine}).
The command makes an environment of its own under `out/masters`, takes the masters from PyPI, exports plant,
observer and controller of the deck `{DECK}` with their reference results, and
runs 1000 samples of 1 ms in each master. It changes nothing else.

Each cell is the worst deviation from the package's own simulation, of any variable that the master shows,
over the range of that variable; a reading in counts may be one count off where the angle lies on the edge of
a count.
"""


def _notes() -> Iterator[str]:
    yield """fmpy and CasADi run in the environment of nlsdesign; cofmupy brings an older fmpy and shows
outputs alone, of the plant the counts of the encoder. ecospy needs the wheel `tbb` beside it. libcosim has no
FMI 3.0 and dies of it. CasADi imports model exchange, so the plant alone; its states are those of CVODES with
the derivatives of the FMU.

VDMCheck is not on PyPI. It is a Java program, to be had from the releases of
github.com/INTO-CPS-Association/FMI-VDM-Model: `VDMCheck3.sh plant_3.fmu` checks an FMU of FMI 3.0,
`VDMCheck2.sh plant_2.fmu` one of FMI 2.0."""


def main() -> int:
    """Write the table; exit status 1 if a master that ran does not agree."""
    parser = argparse.ArgumentParser(description="FMUs in foreign masters")
    parser.add_argument("--environment", type=Path, default=Path("out/masters/environment"))
    parser.add_argument("--out", type=Path, default=Path("out/masters"))
    parser.add_argument("--write", type=Path, help="page of the documentation")
    given = parser.parse_args()
    python = environment(given.environment.resolve())
    made = units(given.out.resolve())
    cells = {}
    for master in MASTERS:
        for (name, kind), (fmu, model) in made.items():
            here = Path(sys.executable) if master in OUR_OWN else python
            cells[master, name, kind] = each = cell(here, master, fmu, model)
            print(f"{master:12} {name:12} FMI {kind}: {each}", flush=True)
    tool = {fmu.stem: checked(python, fmu) for fmu, _ in made.values()}
    text = page(cells, releases(python), tool)
    if given.write:
        given.write.write_text(text, encoding="utf-8")
    print(text)
    return int(any(each.deviation > AGREES for each in cells.values()))


if __name__ == "__main__":
    sys.exit(main())
