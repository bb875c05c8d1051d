"""A real elastomer: what an elastic strip lacks, found at two rates of stretch, judged at a third.

Data: uniaxial loading and unloading of VHB 4910 at 0.01, 0.03 and 0.05 1/s up to a stretch of 3, published by
Chongran Zhao (VHB4910_data). They are read where they stand and never copied.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls

from ._measured import data_folder, gap_figure, skipped

MAPPING = Path(__file__).with_name("vhb4910_records.toml")
FORCE = "load_cell.reading"


def main(out: Path, fast: bool = False, steps: Any = None, data: Path | None = None) -> dict[str, float]:
    """Diagnose the elastic strip with the tests at the slowest and the fastest rate.

    Parameters
    ----------
    out
        Folder for ``report.html``, the verdict and the better deck.
    fast, steps
        No shorter way is needed; shows progress.
    data
        Folder that holds ``loading_unloading``; see :func:`data_folder`.
    """
    folder = data_folder("vhb4910", data)
    if folder is None:
        return skipped("vhb4910", out)
    steps = steps or nls.progress.Steps()
    strip = elastic_strip(nls.load_deck("vhb4910_specimen"))
    records = nls.load_records(folder / "loading_unloading", nls.flatten(strip), mapping=MAPPING)
    with steps.step("diagnosis"):
        verdict = nls.diagnose(strip, records, progress=steps.note)
    nls.write_verdict(verdict, out)
    gap_figure(verdict, out)
    better, numbers = verdict.actuator, verdict.actuator.quantities()
    found = {
        **{f"named_{e.name}": 1.0 for e in verdict.effects},
        "names": float(len({e.name for e in verdict.effects})),
        "elastic_error_fit_percent": error(verdict.declared, records, "fit"),
        "elastic_error_held_out_percent": error(verdict.declared, records, "held_out"),
        "better_error_fit_percent": error(better, records, "fit"),
        "better_error_held_out_percent": error(better, records, "held_out"),
        **{f"relaxation_time_{i}_s": t for i, t in enumerate(relaxation_times(better), start=1)},
        "equilibrium_modulus_kPa": 1e-3 * next(q.number for n, q in numbers.items() if "elastic." in n),
    }
    rows = [(name.replace("_", " "), f"{value:.3g}") for name, value in found.items()]
    pages = [
        *nls.report.verdict_sections(verdict),
        nls.report.TableSection("Numbers", ("what", "value"), tuple(rows)),
    ]
    nls.write_report(out / "report.html", *pages, title="VHB 4910: what is missing")
    return found


def elastic_strip(deck: Any) -> Any:
    """Return the strip of the deck with an elastic law alone, whose modulus is known to a factor of three."""
    declared = nls.models.elastomer_specimen(deck)
    size = {name: declared.quantities()[f"strip.rubber.{name}"] for name in ("area", "rest_length")}
    modulus = nls.quantity(40.0, "kPa", source="assumed: an order of magnitude", spread=2.0)
    rubber = nls.specimen(
        area=replace(size["area"], spread=0.0),
        rest_length=size["rest_length"],
        elastic=nls.components.NeoHooke(shear_modulus=modulus),
    )
    return declared.with_part("strip", rubber)


def error(strip: Any, records: Any, role: str) -> float:
    """Return the rms error of the force over all tests of a role, in per cent of the rms force."""
    rest, whole = [], []
    for record in records.of(role):
        whole.append(record.trace[FORCE])
        alone = replace(records, records=(record,))
        rest.append(nls.predict(strip, alone, record.name)[FORCE] - record.trace[FORCE])
    return float(100.0 * np.linalg.norm(np.concatenate(rest)) / np.linalg.norm(np.concatenate(whole)))


def relaxation_times(strip: Any) -> list[float]:
    """Return viscosity over shear modulus of each branch that flows, shortest first."""
    branches = [part for _, part in strip.walk() if isinstance(part, nls.components.FlowingChains)]
    return sorted(b.viscosity.number / b.shear_modulus.number for b in branches)
