"""The step of a simulation as compiled code, for long or many simulations of one model on this machine."""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import lru_cache
from pathlib import Path

import casadi as ca

from ...errors import ExportError
from ...writing import write_bytes
from .cross_compiler import cache_folder, compile_library


@lru_cache(maxsize=16)
def natively(function: ca.Function) -> ca.Function:
    """Return a function as compiled code, for ``simulate(..., translate=natively)``.

    Compilation takes about a second; results are cached under a hash of the code.

    Parameters
    ----------
    function
        Any CasADi function that can be written in C.

    Raises
    ------
    ExportError
        If the compiler is missing or fails, or its result cannot be loaded.
    """
    code = ca.CodeGenerator("step.c", {"with_header": False, "main": False})
    code.add(function)
    text = code.dump()
    digest = hashlib.sha256(text.encode()).hexdigest()[:24]
    folder = cache_folder() / "steps"
    library = folder / f"{digest}{'.dll' if os.name == 'nt' else '.so'}"
    if not library.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as name:
            source = Path(name) / "step.c"
            source.write_text(text, encoding="utf-8")
            # Without this definition the generated code does not export its functions.
            flags = ("-std=c99", "-DGCC_HASCLASSVISIBILITY")
            built = compile_library([source], Path(name) / library.name, flags=flags)
            write_bytes(library, built.read_bytes())
    try:
        return ca.external(function.name(), str(library))
    except RuntimeError as error:
        raise ExportError(
            f"compiled step {library}", "cannot be loaded", next_step="delete it and try again"
        ) from error
