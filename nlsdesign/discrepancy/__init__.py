"""What a declared model lacks: locate, name, add, judge on held-out records, abstain."""

from .blocks.prediction_of_blocks import predict
from .diagnose import diagnose, write_refit, write_verdict
from .effects import ALL, Candidate, Effect, Unknown
from .reporting.circumstances import DiagnosisRun, records_of_run
from .reporting.named_effect import EffectEvidence
from .reporting.refit import BlockError, FittedNumber, Refit, refit
from .reporting.verdict import Course, NamedEffect, RecordGap, Verdict

__all__ = [
    "ALL",
    "BlockError",
    "Candidate",
    "Course",
    "DiagnosisRun",
    "Effect",
    "EffectEvidence",
    "FittedNumber",
    "NamedEffect",
    "RecordGap",
    "Refit",
    "Unknown",
    "Verdict",
    "diagnose",
    "predict",
    "records_of_run",
    "refit",
    "write_refit",
    "write_verdict",
]
