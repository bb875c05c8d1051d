"""Numbers that follow from the parameters alone: computed when parameters are set, not in each step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca

from ...model.flat import FlatModel
from .c_text import Real
from .instructions import named_indices, print_statements
from .structures import member_paths

LETTER = "d"
"""First letter of these numbers in the step."""


@dataclass(frozen=True, eq=False)
class ParameterNumbers:
    """Expressions without what the parameters alone decide.

    Parameters
    ----------
    results
        The expressions, with a symbol for each number that was taken out.
    symbols
        Shape (n,).
    values
        The numbers as expressions of the parameters, shape (n,).
    parameters
        Symbols of the parameters.
    """

    results: list[ca.SX]
    symbols: ca.SX
    values: ca.SX
    parameters: ca.SX

    @property
    def names(self) -> list[str]:
        """Names in the step."""
        return [f"{LETTER}{i}" for i in range(self.symbols.numel())]


def without_parameter_numbers(results: Sequence[ca.SX], parameters: ca.SX) -> ParameterNumbers:
    """Take out of expressions what depends on parameters alone and is more than a parameter.

    Parameters
    ----------
    results
        Columns of expressions.
    parameters
        Their symbols, shape (n,).
    """
    if not parameters.numel():
        return ParameterNumbers(list(results), ca.SX(0, 1), ca.SX(0, 1), parameters)
    whole = ca.cse(ca.vertcat(*results))
    rest, symbols, values = ca.extract_parametric(whole, parameters)
    # A sign costs nothing where it is needed.
    signs = [k for k, value in enumerate(values) if value.op() == ca.OP_NEG and value.dep(0).is_symbolic()]
    if signs:
        rest = ca.substitute(
            rest, ca.vertcat(*[symbols[k] for k in signs]), ca.vertcat(*[values[k] for k in signs])
        )
    symbols = [symbol for k, symbol in enumerate(symbols) if k not in signs]
    values = [value for k, value in enumerate(values) if k not in signs]
    ends = [0]
    for result in results:
        ends.append(ends[-1] + result.numel())
    parts = [rest[first:last] for first, last in pairwise(ends)]
    return ParameterNumbers(parts, ca.SX(ca.vertcat(*symbols)), ca.SX(ca.vertcat(*values)), parameters)


def parameter_statements(model: FlatModel, numbers: ParameterNumbers, real: Real) -> list[str]:
    """Return the statements that compute the numbers into the structure of the caller.

    Parameters
    ----------
    model
        Discrete model.
    numbers
        Of its step.
    real
        Number type.
    """
    if not numbers.symbols.numel():
        return []
    function = ca.Function("derived", [numbers.parameters], [numbers.values], {"cse": True})
    names = [f"p{i}" for i in range(len(model.parameters))]
    targets = [f"state->derived[{i}]" for i in range(numbers.symbols.numel())]
    statements = print_statements(function, [names], [targets], real=real)
    paths, used = member_paths(model.parameters), named_indices(statements, "p")
    loads = [
        f"const {real.name} p{i} = state->parameters.{paths[v.name]};"
        for i, v in enumerate(model.parameters)
        if i in used
    ]
    return [*loads, *statements]
