"""Measured records, noise, fits and their metrics."""

from .fit import Fit, Parameter, fit
from .measurement import Column, ColumnMap, Record, RecordSet, load_records
from .metrics import Agreement, agreement, rmse
from .quality import Finding

__all__ = [
    "Agreement",
    "Column",
    "ColumnMap",
    "Finding",
    "Fit",
    "Parameter",
    "Record",
    "RecordSet",
    "agreement",
    "fit",
    "load_records",
    "rmse",
]
