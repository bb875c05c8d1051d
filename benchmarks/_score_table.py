"""The table of a score from its results: the diagnosis and its yardsticks side by side."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

Result = dict[str, Any]
Names = Callable[[Result], list[str] | None]


def diagnosis(result: Result) -> list[str] | None:
    """Return what the diagnosis named; ``unknown`` where it abstained, nothing on ``none``.

    Parameters
    ----------
    result
        Of one case; ``None`` is returned for one that failed.
    """
    if "error" in result:
        return None
    word = result["verdict"]
    return list(result["named"]) if word == "named" else [] if word == "none" else [word]


def yardstick(name: str) -> Names:
    """Return what picks the names that a yardstick gave.

    Parameters
    ----------
    name
        Of the yardstick.
    """

    def names(result: Result) -> list[str] | None:
        found = result.get("yardsticks", {}).get(name)
        return list(found) if isinstance(found, list) else None

    return names


def table(results: Sequence[Result]) -> str:
    """Return the table as Markdown.

    Parameters
    ----------
    results
        As read from the JSON lines.
    """
    known = list(dict.fromkeys(n for r in results for n in r.get("yardsticks", {})))
    methods: dict[str, Names] = {"diagnosis": diagnosis} | {n: yardstick(n) for n in known}
    failed = [r for r in results if "error" in r]
    counts = Counter(r["kind"] for r in results)
    lines = [
        f"{len(results)} cases: "
        + ", ".join(f"{counts[k]} {k}" for k in ("single", "pair", "clean", "outside"))
        + f"; {len(failed)} failed.",
        "",
        "| | " + " | ".join(methods) + " |",
        "|---|" + "---|" * len(methods),
    ]
    for title, rate in RATES.items():
        lines.append(f"| {title} | " + " | ".join(rate(results, names) for names in methods.values()) + " |")
    lines += ["", *_numbers(results), "", *_confusion(results), ""]
    lines += [f"Failed: `{r['case']}`: {r['error']}  " for r in failed]
    skipped = {t for r in results for t in r.get("yardsticks", {}).values() if isinstance(t, str)}
    lines += [f"Yardstick {text}.  " for text in sorted(skipped)]
    return "\n".join(lines).rstrip() + "\n"


def _share(hits: Iterable[bool]) -> str:
    given = list(hits)
    return f"{sum(given)}/{len(given)}" if given else "–"


def _of(results: Sequence[Result], kind: str, names: Names) -> list[tuple[Result, list[str]]]:
    pairs = [(r, names(r)) for r in results if r["kind"] == kind]
    return [(r, n) for r, n in pairs if n is not None]


def _first(results: Sequence[Result], names: Names) -> str:
    return _share(n[:1] == r["hidden"] for r, n in _of(results, "single", names))


def _exact(results: Sequence[Result], names: Names) -> str:
    return _share(n == r["hidden"] for r, n in _of(results, "single", names))


def _first_or_alias(results: Sequence[Result], names: Names) -> str:
    """A class counts if the hidden effect is in it; only the diagnosis gives classes."""
    if names is not diagnosis:
        return "–"
    return _share(
        bool(n) and r["hidden"][0] in {n[0], *(r["aliases"][0] if r["aliases"] else ())}
        for r, n in _of(results, "single", names)
    )


def _both(results: Sequence[Result], names: Names) -> str:
    return _share(set(r["hidden"]) == set(n) for r, n in _of(results, "pair", names))


def _one_of_two(results: Sequence[Result], names: Names) -> str:
    return _share(bool(set(r["hidden"]) & set(n[:1])) for r, n in _of(results, "pair", names))


def _invented(results: Sequence[Result], names: Names) -> str:
    return _share(bool(n) for _, n in _of(results, "clean", names))


def _abstained(results: Sequence[Result], names: Names) -> str:
    return _share("unknown" in n for _, n in _of(results, "outside", names))


def _unknown_inside(results: Sequence[Result], names: Names) -> str:
    return _share("unknown" in n for _, n in _of(results, "single", names))


RATES: dict[str, Callable[[Sequence[Result], Names], str]] = {
    "single: right first name": _first,
    "single: right name and no other": _exact,
    "single: in the class of the first name": _first_or_alias,
    "single: `unknown`": _unknown_inside,
    "pair: both and no other": _both,
    "pair: first name is one of the two": _one_of_two,
    "clean: something invented": _invented,
    "outside the catalogue: `unknown`": _abstained,
}


def _numbers(results: Sequence[Result]) -> list[str]:
    """Return gap closed, coverage and time of the diagnosis."""
    sound = [r for r in results if "error" not in r]
    closed = [r["closed"] for r in sound if r["kind"] in ("single", "pair") and r["hidden"]]
    named = [r["closed"] for r in sound if r["kind"] in ("single", "pair") and r["verdict"] == "named"]
    held = [held for r in sound for *_, held in r["covered"].values()]
    seconds = [r["seconds"] for r in sound]
    lines = []
    if closed:
        lines.append(
            f"Held-out gap closed, median over single and pair cases: {np.median(closed):.2f}; "
            f"at least 0.8 in {_share(c >= 0.8 for c in closed)}, "
            f"where something was named in {_share(c >= 0.8 for c in named)}.  "
        )
    if held:
        lines.append(f"True value inside the 95 % interval: {_share(held)}.  ")
    if seconds:
        worked = [r.get("cpu_seconds", r["seconds"]) for r in sound]
        lines.append(
            f"Seconds per diagnosis: median {np.median(seconds):.0f}, largest {max(seconds):.0f}; "
            f"of the processor: median {np.median(worked):.0f}, largest {max(worked):.0f}."
        )
    return lines


def _confusion(results: Sequence[Result]) -> list[str]:
    """Return the confusion matrix without its zeros: what was hidden, and what was named how often."""
    lines = ["| hidden | cases | named |", "|---|---|---|"]
    sound = [r for r in results if "error" not in r]
    for hidden in dict.fromkeys("+".join(r["hidden"]) or "(nothing)" for r in sound):
        mine = [r for r in sound if ("+".join(r["hidden"]) or "(nothing)") == hidden]
        said = Counter(" + ".join(diagnosis(r) or ["none"]) for r in mine)
        words = ", ".join(f"{name} ({n})" if len(mine) > 1 else name for name, n in said.most_common())
        lines.append(f"| {hidden} | {len(mine)} | {words} |")
    return lines
