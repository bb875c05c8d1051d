"""The waist: from an assembly to a frozen, flat, named model, and views of it."""

from .flat import FlatModel, Symbols, Table, Variable
from .flatten import flatten
from .switching import Switch, Switching

__all__ = ["FlatModel", "Switch", "Switching", "Symbols", "Table", "Variable", "flatten"]
