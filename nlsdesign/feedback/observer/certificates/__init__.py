"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling`` and ``adaptive``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""

from .certificate import CERTIFICATE, Certificate, Proof, certificate_text, write_certificate
from .co_design import CertifiedGain
from .continuous import ContinuousContraction, certify_continuous
from .contraction import Contraction, certify, declared_assumptions
from .error_system import ErrorSystem, error_system
from .held_estimate import (
    HeldEstimate,
    HeldEstimateBound,
    certify_held_estimate,
    clamped_estimate_bound,
    held_estimate_bound,
)
from .polytope import ErrorPolytope, error_polytope
from .torque_bound import Assumptions, TorqueErrorBound, torque_bound
from .verification import Check, CodeToCompare, Verification, certified_design, read_certificate, verify

__all__ = [
    "CERTIFICATE",
    "Assumptions",
    "Certificate",
    "CertifiedGain",
    "Check",
    "CodeToCompare",
    "ContinuousContraction",
    "Contraction",
    "ErrorPolytope",
    "ErrorSystem",
    "HeldEstimate",
    "HeldEstimateBound",
    "Proof",
    "TorqueErrorBound",
    "Verification",
    "certificate_text",
    "certified_design",
    "certify",
    "certify_continuous",
    "certify_held_estimate",
    "clamped_estimate_bound",
    "declared_assumptions",
    "error_polytope",
    "error_system",
    "held_estimate_bound",
    "read_certificate",
    "torque_bound",
    "verify",
    "write_certificate",
]
