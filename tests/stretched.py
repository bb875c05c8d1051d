"""A piece of rubber in a grip that moves as told: what the tests of material laws have in common."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nlsdesign.components import TRANSLATION, Driven, Element, specimen, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate

AREA, LENGTH = 1e-4, 0.0125
VOLUME = AREA * LENGTH


def deck_head(name: str, *, area: int) -> str:
    """Deck of such a piece whose area is given in mm², up to its law."""
    return f"""[deck]
name = "{name}"
description = ""
[grip]
component = "Driven"
domain = "translation"
[rubber]
component = "Specimen"
between = ["grip"]
area = {{value = {area}, unit = "mm^2", source = "test"}}
rest_length = {{value = 12.5, unit = "mm", source = "test"}}
"""


def pulled(**laws: Element) -> FlatModel:
    """The flat model of a piece with laws in parallel; its output is the force."""
    rubber = specimen(area=AREA, rest_length=LENGTH, **laws)
    return flatten(
        assembly("pulled", grip=Driven(domain=TRANSLATION), rubber=tie(rubber, "grip")),
        outputs=["rubber.force"],
    )


def stress_at(model: FlatModel, strains: np.ndarray | list[float]) -> np.ndarray:
    """Nominal stress of a piece without memory, in Pa."""
    return np.array([model.evaluate([], [e * LENGTH, 0.0])["rubber.force"] / AREA for e in strains])


def run(
    model: FlatModel,
    times: np.ndarray,
    strain: Callable[[float], float],
    rate: Callable[[float], float],
    tolerance: float = 1e-9,
) -> Trace:
    """Simulate the piece along a path of the strain."""
    drive = {"grip.position": lambda t: LENGTH * strain(t), "grip.speed": lambda t: LENGTH * rate(t)}
    return simulate(model, times, inputs=drive, tolerance=tolerance)
