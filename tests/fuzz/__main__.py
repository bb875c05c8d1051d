"""Run fuzzed cases by the thousand.

    python -m tests.fuzz decks --count 20000 --seed 1 --out out/fuzz
    python -m tests.fuzz records|fmus|commands|interrupts --count 1000

Each case depends on seed and number alone. Outcomes stand in ``FAMILY-SEED.jsonl``: a run that was stopped
goes on where it was. At the end stands a table, and each distinct fault once, with the smallest case of its
kind written beside it. The exit status is 1 where there was any.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from . import family_names, family_of
from .cases import Outcome
from .running import made_by, outcomes, shrunk

_SHORT = 20.0
"""Cases that may take longer are not made smaller."""


def main() -> int:
    """Run, and return 1 where a case ended as none may."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("family", choices=family_names())
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    family, log = family_of(given.family), given.out / f"{given.family}-{given.seed}.jsonl"
    cases = made_by(family, given.seed)
    done = _logged(log)
    left = [number for number in range(given.count) if number not in done]
    try:
        with log.open("a", encoding="utf-8") as stream:
            for number, outcome in outcomes(family, cases, left):
                done[number] = outcome
                print(json.dumps([number, *outcome]), file=stream, flush=True)
                _show_progress(len(done), given.count)
    except KeyboardInterrupt:
        print("\nstopped; the same command goes on from here")
    counts = Counter(outcome.kind for outcome in done.values())
    print(f"\n{given.family}, seed {given.seed}: {len(done)} cases")
    for kind, count in counts.most_common():
        print(f"  {kind:24} {count}")
    faults: dict[Outcome, list[int]] = {}
    for number, outcome in done.items():
        if outcome.wrong:
            faults.setdefault(outcome, []).append(number)
    for order, (outcome, numbers) in enumerate(sorted(faults.items(), key=lambda pair: -len(pair[1]))):
        smallest = min(map(cases, numbers[:50]), key=lambda case: case.size)
        if family.limit <= _SHORT:
            smallest = shrunk(family, smallest, outcome)
        place = given.out / f"{given.family}-{given.seed}-fault-{order + 1}"
        smallest.written(place)
        words = f", words {[word[:60] for word in smallest.words]}" if smallest.words else ""
        print(f"{outcome.kind}: {outcome.detail}\n    {len(numbers)} times, first {numbers[0]}, "
              f"by {smallest.how}{words}, {smallest.size} bytes in {place}")  # fmt: skip
    return 1 if faults else 0


def _logged(log: Path) -> dict[int, Outcome]:
    lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
    return {number: Outcome(*rest) for number, *rest in map(json.loads, lines)}


def _show_progress(done: int, count: int) -> None:
    if sys.stderr.isatty() or done % 1000 == 0:
        print(f"\r{done} of {count}", end="" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
