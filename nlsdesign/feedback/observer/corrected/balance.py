"""What the balance of the driven body can tell of the torque of its spring: few terms, each with a factor.

J·ω̇ is the sum of what the drive gives, of what the spring gives at rest and of what relaxes in it, of viscous
and of dry friction. A machine whose numbers differ from the deck's has other factors on these terms,

    J·ω̇ − Σ φⱼ = Σ cⱼ·φⱼ + c₀,    ln(1 + cⱼ) = (change of the term) − (change of the inertia),

with an offset of the drive, c₀, as the last. The acceleration is a sum of the others, so it is on the left
alone and its noise is in no term. With numbers p = p₀·exp(L·ξ) the factors, and those of the two parts of the
torque, are to first order linear in the same ξ: their joint covariance says what the factors tell of the
torque, and what no motion can tell, as a common scale of drive, spring and inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError
from ....simulation.prior import Prior
from ...analysis.rest import evaluate_rows
from ..scheduling.angle_form import AngleForm
from .duty import (
    STEP,
    Duty,
    OperatingPoints,
    effects_of,
    operating_points,
    push,
    root_of,
    spring_inertia,
)

DRIVE, REST, RELAXING, VISCOUS, DRY, OFFSET = range(6)
TERMS = (
    "what the drive gives", "the spring at rest", "what relaxes in the spring", "viscous friction",
    "dry friction", "an offset of the drive",
)  # fmt: skip
"""Terms of the balance in the order of their factors."""
OFFSET_SHARE = 0.02
"""Standard deviation of an offset of the drive that no deck declares, as a share of that of the duty."""
SLOW = 0.02
"""Speed below which the actuator may stand, as a share of the largest on the slowest sine of the duty."""
ELSEWHERE = 1e-6
"""Largest part of the acceleration at an angle that may come from something else than the spring."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Terms of the balance at the declared numbers, and what is known of their factors."""

    inertia: float  # that the torque of the spring accelerates, in kg·m²
    # drive, place: torque per unit of the input that moves the body, and the place of that input
    drive: float
    place: int
    # viscous, dry: in N·m·s/rad and N·m
    viscous: float
    dry: float
    width: float  # speed in rad/s beyond which the actuator surely moves
    torque: float  # amplitude of the duty in N·m
    terms: tuple[int, ...]  # which of TERMS have a factor
    deviations: Array  # of these factors, shape (terms,)
    correlation: Array  # of them, shape (terms, terms)
    # slopes: expected change of the logarithm of the torque at rest and of that which relaxes, per unit of
    # ln(1 + c) of each factor, shape (2, terms)
    slopes: Array
    unseen: Array  # covariance of both that is left when all factors are known, shape (2, 2)
    alone: Array  # standard deviations of both before any motion, shape (2,)
    missed: float  # torque of changes of the spring's form, which no factor describes, in N·m rms
    before: float  # torque that is not known before any motion, in N·m rms along the duty


def balance_of(form: AngleForm, prior: Prior, duty: Duty) -> Balance:
    """Return the balance of a machine, and what is known of it; refused where the spring is not alone."""
    points = operating_points(form, duty)
    _, place = push(form)
    if place is None:
        raise ArrangementError(
            f"model '{form.model.name}'", "has no input that moves the measured body",
            next_step="keep the current of the motor among the inputs",
        )  # fmt: skip
    declared = _numbers(form, points)
    check_spring_alone(form, declared.inertia)
    factors, parts, missed, before = changes_of(form, prior, points, declared)
    used = [k for k in range(OFFSET) if np.linalg.norm(factors[k]) > 1e-9]
    if not used or not np.any(parts):
        raise ArrangementError(
            f"model '{form.model.name}'", "has no uncertain numbers that move the torque",
            next_step="an observer without slow states is enough: leave the correction out",
        )  # fmt: skip
    seen = factors[used]
    covariance = seen @ seen.T
    slopes = parts @ seen.T @ np.linalg.pinv(covariance, rcond=1e-9, hermitian=True)
    deviations = np.append(np.sqrt(np.diag(covariance)), OFFSET_SHARE * points.torque)
    correlation = np.eye(len(deviations))
    correlation[:-1, :-1] = covariance / np.outer(deviations[:-1], deviations[:-1])
    return Balance(
        declared.inertia, declared.push * declared.inertia, form.free_inputs.index(place),
        -declared.damping * declared.inertia, -declared.dry * declared.inertia,
        SLOW * points.amplitude * min(points.pulsations), points.torque, (*used, OFFSET), deviations,
        correlation,
        np.hstack([slopes, np.zeros((2, 1))]), parts @ parts.T - slopes @ seen @ parts.T,
        np.linalg.norm(parts, axis=1), missed, before,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Numbers:
    """What decides the terms of one machine: torque at rest and relaxing along the duty, and four scalars."""

    rest: Array
    relaxing: Array
    inertia: float
    push: float
    damping: float
    dry: float


def _numbers(form: AngleForm, points: OperatingPoints) -> _Numbers:
    own = effects_of(form, points)[0]
    count = len(points.angles)
    damping = float(form.at(np.zeros(1)).a[0, form.speed, form.speed])
    friction = form.friction()
    dry = 0.0 if friction is None else float(friction(0.5 * points.amplitude * min(points.pulsations)))
    return _Numbers(own[:count], own[count:], spring_inertia(form), push(form)[0], damping, dry)


def changes_of(
    form: AngleForm, prior: Prior, points: OperatingPoints, declared: _Numbers
) -> tuple[Array, Array, float, float]:
    """Return changes of factors and of both parts of the torque per ξ, torque of neither, and all of it.

    Shapes (5, ξ) and (2, ξ).
    """
    known = prior.only([name for name in prior.names if name in form.model.values])
    root = root_of(known.covariance) if np.any(known.deviations) else np.zeros((len(known.names), 0))
    factors, parts, missed = np.zeros((OFFSET, root.shape[1])), np.zeros((2, root.shape[1])), 0.0
    before = 0.0
    for k in range(root.shape[1]):
        sides = []
        for sign in (STEP, -STEP):
            numbers = dict(zip(known.names, known.numbers(sign * root[:, k]), strict=True))
            sides.append(_numbers(form.with_values(numbers), points))
        up, down = sides
        inertia = math.log(up.inertia / down.inertia)
        for i, name in enumerate(("rest", "relaxing")):
            own, change = getattr(declared, name), getattr(up, name) - getattr(down, name)
            size = float(own @ own)
            parts[i, k] = float(change @ own) / size if size > 0.0 else 0.0
            missed += float(np.sum((change - parts[i, k] * own) ** 2))
            before += float(np.sum(change**2))
        factors[DRIVE, k] = math.log(up.push / down.push)
        factors[[REST, RELAXING], k] = parts[:, k] - inertia
        for term, a, b in ((VISCOUS, up.damping, down.damping), (DRY, up.dry, down.dry)):
            factors[term, k] = math.log(a / b) if a * b > 0.0 else 0.0
    if not np.any(declared.relaxing):
        factors[RELAXING] = 0.0
    return factors, parts, math.sqrt(missed), math.sqrt(before)


def check_spring_alone(form: AngleForm, inertia: float) -> None:
    """Raise unless the machine at rest is moved by the torque of the spring alone."""
    x = form.rest_in_model_order(form.layout.angles)
    rate, wanted = evaluate_rows(form.rates_and_estimate, x, np.tile(form.u, (len(x), 1)), form.p)
    other = inertia * rate[:, form.speed] + wanted[:, 0]
    if np.max(np.abs(other)) > ELSEWHERE * np.max(np.abs(wanted)):
        raise ArrangementError(
            f"model '{form.model.name}'",
            "is moved at rest by something beside its spring: a weight, a load or a ripple over the angle",
            next_step="take the cascade, which needs no balance: --kind cascade",
        )  # fmt: skip
