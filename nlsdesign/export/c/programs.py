"""Programs beside a generated step: its self-test, main programs and build files for a controller.

A generated step as a library for PlatformIO, Arduino, Zephyr, CMake and ros2_control.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

from ...foundation.arrays import Array
from ...foundation.locations import version
from ...model.flat import FlatModel
from ..files import filled, write_all
from .c_text import SHORT, Real, comment, half_byte_sums
from .guarded_step import STATUS_BITS, GuardedModel
from .writer import CSource, CWriter

SAMPLES = 120
DOUBLE_TOLERANCE = 1e-12
"""Largest difference relative to the largest size of each output, for double."""
FLOAT_TOLERANCE = 2e-4
"""The same for float: some 3000 times its rounding error of 6e-8. This covers the rounding of a few
hundred operations, accumulated by stable poles over some ten samples, and still reveals a wrong term."""
ROUNDINGS, WIDENING = 8.0, 10.0
"""Difference that one rounding of each state per sample makes, times this, is allowed where it is more: a
state is the sum of some tens of terms. At most so often the tolerances above, for a rounding at a corner can
tip it, and nothing would be compared."""


def sample_inputs(model: FlatModel, real: Real) -> Array:
    """Return an input sequence that sweeps each range, with NaN, infinities, excesses, a jump and a gap.

    A measured input moves over its usual range, and no faster than is believed. The numbers are exact in the
    number type; shape (samples, inputs).
    """
    columns = np.zeros((SAMPLES, len(model.inputs)))
    for i, variable in enumerate(model.inputs):
        middle, half = variable.start, variable.nominal
        if variable.plausibility is None and math.isfinite(variable.minimum + variable.maximum):
            middle = (variable.minimum + variable.maximum) / 2
            half = (variable.maximum - variable.minimum) / 2
        slow, fast = 0.071 * (i + 1), 0.39
        k = np.arange(SAMPLES, dtype=float)
        if variable.plausibility is not None:
            k *= min(
                1.0,
                0.5
                * variable.plausibility.largest_rate
                * float(model.sample_time or 0.0)
                / (half * (0.6 * slow + 0.3 * fast)),
            )
        wave = np.asarray(0.6 * np.sin(slow * k + i) + 0.3 * np.sin(fast * k + 2 * i))
        columns[:, i] = middle + half * wave
        for at, bad in ((50, math.nan), (60, math.inf), (70, -math.inf)):
            columns[at + i % 8, i] = bad
        if variable.maximum < math.inf:
            columns[80 + i % 8, i] = variable.maximum + 0.1 * half
        if variable.minimum > -math.inf:
            columns[90 + i % 8, i] = variable.minimum - 10.0 * half
        if variable.plausibility is not None:
            columns[100 + i % 8, i] += 0.5 * half
            columns[108 + i % 4 : 112 + i % 4, i] = math.nan
    return np.vectorize(real.round, otypes=[float])(columns) if columns.size else columns


def selftest_source(c: CWriter) -> str:
    """Return a program that feeds recorded inputs to the step and compares with the evaluation in Python.

    Its ``main`` returns 0, or the number of the first sample that differs.
    """
    real, inputs = c.real, sample_inputs(c.model, c.real)
    run = GuardedModel(c.model, real)
    results = [run.step(row) for row in inputs.tolist()]
    outputs = np.array([y for y, _ in results]).reshape(len(results), len(c.paths.outputs))
    size = np.abs(outputs).max(axis=0, initial=0.0)
    relative = DOUBLE_TOLERANCE if real is Real.DOUBLE else FLOAT_TOLERANCE
    # Each state is one rounding off after each sample, up or down; what one moves another can hide.
    number, carried = np.arange(1, len(c.model.states) + 1), np.zeros(len(size))
    for first in range(4):
        run = GuardedModel(c.model, real)
        for k, row in enumerate(inputs.tolist()):
            carried = np.maximum(carried, np.abs(np.array(run.step(row)[0]) - outputs[k]))
            run.state = run.state * (1.0 + real.epsilon * np.sign(np.sin(1.7 * (k + 1.0) * number + first)))
    allowed = np.clip(ROUNDINGS * carried, relative * size, WIDENING * relative * size)
    tolerance = [float(v) + real.epsilon**2 for v in allowed]
    values = {
        "samples": str(len(results)),
        "given": real.table("given", inputs.tolist()),
        "expected": real.table("expected", outputs.tolist()),
        "tolerance": real.table("tolerance", [tolerance]),
        "status": ", ".join(f"0x{status:x}u" for _, status in results),
        "assignments": [f"inputs.{path} = given[k][{i}];" for i, path in enumerate(c.paths.inputs)],
        "comparisons": [
            f"differs |= !({real.function('fabs')}(outputs.{path} - expected[k][{i}]) <= tolerance[0][{i}]);"
            for i, path in enumerate(c.paths.outputs)
        ],
    }
    return c.filled("controller_selftest.c", values)


_OF_THE_CLASS = (
    *("step", "restart", "set_parameters", "status", "outputs", "sample_time"),
    *("inputs_type", "outputs_type", "parameters_type", "state_", "outputs_", "clock_", "status_"),
)
"""Members of the C++ class around a step."""


def write_examples(source: CSource) -> list[Path]:
    """Write a C++ class, main programs and build files beside the files of a step.

    The main programs are a loop on a POSIX timer and a timer interrupt of a Cortex-M; both say where readings
    come from and where outputs go to. A supervisor turns the status word into the share of a command that
    may act. A third program answers a desk that plays a record through it, and a script is that desk. A
    command of GDB prints an instance by flat names.
    """
    name, folder = source.name, source.header.parent
    values = {
        "name": name,
        "NAME": name.upper(),
        # No member of a C++ class may have the name of the class.
        "class": f"{name}_object" if name in _OF_THE_CLASS else name,
        "real": source.real,
        "title": f"/* {comment(source.model.description)} */",
        "read": [
            f"inputs.{path} = {source.real.literal(0.0)}; /* {comment(v.description)}, {v.unit} */"
            for v, path in zip(source.model.inputs, source.writer.paths.inputs, strict=True)
        ],
        "nanoseconds": str(round(1e9 * float(source.model.sample_time or 0.0))),
        "microseconds": str(round(1e6 * float(source.model.sample_time or 0.0))),
        "shown": [
            f'printf "{group} {v.name} = %.9g {v.unit}\\n", $arg0.{group}.{path}'
            for group in ("inputs", "outputs", "states", "parameters")
            for v, path in zip(getattr(source.model, group), getattr(source.writer.paths, group), strict=True)
        ],
        "unit": "4" if source.real is Real.FLOAT else "8",  # bits of __ARM_FP, Arm C Language Extensions
        **link_values(source),
    }
    files = {
        f"{name}.hpp": "wrapper.hpp",
        f"{name}_supervisor.h": "supervisor.h",
        f"{name}_example_posix.c": "example_posix.c",
        f"{name}_example_cortex_m.c": "example_cortex_m.c",
        f"{name}_link.h": "link.h",
        f"{name}_example_link.c": "example_link.c",
        f"{name}_play.py": "play.txt",
        "CMakeLists.txt": "CMakeLists.txt",
        f"{name}.mk": "example.mk",
        f"{name}.gdb": "debugger.gdb",
    }
    texts = {folder / file: filled(template, values) for file, template in files.items()}
    write_all(texts)
    return list(texts)


def link_values(source: CSource) -> dict[str, str | list[str]]:
    """Return what the frames between a board and a desk hold."""
    model, paths = source.model, source.writer.paths
    inputs, outputs = ([v.name for v in group] for group in (model.inputs, model.outputs))
    return {
        "inputs": str(len(inputs)),
        "outputs": str(len(outputs)),
        "given": [f"outputs->{path}," for path in paths.outputs],
        "assignments": [f"inputs.{path} = numbers[{i}];" for i, path in enumerate(paths.inputs)],
        "half_bytes": half_byte_sums(),
        "names": ", ".join(f"{v.name} [{v.unit}]" for v in model.inputs),
        "input_tuple": "".join(f"{name!r}, " for name in inputs),
        "output_tuple": "".join(f"{name!r}, " for name in outputs),
        "flags": ", ".join(f'"{flag}": 0x{bit:x}' for flag, (bit, _) in STATUS_BITS.items()),
        "letter": "f" if source.real is Real.FLOAT else "d",
    }


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
