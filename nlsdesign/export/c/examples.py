"""Programs and build files beside generated code, for those who put it on a controller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...model.flat import Variable
from ..files import filled, write_all
from .c_text import comment, real_type
from .controller_code import CSource
from .structures import member_paths


def write_examples(source: CSource) -> list[Path]:
    """Write a C++ class, two main programs and build files beside the files of a step.

    The main programs are a loop on a POSIX timer and a timer interrupt of a Cortex-M; both say where readings
    come from and where outputs go to, and what to do with the status word.

    Parameters
    ----------
    source
        As written by :func:`~nlsdesign.export.c.controller_code.export_c`.

    Returns
    -------
    list
        The files.

    Raises
    ------
    ExportError
        If a file cannot be written.
    """
    name, folder = source.name, source.header.parent
    values = {
        "name": name,
        "NAME": name.upper(),
        "real": source.real,
        "title": f"/* {comment(source.model.description)} */",
        "read": _assignments("inputs", source.model.inputs, real_type(source.real).literal(0.0)),
        "nanoseconds": str(round(1e9 * float(source.model.sample_time or 0.0))),
        "microseconds": str(round(1e6 * float(source.model.sample_time or 0.0))),
    }
    files = {
        f"{name}.hpp": "wrapper.hpp",
        f"{name}_example_posix.c": "example_posix.c",
        f"{name}_example_cortex_m.c": "example_cortex_m.c",
        "CMakeLists.txt": "CMakeLists.txt",
        f"{name}.mk": "example.mk",
    }
    texts = {folder / file: filled(shell, values) for file, shell in files.items()}
    write_all(texts)
    return list(texts)


def _assignments(structure: str, variables: Sequence[Variable], zero: str) -> list[str]:
    paths = member_paths(variables)
    return [
        f"{structure}.{paths[v.name]} = {zero}; /* {comment(v.description)}, {v.unit} */" for v in variables
    ]
