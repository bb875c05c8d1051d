"""The actuators to begin from: decks and templates of the project, and those that a designer brings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..components.assembly.deck_template import load_template
from ..components.assembly.deck_writer import declare
from ..components.assembly.named_parts import Assembly
from ..design import MaximumStrain, MaximumStress, contour_of_cam
from ..design.optimisation.defaults import BREAKS
from ..design.parametric.cam_question import ChosenMachine, TargetPoint, under_cable
from ..design.statics.declared_cam import declared_cam
from ..design.statics.equilibrium import equilibrium_torque
from ..foundation.arrays import Array
from ..foundation.deck import Deck, deck_names, load_deck, read_deck, template_names
from ..foundation.errors import NlsError, ValueRangeError, unknown_name
from ..model import flatten
from ..model.roles import series_cam
from .question import LiveQuestion
from .views import declared_strain

MOST_DECK_BYTES = 400_000
"""Largest deck that is read."""
_POINTS = 6
"""Of the target with which an actuator begins."""
_LEAST_STRAIN = 1e-3
_ROOM = 2.0
"""Assumed: how much further than its own cam a design may stretch rubber of which nothing is declared."""


@dataclass(frozen=True)
class GalleryCard:
    """One actuator to begin from."""

    name: str  # by which it is chosen
    kind: str  # "deck" or "template"
    line: str  # what it is, in one line
    reason: str  # why no cam can be designed for it; empty where it can


def gallery_cards() -> tuple[GalleryCard, ...]:
    """Return the actuators that come with the project, also those without a cam, with the reason."""
    cards = []
    for kind, names in (("deck", deck_names()), ("template", template_names())):
        for name in names:
            deck = _deck(name)
            cards.append(GalleryCard(name, kind, deck.description, _objection(deck)))
    return tuple(cards)


def gallery_question(name: str) -> LiveQuestion:
    """Return the question with which an actuator of the gallery begins: its own curve as the target."""
    return question_of(declare(_deck(name)), name)


def question_of_deck(text: str, name: str) -> LiveQuestion:
    """Return the question with which a deck of one's own begins."""
    size = len(text.encode())
    if size > MOST_DECK_BYTES:
        raise ValueRangeError(
            f"deck '{name:.80}' of {size / 1e3:.0f} kB", f"is larger than {MOST_DECK_BYTES / 1e3:.0f} kB",
            next_step="take measured tables out of it",
        )  # fmt: skip
    assembly = declare(read_deck(text, Path(f"{name[:80]}")))
    return question_of(assembly, assembly.name)


def question_of(actuator: Assembly, title: str) -> LiveQuestion:
    """Return the question with which an actuator begins.

    The target is its own torque curve, contour and pretension are free. Rubber of which no strength is
    declared begins with a limit of its own: twice the strain of its own cam.
    """
    blank = LiveQuestion(ChosenMachine(actuator), (TargetPoint(0.0, 0.0), TargetPoint(1.0, 1.0)), title=title)
    cam = blank.cam
    if cam.last_angle is not None:
        last = blank.machine.model.values[cam.last_angle]
    else:
        last = float(contour_of_cam(actuator[cam.name]).angles[-1])
    # Round as a person reads them, in degrees.
    angles = np.radians([float(f"{each:.3g}") for each in np.degrees(np.linspace(0.0, last, _POINTS))])
    torques = np.maximum(equilibrium_torque(blank.machine.model, cam.drive, angles), 0.0)
    torques[0] = 0.0
    points = tuple(TargetPoint(float(a), float(f"{t:.3g}")) for a, t in zip(angles, torques, strict=True))
    question = replace(
        blank, points=points, free=(blank.contour, cam.pretension), limits=_stretch(blank.machine, angles)
    )
    return question.with_points(points)


def _stretch(machine: ChosenMachine, angles: Array) -> dict[str, float]:
    """Return the limit on the strain of rubber of which no strength is declared: by what its own cam does.

    Without any, a design may stretch it without end, to where its law has no value any more.
    """
    if {MaximumStrain.__name__, MaximumStress.__name__} & set(machine.default_limits):
        return {}
    strain = declared_strain(machine.model, angles)
    if strain is None or not _LEAST_STRAIN < strain < BREAKS:
        return {}
    allowed = min(_ROOM * strain, BREAKS)
    size = 10.0 ** (math.floor(math.log10(allowed)) - 1)
    return {MaximumStrain.__name__: float(f"{size * math.ceil(allowed / size):.3g}")}


def _deck(name: str) -> Deck:
    if name in template_names():
        return load_template(name).deck
    if name in deck_names():
        return load_deck(name)
    raise unknown_name("actuator of the gallery", name[:80], [*deck_names(), *template_names()])


def _objection(deck: Deck) -> str:
    try:
        machine = declare(deck)
        model = flatten(machine)
        if not any(spring.cams for spring in model.springs):
            return "no cam spring, whose curve is designed here"
        declared_cam(machine[under_cable(series_cam(model)).name])
    except NlsError as error:
        return error.rule
    return ""
