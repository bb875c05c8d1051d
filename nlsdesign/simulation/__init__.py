"""Simulation of flat models over time."""

from .integrate import simulate
from .trace import Trace

__all__ = ["Trace", "simulate"]
