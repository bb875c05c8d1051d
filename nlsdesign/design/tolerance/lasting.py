"""What time takes from the torque of a spring: set of its rubber, and relaxation that is not over.

Rubber that lasts at the strain ε₀ of angle zero keeps a part c of it for good, so its piece is longer by
c·ε₀·L₀ and pulls as with that much less pretension. A branch that relaxes slowly still pulls when the torque
curve of the new spring is measured, and no longer later on. Neither is guessed: where a deck states nothing,
that is said. Source: ISO 2285 (tension set).
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError
from ...model import FlatModel
from ...model.structure import SpecimenNames
from ..statics.equilibrium import ElasticLaw, cam_function, elastic_law, relaxing_law
from .causes import LastingCause, SinceMade

MEASURED_AFTER = 60.0
"""Assumed: seconds for which a new spring has stood at an angle when its torque there is measured."""
SMALLEST = 1e-6
"""Share of the largest torque below which what relaxes later is nothing."""


def lasting_causes(
    model: FlatModel, spring: str | None, angles: Array
) -> tuple[tuple[LastingCause, ...], tuple[str, ...]]:
    """Return what time takes from the torque, and a sentence on each kind: what it rests on, or what lacks.

    ``spring``: path of the cam spring; decided from the structure if it is left out. ``angles``: in rad,
    shape (n,).
    """
    law = elastic_law(model, spring)
    both = cam_function(model, spring)(angles.reshape(1, -1), law.numbers)
    arm, longer = (np.array(item, dtype=float).ravel() for item in both)
    arms = model.values[law.cam.elements] * arm
    stretch = model.values[law.cam.pretension] + longer
    causes, sentences = [], []
    for piece in law.cam.specimens:
        cause, sentence = loss_by_set(model, law, piece, arms, stretch)
        causes += [cause] if cause else []
        sentences.append(sentence)
    cause, sentence = loss_by_relaxation(model, law, arms, stretch)
    return tuple(causes + ([cause] if cause else [])), (*sentences, sentence)


def loss_by_set(
    model: FlatModel, law: ElasticLaw, piece: SpecimenNames, arms: Array, stretch: Array
) -> tuple[LastingCause | None, str]:
    """Return what the set of a piece takes."""
    strains = np.array(law.function(model.values[law.cam.pretension], law.numbers)[2], dtype=float).ravel()
    strain = float(strains[law.specimens.index(piece.name)])
    if strain <= 0.0:
        return None, f"set: '{piece.name}' is not stretched at angle zero, so nothing lasts there"
    at_rest = f"'{piece.name}' is stretched by {100 * strain:.3g} % at angle zero"
    if piece.tension_set is None:
        return None, f"set: {at_rest} and states no tension_set (ISO 2285), so what that takes is not counted"
    share = model.values[piece.tension_set]
    shorter = share * strain * model.values[piece.rest_length]
    lost = arms * (law.force(stretch) - law.force(np.maximum(stretch - shorter, 0.0)))
    stated = model.variable(piece.tension_set).source
    source = f"declared: {100 * share:.3g} % of the strain at rest stays, {stated}"
    return _cause(f"{piece.name}.set", lost, source), f"set: {at_rest}; {source}"


def loss_by_relaxation(
    model: FlatModel, law: ElasticLaw, arms: Array, stretch: Array
) -> tuple[LastingCause | None, str]:
    """Return what relaxation takes after the torque was measured."""
    if not law.cam.states:
        return None, f"creep: no law of '{law.element}' relaxes, so what creep takes is not counted"
    try:
        relaxing = relaxing_law(model, law.cam.drive).function
    except ArrangementError as error:
        return None, f"creep: not counted: {error}"
    lost = []
    for extension in stretch:
        offset = np.array(relaxing(extension, 0.0, 0.0, law.numbers)[1], dtype=float).ravel()
        states = relaxed_until_measured(relaxing, extension, law.numbers)[1] @ offset
        lost.append(float(relaxing(extension, 0.0, states, law.numbers)[0]))
    lost = arms * np.array(lost)
    after = f"{MEASURED_AFTER:g} s after it was stretched"
    if np.max(np.abs(lost)) < SMALLEST * np.max(np.abs(arms * law.force(stretch))):
        return None, f"creep: what is declared to relax in '{law.element}' is over {after}"
    source = f"declared: relaxation of '{law.element}' that is not over {after}, when its torque is measured"
    return _cause(f"{law.element}.creep", lost, source), f"creep: {source}"


def relaxed_until_measured(relaxing: ca.Function, extension: float, numbers: Array) -> tuple[Array, Array]:
    """Return e^(A·t) and its integral until a new spring is measured.

    ``relaxing``: function of a :class:`~..statics.equilibrium.RelaxingLaw`, affine in its states.
    """
    count = relaxing.size1_in(2)
    offset, *columns = (
        np.array(relaxing(extension, 0.0, states, numbers)[1], dtype=float).ravel()
        for states in (np.zeros(count), *np.eye(count))
    )
    a = np.column_stack(columns) - offset[:, None]
    flow = scipy.linalg.expm(MEASURED_AFTER * np.block([[a, np.eye(count)], [np.zeros((count, 2 * count))]]))
    return flow[:count, :count], flow[:count, count:]


def _cause(name: str, lost: Array, source: str) -> LastingCause:
    spread = SinceMade()
    deviation = spread.slope(0.0)
    return LastingCause(name, 1.0, deviation, "1", source, True, spread, tuple(deviation * lost))
