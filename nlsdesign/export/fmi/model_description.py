"""modelDescription.xml and the other XML files of an FMU, for FMI 2.0 and 3.0.

Dependencies of outputs and derivatives, from the operations of their expressions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import casadi as ca

from ...foundation.locations import version as own_version
from ...foundation.quantity import BASE, parse_unit
from ...model.flat import Symbols
from ..c.c_text import identifier
from ..files import xml_text
from .fmu_documentation import Authorship, described
from .fmu_sources import main_source
from .fmu_variables import (
    FLANGE,
    RELATIVE_TOLERANCE,
    Dependence,
    FmuLayout,
    FmuVariable,
    dependences,
    terminals,
)


@dataclass(frozen=True)
class FmiUnknown:
    """One unknown of the model structure, as FMI calls it."""

    variable: FmuVariable
    dependencies: tuple[int, ...]  # value references of the knowns it depends on
    kinds: tuple[str, ...]  # their kinds as FMI names them


@dataclass(frozen=True)
class ModelStructure:
    """The model structure."""

    # outputs, derivatives: depend on inputs, continuous states and time
    outputs: tuple[FmiUnknown, ...]
    derivatives: tuple[FmiUnknown, ...]
    initial: tuple[FmiUnknown, ...]  # computed at the start; these depend also on parameters and start values


def model_structure(layout: FmuLayout) -> ModelStructure:
    """Return the model structure of an FMU."""
    model = layout.model
    s = model.symbols()
    given = [(v, s.state[i]) for i, v in enumerate(layout.states) if v.causality == "output"]
    own = {v.name: i for i, v in enumerate(model.outputs)}
    given += [(v, ca.densify(s.output)[own[v.variable.name]]) for v in layout.outputs]
    rates = [(v, ca.densify(s.derivative)[i]) for i, v in enumerate(layout.derivatives)]
    dependencies = {v.reference: kinds for v, kinds in _kinds(layout, s, [*given, *rates])}

    running = {0, *[v.reference for v in layout.inputs]}
    if model.sample_time is None:
        running |= {v.reference for v in layout.states}

    def entry(variable: FmuVariable, *, initial: bool) -> FmiUnknown:
        kinds = {
            reference: "dependent" if initial and kind != "constant" else kind
            for reference, kind in sorted(dependencies[variable.reference].items())
            if initial or reference in running
        }
        return FmiUnknown(variable, tuple(kinds), tuple(kinds.values()))

    outputs, derivatives = [v for v, _ in given], [v for v, _ in rates]
    computed = sorted([*layout.outputs, *derivatives], key=lambda v: v.reference)
    return ModelStructure(
        tuple(entry(v, initial=False) for v in outputs),
        tuple(entry(v, initial=False) for v in derivatives),
        tuple(entry(v, initial=True) for v in computed),
    )


def _kinds(
    layout: FmuLayout, s: Symbols, unknowns: Sequence[tuple[FmuVariable, ca.SX]]
) -> list[tuple[FmuVariable, dict[int, str]]]:
    """Return for each unknown the value references it depends on, each with its kind.

    They are read off the operations, not off the slopes: a rounded or compared value depends on what is
    rounded, though its slope is zero.
    """
    model = layout.model
    knowns = [layout.time, *layout.states, *layout.inputs, *layout.parameters]
    place = {each.variable.name: number for number, each in enumerate(knowns)}
    symbols = [[place[v.variable.name] for v in group] for group in (layout.states, layout.inputs)]
    symbols = [[0], *symbols, [place[v.variable.name] for v in layout.parameters]]
    symbols.append([place[table.argument] for table in model.tables for _ in table.columns])
    changing = sum(1 << number for number in range(1 + len(layout.states) + len(layout.inputs)))
    expressions = ca.SX(ca.vertcat(*[e for _, e in unknowns]))
    groups = [s.time, s.state, s.input, s.parameter, s.table]
    of_each = dependences(ca.Function("unknowns", groups, [ca.densify(expressions)]), symbols, changing)
    tuned = "fixed" if model.sample_time is None else "tunable"

    def kind(of: Dependence, bit: int) -> str:
        return "dependent" if of.nonlinear & bit else tuned if of.scaled & bit else "constant"

    return [
        (variable, {each.reference: kind(of, 1 << i) for i, each in enumerate(knowns) if of.on & (1 << i)})
        for (variable, _), of in zip(unknowns, of_each, strict=True)
    ]


LOG_CATEGORIES = {
    "logStatusError": "What could not be done, and why",
    "logStatusWarning": "Inputs outside the range for which the laws are stated",
    "logSolver": "Steps of the integrator",
}
# Exponents of the base units of quantities that are shown in degrees.
_SHOWN: Mapping[tuple[int, ...], str] = {(0, 0, 0, 0, 0, 1): "deg", (0, 0, -1, 0, 0, 1): "deg/s"}


def model_description(
    layout: FmuLayout, *, version: str, token: str, step: float, authorship: Authorship | None = None
) -> str:
    """Return ``modelDescription.xml``.

    ``authorship``: author, licence and date; nothing but the licence of the templates by default.
    """
    model, two = layout.model, version == "2.0"
    root = _element(
        None,
        "fmiModelDescription",
        fmiVersion=version,
        modelName=model.name,
        **{"guid" if two else "instantiationToken": token},
        description=described(model.description, model.origin),
        **(authorship or Authorship()).attributes(model.origin),
        generationTool=f"nlsdesign {own_version()}",
        variableNamingConvention="structured",
        **({"numberOfEventIndicators": len(layout.indicators)} if two else {}),
    )
    if model.sample_time is None:
        _model_exchange(root, layout, two)
    _co_simulation(root, layout, two)
    _units(root, layout)
    categories = ElementTree.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        _element(categories, "Category", name=name, description=text)
    experiment = _element(root, "DefaultExperiment", startTime=0.0, stopTime=1000 * step)
    if model.sample_time is None:
        experiment.set("tolerance", _text(RELATIVE_TOLERANCE))
    experiment.set("stepSize", _text(step))
    if two and model.origin:
        tool = _element(ElementTree.SubElement(root, "VendorAnnotations"), "Tool", name="nlsdesign")
        _element(tool, "deck", name=model.origin.deck, sha256=model.origin.digest)
    variables = ElementTree.SubElement(root, "ModelVariables")
    for each in layout.everything:
        (_variable2 if two else _variable3)(variables, each)
    structure = ElementTree.SubElement(root, "ModelStructure")
    (_structure2 if two else _structure3)(structure, model_structure(layout))
    for each in () if two else layout.indicators:
        _element(structure, "EventIndicator", valueReference=each.reference)
    if not two and model.origin:
        notes = ElementTree.SubElement(root, "Annotations")
        note = _element(notes, "Annotation", type="nlsdesign.deck")
        _element(note, "deck", name=model.origin.deck, sha256=model.origin.digest)
    return xml_text(root)


def build_description(layout: FmuLayout) -> str:
    """Return ``sources/buildDescription.xml`` of FMI 3.0."""
    root = _element(None, "fmiBuildDescription", fmiVersion="3.0")
    configuration = _element(root, "BuildConfiguration", modelIdentifier=identifier(layout.model.name))
    files = _element(configuration, "SourceFileSet", language="C99")
    _element(files, "SourceFile", name=main_source("3.0"))
    return xml_text(root)


def terminals_and_icons(layout: FmuLayout) -> str:
    """Return ``terminalsAndIcons/terminalsAndIcons.xml`` of FMI 3.0: icon and terminals with their places."""
    root = _element(None, "fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = ElementTree.SubElement(root, "GraphicalRepresentation")
    corners = {"x1": -100.0, "y1": -100.0, "x2": 100.0, "y2": 100.0}
    _element(picture, "CoordinateSystem", **corners, suggestedScalingFactorTo_mm=0.1)
    _element(picture, "Icon", **corners)
    every = terminals(layout.model)
    group = ElementTree.SubElement(root, "Terminals") if every else root
    beside = [each for each in every if each.picture == FLANGE]
    for each in every:
        # The bus on the left, flanges on the right, one above the other.
        right = each in beside
        x = 100.0 if right else -100.0
        y = 100.0 - 200.0 * (beside.index(each) + 1) / (len(beside) + 1) if right else 0.0
        names = {"name": each.name, "matchingRule": each.rule, "terminalKind": each.kind}
        terminal = _element(group, "Terminal", **names, description=each.description)
        for member in each.members:
            _element(
                terminal, "TerminalMemberVariable", variableName=member.variable, memberName=member.name,
                variableKind=member.kind,
            )  # fmt: skip
        edges = {"x1": x - 10.0, "y1": y - 10.0, "x2": x + 10.0, "y2": y + 10.0}
        _element(terminal, "TerminalGraphicalRepresentation", **edges, iconBaseName=each.picture)
    return xml_text(root)


def _model_exchange(root: ElementTree.Element, layout: FmuLayout, two: bool) -> None:
    located = bool(layout.indicators)
    kind = _element(
        root,
        "ModelExchange",
        modelIdentifier=identifier(layout.model.name),
        **({"canGetAndSetFMUstate" if two else "canGetAndSetFMUState": True}),
        **({"canSerializeFMUstate" if two else "canSerializeFMUState": True}),
        **({"providesDirectionalDerivative" if two else "providesDirectionalDerivatives": True}),
        # A step may have gone past an event that its integrator has not seen.
        **(
            {"completedIntegratorStepNotNeeded": not located}
            if two
            else {"needsCompletedIntegratorStep": located}
        ),
    )
    if two:
        kind.set("canNotUseMemoryManagementFunctions", "true")
        _element(_element(kind, "SourceFiles"), "File", name=main_source("2.0"))


def _co_simulation(root: ElementTree.Element, layout: FmuLayout, two: bool) -> None:
    continuous = layout.model.sample_time is None
    kind = _element(
        root,
        "CoSimulation",
        modelIdentifier=identifier(layout.model.name),
        canHandleVariableCommunicationStepSize=True,
        **({"canGetAndSetFMUstate" if two else "canGetAndSetFMUState": True}),
        **({"canSerializeFMUstate" if two else "canSerializeFMUState": True}),
        **({"providesDirectionalDerivative" if two else "providesDirectionalDerivatives": True}),
    )
    if two:
        kind.set("canNotUseMemoryManagementFunctions", "true")
        _element(_element(kind, "SourceFiles"), "File", name=main_source("2.0"))
    elif layout.indicators:
        kind.set("hasEventMode", "true")
        kind.set("mightReturnEarlyFromDoStep", "true")
    elif not continuous:
        kind.set("fixedInternalStepSize", _text(layout.model.sample_time))


def _units(root: ElementTree.Element, layout: FmuLayout) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for text in sorted({each.variable.unit for each in layout.reals}):
        unit = parse_unit(text)
        element = _element(definitions, "Unit", name=text)
        base = {name: power for name, power in zip(BASE, unit.exponents, strict=True) if power}
        _element(element, "BaseUnit", **base, **({"factor": unit.factor} if unit.factor != 1.0 else {}))
        shown = display_unit(text)
        if shown:
            _element(element, "DisplayUnit", name=shown, factor=unit.factor * 180.0 / math.pi)


def display_unit(unit: str) -> str | None:
    """Return the unit in which a value is shown, or ``None`` for its own.

    ``unit``: SI unit; angles are shown in degrees.
    """
    return _SHOWN.get(parse_unit(unit).exponents)


def _attributes(each: FmuVariable) -> dict[str, object]:
    """Return unit, range and start as both versions name them."""
    v = each.variable
    attributes: dict[str, object] = {"unit": v.unit}
    if display_unit(v.unit):
        attributes["displayUnit"] = display_unit(v.unit)
    if v.minimum > -math.inf:
        attributes["min"] = v.minimum
    if v.maximum < math.inf:
        attributes["max"] = v.maximum
    size = v.start if each.causality == "parameter" or each.variability == "constant" else v.nominal
    if each.causality != "independent" and size:
        attributes["nominal"] = abs(size)
    if each.has_start:
        attributes["start"] = v.start
    return attributes


def _common(each: FmuVariable) -> dict[str, object]:
    v = each.variable
    text = v.description + (f" (source: {v.source})" if v.source else "")
    attributes: dict[str, object] = {"name": v.name, "valueReference": each.reference, "description": text}
    attributes |= {"causality": each.causality, "variability": each.variability}
    return attributes | ({"initial": each.initial} if each.initial else {})


def _variable2(parent: ElementTree.Element, each: FmuVariable) -> None:
    scalar = _element(parent, "ScalarVariable", **_common(each))
    if each.integer:
        _element(scalar, "Integer")
        return
    real = _element(scalar, "Real", **_attributes(each))
    if each.derivative_of is not None:
        real.set("derivative", str(each.derivative_of + 1))


def _variable3(parent: ElementTree.Element, each: FmuVariable) -> None:
    if each.integer:
        _element(parent, "Int32", **_common(each))
        return
    real = _element(parent, "Float64", **_common(each), **_attributes(each))
    if each.derivative_of is not None:
        real.set("derivative", str(each.derivative_of))


def _structure2(parent: ElementTree.Element, structure: ModelStructure) -> None:
    # Variables stand in the order of their references, so the index is the reference + 1.
    for name, unknowns in (
        ("Outputs", structure.outputs),
        ("Derivatives", structure.derivatives),
        ("InitialUnknowns", structure.initial),
    ):
        if unknowns:
            group = ElementTree.SubElement(parent, name)
            for each in unknowns:
                _element(group, "Unknown", index=each.variable.reference + 1, **_dependencies(each, 1))


def _structure3(parent: ElementTree.Element, structure: ModelStructure) -> None:
    for name, unknowns in (
        ("Output", structure.outputs),
        ("ContinuousStateDerivative", structure.derivatives),
        ("InitialUnknown", structure.initial),
    ):
        for each in unknowns:
            _element(parent, name, valueReference=each.variable.reference, **_dependencies(each, 0))


def _dependencies(each: FmiUnknown, offset: int) -> Mapping[str, object]:
    return {
        "dependencies": " ".join(str(reference + offset) for reference in each.dependencies),
        "dependenciesKind": " ".join(each.kinds),
    }


def _element(parent: ElementTree.Element | None, tag: str, /, **attributes: object) -> ElementTree.Element:
    written = {key: _text(value) for key, value in attributes.items()}
    return (
        ElementTree.Element(tag, written) if parent is None else ElementTree.SubElement(parent, tag, written)
    )


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(float(value)) if isinstance(value, float) else str(value)
