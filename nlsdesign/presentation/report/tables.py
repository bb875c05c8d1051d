"""Tables that reports share: numbers of a deck, points of a sweep, paper and model, steps, equations."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple
from urllib.parse import quote

from ...foundation.errors import unknown_name, visible
from ...foundation.quantity import Quantity, sources, typeset_number, typeset_unit
from ..figures.style import compact
from .sections import Html, PagePosition, Section, TableSection, inner_sections

if TYPE_CHECKING:
    from ...model.symbolic_view import Equations

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
            q.spread_text,
            q.source,
        )
        for name, q in numbers.items()
    )
    share = sources(numbers)["assumed"]
    caption = (
        f"{len(numbers)} numbers, of which {100 * share:.0f} % are only assumed (marked). "
        "The spread is one standard deviation: relative, of the logarithm; with a unit, of the number itself."
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
            "–" if row.paper is None else typeset_number(row.paper),
            typeset_number(row.here),
            typeset_unit(row.unit),
            row.remark,
        )
        for row in rows
    )
    return TableSection(title, ("", "paper", "here", "unit", "remark"), cells, caption=caption)


@dataclass(frozen=True, eq=False)
class PointTableSection(Section):
    """A table of points, each with its deck, and what the page shows of a point chosen in a figure."""

    table: TableSection  # one row per point of points, without the number of the point
    points: Sequence[int]  # numbers of the points in the table
    _: KW_ONLY
    # decks: path of the deck of a point, from the folder of the page, by number; for points beyond the table
    # too
    decks: Mapping[int, str] = field(default_factory=dict)
    # rows: for each point that a figure shows its values, by number: status, reason, values
    rows: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    columns: Sequence[tuple[str, str]] = ()  # name and unit of each of the values
    command: str = ""  # what writes the deck of a point that has none yet; POINT stands for its number
    elsewhere: str = ""  # where the rows of points stand that are not on the page
    template: ClassVar[str] = "points.html"
    script: ClassVar[str] = "points.js"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the cells, the links, and the rows as JSON that no name can break out of."""
        inner = dict(self.table.content(place))
        for row, number in zip(inner["rows"], self.points, strict=True):
            row["point"] = number
            row["deck"] = quote(self.decks[number]) if number in self.decks else ""
        content = {
            "columns": [[visible(name), unit] for name, unit in self.columns],
            "rows": {str(number): row for number, row in self.rows.items()},
            "decks": {str(number): quote(path) for number, path in self.decks.items()},
            "command": visible(self.command),
            "elsewhere": self.elsewhere,
        }
        text = json.dumps(content, separators=(",", ":"))
        for letter in "<>&":  # they stand in texts only, where JSON may write any letter by its number
            text = text.replace(letter, f"\\u{ord(letter):04x}")
        return {**inner, "data": Html(text), "key": place.key, "elsewhere": self.elsewhere}


OUTCOMES = {
    "holds": "none",
    "does not hold": "unknown",
    "cannot be decided": "named",
    "contradicts the figures": "data_suspect",
}
"""Possible verdicts on a statement, each with the style of its card."""

# Symbols of a calculation are letters with an index, a star or a rate; those of a model are full names.
_RATE = re.compile(r"<mi>d([^</]{1,6})/d([^</]{1,2})</mi>")
_INDEX = re.compile(r"<mi>([^<_]{1,2})_([^<_*]{1,4})</mi>")
_STAR = re.compile(r"<mi>([^<*]{1,2})\*</mi>")


class CalculationStep(NamedTuple):
    """One line of a calculation.

    Parameters
    ----------
    words
        What is done.
    formula
        SymPy equation or expression; ``None`` without one.
    latex
        The same formula as LaTeX.
    """

    words: str
    formula: Any = None
    latex: str = ""


@dataclass(frozen=True, eq=False)
class CalculationSection(Section):
    """A statement with its calculation, its evidence and a verdict.

    Parameters
    ----------
    statement
        The tested statement and its source.
    verdict
        One of ``OUTCOMES``.
    steps
        The calculation, step by step.
    why
        What follows from it.
    numbers
        Results as text by name.
    parts
        Sections with figures or tables.

    Raises
    ------
    UnknownNameError
        If there is no such verdict.
    """

    statement: str
    verdict: str
    _: KW_ONLY
    steps: tuple[CalculationStep, ...]
    why: str = ""
    numbers: Mapping[str, str]
    parts: tuple[Section, ...] = ()
    template: ClassVar[str] = "calculation.html"

    def __post_init__(self) -> None:
        if self.verdict not in OUTCOMES:
            raise unknown_name("verdict", self.verdict, OUTCOMES)

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return texts, formulas and evidence."""
        steps = [
            {"words": s.words, "formula": "" if s.formula is None else typeset(s.formula), "latex": s.latex}
            for s in self.steps
        ]
        return {
            "statement": self.statement, "verdict": self.verdict, "tone": OUTCOMES[self.verdict],
            "steps": steps, "why": self.why, "numbers": self.numbers,
            "parts": inner_sections(self.parts, place),
        }  # fmt: skip


def typeset(expression: Any) -> Html:
    """Return a SymPy expression as MathML; ``F_M``, ``F*`` and ``dF/dt`` get index, superscript and fraction.

    Examples
    --------
    >>> import sympy
    >>> typeset(sympy.Symbol("F_M"))
    "<math displaystyle='true'><mrow><msub><mi>F</mi><mi>M</mi></msub></mrow></math>"
    """
    from .mathml import formula  # here, because it loads SymPy

    rate = r"<mfrac><mrow><mi>d</mi><mi>\1</mi></mrow><mrow><mi>d</mi><mi>\2</mi></mrow></mfrac>"
    text = _RATE.sub(rate, formula(expression))
    text = _STAR.sub(r"<msup><mi>\1</mi><mo>*</mo></msup>", text)
    return Html(_INDEX.sub(r"<msub><mi>\1</mi><mi>\2</mi></msub>", text))


@dataclass(frozen=True, eq=False)
class EquationsSection(Section):
    """The equations of a flat model.

    Parameters
    ----------
    equations
        From :func:`nlsdesign.model.flat.equations`.
    caption
        What they describe.
    folded
        Whether they are closed until the reader opens them.
    """

    equations: Equations
    caption: str = ""
    folded: bool = False
    template: ClassVar[str] = "equations.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the rows of the derivatives and of the definitions."""
        from .mathml import equation_rows  # loads SymPy

        states, signals = equation_rows(self.equations)
        return {"states": states, "signals": signals, "caption": self.caption, "folded": self.folded}
