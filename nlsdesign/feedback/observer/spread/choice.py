"""Which observer errs least over the spread of the deck, and the one that is designed where none is named.

Beside it stands what the best estimator could reach on the bench, from what is known of the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....foundation.errors import ArrangementError, ConvergenceError, ValueRangeError, unknown_name
from ....foundation.quantity import typeset_unit
from ....foundation.symbolic import remembered
from ....foundation.written_numbers import prefixed
from ....model import FlatModel
from ....model.roles import measured_motion, series_spring, spring_torque
from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import Prior
from ....simulation.sampled_batch import PLANT, run_batch
from ...analysis.kalman import NoiseAssumptions, declared_deviation
from ...analysis.rest_points import rest_points
from ..certificates.certificate import Certificate
from ..certificates.co_design import CertifiedGain
from ..certificates.contraction import Contraction, certify, declared_assumptions
from ..corrected.corrected_cascade import (
    PREFIX,
    SPREAD,
    CorrectedDesign,
    corrected,
    design_corrected_observer,
    encoder_quantum,
)
from ..corrected.duty import Duty
from ..scheduling.angle_form import PaperForm, StateForm
from ..scheduling.scheduled import ObserverDesign, check_sampling, design_observer_with_details, whole_contour
from ..scheduling.step import CascadeGain, FittedGain, GainRule, SteadyStateKalman
from ..scheduling.table import Grid
from .estimator_bound import SensedTorque, estimator_bound, rms_over
from .innovation_alarm import with_innovation_alarm
from .observer_bench import ObserverBench, observer_bench

BEST, CORRECTED, CASCADE, CERTIFIED = "best", "corrected", "cascade", "certified"
KINDS = (BEST, CORRECTED, CASCADE, CERTIFIED, "kalman", "published")
"""Kinds of observers by name; the first is the one that errs least over the spread."""


@dataclass(frozen=True, eq=False)
class ObserverOfChoice:
    """The observer that errs least over the spread, and why it was taken.

    Parameters
    ----------
    design
        Corrected where that helps, else the cascade.
    reason
        One sentence with the errors that decided.
    expected
        Root mean square torque error over the spread, to first order, along the duty: of the cascade, and of
        the corrected one where it could be designed.
    """

    design: CorrectedDesign | ObserverDesign
    reason: str
    expected: tuple[float, ...]

    @property
    def model(self) -> FlatModel:
        """The observer; its description ends with the reason."""
        model = self.design.model
        return replace(model, description=f"{model.description}; {self.reason}")


@remembered(8)
def choose_observer(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    prior: Prior | None = None,
    duty: Duty | None = None,
    grid: Grid | None = None,
) -> ObserverOfChoice:
    """Return the observer that errs least over the spread of the deck.

    Compared are, to first order, the error of the cascade, which takes the numbers of the deck for granted,
    and that which the corrected one expects of itself along one run of the bench with these numbers.
    :func:`~nlsdesign.feedback.observer.observer_errors` measures both on drawn machines.

    Parameters
    ----------
    model, estimate, measured, sample_time
        As for :func:`design_observer`.
    prior
        What is known of the numbers; the spreads of the deck by default.
    duty
        What the actuator does.
    grid
        As for :func:`design_observer`.

    Raises
    ------
    UnknownNameError
        If a name does not exist.
    ArrangementError
        If the equations cannot be scheduled over one angle.
    ValueRangeError
        If the model is discrete, the estimate is far from linear in the inner states, or a setting is out of
        range.
    ConvergenceError
        If a table does not keep its error bound.
    """
    check_sampling(model, sample_time)
    cascade = design_observer_with_details(
        model, estimate=estimate, measured=measured, sample_time=sample_time, grid=grid
    )
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    unit = typeset_unit(model.variable(estimate).unit)
    try:
        learning = corrected(
            model, cascade, prior=prior, duty=duty, grid=grid, estimate=estimate, measured=measured
        )
        learned = expected_error(model, learning, duty)
    except (ArrangementError, ValueRangeError, ConvergenceError) as error:
        # Without spreads, an encoder or a drive there is nothing to learn from: the reason is handed on.
        reason = f"cascade, for it cannot be corrected: {error}"
        return ObserverOfChoice(with_alarm(cascade, model), reason, ())
    alone = learning.balance.before
    sizes = f"{prefixed(learned, unit)} against {prefixed(alone, unit)} rms"
    both = f"expected over the spread {sizes} of the cascade"
    if learned < alone:
        return ObserverOfChoice(learning, f"corrected: {both}", (alone, learned))
    reason = f"cascade: the corrected one has {both}"
    return ObserverOfChoice(with_alarm(cascade, model), reason, (alone, learned))


def expected_error(model: FlatModel, design: CorrectedDesign, duty: Duty | None) -> float:
    """Return the deviation that the observer expects along the bench with the numbers of the deck."""
    plant = design.step.plant
    bench = observer_bench(
        model, duty=duty, estimate=plant.estimate.name, measured=plant.angle,
        sample_time=design.step.sample_time,
    )  # fmt: skip
    name = f"observer.{PREFIX}.{SPREAD}"
    batch = run_batch(bench.system({"observer": design.model}), bench.stop, inputs=bench.inputs, keep=[name])
    counted = np.zeros(len(batch.time), dtype=bool)
    for _, first, last in bench.stretches:
        counted |= (batch.time >= first) & (batch.time < last)
    deviation = batch[name][0, counted]
    if not np.all(np.isfinite(deviation)):
        raise ConvergenceError(
            f"bench of {model.name}", "does not stay finite",
            next_step="use a smaller torque or lower frequencies in the duty",
        )  # fmt: skip
    return float(np.sqrt(np.mean(deviation**2)))


@dataclass(frozen=True, eq=False)
class DesignedObserver:
    """An observer of a named kind, as commands write it.

    Parameters
    ----------
    kind
        Which was designed: not ``best``, but what that turned out to be.
    design
        With table and start values.
    reason
        Why it was taken; empty where it was asked for.
    expected
        Root mean square torque error over the spread, to first order: cascade, and corrected one where it
        could be designed; empty where it was asked for.
    """

    kind: str
    design: CorrectedDesign | ObserverDesign
    reason: str = ""
    expected: tuple[float, ...] = ()

    @property
    def model(self) -> FlatModel:
        """The observer, its description with reason and what is proved of it: here nothing."""
        model = self.design.model
        text = "; ".join(filter(None, (model.description, self.reason, "not certified")))
        return replace(model, description=text)

    def certify(
        self,
        plant: FlatModel,
        *,
        deck: tuple[str, str] = ("", ""),
        decay: float | None = None,
        with_spread: bool = False,
        real: str = "double",
        ranges: Mapping[str, Any] | None = None,
    ) -> Certificate[Contraction]:
        """Prove what can be proved of the observer.

        Parameters
        ----------
        plant
            Flat model of the actuator.
        deck
            Name and text of its deck.
        decay
            To be proved, in 1/s; 98 % of the fastest that can be by default.
        with_spread
            Whether parameters may be anywhere within their spread.
        real
            ``"double"`` or ``"float"``, of the C code.
        ranges
            Angles, speed and error of the angle by name, where they are not those that the deck declares.

        Raises
        ------
        ArrangementError
            If observers of that kind cannot be certified.
        """
        if not isinstance(self.design, ObserverDesign):
            raise ArrangementError(
                f"observer of kind '{self.kind}'", "cannot be certified", next_step="take --kind certified"
            )
        uncertain = [v for v in plant.parameters if v.uncertain] if with_spread else []
        spreads = {v.name: v.spread.share(v.start) for v in uncertain}
        declared = declared_assumptions(plant, self.design)
        assumed = replace(declared, spreads=spreads, real=real, **(ranges or {}))
        return certify(plant, self.design, assumptions=assumed, decay=decay, deck=deck)


def designed_observer(
    plant: FlatModel,
    *,
    kind: str | None = None,
    decay: float | None = None,
    sample_time: float = 1e-3,
    spring: str | None = None,
    measured: str | None = None,
    grid: Grid | None = None,
) -> DesignedObserver:
    """Design an observer of the torque of a series spring.

    Parameters
    ----------
    plant
        Flat model of an actuator.
    kind
        One of :data:`KINDS`; the first by default.
    decay
        Of a certified gain, in 1/s; as fast as can be proved by default.
    sample_time
        In s.
    spring
        Path of the spring; decided from the structure if it is left out.
    measured
        State that is measured; decided from the structure if it is left out.
    grid
        Of its table; by the default torque error if it is left out.

    Raises
    ------
    ArrangementError
        If the model has no spring or no driven body, the structure leaves open which is meant, or there is
        no observer of that kind.
    UnknownNameError
        If that is no kind.
    """
    try:
        torque, measured = series_spring(plant, spring).effort, measured_motion(plant, measured)
    except ArrangementError as error:
        alone = "nlsdesign export fmu --what plant writes the plant alone, with its C sources inside"
        raise ArrangementError(error.thing, error.rule, next_step=f"{error.next_step}; {alone}") from None
    named: dict[str, Any] = {
        "estimate": torque, "measured": measured, "sample_time": sample_time, "grid": grid,
    }  # fmt: skip
    kind = kind or BEST
    if kind == BEST:
        chosen = choose_observer(plant, **named)
        corrected = isinstance(chosen.design, CorrectedDesign)
        return DesignedObserver(
            CORRECTED if corrected else CASCADE, chosen.design, chosen.reason, chosen.expected
        )
    if kind == CORRECTED:
        return DesignedObserver(kind, design_corrected_observer(plant, **named))
    if kind == "published":
        design = design_observer_with_details(plant, form=PaperForm(), **named)
        return DesignedObserver(kind, with_alarm(design, plant))
    gains: dict[str, Callable[[], Any]] = {
        CASCADE: CascadeGain,
        CERTIFIED: lambda: CertifiedGain(decay=decay),
        "kalman": lambda: _kalman(plant, measured, sample_time),
    }
    if kind not in gains:
        raise unknown_name("kind of observer", kind, KINDS)
    gain = gains[kind]()
    return DesignedObserver(kind, with_alarm(design_observer_with_details(plant, gain=gain, **named), plant))


def with_alarm(design: ObserverDesign, plant: FlatModel) -> ObserverDesign:
    """Return a design whose observer says when the deck no longer explains its innovation."""
    return replace(design, model=with_innovation_alarm(design.model, plant))


def _kalman(plant: FlatModel, measured: str, sample_time: float) -> SteadyStateKalman:
    """Return the rule with the noise that the deck declares, and that assumed where it declares none."""
    over = whole_contour(plant)
    points = rest_points(plant, np.linspace(over.lower, over.upper, 41), angle=measured)
    process = NoiseAssumptions(sample_time=sample_time).process(points)
    return SteadyStateKalman(process, (declared_deviation(plant, measured),))


def design_observer(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    gain: GainRule | FittedGain | None = None,
    form: StateForm | None = None,
    grid: Grid | None = None,
) -> FlatModel:
    """Design an observer that estimates a torque from a measured angle and the known inputs.

    Without ``gain`` and ``form`` it is the one that errs least over the spread of the deck, as
    :func:`choose_observer` says; its description gives the reason. With one of them it is a scheduled
    observer of that kind, designed at the declared numbers.

    Its inputs are the measured angle and the inputs of the model, held over the coming sample; its outputs
    the estimate, the states, and the innovation. A name is that of the plant; what the plant does not have
    carries an ending: ``.memory`` is what goes from sample to sample, ``.innovation`` the measured minus
    the expected angle, ``.estimate`` the estimate of the angle itself, whose name the input has;
    ``correction.standard_deviation`` what the corrected one expects of its estimate, ``correction.factor[i]``
    what it has learned.

    Parameters
    ----------
    model
        Continuous, load fixed.
    estimate
        Output or signal that is wanted; by default the torque of the series spring.
    measured
        State that is measured and over which everything is scheduled; by default the motion of the driven
        body.
    sample_time
        In s.
    gain
        Rule for the correction of a scheduled observer, at each angle or for all angles together.
    form
        Which states a scheduled observer carries;
        :class:`~nlsdesign.feedback.observer.scheduling.angle_form.Minimal` where only a gain is named.
    grid
        Range and number of grid points; the whole contour of the cam by default.

    Raises
    ------
    UnknownNameError
        If a name does not exist.
    ArrangementError
        If the equations cannot be scheduled over one angle, or the structure does not say what is estimated
        or measured.
    ValueRangeError
        If the estimate is far from linear in the inner states, or a setting is out of range.
    ConvergenceError
        If a gain cannot be found, or the table does not keep its error bound.
    """
    if gain is None and form is None:
        chosen = choose_observer(
            model, estimate=estimate, measured=measured, sample_time=sample_time, grid=grid
        )
        return chosen.model
    return design_observer_with_details(
        model, estimate=estimate, measured=measured, sample_time=sample_time, gain=gain, form=form, grid=grid
    ).model


def least_torque_error(bench: ObserverBench, *, translate: Translate = as_it_is) -> Callable[[Prior], float]:
    """Return a function from a prior to the Cramér–Rao bound along the bench, N·m rms.

    The machine runs once, with the numbers of the deck; a calibration is worth what it takes off this bound.

    Parameters
    ----------
    bench
        One run for all observers.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ArrangementError
        If no encoder of the measured motion is declared.
    """
    system = bench.system({})
    names = [f"{PLANT}.{v.name}" for v in bench.model.inputs]
    batch = run_batch(system, bench.stop, inputs=bench.inputs, keep=names, translate=translate)
    inputs = np.vstack([batch[name] for name in names])
    sensed = SensedTorque(
        bench.estimate, bench.measured, encoder_quantum(bench.model, bench.measured), system.sample_time
    )

    def least(prior: Prior) -> float:
        bound = estimator_bound(bench.model, prior, inputs, sensed)
        squares = [rms_over([bound], first, last) ** 2 for _, first, last in bench.stretches]
        return math.sqrt(float(np.mean(squares)))

    return least
