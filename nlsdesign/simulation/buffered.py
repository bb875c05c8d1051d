"""A CasADi function called through fixed buffers, with little overhead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from ..foundation.arrays import Array

Translate: TypeAlias = Callable[[ca.Function], ca.Function]
"""Takes a function and returns one with the same arguments and results, for instance compiled code."""


def as_it_is(function: ca.Function) -> ca.Function:
    """Return a function unchanged; CasADi's own virtual machine runs it."""
    return function


class Buffered:
    """A function with dense results, with fixed arrays for its arguments and results.

    ``arguments``: arrays that are read at each call; matrices column by column.
    """

    def __init__(self, function: ca.Function, arguments: Sequence[Array]) -> None:
        self._kept = tuple(arguments)
        self.results = tuple(np.zeros(function.nnz_out(i)) for i in range(function.n_out()))
        self._buffer, self.evaluate = function.buffer()
        for i, values in enumerate(self._kept):
            self._buffer.set_arg(i, memoryview(values))  # type: ignore[call-arg, arg-type]
        for i, values in enumerate(self.results):
            self._buffer.set_res(i, memoryview(values))  # type: ignore[call-arg, arg-type]
