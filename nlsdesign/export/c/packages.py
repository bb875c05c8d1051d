"""A generated step as a library that PlatformIO, Arduino, Zephyr and CMake take as it stands."""

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


def write_package(source: CSource, folder: Path) -> list[Path]:
    """Write a step as a library with the files that build systems of controllers ask for.

    One folder serves all: ``library.json`` for PlatformIO, ``library.properties`` and a sketch for Arduino,
    ``zephyr/module.yml`` for Zephyr, ``CMakeLists.txt`` for CMake, with what ``find_package`` finds.

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
    texts = {folder / file.format(name=name): filled(template, values) for file, template in _FILES.items()}
    for file, place in ((source.header, "src"), (source.source, "src"), (source.selftest, "test")):
        texts[folder / place / file.name] = file.read_text(encoding="utf-8")
    write_all(texts)
    return list(texts)
