"""Actuators, declared in Python with the numbers of a deck. Each function returns an Assembly."""

from .cam_rubber import cam_rubber_actuator
from .linear import linear_spring_actuator

__all__ = ["cam_rubber_actuator", "linear_spring_actuator"]
