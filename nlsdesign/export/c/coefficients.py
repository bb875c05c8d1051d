"""Which constants of a step follow from the numbers of its deck: those that a block of numbers replaces.

A design turns the numbers of a deck into constants of equations. They are written twice, from the deck and
from one whose numbers are all a little different. What differs between both is a *coefficient*, and becomes
a parameter of the equations. Coincidences of one deck, such as a quotient that is one and drops out, are
those of no other, so the second equations give the form, and the first are read as a case of it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.symbolic import Expression
from ...model.flat import FlatModel, Variable
from ...model.graph import Graph, Instruction, applied, as_results, read_graph

COEFFICIENT = "coefficient"
SAME = 1e-9
"""Share of a constant up to which two of them are one: what rounding leaves between equal designs."""
WIDER = 10.0
"""A coefficient, or a number of a table, may grow to so many times its size, and a divisor shrink as much."""
_AGAIN = "export the code again from the other deck"

_NEUTRAL: Mapping[int, tuple[tuple[float, int | None], tuple[float, int | None]]] = {
    ca.OP_ADD: ((0.0, None), (0.0, None)),
    ca.OP_SUB: ((0.0, ca.OP_NEG), (0.0, None)),
    ca.OP_MUL: ((1.0, None), (1.0, None)),
}
"""First and second operand that change nothing, or leave another operation of the remaining one."""
_SPECIAL = {(ca.OP_MUL, ca.OP_NEG): -1.0, (ca.OP_MUL, ca.OP_TWICE): 2.0, (ca.OP_DIV, ca.OP_INV): 1.0}
"""Constants with which CasADi writes another operation."""


class BlockNumbers(NamedTuple):
    """Numbers of a block: parameters and coefficients in order, and tables of shape (rows, columns)."""

    parameters: tuple[float, ...]
    coefficients: tuple[float, ...]
    tables: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class LoadableModel:
    """A discrete model whose coefficients are its last parameters.

    Parameters
    ----------
    model
        With the numbers of its deck.
    coefficients
        How many of the last parameters are coefficients.
    forms
        Operations of each function of the model.
    members
        For each function and each constant of its form the number of the coefficient, or the constant itself.
    """

    model: FlatModel
    coefficients: int
    forms: Mapping[str, Graph]
    members: Mapping[str, tuple[int | float, ...]]

    @property
    def parameters(self) -> tuple[Variable, ...]:
        """Parameters that are none of the coefficients."""
        return self.model.parameters[: len(self.model.parameters) - self.coefficients]

    def structure(self) -> str:
        """Return a digest of the form of the equations, which says nothing of any constant."""
        steps = [(name, [(s.operation, s.operands) for s in form.steps]) for name, form in self.forms.items()]
        return hashlib.sha256(repr(steps).encode()).hexdigest()

    def numbers_of(self, other: FlatModel) -> BlockNumbers:
        """Return the numbers with which these equations become those of another design."""
        _same_interface(self.model, other, len(self.parameters))
        solved: dict[int, float] = {}
        for name, form in self.forms.items():
            values = _constants(form, _form(getattr(other, name)), other.name)
            for member, value in zip(self.members[name], values, strict=True):
                known = solved.setdefault(member, value) if isinstance(member, int) else member
                if not _same(known, value):
                    raise _other_form(other.name, f"has the constant {value:.9g} in place of {known:.9g}")
        parameters = tuple(v.start for v in other.parameters)
        tables = tuple(np.asarray(table.values, dtype=float) for table in other.tables)
        return BlockNumbers(parameters, tuple(solved[i] for i in range(self.coefficients)), tables)


def loadable_model(model: FlatModel, moved: FlatModel) -> LoadableModel:
    """Return a discrete model with its coefficients as parameters."""
    _same_interface(model, moved, len(model.parameters))
    names = [name for name in ("equations", "begin", "expected") if getattr(model, name) is not None]
    forms = {name: _form(getattr(moved, name)) for name in names}
    numbered: dict[tuple[float, float], int] = {}
    members: dict[str, tuple[int | float, ...]] = {}
    for name, form in forms.items():
        pairs = zip(
            _constants(form, _form(getattr(model, name)), model.name), constants_of(form), strict=True
        )
        members[name] = tuple(
            value if _same(value, other) else numbered.setdefault((value, other), len(numbered))
            for value, other in pairs
        )
    divisors = {
        members[name][n]
        for name, form in forms.items()
        for n, (k, place) in enumerate(_operands(form))
        if k >= 0 and form.steps[k].operation == ca.OP_DIV and place == 1
    }
    added = tuple(coefficient_of(i, *pair, i in divisors) for i, pair in enumerate(numbered))
    symbols = ca.SX.sym(COEFFICIENT, len(added))
    functions: dict[str, Any] = {
        n: with_coefficients(getattr(model, n), forms[n], members[n], symbols) for n in names
    }
    whole = replace(model, parameters=(*model.parameters, *added), **functions)
    return LoadableModel(whole, len(added), forms, members)


def coefficient_of(number: int, value: float, moved: float, divides: bool) -> Variable:
    """Return a coefficient with its range; one by which something is divided keeps its sign."""
    size = WIDER * max(abs(value), abs(moved))
    low, high = (sorted((value / WIDER, value * WIDER))) if divides else (-size, size)
    return Variable(
        f"{COEFFICIENT}[{number}]", "1", "constant of the equations that follows from the deck",
        start=value, nominal=abs(value) or 1.0, minimum=low, maximum=high,
    )  # fmt: skip


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME * max(abs(one), abs(other))


def _other_form(name: str, how: str) -> ExportError:
    return ExportError(f"'{name}'", f"is not of the form of the code: it {how}", next_step=_AGAIN)


def _same_interface(model: FlatModel, other: FlatModel, count: int) -> None:
    """Refuse a model whose names, units, sample time or grids are others; so many parameters count."""
    if model.sample_time != other.sample_time:
        raise _other_form(other.name, f"is sampled every {other.sample_time} s, not {model.sample_time} s")
    for group in ("states", "inputs", "outputs", "parameters"):
        pairs = [[(v.name, v.unit) for v in getattr(each, group)[: count if group == "parameters" else None]]
                 for each in (model, other)]  # fmt: skip
        if pairs[0] != pairs[1]:
            lacking = [f"{n} [{u}]" for n, u in pairs[0] if (n, u) not in pairs[1]]
            further = [f"{n} [{u}]" for n, u in pairs[1] if (n, u) not in pairs[0]]
            raise _other_form(
                other.name, f"has other {group}: {', '.join(lacking) or 'none'} of them is lacking, "
                f"{', '.join(further) or 'none'} is added",
            )  # fmt: skip
    tables = [[(t.argument, t.values.shape, [(v.name, v.unit) for v in t.columns]) for t in each.tables]
              for each in (model, other)]  # fmt: skip
    grids = zip(model.tables, other.tables, strict=False)
    if tables[0] != tables[1] or not all(np.allclose(a.grid, b.grid, rtol=SAME, atol=SAME) for a, b in grids):
        raise _other_form(other.name, "has tables with other columns or grid points")


def _form(function: ca.Function) -> Graph:
    """Return what a function computes, without factors that are one but for rounding."""
    graph = read_graph(function)
    at: dict[int, int] = {}
    steps: list[Instruction] = []
    for k, step in enumerate(graph.steps):
        operands = tuple(at[i] for i in step.operands)
        ones = [steps[i].operation == ca.OP_CONST and _same(steps[i].extra, 1.0) for i in operands]
        if step.operation == ca.OP_MUL and any(ones):
            at[k] = operands[1 - ones.index(True)]
            continue
        at[k] = len(steps)
        steps.append(step._replace(operands=operands))
    return Graph(tuple(steps), {place: at[i] for place, i in graph.results.items()}, ())


def _operands(form: Graph) -> list[tuple[int, int]]:
    """Return where constants stand, in order: step and place, or −1 and the constant of a result."""
    constant = [step.operation == ca.OP_CONST for step in form.steps]
    inside = [
        (k, place)
        for k, step in enumerate(form.steps)
        for place, operand in enumerate(step.operands)
        if constant[operand]
    ]
    return inside + [(-1, number) for _, number in sorted(form.results.items()) if constant[number]]


def constants_of(form: Graph) -> list[float]:
    """Return the constants of a form, in order."""
    return [
        float(form.steps[place if k < 0 else form.steps[k].operands[place]].extra)
        for k, place in _operands(form)
    ]


def _constants(form: Graph, other: Graph, name: str) -> list[float]:
    """Return the constants with which a form gives the same operations as another graph; refuse others."""
    reading = _Reading(form, other, name)
    for k, step in enumerate(form.steps):
        if step.operation != ca.OP_CONST:
            reading.take(k)
    return reading.finished()


class _Reading:
    """Reads a graph as a case of a form, operation by operation: where each value of the form is in it."""

    def __init__(self, form: Graph, other: Graph, name: str) -> None:
        self.form, self.other, self.name = form, other, name
        self.at: dict[int, int] = {}
        self.values: list[float] = []
        leaves = (ca.OP_CONST, ca.OP_INPUT)
        self.given = {s.extra: k for k, s in enumerate(other.steps) if s.operation == ca.OP_INPUT}
        self.following = [k for k, s in enumerate(other.steps) if s.operation not in leaves][::-1]

    def take(self, k: int) -> None:
        """Find one operation of the form."""
        step = self.form.steps[k]
        if step.operation == ca.OP_INPUT:
            self.at[k] = self.given.get(step.extra, -1)
            return
        if self.following and self.takes(k, self.following[-1]):
            self.at[k] = self.following.pop()
            return
        fixed = [self.form.steps[i].operation == ca.OP_CONST for i in step.operands]
        if len(fixed) == 2 and sum(fixed) == 1:
            kept = self.at[step.operands[1 - fixed.index(True)]]
            if self.takes_shorter(k, fixed.index(True), kept):
                return
        raise _other_form(self.name, f"has other operations, from number {len(self.at) + 1} on")

    def takes(self, k: int, candidate: int) -> bool:
        """Take an operation as it is; its constants are noted."""
        step, candidate_step = self.form.steps[k], self.other.steps[candidate]
        if step.operation != candidate_step.operation:
            return False
        values = []
        for operand, its in zip(step.operands, candidate_step.operands, strict=True):
            if (self.form.steps[operand].operation == ca.OP_CONST) != (
                self.other.steps[its].operation == ca.OP_CONST
            ):
                return False
            if self.form.steps[operand].operation == ca.OP_CONST:
                values.append(float(self.other.steps[its].extra))
            elif self.at[operand] != its:
                return False
        self.values += values
        return True

    def takes_shorter(self, k: int, place: int, kept: int) -> bool:
        """Take an operation whose constant makes it another one, or none at all."""
        operation = self.form.steps[k].operation
        following = self.other.steps[self.following[-1]] if self.following else None
        neutral = _NEUTRAL.get(operation)
        becomes = following.operation if following and following.operands == (kept,) else None
        special = _SPECIAL.get((operation, becomes)) if becomes is not None else None
        if special is not None:
            value: float | None = special
        elif neutral is not None and neutral[place][1] in (None, becomes):
            value, becomes = neutral[place]
        else:
            value = 1.0 if operation == ca.OP_DIV and place == 1 else None
            becomes = None
        if value is None:
            return False
        self.values.append(value)
        self.at[k] = kept if becomes is None else self.following.pop()
        return True

    def finished(self) -> list[float]:
        """Return all constants; refuse a graph with further operations or other results."""
        places = sorted(self.form.results.items())
        agree = not self.following and [p for p, _ in places] == sorted(self.other.results)
        for place, number in places if agree else ():
            its = self.other.results[place]
            if self.form.steps[number].operation != ca.OP_CONST:
                agree = agree and self.at[number] == its
            elif self.other.steps[its].operation == ca.OP_CONST:
                self.values.append(float(self.other.steps[its].extra))
            else:
                agree = False
        if not agree:
            raise _other_form(self.name, "has other results")
        return self.values


def with_coefficients(
    function: ca.Function, form: Graph, members: Sequence[int | float], coefficients: Expression
) -> ca.Function:
    """Return a function of a model in its form, with coefficients behind its parameters."""
    names = function.name_in()
    arguments = [ca.SX.sym(name, function.sparsity_in(i)) for i, name in enumerate(names)]
    number, count = iter(members), len(names)
    values: dict[int, Expression] = {}

    def constant() -> Expression:
        member = next(number)
        return coefficients[member] if isinstance(member, int) else ca.SX(member)

    for k, step in enumerate(form.steps):
        if step.operation == ca.OP_INPUT:
            values[k] = arguments[step.extra[0]].nz[step.extra[1]]
        elif step.operation != ca.OP_CONST:
            operands = [values[i] if i in values else constant() for i in step.operands]
            values[k] = applied(step.operation, operands)
    results = {place: values[i] if i in values else constant() for place, i in sorted(form.results.items())}
    # Parameters stand before the looked-up numbers, which are the last argument.
    arguments[count - 2] = ca.vertcat(arguments[count - 2], coefficients)
    return ca.Function(function.name(), arguments, as_results(function, results), names, function.name_out())
