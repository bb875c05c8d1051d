"""A continuous flat model as one Modelica file, for tools that read equations and not only FMUs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...foundation.quantity import NOT_STATED
from ...foundation.writing import write_text
from ...model import FlatModel, Variable
from ..c.c_text import comment
from ..c.provenance import origin_lines, stamped
from .modelica_equations import ModelicaEquations, modelica_equations
from .modelica_text import class_name, literal, modelica_unit, quoted_names, string

_WIDTH = 110


def export_modelica(model: FlatModel, path: str | Path) -> Path:
    """Write a continuous model as plain Modelica, one flat class without any library.

    Names are those of the deck, between quotation marks: ``'motor.angle'``. Parameters carry their values
    and units, with their sources as comments. Nothing in the text makes events: where a law has a corner,
    the text has it too, under ``noEvent``.

    Parameters
    ----------
    model
        Continuous and smooth, as ``flatten`` gives it.
    path
        File to write, by custom ``NAME.mo``.

    Returns
    -------
    Path
        The file.

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
    _refuse(model)
    groups = (model.states, model.inputs, model.parameters, model.outputs, model.signals)
    names = quoted_names(v.name for group in groups for v in group)
    equations = modelica_equations(model, names)
    name = class_name(model.name)
    lines = [
        *_head(model),
        f"model {name} {string(model.description)}",
        *_declarations(model, names, equations),
        "equation",
        *_equations(equations),
        "  annotation (experiment(StopTime = 1.0, Tolerance = 1e-8));",
        f"end {name};",
    ]
    return stamped("\n".join(lines) + "\n", model)


def _refuse(model: FlatModel) -> None:
    if model.sample_time is not None or model.tables:
        raise ExportError(
            f"model '{model.name}'",
            "is sampled, and Modelica text is written of continuous models",
            next_step="export it as C or FMU: nlsdesign export c, nlsdesign export fmu",
        )
    if model.switching is not None and model.switching.jumps:
        raise ExportError(
            f"model '{model.name}': '{model.switching.jumps[0]}'",
            "is sharp, and its sticking and impacts have no plain Modelica text",
            next_step="export the smooth form (--smooth, or flatten(smoothed(assembly))), or the plant as "
            "FMU, which holds the sharp form",
        )


def _head(model: FlatModel) -> list[str]:
    about = comment(f"{model.name}: {model.description}")
    return [
        f"/* {about}",
        "   All numbers in SI units. Relations are under noEvent: the text has no events.",
        *origin_lines(model),
        f"   Written by nlsdesign {version()} with CasADi {ca.CasadiMeta.version()}; do not edit. */",
    ]


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
            attributes = _attributes(v, starts=starts, fixed=state)
            value = f" = {literal(v.start)}" if parameter else ""
            about = f"  // {_evidence(v)}" if parameter and _evidence(v) else ""
            yield f"  {shown} {names[v.name]}({attributes}){value} {string(v.description)};{about}"
    if equations.common:
        yield "protected"
        yield from (f"  Real {name};" for name in equations.common)


def _attributes(v: Variable, *, starts: bool, fixed: bool) -> str:
    parts = [f"unit = {string(modelica_unit(v.unit))}"]
    parts += [f"start = {literal(v.start)}"] if starts else []
    parts += ["fixed = true"] if fixed else []
    parts += [f"nominal = {literal(v.nominal)}"] if fixed else []
    limits = {"min": v.minimum, "max": v.maximum}
    return ", ".join(parts + [f"{k} = {literal(n)}" for k, n in limits.items() if abs(n) != float("inf")])


def _evidence(v: Variable) -> str:
    source = comment(v.source) or NOT_STATED
    return f"{source}; ± {v.spread * 100:g} %" if v.spread else source


def _equations(equations: ModelicaEquations) -> Iterator[str]:
    sides = [*equations.definitions.items()]
    sides += [(f"der({name})", right) for name, right in equations.derivatives.items()]
    for left, right in sides:
        yield from textwrap.wrap(
            f"{left} = {right};", _WIDTH, initial_indent="  ", subsequent_indent="      ",
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
