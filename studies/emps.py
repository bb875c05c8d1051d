"""A real positioning drive: what its viscous model lacks, found on one half of a record, judged on the other.

Data: Janot, Gautier, Brunot, "Data set and reference models of EMPS", Workshop on Nonlinear System
Identification Benchmarks, 2019. They are read where they stand and never copied.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

import nlsdesign as nls

from ._measured import data_folder, gap_figure, skipped

MAPPING = Path(__file__).with_name("emps_records.toml")
WINDOWS = {"1s": 1.0, "3s1": 3.1}
BANDWIDTH, EDGE = 20.0, 100
PHASES = 4
MISSING = ("dry_friction", "offset")
FITTED = {"mass_kg": "carriage.mass", "viscous_Ns_per_m": "guide.damping"}
FITTED |= {"coulomb_N": "dry_friction.sliding_force", "offset_N": "offset.load"}
UNITS = dict(zip(FITTED, ("kg", "N*s/m", "N", "N"), strict=True))


def main(out: Path, fast: bool = False, steps: Any = None, data: Path | None = None) -> dict[str, float]:
    """Diagnose the drive without dry friction and offset, refit what was found, and measure both halves.

    Parameters
    ----------
    out
        Folder for ``report.html``, the verdict and the better deck.
    fast, steps
        No shorter way is needed; shows progress.
    data
        Folder with ``emps.csv``; see :func:`data_folder`.
    """
    folder = data_folder("emps", data)
    if folder is None:
        return skipped("emps", out)
    steps = steps or nls.progress.Steps()
    published = nls.models.positioning_drive(nls.load_deck("janot2019_positioning_drive"))
    bare = viscous_only(published)
    records = nls.load_records(folder, nls.flatten(bare), mapping=MAPPING)
    with steps.step("diagnosis"):
        verdict = nls.diagnose(bare, records, progress=steps.note)
    with steps.step("fit by simulation, the balance of forces as prior"):
        better = refitted(verdict, records)
    nls.write_verdict(verdict, out)
    gap_figure(verdict, out)
    nls.write_deck(better, out / "refitted.toml")
    (held,) = records.of("held_out")
    found = {
        **{f"named_{e.name}": 1.0 for e in verdict.effects},
        "names": float(len({e.name for e in verdict.effects})),
        **errors("viscous", verdict.declared, held, records),
        **errors("better", better, held, records),
        **{name: nls.flatten(better).values[path] for name, path in FITTED.items()},
    }
    numbers = {path: q.number for path, q in published.quantities().items() if path in FITTED.values()}
    nls.write_report(out / "report.html", *pages(verdict, found, numbers), title="EMPS: what is missing")
    return found


def viscous_only(published: Any) -> Any:
    """Return the drive with mass and viscous friction alone, known to a factor of three."""
    bare = published
    for name in MISSING:
        bare = bare.without_part(name)
    numbers = bare.quantities()
    guess = {"carriage.mass": 60.0, "guide.damping": 100.0}
    source = "assumed: an order of magnitude"
    wide = {n: replace(numbers[n].with_value(v, source), spread=2.0) for n, v in guess.items()}
    return bare.with_values(wide)


def refitted(verdict: Any, records: Any) -> Any:
    """Return the better model, fitted by simulation over one second on top of the balance of forces."""
    model = nls.flatten(verdict.actuator)
    free = [nls.free_parameter(model.variable(p.name)) for fit in verdict.fits for p in fit.parameters]
    shots, seen = nls.identification.Shots(WINDOWS["1s"], joined=False, phases=PHASES), records.of("fit")
    alone = nls.fit_by_simulation(model, seen, free, shots=shots)
    weights = nls.identification.Weights(nls.identification.coloured_sigma(alone), known=verdict.fits)
    both = nls.fit_by_simulation(model, seen, free, shots=shots, weights=weights)
    return verdict.actuator.with_values(both.fit.values)


def errors(label: str, drive: Any, record: Any, records: Any) -> dict[str, float]:
    """Return position errors over windows in mm, and the error of the balance in per cent of the force."""
    model = nls.flatten(drive)
    runs = {name: nls.predict_in_windows(model, record, length) for name, length in WINDOWS.items()}
    unbalanced = nls.predict(drive, records, record.name)["carriage.unbalanced"]
    force = model.values["carriage.force_constant"] * record.trace["carriage.voltage"]
    sections = butter(4, BANDWIDTH, fs=1.0 / record.step, output="sos")
    rest, whole = (sosfiltfilt(sections, row)[EDGE:-EDGE] for row in (unbalanced, force))
    found = {f"{label}_error_over_{name}_mm": 1e3 * r.rmse("carriage.position") for name, r in runs.items()}
    return found | {
        f"{label}_force_error_percent": float(100.0 * np.linalg.norm(rest) / np.linalg.norm(whole))
    }


def pages(verdict: Any, found: dict[str, float], published: dict[str, float]) -> list[Any]:
    """Return the report: the verdict, the errors on the half that no fit has seen, and the numbers."""
    kept = [key[7:] for key in found if key.startswith("better_")]
    rows = [
        (key.replace("_", " "), f"{found['viscous_' + key]:.3g}", f"{found['better_' + key]:.3g}")
        for key in kept
    ]
    numbers = [nls.report.PublishedNumber(n, published[p], found[n], UNITS[n]) for n, p in FITTED.items()]
    columns = ("error", "viscous friction alone", "with what was found")
    return [
        *nls.report.verdict_sections(verdict),
        nls.report.TableSection("Second half", columns, tuple(rows)),
        nls.report.comparison_table("Fitted on the first half, and published", numbers),
    ]
