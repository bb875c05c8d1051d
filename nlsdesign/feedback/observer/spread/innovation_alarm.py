"""How large the innovation of an observer may be if the machine is one of those that the deck describes.

A machine whose numbers differ from the deck's accelerates otherwise by Σ cⱼ·φⱼ/J, with the terms φⱼ of its
balance (:mod:`~nlsdesign.feedback.observer.corrected.balance`). The observer shows that as an innovation of
at most G times as much, with G the largest gain from acceleration to innovation over frequency and angle. So the
square of the innovation should stay below

    q² + 9·G²/J²·(σ_T²·T̂² + σ_D²·(D·i)² + friction's + that of an ammeter),

with a count q, and with the deviations σ of what spring and drive give, as if these were independent.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ....foundation.errors import ArrangementError, ConvergenceError, ValueRangeError
from ....foundation.symbolic import remembered
from ....model import Alarm, FlatModel
from ....model.roles import declared_reading
from ....simulation.prior import declared_prior
from ..corrected.balance import DRIVE, DRY, REST, SLOW, VISCOUS, Balance, balance_of
from ..corrected.duty import Duty
from ..scheduling.angle_form import minimal_form
from ..scheduling.scheduled import INNOVATION, MEMORY, error_matrices, whole_contour

DEVIATIONS, WINDOW = 3.0, 2.0
"""How many standard deviations the deck explains, and the time constant of the mean in s."""


def with_innovation_alarm(observer: FlatModel, plant: FlatModel) -> FlatModel:
    """Return an observer whose innovation says when the deck no longer explains it.

    Generated code and FMUs then set the bit ``INNOVATION_LARGE`` of their status word. The observer computes
    what it did. Observers that :func:`~nlsdesign.feedback.observer.designed_observer` gives have the alarm.

    Parameters
    ----------
    observer
        Of the plant, scheduled over one angle; one that is corrected has an alarm of its own.
    plant
        Continuous, with spreads.

    Returns
    -------
    FlatModel
        Unchanged where the deck states no spreads, or something else than the spring moves the machine at
        rest: then nothing says how large the innovation may be.

    Raises
    ------
    UnknownNameError
        If the plant does not have the variables of the observer.
    """
    measured = observer.inputs[0].name
    try:
        balance = declared_balance(plant, observer.outputs[0].name, measured)
    except (ArrangementError, ConvergenceError, ValueRangeError):
        return observer
    deviations = dict(zip(balance.terms, balance.deviations.tolist(), strict=True))
    scale = (DEVIATIONS * acceleration_gain(observer) / balance.inertia) ** 2
    missed = balance.missed * math.sqrt(2.0) / balance.torque
    spring = deviations.get(REST, 0.0) ** 2 + missed**2
    drive = observer.inputs[1 + balance.place].name
    noise = sum(
        plant.values.get(f"{sensor}.noise", 0.0)
        for reading in plant.readings
        if reading.measured == drive
        for sensor in reading.sensors
    )
    still = [
        deviations.get(DRY, 0.0) * balance.dry,
        deviations.get(VISCOUS, 0.0) * balance.viscous * balance.width / SLOW, balance.drive * noise,
    ]  # fmt: skip
    limit = declared_reading(plant, measured).quantum ** 2 + scale * sum(part**2 for part in still)
    shares = (
        (observer.outputs[0].name, scale * spring),
        (drive, scale * (deviations.get(DRIVE, 0.0) * balance.drive) ** 2),
    )
    alarm = Alarm(limit, shares, WINDOW)
    name = f"{measured}.{INNOVATION}"
    return replace(
        observer,
        outputs=tuple(replace(v, alarm=alarm) if v.name == name else v for v in observer.outputs),
    )


@remembered(8)
def declared_balance(plant: FlatModel, estimate: str, measured: str) -> Balance:
    """Return the balance of the measured body over the whole contour, with the spreads of the deck."""
    over = whole_contour(plant)
    angles = np.linspace(over.lower, over.upper, 65)
    form, _ = minimal_form(plant, estimate=estimate, angle=measured, angles=angles)
    return balance_of(form, declared_prior(plant), Duty())


def acceleration_gain(observer: FlatModel) -> float:
    """Return the largest innovation per acceleration that the observer does not expect, in s².

    Over frequencies up to half the sampling rate and over the angles of the table, while the machine slides.
    """
    time, (body,) = float(observer.sample_time or 0.0), observer.bodies
    (speed,) = (v.nominal for v in observer.states if v.name == f"{body.rate}.{MEMORY}")
    ends = observer.tables[0].ends if observer.tables else (0.0, 0.0)
    errors = error_matrices(observer, np.linspace(*ends, 17), speed)
    count = errors.shape[1]
    pushed = np.zeros(count)
    pushed[-2:] = time**2 / 2.0, time  # of the memory angle and speed stand last
    turns = np.exp(1j * np.append(0.0, np.geomspace(1e-4, np.pi, 64)))
    systems = turns[:, None, None, None] * np.eye(count) - errors
    answers = np.linalg.solve(systems, np.broadcast_to(pushed[:, None], (*systems.shape[:2], count, 1)))
    return float(np.max(np.abs(answers[..., -2, 0])))
