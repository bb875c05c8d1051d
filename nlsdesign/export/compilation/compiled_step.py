"""Generated C run from Python: the step of a controller, and the step of a simulation.

:class:`CompiledStep` runs the files of a controller. :func:`natively` compiles the step of a simulation, for
long or many simulations of one model on this machine.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.text_files import write_bytes
from ...simulation.buffered import Translate, as_it_is
from ...simulation.column_graph import ColumnGraph
from ...simulation.column_runs import ColumnRun
from ..c.c_text import Real
from ..c.writer import CSource
from .columns_in_c import WIDTH, ColumnsInC, sampled_run_in_c
from .cross_compiler import (
    BASELINE,
    THIS_PROCESSOR,
    cache_folder,
    compile_library,
    flags_of_environment,
)


class CompiledStep:
    """A controller's step, compiled for this machine and loaded; one object is one instance.

    Examples
    --------
    >>> step = CompiledStep(export_c(observer, "out/c"))  # doctest: +SKIP
    >>> outputs, status = step([0.1, 1.5])  # doctest: +SKIP

    ``parameters``: parameters in the order of the model; those of the design by default.
    """

    def __init__(self, source: CSource, parameters: Sequence[float] | None = None) -> None:
        self._source = source
        self._type: Any = ctypes.c_double if source.real is Real.DOUBLE else ctypes.c_float
        with tempfile.TemporaryDirectory(prefix="nlsdesign-step-", ignore_cleanup_errors=True) as folder:
            adapter = Path(folder) / "adapter.c"
            # C that converts between the named structures and vectors in the order of the model.
            paths = source.writer.paths
            conversions = {
                "parameters": [f"to->{path} = p[{i}];" for i, path in enumerate(paths.parameters)],
                "inputs": [f"inputs.{path} = u[{i}];" for i, path in enumerate(paths.inputs)],
                "outputs": [f"y[{i}] = outputs.{path};" for i, path in enumerate(paths.outputs)],
                "states": [f"x[{i}] = state->states.{path};" for i, path in enumerate(paths.states)],
            }
            adapter.write_text(source.writer.filled("adapter.c", conversions), encoding="utf-8")
            library = compile_library(
                [adapter, source.source], Path(folder) / "step.so", include=[source.header.parent.resolve()],
                flags=("-std=c99", *flags_of_environment()),
            )  # fmt: skip
            self._library = ctypes.CDLL(str(library))
        self._library.adapter_size.restype = ctypes.c_size_t
        for function in ("adapter_init", "adapter_set_parameters", "adapter_step"):
            getattr(self._library, function).restype = ctypes.c_uint32
        # An array of doubles is aligned.
        self._state = (ctypes.c_double * (self._library.adapter_size() // 8 + 1))()
        self.first_status = self.init(parameters)

    def __call__(self, inputs: Sequence[float]) -> tuple[Array, int]:
        """Advance by one sample.

        Result: outputs, shape (outputs,), and the status word.
        """
        outputs = self._array([0.0] * len(self._source.model.outputs))
        status = self._library.adapter_step(self._state, self._array(inputs), outputs)
        return self._plain(outputs, len(self._source.model.outputs)), int(status)

    def init(self, parameters: Sequence[float] | None = None) -> int:
        """Start the instance anew; return the status word."""
        given = None if parameters is None else self._array(parameters)
        return int(self._library.adapter_init(self._state, given))

    def fill(self, byte: int) -> None:
        """Fill the memory of the instance, as that of a machine may be that was just switched on."""
        ctypes.memset(self._state, byte, ctypes.sizeof(self._state))

    def set_parameters(self, parameters: Sequence[float]) -> int:
        """Change the parameters of the running instance."""
        return int(self._library.adapter_set_parameters(self._state, self._array(parameters)))

    @property
    def states(self) -> Array:
        """The states in the order of the model."""
        values = self._array([0.0] * len(self._source.model.states))
        self._library.adapter_states(self._state, values)
        return self._plain(values, len(self._source.model.states))

    def _array(self, values: Sequence[float]) -> Any:
        return (self._type * max(1, len(values)))(*[float(v) for v in values])

    @staticmethod
    def _plain(values: Any, count: int) -> Array:
        return np.array(values[:count], dtype=float)


_STEP_FLAGS = ("-std=c99", "-DGCC_HASCLASSVISIBILITY")
"""Without the definition the generated code does not export its functions."""
_COLUMN_FLAGS = ("-std=gnu99", "-fno-math-errno", "-Wno-psabi")


@dataclass(frozen=True)
class Natively:
    """Makes compiled code of functions, for ``simulate(..., translate=natively)`` and for batches.

    Compilation takes about a second; results are cached under a hash of the code. A function keeps its form;
    a batch gets code that computes eight columns together, with the instructions of this processor.
    """

    def __call__(self, function: ca.Function) -> ca.Function:
        """Return a function as compiled code."""
        return _step(function)

    def columns(self, graph: ColumnGraph) -> ColumnRun:
        """Return compiled code that runs samples of many columns."""
        return CompiledColumns(sampled_run_in_c(graph), kept=len(graph.results[1]))


natively = Natively()
"""Compiled code for ``translate=``."""


@lru_cache(maxsize=1)
def quickest() -> Translate:
    """Return what runs functions quickest here: compiled code, or without a compiler CasADi and NumPy.

    The numbers are the same but for the last digits of elementary functions, which are NumPy's own.
    """
    x = ca.SX.sym("x")
    try:
        natively(ca.Function("probe", [x], [2 * x]))
    except ExportError:
        return as_it_is
    return natively


class CompiledColumns:
    """Compiled code that runs samples of many columns.

    ``code``: with a function ``run``, and the numbers that are given to it. ``kept``: how many values are
    kept of a sample.
    """

    def __init__(self, code: ColumnsInC, kept: int) -> None:
        path = _built(code.text, _COLUMN_FLAGS, this_processor=True)
        self._numbers = np.ascontiguousarray(code.numbers)
        try:
            self._run = ctypes.CDLL(str(path)).run
        except OSError as error:
            raise _not_loaded(path) from error
        self._run.restype, self._kept = None, kept

    def __call__(self, state: Array, given: Array, parameter: Array) -> tuple[Array, Array]:
        """Return the states after the last sample, (states, columns), and what is kept, (T, kept, columns).

        ``state``: shape (states, columns). ``given``: shape (T, given, columns). ``parameter``: shape
        (parameters, columns).
        """
        count = state.shape[1]
        after, inputs, numbers = (_filled_up(each) for each in (state, given, parameter))
        after = after.copy() if after is state else after
        kept = np.empty((len(given), self._kept, after.shape[1]))
        arrays = (
            array.ctypes.data_as(ctypes.c_void_p) for array in (after, inputs, numbers, self._numbers, kept)
        )
        self._run(ctypes.c_int64(len(given)), ctypes.c_int64(after.shape[1] // WIDTH), *arrays)
        return after[:, :count], kept[:, :, :count]


def _filled_up(values: Array) -> Array:
    """Return an array whose last axis is a multiple of the width; the last column is repeated."""
    missing = -values.shape[-1] % WIDTH
    if missing:
        values = np.concatenate([values, np.repeat(values[..., -1:], missing, axis=-1)], axis=-1)
    return np.ascontiguousarray(values)


@lru_cache(maxsize=16)
def _step(function: ca.Function) -> ca.Function:
    code = ca.CodeGenerator("step.c", {"with_header": False, "main": False})
    code.add(function)
    library = _built(code.dump(), _STEP_FLAGS)
    try:
        return ca.external(function.name(), str(library))
    except RuntimeError as error:
        raise _not_loaded(library) from error


def _not_loaded(library: Path) -> ExportError:
    return ExportError(f"compiled step {library}", "cannot be loaded", next_step="delete it and try again")


def _built(text: str, flags: Sequence[str], *, this_processor: bool = False) -> Path:
    """Return the library of a C text, compiled if it is not in the cache.

    Code for this processor has its name in the hash: the cache may be shared with a machine that has another.
    """
    named = f"{text}{_processor()}" if this_processor else text
    digest = hashlib.sha256(named.encode()).hexdigest()[:24]
    folder = cache_folder() / "steps"
    library = folder / f"{digest}{'.dll' if os.name == 'nt' else '.so'}"
    if not library.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as name:
            source = Path(name) / "step.c"
            source.write_text(text, encoding="utf-8")
            processor = THIS_PROCESSOR if this_processor else BASELINE
            built = compile_library([source], Path(name) / library.name, flags=flags, processor=processor)
            write_bytes(library, built.read_bytes())
    return library


@lru_cache(maxsize=1)
def _processor() -> str:
    """Return what distinguishes the instructions of this processor from those of others."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()} {platform.node()}"
    naming = [line for line in lines if line.split("\t")[0].strip() in ("flags", "Features", "model name")]
    return "\n".join(sorted(set(naming))) + platform.machine()
