"""Softening, set, heat and cable friction around a Hookean spring, against closed forms and quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp, trapezoid

from nlsdesign.components import (
    TRANSLATION,
    BoucWen,
    CapstanFriction,
    DamageByMotion,
    Dashpot,
    Driven,
    Element,
    Following,
    HardeningSpring,
    LargestMotion,
    LossHeat,
    PermanentSet,
    SelfHeating,
    SoftWindup,
    Spring,
    StressSoftening,
    ViscousHeat,
    WorkHeat,
    WrapProduct,
    parallel,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.springs import LinearElastic
from nlsdesign.foundation.errors import ArrangementError
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


@pytest.mark.long_cases("1.0")
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_heat_of_the_loss_inside_softens_what_does_not_relax(share: float) -> None:
    """ϑ' = c·ẋ²·g/E − ϑ/τ with a dashpot c beside the spring; g = 1 where the dashpot does not soften."""
    damping, loss, cooling = 30.0, 0.05, 3.0
    times = np.linspace(0.0, 4.0, 8001)
    heat = LossHeat(halving_loss=loss, cooling_time=cooling, relaxing_share=share)
    members = (*BAND, ("dashpot", Dashpot(damping=damping)))
    force, signals = forces(SelfHeating(members=members, heat=heat), times)
    x, v = (np.array([f(t) for t in times]) for f in (place, speed))

    def rate(t: float, warm: np.ndarray) -> np.ndarray:
        return damping * speed(t) ** 2 / (1.0 + share * warm) / loss - warm / cooling

    expected = solve_ivp(rate, (0.0, 4.0), [0.0], t_eval=times, rtol=1e-9, atol=1e-12, max_step=0.01).y[0]
    assert expected[-1] > 0.05
    assert signals["piece.heat"] == pytest.approx(expected, rel=1e-4, abs=1e-6)
    by_hand = K * x / (1.0 + expected) + damping * v / (1.0 + share * expected)
    assert force == pytest.approx(by_hand, rel=1e-4, abs=1e-4)


def test_damage_is_the_same_at_every_later_motion() -> None:
    times = np.linspace(0.0, 6.0, 601)
    curve = DamageByMotion(damage=0.4, damage_motion=REACH, following=1e-4)
    force, _ = forces(StressSoftening(members=BAND, curve=curve), times)
    x = np.array([place(t) for t in times])
    largest = np.maximum.accumulate(x)
    by_hand = K * x * (1.0 - 0.4 * (1.0 - np.exp(-largest / REACH)))
    assert force == pytest.approx(by_hand, rel=2e-3, abs=1e-3)


def test_softening_knows_no_side() -> None:
    """A spring twisted both ways is softened by the larger of both: half of the motion, half of the loss."""
    softened = StressSoftening(members=BAND, curve=LargestMotion(softening=0.4))
    model = pulled(softened)
    states = [REACH if v.name == "piece.largest" else 0.0 for v in model.states]
    there, back = (model.evaluate(states, [side * REACH / 2.0, 0.0])["piece.force"] for side in (1.0, -1.0))
    assert there == pytest.approx(K * REACH / 2.0 * 0.8)
    assert back == pytest.approx(-there)


def test_a_smooth_slider_with_a_large_exponent_is_a_dry_one() -> None:
    """Elastic from each reversal on until it slides: the loop of a spring of stiffness K behind a slider."""
    limit = 4.0
    times = np.linspace(0.0, 4.0, 4001)
    force, _ = forces(BoucWen(stiffness=K, yield_effort=limit, exponent=20.0), times)
    x, dry = np.array([place(t) for t in times]), np.zeros(4001)
    for k in range(4000):
        dry[k + 1] = np.clip(dry[k] + K * (x[k + 1] - x[k]), -limit, limit)
    assert np.sqrt(np.mean((force - dry) ** 2)) < 0.04 * limit
    second = slice(2000, 4001)
    lost = trapezoid(force[second], x[second])
    assert lost == pytest.approx(trapezoid(dry[second], x[second]), rel=0.06)
    # A small exponent rounds the way: less is lost in a loop of the same reach.
    round_way, _ = forces(BoucWen(stiffness=K, yield_effort=limit, exponent=0.5), times)
    assert trapezoid(round_way[second], x[second]) < 0.8 * lost


def test_a_hardening_spring_is_a_cubic_at_first() -> None:
    scale, cubic = 0.05, K / (6.0 * 0.05**2)
    model = pulled(HardeningSpring(cubic=cubic, scale=scale))
    for x in (-2e-3, 1e-3):
        force = model.evaluate([], [x, 0.0])["piece.force"]
        assert force == pytest.approx(cubic * x**3, rel=1e-3)
    # Anywhere it is the derivative of K·x₀²·(cosh(x/x₀) − 1 − (x/x₀)²/2).
    h = 1e-6

    def energy(at: float) -> float:
        return K * scale**2 * float(np.cosh(at / scale) - 1.0 - (at / scale) ** 2 / 2.0)

    for x in (-0.2, 0.05, 0.2):
        slope = (energy(x + h) - energy(x - h)) / (2.0 * h)
        assert model.evaluate([], [x, 0.0])["piece.force"] == pytest.approx(slope, rel=1e-6)
    below, above = (model.evaluate([], [0.1 * scale * f, 0.0])["piece.force"] for f in (1 - 1e-9, 1 + 1e-9))
    assert below == pytest.approx(above, rel=1e-8)


def test_a_soft_windup_lacks_its_stiffness_around_rest_alone() -> None:
    missing, width = 0.6 * K, 2e-3
    model = pulled(parallel(spring=Spring(stiffness=K), windup=SoftWindup(missing=missing, width=width)))
    for x in (-0.05, -1e-3, 2e-3, 0.03):
        force = model.evaluate([], [x, 0.0])["piece.force"]
        by_hand, _ = quad(lambda at: K - missing / np.cosh(at / width) ** 2, 0.0, x, epsabs=1e-12)
        assert force == pytest.approx(by_hand, rel=1e-9)
    # Far out the force is that of a spring behind a dead zone as wide as twice w, by the missing share.
    assert force == pytest.approx(K * 0.03 - missing * width, rel=1e-9)


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
