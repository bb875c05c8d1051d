"""What a declared model lacks: locate, name, add, judge on held-out records, abstain."""

from .block_prediction import band_errors, predict, ranges_left
from .diagnose import diagnose, write_refit, write_verdict
from .effects import ALL, Candidate, Effect, Unknown
from .effects.unnamed_tables import unnamed_part
from .planning.candidate_commands import MachineLimits
from .planning.experiment import Experiment, next_experiment, write_command
from .reporting.circumstances import DiagnosisRun, records_of_run
from .reporting.fitted_numbers import with_records_named
from .reporting.named_run import range_findings, refit_of_run, verdict_of_run
from .reporting.refit import Refit, refit
from .reporting.verdict import Verdict
from .reporting.written import verdict_frames

__all__ = [
    "ALL",
    "Candidate",
    "DiagnosisRun",
    "Effect",
    "Experiment",
    "MachineLimits",
    "Refit",
    "Unknown",
    "Verdict",
    "band_errors",
    "diagnose",
    "next_experiment",
    "predict",
    "range_findings",
    "ranges_left",
    "records_of_run",
    "refit",
    "refit_of_run",
    "unnamed_part",
    "verdict_frames",
    "verdict_of_run",
    "with_records_named",
    "write_command",
    "write_refit",
    "write_verdict",
]
