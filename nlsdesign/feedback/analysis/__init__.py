"""What can be said of a model before anything is built on it: observability, stability, best estimate."""

from .kalman import EstimateDeviation, NoiseAssumptions
from .observability import EmpiricalGramian, Observability, RankDrops, empirical_gramian, rank_drops
from .rest import ranges_at_rest
from .rest_points import rest_points
from .sensor_ranking import SensorCandidate, SensorRanking, rank_sensors
from .sweep import Chart, Stability, View, over_angle, sampled_poles

__all__ = [
    "Chart",
    "EmpiricalGramian",
    "EstimateDeviation",
    "NoiseAssumptions",
    "Observability",
    "RankDrops",
    "SensorCandidate",
    "SensorRanking",
    "Stability",
    "View",
    "empirical_gramian",
    "over_angle",
    "ranges_at_rest",
    "rank_drops",
    "rank_sensors",
    "rest_points",
    "sampled_poles",
]
