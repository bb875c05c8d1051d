"""How far the estimate of an adaptive observer can be from the torque of its deck, whatever is measured.

Its inner states get no correction and its slow states are held within ±limit. So the estimate
Σⱼ (tⱼ(θ) + Σ_d s_d·tⱼ_d(θ))·ẑⱼ + t₀(θ) + Σ_d s_d·t₀_d(θ) differs from that of the same observer with all
slow states at zero, which is a cascade with a bound of its own, only by what |s_d| ≤ limit can do. Current,
friction and a load enter through the slow states alone, and these cannot leave their box.

ẑ⁺ = (φ + Σ s_d·φ_d(θ))·ẑ + Σ_d s_d·(…) runs with its slow states inside: whether it stays in a box at all
depends on the limit, since a linear φ(s) may reach 1. That is decided here, on the table as it is read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError
from ....model import FlatModel
from ..adaptive.adaptive_observer import AdaptiveDesign, design_adaptive_observer
from ..adaptive.duty_and_directions import AdaptiveSettings, Trust
from ..scheduling.scheduled import ObserverDesign
from ..scheduling.table import ColumnPlace
from .certificate import FORMAT, Certificate, Proof
from .contraction import assumptions_of, declared_assumptions, numbers_of
from .exact import corners
from .torque_bound import OPERATIONS, ROUNDING, SLACK, Assumptions, torque_bound


def clamped_estimate_bound(rows: ArrayLike, estimated: ArrayLike, true: ArrayLike) -> float:
    """Return a bound on the error of an estimate t(θ)·x̂ + t₀(θ) whose states are held in boxes.

    It holds for every motion and every current as long as the boxes do: inner states that are driven by the
    measured angle alone stay in the range of their rest values, slow states where they are clamped. States
    whose error is known better enter by that error: ``estimated`` its range, ``true`` zero. It says
    nothing of the error that an estimator reaches, only of the one that it cannot exceed.

    Parameters
    ----------
    rows
        t at the grid points of a table that is read linearly and held at its ends, shape (points, n); a last
        column t₀ that observer and plant share cancels and is left out.
    estimated, true
        Lower and upper bound of each state of the observer and of the plant, shape (n, 2).

    Returns
    -------
    float
        In the unit of the estimate, rounded up.

    Raises
    ------
    ValueRangeError
        If shapes do not agree, or a number is not finite, or bounds are exchanged.
    """
    t, held, real = (np.asarray(v, dtype=float) for v in (rows, estimated, true))
    if t.ndim != 2 or held.shape != (t.shape[1], 2) or real.shape != held.shape:
        raise ValueRangeError(
            f"rows {t.shape}, boxes {held.shape} and {real.shape}",
            "need shapes (points, n), (n, 2) and (n, 2)",
        )
    if not all(np.all(np.isfinite(v)) for v in (t, held, real)):
        raise ValueRangeError("bound of a clamped estimate", "needs finite numbers")
    if np.any(held[:, 0] > held[:, 1]) or np.any(real[:, 0] > real[:, 1]):
        raise ValueRangeError("bound of a clamped estimate", "a lower bound is above its upper bound")
    # Between two grid points t is a mean of theirs, so no angle is worse than the worse of both.
    ends = np.stack([t * (held[:, 0] - real[:, 1]), t * (held[:, 1] - real[:, 0])])
    above, below = np.sum(np.max(ends, axis=0), axis=1), np.sum(np.min(ends, axis=0), axis=1)
    return float(np.max(np.maximum(above, -below), initial=0.0) * (1.0 + 1e-12))


LARGEST = 100.0
"""Boxes up to so many times as wide as the range of an inner state at the deck are tried."""
NARROWINGS = 5


@dataclass(frozen=True)
class HeldEstimateBound:
    """Largest distance of an adaptive observer's estimate from the deck's torque, in N·m."""

    learned: float  # what the slow states can do to the estimate
    cascade: float  # bound of the same observer with all slow states at zero
    limit: float  # of the slow states, in deviations
    boxes: Mapping[str, tuple[float, float]]  # range in which each inner state of the observer stays, by name

    @property
    def total(self) -> float:
        """Largest distance in N·m."""
        return (self.learned + self.cascade) * SLACK


def held_estimate_bound(
    model: FlatModel, design: AdaptiveDesign, assumptions: Assumptions
) -> HeldEstimateBound:
    """Return the largest distance of an adaptive observer's estimate from the torque of its deck.

    ``model``: continuous; the deck's actuator, with the numbers of the deck. ``assumptions``: ranges; without
    spreads, since the bound is from the torque of the deck.
    """
    if any(v > 0.0 for v in assumptions.spreads.values()):
        raise ValueRangeError(
            "spreads", "have no place here: the bound is from the torque of the deck",
            next_step="leave the spreads out",
        )  # fmt: skip
    cascade = torque_bound(model, _nominal(design), assumptions).total
    table, limit = _Table(design, ROUNDING[assumptions.real]), design.trust.limit
    boxes = [table.box(k, limit) for k in range(table.inner)]
    if any(box is None for box in boxes):
        least, most = 0.0, limit
        while most - least > 1e-3 * limit:
            middle = (least + most) / 2.0
            stays = all(table.box(k, middle) is not None for k in range(table.inner))
            least, most = (middle, most) if stays else (least, middle)
        name = table.names[next(k for k, box in enumerate(boxes) if box is None)]
        raise ValueRangeError(
            f"slow states up to {limit:g} deviations",
            f"can keep '{name}' from decaying, so that no bound holds; it is held up to {least:.3g}",
            next_step=f"design with Trust(limit={np.floor(20.0 * 0.98 * least) / 20.0:g})",
        )
    held = [box for box in boxes if box is not None]
    return HeldEstimateBound(
        learned=table.learned(held, limit) * SLACK, cascade=cascade, limit=limit,
        boxes={n: (float(b[0]), float(b[1])) for n, b in zip(table.names, held, strict=True)},
    )  # fmt: skip


def _nominal(design: AdaptiveDesign) -> ObserverDesign:
    """Return the observer with all slow states at zero, as far as its inner states and estimate go."""
    step = design.step.nominal
    rows = {f"correction[{i}][0]": ColumnPlace(0.0) for i in range(len(step.plant.names))}
    compact = replace(design.compact, places={**design.compact.places, **rows})
    return ObserverDesign(design.model, step, compact)


class _Table:
    """The table of an adaptive observer at its grid points; between them all of it is linear."""

    def __init__(self, design: AdaptiveDesign, rounding: float) -> None:
        # A slow state has faded by this share where the end of a sample is added.
        self.faded = -np.expm1(-design.step.nominal.sample_time / design.trust.drift_time)
        self.compact, plant = design.compact, design.step.nominal.plant
        self.n, self.inner = len(plant.names), design.step.inner
        self.names = plant.names[: self.inner]
        places = self.compact.places
        self.slow = sum(f"estimate.{d}[0][{self.n}]" in places for d in range(len(places)))
        self.rounding = OPERATIONS * (1 + self.slow) * rounding
        kinds = ["", *(f".{d}" for d in range(self.slow))]
        for kind in kinds:
            row = [f"next{kind}[{i}][{j}]" for i in range(self.inner) for j in range(self.n) if i != j]
            row += [f"next{kind}[{i}][{j}]" for i in range(self.inner) for j in self._inputs(kind)]
            wrong = [key for key in row if places[key].column is not None or places[key].factor != 0.0]
            if wrong:
                raise ArrangementError(
                    f"bound of the estimate, entry {wrong[0]}",
                    "another state or an input enters an inner state",
                )  # fmt: skip

    def _inputs(self, kind: str) -> range:
        last = self.n + 1
        while f"next{kind}[0][{last}]" in self.compact.places:
            last += 1
        return range(self.n + 1, last)

    def read(self, key: str) -> Array:
        """Return an entry at the grid points, shape (points,)."""
        place = self.compact.places[key]
        if place.column is None:
            return np.full(len(self.compact.angles), place.factor)
        return place.factor * self.compact.values[:, place.column]

    def deck_box(self, k: int) -> Array:
        """Return the range of an inner state with all slow states at zero, shape (2,)."""
        kept, drive, prior = (self.read(f"{key}[{k}][{j}]") for key, j in self._keys(k))
        whole = 1.0 - float(np.max(kept))
        return np.array([np.min(drive) + np.min(prior), np.max(drive) + np.max(prior)]) / whole

    def _keys(self, k: int, d: int | None = None) -> list[tuple[str, int]]:
        end = "" if d is None else f".{d}"
        return [(f"next{end}", k), (f"next{end}", self.n), (f"prior{end}", 0)]

    def box(self, k: int, limit: float) -> tuple[float, float] | None:
        """Return a box that an inner state never leaves, or ``None`` where none was found.

        The next state is affine in the state, in each slow state and, within cells, in both angles, so the
        corners of the box and the grid points decide for all angles that follow each other, also by a jump.
        """
        deck = self.deck_box(k)
        width = max(float(deck[1] - deck[0]), 1e-12)
        middle = float(deck[0] + deck[1]) / 2.0

        def tried(size: float) -> tuple[float, float] | None:
            ends = middle - size * width / 2.0, middle + size * width / 2.0
            low, high = self._reached(k, ends, limit)
            return ends if low >= ends[0] and high <= ends[1] else None

        size, stays_in = 1.0 + 1e-6, None
        while stays_in is None and size <= LARGEST:
            size, stays_in = 1.5 * size, tried(size)
        least, most = size / 2.25, size / 1.5
        for _ in range(NARROWINGS if stays_in is not None else 0):
            between = (least + most) / 2.0
            narrower = tried(between)
            least, most = (between, most) if narrower is None else (least, between)
            stays_in = narrower or stays_in
        return stays_in

    def _reached(self, k: int, box: tuple[float, float], limit: float) -> tuple[float, float]:
        """Return the range of the next state from a box, over all angles and slow states."""
        at = [[self.read(f"{key}[{k}][{j}]") for key, j in self._keys(k)]]
        at += [[self.read(f"{key}[{k}][{j}]") for key, j in self._keys(k, d)] for d in range(self.slow)]
        low, high, spare = np.inf, -np.inf, 0.0
        for z in box:
            kept, drive, prior = at[0]
            middle = (kept * z + drive)[:, None] + prior[None, :]
            room = self._moved(k, z, limit)
            low = min(low, float(np.min(middle - room)))
            high = max(high, float(np.max(middle + room)))
            size = sum(
                w * float(np.max(np.abs(kept * z)) + np.max(np.abs(drive)) + np.max(np.abs(prior)))
                for w, (kept, drive, prior) in zip([1.0] + [limit] * self.slow, at, strict=True)
            )
            spare = max(spare, self.rounding * size)
        return low - spare, high + spare

    def _moved(self, k: int, z: float, limit: float) -> Array:
        """Return what slow states can add to the next state, by angle before and after."""
        total = np.zeros((len(self.compact.angles),) * 2)
        for d in range(self.slow):
            kept, drive, prior = (self.read(f"{key}[{k}][{j}]") for key, j in self._keys(k, d))
            if not (np.any(kept) or np.any(drive) or np.any(prior)):
                continue
            both = (kept * z + drive)[:, None] + prior[None, :]
            total += limit * (np.abs(both) + self.faded * np.abs(prior)[None, :])
        return total

    def _apart(self, k: int, box: tuple[float, float], limit: float) -> float:
        """Return how far an inner state can be from where it is with all slow states at zero."""
        deck = self.deck_box(k)
        by_box = max(box[1] - float(deck[0]), float(deck[1]) - box[0])
        kept = np.abs(self.read(f"next[{k}][{k}]"))
        kept = kept + limit * sum(np.abs(self.read(f"next.{d}[{k}][{k}]")) for d in range(self.slow))
        most = float(np.max(kept))
        if most >= 1.0:
            return by_box
        moved = max(float(np.max(self._moved(k, float(z), limit))) for z in deck)
        size = self.rounding * max(map(abs, box))
        return min(by_box, (moved + size) / (1.0 - most))

    def learned(self, boxes: list[tuple[float, float]], limit: float) -> float:
        """Return how far the estimate can be from that with all slow states at zero."""
        apart = [self._apart(k, box, limit) for k, box in enumerate(boxes)]
        own = [self.read(f"estimate[0][{k}]") for k in range(self.inner)]
        held = np.array([(-a, a) for a in apart] + [(-limit, limit)] * self.slow).reshape(-1, 2)
        worst = 0.0
        for z in corners([b[0] for b in boxes], [b[1] for b in boxes]):
            slopes = []
            for d in range(self.slow):
                slope = self.read(f"estimate.{d}[0][{self.n}]").copy()
                for k, value in enumerate(z):
                    slope += value * self.read(f"estimate.{d}[0][{k}]")
                slopes.append(slope)
            rows = np.array([*own, *slopes]).T
            size = float(np.max(np.abs(rows) @ np.concatenate([np.abs(z), np.full(self.slow, limit)])))
            bound = clamped_estimate_bound(rows, held, np.zeros_like(held))
            worst = max(worst, bound + self.rounding * size)
        return worst


def held_assumptions(model: FlatModel, design: AdaptiveDesign) -> Assumptions:
    """Return the whole table, and half a count of the encoder that the deck declares."""
    return declared_assumptions(model, _nominal(design))


@dataclass(frozen=True, eq=False)
class HeldEstimate:
    """The estimate of an adaptive observer stays near the torque of its deck."""

    form: ClassVar[str] = f"{FORMAT}, held estimate"
    sampled: ClassVar[bool] = True

    sample_time: float  # in s
    settings: Mapping[str, float]  # numbers of the settings of trust by name
    assumptions: Assumptions
    bound: HeldEstimateBound

    @property
    def statement(self) -> tuple[str, ...]:
        """Return in sentences what is proved, and what is not."""
        a, b = self.assumptions, self.bound
        boxes = ", ".join(f"'{n}' from {low:.4g} to {high:.4g}" for n, (low, high) in b.boxes.items())
        return (
            f"The estimated torque stays within {b.total:.4g} N·m of that of the deck's model (of which "
            f"{b.cascade:.3g} without slow states), for every current and friction, every motion from "
            f"{a.angles[0]:.4g} to {a.angles[1]:.4g} rad with at most {a.speed:g} rad/s, and an angle "
            f"measured to {a.angle_error:.3g} rad, with slow states within ±{b.limit:g} deviations and "
            f"inner states begun in their boxes: {boxes or 'there are none'}.",
            "This bounds what wrong currents can do to the estimate; it is not the error that is reached, "
            "and no convergence is claimed.",
        )

    def observer(self) -> dict[str, Any]:
        """Return what a file says of the observer beside the names of its torque and angle."""
        return {"sample_time": self.sample_time, "settings": dict(self.settings)}

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the proof as JSON holds them."""
        bound = {"total": self.bound.total, **asdict(self.bound)}
        return {"assumptions": numbers_of(self.assumptions), "bound": bound}

    @classmethod
    def read(cls, content: dict[str, Any]) -> HeldEstimate:
        """Return the proof that the content of a file holds."""
        o, b = content["observer"], content["bound"]
        boxes = {name: (float(box[0]), float(box[1])) for name, box in b["boxes"].items()}
        bound = HeldEstimateBound(float(b["learned"]), float(b["cascade"]), float(b["limit"]), boxes)
        return cls(float(o["sample_time"]), o["settings"], assumptions_of(content["assumptions"]), bound)


def designed_again(certificate: Certificate[Proof], proof: HeldEstimate, model: FlatModel) -> AdaptiveDesign:
    """Return the adaptive observer of a certificate, designed from its deck with its settings."""
    numbers = dict(proof.settings)
    trust = Trust(most=int(numbers.pop("most")), **numbers)
    return design_adaptive_observer(
        model.with_values(dict(certificate.parameters)), estimate=certificate.estimate,
        measured=certificate.measured, sample_time=proof.sample_time, settings=AdaptiveSettings(trust=trust),
    )  # fmt: skip


def certify_held_estimate(
    model: FlatModel,
    design: AdaptiveDesign,
    *,
    assumptions: Assumptions,
    settings: Mapping[str, float],
    deck: tuple[str, str] = ("", ""),
    code: Mapping[str, str] | None = None,
) -> Certificate[HeldEstimate]:
    """Certify that the estimate of an adaptive observer stays near the torque of its deck.

    Parameters
    ----------
    model
        Continuous; what the observer was designed on, with the numbers of the deck.
    design
        The adaptive observer.
    assumptions
        Ranges, without spreads.
    settings
        Numbers of its settings of trust by name, so that it can be designed again.
    deck
        Name and text.
    code
        SHA-256 of the C files by name.

    Raises
    ------
    ValueRangeError
        If no bound holds, with the largest limit of the slow states at which one does.
    ArrangementError
        If the structure of the rubber allows none.
    """
    plant = design.step.nominal.plant
    bound = held_estimate_bound(model, design, assumptions)
    proof = HeldEstimate(design.step.nominal.sample_time, dict(settings), assumptions, bound)
    code = {} if code is None else dict(code)
    return Certificate(deck, model.values, plant.estimate.name, plant.angle, proof, code)
