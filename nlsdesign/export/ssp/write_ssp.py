"""A co-simulated system written as an SSP archive: FMUs, connections with gains, units, parameter values."""

from __future__ import annotations

import math
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ...foundation.errors import ExportError, UnitError, ValueRangeError
from ...foundation.files import draft
from ...foundation.locations import version as package_version
from ...foundation.quantity import BASE, Quantity, parse_unit
from ..cosimulation.cosimulate import check_order, check_signals, unpacked_fmus
from ..cosimulation.fmu_description import FmuDescription, FmuScalar
from ..cosimulation.wires import Wire, as_wire, check_wires, delay_of, gain_to, split_name
from .system_format import ANNOTATION, NAMESPACES, RESOURCES, STRUCTURE_FILE, VERSIONS, tag

_EPOCH = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class WrittenSystem:
    """An SSP archive that was written.

    Parameters
    ----------
    path
        The archive.
    notes
        What the standard has no place for: kept in annotations, which other tools may ignore.
    """

    path: Path
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
        check_signals(descriptions, joined, dict.fromkeys(inputs, _undriven), given)
        writer = _Structure(descriptions, joined, given, (tuple(order), tuple(inputs)), version)
        entries: dict[str, bytes] = {STRUCTURE_FILE: writer.structure(Path(path).stem)}
        entries |= writer.values()
        for name, file in fmus.items():
            entries[f"{RESOURCES}/{name}.fmu"] = _content(Path(file))
    with draft(Path(path)) as file_name, zipfile.ZipFile(file_name, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.external_attr = 0o644 << 16
            # An FMU is compressed already.
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".fmu") else zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return WrittenSystem(Path(path), tuple(writer.notes))


def _undriven(time: float) -> float:
    return 0.0


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise ExportError(str(file), f"cannot be read ({error.strerror or error})") from error


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
        return _text(root)

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
            files[_values_file(name)] = _text(root)
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


def _text(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    text: str = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()
