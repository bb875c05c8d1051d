"""Re-checks a certificate without the solver that found it: in fractions and in interval arithmetic."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import NlsError
from ...model import FlatModel
from ..scheduling.scheduled import ObserverDesign, design_observer_with_details
from ..scheduling.table import Grid
from .certificate import Certificate, contracts, hashes_of_code, within_condition
from .polytope import ErrorPolytope, error_polytope
from .torque_bound import TorqueErrorBound, torque_bound

SAME = 1e-9
"""Relative difference of numbers that another machine may compute for the same table."""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Parameters
    ----------
    name
        What.
    holds
        ``None`` where it could not be looked at.
    detail
        What was again.
    """

    name: str
    holds: bool | None
    detail: str


@dataclass(frozen=True)
class Verification:
    """What a re-check of a certificate found.

    Parameters
    ----------
    checks
        In the order in which they were made.
    """

    checks: tuple[Check, ...]

    @property
    def holds(self) -> bool:
        """Whether nothing that was looked at failed."""
        return all(check.holds is not False for check in self.checks)

    def __str__(self) -> str:
        words = {True: "holds", False: "DOES NOT HOLD", None: "not compared"}
        return "\n".join(f"{words[c.holds]}: {c.name} ({c.detail})" for c in self.checks)


def verify(
    certificate: Certificate,
    *,
    untouched: bool = True,
    model: FlatModel | None = None,
    deck: str | None = None,
    code: Path | None = None,
    grid: Grid | None = None,
) -> Verification:
    """Check a certificate again.

    Parameters
    ----------
    certificate
        As :func:`~nlsdesign.observer.certificates.certificate_file.read_certificate` gives it.
    untouched
        Whether checksum and sentences of the file are those of its numbers.
    model
        Flat model of its deck; without it the table and the bound on the torque are not compared.
    deck
        Text of a deck that should be the certified one.
    code
        Folder of C files that should be the certified ones.
    grid
        With which the observer was designed, if not the default one.
    """
    checks = [Check("file", untouched, "checksum and sentences agree with the numbers" if untouched
                    else "a character differs from what was written")]  # fmt: skip
    p = certificate.lyapunov
    holds = bool(np.all(np.isfinite(p))) and certificate.decay > 0.0
    holds = holds and contracts(certificate.polytope, p, certificate.decay)
    checks.append(
        Check("contraction", holds, f"decay {certificate.decay:g} 1/s at every corner, in fractions")
    )
    condition = holds and within_condition(p, certificate.condition)
    checks.append(Check("condition of P", condition, f"at most {certificate.condition:g}"))
    if deck is not None:
        same = _hash(deck) == _hash(certificate.deck[1])
        checks.append(Check("deck", same, f"sha256 {_hash(deck)[:12]}"))
    checks += _against_model(certificate, model, grid)
    if code is not None:
        checks.append(_against_code(certificate, code))
    elif certificate.code:
        checks.append(Check("C code", None, "name its folder with --c"))
    return Verification(tuple(checks))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _against_code(certificate: Certificate, folder: Path) -> Check:
    again = hashes_of_code(folder)
    wrong = [name for name, digest in certificate.code.items() if again.get(name) != digest]
    if not certificate.code:
        return Check("C code", False, "the certificate names no C files")
    text = f"{', '.join(wrong)} differs or is missing" if wrong else ", ".join(certificate.code)
    return Check("C code", not wrong, text)


def _against_model(certificate: Certificate, model: FlatModel | None, grid: Grid | None) -> list[Check]:
    if model is None:
        return [Check("table and torque bound", None, "needs the deck")]
    try:
        changed = model.with_values(dict(certificate.parameters))
        design = design_observer_with_details(
            changed, estimate=certificate.estimate, measured=certificate.measured,
            sample_time=certificate.polytope.sample_time, gain=certificate.gain, grid=grid,
        )  # fmt: skip
    except NlsError as error:  # the deck does not give this observer, whatever the reason
        return [Check("table", False, str(error))]
    declared = model.values
    others = [n for n, v in certificate.parameters.items() if declared[n] != v]
    text = f"; {len(others)} parameters differ from the deck: {', '.join(others[:3])}" if others else ""
    same = _same(certificate.polytope, error_polytope(design))
    return [
        Check("table", same, "designed again from the deck" + text),
        _torque(certificate, changed, design),
    ]


def _same(a: ErrorPolytope, b: ErrorPolytope) -> bool:
    """Return whether two polytopes are the same but for the last digits of another machine."""
    if (a.states, a.moving, a.seen, a.sample_time) != (b.states, b.moving, b.seen, b.sample_time):
        return False
    if len(a.columns) != len(b.columns) or a.friction[0] > b.friction[0] or a.friction[1] < b.friction[1]:
        return False
    first, second = a.corners(), b.corners()
    used = [e.column for row in (*a.transition, *b.transition) for e in row]
    same = (
        first.shape == second.shape and [e.column for r in a.transition for e in r] == used[: len(used) // 2]
    )
    return same and bool(np.allclose(first, second, rtol=SAME, atol=SAME) and np.allclose(
        np.array(a.columns).ravel(), np.array(b.columns).ravel(), rtol=SAME, atol=1e-15
    )) and a.sizes == b.sizes  # fmt: skip


def _torque(certificate: Certificate, model: FlatModel, design: ObserverDesign) -> Check:
    claimed = certificate.torque
    if isinstance(claimed, str):
        return Check("torque bound", None, f"none is claimed: {claimed}")
    try:
        again = torque_bound(model, design, certificate.assumptions)
    except NlsError as error:  # nothing can be bounded, so nothing may be claimed
        return Check("torque bound", False, str(error))
    return Check("torque bound", _covers(claimed, again), f"{1e3 * again.total:.4g} mN·m found again")


def _covers(claimed: TorqueErrorBound, again: TorqueErrorBound) -> bool:
    causes = all(value <= claimed.causes[name] * (1.0 + 1e-6) + 1e-12 for name, value in again.causes.items())
    start = claimed.start.keys() == again.start.keys() and all(
        claimed.start[n][0] * (1.0 + 1e-6) >= torque and claimed.start[n][1] <= rate * (1.0 + 1e-6)
        for n, (torque, rate) in again.start.items()
    )
    return causes and start
