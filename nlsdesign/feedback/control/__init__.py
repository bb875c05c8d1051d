"""Torque control on an estimated torque, and what a closed loop does."""

from .closed_loop import ClosedLoop, encoder_loop, joined
from .evaluation.linear_parts import with_fine_counts
from .evaluation.loop_verdict import LoopJudge, LoopVerdict
from .evaluation.margins import LoopMargins, OutputImpedance, loop_margins, output_impedance
from .evaluation.onset import (
    LimitCycleOnset,
    LoopSpread,
    loop_over_spread,
    onset_of_limit_cycling,
    saturation_line,
)
from .evaluation.responses import (
    SineResponse,
    Tracking,
    ZeroTorque,
    sine_response,
    tracking,
    zero_torque,
)
from .evaluation.whole_evaluation import BIAS as BIAS
from .evaluation.whole_evaluation import LoopEvaluation, evaluate_loop
from .evaluation.whole_evaluation import LoopRange as LoopRange
from .evaluation.whole_evaluation import cascade_loops as cascade_loops
from .evaluation.whole_evaluation import with_margin as with_margin
from .laws.known_drive import check_torque
from .laws.known_drive import largest_torque as largest_torque
from .laws.law_writer import BackCalculation, ConditionalIntegration
from .laws.outer_laws import FilteredDifference, GivenRate, PidTorque, ScheduledTorque, TorqueLaw
from .laws.torque_loop import REPRODUCED_GAINS, TorqueGains, torque_controller
from .laws.velocity_loop import DisturbanceObserver, FrictionCompensation, VelocityLoop
from .tuning import LoopChoice, LoopLimits, bandwidth_against_impedance, best_choices, largest_gain

__all__ = [
    "REPRODUCED_GAINS",
    "BackCalculation",
    "ClosedLoop",
    "ConditionalIntegration",
    "DisturbanceObserver",
    "FilteredDifference",
    "FrictionCompensation",
    "GivenRate",
    "LimitCycleOnset",
    "LoopChoice",
    "LoopEvaluation",
    "LoopJudge",
    "LoopLimits",
    "LoopMargins",
    "LoopSpread",
    "LoopVerdict",
    "OutputImpedance",
    "PidTorque",
    "ScheduledTorque",
    "SineResponse",
    "TorqueGains",
    "TorqueLaw",
    "Tracking",
    "VelocityLoop",
    "ZeroTorque",
    "bandwidth_against_impedance",
    "best_choices",
    "check_torque",
    "encoder_loop",
    "evaluate_loop",
    "joined",
    "largest_gain",
    "loop_margins",
    "loop_over_spread",
    "onset_of_limit_cycling",
    "output_impedance",
    "saturation_line",
    "sine_response",
    "torque_controller",
    "tracking",
    "with_fine_counts",
    "zero_torque",
]
