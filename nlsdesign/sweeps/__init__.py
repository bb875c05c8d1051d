"""Sweeps: one question asked of many changed assemblies, on one machine or many, with a table of answers.

The report of a sweep and the command import it. It decides no physics: questions ask the rooms below.
"""

from .axes import AxisSet, BoundAxes, Grid, LatinHypercube, Listed, RandomDraws, SobolSample
from .axis_values import Subject
from .design_question import DesignQuestion
from .diagnosis_question import DiagnosisQuestion
from .model_questions import AngleQuestion, LoopQuestion, SpreadQuestion
from .plan import Plan
from .preferences import LargerIsBetter, NearIsBetter, NotAbove, NotBelow, SmallerIsBetter
from .question import FunctionQuestion, SweepQuestion
from .run_sweep import SweepSettings, SweepTask, sweep, sweep_task
from .saltelli_sample import SaltelliSample
from .sweep_file import read_sweep_file
from .sweep_table import Column, SweepTable, read_sweep

__all__ = [
    "AngleQuestion",
    "AxisSet",
    "BoundAxes",
    "Column",
    "DesignQuestion",
    "DiagnosisQuestion",
    "FunctionQuestion",
    "Grid",
    "LargerIsBetter",
    "LatinHypercube",
    "Listed",
    "LoopQuestion",
    "NearIsBetter",
    "NotAbove",
    "NotBelow",
    "Plan",
    "RandomDraws",
    "SaltelliSample",
    "SmallerIsBetter",
    "SobolSample",
    "SpreadQuestion",
    "Subject",
    "SweepQuestion",
    "SweepSettings",
    "SweepTable",
    "SweepTask",
    "read_sweep",
    "read_sweep_file",
    "sweep",
    "sweep_task",
]
