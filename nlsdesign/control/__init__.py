"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation.responses import SineResponse, Tracking, sine_response, tracking, zero_torque
from .laws.disturbance import DisturbanceObserver
from .laws.largest_torque import TorqueLimit, check_torque, largest_torque, torque_limit
from .laws.outer_laws import PidTorque, TorqueLaw
from .laws.scheduled_torque import DesiredRate, FilteredDifference, GivenRate, ScheduledTorque
from .laws.torque_loop import LoopNames, TorqueGains, loop_names, torque_controller
from .laws.velocity_loop import FrictionCompensation, VelocityLoop
from .laws.windup import AntiWindup, BackCalculation, ConditionalIntegration
from .loop.closed_loop import ClosedLoop

__all__ = [
    "AntiWindup",
    "BackCalculation",
    "ClosedLoop",
    "ConditionalIntegration",
    "DesiredRate",
    "DisturbanceObserver",
    "FilteredDifference",
    "FrictionCompensation",
    "GivenRate",
    "LoopNames",
    "PidTorque",
    "ScheduledTorque",
    "SineResponse",
    "TorqueGains",
    "TorqueLaw",
    "TorqueLimit",
    "Tracking",
    "VelocityLoop",
    "check_torque",
    "largest_torque",
    "loop_names",
    "sine_response",
    "torque_controller",
    "torque_limit",
    "tracking",
    "zero_torque",
]
