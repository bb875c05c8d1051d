"""Measured records, noise, fits and their metrics."""

from .estimation.least_squares import Fit, fit
from .estimation.parameters import Parameter, declared_parameter, free_parameter
from .estimation.profile import Profile, profile_of
from .output_error.cma_es import Evolved, fit_by_cma
from .output_error.multiple_shooting import SimulatedFit, coloured_sigma, fit_by_simulation
from .output_error.prediction import Prediction, predict_in_windows
from .output_error.simulation_error import Shots, SimulationError, Weights
from .output_error.wiring import Wiring, wired
from .records.alignment import aligned, joined, resampled
from .records.clocks import Channel, Resampled, on_one_clock
from .records.lag import Lag, lag_between
from .records.measurement import Column, ColumnMap, Record, RecordSet, cut_in_time, load_record, load_records
from .records.quality import Finding
from .statistics.losses import Huber, Loss, Squares
from .statistics.metrics import Agreement, agreement, rmse
from .statistics.residuals import noise_of

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
