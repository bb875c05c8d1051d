"""Simulation of flat models over time."""

from .events import Event
from .integrate import simulate
from .measure import measure
from .signals import Sine, sine
from .trace import RangeWarning, Trace, range_warnings

__all__ = ["Event", "RangeWarning", "Sine", "Trace", "measure", "range_warnings", "simulate", "sine"]
