"""What can be said of a model before anything is built on it: observability, stability, best estimate."""

from .kalman import EstimateDeviation
from .observability import Observability
from .stability import Stability
from .sweep import Chart, RestPoint, View, over_angle

__all__ = ["Chart", "EstimateDeviation", "Observability", "RestPoint", "Stability", "View", "over_angle"]
