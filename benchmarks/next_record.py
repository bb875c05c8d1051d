"""Does the record that is proposed decide what the records before could not?

    python -m benchmarks.next_record [--seeds 1-3] [--out next_record.jsonl]

For each pair of effects the rig leaves a few gentle records in which both look alike, the experiment is
proposed from the two fitted hypotheses, the rig runs it with the true effect, and both are fitted again.
Counted are the cases that were not decided rightly before, and those of them that are afterwards.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from models.test_rig import test_rig_deck
from nlsdesign.bench.discrepancy import effects
from nlsdesign.bench.discrepancy.planning.candidate_commands import MachineLimits
from nlsdesign.bench.discrepancy.planning.experiment import next_experiment
from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.components import Assembly
from nlsdesign.foundation.errors import ConvergenceError
from nlsdesign.model import flatten
from tests.rig import ACTUATORS, write_declaration, write_records
from tests.rig.commands import STEP, Command, command_of, sines
from tests.rig.records import make_record

DECIDED = 9.0
"""Difference of the sums of squares, in units of the noise, from which a pair is told apart: three standard
errors."""
_FIRST = 6
"""Number of the first record; those of a set of the rig are below."""


def _sine(degrees: float, frequency: float, duration: float) -> Command:
    time = np.arange(round(duration / STEP)) * STEP
    return sines(time, np.radians([degrees]), np.array([frequency]), np.zeros(1))


def _ramps(degrees: float, speed: float, duration: float) -> Command:
    """One triangle after the other, with a constant speed in rad/s."""
    time = np.arange(0.0, duration, 2e-3)
    top = np.radians(degrees)
    angle = top - np.abs(np.mod(speed * time + top, 4.0 * top) - 2.0 * top)
    kernel = np.hanning(101) / np.hanning(101).sum()
    rounded = np.convolve(np.pad(angle, 50, mode="edge"), kernel, mode="valid")
    return command_of(time, rounded * np.minimum(time / 0.3, 1.0))


def _rise(degrees: float, duration: float) -> Command:
    """Only upwards, at one speed."""
    time = np.arange(0.0, duration, 2e-3)
    x = time / duration
    return command_of(time, np.radians(degrees) * (x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi)))


@dataclass(frozen=True)
class Pair:
    """Two effects that the commands hardly tell apart."""

    one: str
    other: str
    commands: Mapping[str, Command]
    nested: bool = False


PAIRS = (
    Pair("force_sensor_delay", "second_relaxation", {"sine": _sine(3.0, 1.0, 2.0)}),
    Pair("coulomb_friction", "stribeck_friction", {"sine": _sine(25.0, 3.0, 4.0)}, nested=True),
    Pair("load_dependent_friction", "cable_friction", {"sine": _sine(10.0, 0.5, 4.0)}),
    Pair("permanent_set", "cable_slack", {"rise": _rise(12.0, 3.0)}),
    Pair("current_sensor_bias", "coulomb_friction", {"rise": _rise(20.0, 3.0)}),
    Pair("coulomb_friction", "quadratic_drag", {"ramps": _ramps(8.0, 1.0, 2.0)}),
    Pair("rate_independent_hysteresis", "second_relaxation", {"rise": _rise(8.0, 1.5)}),
    Pair("cam_angle_offset", "cable_slack", {"rise": _rise(10.0, 3.0)}),
)
STRENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Tried in this order until the first records leave a pair undecided."""
LIMITS = MachineLimits(
    np.radians(-45.0), np.radians(45.0), speed=8.0, acceleration=300.0,
    drive=(("current_sensor.reading", 12.0),),
)  # fmt: skip
"""Of the machine: its servo clips at 12 A, and turns to 45° in the records of a whole set."""
DURATION = 8.0
"""Of the proposed record in s."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """Both hypotheses, fitted to the same records."""

    bench: Bench
    hypotheses: tuple[Hypothesis, Hypothesis]

    @property
    def lead(self) -> float:
        """How far the first is ahead: difference of the sums of squares, in units of what is left over."""
        one, other = self.hypotheses
        total = 0.0
        for block in dict.fromkeys(b for b, _ in one.tallies):
            keys = [k for k in one.tallies if k[0] == block]
            best = min(self.hypotheses, key=lambda h: sum(h.tallies[k].squares for k in keys))
            rows = sum(best.tallies[k].rows for k in keys)
            size = max(sum(best.tallies[k].squares for k in keys) / rows, 1.0)
            colour = max(rows / max(sum(best.tallies[k].effective_size for k in keys), 1.0), 1.0)
            total += sum(other.tallies[k].squares - one.tallies[k].squares for k in keys) / (size * colour)
        return total + (other.prior - one.prior)


def fitted(declared: Assembly, records: RecordSet, pair: Pair) -> Fitted:
    """Fit both effects of a pair to all records."""
    all_fit = replace(records, records=tuple(replace(r, role="fit") for r in records.records))
    bench = Bench(all_fit, blocks_of(flatten(declared), records.signals))
    comparison = Comparison(bench, typical_sizes(declared, all_fit))
    base = comparison.base(declared)
    return Fitted(bench, (_best(comparison, base, pair.one), _best(comparison, base, pair.other)))


def _best(comparison: Comparison, base: Hypothesis, name: str) -> Hypothesis:
    fits = []
    for candidate in getattr(effects, name)(base.assembly):
        try:
            hypothesis = comparison.with_effect(base, candidate)
        except ConvergenceError:
            continue
        if hypothesis is not None:
            fits.append(hypothesis)
    return min(fits, key=lambda h: sum(t.squares for t in h.tallies.values()) + h.prior)


def case(pair: Pair, truth: str, actuator: str, seed: int) -> dict[str, Any]:
    """Return how one case went.

    Parameters
    ----------
    pair
        Of effects.
    truth
        The one that is hidden.
    actuator
        Name of the rig's actuator.
    seed
        Of the rig.
    """
    for strength in STRENGTHS:
        result = _at(pair, truth, actuator, seed, strength)
        if result["open"]:
            break
    return result


def _at(pair: Pair, truth: str, actuator: str, seed: int, strength: float) -> dict[str, Any]:
    made, hidden = ACTUATORS[actuator], {truth: strength}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_declaration(folder, made)
        tables = {
            name: make_record(made, hidden, seed, command, _FIRST + k)
            for k, (name, command) in enumerate(pair.commands.items())
        }
        write_records(folder, tables)
        declared = test_rig_deck(folder / "rig.toml", folder / "cam.csv")
        model = flatten(declared)
        before = fitted(declared, load_whole(folder, model), pair)
        ahead = _ahead(before, pair, truth)
        result: dict[str, Any] = {
            "pair": [pair.one, pair.other], "truth": truth, "actuator": actuator, "seed": seed,
            "strength": strength, "before": round(ahead, 2), "open": ahead < DECIDED,
        }  # fmt: skip
        if not result["open"]:
            return result
        begin = clock.perf_counter()
        proposed = next_experiment(before.hypotheses, before.bench, limits=LIMITS, duration=DURATION)
        seconds = clock.perf_counter() - begin
        result["planning_seconds"] = round(seconds, 2)
        if proposed is None:
            return {**result, "right": False, "proposed": None}
        command = command_of(proposed.command.time, proposed.command[proposed.signal])
        tables["proposed"] = make_record(made, hidden, seed, command, _FIRST + len(tables))
        write_records(folder, tables)
        after = fitted(declared, load_whole(folder, model), pair)
    return {
        **result,
        "proposed": proposed.motion,
        "expected": round(proposed.separations[0].standard_errors, 2),
        "after": round(_ahead(after, pair, truth), 2),
        "right": _ahead(after, pair, truth) >= DECIDED,
    }


def load_whole(folder: Path, model: Any) -> RecordSet:
    """Return the records of a folder, each whole."""
    records = [load_record_of(file, model) for file in sorted(folder.glob("*.csv")) if file.stem != "cam"]
    return replace(records[0], records=tuple(r for each in records for r in each.records))


def load_record_of(file: Path, model: Any) -> RecordSet:
    """Return one record."""
    from nlsdesign.bench.identification.records.measurement import load_record

    return load_record(file, model)


def _ahead(result: Fitted, pair: Pair, truth: str) -> float:
    return result.lead if truth == pair.one else -result.lead


def cases(seeds: Sequence[int]) -> Iterator[tuple[Pair, str, str, int]]:
    """Yield every pair with either truth; from case to case the actuator changes."""
    actuators = list(ACTUATORS)
    for seed in seeds:
        for k, pair in enumerate(PAIRS):
            for n, truth in enumerate((pair.one, pair.other)):
                if not (pair.nested and truth == pair.one):
                    yield pair, truth, actuators[(seed + k + n) % 2], seed


def main() -> None:
    """Run the cases and print the count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1-3")
    parser.add_argument("--only", default="", help="part of a pair's names")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    first, _, last = given.seeds.partition("-")
    results = []
    for pair, truth, actuator, seed in cases(range(int(first), int(last or first) + 1)):
        if given.only not in f"{pair.one}/{pair.other}":
            continue
        result = case(pair, truth, actuator, seed)
        results.append(result)
        print(json.dumps(result), flush=True)
        if given.out:
            with given.out.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(result) + "\n")
    tried = [r for r in results if r["open"]]
    right = sum(r["right"] for r in tried)
    print(f"{len(results)} cases, {len(tried)} not decided rightly before, {right} of these afterwards")


if __name__ == "__main__":
    main()
