"""Proofs about generated steps: ``python -m benchmarks.proofs`` writes the table of ``docs/proofs.md`` anew.

Needs ``frama-c``. All kinds take more than an hour; with the names of some, only their rows are written
anew. With ``--check`` nothing is written. The exit status says whether all proofs hold.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from benchmarks._generated import models
from benchmarks.targets import with_rows
from nlsdesign.export import export_c
from nlsdesign.export.compilation.proof import StepProof, prove_step

PAGE = Path(__file__).parents[1] / "docs" / "proofs.md"
REALS = ("float", "double")


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
    parser.add_argument("kinds", nargs="*", help="such as 'cascade observer'; all by default")
    parser.add_argument("--check", action="store_true", help="write nothing")
    given, every = parser.parse_args(), models()
    if unknown := [kind for kind in given.kinds if kind not in every]:
        parser.error(f"there is no kind {unknown[0]!r}; kinds are {', '.join(every)}")
    chosen = {name: every[name] for name in given.kinds or every}
    order = [f"| {name} | {real} |" for real in REALS for name in every]
    holds = True
    for real in REALS:
        results = proved(chosen, real)  # type: ignore[arg-type]
        holds &= all(each.holds for each in results.values())
        if not given.check:
            page = with_rows(PAGE.read_text(encoding="utf8"), "proofs", order, rows(results, real))
            PAGE.write_text(page, encoding="utf8")
    return int(not holds)


if __name__ == "__main__":
    raise SystemExit(main())
