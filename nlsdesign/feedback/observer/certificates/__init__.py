"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""

from .certificate import Certificate, certify, declared_assumptions
from .certificate_file import Proof, read_certificate, write_certificate
from .co_design import CertifiedGain
from .continuous import ContinuousCertificate, certify_continuous
from .held_estimate import HeldEstimateCertificate, certify_held_estimate, clamped_estimate_bound
from .torque_bound import Assumptions
from .verification import CodeToCompare, Verification, certified_design, verify

__all__ = [
    "Assumptions",
    "Certificate",
    "CertifiedGain",
    "CodeToCompare",
    "ContinuousCertificate",
    "HeldEstimateCertificate",
    "Proof",
    "Verification",
    "certified_design",
    "certify",
    "certify_continuous",
    "certify_held_estimate",
    "clamped_estimate_bound",
    "declared_assumptions",
    "read_certificate",
    "verify",
    "write_certificate",
]
