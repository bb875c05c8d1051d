"""Deviations of generated C from MISRA C:2012, as cppcheck finds them: ``python -m benchmarks.misra``.

Writes the table of ``docs/misra.md`` anew. The exit status is 1 if a rule is broken that has no argument
there, so a new deviation is argued or mended.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from benchmarks._generated import DECK, models
from benchmarks._tools import run_tool
from benchmarks.targets import replaced
from nlsdesign.export import export_c
from nlsdesign.export.c.writer import CSource

PAGE = Path(__file__).parents[1] / "docs" / "misra.md"

# Rule: its category in MISRA C:2012, what it asks for, and why it is deviated from.
ARGUMENTS = {
    "2.5": (
        "advisory",
        "unused macros",
        "Sample time, deck, digest and interface version in the header are for the program that calls.",
    ),
    "8.7": (
        "advisory",
        "external linkage only where it is needed",
        "The functions of the header are the interface; another file calls them.",
    ),
    "8.9": (
        "advisory",
        "objects used in one function are defined there",
        "Start values and limits stand together before the functions, where a reader looks for them.",
    ),
    "12.1": (
        "advisory",
        "brackets make precedence explicit",
        "Sums of products are written as in mathematics; more brackets would hide the equations.",
    ),
    "19.2": (
        "advisory",
        "no unions",
        "Elementary functions read and write the exponent of a number; C99 defines that for a union, and the "
        "alternative, memcpy between unlike types, breaks the required rule 21.15.",
    ),
}


def cppcheck() -> str | None:
    """The command, if it is installed."""
    return shutil.which("cppcheck")


def deviations(source: CSource) -> Counter[str]:
    """How often each rule is broken in one controller."""
    command = [cppcheck() or "cppcheck", "--addon=misra", "--enable=style", "--std=c99", "--quiet"]
    done = run_tool([*command, f"-I{source.header.parent}", str(source.source)], source.header.parent)
    broken = set(re.findall(r"^(.*?:\d+:\d+): .*\[misra-c2012-([\d.]+)\]$", done.stderr, flags=re.MULTILINE))
    if "misra" in done.stderr and not broken:
        raise SystemExit(f"cppcheck: {done.stderr.strip().splitlines()[-1]}")
    return Counter(rule for _, rule in broken)


def table(counts: dict[str, Counter[str]]) -> list[str]:
    """One row for each rule."""
    lines = [f"| rule | category | asks for | {' | '.join(counts)} | why it is deviated from |"]
    lines.append("| --- | --- | --- |" + " ---: |" * len(counts) + " --- |")
    rules = sorted(set().union(*counts.values()), key=lambda rule: [int(part) for part in rule.split(".")])
    for rule in rules:
        category, asks, argument = ARGUMENTS.get(rule, ("?", "?", "not argued"))
        numbers = " | ".join(str(count[rule]) for count in counts.values())
        lines.append(f"| {rule} | {category} | {asks} | {numbers} | {argument} |")
    return lines


def unargued(counts: dict[str, Counter[str]]) -> list[str]:
    """Rules that are broken without an argument."""
    return sorted({rule for count in counts.values() for rule in count} - set(ARGUMENTS))


def main() -> int:
    """Check, and write the page."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter).parse_args()
    if cppcheck() is None:
        raise SystemExit("not checked: cppcheck is not installed (Debian: apt-get install cppcheck)")
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, model in models().items():
            if name in ("cascade observer", "controller", "cascade observer and controller"):
                source = export_c(model, Path(folder) / name.replace(" ", "_"), real="float", name="step")
                counts[name] = deviations(source)
    version = run_tool(["cppcheck", "--version"]).stdout.strip()
    lines = [f"Found by {version} in the float code of deck `{DECK}`.", "", *table(counts)]
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf8"), {"deviations": lines}), encoding="utf8")
    print("\n".join(lines))
    missing = unargued(counts)
    for rule in missing:
        print(f"rule {rule} is broken without an argument")
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main())
