"""What the audit finds on one statement: calculation, numbers, verdict; and how it is shown and written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy

import nlsdesign as nls

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
    """One statement with what became of it.

    Parameters
    ----------
    key
        Short identifier; the number before the dot is that of the list of the design notes.
    says
        Who makes the statement: the paper or the project's design notes.
    statement, verdict, why
        What is tested, what came out, and the reason in words.
    steps
        The calculation.
    numbers
        Value and unit by name; the names are those of ``expected.toml``.
    figures
        Figures with their captions, by title.
    """

    key: str
    says: str
    statement: str
    verdict: str
    why: str
    steps: tuple[nls.report.CalculationStep, ...] = ()
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    figures: Mapping[str, tuple[Any, str]] = field(default_factory=dict)

    def section(self) -> Any:
        """Return the finding as a section of the page."""
        shown = {_label(n, u): f"{nls.figures.compact(v, 4)} {u}" for n, (v, u) in self.numbers.items()}
        parts = tuple(nls.report.FigureSection(t, f, caption=c) for t, (f, c) in self.figures.items())
        return nls.report.CalculationSection(
            f"{self.key} {_title(self.statement)}",
            f"{self.statement} (Said by: {self.says}.)",
            self.verdict,
            steps=self.steps,
            why=self.why,
            numbers={name: number.removesuffix(" 1") for name, number in shown.items()},
            parts=parts,
        )

    def record(self) -> dict[str, Any]:
        """Return the finding as plain data."""
        return {
            "key": self.key, "says": self.says, "statement": self.statement, "verdict": self.verdict,
            "why": self.why,
            "numbers": {n: {"value": v, "unit": u} for n, (v, u) in self.numbers.items()},
            "calculation": [
                {"words": s.words, "formula": "" if s.formula is None else str(s.formula), "latex": s.latex}
                for s in self.steps
            ],
        }  # fmt: skip


def step(words: str, formula: Any = None) -> nls.report.CalculationStep:
    """Return a line of a calculation with its LaTeX."""
    if formula is None:
        return nls.report.CalculationStep(words)
    names = {s: LATEX[s.name] for s in formula.free_symbols if s.name in LATEX}
    return nls.report.CalculationStep(words, formula, sympy.latex(formula, symbol_names=names))


def equal(left: Any, right: Any) -> Any:
    """Return an equation as it stands, without any evaluation."""
    return sympy.Eq(left, right, evaluate=False)


def _label(name: str, unit: str) -> str:
    """Return the name of a number in words, without the unit that ends it."""
    ending = {"%": "percent", "kg·m²": "kg_m2", "N·m": "Nm", "mN·m": "mNm", "N·m/rad": "Nm", "1/s": "per_s"}
    unit_words = ending.get(unit, unit.replace("·", "_").replace("/", "_per_"))
    return name.removesuffix("_" + unit_words).replace("_", " ")


def _title(statement: str) -> str:
    return statement if len(statement) <= 64 else statement[:63].rsplit(" ", 1)[0] + " …"
