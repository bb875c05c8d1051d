"""From a flat model to a discrete observer, which is a flat model again."""

from .certificates import (
    Assumptions,
    Certificate,
    CertifiedGain,
    TorqueErrorBound,
    Verification,
    certify,
    clamped_estimate_bound,
    declared_assumptions,
    read_certificate,
    torque_bound,
    verify,
    write_certificate,
)
from .scheduling.check import ErrorStability, check_stability
from .scheduling.forms import Minimal, PaperForm, StateForm
from .scheduling.gains import (
    CascadeGain,
    ConstantGain,
    FittedGain,
    GainRule,
    PolePlacement,
    SteadyStateKalman,
)
from .scheduling.run import observe
from .scheduling.scheduled import ObserverDesign, design_observer, design_observer_with_details
from .scheduling.table import FixedGrid, Grid, GridByTolerance

__all__ = [
    "Assumptions",
    "CascadeGain",
    "Certificate",
    "CertifiedGain",
    "ConstantGain",
    "ErrorStability",
    "FittedGain",
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
    "TorqueErrorBound",
    "Verification",
    "certify",
    "check_stability",
    "clamped_estimate_bound",
    "declared_assumptions",
    "design_observer",
    "design_observer_with_details",
    "observe",
    "read_certificate",
    "torque_bound",
    "verify",
    "write_certificate",
]
