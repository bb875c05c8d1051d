"""Names of the SSP standard: namespaces, entries of an archive, and the annotation of this package.

The namespaces are the same in SSP 1.0 and 2.0; 2.0 adds the types of FMI 3. Neither knows a delay of a
connection or an order of instances; both stand in annotations, which other tools may ignore.
"""

from __future__ import annotations

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
