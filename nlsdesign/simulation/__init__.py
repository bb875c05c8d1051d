"""Simulation of flat models over time."""

from .driven_run import StepAt as StepAt
from .driven_run import as_recorded as as_recorded
from .driven_run import even_times as even_times
from .driven_run import main_signals as main_signals
from .driven_run import only as only
from .driven_run import require_visible as require_visible
from .driven_run import rms_against as rms_against
from .driven_run import signal_names as signal_names
from .driven_run import signal_sizes as signal_sizes
from .driven_run import with_prescribed_speeds as with_prescribed_speeds
from .input_signals import Sine, sine
from .integrate import simulate
from .limits_reached import limits_reached as limits_reached
from .measure import measure
from .prior import Prior, declared_prior
from .simulated_batch import simulate_batch
from .trace import RangeWarning, Trace
from .trace import range_warnings as range_warnings

__all__ = [
    "Prior",
    "RangeWarning",
    "Sine",
    "Trace",
    "declared_prior",
    "measure",
    "simulate",
    "simulate_batch",
    "sine",
]
