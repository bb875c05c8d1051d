"""Torque control on an estimated torque, and what a closed loop does."""

from .evaluation import SineResponse, Tracking, sine_response, tracking, zero_torque
from .loop import ClosedLoop
from .torque_loop import TorqueGains, torque_controller

__all__ = [
    "ClosedLoop",
    "SineResponse",
    "TorqueGains",
    "Tracking",
    "sine_response",
    "torque_controller",
    "tracking",
    "zero_torque",
]
