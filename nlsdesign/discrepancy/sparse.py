"""A short formula for what is left: sequentially thresholded least squares on a small library.

Brunton, Proctor and Kutz 2016 (STLSQ); here the threshold is chosen on records that the regression has not
seen, and a term counts by what it contributes, not by the size of its coefficient.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Part = tuple[Array, Mapping[str, Array], bool]

_THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4)
_LEAST = 0.3
_PER_TERM = 0.02
_ROUNDS = 10


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
    """Return a short formula for an error, or nothing if none holds on the other records.

    Parameters
    ----------
    parts
        For each record: error, signals at the same places, whether the formula may be fitted to it.
    unit
        Of the error.
    extra
        Further terms of each record by name.
    """
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
    found = [_thresholded(a[:, kept] / size[kept], b, t) for t in _THRESHOLDS]
    whole = float(target @ target)
    scored = []
    for weights in found:
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
    return Formula(ordered, share, f"{text} (in {unit}, signals in SI)")


def _library(signals: Mapping[str, Array]) -> dict[str, Array]:
    found = {"1": np.ones(len(next(iter(signals.values()))))}
    rates = [n for n in signals if n.startswith("rate of ")]
    for name, value in signals.items():
        short = f"[{name}]"
        found |= {short: value, f"|{short}|": np.abs(value), f"{short}²": value**2, f"{short}³": value**3}
        found[f"sign({short})"] = np.sign(value)
    for rate in rates:
        speed = signals[rate]
        found[f"[{rate}]·|[{rate}]|"] = speed * np.abs(speed)
        for name, value in signals.items():
            if name not in rates:
                found[f"sign([{rate}])·|[{name}]|"] = np.sign(speed) * np.abs(value)
                found[f"[{rate}]·[{name}]"] = speed * value
    return found


def _thresholded(a: Array, b: Array, threshold: float) -> Array:
    """Return weights of normalised columns; terms below a share of the largest are dropped until none is."""
    weights = np.zeros(a.shape[1])
    active = np.arange(a.shape[1])
    for _ in range(_ROUNDS):
        solved = np.linalg.lstsq(a[:, active], b, rcond=1e-6)[0]
        size = np.abs(solved)
        stays = size >= threshold * max(float(np.sqrt(np.mean(b**2))), 1e-300)
        if np.all(stays):
            break
        active = active[stays]
        if not len(active):
            return weights
    weights[active] = np.linalg.lstsq(a[:, active], b, rcond=1e-6)[0]
    return weights
