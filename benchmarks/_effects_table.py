"""Tables of methods side by side on a data set of hidden effects, with the definitions of the score."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks._score_cases import KIND_TIERS
from benchmarks._score_kinds import brier
from benchmarks._score_table import Result, diagnosis, exact, invented, share

_TITLES = dict(
    zip(
        KIND_TIERS,
        ("clean: nothing named", "singles", "singles, half strength", "pairs", "not listed: nothing named"),
        strict=True,
    )
)
_SILENT = (KIND_TIERS[0], KIND_TIERS[-1])


def right(result: Result) -> bool:
    """Return whether all that is hidden was named and nothing else; where no name is right, whether none was.

    Parameters
    ----------
    result
        Of one case.
    """
    if "error" in result:
        return False
    return not result["named"] if result["tier"] in _SILENT else exact(result, result["named"])


def page(scored: Mapping[str, Sequence[Result]], command: str) -> str:
    """Return the tables: methods, kinds of machines, cases.

    Parameters
    ----------
    scored
        Results by the name of the method, all of one data set.
    command
        That wrote the data set.
    """
    first = next(iter(scored.values()))
    lines = [f"{len(first)} cases, written by `{command}`.", ""]
    lines += [*_by_method(scored), "", *_by_kind(scored), "", *_by_case(scored)]
    return "\n".join(lines) + "\n"


def _by_method(scored: Mapping[str, Sequence[Result]]) -> list[str]:
    tiers = [t for t in KIND_TIERS if any(r["tier"] == t for r in next(iter(scored.values())))]
    heads = [
        "method", *(_TITLES[t] for t in tiers), "a wrong name in", "Brier score", "95 % intervals", "failed",
        "seconds, median and largest",
    ]  # fmt: skip
    lines = _head(heads)
    for method, results in scored.items():
        sound = [r for r in results if "error" not in r]
        seconds = [r["cpu_seconds"] for r in results if np.isfinite(r["cpu_seconds"])]
        cells = [
            method,
            *(share(right(r) for r in results if r["tier"] == tier) for tier in tiers),
            f"{sum(invented(r, r['named']) for r in sound)} of {len(sound)}",
            brier(sound),
            share(bool(row[3]) for r in sound for row in r["covered"].values()),
            f"{len(results) - len(sound)} of {len(results)}",
            f"{np.median(seconds):.1f}, {max(seconds):.0f}" if seconds else "–",
        ]
        lines.append(_row(cells))
    return lines


def _by_kind(scored: Mapping[str, Sequence[Result]]) -> list[str]:
    lines = _head(["right, by kind", *scored])
    for kind in dict.fromkeys(r["machine"] for r in next(iter(scored.values()))):
        own = [[right(r) for r in results if r["machine"] == kind] for results in scored.values()]
        lines.append(_row([kind, *(f"{sum(each)} of {len(each)}" for each in own)]))
    return lines


def _by_case(scored: Mapping[str, Sequence[Result]]) -> list[str]:
    """Return what each method said of each case, in bold where that is right."""
    lines = _head(["kind", "hidden", "strength", *scored])
    columns = list(scored.values())
    order = sorted(range(len(columns[0])), key=lambda i: _key(columns[0][i]))
    for i in order:
        label = columns[0][i]
        hidden = " + ".join(label["hidden"]) or "nothing"
        lines.append(
            _row([label["machine"], hidden, f"{label['strength']:g}", *(_said(c[i]) for c in columns)])
        )
    return lines


def _key(result: Result) -> tuple[str, int, list[str], int]:
    return result["machine"], KIND_TIERS.index(result["tier"]), result["hidden"], result["seed"]


def _said(result: Result) -> str:
    names = diagnosis(result)
    text = "failed" if names is None else " + ".join(names) or "none"
    return f"**{text}**" if right(result) else text


def _head(cells: Sequence[str]) -> list[str]:
    return [_row(cells), "|---" * len(cells) + "|"]


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
