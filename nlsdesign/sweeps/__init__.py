"""Sweeps: one question asked of many changed assemblies, on one machine or many, with a table of answers.

The report of a sweep and the command import it. It decides no physics: questions ask the rooms below.
"""

from .axes import AxisSet, GridAxis, LatinHypercube, Listed, RandomDraws, SobolSample
from .axis_values import Subject
from .preferences import LargerIsBetter, NearIsBetter, NotBelow, SmallerIsBetter
from .questions import AngleQuestion, DesignQuestion, DiagnosisQuestion, LoopQuestion, SpreadQuestion
from .run_sweep import SweepTask, sweep
from .saltelli import SaltelliSample
from .sweep_columns import SweepColumn
from .sweep_question import FunctionQuestion, SweepQuestion
from .sweep_table import SweepTable, read_sweep

__all__ = [
    "AngleQuestion",
    "AxisSet",
    "DesignQuestion",
    "DiagnosisQuestion",
    "FunctionQuestion",
    "GridAxis",
    "LargerIsBetter",
    "LatinHypercube",
    "Listed",
    "LoopQuestion",
    "NearIsBetter",
    "NotBelow",
    "RandomDraws",
    "SaltelliSample",
    "SmallerIsBetter",
    "SobolSample",
    "SpreadQuestion",
    "Subject",
    "SweepColumn",
    "SweepQuestion",
    "SweepTable",
    "SweepTask",
    "read_sweep",
    "sweep",
]
