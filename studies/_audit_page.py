"""The page of the audit: table of verdicts first, then each statement with calculation and figure."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nlsdesign as nls

from ._audit_finding import Finding
from ._audit_output import counts, table
from ._audit_units import unit_table

ABSTRACT = (
    "Each statement on the published cam-rubber actuator, of the paper or of the project's design "
    "notes, with the calculation that tests it and one verdict: `holds`, `does not hold`, `cannot be "
    "decided`, `contradicts the figures`. The equations are derived symbolically; the points of the "
    "figures were read off the vector graphics of the paper.\n\nThe printed equations (1), (3) and (4) "
    "are used as the design notes transcribe them. Where a printed form is known by its consequences "
    "only, it was rebuilt and the consequence was tested."
)

ELSEWHERE = (
    ("Scaled condition numbers of the published form over the "
        "angle", "tests/literature/test_observability_2015.py"),
    ("Joint design: 266, 28 and below 0.05 mN·m rms", "tests/literature/test_design_2014.py"),
    ("Cam error of the two decks against Fig. 8", "tests/literature/test_fig8.py"),
    ("The cascade observer is stable for every motion", "tests/physics/test_observer_error.py"),
    ("Zero-torque curve of the nonlinear spring, Fig. 9", "tests/literature/test_zero_torque_2015.py"),
    ("Common Lyapunov functions and their decay rates; pole placement fails in 17 of 18 "
        "cases", "not audited"),
    ("Overshoot at 3–5 Hz of Fig. 10, rise of Fig. 9 to 0.62 N·m at 11 Hz", "not audited"),
    ("Command speed (dτ/dt + ω_c·e)/k_t: errors .05/.09/.19/.29", "not audited"),
)  # fmt: skip


SYMBOLS = (
    ("F, F*, F_M", "force of one element; of its equilibrium law; of its Maxwell branch (k, η)"),
    ("δ, θ, ω, h", "extension, angle and speed of the cam, lever arm h = dδ/dθ = r·sin β"),
    ("a", "A₀/L₀ = 8.0 mm: force per modulus and extension"),
    ("K, D", "Σ kᵢ*·H(δ − δᵢ) and Σ kᵢ*·H(δ − δᵢ)·δᵢ; so F* = a·(K·δ − D)"),
    ("K_off", "Σ kᵢ* over the moduli that are not engaged"),
    ("N, J, n, k_T, I", "number of elements, inertia, gear ratio, torque constant, current"),
)


def write_page(chapters: Mapping[str, list[Finding]], out: Path) -> Path:
    """Write the self-contained page ``report.html``."""
    everything = [finding for found in chapters.values() for finding in found]
    sections: list[Any] = [
        nls.report.NumbersSection(
            "Verdicts", tuple(nls.report.KeyNumber(v, str(n)) for v, n in counts(everything).items())
        ),
        nls.report.TableSection(
            "Statements", ("item", "statement", "verdict", "numbers"), tuple(table(everything))
        ),
        nls.report.TableSection("Symbols", ("symbol", "meaning"), SYMBOLS),
    ]
    for title, found in chapters.items():
        sections.append(nls.report.Chapter(title))
        sections += [finding.section() for finding in found]
        if title == "The law of the rubber":
            sections.append(unit_table())
    sections += [
        nls.report.Chapter("Beyond this audit"),
        nls.report.TableSection(
            "Statements that are tested elsewhere, or not at all", ("statement", "where"), ELSEWHERE
        ),
        nls.report.FileSection(
            "Written beside this page",
            {out / "audit.json": "all findings as data", out / "audit.txt": "the calculations as text"},
        ),
    ]
    page: Path = nls.write_report(
        out / "report.html", *sections, title="Audit of the published model", abstract=ABSTRACT
    )
    return page
