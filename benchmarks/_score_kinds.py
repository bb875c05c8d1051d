"""Cases of the score on kinds of machines beside the cam actuator, and their table, kind by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks._score_cases import CATALOGUE, HALF, KIND_TIERS, NOISES, PAIRS, STRONG, Case, known_effects
from benchmarks._score_table import Result, describes, diagnosis, exact, share
from tests.rig import ACTUATORS, OUTSIDE_ANY_CATALOGUE, specimens
from tests.rig.kind_cases import ALL_KINDS, CASCADED, names_of
from tests.rig.kinds import KINDS

_AT_LOAD = ("load", "load_encoder", "load_bearing", "arm")
_FINE = ("torque_ripple", "angle_sensor_delay", "angle_sensor_bias")
_READ = ("plain", "coarse", "coloured")


def kind_cases(seeds: Iterable[int], kinds: Sequence[str], *, cascaded: bool = False) -> list[Case]:
    """Return the cases of some seeds: of each kind one clean, three singles, a pair, one not listed.

    What is hidden goes round from seed to seed, as do coarse counts, coloured noise and, for clean machines,
    slow logs.

    Parameters
    ----------
    seeds
        One set of cases each.
    kinds
        Some of :data:`tests.rig.kind_cases.ALL_KINDS`.
    cascaded
        Whether all are machines under a robot's cascade that goes from point to point, with a plain log.
    """
    cases = [case for seed in seeds for kind in kinds for case in _of_kind(kind, seed)]
    return [replace(c, noise=CASCADED) for c in cases if c.machine in KINDS] if cascaded else cases


def all_kinds() -> list[str]:
    """Return the kinds of machines that are counted."""
    return ["cam", *ALL_KINDS]


def _of_kind(name: str, seed: int) -> Iterator[Case]:
    if name == "cam":
        yield from _of_cam(seed)
        return
    effects = specimens.EFFECTS if name == "specimen" else KINDS[name].effects
    pairs = specimens.PAIRS if name == "specimen" else KINDS[name].pairs
    others = specimens.NOT_LISTED if name == "specimen" else KINDS[name].not_listed

    def read(number: int, *hidden: str) -> str:
        # A coarse encoder does not see the way that a ripple of the motor makes behind its gear.
        condition = _READ[(seed + number) % len(_READ)]
        return "plain" if condition == "coarse" and set(hidden) & set(_FINE) else condition

    def hiding(tier: str, strength: float, number: int, *hidden: str) -> Case:
        return Case(tier, name, hidden, strength, seed, read(number, *hidden))

    clean, single, half, pair, other = KIND_TIERS
    yield Case(clean, name, (), 0.0, seed, (*_READ, "slow", "averaged")[seed % 5])
    for i in range(2):
        yield hiding(single, STRONG, i, effects[(2 * seed + i) % len(effects)])
    yield hiding(half, HALF, 2, effects[(seed + 3) % len(effects)])
    yield hiding(pair, STRONG, 3, *pairs[seed % len(pairs)])
    yield hiding(other, STRONG, 4, others[seed % len(others)])


def _of_cam(seed: int) -> Iterator[Case]:
    """Yield the same tiers on the cam actuators, under the noises of their own score."""
    known, noises, actuators = known_effects(), list(NOISES), list(ACTUATORS)
    others = [effect for effect in OUTSIDE_ANY_CATALOGUE if effect not in CATALOGUE]
    hidden = (
        (), (known[(2 * seed) % len(known)],), (known[(2 * seed + 1) % len(known)],),
        (known[(seed + 3) % len(known)],), PAIRS[seed % len(PAIRS)], (others[seed % len(others)],),
    )  # fmt: skip
    clean, single, half, pair, other = KIND_TIERS
    for i, (tier, effects) in enumerate(zip((clean, single, single, half, pair, other), hidden, strict=True)):
        strength = 0.0 if tier == clean else HALF if tier == half else STRONG
        actuator, noise = actuators[(seed + i) % len(actuators)], noises[(seed + i) % len(noises)]
        yield Case(tier, actuator, effects, strength, seed, noise)


def kind_of(machine: str) -> str:
    """Return the kind of a machine: all actuators with a cam are one.

    Parameters
    ----------
    machine
        Of a case.
    """
    return "cam" if machine in ACTUATORS else machine


def named_with_place(case: Case, effect: str, location: str) -> str:
    """Return the name of an effect, marked where it was found behind the spring of a machine with two bodies.

    Parameters
    ----------
    case
        Whose deck it is.
    effect, location
        As a verdict states them.
    """
    if case.machine not in KINDS or KINDS[case.machine].sides == 1:
        return effect
    names = names_of(case.machine, case.seed)
    return f"{effect}@load" if location.partition(".")[0] in {names[role] for role in _AT_LOAD} else effect


COLUMNS = (
    "kind", "clean: nothing named", "singles", "singles, half strength", "pairs", "not listed: nothing named",
    "Brier score", "95 % intervals", "failed", "seconds, median and largest",
)  # fmt: skip


def kind_table(results: Sequence[Result]) -> list[str]:
    """Return the table by kind, machines of MuJoCo apart, and what was named for what.

    Parameters
    ----------
    results
        As read from the JSON lines.
    """
    own = [r for r in results if r["tier"] in KIND_TIERS]
    if not own:
        return []
    apart = [r for r in own if r["machine"].startswith("mujoco")]
    lines = _rows("Machines of `tests/rig`", [r for r in own if r not in apart])
    return [*lines, "", *_rows("Machines in MuJoCo", apart), "", *_misses(own)]


def _rows(title: str, results: Sequence[Result]) -> list[str]:
    lines = [f"**{title}**", "", "| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    names = dict.fromkeys(kind_of(r["machine"]) for r in results)
    lines += [_row(name, [r for r in results if kind_of(r["machine"]) == name]) for name in names]
    return [*lines, _row("all", results)] if len(names) > 1 else lines


def _row(name: str, results: Sequence[Result]) -> str:
    def of(tier: str) -> list[Result]:
        return [r for r in results if r["tier"] == tier]

    clean, single, half, pair, other = KIND_TIERS
    sound = [r for r in results if "error" not in r]
    held = [bool(row[3]) for r in sound for row in r["covered"].values()]
    seconds = [r["cpu_seconds"] for r in results]
    cells = [
        name,
        share("error" not in r and not r["named"] for r in of(clean)),
        *(
            share("error" not in r and exact(r, r["named"]) for r in of(tier))
            for tier in (single, half, pair)
        ),
        share("error" not in r and not r["named"] for r in of(other)),
        brier(sound),
        share(held),
        f"{len(results) - len(sound)} of {len(results)}",
        f"{np.median(seconds):.0f}, {max(seconds):.0f}" if seconds else "–",
    ]
    return "| " + " | ".join(cells) + " |"


def brier(results: Iterable[Result]) -> str:
    """Return the Brier score of the probabilities that were stated, and of how many.

    Parameters
    ----------
    results
        Of cases that did not fail.
    """
    errors = [
        (probability - describes(name, r["hidden"])) ** 2
        for r in results
        for name, probability in zip(r["named"], r["probabilities"], strict=True)
        if probability is not None
    ]
    return f"{np.mean(errors):.3f} of {len(errors)}" if errors else "–"


def _misses(results: Sequence[Result]) -> list[str]:
    """Return what was answered where it was not right, most frequent first."""
    lines = ["| kind | hidden | answered instead | cases |", "|---|---|---|---|"]
    counts: Counter[tuple[str, str, str]] = Counter()
    for r in results:
        hidden = list(r["hidden"])
        listed = r["tier"] not in (KIND_TIERS[0], KIND_TIERS[-1])
        answer = diagnosis(r)
        right = answer is not None and (exact(r, r["named"]) if listed else not r["named"])
        if not right:
            said = "failed: " + r["error"][:60] if answer is None else " + ".join(answer) or "none"
            counts[(kind_of(r["machine"]), " + ".join(hidden) or "(nothing)", said.replace("|", "/"))] += 1
    rows = sorted(counts.items(), key=lambda row: (-row[1], row[0]))
    return [*lines, *(f"| {k} | {h} | {s} | {n} |" for (k, h, s), n in rows)]


def codes(results: Iterable[Result]) -> Mapping[str, int]:
    """Return how many cases were counted with which code.

    Parameters
    ----------
    results
        As read from the JSON lines.
    """
    return Counter(str(r.get("code", "not known")) for r in results)
