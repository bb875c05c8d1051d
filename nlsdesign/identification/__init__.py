"""Measured records, noise, fits and their metrics."""

from .alignment import aligned, joined, resampled
from .clocks import Channel, Resampled, on_one_clock
from .evolution import Evolved, fit_by_cma
from .fit import Fit, fit
from .lag import Lag, lag_between
from .losses import Huber, Loss, Squares
from .measurement import Column, ColumnMap, Record, RecordSet, cut_in_time, load_record, load_records
from .metrics import Agreement, agreement, rmse
from .multiple_shooting import SimulatedFit, coloured_sigma, fit_by_simulation
from .parameters import Parameter, declared_parameter, free_parameter
from .prediction import Prediction, predict_in_windows
from .profile import Profile, profile_of
from .quality import Finding
from .residuals import noise_of
from .simulation_error import Shots, SimulationError, Weights
from .wiring import Wiring, wired

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
