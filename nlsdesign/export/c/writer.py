"""The writer of the C of one discrete model: names and types, then the statements of its functions.

Members of structures are named as the variables: ``spring.rubber.relaxing.dashpot.strain``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Literal, NamedTuple

import casadi as ca

from ...foundation.errors import ExportError
from ...model.flat import FlatModel, Symbols, Variable
from ..files import filled
from .c_text import Real, comment, identifier
from .elementary import own_functions
from .guarded_step import (
    AGREEING,
    GAP,
    MOST,
    ReadingNumbers,
    explained_limit,
    index_bit,
    mover,
    reading_numbers,
)
from .instructions import print_statements
from .table_lookup import CTable, c_tables, look_up

Group = Literal["inputs", "outputs", "parameters", "states"]

_MISSED = "q"
"""First letter of the numbers that are 1 while an input stands in for a refused reading."""
_DERIVED = "d"
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
    coefficients
        How many of the last parameters are coefficients, which blocks of numbers replace at run time;
        ``None`` where the numbers of the code are fixed.
    """

    name: str
    model: FlatModel
    real: Real
    header: Path
    source: Path
    selftest: Path
    coefficients: int | None = None

    @property
    def writer(self) -> CWriter:
        """What the files were written with."""
        return CWriter(self.model, self.name, self.real, self.coefficients)


class MemberPaths(NamedTuple):
    """Paths of the members inside the four structures, each in the order of the model."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    states: tuple[str, ...]


class MeasuredInput(NamedTuple):
    """A measured input: which one, the numbers of its guard, and what moves it, as C text."""

    number: int
    limits: ReadingNumbers
    driver: str


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
    coefficients: int | None = None

    @property
    def parameters(self) -> tuple[Variable, ...]:
        """Parameters of the model that are members of a structure; coefficients are none."""
        return self.model.parameters[: len(self.model.parameters) - (self.coefficients or 0)]

    @cached_property
    def paths(self) -> MemberPaths:
        """Paths of the members of the structures."""
        m = self.model
        groups = (m.inputs, m.outputs, self.parameters, m.states)
        return MemberPaths(*(tuple(member_paths(group).values()) for group in groups))

    @cached_property
    def readings(self) -> dict[str, MeasuredInput]:
        """Inputs that are measured, in order, by name."""
        measured: dict[str, MeasuredInput] = {}
        for v in self.model.inputs:
            limits = reading_numbers(v, float(self.model.sample_time or 0.0), self.real)
            if limits is not None:
                moved, driver = mover(self.model, v), self.real.literal(0.0)
                if moved is not None:
                    group, index = moved
                    driver = f"state->{group}.{getattr(self.paths, group)[index]}"
                measured[v.name] = MeasuredInput(len(measured), limits, driver)
        return measured

    @cached_property
    def tables(self) -> list[CTable]:
        """Tables of the model."""
        return c_tables(self.model, self.real, owner="" if self.coefficients is None else "state->")

    @cached_property
    def arguments(self) -> dict[str, str]:
        """Names of the constants that hold states and inputs in a function, by name of the variable."""
        arguments = {v.name: f"x{i}" for i, v in enumerate(self.model.states)}
        return arguments | {v.name: f"u{i}" for i, v in enumerate(self.model.inputs)}

    @cached_property
    def equations(self) -> StepEquations:
        """What a step computes, with what is expected in place of refused readings."""
        model, s = self.model, self.model.symbols()
        gap, used = ca.SX(0, 1), s.input
        if model.expected is not None and self.readings:
            gap = ca.SX.sym("gap", len(self.readings))
            expected = ca.SX(ca.densify(model.expected(s.state, s.input, s.parameter, s.table)))
            stands_in = {name: gap[reading.number] > 0.5 for name, reading in self.readings.items()}
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

    def filled(self, template: str, values: Mapping[str, str | Sequence[str]]) -> str:
        """Return a fixed text with the names of the model and the number type, and further values."""
        return filled(
            template,
            {"name": self.name, "NAME": self.name.upper(), "real": self.real, "zero": self.real.literal(0.0)}
            | dict(values),
        )

    def structure(self, group: Group, title: str, *, numbered: bool = False) -> list[str]:
        """Return the type of a group of variables, numbered in the order of the model or not."""
        variables = self.parameters if group == "parameters" else getattr(self.model, group)
        numbers = {variable.name: f"{i}: " if numbered else "" for i, variable in enumerate(variables)}
        lines = [f"/* {comment(title)} */", "typedef struct {"]
        if not variables:
            lines.append("    char none; /* C99 knows no empty structure */")

        def walk(branch: _Branch, indent: str) -> None:
            for member, below in branch.branches.items():
                if below.leaf is not None:
                    variable = below.leaf
                    limits = ""
                    if variable.minimum > -float("inf") or variable.maximum < float("inf"):
                        limits = f", {variable.minimum:.6g} to {variable.maximum:.6g}"
                    source = f"; {variable.source}" if variable.source else ""
                    described = comment(f"[{variable.unit}{limits}] {variable.description}{source}")
                    remark = numbers[variable.name] + described
                    lines.append(f"{indent}{self.real} {_leaf_name(member, below)}; /* {remark} */")
                if below.branches:
                    lines.append(f"{indent}struct {{")
                    walk(below, indent + "    ")
                    lines.append(f"{indent}}} {member};")

        walk(_tree(variables), "    ")
        return [*lines, f"}} {self.name}_{group};"]

    def initialiser(self, group: Group, values: Sequence[float]) -> list[str]:
        """Return designated initialisers for the structure of a group."""
        paths: Sequence[str] = getattr(self.paths, group)
        lines = [f".{path} = {self.real.literal(value)}," for path, value in zip(paths, values, strict=True)]
        return lines or [".none = 0"]

    def statements(
        self, function: ca.Function, inputs: Sequence[Sequence[str]], targets: Sequence[Sequence[str]]
    ) -> list[str]:
        """Return statements that compute all results of a function, with elementary functions of our own."""
        return print_statements(function, inputs, targets, real=self.real, own=own_functions())

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

    def loads(self, following: Iterable[str]) -> list[str]:
        """Return the constants that statements read: inputs, states, parameters, in this order."""
        lines, following = [], list(following)
        for letter, group in (("u", "inputs"), ("x", "states"), ("p", "parameters")):
            used, paths = (
                named_indices(following, letter),
                [f"{group}.{p}" for p in getattr(self.paths, group)],
            )
            if group == "parameters":
                paths += [f"coefficients[{i}]" for i in range(len(self.model.parameters) - len(paths))]
            lines += [f"const {self.real} {letter}{i} = state->{paths[i]};" for i in sorted(used)]
        return lines


def guard_functions(c: CWriter) -> list[str]:
    """Return the functions that judge commands, readings and parameters, as far as there are any."""
    limits: list[str] = []
    for number, reading, _ in c.readings.values():
        parts = (reading.lowest, reading.highest, reading.change, reading.noticeable)
        row = ", ".join(c.real.literal(part) for part in parts)
        limits.append(f"static const reading_limits reading_{number} = {{{row}, {reading.patience}u}};")
    values: dict[str, str | list[str]] = {
        "LARGEST": "FLT_MAX" if c.real is Real.FLOAT else "DBL_MAX",
        "fabs": c.real.function("fabs"),
        "AGREEING": str(AGREEING),
        "GAP": str(GAP),
        "MOST": str(MOST),
        "readings": limits,
    }
    wanted = {
        "controller_guard.c": len(c.model.inputs) > len(c.readings),
        "controller_command.c": any(v.largest_rate < inf for v in c.model.inputs if v.name not in c.readings),
        "controller_reading.c": bool(c.readings),
        "controller_parameter.c": bool(c.parameters),
    }
    texts = [c.filled(template, values) for template, is_wanted in wanted.items() if is_wanted]
    return [line for text in texts for line in (*text.splitlines(), "")]


def take_statements(c: CWriter) -> list[str]:
    """Return the statements that take the inputs: commands, then readings, with which the model may begin."""
    real, begins = c.real, c.model.begin is not None
    resumes = bool(c.readings) and begins
    commands, readings = ["uint32_t resuming = 0u;"] if resumes else [], []
    for i, (v, path) in enumerate(zip(c.model.inputs, c.paths.inputs, strict=True)):
        bit, taken = f"0x{index_bit(i):x}u, &status", f"&state->inputs.{path}"
        if v.name not in c.readings:
            limits = f"{real.bound(v.minimum)}, {real.bound(v.maximum)}"
            if v.largest_rate < inf:
                # The first command is taken as it is, as fast as it may be.
                change = real.bound(v.largest_rate * float(c.model.sample_time or 0.0))
                limits += f", state->begun == 0u ? {real.bound(inf)} : {change}"
            function = "followed" if v.largest_rate < inf else "usable"
            commands.append(f"{function}(inputs->{path}, {limits}, {taken}, {bit});")
            continue
        number, _, driver = c.readings[v.name]
        remembered = f"&reading_{number}, &state->readings[{number}]"
        call = f"plausible(inputs->{path}, {driver}, {remembered}, {taken}, {bit});"
        readings.append(f"{'resuming |=' if resumes else '(void)'} {call}")
    ready = [f"state->readings[{number}].seen != 0u" for number, _, _ in c.readings.values()]
    values = {
        "condition": " && ".join(["state->begun == 0u", *ready]),
        "begin": [f"{c.name}_begin(state);"] if begins else [],
        "resume": c.filled("controller_resuming.c", {}).splitlines() if resumes else [],
    }
    beginning = c.filled("controller_beginning.c", values).splitlines()
    return [*(commands + readings or ["(void)inputs;"]), *beginning]


def step_body(c: CWriter) -> tuple[list[str], set[int]]:
    """Return the statements of the step and the indices of the looked-up numbers it uses.

    Results are stored only if all are finite: a state that is not begins anew with the next sample, outputs
    that are not are held.
    """
    real, equations = c.real, c.equations
    s, gap, numbers = equations.symbols, equations.gap, equations.numbers
    function = ca.Function(
        "step", [s.state, s.input, s.parameter, s.table, gap, numbers], equations.results, {"cse": True}
    )
    targets = [[f"const {real} {y}{i}" for i in range(function.numel_out(k))] for k, y in enumerate("fy")]
    further = [
        [f"{letter}{i}" for i in range(group.numel())]
        for letter, group in ((_MISSED, gap), (_DERIVED, numbers))
    ]
    tables, statements = c.equation_lines(function, further, targets)
    # Of tables over one argument the narrowest, which others may miss by a rounding.
    ranges: dict[str, list[tuple[float, float]]] = {}
    for table in c.model.tables:
        ranges.setdefault(c.arguments[table.argument], []).append(table.ends)
    beyond = " || ".join(
        f"{a} < {real.literal(max(ends)[0])} || {a} > {real.literal(min(last for _, last in ends))}"
        for a, ends in ranges.items()
    )
    flag = [f"status |= ({beyond}) ? {c.name.upper()}_OUT_OF_TABLE : 0u;"] if beyond else []
    missed, derived = (sorted(named_indices(statements, letter)) for letter in (_MISSED, _DERIVED))
    one, zero = real.literal(1.0), real.literal(0.0)
    body = [
        *c.loads([*flag, *tables, *statements]),
        *(f"const {real} {_MISSED}{i} = state->readings[{i}].missed > 0u ? {one} : {zero};" for i in missed),
        *(f"const {real} {_DERIVED}{i} = state->derived[{i}];" for i in derived),
        *flag,
        *tables,
        *statements,
        "",
    ]
    # v - v is 0 for a finite v and NaN otherwise: one comparison for all, which NaN does not pass.
    for letter, group, owners in (
        ("f", "states", ("state->states.",)),
        ("y", "outputs", ("state->outputs.", "outputs->")),
    ):
        paths: Sequence[str] = getattr(c.paths, group)
        stores = [f"{owner}{path} = {letter}{i};" for i, path in enumerate(paths) for owner in owners]
        differences = " + ".join(f"({letter}{i} - {letter}{i})" for i in range(len(paths)))
        if group == "outputs":
            stores += [
                f"status |= y{i} > {real.literal(limit)} ? {c.name.upper()}_INNOVATION_LARGE : 0u;"
                for i, limit in enumerate(map(explained_limit, c.model.outputs))
                if limit < inf
            ]
        values = {"finite": f"{differences} >= {zero}", "stores": stores}
        body += c.filled(f"controller_{group}.c", values).splitlines() if paths else []
    if not c.paths.outputs:
        body.append("(void)state, (void)outputs;")
    return body, named_indices(statements, "w")


def settled_functions(c: CWriter) -> list[str]:
    """Return the functions that begin and resume, where the states depend on the readings."""
    model = c.model
    if model.begin is None:
        return []
    lines: list[str] = []
    what = {"begin": "rests at its first readings", "resume": "goes on after a gap in its readings"}
    # Without a measured input there are no gaps after which to resume.
    for which, verb in enumerate(what if c.readings else ["begin"]):
        s = model.symbols()
        settled = ca.SX(ca.densify(model.begin(s.state, s.input, s.parameter, s.table)[which]))
        changed = [i for i in range(len(model.states)) if not ca.is_equal(settled[i], s.state[i], 2)]
        result = ca.SX(ca.vertcat(*[settled[i] for i in changed]))
        function = ca.Function("settled", [s.state, s.input, s.parameter, s.table], [result], {"cse": True})
        targets = [[f"state->states.{c.paths.states[i]}" for i in changed]]
        tables, equations = c.equation_lines(function, [], targets)
        body = [*c.loads([*tables, *equations]), *tables, *equations] or ["(void)state;"]
        text = c.filled("controller_settled.c", {"verb": verb, "words": what[verb], "body": body})
        lines += [*text.splitlines(), ""]
    return lines


def derived_statements(c: CWriter) -> list[str]:
    """Return the statements that compute what follows from the parameters alone."""
    equations = c.equations
    count = equations.numbers.numel()
    if not count:
        return []
    function = ca.Function("derived", [equations.symbols.parameter], [equations.values], {"cse": True})
    names = [f"p{i}" for i in range(len(c.model.parameters))]
    statements = c.statements(function, [names], [[f"state->derived[{i}]" for i in range(count)]])
    return [*c.loads(statements), *statements]


def named_indices(lines: Sequence[str], letter: str) -> set[int]:
    """Return the numbers i of all names such as ``w<i>`` in statements."""
    return {int(number) for line in lines for number in re.findall(rf"(?<![\w.]){letter}(\d+)\b", line)}


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


@dataclass
class _Branch:
    leaf: Variable | None = None
    branches: dict[str, _Branch] = field(default_factory=dict)


def _tree(variables: Iterable[Variable]) -> _Branch:
    root = _Branch()
    for variable in variables:
        branch = root
        for part in variable.name.split("."):
            member = identifier(re.sub(r"\[(\d+)\]$", r"_\1", part))
            branch = branch.branches.setdefault(member, _Branch())
        if branch.leaf is not None:
            raise ExportError(
                f"'{branch.leaf.name}' and '{variable.name}'",
                "become the same member of a C structure",
                next_step="rename one of them",
            )
        branch.leaf = variable
    return root


def _leaf_name(member: str, branch: _Branch) -> str:
    # A name that is also a prefix of longer names gets a trailing underscore.
    return member + "_" if branch.branches else member


def member_paths(variables: Sequence[Variable]) -> dict[str, str]:
    """Return the path of each variable inside its structure in C; two of one path are an ``ExportError``."""
    paths = paths_in_memory(variables)
    return {variable.name: paths[variable.name] for variable in variables}


def paths_in_memory(variables: Sequence[Variable]) -> dict[str, str]:
    """Return the path of each variable inside its structure in C, in the order of the members."""
    paths: dict[str, str] = {}

    def walk(branch: _Branch, path: str) -> None:
        for member, below in branch.branches.items():
            if below.leaf is not None:
                paths[below.leaf.name] = path + _leaf_name(member, below)
            walk(below, f"{path}{member}.")

    walk(_tree(variables), "")
    return paths
