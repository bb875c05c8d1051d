"""A co-simulated system as an SSP archive, written and read.

The archive holds FMUs, connections with gains, units and parameter values. The namespaces are the same in
SSP 1.0 and 2.0; 2.0 adds the types of FMI 3. Neither knows a delay of a connection or an order of instances;
both stand in annotations, which other tools may ignore.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

from ...foundation.errors import ExportError, UnitError, ValueRangeError
from ...foundation.locations import version as package_version
from ...foundation.quantity import BASE, Quantity, Unit, parse_unit
from ..files import write_archive, xml_text
from .cosimulate import FmuSystem, check_order, check_signals, unpacked_fmus
from .fmu_description import FmuDescription, FmuScalar, fit_to_show, unpack
from .run_plan import Wire, as_wire, check_wires, delay_of, gain_to, split_name

VERSIONS = ("1.0", "2.0")
STRUCTURE_FILE = "SystemStructure.ssd"
RESOURCES = "resources"
_BASE = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "ssd": f"{_BASE}Description",
    "ssc": f"{_BASE}Common",
    "ssv": f"{_BASE}ParameterValues",
    "nls": "urn:nlsdesign:cosimulation",
}
ANNOTATION = "nlsdesign.cosimulation"
"""Type of the annotations of this package."""


def tag(name: str) -> str:
    """Return the full name of an element."""
    space, _, local = name.partition(":")
    return f"{{{NAMESPACES[space]}}}{local}"


_FMU = "application/x-fmu-sharedlibrary"
_VALUES = "application/x-ssp-parameter-set"
_NUMBERS = ("Real", "Float64", "Float32", "Integer", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16",
            "UInt32", "UInt64")  # fmt: skip


def read_ssp(path: str | Path, folder: str | Path) -> FmuSystem:
    """Read an archive of the standard System Structure and Parameterization, version 1.0 or 2.0.

    Read are flat systems of FMUs: connections with linear gains, parameter values, and, where this package
    wrote them, delays and the order of instances. Inputs of the system are the inputs of its FMUs.

    Parameters
    ----------
    path
        The archive.
    folder
        Where it is unpacked, for as long as the system is used; made if it does not exist.

    Returns
    -------
    FmuSystem
        Its ``run`` simulates it.

    Raises
    ------
    ExportError
        If the archive is damaged, is of another version, or holds what is not read: a system within the
        system, a component that is no FMU, another transformation than a gain, a mapping of parameters.
    """
    what, place = f"system {path}", Path(folder)
    unpack(what, Path(path), place, needs=STRUCTURE_FILE)
    root = _parsed(what, place / STRUCTURE_FILE)
    if root.tag != tag("ssd:SystemStructureDescription"):
        raise ExportError(what, f"{STRUCTURE_FILE} is no description of a system")
    version = root.get("version", "")
    if version not in VERSIONS and not version.startswith("1."):
        stated = fit_to_show(version)
        raise ExportError(what, f"is of SSP version '{stated}'; read are {', '.join(VERSIONS)}")
    system = root.find("ssd:System", NAMESPACES)
    if system is None:
        raise ExportError(what, f"{STRUCTURE_FILE} holds no system")
    return _Reader(what, place, system).system()


def _parsed(what: str, file: Path) -> ElementTree.Element:
    try:
        return ElementTree.parse(file).getroot()
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ExportError(f"{what}, {file.name}", f"is no valid XML: {fit_to_show(error)}") from error
    except OSError as error:
        raise ExportError(f"{what}, {file.name}", f"cannot be read ({error.strerror or error})") from error


class _Reader:
    """Reads one system whose archive is unpacked."""

    def __init__(self, what: str, folder: Path, system: ElementTree.Element) -> None:
        self._what, self._folder, self._root = what, folder, system
        self._components: dict[str, ElementTree.Element] = {}

    def system(self) -> FmuSystem:
        """Return the FMUs and what joins them."""
        for element in self._root.findall("ssd:Elements/*", NAMESPACES):
            if element.tag != tag("ssd:Component"):
                kind = element.tag.rpartition("}")[2]
                raise self._refused(f"{kind} '{fit_to_show(element.get('name'))}'", "only FMUs are read")
            self._components[self._needed(element, "name")] = element
        fmus = {}
        for name, element in self._components.items():
            thing = f"component '{fit_to_show(name)}'"
            if element.get("type", _FMU) != _FMU:
                kind = fit_to_show(element.get("type"))
                raise self._refused(thing, f"is of type {kind}; only FMUs are read")
            fmus[name] = self._file(thing, self._needed(element, "source"))
        if not fmus:
            raise ExportError(self._what, "holds no FMU")
        wires = dict(self._wires())
        parameters = self._bound(self._root, "")
        for name, element in self._components.items():
            parameters |= self._bound(element, f"{name}.")
        order = self._root.find("ssd:Annotations/ssc:Annotation/nls:Order", NAMESPACES)
        names = tuple(order.get("instances", "").split()) if order is not None else ()
        return FmuSystem(fmus=fmus, wires=wires, parameters=parameters, order=names)

    def _refused(self, thing: str, rule: str) -> ExportError:
        return ExportError(f"{self._what}, {thing}", rule)

    def _needed(self, element: ElementTree.Element, attribute: str) -> str:
        value = element.get(attribute)
        if not value:
            kind = element.tag.rpartition("}")[2]
            raise self._refused(f"a {kind}", f"has no {attribute}")
        return value

    def _file(self, thing: str, source: str) -> Path:
        """Return a file of the archive."""
        file = (self._folder / unquote(source)).resolve()
        if not file.is_relative_to(self._folder.resolve()) or not file.is_file():
            raise self._refused(thing, f"'{fit_to_show(source)}' is no file of the archive")
        return file

    def _connector(self, element: str, name: str) -> ElementTree.Element:
        if element not in self._components:
            raise self._refused("a Connection", f"leads to the unknown component '{fit_to_show(element)}'")
        for connector in self._components[element].findall("ssd:Connectors/ssd:Connector", NAMESPACES):
            if connector.get("name") == name:
                return connector
        raise self._refused(f"component '{fit_to_show(element)}'", f"has no connector '{fit_to_show(name)}'")

    def _wires(self) -> Iterator[tuple[str, Wire]]:
        for connection in self._root.findall("ssd:Connections/ssd:Connection", NAMESPACES):
            names = [self._needed(connection, f"{end}Connector") for end in ("start", "end")]
            owners = [connection.get(f"{end}Element") for end in ("start", "end")]
            if None in owners:
                continue  # an input or output of the system: that of the component, by its own name
            both = [(str(o), n, self._connector(str(o), n)) for o, n in zip(owners, names, strict=True)]
            # Start and end say nothing of the direction, the kinds of the connectors do.
            kinds = [connector.get("kind") for _, _, connector in both]
            if kinds == ["input", "output"]:
                both.reverse()
            elif kinds != ["output", "input"]:
                raise self._refused(
                    f"the connection to '{fit_to_show(names[1])}'", "joins no output with an input"
                )
            (start, output, source), (end, taken, target) = both
            delay = connection.find("ssd:Annotations/ssc:Annotation/nls:Delay", NAMESPACES)
            seconds = 0.0 if delay is None else self._number(delay, "seconds")
            gain = self._gain(connection, source, target)
            yield f"{end}.{taken}", Wire(f"{start}.{output}", gain=gain, delay=seconds)

    def _gain(
        self, connection: ElementTree.Element, source: ElementTree.Element, target: ElementTree.Element
    ) -> float | Quantity:
        """Return the gain; one of the FMUs' own units where the connection converts no units."""
        factor = 1.0
        for change in connection:
            kind = change.tag.rpartition("}")[2]
            if kind == "LinearTransformation":
                factor = self._number(change, "factor", 1.0)
                if self._number(change, "offset", 0.0):
                    raise self._refused("a LinearTransformation", "has an offset, which a wire has not")
            elif kind.endswith("Transformation"):
                raise self._refused(f"a {kind}", "is not read, only a LinearTransformation")
        units = [_unit(connector) for connector in (source, target)]
        of, to = units
        if of is None or to is None or of.text == to.text:
            return factor
        if connection.get("suppressUnitConversion") in ("true", "1"):
            exponents = [a - b for a, b in zip(to.exponents, of.exponents, strict=True)]
            text = "*".join(["1", *(f"{n}^{p}" for n, p in zip(BASE, exponents, strict=True) if p)])
            return Quantity(factor * to.factor / of.factor, text)
        return Quantity(factor, "1")

    def _number(self, element: ElementTree.Element, attribute: str, default: float = math.nan) -> float:
        text = element.get(attribute)
        try:
            value = default if text is None else float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            kind = element.tag.rpartition("}")[2]
            raise self._refused(f"a {kind}", f"{attribute}='{fit_to_show(text)}' is no number")
        return value

    def _bound(self, element: ElementTree.Element, owner: str) -> dict[str, float]:
        """Return the parameter values that are bound to a component, or to the system with its full names."""
        values: dict[str, float] = {}
        for binding in element.findall("ssd:ParameterBindings/ssd:ParameterBinding", NAMESPACES):
            if binding.find("ssd:ParameterMapping", NAMESPACES) is not None:
                raise self._refused("a ParameterMapping", "is not read; bind parameters by their own names")
            if binding.get("type", _VALUES) != _VALUES:
                raise self._refused("a ParameterBinding", f"is of type {fit_to_show(binding.get('type'))}")
            inline = binding.find("ssd:ParameterValues/ssv:ParameterSet", NAMESPACES)
            if inline is None:
                source = self._needed(binding, "source")
                inline = _parsed(self._what, self._file("a ParameterBinding", source))
            prefix = owner + binding.get("prefix", "")
            for row in inline.findall("ssv:Parameters/ssv:Parameter", NAMESPACES):
                number = next((kind for kind in row if kind.tag.rpartition("}")[2] in _NUMBERS), None)
                if number is None:
                    thing = f"parameter '{fit_to_show(row.get('name'))}'"
                    raise self._refused(thing, "has no number as its value")
                value = self._number(number, "value")
                values[prefix + self._needed(row, "name")] = value
        return values


def _unit(connector: ElementTree.Element) -> Unit | None:
    for kind in connector:
        text = kind.get("unit")
        if text:
            try:
                return parse_unit(text)
            except UnitError:
                return None  # a name of a foreign tool; the FMUs' own units are checked when it runs
    return None


@dataclass(frozen=True)
class WrittenSystem:
    """An SSP archive that was written."""

    path: Path
    # notes: what the standard has no place for: kept in annotations, which other tools may ignore
    notes: tuple[str, ...]


def write_ssp(
    path: str | Path,
    *,
    fmus: Mapping[str, str | Path],
    wires: Mapping[str, str | Wire],
    parameters: Mapping[str, float] | None = None,
    order: Sequence[str] = (),
    inputs: Sequence[str] = (),
    version: str = "1.0",
) -> WrittenSystem:
    """Write FMUs and their wires as one archive of the standard System Structure and Parameterization.

    Gains are linear transformations of the connections, parameters a file of values per FMU. Delays and the
    order of sampled instances have no place in the standard: they are written as annotations, which
    :func:`read_ssp` reads.

    Parameters
    ----------
    path
        File to write, usually ``.ssp``.
    fmus, wires, parameters, order
        As in :func:`~nlsdesign.export.cosimulate`.
    inputs
        Inputs of FMUs that become inputs of the system, called ``instance_variable``, for other tools to
        drive. The others keep their start values, or those in ``parameters``.
    version
        ``"1.0"`` or ``"2.0"``.

    Raises
    ------
    ValueRangeError
        If the version is another, or the order does not name each instance once.
    UnknownNameError
        If a wire or parameter names what does not exist, with the nearest that does.
    UnitError
        If a wire joins different units.
    ExportError
        If an FMU cannot be read or the archive not be written.
    """
    if version not in VERSIONS:
        raise ValueRangeError(f"SSP version '{version}'", f"is none of {', '.join(VERSIONS)}")
    joined = {target: as_wire(source) for target, source in wires.items()}
    given = dict(parameters or {})
    check_order(order, fmus)
    with tempfile.TemporaryDirectory(prefix="nlsdesign-ssp-") as folder:
        descriptions = unpacked_fmus(fmus, Path(folder))
        check_wires(descriptions, joined)
        check_signals(descriptions, joined, dict.fromkeys(inputs, lambda _: 0.0), given)
        writer = _Structure(descriptions, joined, given, (tuple(order), tuple(inputs)), version)
        entries: dict[str, bytes] = {STRUCTURE_FILE: writer.structure(Path(path).stem)}
        entries |= writer.values()
        for name, file in fmus.items():
            try:
                entries[f"{RESOURCES}/{name}.fmu"] = Path(file).read_bytes()
            except OSError as error:
                raise ExportError(str(file), f"cannot be read ({error.strerror or error})") from error
    write_archive(Path(path), entries)
    return WrittenSystem(Path(path), tuple(writer.notes))


class _Structure:
    """Writes the XML files of one system."""

    def __init__(
        self,
        descriptions: Mapping[str, FmuDescription],
        wires: Mapping[str, Wire],
        parameters: Mapping[str, float],
        order_and_inputs: tuple[tuple[str, ...], tuple[str, ...]],
        version: str,
    ) -> None:
        self._descriptions, self._wires = descriptions, wires
        self._order, self._inputs = order_and_inputs
        self._parameters, self._version = parameters, version
        self.notes: list[str] = []
        for prefix, address in NAMESPACES.items():
            ElementTree.register_namespace(prefix, address)

    def structure(self, name: str) -> bytes:
        """Return the file that describes the system."""
        root = ElementTree.Element(
            tag("ssd:SystemStructureDescription"),
            {"version": self._version, "name": name, "generationTool": f"nlsdesign {package_version()}"},
        )
        system = ElementTree.SubElement(root, tag("ssd:System"), {"name": name})
        opened = self._open_inputs()
        if opened:
            connectors = ElementTree.SubElement(system, tag("ssd:Connectors"))
            for full, description, variable in opened:
                self._connector(connectors, full, "input", description, variable)
        elements = ElementTree.SubElement(system, tag("ssd:Elements"))
        for description in self._descriptions.values():
            self._component(elements, description)
        if opened or self._wires:
            connections = ElementTree.SubElement(system, tag("ssd:Connections"))
            for full, description, variable in opened:
                ends = {
                    "startConnector": full,
                    "endElement": description.instance,
                    "endConnector": variable.name,
                }
                ElementTree.SubElement(connections, tag("ssd:Connection"), ends)
            for target, wire in self._wires.items():
                self._connection(connections, target, wire)
        if self._order:
            self._annotate(system, "Order", {"instances": " ".join(self._order)})
            self.notes.append(f"the order in which sampled instances compute: {', '.join(self._order)}")
        self._units(root)
        return xml_text(root).encode()

    def values(self) -> dict[str, bytes]:
        """Return a file of parameter values for each instance that has some."""
        files: dict[str, bytes] = {}
        for name, description in self._descriptions.items():
            own = self._own_parameters(name)
            if not own:
                continue
            root = ElementTree.Element(
                tag("ssv:ParameterSet"), {"version": self._version, "name": f"{name} parameters"}
            )
            rows = ElementTree.SubElement(root, tag("ssv:Parameters"))
            for variable, value in own.items():
                row = ElementTree.SubElement(rows, tag("ssv:Parameter"), {"name": variable})
                described = description.variables[variable]
                unit = {"unit": described.unit} if described.unit else {}
                shown = repr(value) if described.kind == "real" else str(int(value))
                kind = self._type(description, described)
                unit = unit if described.kind == "real" else {}
                ElementTree.SubElement(row, tag(f"ssv:{kind}"), {"value": shown, **unit})
            self._units(root, [description.variables[each] for each in own], "ssv:Units")
            files[_values_file(name)] = xml_text(root).encode()
        return files

    def _own_parameters(self, name: str) -> dict[str, float]:
        rows = ((split_name(full), value) for full, value in self._parameters.items())
        return {variable: value for (instance, variable), value in rows if instance == name}

    def _open_inputs(self) -> list[tuple[str, FmuDescription, FmuScalar]]:
        opened = []
        for full in self._inputs:
            instance, variable = split_name(full)
            description = self._descriptions[instance]
            # Not with a dot: tools that name a connector by its path would have the name twice.
            opened.append((f"{instance}_{variable}", description, description.variables[variable]))
        return opened

    def _type(self, description: FmuDescription, variable: FmuScalar) -> str:
        """Return the type of a variable: SSP 2.0 has those of FMI 3."""
        real = variable.kind == "real"
        if self._version == "2.0" and description.version == "3.0":
            return "Float64" if real else "Int32"
        return "Real" if real else "Integer"

    def _connector(
        self,
        parent: ElementTree.Element,
        name: str,
        kind: str,
        description: FmuDescription,
        variable: FmuScalar,
    ) -> None:
        connector = ElementTree.SubElement(parent, tag("ssd:Connector"), {"name": name, "kind": kind})
        unit = {"unit": variable.unit} if variable.unit and variable.kind == "real" else {}
        ElementTree.SubElement(connector, tag(f"ssc:{self._type(description, variable)}"), unit)

    def _component(self, parent: ElementTree.Element, description: FmuDescription) -> None:
        name = description.instance
        component = ElementTree.SubElement(
            parent,
            tag("ssd:Component"),
            {
                "name": name,
                "type": "application/x-fmu-sharedlibrary",
                "source": f"{RESOURCES}/{name}.fmu",
                "implementation": "CoSimulation",
            },
        )
        parameters = self._own_parameters(name)
        connectors = ElementTree.SubElement(component, tag("ssd:Connectors"))
        for variable in description.variables.values():
            if variable.causality in ("input", "output"):
                self._connector(connectors, variable.name, variable.causality, description, variable)
            elif variable.causality == "parameter" and variable.name in parameters:
                self._connector(connectors, variable.name, "parameter", description, variable)
        if parameters:
            bindings = ElementTree.SubElement(component, tag("ssd:ParameterBindings"))
            ElementTree.SubElement(bindings, tag("ssd:ParameterBinding"), {"source": _values_file(name)})

    def _connection(self, parent: ElementTree.Element, target: str, wire: Wire) -> None:
        (start, output), (end, taken) = split_name(wire.source), split_name(target)
        ends = {"startElement": start, "startConnector": output, "endElement": end, "endConnector": taken}
        if isinstance(wire.gain, Quantity):
            # The factor is that between the numbers of both ends, units included.
            ends["suppressUnitConversion"] = "true"
        connection = ElementTree.SubElement(parent, tag("ssd:Connection"), ends)
        gain = gain_to(self._descriptions, target, wire)
        if gain != 1.0:
            ElementTree.SubElement(connection, tag("ssc:LinearTransformation"), {"factor": repr(gain)})
        delay = delay_of(self._descriptions, wire)
        if delay:
            self._annotate(connection, "Delay", {"seconds": repr(delay)})
            self.notes.append(f"the delay of {delay:g} s from {wire.source} to {target}")

    def _annotate(self, parent: ElementTree.Element, name: str, content: dict[str, str]) -> None:
        notes = ElementTree.SubElement(parent, tag("ssd:Annotations"))
        note = ElementTree.SubElement(notes, tag("ssc:Annotation"), {"type": ANNOTATION})
        ElementTree.SubElement(note, tag(f"nls:{name}"), content)

    def _units(
        self,
        root: ElementTree.Element,
        variables: Sequence[FmuScalar] | None = None,
        group: str = "ssd:Units",
    ) -> None:
        """Write the units with their base units; one that cannot be read here is left to the FMU."""
        shown = variables if variables is not None else self._connected()
        texts = sorted({variable.unit for variable in shown if variable.unit and variable.kind == "real"})
        rows = []
        for text in texts:
            try:
                rows.append((text, parse_unit(text)))
            except UnitError:
                continue  # a name of a foreign FMU; the unit stays a plain name
        if not rows:
            return
        units = ElementTree.SubElement(root, tag(group))
        for text, unit in rows:
            element = ElementTree.SubElement(units, tag("ssc:Unit"), {"name": text})
            base = {n: str(power) for n, power in zip(BASE, unit.exponents, strict=True) if power}
            if not math.isclose(unit.factor, 1.0, rel_tol=0.0, abs_tol=0.0):
                base["factor"] = repr(unit.factor)
            ElementTree.SubElement(element, tag("ssc:BaseUnit"), base)

    def _connected(self) -> list[FmuScalar]:
        parameters = set(self._parameters)
        return [
            variable
            for name, description in self._descriptions.items()
            for variable in description.variables.values()
            if variable.causality in ("input", "output") or f"{name}.{variable.name}" in parameters
        ]


def _values_file(name: str) -> str:
    return f"{RESOURCES}/{name}.ssv"
