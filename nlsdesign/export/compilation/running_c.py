"""Running generated C from Python, for tests and benchmarks."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...foundation.arrays import Array
from ..c.c_text import Real
from ..c.writer import CSource, CWriter
from .cross_compiler import compile_library


class CompiledStep:
    """A controller's step, compiled for this machine and loaded; one object is one instance.

    Parameters
    ----------
    source
        Generated C files.
    parameters
        Parameters in the order of the model; those of the design by default.

    Examples
    --------
    >>> step = CompiledStep(export_c(observer, "out/c"))  # doctest: +SKIP
    >>> outputs, status = step([0.1, 1.5])  # doctest: +SKIP
    """

    def __init__(self, source: CSource, parameters: Sequence[float] | None = None) -> None:
        self._source = source
        self._type: Any = ctypes.c_double if source.real is Real.DOUBLE else ctypes.c_float
        with tempfile.TemporaryDirectory(prefix="nlsdesign-step-", ignore_cleanup_errors=True) as folder:
            adapter = Path(folder) / "adapter.c"
            adapter.write_text(
                source.writer.filled("adapter.c", _conversions(source.writer)), encoding="utf-8"
            )
            library = compile_library(
                [adapter, source.source], Path(folder) / "step.so", include=[source.header.parent.resolve()]
            )
            self._library = ctypes.CDLL(str(library))
        self._library.adapter_size.restype = ctypes.c_size_t
        for function in ("adapter_init", "adapter_set_parameters", "adapter_step"):
            getattr(self._library, function).restype = ctypes.c_uint32
        # An array of doubles is aligned.
        self._state = (ctypes.c_double * (self._library.adapter_size() // 8 + 1))()
        given = None if parameters is None else self._array(parameters)
        self.first_status = int(self._library.adapter_init(self._state, given))

    def __call__(self, inputs: Sequence[float]) -> tuple[Array, int]:
        """Advance by one sample.

        Result: outputs, shape (outputs,), and the status word.
        """
        outputs = self._array([0.0] * len(self._source.model.outputs))
        status = self._library.adapter_step(self._state, self._array(inputs), outputs)
        return self._plain(outputs, len(self._source.model.outputs)), int(status)

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


def _conversions(c: CWriter) -> dict[str, list[str]]:
    """Return C that converts between the named structures and vectors in the order of the model."""
    return {
        "parameters": [f"to->{path} = p[{i}];" for i, path in enumerate(c.parameters)],
        "inputs": [f"inputs.{path} = u[{i}];" for i, path in enumerate(c.inputs)],
        "outputs": [f"y[{i}] = outputs.{path};" for i, path in enumerate(c.outputs)],
        "states": [f"x[{i}] = state->states.{path};" for i, path in enumerate(c.states)],
    }
