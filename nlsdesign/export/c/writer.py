"""The writer of the C of one discrete model: its names, its look-ups, its equations and its statements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Literal

import casadi as ca

from ...model.flat import FlatModel, Symbols, Variable
from ..files import filled
from .c_text import Real, member_paths, structure
from .elementary import own_functions
from .instructions import named_indices, print_statements
from .table_lookup import CTable, c_tables, look_up

Group = Literal["inputs", "outputs", "parameters", "states"]

MISSED = "q"
"""First letter of the numbers that are 1 while an input stands in for a refused reading."""
DERIVED = "d"
"""First letter of the numbers that follow from the parameters alone."""


@dataclass(frozen=True, eq=False)
class CSource:
    """C files of one discrete model.

    Parameters
    ----------
    name
        Prefix of all C names and of the files.
    model
        The model they compute.
    real
        Number type; it is also the text ``"double"`` or ``"float"``.
    header, source, selftest
        Paths of the interface, of the functions, and of a program that tests them.
    """

    name: str
    model: FlatModel
    real: Real
    header: Path
    source: Path
    selftest: Path

    @property
    def writer(self) -> CWriter:
        """What the files were written with."""
        return CWriter(self.model, self.name, self.real)


@dataclass(frozen=True, eq=False)
class StepEquations:
    """Next states and outputs, without what the parameters alone decide: that is computed when they are set.

    ``gap`` are symbols that are 1 while an input stands in for a refused reading, ``numbers`` symbols of what
    was taken out of ``results``, and ``values`` these numbers as expressions of the parameters.
    """

    symbols: Symbols
    gap: ca.SX
    results: list[ca.SX]
    numbers: ca.SX
    values: ca.SX


@dataclass(frozen=True, eq=False)
class CWriter:
    """What the C of a discrete model is written with: the model, the prefix of all names, the number type."""

    model: FlatModel
    name: str
    real: Real = Real.DOUBLE

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Members of the structure of inputs, in the order of the model."""
        return tuple(member_paths(self.model.inputs).values())

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Members of the structure of outputs, in the order of the model."""
        return tuple(member_paths(self.model.outputs).values())

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Members of the structure of parameters, in the order of the model."""
        return tuple(member_paths(self.model.parameters).values())

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Members of the structure of states, in the order of the model."""
        return tuple(member_paths(self.model.states).values())

    @cached_property
    def readings(self) -> dict[str, int]:
        """Number of each input that is measured, in order, by name."""
        names = [v.name for v in self.model.inputs if v.plausibility is not None]
        return {name: number for number, name in enumerate(names)}

    @cached_property
    def tables(self) -> list[CTable]:
        """Tables of the model."""
        return c_tables(self.model, self.real)

    @cached_property
    def equations(self) -> StepEquations:
        """What a step computes, with what is expected in place of refused readings."""
        model, s = self.model, self.model.symbols()
        gap, used = ca.SX(0, 1), s.input
        if model.expected is not None and self.readings:
            gap = ca.SX.sym("gap", len(self.readings))
            expected = ca.SX(ca.densify(model.expected(s.state, s.input, s.parameter, s.table)))
            stands_in = {name: gap[number] > 0.5 for name, number in self.readings.items()}
            used = ca.SX(
                ca.vertcat(
                    *[
                        ca.if_else(stands_in[v.name], expected[i], s.input[i])
                        if v.name in stands_in
                        else s.input[i]
                        for i, v in enumerate(model.inputs)
                    ]
                )
            )
        results = ca.substitute([ca.densify(s.derivative), ca.densify(s.output)], [s.input], [used])
        return StepEquations(s, gap, *_without_parameter_numbers(results, s.parameter))

    def filled(self, shell: str, values: Mapping[str, str | Sequence[str]]) -> str:
        """Return a fixed text with the names of the model and the number type, and further values."""
        return filled(
            shell,
            {"name": self.name, "NAME": self.name.upper(), "real": self.real, "zero": self.real.literal(0.0)}
            | dict(values),
        )

    def structure(self, group: Group, title: str, *, numbered: bool) -> list[str]:
        """Return the type of the inputs, outputs, parameters or states."""
        variables: Sequence[Variable] = getattr(self.model, group)
        return structure(f"{self.name}_{group}", variables, self.real, title, numbered=numbered)

    def statements(
        self, function: ca.Function, inputs: Sequence[Sequence[str]], targets: Sequence[Sequence[str]]
    ) -> list[str]:
        """Return statements that compute all results of a function, with elementary functions of our own."""
        return print_statements(function, inputs, targets, real=self.real, own=own_functions(self.real))

    def equation_lines(
        self, function: ca.Function, further: Sequence[Sequence[str]], targets: Sequence[Sequence[str]]
    ) -> tuple[list[str], list[str]]:
        """Return look-ups and statements of a function of states, inputs, parameters, looked-up numbers.

        Further arguments may follow; they are given by name.
        """
        model = self.model
        groups = {"x": model.states, "u": model.inputs, "p": model.parameters}
        names = {letter: [f"{letter}{i}" for i in range(len(group))] for letter, group in groups.items()}
        looked_up = [f"w{i}" for i in range(sum(len(table.columns) for table in model.tables))]
        statements = self.statements(function, [*names.values(), looked_up, *further], targets)
        return look_up(self.tables, self.arguments, named_indices(statements, "w")), statements

    @cached_property
    def arguments(self) -> dict[str, str]:
        """Names of the constants that hold states and inputs in a function, by name of the variable."""
        arguments = {v.name: f"x{i}" for i, v in enumerate(self.model.states)}
        return arguments | {v.name: f"u{i}" for i, v in enumerate(self.model.inputs)}

    def loads(self, following: Iterable[str]) -> list[str]:
        """Return the constants that statements read: inputs, states, parameters, in this order."""
        lines, following = [], list(following)
        for letter, group in (("u", "inputs"), ("x", "states"), ("p", "parameters")):
            used, paths = named_indices(following, letter), getattr(self, group)
            lines += [f"const {self.real} {letter}{i} = state->{group}.{paths[i]};" for i in sorted(used)]
        return lines


def _without_parameter_numbers(
    results: Sequence[ca.SX], parameters: ca.SX
) -> tuple[list[ca.SX], ca.SX, ca.SX]:
    """Take out of expressions what depends on parameters alone and is more than a parameter."""
    if not parameters.numel():
        return list(results), ca.SX(0, 1), ca.SX(0, 1)
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
    edges = [0]
    for result in results:
        edges.append(edges[-1] + result.numel())
    parts = [rest[first:last] for first, last in pairwise(edges)]
    return parts, ca.SX(ca.vertcat(*symbols)), ca.SX(ca.vertcat(*values))
