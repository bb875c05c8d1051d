"""A remainder without a name, as a table at its place: passive, bounded, smooth, and only if it predicts.

It is no effect of the catalogue: nothing says what it is. Tables of several sizes are regressed on what a
block leaves over, together with the free numbers of the block, and judged by cross-validation on the fit
records (Stone 1974; of those within one standard error of the best the smallest, Breiman et al. 1984). A
remainder that depends on time, and not on the motion, does not predict other records and is refused.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
import scipy

from ....components import Assembly, Element, Parallel, UnnamedFriction, UnnamedSpring
from ....components.core.domain import Domain
from ....foundation.arrays import Array, Indices
from ....foundation.errors import ArrangementError
from ....foundation.quantity import Quantity, significant, with_unit
from ....foundation.symbolic import depends
from ....model import FlatModel, flatten
from ....model.readings import reading_of
from ....model.structure import body_moved_by
from ...identification.equation_error.block import Block
from ...identification.equation_error.block_noise import rate_span
from ...identification.equation_error.evidence import Bench, Evidence
from ...identification.filters import derivative
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter
from ...identification.records.measurement import Record
from ..block_prediction import shown_values
from ..tearing import blocks_of
from .effect import Candidate, Unknown, wrapped
from .friction import tied
from .places import stretched

EFFECT = "unnamed"
"""Name of the candidate in verdicts: what it is, is not known."""
_SPANS = (4, 10, 22)
"""Spans of the tables that are tried."""
_FOLDS, _LEAST_RECORDS = 6, 3
"""Folds in time where there are fewer than so many records to fit; else each record is a fold."""
_BLOCKS = 8
"""Stretches of each record of which the standard error of the gain is taken, longer than its colour."""
_SURE = 3.0
"""Standard errors by which the gain on records that were not used must exceed zero."""
_SMOOTH = 1e-3
"""Weight of second differences, relative to that of the samples: decides where no record has been."""
_REACH = 5.0
"""Bounds of the control values, in the largest of them."""
_ROUNDING = 1e-9
"""Least distance between two bounds of a regression."""
_SPANNED, _INDEPENDENT = 0.1, 1e-6
"""Share of its squares that a table leaves of what a number does, below which it can stand for it; singular
values of a table, in the largest one, that count."""
_SOURCE = "fitted to bench records; a table, no law"


class _Motion(NamedTuple):
    """Motion and rate of one record at all samples."""

    value: Array
    rate: Array


@dataclass(frozen=True)
class _Place:
    """Where the part goes."""

    path: str  # body on which it acts, or element beside which it stands
    domain: Domain  # motion and effort
    on_body: bool  # whether the path is that of a body


@dataclass(frozen=True)
class _Form:
    """One size and kind of table."""

    spans: int
    spring: bool
    friction: bool

    @property
    def size(self) -> int:
        return (self.spans + 3) * (self.spring + self.friction)

    def columns(self, motion: _Motion, low: float, high: float, creep: float) -> Array:
        """Return the effort of each control value at all samples, shape (samples, size)."""
        basis = _basis(motion.value, low, high, self.spans)
        parts = [basis] if self.spring else []
        if self.friction:
            parts.append(basis * np.tanh(motion.rate / creep)[:, None])
        return np.hstack(parts)

    def can_stand_for_any(self, held: Sequence[_Part], bounds: tuple[float, float, float]) -> bool:
        """Tell whether such a table can stand for what one of the numbers in the slopes does."""
        slopes = np.vstack([part.slope for part in held])
        table = np.vstack([part.columns(self, bounds)[:, : self.size] for part in held])
        left = slopes - table @ np.linalg.lstsq(table, slopes, rcond=_INDEPENDENT)[0]
        return bool(np.any(np.sum(left**2, axis=0) < _SPANNED * np.sum(slopes**2, axis=0)))

    def least(self) -> Array:
        """Return the lower bounds: a spring may pull or push, friction only takes."""
        count = self.spans + 3
        return np.concatenate([np.full(count, -np.inf)] * self.spring + [np.zeros(count)] * self.friction)

    def roughness(self) -> Array:
        """Return the matrix of squared second differences."""
        count = self.spans + 3
        bend = np.diff(np.eye(count), n=2, axis=0)
        return np.asarray(np.kron(np.eye(self.spring + self.friction), bend.T @ bend), dtype=np.float64)


_FORMS = tuple(
    sorted(
        (
            _Form(spans, spring, friction)
            for spans, (spring, friction) in itertools.product(
                _SPANS, ((True, False), (False, True), (True, True))
            )
        ),
        key=lambda form: form.size,
    )
)


def unnamed_part(
    assembly: Assembly, fit: Fit, bench: Bench, block: str, named: Collection[str] = ()
) -> Candidate | None:
    """Return what a block leaves over as a table over its motion, if that predicts records it has not seen.

    Parameters
    ----------
    assembly
        Of the hypothesis, with its numbers as declared.
    fit
        Of the group of blocks in which the block is.
    bench
        Records; only those to be fitted are looked at.
    block
        Name of the block that is open.
    named
        Names of the numbers of effects that were named: they stay what they are, and no table is offered that
        can stand for what one of them does.

    Returns
    -------
    Candidate or None
        To be fitted as any effect of the catalogue; ``None`` where there is no place for it, or where nothing
        is gained on records that were not used.
    """
    model = flatten(assembly.with_values(fit.values))
    cut = next((b for b in blocks_of(model, bench.records.signals) if b.name == block), None)
    place = _place(assembly, model, cut) if cut is not None else None
    if cut is None or place is None:
        return None
    free = [p.name for p in fit.parameters if p.name in cut.model.values]
    evidence = bench.evidence(bench.driven(cut, free, fit.values), bench.records.of("fit"), fit.values)
    motions = [_motion(model, cut, place, each.record) for each in evidence]
    known = [m for m in motions if m is not None]
    if not evidence or len(known) < len(motions):
        return None
    low, high = min(float(m.value.min()) for m in known), max(float(m.value.max()) for m in known)
    if high - low <= 0.0:
        return None
    creep = UnnamedFriction.rounding[place.domain]
    every = [p for p in fit.parameters if p.name in evidence[0].driven.free]
    numbers = [p for p in every if p.name not in named]
    parts, held = (
        [_Part.of(e, fit, some, m) for e, m in zip(evidence, known, strict=True)]
        for some in (numbers, [p for p in every if p.name in named])
    )
    bounds = (low, high, creep)
    forms = [form for form in _FORMS if not form.can_stand_for_any(held, bounds)]
    chosen = _chosen(forms, parts, _Shifts.of(numbers, fit), bounds)
    if chosen is None:
        return None
    form, values = chosen
    return _candidate(assembly, place, form, values, (low, high))


def _place(assembly: Assembly, model: FlatModel, block: Block) -> _Place | None:
    if block.target is None:
        body = next((b for b in model.bodies if b.name == block.name), None)
        tops = {name for name, _ in assembly.parts}
        return _Place(body.name, body.domain, True) if body and body.name in tops else None
    path, _, effort = reading_of(model.readings, block.target).measured.rpartition(".")
    inside = [p for p in stretched(assembly) if p == path or p.startswith(f"{path}.")]
    try:
        domain = assembly.element(path).domain
    except (ArrangementError, KeyError, AttributeError, ValueError):
        return None  # what is measured is no element's effort, so there is no place for a table
    if effort != domain.effort:
        return None
    return _Place(inside[0] if inside else path, domain, False)


def _motion(model: FlatModel, block: Block, place: _Place, record: Record) -> _Motion | None:
    """Return motion and rate of the place; nothing where the measured motions do not say them."""
    shown, spans = {}, [0.0]
    for signal in dict.fromkeys(d.signal for d in block.drives.values()):
        reading = reading_of(model.readings, signal)
        if reading.shows_value and body_moved_by(model.bodies, reading.measured) is not None:
            shown[reading.measured] = shown_values(model, record, signal)
            spans.append(rate_span([record], signal))
    if place.on_body:
        name = next(b.motion for b in model.bodies if b.name == place.path)
        value = shown.get(name)
    else:
        value = _signal(model, f"{place.path}.{place.domain.motion}", shown)
    if value is None:
        return None
    return _Motion(value, derivative(value, record.step, order=1, span=max(spans)))


def _signal(model: FlatModel, name: str, shown: dict[str, Array]) -> Array | None:
    """Return a signal that depends on measured motions alone."""
    s = model.symbols()
    names = [v.name for v in model.signals]
    if name not in names:
        return None
    value = s.signal[names.index(name)]
    variables = [v.name for v in (*model.states, *model.inputs)]
    symbols = ca.vertsplit(ca.vertcat(s.state, s.input))
    others = [x for n, x in zip(variables, symbols, strict=True) if n not in shown]
    if others and depends(value, ca.vertcat(*others)):
        return None
    given = [x for n, x in zip(variables, symbols, strict=True) if n in shown]
    numbers = ca.substitute(value, s.parameter, ca.DM(model.start(model.parameters)))
    if others:
        numbers = ca.substitute(numbers, ca.vertcat(*others), ca.DM.zeros(len(others)))
    function = ca.Function("motion", [ca.vertcat(*given)], [numbers])
    rows = np.array([shown[n] for n in variables if n in shown])
    result: Array = function.map(rows.shape[1])(rows).full().ravel()
    return result


def _basis(motion: Array, low: float, high: float, spans: int) -> Array:
    """Return the values of uniform cubic B-splines on [low, high], shape (samples, spans + 3)."""
    step = (high - low) / spans
    knots = low + step * np.arange(-3, spans + 4)
    inside = np.clip(motion, low, high - 1e-9 * step)
    result: Array = scipy.interpolate.BSpline.design_matrix(inside, knots, 3).toarray()
    return result


class _Shifts(NamedTuple):
    """What the free numbers may still move by, in the scale in which they are fitted."""

    precise: Array
    least: Array
    most: Array

    @classmethod
    def of(cls, numbers: Sequence[Parameter], fit: Fit) -> _Shifts:
        """Return it from fitted numbers: beyond the bounds of their fit they would spare the table."""
        rows = [
            (p.sigma**-2.0, p.inward(p.lower) - at, p.inward(p.upper) - at)
            for p in numbers
            for at in [p.inward(fit.values[p.name])]
        ]
        precise, least, most = np.array(rows, dtype=float).reshape(len(rows), 3).T
        return cls(precise, np.minimum(least, -_ROUNDING), np.maximum(most, _ROUNDING))


@dataclass(frozen=True, eq=False)
class _Part:
    """What one record says, in units of the noise floor: rows, and slopes of the free numbers."""

    evidence: Evidence
    residual: Array
    slope: Array
    motion: _Motion

    @classmethod
    def of(cls, evidence: Evidence, fit: Fit, numbers: Sequence[Parameter], motion: _Motion) -> _Part:
        """Return it at the fitted numbers."""
        residual, slope = evidence.residual(fit.values)
        free = list(evidence.driven.free)
        scaled = [-slope[:, free.index(p.name)] * p.slope(fit.values[p.name]) for p in numbers]
        wide = np.column_stack(scaled) if scaled else np.zeros((len(residual), 0))
        return cls(evidence, residual, wide, motion)

    def columns(self, form: _Form, bounds: tuple[float, float, float]) -> Array:
        """Return the regressors: control values, then free numbers."""
        floor = self.evidence.floor
        table = (floor.filter @ form.columns(self.motion, *bounds)) / floor.sigma[:, None]
        return np.hstack([table, self.slope])


class _Fold(NamedTuple):
    """Part and rows of it that are left out together."""

    part: int
    rows: Indices


def _folds(parts: Sequence[_Part]) -> list[list[_Fold]]:
    everything = [np.arange(len(p.residual), dtype=np.intp) for p in parts]
    if len(parts) >= _LEAST_RECORDS:
        return [[_Fold(k, rows)] for k, rows in enumerate(everything)]
    pieces = [np.array_split(rows, _FOLDS) for rows in everything]
    return [[_Fold(k, piece[f]) for k, piece in enumerate(pieces)] for f in range(_FOLDS)]


def _chosen(
    forms: Sequence[_Form], parts: Sequence[_Part], shifts: _Shifts, bounds: tuple[float, float, float]
) -> tuple[_Form, Array] | None:
    """Return the smallest form within one standard error of the best, with its control values."""
    scored, folds = [], _folds(parts)
    for form in forms:
        regression = _Regression.of(form, parts, shifts, bounds)
        gains = regression.without_table(form.size).squares(folds) - regression.squares(folds)
        error = math.sqrt(len(gains)) * float(np.std(gains, ddof=1))
        scored.append((form, float(gains.sum()), error, regression))
    best = max(scored, key=lambda each: each[1], default=None)
    if best is None or best[1] <= _SURE * best[2]:
        return None
    form, _, _, regression = next(s for s in scored if s[1] >= best[1] - best[2])
    return form, regression.solved()[: form.size]


class _Regression:
    """Bounded ridge regression of a table, and of the free numbers, on the records.

    ``columns``: regressors of each record: those of the table, then those of the numbers. ``ridge``: priors
    of the numbers, smoothness of the table.
    """

    def __init__(
        self,
        columns: Sequence[Array],
        targets: Sequence[Array],
        ridge: Array,
        bounds: tuple[Array, Array],
    ) -> None:
        self._columns, self._targets, self._ridge, self._bounds = columns, targets, ridge, bounds

    @classmethod
    def of(
        cls,
        form: _Form,
        parts: Sequence[_Part],
        shifts: _Shifts,
        bounds: tuple[float, float, float],
    ) -> _Regression:
        """Return the regression of a form of table."""
        columns, size = [p.columns(form, bounds) for p in parts], form.size
        squares = sum(np.sum(c[:, :size] ** 2, axis=0) for c in columns)
        scale = float(np.mean(squares)) or 1.0
        ridge = np.diag(np.concatenate([np.zeros(size), shifts.precise]))
        ridge += 1e-9 * scale * np.eye(len(ridge))
        ridge[:size, :size] += _SMOOTH * scale * form.roughness()
        least = np.concatenate([form.least(), shifts.least])
        most = np.concatenate([np.full(size, np.inf), shifts.most])
        return cls(columns, [p.residual for p in parts], ridge, (least, most))

    def without_table(self, size: int) -> _Regression:
        """Return the regression of the numbers alone."""
        columns = [np.hstack([np.zeros((len(c), size)), c[:, size:]]) for c in self._columns]
        return _Regression(columns, self._targets, self._ridge, self._bounds)

    def solved(self, without: Sequence[_Fold] = ()) -> Array:
        """Return control values and shifts of the numbers from all records but the rows of a fold."""
        out = {fold.part: fold.rows for fold in without}
        matrix, vector = self._ridge.copy(), np.zeros(len(self._ridge))
        for k, (every, target) in enumerate(zip(self._columns, self._targets, strict=True)):
            keep = np.ones(len(every), dtype=bool)
            keep[out.get(k, np.zeros(0, dtype=np.intp))] = False
            matrix += every[keep].T @ every[keep]
            vector += every[keep].T @ target[keep]
        strength, axes = np.linalg.eigh(matrix)
        root = np.sqrt(np.maximum(strength, 1e-13 * strength[-1]))
        result: Array = scipy.optimize.lsq_linear(
            root[:, None] * axes.T, (axes.T @ vector) / root, bounds=self._bounds, method="bvls"
        ).x
        return result

    def squares(self, folds: Sequence[Sequence[_Fold]]) -> Array:
        """Return the sum of squares on each stretch, when its fold was not used."""
        sums = []
        for fold in folds:
            x = self.solved(fold)
            for part, rows in fold:
                left = (self._targets[part][rows] - self._columns[part][rows] @ x) ** 2
                pieces = max(1, _BLOCKS * len(rows) // len(self._targets[part]))
                sums += [float(piece.sum()) for piece in np.array_split(left, pieces)]
        return np.array(sums)


def _candidate(
    assembly: Assembly, place: _Place, form: _Form, values: Array, span: tuple[float, float]
) -> Candidate:
    count = form.spans + 3
    effort, unit = place.domain.effort_unit, place.domain.motion_unit
    low, high = (Quantity(significant([v])[0], unit, _SOURCE) for v in span)
    elements: list[tuple[str, Element, str, Array]] = []
    if form.spring:
        row = Quantity(significant(values[:count]), effort, _SOURCE)
        spring = UnnamedSpring(elastic=row, lowest=low, highest=high, domain=place.domain)
        elements.append(("unnamed_spring", spring, "elastic", values[:count]))
    if form.friction:
        row = Quantity(significant(np.maximum(values[-count:], 0.0)), effort, _SOURCE)
        friction = UnnamedFriction(friction=row, lowest=low, highest=high, domain=place.domain).smooth()
        elements.append(("unnamed_friction", friction, "friction", np.maximum(values[-count:], 0.0)))
    edited, unknowns = assembly, []
    if place.on_body:
        for name, element, field, own in elements:
            edited, part = tied(edited, name, place.path, element)
            unknowns += _unknowns(f"{part}.{field}", own, passive=field == "friction")
    else:
        edited, outer = _beside(assembly, place.path, [(name, element) for name, element, _, _ in elements])
        for name, _, field, own in elements:
            unknowns += _unknowns(f"{outer}.{name}.{field}", own, passive=field == "friction")
    shown = " to ".join(with_unit(f"{v:.3g}", unit) for v in span)
    kinds = " and ".join(
        words for words, there in (("of the motion", form.spring), ("against it", form.friction)) if there
    )
    return Candidate(
        EFFECT,
        place.path,
        edited,
        tuple(unknowns),
        f"an effort {kinds} that has no name, a table over the {place.domain.motion} from {shown}",
        "bench records: no law, not valid elsewhere",
    )


def _unknowns(row: str, values: Array, *, passive: bool) -> list[Unknown]:
    most = _REACH * float(np.max(np.abs(values))) or 1.0
    least = 0.0 if passive else -most
    return [Unknown(f"{row}[{k}]", (float(v),), least, most) for k, v in enumerate(values, start=1)]


def _beside(assembly: Assembly, path: str, elements: Sequence[tuple[str, Element]]) -> tuple[Assembly, str]:
    """Return the assembly with elements in parallel to one of it, and the path of what holds them."""

    def around(inner: str, element: Element) -> Element:
        return Parallel(members=((inner, element), *elements))

    owner, _, _ = path.rpartition(".")
    name = "beside" if owner else "named"
    edited = wrapped(assembly, path, name, around, read_outside=True)
    return edited, f"{owner}.{name}" if owner else path
