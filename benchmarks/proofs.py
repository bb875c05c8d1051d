"""Proofs about generated steps: ``python -m benchmarks.proofs`` writes the table of ``docs/proofs.md`` anew.

Needs ``frama-c``. With ``--check`` nothing is written, and the exit status says whether all proofs hold.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from benchmarks._generated import models
from nlsdesign.export import export_c
from nlsdesign.export.compilation.proof import StepProof, prove_step

PAGE = Path(__file__).parents[1] / "docs" / "proofs.md"
BEGIN, END = "<!-- begin: proofs -->", "<!-- end: proofs -->"


def proved(chosen: dict[str, object], real: str) -> dict[str, StepProof]:
    """Prove each step in one number type; tell as it goes."""
    results = {}
    for name, model in chosen.items():
        with tempfile.TemporaryDirectory() as folder:
            results[name] = prove_step(export_c(model, folder, real=real, name="step"))  # type: ignore[arg-type]
        print(f"{name}, {real}: {'holds' if results[name].holds else results[name]}", flush=True)
    return results


def rows(results: dict[str, StepProof], real: str) -> list[str]:
    """Return a row of the table for each proof."""
    return [
        f"| {name} | {real} | {len(each.alarms) or 'none'} | {len(each.open_members) or 'none'} | "
        f"{len(each.beyond) or 'none'} | "
        f"{each.reached} of {each.statements} |"
        for name, each in results.items()
    ]


def main() -> int:
    """Prove, and write or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing")
    given = parser.parse_args()
    lines = [
        "| | number type | may be undefined | not proved finite | beyond limits | statements reached |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    holds = True
    for real in ("float", "double"):
        results = proved(models(), real)  # type: ignore[arg-type]
        lines += rows(results, real)
        holds &= all(each.holds for each in results.values())
    if not given.check:
        page = PAGE.read_text(encoding="utf8")
        before, after = page.partition(BEGIN)[0], page.partition(END)[2]
        PAGE.write_text(before + "\n".join([BEGIN, *lines, END]) + after, encoding="utf8")
    return int(not holds)


if __name__ == "__main__":
    raise SystemExit(main())
