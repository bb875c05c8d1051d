"""A short formula for what is left: orthogonal least squares on a small library, one term after the other.

Chen, Billings and Luo 1989. Terms of the library resemble each other, so dropping small ones from the full
regression leaves many large ones that cancel; adding the one that explains most of what is left does not.
How many are kept is decided on records that the regression has not seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ....foundation.quantity import typeset_unit

Part = tuple[Array, Mapping[str, Array], bool]

_MOST_TERMS = 5
_LEAST = 0.3
"""Share of the remainder that a formula must explain on other records to be reported."""
_PER_TERM = 0.02
"""Share that a further term must add there."""


@dataclass(frozen=True)
class Formula:
    """A regression on measured signals.

    Parameters
    ----------
    terms
        Coefficient by name of the term, in SI.
    share
        Share of the remainder that it explains on records that it was not fitted to.
    text
        The sum, written out.
    """

    terms: Mapping[str, float]
    share: float
    text: str


def sparse_formula(
    parts: Sequence[Part], unit: str, extra: Sequence[Mapping[str, Array]] = ()
) -> Formula | None:
    """Return a short formula for an error, or nothing if none holds on the other records."""
    columns = [_library(signals) for _, signals, _ in parts]
    for column, more in zip(columns, extra, strict=False):
        column |= more
    names = list(columns[0])
    table = [np.column_stack([c[n] for n in names]) for c in columns]
    seen = [i for i, p in enumerate(parts) if p[2]] or list(range(len(parts)))
    others = [i for i in range(len(parts)) if i not in seen] or seen
    a, b = np.vstack([table[i] for i in seen]), np.concatenate([parts[i][0] for i in seen])
    rest, target = np.vstack([table[i] for i in others]), np.concatenate([parts[i][0] for i in others])
    size = np.sqrt(np.mean(a**2, axis=0))
    kept = size > 1e-12 * size.max()
    candidates = _one_by_one(a[:, kept] / size[kept], b)
    whole = float(target @ target)
    scored = []
    for weights in candidates:
        left = target - rest[:, kept] @ (weights / size[kept])
        share = 1.0 - float(left @ left) / whole if whole > 0.0 else 0.0
        scored.append((share - _PER_TERM * int(np.count_nonzero(weights)), share, weights))
    _, share, weights = max(scored, key=lambda s: s[0])
    if share < _LEAST or not np.any(weights):
        return None
    used = [n for n, k in zip(names, kept, strict=True) if k]
    terms = {n: float(w / s) for n, w, s in zip(used, weights, size[kept], strict=True) if w}
    ordered = dict(sorted(terms.items(), key=lambda pair: -abs(pair[1]) * size[names.index(pair[0])]))
    text = " ".join(f"{value:+.4g}·{name}" for name, value in ordered.items()).lstrip("+")
    return Formula(ordered, share, f"{text} (in {typeset_unit(unit) or '1'}, signals in SI)")


def _library(signals: Mapping[str, Array]) -> dict[str, Array]:
    terms = {"1": np.ones(len(next(iter(signals.values()))))}
    rates = [n for n in signals if n.startswith("rate of ")]
    for name, value in signals.items():
        short = f"[{name}]"
        terms |= {short: value, f"|{short}|": np.abs(value), f"{short}²": value**2, f"{short}³": value**3}
        terms[f"sign({short})"] = np.sign(value)
    for rate in rates:
        speed = signals[rate]
        terms[f"[{rate}]·|[{rate}]|"] = speed * np.abs(speed)
        for name, value in signals.items():
            if name not in rates:
                terms[f"sign([{rate}])·|[{name}]|"] = np.sign(speed) * np.abs(value)
                terms[f"[{rate}]·[{name}]"] = speed * value
    return terms


def _one_by_one(a: Array, b: Array) -> list[Array]:
    """Return weights with one term, two, and so on; each is the term that explains most of the rest."""
    active: list[int] = []
    steps, free = [], a / np.linalg.norm(a, axis=0)
    for _ in range(min(_MOST_TERMS, a.shape[1])):
        gains = np.abs(free.T @ b)
        gains[active] = -1.0
        active.append(int(np.argmax(gains)))
        weights = np.zeros(a.shape[1])
        weights[active] = np.linalg.lstsq(a[:, active], b, rcond=1e-6)[0]
        steps.append(weights)
        taken = free[:, active[-1]]
        free = free - np.outer(taken, taken @ free)
        norms = np.linalg.norm(free, axis=0)
        # A term that the others already hold would be noise, blown up.
        free = np.where(norms > 1e-3, free / np.maximum(norms, 1e-300), 0.0)
    return steps
