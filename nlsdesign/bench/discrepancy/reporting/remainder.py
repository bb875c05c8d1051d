"""What is left without a name: where it is, over what it has a shape, of what kind it is, and as a formula.

The formula is found by orthogonal least squares on a small library, one term after the other (Chen,
Billings and Luo 1989). Terms of the library resemble each other, so dropping small ones from the full
regression leaves many large ones that cancel; adding the one that explains most of what is left does not.
How many are kept is decided on records that the regression has not seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....foundation.arrays import Array
from ....foundation.quantity import typeset_unit, with_unit
from ...identification.equation_error.block_noise import rate_span
from ...identification.filters import derivative
from ...identification.records.measurement import RecordSet
from ..selection.comparison import Judged

Part = tuple[Array, Mapping[str, Array], bool]

_MOST_TERMS = 5
_LEAST = 0.3
"""Share of the remainder that a formula must explain on other records to be reported."""
_PER_TERM = 0.02
"""Share that a further term must add there."""


@dataclass(frozen=True)
class Formula:
    """A regression on measured signals."""

    terms: Mapping[str, float]  # coefficient by name of the term, in SI
    share: float  # share of the remainder that it explains on records that it was not fitted to
    text: str  # the sum, written out


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


_ENOUGH = 0.4
"""A shape is reported if it explains this share of the remainder on records that it was not taken from."""
_BINS, _LEAST_IN_BIN = 24, 8
"""Bins of a mean curve, and samples from which a bin counts: enough for a curve, few enough to be no fit."""
_LOWEST, _NARROW = 0.3, 0.15
"""Lowest frequency in Hz that is looked for, below which a record holds too few periods; and half width of
the band around a resonance, relative to its frequency."""
_CHUNK = 200
"""Frequencies that are worked on at a time, to bound memory."""


@dataclass(frozen=True)
class Remainder:
    """A significant error that no effect of the catalogue explains."""

    # block, quantity, unit: where it is, and in what
    block: str
    quantity: str
    unit: str
    # size, floor: root mean square and noise floor, in the unit
    size: float
    floor: float
    kind: str  # in words: periodic in time, drifting, ringing, or bound to a measured signal
    # shapes: share of it that a curve over each signal explains, across records, largest first
    shapes: tuple[tuple[str, float], ...]
    # formula: sparse regression, no law: marked as unnamed; None if no short one holds on other records
    formula: Formula | None

    def words(self) -> str:
        """Return what is known of it in sentences."""
        text = f"What is left is {self.kind}. It acts at `{self.block}` ({self.quantity}) "
        size, floor = (with_unit(f"{number:.3g}", self.unit) for number in (self.size, self.floor))
        text += f"and is {size} rms, the noise floor {floor}."
        if self.formula is not None:
            text += f" Unnamed regression, no law: {self.formula.text} "
            text += f"explains {100 * self.formula.share:.0f} % of it on records that it was not fitted to."
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return it for ``verdict.json``."""
        formula = self.formula
        return {
            "location": self.block,
            "quantity": self.quantity,
            "unit": self.unit,
            "rms": self.size,
            "noise_floor": self.floor,
            "kind": self.kind,
            "shape": [{"over": name, "share": share} for name, share in self.shapes],
            "unnamed_formula": None
            if formula is None
            else {"text": formula.text, "terms": dict(formula.terms), "share": formula.share},
        }


@dataclass(frozen=True)
class _Rows:
    """Residual of one record with the signals at the same places."""

    error: Array
    time: Array
    signals: dict[str, Array]
    fitted: bool


def remainder_of(judged: Sequence[Judged], records: RecordSet, rounded: Sequence[str]) -> Remainder:
    """Return a description of the residual of one block.

    ``rounded``: signals whose noise is rounding, as that of an encoder; the rate of the first is the speed.
    """
    block = judged[0].block
    motion = [*rounded, *records.signals][0]
    span = rate_span(records.records, motion)
    rows = [_rows(each, records, motion, span) for each in judged]
    size = float(np.sqrt(np.mean(np.concatenate([r.error for r in rows]) ** 2)))
    floor = float(np.sqrt(np.mean(np.concatenate([j.floor.sigma for j in judged]) ** 2)))
    own = block.target or block.output
    shapes = {name: _curve_share(rows, name) for name in rows[0].signals if name != own}
    shapes["time"] = _curve_share(rows, None)
    ranked = tuple(sorted(shapes.items(), key=lambda pair: -pair[1]))
    line, frequency = _line(rows)
    unit = block.model.outputs[0].unit
    parts = [(r.error, {n: v for n, v in r.signals.items() if n != own}, r.fitted) for r in rows]
    waves = [_waves(r, frequency) if line >= _ENOUGH else {} for r in rows]
    formula = sparse_formula(parts, unit, waves)
    kind = _kind(ranked, (line, frequency), _ringing(rows))
    return Remainder(block.name, own, unit, size, floor, kind, ranked, formula)


def _rows(each: Judged, records: RecordSet, motion: str, span: float) -> _Rows:
    trace, places = each.record.trace, each.floor.places
    signals = {s: trace[s][places] for s in records.signals}
    rate = derivative(trace[motion], each.record.step, order=1, span=span)
    signals[f"rate of {motion}"] = rate[places]
    return _Rows(each.error, trace.time[places] - trace.time[0], signals, each.record.role == "fit")


def _waves(row: _Rows, frequency: float) -> dict[str, Array]:
    phase = 2.0 * np.pi * frequency * row.time
    return {f"sin(2π·{frequency:.4g}·t)": np.sin(phase), f"cos(2π·{frequency:.4g}·t)": np.cos(phase)}


def _kind(
    ranked: Sequence[tuple[str, float]], line: tuple[float, float], ringing: tuple[float, float]
) -> str:
    share, frequency = line
    over, best = ranked[0]
    if share >= _ENOUGH and share >= best:
        return f"periodic in time at {frequency:.3g} Hz, whatever the motion"
    if over == "time" and best >= _ENOUGH:
        return "a drift: the same course over time in every record"
    if best >= _ENOUGH:
        return f"bound to {over}: a curve over it alone explains {100 * best:.0f} % on other records"
    share, frequency = ringing
    if share >= _ENOUGH:
        return f"a resonance near {frequency:.3g} Hz, with a phase of its own in every record"
    return "bound to no single measured signal and to no single frequency"


def _curve_share(rows: Sequence[_Rows], name: str | None) -> float:
    """Return the share that the mean curve of the fitted records explains on the others."""
    over = [r.time if name is None else r.signals[name] for r in rows]
    edges = np.linspace(min(o.min() for o in over), max(o.max() for o in over), _BINS + 1)
    place = [np.clip(np.digitize(o, edges) - 1, 0, _BINS - 1) for o in over]
    pairs = list(zip(rows, place, strict=True))
    seen = [p for p in pairs if p[0].fitted] or pairs
    others = [p for p in pairs if not p[0].fitted] or pairs
    where = np.concatenate([p for _, p in seen])
    count = np.bincount(where, minlength=_BINS)
    total = np.bincount(where, np.concatenate([r.error for r, _ in seen]), _BINS)
    mean = np.where(count >= _LEAST_IN_BIN, total / np.maximum(count, 1), 0.0)
    before = sum(float(r.error @ r.error) for r, _ in others)
    after = sum(float(np.sum((r.error - mean[p]) ** 2)) for r, p in others)
    return max(0.0, 1.0 - after / before) if before > 0.0 else 0.0


def _frequencies(rows: Sequence[_Rows]) -> Array:
    longest = max(float(r.time[-1]) for r in rows)
    highest = 0.5 / float(np.median(np.diff(rows[0].time)))
    return np.arange(_LOWEST, 0.95 * highest, 0.2 / longest)


def _powers(rows: Sequence[_Rows], frequencies: Array) -> Array:
    """Return the share of each record that a sine of each frequency and free phase explains."""
    shares = np.zeros((len(rows), len(frequencies)))
    for i, row in enumerate(rows):
        whole = float(row.error @ row.error)
        for begin in range(0, len(frequencies), _CHUNK):
            chunk = frequencies[begin : begin + _CHUNK]
            waves = np.exp(-2j * np.pi * np.outer(chunk, row.time))
            power = np.abs(waves @ row.error) ** 2 * 2.0 / (len(row.error) * max(whole, 1e-300))
            shares[i, begin : begin + _CHUNK] = np.minimum(power, 1.0)
    return shares


def _line(rows: Sequence[_Rows]) -> tuple[float, float]:
    """Return the share of a single frequency, the same in all records, in the worst record but one."""
    frequencies = _frequencies(rows)
    shares = np.sort(_powers(rows, frequencies), axis=0)
    usual = shares[min(1, len(rows) - 1)]
    best = int(np.argmax(usual))
    return float(usual[best]), float(frequencies[best])


def _ringing(rows: Sequence[_Rows]) -> tuple[float, float]:
    """Return the share of the power in the band around the strongest frequency, and that frequency."""
    highest = 0.5 / float(np.median(np.diff(rows[0].time)))
    grid = np.arange(_LOWEST, 0.95 * highest, 0.1)
    power = np.zeros_like(grid)
    for row in rows:
        step = float(np.median(np.diff(row.time)))
        even = np.arange(row.time[0], row.time[-1], step)
        signal = np.interp(even, row.time, row.error) * np.hanning(len(even))
        own = np.abs(np.fft.rfft(signal)) ** 2
        power += np.interp(grid, np.fft.rfftfreq(len(even), step), own) / max(float(own.sum()), 1e-300)
    best = float(grid[int(np.argmax(power))])
    band = np.abs(grid - best) <= _NARROW * best
    return float(power[band].sum() / max(float(power.sum()), 1e-300)), best
