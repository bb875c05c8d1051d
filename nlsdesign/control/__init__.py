"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation.responses import SineResponse, Tracking, ZeroTorque, sine_response, tracking, zero_torque
from .evaluation.verdict import LoopJudge, LoopVerdict
from .laws.torque_loop import LoopNames, TorqueGains, loop_names, torque_controller
from .loop.closed_loop import ClosedLoop

__all__ = [
    "ClosedLoop",
    "LoopJudge",
    "LoopNames",
    "LoopVerdict",
    "SineResponse",
    "TorqueGains",
    "Tracking",
    "ZeroTorque",
    "loop_names",
    "sine_response",
    "torque_controller",
    "tracking",
    "zero_torque",
]
