"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation import SineResponse, Tracking, sine_response, tracking, zero_torque
from .loop import ClosedLoop
from .torque_loop import LoopNames, TorqueGains, loop_names, torque_controller

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
