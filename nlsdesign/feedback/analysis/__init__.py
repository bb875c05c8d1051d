"""What can be said of a model before anything is built on it: observability, stability, best estimate."""

from .kalman import EstimateDeviation, NoiseAssumptions
from .observability import (
    EmpiricalGramian,
    Observability,
    RankDrop,
    RankDrops,
    Unseen,
    empirical_gramian,
    rank_drops,
)
from .rest import RangeAtRest, ranges_at_rest
from .rest_points import PlantMode, RestPoint, RestPoints, rest_points
from .sensor_ranking import (
    RankingAssumptions,
    SensorCandidate,
    SensorGain,
    SensorRanking,
    rank_sensors,
)
from .stability import Stability, least_damped, sampled_poles
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
