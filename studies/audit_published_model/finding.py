"""What the audit finds on one statement: calculation, numbers and verdict; and all statements together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field

import sympy as sp
from matplotlib.figure import Figure

import nlsdesign as nls
from nlsdesign.presentation.report import (
    OUTCOMES,
    CalculationSection,
    CalculationStep,
    FigureSection,
    Section,
)

HOLDS, FAILS = "holds", "does not hold"
OPEN, AGAINST_FIGURES = "cannot be decided", "contradicts the figures"

PAPER, NOTES = "paper", "design notes"

LATEX = {
    "δ": r"\delta", "η": r"\eta", "θ": r"\theta", "ω": r"\omega", "β": r"\beta", "τ": r"\tau",
    "ψ": r"\psi", "ρ": r"\rho", "dδ/dt": r"\dot\delta", "dF/dt": r"\dot F", "dF_M/dt": r"\dot F_M",
    "F*": "F^*", "dF*/dt": r"\dot F^*", "K": r"\sum_i k_i^* H_i", "K_off": r"\sum_i k_i^* (1 - H_i)",
    "D": r"\sum_i k_i^* H_i\delta_i", "dω/dt": r"\dot\omega", "k_T": "k_T",
    "dδ/dθ": r"\frac{d\delta}{d\theta}", "dh/dθ": "h'", "Δt": r"\Delta t",
    "dτ/dθ": r"\frac{d\tau}{d\theta}", "ΔK": r"\Delta K", "Δh'": r"\Delta h'", "U*": "U^*",
    "dE/dt": r"\dot E",
}  # fmt: skip
"""LaTeX of the symbols whose name is not LaTeX already."""


@dataclass(frozen=True, eq=False)
class Finding:
    """One statement, tested.

    Parameters
    ----------
    key
        Short identifier; the number before the dot is that of the list of the design notes.
    stated_by
        The paper or the project's design notes.
    statement, verdict, why
        What is tested, the outcome, and the reason in words.
    steps
        The calculation.
    numbers
        Value and unit by name; the names are those of ``expected.toml``.
    figures
        Figures with their captions, by title.
    """

    key: str
    stated_by: str
    _: KW_ONLY
    statement: str
    verdict: str
    why: str
    steps: tuple[CalculationStep, ...] = ()
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    figures: Mapping[str, tuple[Figure, str]] = field(default_factory=dict)

    def section(self) -> Section:
        """Return the finding as a section of the page."""
        shown = {_label(n, u): f"{nls.figures.compact(v, 4)} {u}" for n, (v, u) in self.numbers.items()}
        parts = tuple(FigureSection(t, f, caption=c) for t, (f, c) in self.figures.items())
        return CalculationSection(
            f"{self.key} {_title(self.statement)}",
            f"{self.statement} (Stated by: {self.stated_by}.)",
            self.verdict,
            steps=self.steps,
            why=self.why,
            numbers={name: number.removesuffix(" 1") for name, number in shown.items()},
            parts=parts,
        )

    def record(self) -> dict[str, object]:
        """Return the finding as plain data."""
        return {
            "key": self.key, "stated_by": self.stated_by, "statement": self.statement,
            "verdict": self.verdict, "why": self.why,
            "numbers": {n: {"value": v, "unit": u} for n, (v, u) in self.numbers.items()},
            "calculation": [
                {"words": s.words, "formula": "" if s.formula is None else str(s.formula), "latex": s.latex}
                for s in self.steps
            ],
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Results:
    """All findings by chapter, in the order of reading."""

    chapters: Mapping[str, tuple[Finding, ...]]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings of all chapters."""
        return tuple(finding for chapter in self.chapters.values() for finding in chapter)

    @property
    def verdicts(self) -> dict[str, int]:
        """How many statements got each verdict."""
        return {verdict: sum(f.verdict == verdict for f in self.findings) for verdict in OUTCOMES}

    @property
    def numbers(self) -> dict[str, float]:
        """Every number of the audit by name, and how many statements got each verdict."""
        numbers = {name: value for each in self.findings for name, (value, _) in each.numbers.items()}
        counts = {f"verdicts_{v.replace(' ', '_')}": float(count) for v, count in self.verdicts.items()}
        return numbers | counts


def step(words: str, formula: sp.Basic | None = None) -> CalculationStep:
    """Return a line of a calculation with its LaTeX."""
    if formula is None:
        return CalculationStep(words)
    names = {s: LATEX[s.name] for s in formula.free_symbols if s.name in LATEX}
    return CalculationStep(words, formula, sp.latex(formula, symbol_names=names))


def equal(left: sp.Basic, right: sp.Basic) -> sp.Eq:
    """Return an equation as it stands, without any evaluation."""
    return sp.Eq(left, right, evaluate=False)


def _label(name: str, unit: str) -> str:
    """Return the name of a number in words, without the unit that ends it."""
    ending = {"%": "percent", "kg·m²": "kg_m2", "N·m": "Nm", "mN·m": "mNm", "N·m/rad": "Nm", "1/s": "per_s"}
    unit_words = ending.get(unit, unit.replace("·", "_").replace("/", "_per_"))
    return name.removesuffix("_" + unit_words).replace("_", " ")


def _title(statement: str) -> str:
    return statement if len(statement) <= 64 else statement[:63].rsplit(" ", 1)[0] + " …"
