"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""

from .box_bound import clamped_estimate_bound
from .certificate import Certificate, certify, declared_assumptions
from .certificate_file import certificate_text, read_certificate, write_certificate
from .co_design import CertifiedGain
from .polytope import ErrorPolytope, error_polytope
from .torque_bound import Assumptions, TorqueErrorBound, torque_bound
from .verification import Check, Verification, verify

__all__ = [
    "Assumptions",
    "Certificate",
    "CertifiedGain",
    "Check",
    "ErrorPolytope",
    "TorqueErrorBound",
    "Verification",
    "certificate_text",
    "certify",
    "clamped_estimate_bound",
    "declared_assumptions",
    "error_polytope",
    "read_certificate",
    "torque_bound",
    "verify",
    "write_certificate",
]
