"""What can be said of a model before anything is built on it: observability, stability, best estimate."""

from .empirical import EmpiricalGramian, empirical_gramian
from .kalman import EstimateDeviation
from .modes import PlantMode
from .noise_assumptions import NoiseAssumptions
from .observability import Observability, Unseen
from .rank_drops import RankDrop, RankDrops, rank_drops
from .rest_points import RestPoint, RestPoints, rest_points
from .sensor_ranking import (
    RankingAssumptions,
    SensorCandidate,
    SensorGain,
    SensorRanking,
    rank_sensors,
)
from .stability import Stability, least_damped, sampled_poles
from .stated_ranges import RangeAtRest, ranges_at_rest
from .sweep import Chart, Columns, PointView, View, over_angle

__all__ = [
    "Chart",
    "Columns",
    "EmpiricalGramian",
    "EstimateDeviation",
    "NoiseAssumptions",
    "Observability",
    "PlantMode",
    "PointView",
    "RangeAtRest",
    "RankDrop",
    "RankDrops",
    "RankingAssumptions",
    "RestPoint",
    "RestPoints",
    "SensorCandidate",
    "SensorGain",
    "SensorRanking",
    "Stability",
    "Unseen",
    "View",
    "empirical_gramian",
    "least_damped",
    "over_angle",
    "ranges_at_rest",
    "rank_drops",
    "rank_sensors",
    "rest_points",
    "sampled_poles",
]
