"""Audit of the published model: every statement on it is re-derived, with the calculation and a verdict.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015, and the statements on it in the project's design notes. Verdicts: holds, does not hold,
cannot be decided, contradicts the figures. Beside ``report.html`` stand ``audit.json`` and ``audit.txt``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import nlsdesign as nls

from . import cam, drive, figures, law, observer, relaxation
from .finding import Finding, Results
from .report import rows, write_data, write_page

CHAPTERS = {
    "The law of the rubber": law.findings,
    "State and observability": observer.findings,
    "Relaxation and loops": relaxation.findings,
    "Forces of the figures": figures.findings,
    "The cam": cam.findings,
    "Drivetrain and closed loop": drive.findings,
}


def main(out: Path, fast: bool = False) -> Results:
    """Check every statement, print the table of verdicts and write page, data and text."""
    steps, chapters = nls.progress.Steps(), {}
    for title, findings in CHAPTERS.items():
        with steps.step(title.lower()):
            chapters[title] = tuple(sorted(findings(), key=order))
    results = Results(chapters)
    out.mkdir(parents=True, exist_ok=True)
    write_data(results, out)
    with steps.step("page"):
        write_page(results, out)
    # On standard error, like all that accompanies a run: with --json standard output is data alone.
    for key, statement, verdict, _ in rows(results.findings):
        print(f"{key:>5}  {verdict:<24} {statement}", file=sys.stderr)
    return results


def order(finding: Finding) -> tuple[bool, float, str]:
    """Return the key that sorts findings: the items of the notes by number, then those with a letter."""
    numbered = finding.key[0].isdigit()
    return not numbered, float(finding.key) if numbered and "10." not in finding.key else 10.0, finding.key
