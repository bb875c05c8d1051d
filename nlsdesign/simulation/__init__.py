"""Simulation of flat models over time."""

from .integrate import simulate
from .measure import measure
from .signals import Sine, sine
from .trace import Trace

__all__ = ["Sine", "Trace", "measure", "simulate", "sine"]
