"""Springs in series with nothing between: the split of the extension and of its rate.

Independent roads: ``scipy.optimize.brentq`` for the static split at many loads; for the dynamic split an
ordinary differential equation derived by hand and integrated by ``scipy.integrate.solve_ivp``.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from nlsdesign.components import (
    TRANSLATION,
    Dashpot,
    Driven,
    Element,
    LinearElastic,
    Specimen,
    Spring,
    StrainStiffening,
    ViscousMaterial,
    parallel,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate

from .fed_by_rate import BoucWen, FedSolid, Hardening

CABLE = 5e4
AREA, LENGTH = 1e-4, 0.0125
MODULI = np.array([0.92, 0.58, 0.74, 0.77, 0.47, 1.06]) * 1e6
KNOTS = np.array([0.0, 0.20, 1.06, 2.65, 9.04, 9.05]) * 1e-3
BRANCH, VISCOSITY = 0.58e6, 31e3
SPEED = 2 * math.pi * 2.0


def rubber(**more: Element) -> Specimen:
    stiff = StrainStiffening(modulus=tuple(MODULI), knots=tuple(KNOTS / LENGTH))
    return specimen(area=AREA, rest_length=LENGTH, stiff=stiff, **more)


def pulled(element: Element) -> FlatModel:
    return flatten(
        assembly("p", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
    )


def static(extension: float) -> float:
    return AREA / LENGTH * float(np.sum(MODULI * np.clip(extension - KNOTS, 0.0, None)))


@pytest.mark.parametrize("cable", [2e2, 5e4, 3e8])
def test_cable_and_rubber_share_a_static_extension(cable: float) -> None:
    """Forty loads across all knots; the cable from softer than the rubber to ten thousand times stiffer."""
    model = pulled(series(cable=Spring(stiffness=cable), rubber=rubber()))
    assert model.states == ()
    for whole in np.concatenate([np.linspace(0.0, 0.014, 36), KNOTS[1:], [1e-7]]):
        x = brentq(
            lambda x, e=whole: static(x) - cable * (e - x), 0.0, max(whole, 1e-12), xtol=1e-18, rtol=1e-14
        )
        at = model.evaluate([], [whole, 0.0])
        assert at["net.rubber.extension"] == pytest.approx(x, rel=1e-10, abs=1e-15)
        assert at["net.force"] == pytest.approx(static(x), rel=1e-9, abs=1e-12)
        assert at["net.cable.extension"] == pytest.approx(whole - x, rel=1e-6, abs=1e-13)


def test_order_of_writing_does_not_matter() -> None:
    one = pulled(series(cable=Spring(stiffness=CABLE), rubber=rubber()))
    other = pulled(series(rubber=rubber(), cable=Spring(stiffness=CABLE)))
    for whole in np.linspace(0.0, 0.012, 13):
        found = [model.evaluate([], [whole, 0.0])["net.force"] for model in (one, other)]
        assert found[0] == pytest.approx(found[1], rel=1e-11)


def test_three_in_series_by_two_nested_roots() -> None:
    model = pulled(
        series(cable=Spring(stiffness=CABLE), a=rubber(), b=Hardening(stiffness=2e3, hardening=4e7))
    )

    def force(whole: float) -> float:
        def both(x: float) -> float:
            rest = brentq(
                lambda y: CABLE * y - (2e3 * (whole - x - y) + 4e7 * (whole - x - y) ** 3), 0, 1, xtol=1e-17
            )
            return static(x) - CABLE * rest

        return static(brentq(both, 0.0, whole, xtol=1e-17))

    for whole in (1e-3, 5e-3, 0.015):
        assert model.evaluate([], [whole, 0.0])["net.force"] == pytest.approx(force(whole), rel=1e-8)


# --- dynamics -------------------------------------------------------------------------------------


def motion(t: float) -> float:
    return 2e-3 * (1 - math.cos(SPEED * t)) + 1e-3 * math.sin(1.7 * SPEED * t) ** 2


def rate(t: float) -> float:
    turned = 1.7 * SPEED * t
    return 2e-3 * SPEED * math.sin(SPEED * t) + 1e-3 * 1.7 * SPEED * 2 * math.sin(turned) * math.cos(turned)


TIMES = np.linspace(0.0, 1.0, 201)


def run(element: Element, name: str = "net.force") -> np.ndarray:
    drive = {"grip.position": motion, "grip.speed": rate}
    return simulate(pulled(element), TIMES, inputs=drive, tolerance=1e-11)[name]


def test_cable_and_relaxing_rubber() -> None:
    """State F_M as in the paper, dF_M/dt = a·k·dδ/dt − (k/η)·F_M, with the split eliminated by hand.

    c·(e − δ) = F*(δ) + F_M ⇒ δ̇ = (c·ė + (k/η)·F_M)/(c + K*(δ) + a·k).
    """
    a = AREA / LENGTH

    def derivative(t: float, y: np.ndarray) -> list[float]:
        delta, branch = y
        tangent = a * float(np.sum(MODULI * (delta > KNOTS)))
        slope = (CABLE * rate(t) + BRANCH / VISCOSITY * branch) / (CABLE + tangent + a * BRANCH)
        return [slope, a * BRANCH * slope - BRANCH / VISCOSITY * branch]

    other = solve_ivp(derivative, (0, 1), [0.0, 0.0], t_eval=TIMES, method="DOP853", rtol=1e-11, atol=1e-15)
    branch = series(spring=LinearElastic(modulus=BRANCH), dashpot=ViscousMaterial(viscosity=VISCOSITY))
    chain = series(cable=Spring(stiffness=CABLE), rubber=rubber(relaxing=branch))
    expected = CABLE * (np.array([motion(t) for t in TIMES]) - other.y[0])
    assert run(chain) == pytest.approx(expected, rel=2e-6, abs=1e-6)
    assert run(chain, "net.rubber.extension") == pytest.approx(other.y[0], rel=1e-7, abs=1e-10)


@pytest.mark.slow
def test_fed_solid_behind_a_cable_is_a_standard_linear_solid_behind_a_cable() -> None:
    """The same physics in two declarations: a state fed by the rate, and spring and dashpot apart."""
    fed = FedSolid(still=4e3, stiffness=6e3, damping=250.0)
    apart = solid_of_parts()
    for first, second in (
        (series(cable=Spring(stiffness=CABLE), s=fed), series(cable=Spring(stiffness=CABLE), s=apart)),
        (
            series(cable=Hardening(stiffness=8e3, hardening=1e9), s=fed),
            series(cable=Hardening(stiffness=8e3, hardening=1e9), s=apart),
        ),
        (series(s=fed, rubber=rubber()), series(s=apart, rubber=rubber())),
    ):
        assert run(first) == pytest.approx(run(second), rel=1e-6, abs=1e-6)


def solid_of_parts() -> Element:
    return parallel(
        still=Spring(stiffness=4e3), branch=series(k=Spring(stiffness=6e3), c=Dashpot(damping=250.0))
    )


def test_sliding_hysteresis_behind_a_hardening_spring() -> None:
    """Bouc–Wen in series with a spring that hardens: the sign of the rate decides the branch.

    By hand: both tangents are positive, so the share moves with the sign of the whole; with it the feed is
    z' = (1 − ½·sgn·z − ½·|z|)/e_y per extension, and x' = e'·K₂/(K₁ + K₂) with K₁ = k₀ + f·z'.
    """
    still, level, yields_at = 1.5e3, 8.0, 4e-4
    k, hardening = 6e3, 5e8

    def derivative(t: float, y: np.ndarray) -> list[float]:
        x, z = y
        sign = math.copysign(1.0, rate(t))
        per = (1 - 0.5 * sign * z - 0.5 * abs(z)) / yields_at
        first, second = still + level * per, k + 3 * hardening * (motion(t) - x) ** 2
        slope = rate(t) * second / (first + second)
        return [slope, per * slope]

    turns = [0.0]
    fine = np.linspace(0.0, 1.0, 20001)
    signs = np.sign([rate(t) for t in fine])
    turns += [
        brentq(rate, fine[i], fine[i + 1], xtol=1e-15) for i in np.flatnonzero(signs[:-1] * signs[1:] < 0)
    ]
    turns += [t for t in fine[1:-1] if rate(t) == 0.0]
    state, found = np.zeros(2), {}
    bounds = sorted({*turns, 1.0})
    for begin, end in pairwise(bounds):
        inside = [t for t in TIMES if begin <= t <= end]
        piece = solve_ivp(
            derivative,
            (begin, end),
            state,
            t_eval=sorted({*inside, end}),
            method="DOP853",
            rtol=1e-11,
            atol=1e-15,
        )
        found |= dict(zip(piece.t, piece.y[0], strict=True))
        state = piece.y[:, -1]
    expected = np.array([found[t] for t in TIMES])
    chain = series(
        b=BoucWen(still=still, level=level, yields_at=yields_at),
        s=Hardening(stiffness=k, hardening=hardening),
    )
    assert run(chain, "net.b.extension") == pytest.approx(expected, rel=1e-5, abs=2e-9)
    assert len(bounds) > 5, "there are reversals"


def test_two_sliding_laws_and_a_spring_balance_at_every_moment() -> None:
    """No reference solution needed: at every sample the three forces are equal and the extensions add."""
    chain = series(
        a=BoucWen(still=1.5e3, level=8.0, yields_at=4e-4),
        b=BoucWen(still=2.5e3, level=3.0, yields_at=1e-4),
        c=Spring(stiffness=4e3),
    )
    drive = {"grip.position": motion, "grip.speed": rate}
    found = simulate(pulled(chain), TIMES, inputs=drive)
    for name in ("a", "b", "c"):
        assert found[f"net.{name}.force"] == pytest.approx(found["net.force"], rel=1e-9, abs=1e-8)
    added = sum(found[f"net.{name}.extension"] for name in ("a", "b", "c"))
    assert added == pytest.approx(found["grip.position"], rel=1e-10, abs=1e-14)
    # The states did follow the rates of these shares: z from its own extension, step by step.
    for name, yields_at in (("a", 4e-4), ("b", 1e-4)):
        z, own = found[f"net.{name}.share_sliding"], np.diff(found[f"net.{name}.extension"])
        middle = (z[1:] + z[:-1]) / 2
        feed = (own - 0.5 * np.abs(own) * middle - 0.5 * own * np.abs(middle)) / yields_at
        assert np.max(np.abs(np.diff(z) - feed)) < 0.1 * np.max(np.abs(feed)) + 1e-3
