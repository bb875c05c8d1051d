"""An observer that learns what the deck does not know exactly, as a discrete flat model.

It carries the states of the plant and, as slow states, how far the machine lies from its deck along a few
directions in the space of the uncertain numbers
(:mod:`~nlsdesign.feedback.observer.adaptive.duty_and_directions`). Given the measured angle everything is
linear in the other states, so the filter is a Kalman filter of a system that varies with the angle; its
covariance is part of its memory. How far rubber and current are trusted is
therefore not a gain that somebody chose: it follows from the spreads of the deck, and from what the motion
has shown so far. Four rules go beyond the textbook:

- The inner states of the rubber get no correction. They are driven by the measured angle alone, as in the
  cascade, so the estimate stays bounded whatever current and friction do.
- Near standstill dry friction can carry anything up to its limit, so there the current says nothing of the
  rubber: the slow states get no correction while the estimated speed is small. The same holds near a limit
  of the drive that is not known exactly.
- What surprises by more than a few deviations corrects the slow states no further than that.
- Slow states are held within a stated number of deviations, so the torque is at most that far from the
  deck's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError
from ....foundation.quantity import typeset_unit
from ....foundation.written_numbers import prefixed
from ....model import FlatModel, Variable
from ....model.roles import measured_motion, spring_torque
from ....simulation.prior import Prior, declared_prior
from ..scheduling.angle_form import finished, minimal_form
from ..scheduling.measured_angle import with_plausible_inputs
from ..scheduling.scheduled import MEMORY, ObserverVariables, check_sampling, whole_contour
from ..scheduling.step import CascadeGain, ObserverStep
from ..scheduling.table import Compact, Draft, Grid
from .adaptive_step import AdaptiveStep, adaptive_step, held_observer
from .duty_and_directions import (
    AdaptiveSettings,
    Duty,
    Trust,
    UncertainDirections,
    operating_points,
    uncertain_directions,
)
from .filter_equations import FilterEquations, FilterNoise, expected_inputs, first_states, pairs

DEVIATION, SPREAD, INFLATION = "deviation", "standard_deviation", "unrest"
"""Endings of the name of the estimate: slow states, the deviation that the filter expects, and the factor on
the noise that it reckons with."""
FIRST_READING = 2.0
"""Deviation of the angle at the start, in deviations of rounding: the filter begins at its first reading."""
LOW_PASS = "followed"
"""Ending of the name of the angle: its measured value behind a filter."""


def filter_model(filter_: FilterEquations, directions: UncertainDirections) -> FlatModel:
    """Return the observer as a discrete flat model."""
    writer = _Variables(filter_, directions)
    return FlatModel(
        name=f"{filter_.plant.name}_observer",
        description=writer.description(),
        states=writer.states(),
        inputs=writer.inputs(),
        parameters=(),
        outputs=writer.outputs(),
        signals=(),
        equations=filter_.sample(),
        sample_time=filter_.step.nominal.sample_time,
        tables=writer.tables(),
        begin=first_states(filter_),
        expected=expected_inputs(filter_),
    )


class _Variables(ObserverVariables):
    """Groups of variables of one adaptive observer."""

    def __init__(self, filter_: FilterEquations, directions: UncertainDirections) -> None:
        super().__init__(filter_.step.nominal, filter_.compact)
        self.directions, self.trust, self.units = directions, filter_.trust, filter_.units
        self.slow, self.angle, self.speed = filter_.slow, filter_.angle, filter_.speed

    def description(self) -> str:
        """Return one sentence."""
        return (
            f"observer of {self.plant.estimate.name} that learns {self.slow} deviations from the deck, "
            f"{self.trust}, {self.table_in_words()}"
        )

    def _slow_names(self) -> list[str]:
        return [f"{self.plant.estimate.name}.{DEVIATION}[{d + 1}]" for d in range(self.slow)]

    def states(self) -> tuple[Variable, ...]:
        """Return what is carried on from sample to sample."""
        plant, states = self.plant, self.memory()
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            states.append(Variable(f"{name}.{MEMORY}", "1", text))
        text = "factor on the variances of all noise, from innovations that were larger than expected"
        states.append(Variable(f"{plant.estimate.name}.{INFLATION}", "1", text, 1.0))
        v = plant.states[self.angle]
        size = float(plant.sizes[self.angle])
        words = f"measured {v.name} behind a filter, which shows whether it moves"
        states.append(Variable(f"{v.name}.{LOW_PASS}", v.unit, words, nominal=size))
        initial = np.concatenate([self._initial_variances(), np.ones(self.slow)])
        names = [*plant.names, *self._slow_names()]
        for i, j in pairs(len(names)):
            start = float(initial[i]) if i == j else 0.0
            words = "covariance of the errors, in counts, counts per sample, typical sizes and deviations: "
            states.append(
                Variable(f"covariance[{i + 1},{j + 1}]", "1", f"{words}{names[i]} and {names[j]}", start)
            )
        return tuple(states)

    def _initial_variances(self) -> Array:
        """Return variances at the start: the angle is that of the first reading, the rest is little known.

        A variance as large as the range would lose the digits of single precision in the first correction.
        """
        sizes = self.plant.sizes / self.units
        first = (0.1 * sizes) ** 2
        first[self.angle] = FIRST_READING**2
        first[self.speed] = (0.03 * sizes[self.speed]) ** 2
        return np.asarray(first, dtype=np.float64)

    def outputs(self) -> tuple[Variable, ...]:
        """Return the estimate, its expected deviation, states, innovation and slow states."""
        wanted, text = self.estimate(), "standard deviation that the filter expects of it"
        outputs = [wanted, Variable(f"{wanted.name}.{SPREAD}", wanted.unit, text), *self.estimates()]
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            outputs.append(Variable(name, "1", text))
        return tuple(outputs)


@dataclass(frozen=True, eq=False)
class AdaptiveDesign:
    """An adaptive observer and what went into it.

    Parameters
    ----------
    model
        The observer: discrete, scheduled over one table.
    step
        Its step as exact functions of the angle.
    compact
        Its table, and the error that the table makes.
    directions
        What the slow states mean.
    duty, trust
        Over which, and with which settings it was designed.
    """

    model: FlatModel
    step: AdaptiveStep
    compact: Compact
    directions: UncertainDirections
    duty: Duty
    trust: Trust

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values of an observer that begins while the actuator rests at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        plant, at = self.step.nominal.plant, np.array([angle])
        matrices = self.step.matrices(at)
        state = plant.rest(at)[0] - matrices["shift"][0, :, 0]
        memory = state - matrices["prior"][0, :, 0] - matrices["coupling"][0] @ state[: self.step.inner]
        start = {f"{n}.{MEMORY}": float(m) for n, m in zip(plant.names, memory, strict=True)}
        return start | {f"{plant.angle}.{LOW_PASS}": float(angle)}

    def __str__(self) -> str:
        grid = self.compact.angles
        estimate = self.step.nominal.plant.estimate
        unit = typeset_unit(estimate.unit)
        lines = [
            f"Adaptive observer of {estimate.name} every {self.step.nominal.sample_time:g} s",
            f"  table: {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad, "
            f"{len(self.compact.columns)} columns{self.compact.cost(estimate.unit)}",
            "  slow states, with the torque that one deviation moves:",
        ]
        for d, effect in enumerate(self.directions.effect):
            where = "spring" if self.directions.torque_share[d] > 0.5 else "drive"
            words = self.directions.in_words(d)
            lines.append(f"    [{d + 1}] {prefixed(effect, unit)}, {where}: {words}")
        return "\n".join([*lines, f"  left out: {prefixed(self.directions.left_out, unit, digits=2)}"])


def design_adaptive_observer(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    settings: AdaptiveSettings | None = None,
    grid: Grid | None = None,
) -> AdaptiveDesign:
    """Design an observer that estimates a torque, and what the deck does not know exactly, from one angle.

    Inputs and outputs are those of :func:`~nlsdesign.feedback.observer.design_observer`; added to the
    outputs are the standard deviation that the filter expects of its estimate, and the slow states.

    Parameters
    ----------
    model
        Continuous, load fixed.
    estimate
        Output or signal that is wanted; by default the torque of the series spring.
    measured
        State that is measured; by default the motion of the driven body.
    sample_time
        In s.
    settings
        What is known, what the actuator does, and how far the equations are trusted.
    grid
        Range and number of grid points; the whole contour of the cam by default.

    Raises
    ------
    ArrangementError
        If no number of the deck is uncertain enough to matter, no encoder of the angle is declared, or the
        equations cannot be scheduled over one angle.
    ValueRangeError
        If the model is discrete, the estimate is far from linear in the inner states, or a setting is out of
        range.
    ConvergenceError
        If the table does not keep its error bound.
    """
    check_sampling(model, sample_time)
    settings = settings or AdaptiveSettings()
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    trust, over = settings.trust, grid or whole_contour(model)
    noise = trust.counts * encoder_quantum(model, measured) / math.sqrt(12.0)
    reference = np.linspace(over.lower, over.upper, 65)
    form, sizes = minimal_form(model, estimate=estimate, angle=measured, angles=reference)
    plant = finished(form, sizes, ())
    points = operating_points(form, settings.duty)
    resolution = trust.unmodelled * points.torque
    prior = settings.prior or declared_prior(model)
    smallest = trust.smallest * points.torque
    directions = uncertain_directions(form, prior, settings.duty, resolution=smallest, most=trust.most)
    step = adaptive_step(
        form, ObserverStep(plant, CascadeGain(), sample_time, reference), directions, form.model.values
    )
    missed = math.hypot(resolution, directions.left_out)
    noises = FilterNoise(noise, missed / points.inertia, missed, safe_inputs(model, prior))
    observed = tuple(body for body in model.bodies if body.motion == measured)
    compact = over.compact(step.entries, Draft(plant, partial(held_observer, step)))
    flat = filter_model(FilterEquations(step, compact, trust, noises), directions)
    flat = with_plausible_inputs(
        replace(flat, bodies=observed, origin=model.origin), model, plant, compact.angles
    )
    design = AdaptiveDesign(flat, step, compact, directions, settings.duty, trust)
    return replace(design, model=design.model.with_values(design.start(0.0)))


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
