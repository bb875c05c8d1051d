"""An SSP archive read as a system of FMUs that ``cosimulate`` can run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

from ...foundation.errors import ExportError, UnitError
from ...foundation.quantity import BASE, Quantity, Unit, parse_unit
from ..cosimulation.cosimulate import FmuSystem
from ..cosimulation.fmu_archive import unpack
from ..cosimulation.foreign_text import fit_to_show
from ..cosimulation.wires import Wire
from .system_format import NAMESPACES, STRUCTURE_FILE, VERSIONS, tag

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
        fmus = {name: self._fmu(name, element) for name, element in self._components.items()}
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

    def _fmu(self, name: str, element: ElementTree.Element) -> Path:
        thing = f"component '{fit_to_show(name)}'"
        if element.get("type", _FMU) != _FMU:
            raise self._refused(thing, f"is of type {fit_to_show(element.get('type'))}; only FMUs are read")
        return self._file(thing, self._needed(element, "source"))

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
                values[prefix + self._needed(row, "name")] = self._value(row)
        return values

    def _value(self, row: ElementTree.Element) -> float:
        for kind in row:
            if kind.tag.rpartition("}")[2] in _NUMBERS:
                return self._number(kind, "value")
        raise self._refused(f"parameter '{fit_to_show(row.get('name'))}'", "has no number as its value")


def _unit(connector: ElementTree.Element) -> Unit | None:
    for kind in connector:
        text = kind.get("unit")
        if text:
            try:
                return parse_unit(text)
            except UnitError:
                return None  # a name of a foreign tool; the FMUs' own units are checked when it runs
    return None
