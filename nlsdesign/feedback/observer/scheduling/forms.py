"""The two forms in which an observer can carry the actuator: minimal, and that of the paper."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError, unknown_name
from ....model import FlatModel
from ....model.paper_form import GEOMETRIC, PaperFormNames, paper_form
from ....model.transform import with_outputs, without_idle_states
from ...analysis.rest import evaluate_rows, rate_state, rest_states, typical_sizes
from .angle_form import AngleForm, ScheduledNames
from .plant import AngleScheduledPlant

Array = NDArray[np.float64]

AFFINE_LIMIT = 0.2
"""Largest deviation of the estimate from its tangent in the inner states, relative to its largest value."""


class StateForm(Protocol):
    """Which states the observer carries."""

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant in the form that an observer is designed on.

        Parameters
        ----------
        model
            Continuous, load fixed.
        estimate
            Output or signal that is wanted.
        angle
            State that is measured.
        angles
            Range in which the form is wanted, ascending, shape (n,).

        Raises
        ------
        UnknownNameError
            If a name does not exist.
        ArrangementError
            If the equations do not have the form.
        ValueRangeError
            If the estimate is far from linear in the inner states.
        """
        ...


@dataclass(frozen=True)
class Minimal:
    """The states that the model has: inner states of the rubber, angle, speed.

    The force at equilibrium is read at the measured angle; only what relaxes is estimated. It makes no
    difference whether the model carries the strain of the dashpot, the relaxing force or the total force:
    each is a known function of the angle away from the others, and that function is integrated exactly.
    """

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant; see :class:`StateForm`.

        Raises
        ------
        UnknownNameError
            If the angle is no state of the model.
        """
        form, size = minimal_form(model, estimate=estimate, angle=angle, angles=angles)
        return finished(form, size, ())


def minimal_form(model: FlatModel, *, estimate: str, angle: str, angles: Array) -> tuple[AngleForm, Array]:
    """Return the model in its own states, reduced to those that matter, and the typical sizes of the states.

    Parameters
    ----------
    model, estimate, angle, angles
        As for :meth:`StateForm.plant`.

    Raises
    ------
    UnknownNameError
        If the angle is no state of the model.
    """
    if angle not in {v.name for v in model.states}:
        raise unknown_name("state", angle, (v.name for v in model.states))
    model = without_idle_states(model, [estimate, angle])
    sizes, speed = typical_sizes(model, angles, angle=angle), rate_state(model, angle)
    form = AngleForm(model, ScheduledNames(angle, speed, sizes[speed], angles, {}))
    size = np.array([sizes[model.states[i].name] for i in form.order])
    carried = form.rest(angles) - form.at(angles).shift
    largest = np.max(np.abs(carried[:, : form.inner]), axis=0)
    size[: form.inner] = np.where(largest > 0.0, largest, size[: form.inner])
    return form, size


@dataclass(frozen=True)
class PaperForm:
    """The states of the paper: force, extension, angle, speed; the rate of the extension is a held input.

    Kept as the reference. The rate is the difference of the extension at the last two measured angles over
    the sample time, behind a low-pass filter where one is wanted.

    Parameters
    ----------
    names
        Which variables are meant; decided from the structure of the model where they are left out.
    rate_bandwidth
        Cut-off frequency of a first-order filter on the rate in Hz; infinite means none.
    """

    names: PaperFormNames = field(default_factory=PaperFormNames)
    rate_bandwidth: float = float("inf")

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant; see :class:`StateForm`.

        Raises
        ------
        ValueRangeError
            If the bandwidth of the rate is not positive.
        """
        if not self.rate_bandwidth > 0.0:
            raise ValueRangeError(f"rate_bandwidth {self.rate_bandwidth:g} Hz", "must be positive")
        n = self.names.of(model)
        published = with_outputs(paper_form(model, self.names), [estimate, n.extension, angle])
        consistent = {n.extension: f"{n.extension}.{GEOMETRIC}"}
        rest = rest_states(published, angles, angle=angle, consistent=consistent)
        names, sizes = [v.name for v in published.states], np.max(np.abs(rest), axis=0)
        s = published.symbols()
        led = s.input[[v.name for v in published.inputs].index(n.rate)]
        probe = ca.Function(
            "probe",
            [s.time, s.state, s.input, s.parameter],
            [s.derivative, ca.densify(ca.jacobian(s.derivative, led))],
        )
        rates, jumps = evaluate_rows(
            probe, rest, published.start(published.inputs), published.start(published.parameters)
        )
        # What rests at zero, such as a relaxing stress, is as large as its jump when the cable is pulled.
        sizes = np.maximum(sizes, np.max(np.abs(jumps), axis=0) * sizes[names.index(n.extension)])
        sizes[names.index(n.speed)] = np.sqrt(
            sizes[names.index(angle)] * np.max(np.abs(rates[:, names.index(n.speed)]))
        )
        speed_size = float(sizes[names.index(n.speed)])
        layout = ScheduledNames(angle, n.speed, speed_size, angles, consistent, n.rate)
        form = AngleForm(published, layout)
        return finished(form, sizes[form.order], (n.extension,), self.rate_bandwidth)


def finished(
    form: AngleForm, sizes: Array, measured: tuple[str, ...], bandwidth: float = float("inf")
) -> AngleScheduledPlant:
    """Return the plant of a form, checked.

    Parameters
    ----------
    form
        The model in the form of an angle-scheduled plant.
    sizes
        Typical sizes of its states, shape (n,).
    measured
        States that are measured besides the angle.
    bandwidth
        Cut-off frequency of the filter on their rate in Hz.

    Raises
    ------
    ArrangementError
        If the equations do not have the form.
    ValueRangeError
        If the estimate is far from linear in the inner states.
    """
    (driven, rows), friction = form.driven(), form.friction()
    form.check_additive(driven, rows, friction, sizes)
    deviation, model = form.affine_error(), form.model
    if deviation > AFFINE_LIMIT:
        raise ValueRangeError(
            f"'{model.outputs[0].name}'",
            f"deviates by {deviation:.0%} of its largest value from being linear in the inner states",
            next_step="exchange an inner state with replace_state so that it becomes linear",
        )
    return AngleScheduledPlant(
        name=model.name, states=tuple(model.states[i] for i in form.order), angle=form.layout.angle,
        speed=form.layout.speed, estimate=model.outputs[0],
        inputs=tuple(model.inputs[i] for i in form.free_inputs), measured=measured, at=form.at,
        rest=form.rest, driven=driven, rows=rows, friction=friction, sizes=sizes, rate_bandwidth=bandwidth,
        affine_error=deviation,
    )  # fmt: skip
