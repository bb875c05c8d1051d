"""From a flat model to a discrete observer, which is a flat model again."""

from .check import ErrorStability, check_stability
from .forms import AsPublished, Minimal, StateForm
from .gains import CascadeGain, GainRule, PolePlacement, SteadyStateKalman
from .run import observe
from .scheduled import ObserverDesign, design_observer, observer_design
from .table import FixedGrid, Grid, GridByTolerance

__all__ = [
    "AsPublished",
    "CascadeGain",
    "ErrorStability",
    "FixedGrid",
    "GainRule",
    "Grid",
    "GridByTolerance",
    "Minimal",
    "ObserverDesign",
    "PolePlacement",
    "StateForm",
    "SteadyStateKalman",
    "check_stability",
    "design_observer",
    "observe",
    "observer_design",
]
