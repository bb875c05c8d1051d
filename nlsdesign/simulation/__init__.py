"""Simulation of flat models over time."""

from .events import Event
from .integrate import simulate
from .measure import measure
from .signals import Sine, sine
from .trace import RangeWarning, Trace, range_warnings

__all__ = ["Sine", "Trace", "measure", "simulate", "sine"]
__all__ = ["RangeWarning", "Sine", "Trace", "range_warnings", "simulate", "sine"]
__all__ = ["Event", "Sine", "Trace", "simulate", "sine"]
