"""A generated step as a library for PlatformIO, Arduino, Zephyr, CMake and ros2_control."""

from __future__ import annotations

import json
from pathlib import Path

from ...foundation.locations import version
from ..files import filled, write_all
from .c_text import comment
from .provenance import SHORT
from .writer import CSource

_LONGEST = 120
"""Letters of a description: lists of libraries show one line."""
_FILES = {
    "library.json": "package_library.json",
    "library.properties": "package_library.properties",
    "examples/{name}_loop/{name}_loop.ino": "package_sketch.ino",
    "zephyr/module.yml": "package_module.yml",
    "zephyr/CMakeLists.txt": "package_zephyr.txt",
    "zephyr/Kconfig": "package_Kconfig",
    "CMakeLists.txt": "package_CMakeLists.txt",
}
_ROS2_FILES = {
    "ros2_control/{name}_transmission.hpp": "ros2_transmission.hpp",
    "ros2_control/{name}_transmission_loader.cpp": "ros2_loader.cpp",
    "ros2_control/ros2_control_plugins.xml": "ros2_plugins.xml",
    "ros2_control/package.xml": "ros2_package.xml",
    "ros2_control/CMakeLists.txt": "ros2_CMakeLists.txt",
}
_DESIRED = ".desired"


def write_package(source: CSource, folder: Path) -> list[Path]:
    """Write a step as a library with the files that build systems of controllers ask for.

    One folder serves all: ``library.json`` for PlatformIO, ``library.properties`` and a sketch for Arduino,
    ``zephyr/module.yml`` for Zephyr, ``CMakeLists.txt`` for CMake, with what ``find_package`` finds. Observer
    and controller as one step are also a transmission of ros2_control, in ``ros2_control/``.

    Parameters
    ----------
    source
        Files of the step, as :func:`~nlsdesign.export.export_c` writes them.
    folder
        Of the library; is made where it does not exist.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ExportError
        If a file cannot be written.
    """
    name, model = source.name, source.model
    described = comment(model.description).replace('"', "'")
    line = described if len(described) <= _LONGEST else f"{described[: _LONGEST - 3].rstrip()}..."
    values = {
        "name": name,
        "NAME": name.upper(),
        "title": f"/* {described} */",
        "description": json.dumps(line, ensure_ascii=False)[1:-1],
        "version": version(),
        "deck": f"{comment(model.origin.deck)}, {model.origin.digest[:SHORT]}" if model.origin else "none",
        "period": str(round(1e6 * float(model.sample_time or 0.0))),
        "read": [
            f"inputs.{path} = {source.real.literal(0.0)}; /* {comment(v.description)}, {v.unit} */"
            for v, path in zip(model.inputs, source.writer.paths.inputs, strict=True)
        ],
    }
    roles = _transmission_roles(source)
    files = _FILES | _ROS2_FILES if roles else _FILES
    texts = {
        folder / file.format(name=name): filled(template, values | roles) for file, template in files.items()
    }
    for file, place in ((source.header, "src"), (source.source, "src"), (source.selftest, "test")):
        texts[folder / place / file.name] = file.read_text(encoding="utf-8")
    write_all(texts)
    return list(texts)


def _transmission_roles(source: CSource) -> dict[str, str]:
    """Return the members of a step that a transmission reads and gives; empty unless it is a whole loop.

    A loop is one measured angle, one desired torque, its estimate, the speed of what is measured, and a
    command, the last output.
    """
    model, paths = source.model, source.writer.paths
    inputs = {v.name: path for v, path in zip(model.inputs, paths.inputs, strict=True)}
    outputs = {v.name: path for v, path in zip(model.outputs, paths.outputs, strict=True)}
    angles = [v.name for v in model.inputs if v.plausibility is not None]
    desired = [name for name in inputs if name.endswith(_DESIRED)]
    if len(angles) != 1 or len(desired) != 1 or len(inputs) != 2:
        return {}
    estimate, speed = desired[0].removesuffix(_DESIRED), f"{angles[0].rpartition('.')[0]}.speed"
    if not {estimate, speed} < set(outputs):
        return {}
    command = model.outputs[-1]
    return {
        "angle": inputs[angles[0]],
        "desired": inputs[desired[0]],
        "estimate": outputs[estimate],
        "speed": f"outputs_.{outputs[speed]}",
        "command": outputs[command.name],
        "command_unit": f"{command.name} in {command.unit}",
        "real": str(source.real),
        "rate": f"{1.0 / float(model.sample_time or 1.0):g}",
    }
