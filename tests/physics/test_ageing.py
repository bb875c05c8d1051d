"""Softening, set, heat and cable friction around a Hookean spring, against closed forms and quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp, trapezoid

from nlsdesign.components import (
    TRANSLATION,
    CapstanFriction,
    Driven,
    Element,
    Following,
    LargestMotion,
    PermanentSet,
    SelfHeating,
    Spring,
    StressSoftening,
    ViscousHeat,
    WorkHeat,
    WrapProduct,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.springs import LinearElastic
from nlsdesign.errors import ArrangementError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate

K, REACH, TURN = 2000.0, 0.01, 2.0 * np.pi * 0.5
BAND = (("band", Spring(stiffness=K)),)
Signal = Callable[[float], float]


def pulled(element: Element) -> FlatModel:
    return flatten(assembly("pulled", grip=Driven(domain=TRANSLATION), piece=tie(element, "grip")))


def place(t: float) -> float:
    """From zero to the reach and back, twice, and a third time half as far again."""
    return float((1.0 if t < 4.0 else 1.5) * REACH * (1.0 - np.cos(TURN * t)) / 2.0)


def speed(t: float) -> float:
    return float((1.0 if t < 4.0 else 1.5) * REACH * TURN * np.sin(TURN * t) / 2.0)


def forces(element: Element, times: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    run = simulate(
        pulled(element), times, inputs={"grip.position": place, "grip.speed": speed}, tolerance=1e-9
    )
    return run["piece.force"], dict(run.signals)


def test_a_softened_spring_loses_the_work_of_its_first_loop_only() -> None:
    """Virgin up, (1 − s(1 − x/X))·kx down: the loop holds ∫ s(1 − x/X)·kx dx = s·k·X²/6."""
    times = np.linspace(0.0, 6.0, 6001)
    softened = StressSoftening(members=BAND, curve=LargestMotion(softening=0.3, following=1e-4))
    force, _ = forces(softened, times)
    x = np.array([place(t) for t in times])
    first, second, third = (slice(2000 * i, 2000 * i + 2001) for i in range(3))
    assert force[:1001] == pytest.approx(K * x[:1001], rel=1e-6, abs=1e-6)
    assert trapezoid(force[first], x[first]) == pytest.approx(0.3 * K * REACH**2 / 6.0, rel=2e-3)
    assert trapezoid(force[second], x[second]) == pytest.approx(0.0, abs=1e-4 * K * REACH**2)
    # Beyond the largest stretch so far the rubber is virgin; the loop of the third is that of a longer one
    # less what had been lost before.
    peak = 5000
    assert force[peak] == pytest.approx(K * 1.5 * REACH, rel=1e-4)
    new = 0.3 * K * ((1.5 * REACH) ** 2 - REACH**2) / 6.0
    assert trapezoid(force[third], x[third]) == pytest.approx(new, rel=0.01)


def test_the_exponent_bends_the_way_back_to_virgin_rubber() -> None:
    softened = StressSoftening(members=BAND, curve=LargestMotion(softening=0.3, exponent=2.0, following=1e-4))
    force, _ = forces(softened, np.array([0.0, 1.0, 1.5, 2.0]))
    half = 1.0 - 0.3 * (1.0 - 0.5**2)
    assert force[2] == pytest.approx(half * K * REACH / 2.0, rel=1e-3)


def test_a_spring_that_has_set_is_a_longer_spring() -> None:
    force, signals = forces(
        PermanentSet(members=BAND, share=0.1, memory=Following(following=1e-4)), np.linspace(0.0, 6.0, 601)
    )
    at_half, later = 150, 350
    assert force[at_half] == pytest.approx(K * (0.5 - 0.1) * REACH, rel=2e-3)
    assert force[later] == pytest.approx(force[at_half], rel=1e-4)
    assert force[550] == pytest.approx(K * (0.5 - 0.1) * 1.5 * REACH, rel=2e-3)
    # What the memory lags behind at a peak, of second order in its time constant, is all that is given back.
    assert np.min(np.diff(signals["piece.set"])) > -0.1 * REACH * (TURN * 1e-4) ** 2


def test_heat_is_the_work_done_less_what_cooled_off() -> None:
    """ϑ(t) = ∫ |F·ẋ|/E·e^(−(t − s)/τ) ds."""
    work, cooling = 2.0, 3.0
    times = np.linspace(0.0, 4.0, 8001)
    force, signals = forces(
        SelfHeating(members=BAND, heat=WorkHeat(halving_work=work, cooling_time=cooling)), times
    )
    x, v = (np.array([f(t) for t in times]) for f in (place, speed))
    grown = cumulative_trapezoid(np.abs(K * x * v) / work * np.exp(times / cooling), times, initial=0.0)
    heat = grown * np.exp(-times / cooling)
    assert heat[-1] > 0.05
    assert signals["piece.heat"] == pytest.approx(heat, rel=1e-4, abs=1e-6)
    assert force == pytest.approx(K * x / (1.0 + heat), rel=1e-4, abs=1e-5)


def test_viscous_heat_is_the_loss_less_what_cooled_off() -> None:
    """ϑ(t) = ∫ (ẋ/v)²/τ·e^(−(t − s)/τ) ds."""
    halving, cooling = 0.02, 3.0
    times = np.linspace(0.0, 4.0, 8001)
    force, signals = forces(
        SelfHeating(members=BAND, heat=ViscousHeat(halving_speed=halving, cooling_time=cooling)), times
    )
    x, v = (np.array([f(t) for t in times]) for f in (place, speed))
    grown = cumulative_trapezoid((v / halving) ** 2 / cooling * np.exp(times / cooling), times, initial=0.0)
    heat = grown * np.exp(-times / cooling)
    assert heat[-1] > 0.05
    assert signals["piece.heat"] == pytest.approx(heat, rel=1e-4, abs=1e-6)
    assert force == pytest.approx(K * x / (1.0 + heat), rel=1e-4, abs=1e-5)


def test_heat_needs_work() -> None:
    material = LinearElastic(modulus=1e6)
    with pytest.raises(ArrangementError, match="work"):
        SelfHeating(members=(("law", material),), heat=WorkHeat(halving_work=1.0, cooling_time=1.0))
    piece = specimen(area=1e-4, rest_length=0.01, law=material)
    assert pulled(
        SelfHeating(members=(("p", piece),), heat=WorkHeat(halving_work=1.0, cooling_time=1.0))
    ).states


def test_a_guide_is_eulers_equation() -> None:
    """dT/dα = µ·T along the wrap: the tension grows against the sense of sliding."""
    friction, wrap = 0.15, 0.8
    along = solve_ivp(lambda a, t: friction * t, (0.0, wrap), [K * 5e-3], rtol=1e-10, atol=1e-12).y[0, -1]
    model = pulled(CapstanFriction(members=BAND, guide=WrapProduct(wrap=friction * wrap), creep_speed=1e-4))
    out, still, back = (model.evaluate([], [5e-3, v])["piece.force"] for v in (0.05, 0.0, -0.05))
    assert out == pytest.approx(along, rel=1e-8)
    assert still == pytest.approx(K * 5e-3)
    assert back == pytest.approx((K * 5e-3) ** 2 / along, rel=1e-8)
