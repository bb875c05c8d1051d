"""What the house may hold: figures that fall as they like, and rise only with a word that says what for.

``tests/budget.toml`` has the lines of code of each room, the numbers of places there that break a bound,
figures of the whole, and the stays of journeys. Lines of code of a room, and figures of the whole, may rise
where the table of ``CHANGELOG.md`` says what for: the newest row of a room, or of ``the whole: classes``,
bounds its budget. The other figures are not raised.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.house.counts import counted
from tests.house.modules import Module, exported_by, modules
from tests.house.repetitions import pairs, sources
from tests.house.walks import Names, stays

FILE = Path("tests") / "budget.toml"
WHOLE = "the whole"

Figures = Mapping[str, Mapping[str, int]]

_OF_THE_WHOLE = ("files", "lines", "code", "classes", "functions", "exported", "once")
_ARGUED = ("files", "lines", "classes", "functions", "exported")
_MAY_RISE = ("code", *_ARGUED)
_ROW = re.compile(r"^\| ([\w :-]+) \| ([\d,]+) \| [^|]*\w[^|]* \|$", flags=re.MULTILINE)
_ADVICE = {
    "code": "shorten it, or raise it and say in the table 'Budget' of CHANGELOG.md what for",
    "stays": "python -m tests.house --walks TITLE lists the steps",
}


def read(root: Path) -> dict[str, Any]:
    """Return the budget of a checkout; that of this one where it has none yet."""
    file = root / FILE
    file = file if file.is_file() else Path(__file__).parents[2] / FILE
    return tomllib.loads(file.read_text(encoding="utf-8"))


def measured(root: Path, budget: Mapping[str, Any]) -> dict[str, dict[str, int]]:
    """Return the figures of today."""
    inside = modules(root / budget["package"])
    beside = [replace(module, room=name) for name in budget["beside"] for module in modules(root / name)]
    whole, names = counted(inside, exported_by(inside)), Names(inside)
    figures = {WHOLE: {name: whole[name] for name in _OF_THE_WHOLE} | {"twice": len(pairs(sources(root)))}}
    figures |= rooms([*inside, *beside], budget["found_by_being_there"])
    for walk in budget["walk"]:
        steps = names.journey(walk["start"], walk["parameter"], walk["through"])
        figures[walk["title"]] = {"stays": len(stays(steps))}
    return figures


def rooms(every: Sequence[Module], found_by_being_there: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return lines of code of each room, and how many places there are outgrown, thin or small."""
    figures = {}
    for room in sorted({module.room for module in every}):
        chosen = [module for module in every if module.room == room]
        small = [module for module in chosen if module.is_small]
        figures[room] = {
            "code": sum(len(module.lines.code) for module in chosen),
            "outgrown": sum(len(module.outgrown) for module in chosen),
            "thin": sum(helper.thin for module in chosen for helper in module.helpers),
            "small": sum(not module.path.startswith(tuple(found_by_being_there)) for module in small),
        }
    return figures


def exceeded(found: Figures, budget: Figures) -> Iterator[str]:
    """Say which figures are above their budget, and what to do."""
    for title, figures in found.items():
        for name, figure in figures.items():
            most = budget.get(title, {}).get(name, 0)
            if figure > most:
                advice = _ADVICE.get(name, "python -m tests.house --room NAME lists the places")
                yield f"{title}: {name} {figure:,}, budget {most:,}; {advice}"


def unargued(budget: Figures, changelog: str) -> Iterator[str]:
    """Say which figures that may rise are above their newest row in the changelog, or have no row."""
    allowed: dict[str, int] = {}
    for title, figure in _ROW.findall(changelog):
        allowed.setdefault(title, int(figure.replace(",", "")))
    for title, figures in budget.items():
        if figures.get("code", 0) > allowed.get(title, 0):
            yield f"{title}: {figures['code']:,} lines of code stand in no row of the table 'Budget'"
    for name in _ARGUED:
        figure = budget.get(WHOLE, {}).get(name, 0)
        if figure > allowed.get(f"{WHOLE}: {name}", 0):
            yield f"{WHOLE}: {name} {figure:,} stand in no row of the table 'Budget'"


def lowered(found: Figures, budget: Figures) -> dict[str, dict[str, int]]:
    """Return the figures of today, but the budget's where it is lower and no row can argue for more."""
    return {
        title: {
            k: v if k in _MAY_RISE else min(v, budget.get(title, {}).get(k, v)) for k, v in figures.items()
        }
        for title, figures in found.items()
    }


def written(figures: Figures, text: str) -> str:
    """Return the text of a budget with other figures; what stands above them stays as it is."""
    rows = (
        f'"{title}" = {{ {", ".join(f"{k} = {v}" for k, v in row.items())} }}'
        for title, row in figures.items()
    )
    return text.partition("[figures]")[0] + "\n".join(["[figures]", *rows, ""])
