"""Certificates as JSON files that a stranger can read and re-check."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ....foundation.errors import MeasurementError, NlsError
from ....foundation.reading import text_of
from ....foundation.writing import write_text
from ....model.paper_form import PaperFormNames
from ..scheduling.angle_form import Minimal, PaperForm
from ..scheduling.step import ConstantGain
from .certificate import Certificate
from .continuous import ContinuousCertificate
from .error_system import ErrorSystem
from .held_estimate import HeldEstimateBound, HeldEstimateCertificate
from .polytope import EntryReading, ErrorPolytope
from .torque_bound import Assumptions, TorqueErrorBound

FORMAT = "nlsdesign observer certificate 1"
CONTINUOUS, HELD = f"{FORMAT}, continuous time", f"{FORMAT}, held estimate"

Proof: TypeAlias = Certificate | ContinuousCertificate | HeldEstimateCertificate
"""Whatever a file of proof can hold."""


def certificate_text(certificate: Proof) -> str:
    """Return the JSON text of a certificate."""
    content: dict[str, Any]
    if isinstance(certificate, Certificate):
        content = _content(certificate)
    elif isinstance(certificate, ContinuousCertificate):
        content = _continuous_content(certificate)
    else:
        content = _held_content(certificate)
    content["checksum"] = _checksum(content)
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def write_certificate(certificate: Proof, path: str | Path) -> Path:
    """Write a certificate as JSON.

    Parameters
    ----------
    certificate
        What is proved.
    path
        File.

    Raises
    ------
    ExportError
        If the file cannot be written.
    """
    write_text(Path(path), certificate_text(certificate))
    return Path(path)


def read_certificate(path: str | Path) -> tuple[Proof, bool]:
    """Read a certificate, and whether its checksum and its sentences are those of its numbers.

    Parameters
    ----------
    path
        File.

    Raises
    ------
    MeasurementError
        If it cannot be read, or is no certificate of this format.
    """
    try:
        text = text_of(Path(path), MeasurementError)
        content = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise MeasurementError(str(path), f"is no readable certificate ({error})") from None
    readers: dict[str, Callable[[dict[str, Any]], Proof]] = {
        FORMAT: _certificate,
        CONTINUOUS: _continuous,
        HELD: _held,
    }
    reader = readers.get(str(content.get("format"))) if isinstance(content, dict) else None
    if reader is None:
        raise MeasurementError(
            str(path), f"is no certificate of format '{FORMAT}'",
            next_step="write one with nlsdesign observer --deck DECK --certificate",
        )  # fmt: skip
    try:
        certificate = reader(content)
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, NlsError) as error:
        raise MeasurementError(str(path), f"is no readable certificate ({error!r})") from None
    # The whole text is compared, so that no digit can be touched that the proof does not use.
    return certificate, certificate_text(certificate) == text


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no number")


def _checksum(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, ensure_ascii=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _head(form: str, c: Proof) -> dict[str, Any]:
    """Return what all certificates begin with."""
    name, text = c.deck
    return {
        "format": form,
        "statement": list(c.statement),
        "deck": {"name": name, "sha256": hashlib.sha256(text.encode()).hexdigest(), "text": text},
        "parameters": dict(c.parameters),
    }


def _content(c: Certificate) -> dict[str, Any]:
    p = c.polytope
    torque: dict[str, Any] | str = (
        c.torque if isinstance(c.torque, str) else {"total": c.torque.total, **asdict(c.torque)}
    )
    return {
        **_head(FORMAT, c),
        "observer": {"estimate": c.estimate, "measured": c.measured, "gain": [list(r) for r in c.gain.rows]},
        "polytope": {
            **{k: getattr(p, k) for k in ("states", "sizes", "moving", "seen", "sample_time", "columns")},
            "friction": p.friction,
            "transition": [[list(e) for e in row] for row in p.transition],
        },
        "lyapunov": c.lyapunov.tolist(),
        "decay": c.decay,
        "condition": c.condition,
        "assumptions": {**asdict(c.assumptions), "spreads": dict(c.assumptions.spreads)},
        "torque": torque,
        "code": dict(c.code),
    }


def _certificate(content: dict[str, Any]) -> Certificate:
    p, a, o, torque = (content[k] for k in ("polytope", "assumptions", "observer", "torque"))
    gain = ConstantGain(tuple(tuple(float(v) for v in row) for row in o["gain"]))
    matrix = tuple(
        tuple(EntryReading(float(f), None if c is None else int(c)) for f, c in r) for r in p["transition"]
    )
    polytope = ErrorPolytope(
        states=tuple(p["states"]), sizes=tuple(p["sizes"]), moving=(p["moving"][0], p["moving"][1]),
        seen=tuple(p["seen"]), sample_time=p["sample_time"],
        columns=tuple((low, high) for low, high in p["columns"]), transition=matrix,
        correction=tuple(tuple(EntryReading(v, None) for v in row) for row in gain.rows),
        friction=(p["friction"][0], p["friction"][1]),
    )  # fmt: skip
    n = len(polytope.states)
    lyapunov = np.array(content["lyapunov"], dtype=float)
    if lyapunov.shape != (n, n) or len(matrix) != n or len(polytope.sizes) != n or min(polytope.sizes) <= 0.0:
        raise ValueError("matrices do not have one row per state")
    bound: TorqueErrorBound | str = torque
    if not isinstance(torque, str):
        start = {k: (v[0], v[1]) for k, v in torque["start"].items()}
        causes = {k: float(v) for k, v in torque.items() if k not in ("total", "start")}
        bound = TorqueErrorBound(**causes, start=start)
    assumed = _assumptions(a)
    deck = content["deck"]
    return Certificate(
        deck=(str(deck["name"]), str(deck["text"])), parameters=content["parameters"],
        estimate=o["estimate"], measured=o["measured"], gain=gain, polytope=polytope, lyapunov=lyapunov,
        decay=float(content["decay"]), condition=float(content["condition"]), assumptions=assumed,
        torque=bound, code=content["code"],
    )  # fmt: skip


def _assumptions(a: dict[str, Any]) -> Assumptions:
    return Assumptions(
        (a["angles"][0], a["angles"][1]), a["speed"], a["angle_error"], a["spreads"], a["real"]
    )


def _continuous_content(c: ContinuousCertificate) -> dict[str, Any]:
    form: dict[str, Any] = {"states": "minimal"}
    if isinstance(c.form, PaperForm):
        form = {"states": "published", "names": asdict(c.form.names)}
    return {
        **_head(CONTINUOUS, c),
        "observer": {
            "estimate": c.estimate, "measured": c.measured, "form": form,
            "gain": [list(row) for row in c.gain],
        },
        "system": asdict(c.system),
        "lyapunov": c.lyapunov.tolist(),
        "decay": c.decay,
        "condition": c.condition,
    }  # fmt: skip


def _continuous(content: dict[str, Any]) -> ContinuousCertificate:
    o, e, deck = content["observer"], content["system"], content["deck"]
    form: Minimal | PaperForm = Minimal()
    if o["form"]["states"] == "published":
        form = PaperForm(PaperFormNames(**o["form"]["names"]))
    elif o["form"]["states"] != "minimal":
        raise ValueError(f"form '{o['form']['states']}' is not known")
    low, high, gain = (_rows(v) for v in (e["lower"], e["upper"], o["gain"]))
    system = ErrorSystem(
        tuple(e["states"]), tuple(e["sizes"]), (e["moving"][0], e["moving"][1]), tuple(e["seen"]),
        (e["angles"][0], e["angles"][1]), low, high,
    )  # fmt: skip
    n, lyapunov = len(system.states), np.array(content["lyapunov"], dtype=float)
    square = all(len(m) == n and all(len(row) == n for row in m) for m in (low, high, lyapunov.tolist()))
    if not square or [len(row) for row in gain] != [len(system.seen)] * n or min(system.sizes) <= 0.0:
        raise ValueError("matrices do not have one row per state")
    return ContinuousCertificate(
        deck=(str(deck["name"]), str(deck["text"])), parameters=content["parameters"],
        estimate=o["estimate"], measured=o["measured"], form=form, gain=gain, system=system,
        lyapunov=lyapunov, decay=float(content["decay"]), condition=float(content["condition"]),
    )  # fmt: skip


def _rows(matrix: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in row) for row in matrix)


def _held_content(c: HeldEstimateCertificate) -> dict[str, Any]:
    return {
        **_head(HELD, c),
        "observer": {
            "estimate": c.estimate, "measured": c.measured, "sample_time": c.sample_time,
            "settings": dict(c.settings),
        },
        "assumptions": {**asdict(c.assumptions), "spreads": dict(c.assumptions.spreads)},
        "bound": {"total": c.bound.total, **asdict(c.bound)},
        "code": dict(c.code),
    }  # fmt: skip


def _held(content: dict[str, Any]) -> HeldEstimateCertificate:
    o, b, deck = content["observer"], content["bound"], content["deck"]
    bound = HeldEstimateBound(
        float(b["learned"]), float(b["cascade"]), float(b["limit"]),
        {name: (float(ends[0]), float(ends[1])) for name, ends in b["boxes"].items()},
    )  # fmt: skip
    return HeldEstimateCertificate(
        deck=(str(deck["name"]), str(deck["text"])), parameters=content["parameters"],
        estimate=o["estimate"], measured=o["measured"], sample_time=float(o["sample_time"]),
        settings=o["settings"], assumptions=_assumptions(content["assumptions"]), bound=bound,
        code=content["code"],
    )  # fmt: skip
