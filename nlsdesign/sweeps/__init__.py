"""Sweeps: one question asked of many changed assemblies, on one machine or many, with a table of answers.

The report of a sweep and the command import it. It decides no physics: questions ask the rooms below.
"""

from .axes import GridAxis, LatinHypercube, Listed, RandomDraws, SaltelliSample, SobolSample
from .preferences import Preference, Requirement
from .questions import AngleQuestion, DesignQuestion, DiagnosisQuestion, LoopQuestion, SpreadQuestion
from .run_sweep import SweepSettings as SweepSettings
from .run_sweep import SweepTask as SweepTask
from .run_sweep import run_task as run_task
from .run_sweep import sweep
from .sweep_columns import SweepColumn
from .sweep_columns import libraries as libraries
from .sweep_file import read_sweep_file as read_sweep_file
from .sweep_folder import standing_points as standing_points
from .sweep_question import FunctionQuestion
from .sweep_table import SweepTable, read_sweep
from .sweep_table import point_deck_text as point_deck_text

__all__ = [
    "AngleQuestion",
    "DesignQuestion",
    "DiagnosisQuestion",
    "FunctionQuestion",
    "GridAxis",
    "LatinHypercube",
    "Listed",
    "LoopQuestion",
    "Preference",
    "RandomDraws",
    "Requirement",
    "SaltelliSample",
    "SobolSample",
    "SpreadQuestion",
    "SweepColumn",
    "SweepTable",
    "read_sweep",
    "sweep",
]
