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
from collections.abc import Iterable
from pathlib import Path

from benchmarks._generated import DECK, every_kind, generated_files, written
from benchmarks._tools import run_tool
from benchmarks.targets import replaced
from nlsdesign.export import CSource
from nlsdesign.export.c.c_text import Real

PAGE = Path(__file__).parents[1] / "docs" / "misra.md"

# Rule: its category in MISRA C:2012, what it asks for, and why it is deviated from.
ARGUMENTS = {
    "2.3": (
        "advisory",
        "unused types",
        "Types of the header are for the program that calls.",
    ),
    "2.4": (
        "advisory",
        "unused tags",
        "The add-on counts three named numbers, an enumeration that has no tag.",
    ),
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


def blocks(folder: Path) -> CSource:
    """Write a joined step that takes blocks of numbers, as the command does."""
    main = ["export", "c", "--deck", DECK, "--what", "both", "--kind", "cascade", "--real", "float"]
    run_tool([sys.executable, "-m", "nlsdesign", *main, "--block", "--out", str(folder)])
    header, source, selftest = (folder / f"torque_loop{end}" for end in (".h", ".c", "_selftest.c"))
    model = every_kind()["cascade observer and scheduled controller"]
    return CSource("torque_loop", model, Real.FLOAT, header, source, selftest)


def cppcheck() -> str | None:
    """The command, if it is installed."""
    return shutil.which("cppcheck")


def deviations(source: CSource) -> Counter[str]:
    """How often each rule is broken in one controller."""
    command = [cppcheck() or "cppcheck", "--addon=misra", "--enable=style", "--std=c99", "--quiet"]
    folder = source.header.parent
    files = [str(file) for file in (*generated_files(source), *folder.glob("*_supervisor.h"))]
    done = run_tool([*command, "--language=c", f"-I{folder}", *files], folder)
    broken = set(re.findall(r"^(.*?:\d+:\d+): .*\[misra-c2012-([\d.]+)\]$", done.stderr, flags=re.MULTILINE))
    if "misra" in done.stderr and not broken:
        raise SystemExit(f"cppcheck: {done.stderr.strip().splitlines()[-1]}")
    return Counter(rule for _, rule in broken)


def by_number(rules: Iterable[str]) -> list[str]:
    """Rules in the order of the standard."""
    return sorted(rules, key=lambda rule: [int(part) for part in rule.split(".")])


def table(counts: dict[str, Counter[str]]) -> list[str]:
    """One row for each rule with its argument, then one for each kind of code with its numbers."""
    lines = ["| rule | category | asks for | why it is deviated from |", "| --- | --- | --- | --- |"]
    rules = by_number(set().union(*counts.values()))
    for rule in rules:
        category, asks, argument = ARGUMENTS.get(rule, ("?", "?", "not argued"))
        lines.append(f"| {rule} | {category} | {asks} | {argument} |")
    lines += ["", f"| | {' | '.join(rules)} |", "| --- |" + " ---: |" * len(rules)]
    return [*lines, *(f"| {name} | {' | '.join(str(c[r]) for r in rules)} |" for name, c in counts.items())]


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
        for name, model in every_kind().items():
            counts[name] = deviations(written(name, model, Path(folder) / name.replace(" ", "_"), "float"))
            print(name, dict(counts[name]), flush=True)
        source = blocks(Path(folder) / "blocks")
        counts["cascade observer and scheduled controller, with blocks"] = deviations(source)
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
