"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation.responses import SineResponse, Tracking, sine_response, tracking, zero_torque
from .laws.torque_loop import LoopNames, TorqueGains, loop_names, torque_controller
from .loop.closed_loop import ClosedLoop

__all__ = [
    "ClosedLoop",
    "LoopNames",
    "SineResponse",
    "TorqueGains",
    "Tracking",
    "loop_names",
    "sine_response",
    "torque_controller",
    "tracking",
    "zero_torque",
]
