"""What a declared model lacks: locate, name, add, judge on held-out records, abstain."""

from .diagnose import diagnose, write_verdict
from .effects import ALL, Candidate, Effect, Unknown
from .predict import predict
from .verdict import Course, NamedEffect, RecordGap, Verdict

__all__ = [
    "ALL",
    "Candidate",
    "Course",
    "Effect",
    "NamedEffect",
    "RecordGap",
    "Unknown",
    "Verdict",
    "diagnose",
    "predict",
    "write_verdict",
]
