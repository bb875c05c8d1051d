"""How large the innovation of an observer may be if the machine is one of those that the deck describes.

A machine whose numbers differ from the deck's accelerates otherwise by Σ cⱼ·φⱼ/J, with the terms φⱼ of its
balance (:mod:`~nlsdesign.feedback.observer.corrected.balance`). The observer shows that as an innovation of
at most G times as much, with G the largest gain from acceleration to innovation over frequency and angle. So
the square of the innovation should stay below

    q² + 9·σ_e² + 9·G²/J²·(σ_T²·T̂² + σ_D²·(D·i)² + friction's + that of an ammeter),

with a count q and the noise σ_e of the encoder, and with the deviations σ of what spring and drive give, as
if these were independent.
"""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np

from ....foundation.errors import ArrangementError, ConvergenceError, ValueRangeError
from ....foundation.symbolic import remembered
from ....model import FlatModel, Plausibility, Variable
from ....model.flat import INTERFACE
from ....model.roles import declared_reading
from ....model.transform import named
from ....simulation.prior import declared_prior
from ..corrected.balance import DRIVE, DRY, REST, SLOW, VISCOUS, Balance, balance_of
from ..corrected.duty import Duty
from ..scheduling.angle_form import minimal_form
from ..scheduling.scheduled import INNOVATION, MEMORY, error_matrices, whole_contour

DEVIATIONS, WINDOW, OUTLIER = 3.0, 2.0, 9.0
"""How many standard deviations the deck explains, the time constant of the mean in s, and how many times what
is explained a single sample counts at most."""
UNEXPLAINED = "unexplained"
"""Ending of the name of the mean."""


def with_innovation_alarm(observer: FlatModel, plant: FlatModel) -> FlatModel:
    """Return an observer that says when the deck no longer explains its innovation.

    It has one output more, ``unexplained``: the mean of the squared innovation over what the spreads explain.
    Above 1 generated code and FMUs set the bit ``INNOVATION_LARGE`` of their status word. All else is as
    before. Observers that :func:`~nlsdesign.feedback.observer.designed_observer` gives have the output.

    Parameters
    ----------
    observer
        Of the plant, scheduled over one angle.
    plant
        Continuous, with spreads.

    Returns
    -------
    FlatModel
        Unchanged where it has such an output already, as a corrected observer; where the deck states no
        spreads; where something else than the spring moves the machine at rest; and where encoder and
        friction are both exact: then nothing says how large the innovation may be.

    Raises
    ------
    UnknownNameError
        If the plant does not have the variables of the observer.
    """
    measured, estimate = observer.inputs[0].name, observer.outputs[0].name
    if any(v.plausibility for v in observer.outputs):
        return observer
    try:
        balance = declared_balance(plant, estimate, measured)
    except (ArrangementError, ConvergenceError, ValueRangeError):
        return observer  # no spreads, or a weight at rest: nothing says how large the innovation may be
    drive = observer.inputs[1 + balance.place].name
    limit, spring, current = explained(observer, plant, balance, measured)
    if not limit:
        return observer
    s = observer.symbols()
    known, mean = named(observer, s), ca.SX.sym(UNEXPLAINED)
    at_rest = limit / (limit + spring * known[estimate] ** 2 + current * known[drive] ** 2)
    pace = float(observer.sample_time or 0.0) / WINDOW
    surprise = ca.fmin(known[f"{measured}.{INNOVATION}"] ** 2 * (1.0 / limit) * at_rest, OUTLIER)
    # Where nothing moves and nothing pulls, what is explained is the limit, and the mean stands.
    following = mean + (pace - pace * at_rest) * (surprise - mean)
    given = [ca.vertcat(s.state, mean), s.input, s.parameter, s.table]
    results = [ca.vertcat(s.derivative, following), ca.vertcat(s.output, following), s.signal, s.residual]
    assert observer.begin is not None  # as all observers have it
    assert observer.expected is not None
    before = [s.state, *given[1:]]
    settled = [ca.vertcat(x, mean) for x in observer.begin.call(before)]
    words = "mean square of the innovation over what the deck explains"
    output = Variable(
        f"{measured}.{UNEXPLAINED}", "1", f"{words}; INNOVATION_LARGE above 1",
        plausibility=Plausibility(noticeable=1.0),
    )  # fmt: skip
    memory = Variable(f"{output.name}.{MEMORY}", "1", words)
    return replace(
        observer, states=(*observer.states, memory), outputs=(*observer.outputs, output),
        equations=ca.Function("equations", [s.time, *given], results, *INTERFACE),
        begin=ca.Function("begin", given, settled),
        expected=ca.Function("expected", given, observer.expected.call(before)),
    )  # fmt: skip


def explained(
    observer: FlatModel, plant: FlatModel, balance: Balance, measured: str
) -> tuple[float, float, float]:
    """Return what the deck explains of the squared innovation: at rest, per T², per square of the drive."""
    deviations = dict(zip(balance.terms, balance.deviations.tolist(), strict=True))
    scale = (DEVIATIONS * acceleration_gain(observer) / balance.inertia) ** 2
    missed = balance.missed * math.sqrt(2.0) / balance.torque
    still = (
        deviations.get(DRY, 0.0) * balance.dry,
        deviations.get(VISCOUS, 0.0) * balance.viscous * balance.width / SLOW,
        balance.drive * noise(plant, observer.inputs[1 + balance.place].name),
    )  # fmt: skip
    sensor = declared_reading(plant, measured).quantum ** 2 + (DEVIATIONS * noise(plant, measured)) ** 2
    return (
        sensor + scale * sum(part**2 for part in still),
        scale * (deviations.get(REST, 0.0) ** 2 + missed**2),
        scale * (deviations.get(DRIVE, 0.0) * balance.drive) ** 2,
    )


def noise(plant: FlatModel, measured: str) -> float:
    """Return the declared standard deviation of the readings of a variable."""
    sensors = [
        sensor for reading in plant.readings if reading.measured == measured for sensor in reading.sensors
    ]
    return sum(plant.values.get(f"{sensor}.noise", 0.0) for sensor in sensors)


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
