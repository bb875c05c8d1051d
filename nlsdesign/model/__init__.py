"""The waist: from an assembly to a frozen, flat, named model, and views of it."""

from .flat import FlatModel, Plausibility, Table, Variable, casadi_dae
from .flatten import flatten
from .origin import Origin

__all__ = [
    "FlatModel",
    "Origin",
    "Plausibility",
    "Table",
    "Variable",
    "casadi_dae",
    "flatten",
]
