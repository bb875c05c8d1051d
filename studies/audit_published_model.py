"""Audit of the published model: every statement on it is re-derived, with the calculation and a verdict.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber "
    "Springs",
IROS 2015, and what the project's design notes say of it. Verdicts: holds, does not hold, cannot be decided,
contradicts the figures. Beside ``report.html`` stand ``audit.json`` and ``audit.txt``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import nlsdesign as nls
from nlsdesign.writing import write_text

from . import (
    _audit_cam,
    _audit_closed_loop,
    _audit_contour,
    _audit_drive,
    _audit_figures,
    _audit_forces,
    _audit_frequency,
    _audit_hooke,
    _audit_law,
    _audit_loops,
    _audit_losses,
    _audit_observer,
    _audit_parameters,
    _audit_printed,
    _audit_prony,
    _audit_seen,
    _audit_state,
    _audit_tensile,
    _audit_units,
    _audit_viscosity,
)
from ._audit_finding import Finding
from ._audit_output import counts, order, table, text, write_json
from ._audit_page import write_page

CHAPTERS = {
    "The law of the rubber": (_audit_units, _audit_law, _audit_printed, _audit_parameters),
    "State and observability": (_audit_state, _audit_seen, _audit_observer),
    "Relaxation and loops": (_audit_losses, _audit_loops, _audit_viscosity, _audit_prony),
    "Forces of the figures": (_audit_frequency, _audit_figures, _audit_forces, _audit_hooke),
    "The cam": (_audit_cam, _audit_contour, _audit_tensile),
    "Drivetrain and closed loop": (_audit_drive, _audit_closed_loop),
}
"""Each module has ``findings()``."""


def main(out: Path, fast: bool = False, steps: Any = None) -> dict[str, float]:
    """Check every statement, print the table of verdicts and write page, data and text.

    Parameters
    ----------
    out
        Folder for everything.
    fast
        Without effect: the whole audit takes some seconds.
    steps
        Shows progress; see ``nlsdesign.progress``.

    Returns
    -------
    dict
        Every number of the audit by name, and how many statements got each verdict.
    """
    steps = steps or nls.progress.Steps()
    chapters = {}
    for title, modules in CHAPTERS.items():
        with steps.step(title.lower()):
            found = [finding for module in modules for finding in module.findings()]
            chapters[title] = sorted(found, key=order)
    everything = [finding for found in chapters.values() for finding in found]
    out.mkdir(parents=True, exist_ok=True)
    write_json(everything, out / "audit.json")
    write_text(out / "audit.txt", text(everything))
    with steps.step("page"):
        write_page(chapters, out)
    # On standard error, like all that accompanies a run: with --json standard output is data alone.
    for key, statement, verdict, _ in table(everything):
        print(f"{key:>5}  {verdict:<24} {statement}", file=sys.stderr)
    return results(everything)


def results(findings: list[Finding]) -> dict[str, float]:
    """Return the numbers of all findings by name, and the counts of the verdicts."""
    found = {name: value for each in findings for name, (value, _) in each.numbers.items()}
    return found | {f"verdicts_{v.replace(' ', '_')}": float(n) for v, n in counts(findings).items()}
