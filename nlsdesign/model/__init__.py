"""From an assembly to a frozen, flat, named model, and views of it."""

from .flat import FlatModel, Plausibility, Table, Variable, casadi_dae
from .flatten import flatten
from .origin import Origin
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
