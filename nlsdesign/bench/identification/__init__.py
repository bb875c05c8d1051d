"""Measured records, noise, fits and their metrics."""

from .estimation.parameters import Parameter, declared_parameter, free_parameter
from .output_error.multiple_shooting import SimulatedFit, coloured_sigma, fit_by_simulation
from .output_error.prediction import Prediction, predict_in_windows
from .output_error.simulation_error import Shots, Weights
from .records.measurement import ColumnMap, Record, RecordSet, load_record, load_records
from .statistics.losses import Huber, Loss, Squares
from .statistics.metrics import Agreement, agreement, rmse
from .statistics.residuals import noise_of

__all__ = [
    "Agreement",
    "ColumnMap",
    "Huber",
    "Loss",
    "Parameter",
    "Prediction",
    "Record",
    "RecordSet",
    "Shots",
    "SimulatedFit",
    "Squares",
    "Weights",
    "agreement",
    "coloured_sigma",
    "declared_parameter",
    "fit_by_simulation",
    "free_parameter",
    "load_record",
    "load_records",
    "noise_of",
    "predict_in_windows",
    "rmse",
]
