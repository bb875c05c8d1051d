"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""

from .certificate import Certificate, certify, declared_assumptions
from .certificate_file import Proof, certificate_text, read_certificate, write_certificate
from .co_design import CertifiedGain
from .continuous import ContinuousCertificate, certify_continuous
from .error_system import ErrorSystem, error_system
from .held_estimate import (
    HeldEstimateBound,
    HeldEstimateCertificate,
    certify_held_estimate,
    clamped_estimate_bound,
    held_estimate_bound,
)
from .polytope import ErrorPolytope, error_polytope
from .torque_bound import Assumptions, TorqueErrorBound, torque_bound
from .verification import Check, CodeToCompare, Verification, certified_design, verify

__all__ = [
    "Assumptions",
    "Certificate",
    "CertifiedGain",
    "Check",
    "CodeToCompare",
    "ContinuousCertificate",
    "ErrorPolytope",
    "ErrorSystem",
    "HeldEstimateBound",
    "HeldEstimateCertificate",
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
