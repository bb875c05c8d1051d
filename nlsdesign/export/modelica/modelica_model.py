"""A continuous flat model as one Modelica file, for tools that read equations and not only FMUs.

In its equations values that are used more than once have a name.
"""

from __future__ import annotations

import re
import sys
import textwrap
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...foundation.quantity import NOT_STATED, parse_unit
from ...foundation.text_files import write_text
from ...model import FlatModel, Variable
from ...model.graph import Instruction, read_graph
from ..c.c_text import comment, identifier, origin_lines, stamped
from ..files import check_continuous
from .modelica_terms import ATOM, SERIES, SIGNED, WRITTEN_TWICE, Term, kept, term

LONGEST = 16
"""Operations in one expression; a longer one gets a name of its own."""


@dataclass
class ModelicaEquations:
    """Left and right sides, in the order of computation."""

    # definitions: of variables: outputs, signals and common values, by their Modelica names
    definitions: dict[str, str] = field(default_factory=dict)
    derivatives: dict[str, str] = field(default_factory=dict)  # of states, by their Modelica names
    # common: names of values that are used more than once and are nothing else
    common: list[str] = field(default_factory=list)


def modelica_equations(model: FlatModel, names: Mapping[str, str]) -> ModelicaEquations:
    """Return the equations of a continuous model."""
    steps, results, _ = read_graph(model.equations)
    groups = (model.states, model.outputs, model.signals)
    given = {v.name for group in (model.states, model.inputs, model.parameters) for v in group}
    called: defaultdict[int, list[str]] = defaultdict(list)
    for port, group in list(enumerate(groups))[1:]:
        for index, variable in enumerate(group):
            name = names[variable.name]
            if variable.name not in given and name not in called[results[port, index]]:
                called[results[port, index]].append(name)
    wanted = {results[port, index] for port, group in enumerate(groups) for index in range(len(group))}
    # How often the text of each value is needed; 0 for what only the residuals need.
    uses = Counter(wanted)
    for step_number in range(len(steps) - 1, -1, -1):
        if uses[step_number]:
            weight = 2 if steps[step_number].operation in WRITTEN_TWICE else 1
            for operand in steps[step_number].operands:
                uses[operand] += weight
    reader = _Reader(model, names, called, uses)
    for number, step in enumerate(steps):
        if reader.uses[number]:
            reader.terms[number] = reader.read(number, step)
    for index, state in enumerate(model.states):
        reader.equations.derivatives[names[state.name]] = _right_side(reader.terms[results[0, index]])
    return reader.equations


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
            text = literal(step.extra)
            return Term(text, SIGNED if text.startswith("-") else ATOM)
        if step.operation == ca.OP_INPUT:
            group = (self.model.states, self.model.inputs, self.model.parameters)
            argument, element = step.extra
            return Term("time" if argument == 0 else self.names[group[argument - 1][element].name])
        return term(step.operation, [self.terms[i] for i in step.operands])


_NOT_QUOTABLE = re.compile(r"[^A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~]")
KEYWORDS = frozenset(
    keyword
    for line in (
        "algorithm and annotation block break class connect connector constant constrainedby der discrete",
        "each else elseif elsewhen encapsulated end enumeration equation expandable extends external false",
        "final flow for function if import impure in initial inner input loop model not operator or outer",
        "output package parameter partial protected public pure record redeclare replaceable return stream",
        "then true type when while within time",
    )
    for keyword in line.split()
)


def quoted_names(names: Iterable[str]) -> dict[str, str]:
    """Return quoted Modelica identifiers, which may hold dots and brackets; different for different names.

    Examples
    --------
    >>> quoted_names(["motor.angle"])
    {'motor.angle': "'motor.angle'"}
    """
    quoted: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = _NOT_QUOTABLE.sub("_", name)
        number, other = 1, plain
        while other in taken:
            number, other = number + 1, f"{plain}_{number + 1}"
        taken.add(other)
        quoted[name] = f"'{other}'"
    return quoted


def literal(value: float) -> str:
    """Return a number that reads back as the same number; an infinite one becomes the largest finite one."""
    if value != value:
        raise ExportError(
            "the model", "contains the number NaN", next_step="correct the law or the start value behind it"
        )
    return repr(min(max(float(value), -sys.float_info.max), sys.float_info.max))


def string(text: str) -> str:
    """Return a Modelica string.

    ``text``: any text; line breaks become spaces.
    """
    flat = " ".join(text.split())
    # A last backslash is followed by a space, as not every tool sees that it is escaped itself.
    flat += " " if flat.endswith("\\") else ""
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'


def modelica_unit(unit: str) -> str:
    """Return a unit in the syntax of Modelica: dots for products, one slash, no sign of a power.

    Examples
    --------
    >>> modelica_unit("N*m*s/rad"), modelica_unit("1/N/s"), modelica_unit("kg*m^2")
    ('N.m.s/rad', '1/(N.s)', 'kg.m2')
    """
    parse_unit(unit)
    above: list[str] = []
    below: list[str] = []
    place = above
    for piece in re.split(r"([*·/])", unit.replace("Ω", "Ohm").replace(" ", "")):
        if piece in ("*", "·", "/"):
            place = below if piece == "/" else above
        elif piece != "1":
            place.append(piece.replace("^", ""))
    if not below:
        return ".".join(above) or "1"
    denominator = ".".join(below)
    return f"{'.'.join(above) or '1'}/{denominator if len(below) == 1 else f'({denominator})'}"


_WIDTH = 110


def export_modelica(model: FlatModel, path: str | Path) -> Path:
    """Write a continuous model as plain Modelica, one flat class without any library; return the file.

    Names are those of the deck, between quotation marks: ``'motor.angle'``. Parameters carry their values
    and units, with their sources as comments. Nothing in the text makes events: where a law has a corner,
    the text has it too, under ``noEvent``.

    Parameters
    ----------
    model
        Continuous and smooth, as ``flatten`` gives it.
    path
        File to write, by custom ``NAME.mo``.

    Raises
    ------
    ExportError
        If the model is sampled, has tables or sharp laws, or uses an operation that Modelica does not have;
        or if the file cannot be written.

    Examples
    --------
    >>> import tempfile, nlsdesign as nls
    >>> model = nls.flatten(nls.declare(nls.load_deck("dfki_pendulum")))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     text = nls.export.export_modelica(model, f"{folder}/pendulum.mo").read_text()
    >>> "model dfki_pendulum" in text
    True
    """
    file = Path(path)
    write_text(file, modelica_text(model))
    return file


def modelica_text(model: FlatModel) -> str:
    """Return a continuous model as Modelica text."""
    check_continuous(
        model, sampled="is sampled, and Modelica text is written of continuous models",
        step="export it as C or FMU: nlsdesign export c, nlsdesign export fmu",
        sharp="is sharp, and its sticking and impacts have no plain Modelica text",
    )  # fmt: skip
    groups = (model.states, model.inputs, model.parameters, model.outputs, model.signals)
    names = quoted_names(v.name for group in groups for v in group)
    equations = modelica_equations(model, names)
    name = identifier(model.name, KEYWORDS)
    about = comment(f"{model.name}: {model.description}")
    head = [
        f"/* {about}",
        "   All numbers in SI units. Relations are under noEvent: the text has no events.",
        *origin_lines(model),
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]
    lines = [
        *head,
        f"model {name} {string(model.description)}",
        *_declarations(model, names, equations),
        "equation",
        *_equations(equations),
        "  annotation (experiment(StopTime = 1.0, Tolerance = 1e-8));",
        f"end {name};",
    ]
    return stamped("\n".join(lines) + "\n", model)


def _declarations(model: FlatModel, names: Mapping[str, str], equations: ModelicaEquations) -> Iterator[str]:
    outputs, written = {v.name for v in model.outputs}, set[str]()
    groups = (
        ("parameter Real", model.parameters), ("input Real", model.inputs), ("Real", model.states),
        ("Real", model.outputs), ("Real", model.signals),
    )  # fmt: skip
    for kind, group in groups:
        for v in group:
            if v.name in written:
                continue
            written.add(v.name)
            shown = f"output {kind}" if kind == "Real" and v.name in outputs else kind
            state, parameter = group is model.states, group is model.parameters
            starts = state or group is model.inputs
            parts = [f"unit = {string(modelica_unit(v.unit))}"]
            parts += [f"start = {literal(v.start)}"] if starts else []
            parts += ["fixed = true"] if state else []
            parts += [f"nominal = {literal(v.nominal)}"] if state else []
            limits = {"min": v.minimum, "max": v.maximum}
            attributes = ", ".join(
                parts + [f"{k} = {literal(n)}" for k, n in limits.items() if abs(n) != float("inf")]
            )
            value = f" = {literal(v.start)}" if parameter else ""
            about = f"  // {_evidence(v)}" if parameter and _evidence(v) else ""
            yield f"  {shown} {names[v.name]}({attributes}){value} {string(v.description)};{about}"
    if equations.common:
        yield "protected"
        yield from (f"  Real {name};" for name in equations.common)


def _evidence(v: Variable) -> str:
    source = comment(v.source) or NOT_STATED
    return f"{source}; {v.spread_text}" if v.spread else source


def _equations(equations: ModelicaEquations) -> Iterator[str]:
    sides = [*equations.definitions.items()]
    sides += [(f"der({name})", right) for name, right in equations.derivatives.items()]
    for left, right in sides:
        yield from textwrap.wrap(
            f"{left} = {right};", _WIDTH, initial_indent="  ", subsequent_indent="      ",
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
