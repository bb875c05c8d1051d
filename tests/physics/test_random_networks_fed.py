"""Random networks with laws that are fed by the rate, against the rule of complex stiffness.

The reference is again one line of complex arithmetic per node. What is new is the element: its state is
driven by the rate of its motion, K = k₀ + k·s/(s + k/c), so that in series with other springs the flattened
model needs the rate of an algebraic share (``Scope.total_rate``). The second half puts hardening springs
into the networks: the reference splits the static extension by nested ``brentq`` and then uses the tangent
stiffnesses in the same complex arithmetic.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from nlsdesign.components import TRANSLATION, Dashpot, Driven, Element, Spring, parallel, series, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.model import flatten
from nlsdesign.model.linear import LinearModel, linearise, rest_state

from .fed_by_rate import FedSolid, Hardening

FREQUENCIES = (0.07, 1.3, 21.0)
Law = Callable[[complex], complex]


def joined(
    draw: random.Random, depth: int, leaf: Callable[[random.Random], tuple[Element, Law]]
) -> tuple[Element, Law]:
    """Return an element and its complex stiffness."""
    if depth == 0 or draw.random() < 0.25:
        return leaf(draw)
    members = [joined(draw, depth - 1, leaf) for _ in range(draw.choice((2, 2, 3)))]
    elements = {f"e{i}": element for i, (element, _) in enumerate(members)}
    laws = [law for _, law in members]
    if draw.random() < 0.4:
        return parallel(**elements), lambda s: sum(law(s) for law in laws)
    return series(**elements), lambda s: 1.0 / sum(1.0 / law(s) for law in laws)


def linear_leaf(draw: random.Random) -> tuple[Element, Law]:
    a, b, c = (10.0 ** draw.uniform(-1.0, 2.0) for _ in range(3))
    kind = draw.random()
    if kind < 0.25:
        return Spring(stiffness=a), lambda s: a + 0.0 * s
    if kind < 0.45:
        return Dashpot(damping=a), lambda s: a * s
    return FedSolid(still=a, stiffness=b, damping=c), lambda s: a + b * s / (s + b / c)


def stiffness(linear: LinearModel, s: complex) -> complex:
    drive = np.array([[1.0], [s]])
    inner = np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B @ drive)
    return complex((linear.C @ inner + linear.D @ drive)[0, 0])


@pytest.mark.long_cases("2", "4", "3", "1", "5")
@pytest.mark.parametrize("batch", range(6))
def test_rate_fed_networks_agree_with_complex_stiffness(batch: int) -> None:
    draw = random.Random(7000 + batch)
    asked = 0
    for number in range(30):
        element, law = joined(draw, draw.randint(1, 4), linear_leaf)
        model = flatten(
            assembly("net", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
        )
        linear = linearise(model, model.start(model.states))
        asked += any("branch_force" in v.name for v in model.states)
        for frequency in FREQUENCIES:
            s = 2j * np.pi * frequency
            assert abs(stiffness(linear, s) - law(s)) <= 1e-8 * abs(law(s)), (batch, number, frequency)
    assert asked >= 10, "the element in question is really there"


def test_three_fed_solids_in_series_at_any_state() -> None:
    """Not only at rest: the equations are linear, so the state must not matter."""
    element = series(
        a=FedSolid(still=3.0, stiffness=5.0, damping=0.7),
        b=parallel(x=FedSolid(still=1.0, stiffness=2.0, damping=4.0), y=Dashpot(damping=0.3)),
        c=series(u=FedSolid(still=9.0, stiffness=1.0, damping=0.1), v=Spring(stiffness=4.0)),
    )
    model = flatten(
        assembly("net", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
    )
    draw = np.random.default_rng(3)
    first = linearise(model, model.start(model.states))
    for _ in range(5):
        other = linearise(model, list(draw.normal(size=len(model.states))), list(draw.normal(size=2)))
        for one, two in zip(first[:4], other[:4], strict=True):
            assert one == pytest.approx(two, rel=1e-9, abs=1e-12)


def test_forces_that_are_states_alone_cannot_share_a_motion() -> None:
    """Two laws in series whose force does not depend on the motion at all: no equation gives the share."""
    lone = {n: FedSolid(still=0.0, stiffness=1.0, damping=1.0) for n in ("a", "b")}
    with pytest.raises(ArrangementError, match="singular"):
        flatten(assembly("net", grip=Driven(domain=TRANSLATION), net=tie(series(**lone), "grip")))


# --- hardening springs: small signals around a preload --------------------------------------------


@dataclass(frozen=True)
class Static:
    """Force at an extension, and the complex tangent stiffness there, of one node of a network."""

    force: Callable[[float], float]
    tangent: Callable[[float], Law]


def hardening_leaf(draw: random.Random) -> tuple[Element, Static]:
    k, c, b = 10.0 ** draw.uniform(0, 2), 10.0 ** draw.uniform(0, 3), 10.0 ** draw.uniform(-1, 1)
    spring = Hardening(stiffness=k, hardening=c)
    force = lambda e: k * e + c * e**3  # noqa: E731 - two laws side by side read best so
    if draw.random() < 0.5:
        return spring, Static(force, lambda e: lambda s: k + 3 * c * e**2 + 0 * s)
    return parallel(k=spring, c=Dashpot(damping=b)), Static(
        force, lambda e: lambda s: k + 3 * c * e**2 + b * s
    )


def network(draw: random.Random, depth: int) -> tuple[Element, Static]:
    if depth == 0 or draw.random() < 0.2:
        return hardening_leaf(draw)
    members = [network(draw, depth - 1) for _ in range(2)]
    elements = {f"e{i}": element for i, (element, _) in enumerate(members)}
    one, other = (static for _, static in members)
    if draw.random() < 0.4:
        return parallel(**elements), Static(
            lambda e: one.force(e) + other.force(e),
            lambda e: lambda s: one.tangent(e)(s) + other.tangent(e)(s),
        )

    def share(e: float) -> float:
        return brentq(
            lambda x: one.force(x) - other.force(e - x), -abs(e) - 1, abs(e) + 1, xtol=1e-15, rtol=1e-14
        )

    return series(**elements), Static(
        lambda e: one.force(share(e)),
        lambda e: lambda s: 1 / (1 / one.tangent(share(e))(s) + 1 / other.tangent(e - share(e))(s)),
    )


@pytest.mark.long_cases("2", "1")
@pytest.mark.parametrize("batch", range(3))
def test_hardening_networks_around_a_preload(batch: int) -> None:
    draw = random.Random(9000 + batch)
    for number in range(8):
        element, static = network(draw, 2)
        preload = draw.uniform(-0.6, 0.6)
        model = flatten(
            assembly("net", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
        )
        held = model.with_values({"grip.position": preload})
        rest = rest_state(held, {})
        found = held.evaluate(list(rest))["net.force"]
        assert found == pytest.approx(static.force(preload), rel=1e-7, abs=1e-9), (batch, number)
        linear = linearise(held, list(rest))
        for frequency in FREQUENCIES:
            s = 2j * np.pi * frequency
            expected = static.tangent(preload)(s)
            assert abs(stiffness(linear, s) - expected) <= 1e-6 * abs(expected), (batch, number, frequency)
