"""Measurements that may not travel with the project: where they are, and what the studies of them share."""

from __future__ import annotations

import os
from pathlib import Path

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict
from nlsdesign.presentation.report import Chapter


def data_folder(name: str, given: Path | None) -> Path | None:
    """Return the folder of a set of measurements, or ``None`` if it is not on this machine.

    ``given``: path that the caller names; otherwise ``measured/NAME`` below the folder in NLSDESIGN_SHARED.
    """
    above = os.environ.get("NLSDESIGN_SHARED")
    folder = given or (Path(above) / "measured" / name if above else None)
    return folder if folder is not None and folder.is_dir() else None


def write_skipped(name: str, out: Path) -> None:
    """Write on the terminal and in the report why a study has no result."""
    why = (
        f"The measurements '{name}' may not be copied into the project and are not on this machine. "
        f"Set NLSDESIGN_SHARED to the folder above measured/{name}, or call main(out, data=FOLDER)."
    )
    print(f"skipped: {why}")
    nls.write_report(out / "report.html", Chapter("Skipped", why), title=f"{name}: skipped")


def write_diagnosis(verdict: Verdict, out: Path) -> None:
    """Write the verdict, the better deck, and ``gap.svg``: the error on each record before and after."""
    nls.write_verdict(verdict, out)
    gaps = [gap for gap in verdict.gaps if gap.block == verdict.block]
    errors = [
        nls.figures.RecordError(g.record, g.before, g.after, g.noise_floor, g.role == "held_out")
        for g in gaps
    ]
    nls.figures.write_figures(out, {"gap": nls.figures.gap_bars(errors, unit=gaps[0].unit)})


def named_effects(verdict: Verdict) -> dict[str, float]:
    """Return a one for each effect that the verdict names, and how many these are."""
    names = dict.fromkeys(effect.name for effect in verdict.effects)
    return {**{f"named_{name}": 1.0 for name in names}, "names": float(len(names))}
