"""Random spring–dashpot networks against the rule of complex stiffness.

The flattened model is an ordinary differential equation found by the algebra of elements; the reference is
one line of complex arithmetic on the same tree: K = k, K = s·c, sum in parallel, 1/K = Σ 1/Kᵢ in series.
"""

from __future__ import annotations

import random

import numpy as np
import pytest

from nlsdesign.components import TRANSLATION, Dashpot, Driven, Element, Spring, parallel, series, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.model.linear import LinearModel, linearise

FREQUENCIES = (0.07, 1.3, 21.0)
BATCHES, EACH = 12, 100


def random_network(draw: random.Random, depth: int) -> tuple[Element, object]:
    """Return an element and its complex stiffness as a function of s."""
    if depth == 0 or draw.random() < 0.25:
        value = 10.0 ** draw.uniform(-1.0, 2.0)
        if draw.random() < 0.5:
            return Spring(stiffness=value), lambda s: value + 0.0 * s
        return Dashpot(damping=value), lambda s: value * s
    members = [random_network(draw, depth - 1) for _ in range(draw.choice((2, 2, 3)))]
    elements = {f"e{i}": element for i, (element, _) in enumerate(members)}
    laws = [law for _, law in members]
    if draw.random() < 0.5:
        return parallel(**elements), lambda s: sum(law(s) for law in laws)
    return series(**elements), lambda s: 1.0 / sum(1.0 / law(s) for law in laws)


def flattened(element: Element) -> LinearModel:
    model = flatten(
        assembly("net", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
    )
    return linearise(model, model.start(model.states))


def stiffness(linear: LinearModel, s: complex) -> complex:
    drive = np.array([[1.0], [s]])
    inner = np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B @ drive)
    return complex((linear.C @ inner + linear.D @ drive)[0, 0])


@pytest.mark.long_cases("10", "1", "2", "3", "4", "5", "6", "7", "8", "9", "11")
@pytest.mark.parametrize("batch", range(BATCHES))
def test_network_agrees_with_complex_stiffness(batch: int) -> None:
    draw = random.Random(4000 + batch)
    for number in range(EACH):
        element, law = random_network(draw, draw.randint(1, 4))
        linear = flattened(element)
        for frequency in FREQUENCIES:
            s = 2j * np.pi * frequency
            expected = law(s)
            found = stiffness(linear, s)
            assert abs(found - expected) <= 1e-8 * abs(expected), (batch, number, frequency)


def test_at_least_a_thousand_networks() -> None:
    assert BATCHES * EACH >= 1000
