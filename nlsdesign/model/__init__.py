"""The waist: from an assembly to a frozen, flat, named model, and views of it."""

from ..components.assembly.named_parts import Assembly
from .flat import FlatModel, Symbols, Table, Variable
from .flatten import flatten
from .switching import Switch, Switching

__all__ = ["Assembly", "FlatModel", "Switch", "Switching", "Symbols", "Table", "Variable", "flatten"]
