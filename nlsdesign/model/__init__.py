"""The waist: from an assembly to a frozen, flat, named model, and views of it."""

from .casadi_view import casadi_dae
from .flat import FlatModel, Table, Variable
from .flatten import flatten
from .origin import Origin
from .plausibility import Plausibility
from .roles import measured_motion as measured_motion
from .roles import series_spring as series_spring
from .transform import with_outputs as with_outputs

__all__ = [
    "FlatModel",
    "Origin",
    "Plausibility",
    "Table",
    "Variable",
    "casadi_dae",
    "flatten",
]
