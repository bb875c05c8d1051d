"""Tables that reports share: numbers of a deck, and the paper against the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...foundation.quantity import Quantity, sources, typeset_unit
from ...simulation import Trace
from ..figures.number_text import compact, significant
from .sections import TableSection

_LONGEST_ROW = 8


def numbers_table(title: str, numbers: Mapping[str, Quantity], *, folded: bool = False) -> TableSection:
    """Return the table of numbers with unit, spread and source; those that are only assumed are highlighted.

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
        (
            name,
            value_in_words(q),
            typeset_unit(q.unit),
            f"± {100 * q.spread:g} %" if q.spread else "",
            q.source,
        )
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


def value_in_words(q: Quantity) -> str:
    """Return a value without its unit; of a long row how many, the least and the largest."""
    shown = q.shown
    if not isinstance(shown, tuple):
        return compact(shown, 6)
    if len(shown) < _LONGEST_ROW:
        return ", ".join(compact(item, 6) for item in shown)
    return f"{len(shown)} numbers from {compact(min(shown), 6)} to {compact(max(shown), 6)}"


@dataclass(frozen=True)
class PublishedNumber:
    """A published number beside the same number computed here.

    Parameters
    ----------
    what
        Name of the number.
    paper
        As published; ``None`` if it is not published.
    here
        As computed by this project.
    unit
        Of both.
    remark
        Remark on the comparison.
    """

    what: str
    paper: float | None
    here: float
    unit: str
    remark: str = ""


def range_table(title: str, traces: Mapping[str, Trace]) -> TableSection:
    """Return the table of laws used beyond their stated range; the caption tells if there are none."""
    rows = tuple(
        (label, w.name, f"{w.minimum:g} to {w.maximum:g}", typeset_unit(w.unit), compact(w.furthest, 4),
         compact(w.time, 4))
        for label, trace in traces.items()
        for w in trace.warnings
    )  # fmt: skip
    columns = ("result", "signal", "range", "unit", "reaches", "first at s")
    caption = (
        "Laws that were used beyond their stated range."
        if rows
        else "Every law was used within its stated range."
    )
    return TableSection(title, columns, rows, caption=caption, marked=frozenset(range(len(rows))))


def comparison_table(title: str, rows: Sequence[PublishedNumber], *, caption: str = "") -> TableSection:
    """Return a table of published numbers beside those computed here.

    Parameters
    ----------
    title
        Heading.
    rows
        In reading order.
    caption
        What is compared.
    """
    cells = tuple(
        (
            row.what,
            "–" if row.paper is None else significant(row.paper),
            significant(row.here),
            typeset_unit(row.unit),
            row.remark,
        )
        for row in rows
    )
    return TableSection(title, ("", "paper", "here", "unit", "remark"), cells, caption=caption)
