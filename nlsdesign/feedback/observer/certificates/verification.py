"""Reads a certificate and checks it again without the solver that found it: in fractions and intervals."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias, cast

import numpy as np

from ....foundation.errors import MeasurementError, NlsError
from ....foundation.text_files import text_of, without_stamp
from ....foundation.written_numbers import prefixed
from ....model import FlatModel
from ..scheduling.scheduled import ObserverDesign, design_observer_with_details
from ..scheduling.table import Grid
from .certificate import FORMAT, Certificate, certificate_text, hashes_of_code
from .co_design import GainAndLyapunov
from .continuous import ContinuousContraction, covers, decays
from .contraction import Contraction, contracts, within_condition
from .error_system import error_system
from .polytope import ErrorPolytope, error_polytope
from .torque_bound import TorqueErrorBound, torque_bound

SAME = 1e-9
"""Relative difference of numbers that another machine may compute for the same table."""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    name: str
    holds: bool | None
    detail: str


@dataclass(frozen=True)
class Verification:
    """What a re-check of a certificate found."""

    checks: tuple[Check, ...]  # in the order in which they were made

    @property
    def holds(self) -> bool:
        """Whether nothing that was looked at failed."""
        return all(check.holds is not False for check in self.checks)

    def __str__(self) -> str:
        words = {True: "holds", False: "DOES NOT HOLD", None: "not compared"}
        return "\n".join(f"{words[c.holds]}: {c.name} ({c.detail})" for c in self.checks)


AnyProof: TypeAlias = Contraction | ContinuousContraction
"""Whatever a file of proof can hold."""
PROOFS: dict[str, type[Contraction] | type[ContinuousContraction]] = {
    proof.form: proof for proof in (Contraction, ContinuousContraction)
}
"""Kind of proof by the format of its file."""


def read_certificate(path: str | Path) -> tuple[Certificate[AnyProof], bool]:
    """Read a certificate, and whether its checksum and its sentences are those of its numbers.

    Parameters
    ----------
    path
        Name of the file.

    Raises
    ------
    MeasurementError
        If it cannot be read, or is no certificate of this format.
    """

    def refuse(constant: str) -> float:
        raise ValueError(f"{constant} is no number")

    try:
        text = text_of(Path(path), MeasurementError)
        content = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise MeasurementError(str(path), f"is no readable certificate ({error})") from None
    kind = PROOFS.get(str(content.get("format"))) if isinstance(content, dict) else None
    if kind is None:
        raise MeasurementError(
            str(path), f"is no certificate of format '{FORMAT}'",
            next_step="write one with nlsdesign observer --deck DECK --certificate",
        )  # fmt: skip
    try:
        deck, observer = content["deck"], content["observer"]
        certificate: Certificate[AnyProof] = Certificate(
            (str(deck["name"]), str(deck["text"])), content["parameters"], observer["estimate"],
            observer["measured"], kind.read(content), content["code"] if kind.sampled else {},
        )  # fmt: skip
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, NlsError) as error:
        raise MeasurementError(str(path), f"is no readable certificate ({error!r})") from None
    # The whole text is compared, so that no digit can be touched that the proof does not use.
    return certificate, certificate_text(certificate) == text


@dataclass(frozen=True, eq=False)
class CodeToCompare:
    """C files that should be those of a certificate.

    Parameters
    ----------
    folder
        Where they are.
    writes
        Writes the observer of the certificate anew, :func:`~nlsdesign.export.export_c`; without it only
        hashes are compared, which a forger can write anew too. The sentences of the certificate are added.
    """

    folder: Path
    writes: Callable[..., object] | None = None


def verify(
    certificate: Certificate[AnyProof],
    *,
    untouched: bool = True,
    model: FlatModel | None = None,
    deck: str | None = None,
    code: Path | CodeToCompare | None = None,
    grid: Grid | None = None,
) -> Verification:
    """Check a certificate again.

    Parameters
    ----------
    certificate
        As :func:`read_certificate` gives it.
    untouched
        Whether checksum and sentences of the file are those of its numbers.
    model
        Flat model of its deck; without it the table and the bound on the torque are not compared.
    deck
        Text of a deck that should be the certified one.
    code
        Folder of C files that should be the certified ones; with what writes them they are written anew from
        the deck and compared character by character.
    grid
        With which a scheduled observer was designed, if not the default one.
    """
    checks = [Check("file", untouched, "checksum and sentences agree with the numbers" if untouched
                    else "a character differs from what was written")]  # fmt: skip
    observer: FlatModel | None = None
    proof = certificate.proof
    if isinstance(proof, Contraction):
        checks += _contraction(proof)
        again = _designed_again(certificate, proof, model, grid)
        checks += _against_model(certificate, proof, model, again)
        observer = again[1].model if isinstance(again, tuple) else None
    else:
        checks += _decay(certificate, proof, model)
    if deck is not None:
        same = _hash(deck) == _hash(certificate.deck[1])
        checks.insert(1, Check("deck", same, f"sha256 {_hash(deck)[:12]}"))
    if code is not None:
        compare = code if isinstance(code, CodeToCompare) else CodeToCompare(code)
        checks.append(_against_code(certificate, compare, observer))
    elif certificate.code:
        checks.append(Check("C code", None, "name its folder with --c"))
    return Verification(tuple(checks))


def _contraction(proof: Contraction) -> list[Check]:
    p = proof.lyapunov
    holds = bool(np.all(np.isfinite(p))) and proof.decay > 0.0
    holds = holds and contracts(proof.polytope, p, proof.decay)
    condition = holds and within_condition(p, proof.condition)
    return [
        Check("contraction", holds, f"decay {proof.decay:g} 1/s at every corner, in fractions"),
        Check("condition of P", condition, f"at most {proof.condition:g}"),
    ]


def _decay(
    certificate: Certificate[AnyProof], proof: ContinuousContraction, model: FlatModel | None
) -> list[Check]:
    p, system = proof.lyapunov, proof.system
    solution = GainAndLyapunov(np.array(proof.gain), p)
    holds = bool(np.all(np.isfinite(p)) and proof.decay > 0.0)
    holds = holds and decays(system, solution, proof.decay)
    condition = holds and within_condition(p, proof.condition)
    checks = [
        Check("decay", holds, f"{proof.decay:g} 1/s at every corner, in fractions"),
        Check("condition of P", condition, f"at most {proof.condition:g}"),
    ]
    if model is None:
        return [*checks, Check("ranges of A", None, "needs the deck")]
    try:
        changed = model.with_values(dict(certificate.parameters))
        again = error_system(
            changed, proof.states, estimate=certificate.estimate, measured=certificate.measured,
            angles=system.angles,
        )  # fmt: skip
    except NlsError as error:  # the deck does not give this error system, whatever the reason
        return [*checks, Check("ranges of A", False, str(error))]
    words = "bounded again over every angle and speed" + _others(certificate, model)
    return [*checks, Check("ranges of A", covers(system, again), words)]


def _others(certificate: Certificate[AnyProof], model: FlatModel) -> str:
    declared = model.values
    others = [n for n, v in certificate.parameters.items() if declared[n] != v]
    return f"; {len(others)} parameters differ from the deck: {', '.join(others[:3])}" if others else ""


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _against_code(
    certificate: Certificate[AnyProof], code: CodeToCompare, observer: FlatModel | None
) -> Check:
    proof = certificate.proof
    if isinstance(proof, ContinuousContraction) or not certificate.code:
        return Check("C code", False, "the certificate names no C files")
    hashed = hashes_of_code(code.folder)
    wrong = [name for name, digest in certificate.code.items() if hashed.get(name) != digest]
    if wrong:
        return Check("C code", False, f"{', '.join(wrong)} differs or is missing")
    if code.writes is None or observer is None:
        return Check("C code", True, f"{', '.join(certificate.code)}: hashes only, not written anew")
    with TemporaryDirectory() as folder:
        for name in sorted({Path(file).stem for file in certificate.code}):
            code.writes(certificate.stated(observer), Path(folder), real=proof.assumptions.real, name=name)
        wrong = [n for n in certificate.code if not _same_but_for_the_date(code.folder / n, Path(folder) / n)]
    if wrong:
        return Check(
            "C code", False, f"{', '.join(wrong)} is not what the deck gives, though its hash is named"
        )
    return Check("C code", True, f"{', '.join(certificate.code)}: written anew from the deck")


def _same_but_for_the_date(*files: Path) -> bool:
    """Compare exported files without their date: code is verified on a later day than it is written."""
    if not all(file.is_file() for file in files):
        return False
    first, second = (without_stamp(file.read_bytes().decode("utf-8", "surrogateescape")) for file in files)
    return first == second


Again: TypeAlias = tuple[FlatModel, ObserverDesign] | Check


def certified_design(
    certificate: Certificate[Contraction], model: FlatModel, *, grid: Grid | None = None
) -> ObserverDesign:
    """Return the observer of a certificate, designed from its deck with its gain: what belongs into C.

    Parameters
    ----------
    certificate
        Of a scheduled observer.
    model
        Flat model of its deck.
    grid
        With which it was designed, if not the default one.

    Raises
    ------
    NlsError
        If the model does not give this observer.
    """
    return design_observer_with_details(
        model.with_values(dict(certificate.parameters)), estimate=certificate.estimate,
        measured=certificate.measured, sample_time=certificate.proof.polytope.sample_time,
        gain=certificate.proof.gain, grid=grid,
    )  # fmt: skip


def _designed_again(
    certificate: Certificate[AnyProof], proof: Contraction, model: FlatModel | None, grid: Grid | None
) -> Again:
    if model is None:
        return Check("table and torque bound", None, "needs the deck")
    try:
        changed = model.with_values(dict(certificate.parameters))
        return changed, certified_design(cast("Certificate[Contraction]", certificate), model, grid=grid)
    except NlsError as error:  # the deck does not give this observer, whatever the reason
        return Check("table", False, str(error))


def _against_model(
    certificate: Certificate[AnyProof], proof: Contraction, model: FlatModel | None, again: Again
) -> list[Check]:
    if model is None or isinstance(again, Check):
        return [again] if isinstance(again, Check) else []
    changed, design = again
    same = _same(proof.polytope, error_polytope(design))
    return [
        Check("table", same, "designed again from the deck" + _others(certificate, model)),
        _torque(proof, changed, design),
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


def _torque(proof: Contraction, model: FlatModel, design: ObserverDesign) -> Check:
    claimed = proof.torque
    if isinstance(claimed, str):
        return Check("torque bound", None, f"none is claimed: {claimed}")
    try:
        again = torque_bound(model, design, proof.assumptions)
    except NlsError as error:  # nothing can be bounded, so nothing may be claimed
        return Check("torque bound", False, str(error))
    return Check("torque bound", _covers(claimed, again), f"{prefixed(again.total, digits=4)} found again")


def _covers(claimed: TorqueErrorBound, again: TorqueErrorBound) -> bool:
    causes = all(value <= claimed.causes[name] * (1.0 + 1e-6) + 1e-12 for name, value in again.causes.items())
    start = claimed.start.keys() == again.start.keys() and all(
        claimed.start[n][0] * (1.0 + 1e-6) >= torque and claimed.start[n][1] <= rate * (1.0 + 1e-6)
        for n, (torque, rate) in again.start.items()
    )
    return causes and start
