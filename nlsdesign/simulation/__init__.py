"""Simulation of flat models over time."""

from .integrate import simulate
from .limits_reached import limits_reached
from .measure import measure
from .prior import Prior, declared_prior
from .signals import Sine, sine
from .simulated_batch import SimulatedBatch, simulate_batch
from .trace import RangeWarning, Trace, range_warnings

__all__ = [
    "Prior",
    "RangeWarning",
    "SimulatedBatch",
    "Sine",
    "Trace",
    "declared_prior",
    "limits_reached",
    "measure",
    "range_warnings",
    "simulate",
    "simulate_batch",
    "sine",
]
