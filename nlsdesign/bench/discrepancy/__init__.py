"""What a declared model lacks: locate, name, add, judge on held-out records, abstain."""

from .block_prediction import band_errors, predict
from .diagnose import diagnose, write_refit, write_verdict
from .effects import ALL, Candidate, Effect, Unknown
from .effects.unnamed_tables import unnamed_part
from .planning.candidate_commands import MachineLimits
from .planning.experiment import next_experiment, write_command
from .reporting.refit import Refit, refit
from .reporting.refit import refit_of_run as refit_of_run
from .reporting.verdict import Verdict
from .reporting.written import range_findings as range_findings
from .reporting.written import verdict_frames
from .reporting.written import verdict_of_run as verdict_of_run

__all__ = [
    "ALL",
    "Candidate",
    "Effect",
    "MachineLimits",
    "Refit",
    "Unknown",
    "Verdict",
    "band_errors",
    "diagnose",
    "next_experiment",
    "predict",
    "refit",
    "unnamed_part",
    "verdict_frames",
    "write_command",
    "write_refit",
    "write_verdict",
]
