"""Measured records, their noise, and fits of a model's numbers to them.

``records`` reads files; ``equation_error`` drives pieces of a model with what was measured; ``least_squares``
fits their numbers, and ``multiple_shooting`` those of a whole simulation. ``discrepancy``, ``calibration``
and the rooms above may import it. It never changes the structure of a model.
"""

from .least_squares import Huber, Loss
from .multiple_shooting import (
    Prediction,
    coloured_sigma,
    fit_by_simulation,
    predict_in_windows,
)
from .parameters import Parameter, free_parameter
from .records.column_heads import read_input_columns as read_input_columns
from .records.description import RecordsDescription as RecordsDescription
from .records.description import describe_records
from .records.measurement import ColumnMap, Record, RecordSet, load_record, load_records
from .residuals import Agreement, agreement, noise_of, rmse
from .simulation_error import Shots, Weights

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
    "Weights",
    "agreement",
    "coloured_sigma",
    "describe_records",
    "fit_by_simulation",
    "free_parameter",
    "load_record",
    "load_records",
    "noise_of",
    "predict_in_windows",
    "rmse",
]
