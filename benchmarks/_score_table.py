"""The table of a score from its results: goals, tiers, methods side by side, reliability, confusion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks._score_cases import ACCEPTED, CATALOGUE, TIERS

Result = dict[str, Any]
Names = Callable[[Result], list[str] | None]
HIDING = ("single", "single half", "pair", "pair half", "triple", "triple half", "disturbed", "three records",
          "machine", "machine half")  # fmt: skip
SINGLE = ("single", "single half", "disturbed", "three records", "machine", "machine half")
BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Edges of the bins of probability in the reliability table."""


def diagnosis(result: Result) -> list[str] | None:
    """Return what the diagnosis named; its verdict where it named nothing, nothing on ``none``.

    Parameters
    ----------
    result
        Of one case; ``None`` is returned for one that failed.
    """
    if "error" in result:
        return None
    return list(result["named"]) or ([] if result["verdict"] == "none" else [result["verdict"]])


def yardstick(name: str) -> Names:
    """Return what picks the names that a yardstick gave.

    Parameters
    ----------
    name
        Of the yardstick.
    """

    def names(result: Result) -> list[str] | None:
        given = result.get("yardsticks", {}).get(name)
        return list(given) if isinstance(given, list) else None

    return names


def describes(name: str, hidden: Iterable[str]) -> bool:
    """Return whether a name truly describes something that was hidden.

    Parameters
    ----------
    name
        Of an effect of the catalogue.
    hidden
        Names of the rig.
    """
    return any(name == effect or name in ACCEPTED.get(effect, ()) for effect in hidden)


def exact(result: Result, names: list[str]) -> bool:
    """Return whether every hidden effect was named, and nothing else."""
    hidden = result["hidden"]
    named = all(any(describes(name, [effect]) for name in names) for effect in hidden)
    return named and len(names) == len(hidden) and all(describes(name, hidden) for name in names)


def first(result: Result, names: list[str]) -> bool:
    """Return whether the first name describes something that was hidden."""
    return bool(names) and describes(names[0], result["hidden"])


def in_class(result: Result, names: list[str]) -> bool:
    """Return whether the first name or one of its aliases describes something that was hidden."""
    aliases = result["aliases"][0] if result.get("aliases") else []
    return any(describes(name, result["hidden"]) for name in [*names[:1], *aliases])


def invented(result: Result, names: list[str]) -> bool:
    """Return whether something was named that is not there."""
    return any(
        name.partition("@")[0] in CATALOGUE and not describes(name, result["hidden"]) for name in names
    )


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after Wilson 1927.

    Parameters
    ----------
    hits, count
        So many of so many.
    """
    z, share = 1.96, hits / count
    centre, spread = (
        share + z * z / (2 * count),
        z * (share * (1 - share) / count + (z / (2 * count)) ** 2) ** 0.5,
    )
    scale = 1 + z * z / count
    return max(0.0, (centre - spread) / scale), min(1.0, (centre + spread) / scale)


def share(hits: Iterable[bool]) -> str:
    """Return hits, count, per cent and interval as a cell."""
    given = list(hits)
    if not given:
        return "–"
    low, high = wilson(sum(given), len(given))
    return (
        f"{sum(given)}/{len(given)} ({100 * sum(given) / len(given):.0f} %, {100 * low:.0f}–{100 * high:.0f})"
    )


def table(results: Sequence[Result]) -> str:
    """Return the table as Markdown.

    Parameters
    ----------
    results
        As read from the JSON lines.
    """
    failed = [r for r in results if "error" in r]
    sound = [r for r in results if "error" not in r]
    lines = [f"{len(results)} cases, {len(failed)} failed. Shares with their 95 % interval (Wilson).", ""]
    lines += [*_goals(results), "", *_tiers(results), "", *_reliability(sound), "", *_numbers(sound), ""]
    lines += [*_methods(results), *_confusion(sound), ""]
    lines += [f"Failed: `{r['case']}`: {r['error']}  " for r in failed]
    skipped = {t for r in results for t in r.get("yardsticks", {}).values() if isinstance(t, str)}
    lines += [f"Yardstick {text}.  " for text in sorted(skipped)]
    return "\n".join(lines).rstrip() + "\n"


def _pairs(results: Sequence[Result], tiers: Iterable[str], names: Names) -> list[tuple[Result, list[str]]]:
    wanted = set(tiers)
    # A diagnosis that failed is one that was wrong; a yardstick that was not asked is not counted.
    absent: list[str] | None = ["failed"] if names is diagnosis else None
    pairs = [(r, absent if (given := names(r)) is None else given) for r in results if r["tier"] in wanted]
    return [(r, n) for r, n in pairs if n is not None]


def _rate(
    results: Sequence[Result], tiers: Iterable[str], right: Callable[[Result, list[str]], bool], names: Names
) -> str:
    return share(right(r, n) for r, n in _pairs(results, tiers, names))


def _nothing(result: Result, names: list[str]) -> bool:
    return not invented(result, names)


def _is_none(result: Result, names: list[str]) -> bool:
    return not names


CLEAN = tuple(tier for tier in TIERS if "clean" in tier)
GOALS: tuple[tuple[str, str, tuple[str, ...], Callable[[Result, list[str]], bool]], ...] = (
    ("singles: first name right", "98 %", ("single",), first),
    ("singles at half strength: first name right", "96 %", ("single half",), first),
    ("singles: exactly the right set", "96 %", ("single",), exact),
    ("singles at half strength: exactly the right set", "94 %", ("single half",), exact),
    ("pairs: exactly the right set", "88 %", ("pair",), exact),
    ("pairs at half strength: exactly the right set", "86 %", ("pair half",), exact),
    ("triples: exactly the right set", "70 %", ("triple",), exact),
    ("triples at half strength: exactly the right set", "68 %", ("triple half",), exact),
    ("clean: nothing invented", "100 of 100", CLEAN, _nothing),
    ("clean: verdict `none`", "", CLEAN, _is_none),
    ("outside the catalogue: not named", "95 %", ("outside",), _nothing),
    ("a wrong declared number: no effect invented", "", ("wrong number",), _nothing),
    ("other machines: exactly the right set", "", ("machine", "machine half"), exact),
)


def _goals(results: Sequence[Result]) -> list[str]:
    lines = ["| | result | goal |", "|---|---|---|"]
    lines += [
        f"| {title} | {_rate(results, t, right, diagnosis)} | {goal} |" for title, goal, t, right in GOALS
    ]
    sound = [r for r in results if "error" not in r]
    lines.append(f"| 95 % intervals that hold the true value | {share(_coverage(sound))} | 90–98 % |")
    closed = [r["closed"] >= 0.8 for r in sound if r["tier"] in HIDING and r["named"] and _closable(r)]
    lines.append(
        f"| at least 80 % of the closable gap closed, where something was named | {share(closed)} | 95 % |"
    )
    if seconds := [r["cpu_seconds"] for r in results]:
        median, most = np.median(seconds), np.quantile(seconds, 0.95)
        lines.append(f"| seconds of one core: median; 95 % under | {median:.0f}; {most:.0f} | 10; 30 |")
    return lines


def _closable(result: Result) -> bool:
    """Return whether the refitted declared model is above the noise on held-out records at all."""
    return bool(result["before"] > 1.1)


def _coverage(results: Iterable[Result]) -> list[bool]:
    return [bool(row[3]) for r in results for row in r["covered"].values()]


def _tiers(results: Sequence[Result]) -> list[str]:
    lines = [
        "| tier | cases | first name right | or in its class | exactly the right set | something invented | "
        "verdicts | seconds, median and largest |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for tier in dict.fromkeys([*TIERS, *(r["tier"] for r in results)]):
        own = [r for r in results if r["tier"] == tier]
        if not own:
            continue
        verdicts = Counter(r.get("verdict", "failed") for r in own)
        seconds = [r["cpu_seconds"] for r in own]
        hiding = tier in HIDING
        cells = [
            tier,
            str(len(own)),
            _rate(own, [tier], first, diagnosis) if hiding else "–",
            _rate(own, [tier], in_class, diagnosis) if hiding else "–",
            _rate(own, [tier], exact, diagnosis) if hiding else "–",
            _rate(own, [tier], invented, diagnosis),
            ", ".join(f"{verdict} {n}" for verdict, n in verdicts.most_common()),
            f"{np.median(seconds):.0f}, {max(seconds):.0f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _reliability(results: Sequence[Result]) -> list[str]:
    """Return how often names of some probability were right."""
    stated = [
        (probability, describes(name, r["hidden"]))
        for r in results
        for name, probability in zip(r["named"], r.get("probabilities", ()), strict=False)
        if probability is not None
    ]
    if not stated:
        return ["No probabilities are stated."]
    lines = ["| probability stated | names | mean | right |", "|---|---|---|---|"]
    for low, high in pairwise(BINS):
        own = [(p, right) for p, right in stated if low <= p < high or p == high == BINS[-1]]
        if own:
            mean = np.mean([p for p, _ in own])
            lines.append(f"| {low:g} to {high:g} | {len(own)} | {mean:.3f} | {share(r for _, r in own)} |")
    brier = np.mean([(p - right) ** 2 for p, right in stated])
    mean, right = np.mean([p for p, _ in stated]), np.mean([r for _, r in stated])
    lines += ["", f"Mean probability {mean:.3f}, share right {right:.3f}, Brier score {brier:.3f}."]
    return lines


def _numbers(results: Sequence[Result]) -> list[str]:
    """Return gap closed and coverage number by number."""
    closed = [r["closed"] for r in results if r["tier"] in HIDING and _closable(r)]
    lines = []
    if closed:
        lines.append(
            f"Share of the closable held-out gap closed, where something is hidden: median "
            f"{np.median(closed):.2f}; "
            f"at least 0.8 in {share(c >= 0.8 for c in closed)}.  "
        )
    held: dict[str, list[bool]] = {}
    for r in results:
        for name, row in r["covered"].items():
            held.setdefault(name.partition(":")[0], []).append(bool(row[3]))
    if held:
        lines += ["", "| number | true value inside its 95 % interval |", "|---|---|"]
        lines += [f"| {name} | {share(hits)} |" for name, hits in sorted(held.items())]
    return lines


def _methods(results: Sequence[Result]) -> list[str]:
    """Return the diagnosis beside its yardsticks, if there are any."""
    known = list(dict.fromkeys(n for r in results for n in r.get("yardsticks", {})))
    if not known:
        return []
    methods: dict[str, Names] = {"diagnosis": diagnosis} | {n: yardstick(n) for n in known}
    rows: tuple[tuple[str, tuple[str, ...], Callable[[Result, list[str]], bool]], ...] = (
        ("one effect: right first name", SINGLE, first),
        ("one effect: right name and no other", SINGLE, exact),
        ("several: all and no other", ("pair", "pair half", "triple", "triple half"), exact),
        ("several: first name right", ("pair", "pair half", "triple", "triple half"), first),
        ("clean: something invented", CLEAN, invented),
        ("outside the catalogue: something named", ("outside",), invented),
    )
    lines = ["| | " + " | ".join(methods) + " |", "|---|" + "---|" * len(methods)]
    for title, tiers, right in rows:
        cells = [_rate(results, tiers, right, names) for names in methods.values()]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _confusion(results: Sequence[Result]) -> list[str]:
    """Return the confusion matrix without its zeros: what was hidden, and what was named how often."""
    lines = ["| hidden | cases | named |", "|---|---|---|"]

    def hidden_in(result: Result) -> str:
        return "+".join(result["hidden"]) or f"(nothing: {result['tier']})"

    for hidden in sorted({hidden_in(r) for r in results}):
        own = [r for r in results if hidden_in(r) == hidden]
        named = Counter(" + ".join(diagnosis(r) or ["none"]) for r in own)
        cells = ", ".join(f"{name} ({n})" if len(own) > 1 else name for name, n in named.most_common())
        lines.append(f"| {hidden} | {len(own)} | {cells} |")
    return lines
