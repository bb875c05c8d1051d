"""A statement, the calculation that tests it, and the verdict."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, NamedTuple

from ...foundation.errors import unknown_name
from .html import Html
from .sections import PagePosition, Section

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
        inner = [place.inner(i) for i, _ in enumerate(self.parts, start=1)]
        parts = [
            {"title": part.title, "template": part.template, "key": at.key, **part.content(at)}
            for at, part in zip(inner, self.parts, strict=True)
        ]
        return {
            "statement": self.statement, "verdict": self.verdict, "tone": OUTCOMES[self.verdict],
            "steps": steps, "why": self.why, "numbers": self.numbers, "parts": parts,
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
