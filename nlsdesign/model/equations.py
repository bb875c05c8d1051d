"""The equations of a flat model as SymPy and LaTeX."""

from __future__ import annotations

from .flat import FlatModel
from .symbolic_view import Equations

__all__ = [
    "Equations",
    "equations",
]


def equations(model: FlatModel) -> Equations:
    """Return the equations of a flat model as SymPy expressions; the same as ``model.symbolic_equations()``.

    Parameters
    ----------
    model
        Continuous or discrete.

    Raises
    ------
    ExportError
        If a law uses an operation that has no SymPy counterpart here.
    """
    return model.symbolic_equations()
