"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation.fine_counts import with_fine_counts
from .evaluation.impedance import CoupledStability, OutputImpedance, coupled_stability, output_impedance
from .evaluation.linear_loop import LinearLoop, linear_loop
from .evaluation.linear_parts import FrozenTables, SlidingPlant, SlopedTables, StuckPlant
from .evaluation.loop_spread import LoopSpread, loop_over_spread
from .evaluation.loop_verdict import LoopJudge, LoopVerdict
from .evaluation.margins import LoopMargins, loop_margins
from .evaluation.onset import LimitCycleOnset, linear_onset, onset_of_limit_cycling
from .evaluation.responses import (
    HeldTorque,
    SineResponse,
    Tracking,
    ZeroTorque,
    held_torque,
    sine_response,
    tracking,
    zero_torque,
)
from .evaluation.saturation import SaturationLine, saturation_line
from .evaluation.steps import StepResponse, step_response, torque_resolution
from .laws.disturbance import DisturbanceObserver
from .laws.largest_torque import TorqueLimit, check_torque, largest_torque, only_side, torque_limit
from .laws.outer_laws import PidTorque, TorqueLaw
from .laws.scheduled_torque import DesiredRate, FilteredDifference, GivenRate, ScheduledTorque
from .laws.torque_loop import LoopNames, TorqueGains, loop_names, torque_controller
from .laws.velocity_loop import FrictionCompensation, VelocityLoop
from .laws.windup import AntiWindup, BackCalculation, ConditionalIntegration
from .loop.closed_loop import ClosedLoop
from .loop.encoder_wiring import encoder_loop
from .loop.joined import joined
from .tuning.largest_gain import LoopLimits, TunedLoop, largest_gain
from .tuning.spring_trade_off import LoopChoice, bandwidth_against_impedance, best_choices

__all__ = [
    "AntiWindup",
    "BackCalculation",
    "ClosedLoop",
    "ConditionalIntegration",
    "CoupledStability",
    "DesiredRate",
    "DisturbanceObserver",
    "FilteredDifference",
    "FrictionCompensation",
    "FrozenTables",
    "GivenRate",
    "HeldTorque",
    "LimitCycleOnset",
    "LinearLoop",
    "LoopChoice",
    "LoopJudge",
    "LoopLimits",
    "LoopMargins",
    "LoopNames",
    "LoopSpread",
    "LoopVerdict",
    "OutputImpedance",
    "PidTorque",
    "SaturationLine",
    "ScheduledTorque",
    "SineResponse",
    "SlidingPlant",
    "SlopedTables",
    "StepResponse",
    "StuckPlant",
    "TorqueGains",
    "TorqueLaw",
    "TorqueLimit",
    "Tracking",
    "TunedLoop",
    "VelocityLoop",
    "ZeroTorque",
    "bandwidth_against_impedance",
    "best_choices",
    "check_torque",
    "coupled_stability",
    "encoder_loop",
    "held_torque",
    "joined",
    "largest_gain",
    "largest_torque",
    "linear_loop",
    "linear_onset",
    "loop_margins",
    "loop_names",
    "loop_over_spread",
    "only_side",
    "onset_of_limit_cycling",
    "output_impedance",
    "saturation_line",
    "sine_response",
    "step_response",
    "torque_controller",
    "torque_limit",
    "torque_resolution",
    "tracking",
    "with_fine_counts",
    "zero_torque",
]
