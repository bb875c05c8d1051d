"""An observer that learns what the deck does not know exactly, as a discrete flat model.

It carries the states of the plant and, as slow states, how far the machine lies from its deck along a few
directions in the space of the uncertain numbers (:mod:`~nlsdesign.feedback.observer.adaptive.directions`).
Given the
measured angle everything is linear in the other states, so the filter is a Kalman filter of a system that
varies with the angle; its covariance is part of its memory. How far rubber and current are trusted is
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
from numpy.typing import NDArray

from ....foundation.errors import ArrangementError
from ....foundation.prefixes import prefixed
from ....foundation.quantity import typeset_unit
from ....model import FlatModel
from ....model.roles import measured_motion, spring_torque
from ....simulation.prior import Prior, declared_prior
from ..scheduling.forms import finished, minimal_form
from ..scheduling.gains import CascadeGain
from ..scheduling.measured_angle import with_plausible_inputs
from ..scheduling.scheduled import MEMORY, check_sampling, whole_contour
from ..scheduling.step import ObserverStep
from ..scheduling.table import Compact, Draft, Grid
from .adaptive_settings import AdaptiveSettings, Trust
from .adaptive_step import AdaptiveStep, adaptive_step
from .adaptive_variables import FOLLOWED, filter_model
from .directions import UncertainDirections, uncertain_directions
from .duty import Duty, operating_points
from .filter_equations import FilterEquations, FilterNoise
from .held_observer import held_observer

Array = NDArray[np.float64]


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
        return start | {f"{plant.angle}.{FOLLOWED}": float(angle)}

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
    """Return the angle of one count of the encoder that shows a motion, in rad.

    Parameters
    ----------
    model
        Flat model with its sensors.
    measured
        State that the encoder shows.

    Raises
    ------
    ArrangementError
        If no encoder of that motion is declared.
    """
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
    """Return the size of each limited input up to which the drive surely gives it: two deviations inside.

    Parameters
    ----------
    model
        Flat model with its motors.
    prior
        What is known of the limits.
    """
    safe = {}
    for body in model.bodies:
        motor = body.motor
        if motor is not None and motor.command is not None and motor.current_limit is not None:
            name = motor.current_limit
            spread = float(prior.deviations[prior.place(name)]) if name in prior.names else 0.0
            safe[motor.command] = model.values[name] * math.exp(-2.0 * spread)
    return safe
