"""Tables that reports share: numbers of a deck, and the paper against the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..figures.numbers import compact, shown_unit, significant
from ..quantity import Quantity, sources
from ..simulation import Trace
from .sections import TableSection

_LONGEST_ROW = 8


def numbers_table(title: str, numbers: Mapping[str, Quantity], *, folded: bool = False) -> TableSection:
    """Return the table of numbers with unit, spread and source; those that are only assumed stand out.

    Parameters
    ----------
    title
        Heading.
    numbers
        By full name, for instance ``Assembly.quantities()``.
    folded
        Whether it is closed until the reader opens it.
    """
    rows = tuple(
        (name, _value(q), shown_unit(q.unit), f"± {100 * q.spread:g} %" if q.spread else "", q.source)
        for name, q in numbers.items()
    )
    share = sources(numbers)["assumed"]
    caption = (
        f"{len(numbers)} numbers, of which {100 * share:.0f} % are only assumed (marked). "
        "The spread is one-sided and relative."
    )
    marked = frozenset(i for i, q in enumerate(numbers.values()) if q.assumed)
    columns = ("name", "value", "unit", "spread", "source")
    return TableSection(title, columns, rows, caption=caption, marked=marked, folded=folded)


def _value(q: Quantity) -> str:
    shown = q.shown
    if not isinstance(shown, tuple):
        return compact(shown, 6)
    if len(shown) < _LONGEST_ROW:
        return ", ".join(compact(item, 6) for item in shown)
    return f"{len(shown)} numbers from {compact(shown[0], 6)} to {compact(shown[-1], 6)}"


@dataclass(frozen=True)
class PublishedNumber:
    """A number of the paper beside the same number found here.

    Parameters
    ----------
    what
        Name of the number.
    paper
        As published; None where the paper has none.
    here
        As found by this project.
    unit
        Of both.
    remark
        How they are to be read together.
    """

    what: str
    paper: float | None
    here: float
    unit: str
    remark: str = ""


def range_table(title: str, traces: Mapping[str, Trace]) -> TableSection:
    """Return the table of laws that were used beyond their stated range; it says so if there is none.

    Parameters
    ----------
    title
        Heading.
    traces
        Results by their label in the report.
    """
    rows = tuple(
        (label, w.name, f"{w.minimum:g} to {w.maximum:g}", shown_unit(w.unit), compact(w.furthest, 4),
         compact(w.time, 4))
        for label, trace in traces.items()
        for w in trace.warnings
    )  # fmt: skip
    columns = ("result", "signal", "range", "unit", "reaches", "first at s")
    caption = (
        "Laws that were used beyond the range in which they are stated to hold."
        if rows
        else ("Every law was used within the range in which it is stated to hold.")
    )
    return TableSection(title, columns, rows, caption=caption, marked=frozenset(range(len(rows))))


def comparison_table(title: str, rows: Sequence[PublishedNumber], *, caption: str = "") -> TableSection:
    """Return a table of published numbers beside those found here.

    Parameters
    ----------
    title
        Heading.
    rows
        In the order of reading.
    caption
        What is compared.
    """
    cells = tuple(
        (
            row.what,
            "–" if row.paper is None else significant(row.paper),
            significant(row.here),
            shown_unit(row.unit),
            row.remark,
        )
        for row in rows
    )
    return TableSection(title, ("", "paper", "here", "unit", "remark"), cells, caption=caption)
