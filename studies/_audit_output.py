"""How findings are written: sorted, as a table, as text, as data."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import nlsdesign as nls
from nlsdesign.writing import write_text

from ._audit_finding import Finding


def order(finding: Finding) -> tuple[bool, float, str]:
    """Return what findings are sorted by: the items of the notes by number, then those with a letter."""
    numbered = finding.key[0].isdigit()
    return not numbered, float(finding.key) if numbered and "10." not in finding.key else 10.0, finding.key


def table(findings: Sequence[Finding]) -> list[tuple[str, str, str, str]]:
    """Return key, statement, verdict and first number of each finding."""
    rows = []
    for each in findings:
        numbers = "; ".join(f"{n} = {v:.4g} {u}".removesuffix(" 1") for n, (v, u) in each.numbers.items())
        rows.append((each.key, each.statement, each.verdict, numbers))
    return rows


def text(findings: Sequence[Finding]) -> str:
    """Return the audit as text: each statement, its calculation, its numbers, its verdict."""
    lines = []
    for each in findings:
        lines += [f"{each.key}  [{each.verdict}]  {each.statement}"]
        lines += [
            f"      {s.words}" + ("" if s.formula is None else f"\n          {s.formula}") for s in each.steps
        ]
        lines += [f"      {n} = {v:.5g} {u}" for n, (v, u) in each.numbers.items()]
        lines += [f"      -> {each.why}", ""]
    return "\n".join(lines)


def write_json(findings: Sequence[Finding], path: Path) -> None:
    """Write the audit as data; the file appears whole or not at all."""
    content = {"counts": counts(findings), "findings": [f.record() for f in findings]}
    write_text(path, json.dumps(content, ensure_ascii=False, indent=1) + "\n")


def counts(findings: Sequence[Finding]) -> dict[str, int]:
    """Return how many statements got each verdict."""
    return {verdict: sum(f.verdict == verdict for f in findings) for verdict in nls.report.OUTCOMES}
