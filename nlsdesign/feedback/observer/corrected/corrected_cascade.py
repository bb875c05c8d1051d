"""The default observer as a discrete flat model: its names, its table and what went into it.

The equations stand in :mod:`~nlsdesign.feedback.observer.corrected.correction_equations`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.errors import ArrangementError
from ....foundation.quantity import typeset_unit
from ....foundation.symbolic import remembered
from ....foundation.written_numbers import prefixed
from ....model import FlatModel, Plausibility, Variable
from ....model.roles import measured_motion, spring_torque
from ....model.transform import with_products
from ....simulation.prior import Prior, declared_prior
from ..scheduling.angle_form import minimal_form
from ..scheduling.scheduled import MEMORY, ObserverDesign, design_observer_with_details, whole_contour
from ..scheduling.step import ObserverStep
from ..scheduling.table import Compact, Grid
from .balance import OFFSET, TERMS, Balance, balance_of
from .correction_equations import CorrectionEquations, pairs, rest_torque
from .duty import Duty

PREFIX, FILTERED = "correction", ("angle", "drive", "rest", "relaxing")
"""Of all names that the cascade does not have, but for the torque at rest in the table."""
SPREAD, INFLATION = "standard_deviation", "unrest"
"""Endings of names: the deviation that is expected of the estimate, and the factor on the noise."""

UNEXPLAINED = 25.0
"""Factor on the noise beyond which no number within the spreads explains the readings: residuals that stay
five times as large as is expected. Of 600 drawn machines none reaches it in a minute."""


class _Variables:
    """Names the variables around those of the cascade."""

    def __init__(self, equations: CorrectionEquations) -> None:
        self.equations, self.model, self.balance = equations, equations.model, equations.balance
        self.estimate, self.angle = equations.estimate, equations.angle

    def _factors(self) -> list[Variable]:
        words = [f"factor of {TERMS[k]}" for k in self.balance.terms]
        sizes = [f"one is {100.0 * d:.3g} %" for d in self.balance.deviations[:-1]]
        sizes.append(f"one is {self.balance.deviations[-1]:.3g} {typeset_unit(self.estimate.unit)}")
        return [
            Variable(f"{PREFIX}.factor[{k + 1}]", "1", f"{w} in standard deviations; {s}")
            for k, (w, s) in enumerate(zip(words, sizes, strict=True))
        ]

    def states(self) -> tuple[Variable, ...]:
        """Return what is carried on from sample to sample."""
        drive, unit = self.model.inputs[1 + self.balance.place], self.estimate.unit
        torque = Variable("torque", unit, "", nominal=self.balance.torque)
        states = list(self.model.states)
        for name, like in zip(FILTERED, (self.angle, drive, torque, torque), strict=True):
            for k in range(3):
                words = f"{name} behind {k + 1} low-pass{'es' if k else ''}"
                states.append(Variable(f"{PREFIX}.{name}[{k + 1}]", like.unit, words, nominal=like.nominal))
        states += [replace(v, name=f"{v.name}.{MEMORY}") for v in self._factors()]
        for i, j in pairs(self.equations.count):
            start = float(self.balance.correlation[i, j])
            words = f"covariance of the errors of factors {i + 1} and {j + 1}, in deviations"
            states.append(Variable(f"{PREFIX}.covariance[{i + 1},{j + 1}]", "1", words, start))
        unrest, evidence = (
            "factor on the variance of what is not explained",
            "for factors, a natural logarithm",
        )
        states += [
            Variable(f"{PREFIX}.offset", "1", "offset of the drive if the deck is exact, in deviations"),
            Variable(f"{PREFIX}.offset_variance", "1", "variance of its error", 1.0),
            Variable(f"{PREFIX}.{INFLATION}.{MEMORY}", "1", unrest, 1.0),
            Variable(f"{PREFIX}.evidence", "1", evidence),
            Variable(f"{PREFIX}.missing", unit, "torque that a drive near its limit may not give"),
        ]
        return tuple(states)

    def outputs(self) -> tuple[Variable, ...]:
        """Return those of the cascade, with what is expected of the estimate and what was learned."""
        first, *rest = self.model.outputs
        unrest = "factor on the variance of what no factor explains"
        return (
            first,
            Variable(
                f"{PREFIX}.{SPREAD}", first.unit, f"standard deviation that is expected of {first.name}"
            ),
            *rest,
            *self._factors(),
            Variable(f"{PREFIX}.weight", "1", "share of the correction, 0 where the deck explains all"),
            Variable(
                f"{PREFIX}.{INFLATION}",
                "1",
                f"{unrest}; INNOVATION_LARGE above {UNEXPLAINED:g}",
                plausibility=Plausibility(noticeable=UNEXPLAINED),
            ),
        )

    def flat(self) -> FlatModel:
        """Return the observer as a discrete flat model."""
        name = f"observer of {self.estimate.name}"
        words = f"{name} that learns {self.equations.count} factors of the balance of its drive"
        return replace(
            self.model,
            description=self.model.description.replace(name, words, 1),
            states=self.states(), outputs=self.outputs(), equations=self.equations.sample(),
            tables=(self.equations.table,), begin=self.equations.begin(), expected=self.equations.expected(),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CorrectedDesign:
    """A cascade with a correction of its torque, and what went into it.

    Parameters
    ----------
    model
        The observer: discrete, scheduled over one table.
    cascade
        The observer whose torque is corrected.
    balance
        Terms whose factors are learned, and what they tell of the torque.
    """

    model: FlatModel
    cascade: ObserverDesign
    balance: Balance

    @property
    def step(self) -> ObserverStep:
        """Step of the cascade as exact functions of the angle."""
        return self.cascade.step

    @property
    def compact(self) -> Compact:
        """Table of the cascade; that of :attr:`model` has the torque at rest besides."""
        return self.cascade.compact

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values of an observer that begins while the actuator rests at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        at = np.array([angle])
        rest = float(rest_torque(self.cascade, at)[0])
        start = self.cascade.start(angle)
        for k in range(3):
            numbers = (float(angle), rest / self.balance.drive, rest, 0.0)
            start |= {f"{PREFIX}.{n}[{k + 1}]": v for n, v in zip(FILTERED, numbers, strict=True)}
        return start

    def __str__(self) -> str:
        balance, unit = self.balance, typeset_unit(self.step.plant.estimate.unit)
        lines = [
            f"{self.cascade}",
            "  corrected by factors of the balance of the drive, each with its deviation:",
        ]
        lines += [
            f"    {TERMS[k]}: {100.0 * d:.3g} %"
            for k, d in zip(balance.terms[:-1], balance.deviations, strict=False)
        ]
        lines.append(f"    {TERMS[OFFSET]}: {prefixed(float(balance.deviations[-1]), unit)}")
        return "\n".join(
            [
                *lines,
                f"  changes of form, which no factor describes: {prefixed(balance.missed, unit, digits=2)}",
            ]
        )


def design_corrected_observer(
    model: FlatModel,
    *,
    prior: Prior | None = None,
    duty: Duty | None = None,
    grid: Grid | None = None,
    sample_time: float = 1e-3,
    estimate: str | None = None,
    measured: str | None = None,
) -> CorrectedDesign:
    """Design a cascade whose torque is corrected by factors that the balance of the drive shows.

    Inputs and outputs are those of :func:`~nlsdesign.feedback.observer.design_observer`; added to the
    outputs are the standard deviation that is expected of the estimate, the factors, the weight of the
    correction, and how much larger than expected the unexplained torque is.

    Parameters
    ----------
    model
        Continuous, load fixed.
    prior
        What is known of the numbers; the spreads of the deck by default.
    duty
        What the actuator does.
    grid, sample_time, estimate, measured
        As for :func:`~nlsdesign.feedback.observer.design_observer`.

    Raises
    ------
    ArrangementError
        If no number of the deck is uncertain, no encoder of the angle is declared, something else than the
        spring moves the body at rest, or the equations cannot be scheduled over one angle.
    ValueRangeError
        If the model is discrete, or the estimate is far from linear in the inner states.
    ConvergenceError
        If the table does not keep its error bound.
    """
    cascade = design_observer_with_details(
        model, estimate=estimate, measured=measured, sample_time=sample_time, grid=grid
    )
    return corrected(model, cascade, prior=prior, duty=duty, grid=grid, estimate=estimate, measured=measured)


@remembered(8)
def corrected(
    model: FlatModel,
    cascade: ObserverDesign,
    *,
    prior: Prior | None,
    duty: Duty | None,
    grid: Grid | None,
    estimate: str | None,
    measured: str | None,
) -> CorrectedDesign:
    """Return a cascade that was designed for a model, corrected by the factors of its balance."""
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    rounding = encoder_quantum(model, measured) / math.sqrt(12.0)
    over = grid or whole_contour(model)
    form, _ = minimal_form(
        model, estimate=estimate, angle=measured, angles=np.linspace(over.lower, over.upper, 65)
    )
    prior = prior or declared_prior(model)
    balance = balance_of(form, prior, duty or Duty())
    drive = cascade.model.inputs[1 + balance.place]
    safe = safe_inputs(model, prior).get(drive.name)
    limit = None if safe is None or drive.maximum is None else (safe, drive.maximum)
    equations = CorrectionEquations(cascade, balance, rounding=rounding, limit=limit)
    design = CorrectedDesign(_Variables(equations).flat(), cascade, balance)
    return replace(design, model=with_products(design.model).with_values(design.start(0.0)))


def encoder_quantum(model: FlatModel, measured: str) -> float:
    """Return the angle of one count of the encoder that shows a motion, in rad."""
    for reading in model.readings:
        if reading.measured == measured:
            for sensor in reading.sensors:
                if f"{sensor}.quantum" in model.values:
                    return model.values[f"{sensor}.quantum"]
    raise ArrangementError(
        f"model '{model.name}'", f"declares no encoder of '{measured}', so its resolution is not known",
        next_step=f'add a part with component = "Encoder" and of = "{measured}"',
    )  # fmt: skip


def safe_inputs(model: FlatModel, prior: Prior) -> dict[str, float]:
    """Return the size of each limited input up to which the drive surely gives it: two deviations inside."""
    safe = {}
    for body in model.bodies:
        motor = body.motor
        if motor is not None and motor.command is not None and motor.current_limit is not None:
            name = motor.current_limit
            safe[motor.command] = model.values[name]
            if name in prior.names:
                k = prior.place(name)
                safe[motor.command] = float(
                    prior.kinds[k].number(model.values[name], -2.0 * prior.deviations[k])
                )
    return safe
