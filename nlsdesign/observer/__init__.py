"""From a flat model to a discrete observer, which is a flat model again."""

from .scheduling.check import ErrorStability, check_stability
from .scheduling.forms import Minimal, PaperForm, StateForm
from .scheduling.gains import CascadeGain, GainRule, PolePlacement, SteadyStateKalman
from .scheduling.run import observe
from .scheduling.scheduled import ObserverDesign, design_observer, design_observer_with_details
from .scheduling.table import FixedGrid, Grid, GridByTolerance

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
