"""From a flat model to a discrete observer, which is a flat model again."""

from .certificates import (
    Assumptions,
    Certificate,
    CertifiedGain,
    CodeToCompare,
    Contraction,
    certified_design,
    certify,
    certify_continuous,
    declared_assumptions,
    read_certificate,
    verify,
    write_certificate,
)
from .corrected.corrected_cascade import CorrectedDesign, design_corrected_observer
from .corrected.duty import Duty
from .scheduling.angle_form import Minimal, PaperForm, StateForm
from .scheduling.measured_angle import observe
from .scheduling.scheduled import ObserverDesign, design_observer_with_details
from .scheduling.step import CascadeGain, ConstantGain, GainRule, PolePlacement, SteadyStateKalman
from .scheduling.table import FixedGrid, Grid, GridByTolerance
from .scheduling.torque_grid import GridByTorqueError
from .spread.choice import (
    DesignedObserver,
    ObserverOfChoice,
    choose_observer,
    design_observer,
    designed_observer,
    least_torque_error,
)
from .spread.innovation_alarm import with_innovation_alarm
from .spread.observer_bench import ObserverBench, observer_bench
from .spread.spread_errors import SpreadErrors, errors_beside, observer_errors

__all__ = [
    "Assumptions",
    "CascadeGain",
    "Certificate",
    "CertifiedGain",
    "CodeToCompare",
    "ConstantGain",
    "Contraction",
    "CorrectedDesign",
    "DesignedObserver",
    "Duty",
    "FixedGrid",
    "GainRule",
    "Grid",
    "GridByTolerance",
    "GridByTorqueError",
    "Minimal",
    "ObserverBench",
    "ObserverDesign",
    "ObserverOfChoice",
    "PaperForm",
    "PolePlacement",
    "SpreadErrors",
    "StateForm",
    "SteadyStateKalman",
    "certified_design",
    "certify",
    "certify_continuous",
    "choose_observer",
    "declared_assumptions",
    "design_corrected_observer",
    "design_observer",
    "design_observer_with_details",
    "designed_observer",
    "errors_beside",
    "least_torque_error",
    "observe",
    "observer_bench",
    "observer_errors",
    "read_certificate",
    "verify",
    "with_innovation_alarm",
    "write_certificate",
]
