"""From a flat model to a discrete observer, which is a flat model again."""

from .check import ErrorStability, check_stability
from .forms import Minimal, PaperForm, StateForm
from .gains import CascadeGain, GainRule, PolePlacement, SteadyStateKalman
from .run import observe
from .scheduled import ObserverDesign, design_observer, design_observer_with_details
from .table import FixedGrid, Grid, GridByTolerance

__all__ = [
    "CascadeGain",
    "ErrorStability",
    "FixedGrid",
    "GainRule",
    "Grid",
    "GridByTolerance",
    "Minimal",
    "ObserverDesign",
    "PaperForm",
    "PolePlacement",
    "StateForm",
    "SteadyStateKalman",
    "check_stability",
    "design_observer",
    "design_observer_with_details",
    "observe",
]
