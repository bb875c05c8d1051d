"""The waist: from an assembly to a frozen, flat, named model, and views of it."""

from .casadi_view import casadi_dae
from .flat import FlatModel, Table, Variable
from .flatten import flatten
from .origin import Origin
from .plausibility import Plausibility

__all__ = [
    "FlatModel",
    "Origin",
    "Plausibility",
    "Table",
    "Variable",
    "casadi_dae",
    "flatten",
]
