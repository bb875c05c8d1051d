"""From a flat model to a discrete observer, which is a flat model again."""

from .adaptive.adaptive_observer import AdaptiveDesign, design_adaptive_observer
from .adaptive.estimator_bound import SensedTorque, EstimatorBound, estimator_bound
from .adaptive.directions import UncertainDirections
from .adaptive.duty import Duty
from .adaptive.adaptive_settings import AdaptiveSettings, Trust
from .scheduling.check import ErrorStability, check_stability
from .scheduling.forms import Minimal, PaperForm, StateForm
from .scheduling.gains import CascadeGain, GainRule, PolePlacement, SteadyStateKalman
from .scheduling.run import observe
from .scheduling.scheduled import ObserverDesign, design_observer_with_details
from .scheduling.table import FixedGrid, Grid, GridByTolerance
from .spread.choice import ObserverOfChoice, choose_observer, design_observer
from .spread.spread_errors import SpreadErrors, observer_errors
from .spread.bench_trial import Trial, bench_trial

__all__ = [
    "AdaptiveDesign",
    "AdaptiveSettings",
    "CascadeGain",
    "Duty",
    "ErrorStability",
    "FixedGrid",
    "GainRule",
    "Grid",
    "GridByTolerance",
    "Minimal",
    "ObserverDesign",
    "ObserverOfChoice",
    "PaperForm",
    "PolePlacement",
    "SensedTorque",
    "SpreadErrors",
    "StateForm",
    "SteadyStateKalman",
    "EstimatorBound",
    "Trial",
    "Trust",
    "UncertainDirections",
    "bench_trial",
    "check_stability",
    "choose_observer",
    "design_adaptive_observer",
    "design_observer",
    "design_observer_with_details",
    "observe",
    "observer_errors",
    "estimator_bound",
]
