"""Sweeps: one question asked of many changed assemblies, on one machine or many, with a table of answers.

The report of a sweep and the command import it. It decides no physics: questions ask the rooms below.
"""

from .sweep_table import Column, SweepTable, read_sweep

__all__ = ["Column", "SweepTable", "read_sweep"]
