"""Measured records, their noise, and fits of a model's numbers to them.

``records`` reads files; ``equation_error`` drives pieces of a model with what was measured; ``least_squares``
fits their numbers, and ``multiple_shooting`` those of a whole simulation. ``discrepancy``, ``calibration``
and the rooms above may import it. It never changes the structure of a model.
"""

from .least_squares import Fit, Huber, Loss, Profile, Squares, fit, profile_of
from .multiple_shooting import (
    Evolved,
    Prediction,
    SimulatedFit,
    coloured_sigma,
    fit_by_cma,
    fit_by_simulation,
    predict_in_windows,
)
from .parameters import Parameter, declared_parameter, free_parameter
from .records.alignment import aligned, joined, resampled
from .records.clocks import Channel, Lag, Resampled, lag_between, on_one_clock
from .records.measurement import Column, ColumnMap, Record, RecordSet, cut_in_time, load_record, load_records
from .records.quality import Finding
from .residuals import Agreement, agreement, noise_of, rmse
from .simulation_error import Shots, SimulationError, Weights
from .windowed_simulation import Wiring, wired

__all__ = [
    "Agreement",
    "Channel",
    "Column",
    "ColumnMap",
    "Evolved",
    "Finding",
    "Fit",
    "Huber",
    "Lag",
    "Loss",
    "Parameter",
    "Prediction",
    "Profile",
    "Record",
    "RecordSet",
    "Resampled",
    "Shots",
    "SimulatedFit",
    "SimulationError",
    "Squares",
    "Weights",
    "Wiring",
    "agreement",
    "aligned",
    "coloured_sigma",
    "cut_in_time",
    "declared_parameter",
    "fit",
    "fit_by_cma",
    "fit_by_simulation",
    "free_parameter",
    "joined",
    "lag_between",
    "load_record",
    "load_records",
    "noise_of",
    "on_one_clock",
    "predict_in_windows",
    "profile_of",
    "resampled",
    "rmse",
    "wired",
]
