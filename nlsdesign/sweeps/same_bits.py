"""What runs the batches within a point: compiled code where there is a compiler, with bits that never differ.

NumPy, which batches take by themselves without a compiler, has elementary functions of its own, so a table
would depend on who computed it. CasADi takes them from the C library, as compiled code does.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..export import natively, quickest
from ..foundation.errors import ExportError
from ..simulation.column_graph import ColumnGraph, NotByColumnsError
from ..simulation.column_runs import ColumnRun


@dataclass(frozen=True)
class SameBits:
    """Compiled code where that is to be had, and CasADi where it is not: a worker may lack a compiler."""

    def __call__(self, function: ca.Function) -> ca.Function:
        """Return a function as compiled code, or as it is."""
        if quickest() is not natively:
            return function
        try:
            return natively(function)
        except ExportError:  # the cache of a worker may be full
            return function

    def columns(self, graph: ColumnGraph) -> ColumnRun:
        """Return compiled code that runs samples of many columns."""
        if quickest() is not natively:
            raise NotByColumnsError
        try:
            return natively.columns(graph)
        except ExportError:
            raise NotByColumnsError from None


same_bits = SameBits()
"""What questions of a sweep give to batches."""
