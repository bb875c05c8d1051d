"""Calibration on the bench: records of a hung weight, a load cell or a free run become smaller spreads.

``report`` and ``cli`` may import it; it stands on the flat model, on records and on what is known of numbers.
It never adds an effect to a machine: what does not fit is refused, or widens what is known.
"""

from .bench_test import KINDS as KINDS
from .bench_test import FreeRunTest, HungWeightTest, Instruments, LoadCellTest
from .calibrated_deck import calibrated, read_joint_numbers, shown_numbers, write_calibration
from .estimate import estimate, load_calibration
from .estimate import record_findings as record_findings
from .plan import CalibrationPlan, what_calibration_buys, write_plan

__all__ = [
    "CalibrationPlan",
    "FreeRunTest",
    "HungWeightTest",
    "Instruments",
    "LoadCellTest",
    "calibrated",
    "estimate",
    "load_calibration",
    "read_joint_numbers",
    "shown_numbers",
    "what_calibration_buys",
    "write_calibration",
    "write_plan",
]
