"""How the audit is written: as a page, as text, as data."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import nlsdesign as nls
from nlsdesign.foundation.text_files import write_text
from nlsdesign.presentation.report import (
    Chapter,
    FileSection,
    KeyNumber,
    NumbersSection,
    Section,
    TableSection,
)

from .finding import Finding, Results
from .law import unit_table

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


def write_page(results: Results, out: Path) -> Path:
    """Write ``report.html``: verdicts first, then each statement with its calculation and figures."""
    counts = tuple(KeyNumber(verdict, str(count)) for verdict, count in results.verdicts.items())
    columns = ("item", "statement", "verdict", "numbers")
    sections: list[Section] = [
        NumbersSection("Verdicts", counts),
        TableSection(
            "Statements",
            columns,
            tuple(rows(results.findings)),
            caption="Each statement, and what became of it.",
        ),
        TableSection("Symbols", ("symbol", "meaning"), SYMBOLS, caption="As the paper writes them."),
    ]
    for title, findings in results.chapters.items():
        sections += [Chapter(title), *(finding.section() for finding in findings)]
        if title == "The law of the rubber":
            sections.append(unit_table())
    files = {out / "audit.json": "all findings as data", out / "audit.txt": "the calculations as text"}
    sections += [
        Chapter("Beyond this audit"),
        TableSection(
            "Statements that are tested elsewhere, or not at all",
            ("statement", "where"),
            ELSEWHERE,
            caption="What this audit leaves to others.",
        ),
        FileSection("Written beside this page", files, caption="The findings for programs and as text."),
    ]
    title = "Audit of the published model"
    return nls.write_report(out / "report.html", *sections, title=title, abstract=ABSTRACT)


def rows(findings: Sequence[Finding]) -> list[tuple[str, str, str, str]]:
    """Return key, statement, verdict and numbers of each finding."""
    table = []
    for each in findings:
        numbers = "; ".join(f"{n} = {v:.4g} {u}".removesuffix(" 1") for n, (v, u) in each.numbers.items())
        table.append((each.key, each.statement, each.verdict, numbers))
    return table


def write_data(results: Results, out: Path) -> None:
    """Write ``audit.json``, all findings as data, and ``audit.txt``, the calculations as text."""
    content = {"counts": results.verdicts, "findings": [finding.record() for finding in results.findings]}
    write_text(out / "audit.json", json.dumps(content, ensure_ascii=False, indent=1) + "\n")
    write_text(out / "audit.txt", text(results.findings))


def text(findings: Sequence[Finding]) -> str:
    """Return each statement with its calculation, its numbers and its verdict."""
    lines = []
    for each in findings:
        lines += [f"{each.key}  [{each.verdict}]  {each.statement}"]
        lines += [
            f"      {s.words}" + ("" if s.formula is None else f"\n          {s.formula}") for s in each.steps
        ]
        lines += [f"      {n} = {v:.5g} {u}" for n, (v, u) in each.numbers.items()]
        lines += [f"      -> {each.why}", ""]
    return "\n".join(lines)
