"""Where measured data stand that may not travel with the project."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import nlsdesign as nls


def data_folder(name: str, given: Path | str | None) -> Path | None:
    """Return the folder of a set of measurements, or ``None`` if it is not on this machine.

    Parameters
    ----------
    name
        Of the set, for instance ``"emps"``.
    given
        Path that the caller names; otherwise ``measured/NAME`` below the folder in NLSDESIGN_SHARED.
    """
    shared = os.environ.get("NLSDESIGN_SHARED")
    folder = Path(given) if given else Path(shared) / "measured" / name if shared else None
    return folder if folder is not None and folder.is_dir() else None


def skipped(name: str, out: Path) -> dict[str, float]:
    """Say why a study has no result, on the terminal and in its report."""
    why = (
        f"The measurements '{name}' may not be copied into the project and are not on this machine. "
        f"Set NLSDESIGN_SHARED to the folder above measured/{name}, or call main(out, data=FOLDER)."
    )
    print(f"skipped: {why}")
    nls.write_report(out / "report.html", nls.report.Chapter("Skipped", why), title=f"{name}: skipped")
    return {}


def gap_figure(verdict: Any, out: Path) -> None:
    """Write ``gap.svg``: the error on each record before and after, with the noise floor."""
    gaps = [g for g in verdict.gaps if g.block == verdict.block]
    rows = [
        nls.figures.RecordError(g.record, g.before, g.after, g.noise_floor, g.role == "held_out")
        for g in gaps
    ]
    nls.figures.write_figures(out, {"gap": nls.figures.gap_bars(rows, unit=gaps[0].unit)})
