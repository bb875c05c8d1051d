"""What a declared model lacks: locate, name, add, judge on held-out records, abstain."""

from .diagnose import diagnose, write_refit, write_verdict
from .effects import ALL, Candidate, Effect, Unknown
from .effects.unnamed_tables import unnamed_part
from .planning.candidate_commands import MachineLimits
from .planning.experiment import Experiment, Separation, next_experiment, write_command
from .prediction import BandError, band_errors, predict, ranges_left
from .reporting.circumstances import DiagnosisRun, records_of_run
from .reporting.fitted_numbers import with_records_named
from .reporting.named_effect import EffectEvidence
from .reporting.refit import BlockError, FittedNumber, Refit, refit
from .reporting.verdict import Course, NamedEffect, RecordGap, Verdict
from .reporting.written import verdict_frames

__all__ = [
    "ALL",
    "BandError",
    "BlockError",
    "Candidate",
    "Course",
    "DiagnosisRun",
    "Effect",
    "EffectEvidence",
    "Experiment",
    "FittedNumber",
    "MachineLimits",
    "NamedEffect",
    "RecordGap",
    "Refit",
    "Separation",
    "Unknown",
    "Verdict",
    "band_errors",
    "diagnose",
    "next_experiment",
    "predict",
    "ranges_left",
    "records_of_run",
    "refit",
    "unnamed_part",
    "verdict_frames",
    "with_records_named",
    "write_command",
    "write_refit",
    "write_verdict",
]
