"""What can be said of a model before anything is built on it: observability, stability, best estimate."""

from .kalman import EstimateDeviation
from .kalman import NoiseAssumptions as NoiseAssumptions
from .observability import EmpiricalGramian, Observability, RankDrops, empirical_gramian, rank_drops
from .rest import ranges_at_rest as ranges_at_rest
from .rest_points import rest_points
from .sensor_ranking import SensorCandidate, SensorRanking, rank_sensors
from .sweep import Chart, Stability, over_angle, sampled_poles
from .sweep import View as View

__all__ = [
    "Chart",
    "EmpiricalGramian",
    "EstimateDeviation",
    "Observability",
    "RankDrops",
    "SensorCandidate",
    "SensorRanking",
    "Stability",
    "empirical_gramian",
    "over_angle",
    "rank_drops",
    "rank_sensors",
    "rest_points",
    "sampled_poles",
]
