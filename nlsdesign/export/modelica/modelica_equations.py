"""The equations of a flat model in Modelica: values that are used more than once have a name."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca

from ...model import FlatModel
from ...model.function_steps import Instruction, read_instructions
from .modelica_terms import ATOM, SERIES, SIGNED, WRITTEN_TWICE, Term, kept, term
from .modelica_text import literal

LONGEST = 16
"""Operations in one expression; a longer one gets a name of its own."""

_RESULTS = ("derivative", "output", "signal")


@dataclass
class ModelicaEquations:
    """Left and right sides, in the order of computation.

    Parameters
    ----------
    definitions
        Of variables: outputs, signals and common values, by their Modelica names.
    derivatives
        Of states, by their Modelica names.
    common
        Names of values that are used more than once and are nothing else.
    """

    definitions: dict[str, str] = field(default_factory=dict)
    derivatives: dict[str, str] = field(default_factory=dict)
    common: list[str] = field(default_factory=list)


def modelica_equations(model: FlatModel, names: Mapping[str, str]) -> ModelicaEquations:
    """Return the equations of a continuous model."""
    steps, results = read_instructions(model.equations)
    groups = (model.states, model.outputs, model.signals)
    given = {v.name for group in (model.states, model.inputs, model.parameters) for v in group}
    called: defaultdict[int, list[str]] = defaultdict(list)
    for port, group in list(enumerate(groups))[1:]:
        for index, variable in enumerate(group):
            name = names[variable.name]
            if variable.name not in given and name not in called[results[port, index]]:
                called[results[port, index]].append(name)
    wanted = {results[port, index] for port, group in enumerate(groups) for index in range(len(group))}
    reader = _Reader(model, names, called, _uses(steps, wanted))
    for number, step in enumerate(steps):
        if reader.uses[number]:
            reader.terms[number] = reader.read(number, step)
    for index, state in enumerate(model.states):
        reader.equations.derivatives[names[state.name]] = _right_side(reader.terms[results[0, index]])
    return reader.equations


def _uses(steps: Sequence[Instruction], wanted: set[int]) -> Counter[int]:
    """Return how often the text of each value is needed; 0 for what only the residuals need."""
    uses = Counter(wanted)
    for number in range(len(steps) - 1, -1, -1):
        if uses[number]:
            weight = 2 if steps[number].operation in WRITTEN_TWICE else 1
            # CasADi names the operand of an operation on one value twice.
            for operand in set(steps[number].operands):
                uses[operand] += weight * max(1, steps[number].operands.count(operand))
    return uses


def _right_side(value: Term) -> str:
    number = value.as_number()
    return f"noEvent({number.text})" if number.events else number.text


@dataclass
class _Reader:
    """Runs through the instructions and turns each into Modelica."""

    model: FlatModel
    names: Mapping[str, str]
    called: Mapping[int, list[str]]
    uses: Counter[int]
    equations: ModelicaEquations = field(default_factory=ModelicaEquations)
    terms: dict[int, Term] = field(default_factory=dict)

    def read(self, number: int, step: Instruction) -> Term:
        """Return the value of an instruction as it is written where it is used."""
        value = self._value(step)
        names = list(self.called.get(number, []))
        simple = value.size == 0
        long = value.size > LONGEST or step.operation in SERIES
        if not names and not simple and (self.uses[number] > 1 or long):
            names = [f"v{len(self.equations.common) + 1}"]
            self.equations.common += names
        for name in names:
            self.equations.definitions[name] = _right_side(value)
            # The next name of the same value is defined by the first; constants stay as they are.
            value = value if simple else kept(name, value)
        return value

    def _value(self, step: Instruction) -> Term:
        if step.operation == ca.OP_CONST:
            text = literal(float(step.extra))
            return Term(text, SIGNED if text.startswith("-") else ATOM)
        if step.operation == ca.OP_INPUT:
            group = (self.model.states, self.model.inputs, self.model.parameters)
            argument, element = step.extra
            return Term("time" if argument == 0 else self.names[group[argument - 1][element].name])
        return term(step.operation, [self.terms[i] for i in step.operands])
