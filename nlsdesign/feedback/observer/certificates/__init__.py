"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""

from .certificate import CERTIFICATE, Certificate, write_certificate
from .co_design import CertifiedGain
from .continuous import certify_continuous
from .contraction import Contraction, certify, declared_assumptions
from .torque_bound import Assumptions
from .verification import CodeToCompare, certified_design, read_certificate, verify

__all__ = [
    "CERTIFICATE",
    "Assumptions",
    "Certificate",
    "CertifiedGain",
    "CodeToCompare",
    "Contraction",
    "certified_design",
    "certify",
    "certify_continuous",
    "declared_assumptions",
    "read_certificate",
    "verify",
    "write_certificate",
]
