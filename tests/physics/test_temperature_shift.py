"""Temperature moves relaxation times: shifted curves, the universal constants, and passivity.

Independent roads: complex modulus of the laws inside at the shifted frequency; two published pairs of the
constants of Williams, Landel and Ferry that must agree; loss of a dashpot by hand.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from nlsdesign.components import (
    ArrheniusShift,
    Element,
    HeatBalance,
    LinearElastic,
    NeoHooke,
    SelfHeating,
    SlidingFillers,
    Springpot,
    WlfShift,
    generalised_maxwell,
    maxwell,
    series,
)
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from tests.stretched import VOLUME, pulled, run

from .test_networks import complex_modulus

T_R = 253.15
INSIDE: dict[str, Element] = {
    "generalised Maxwell": generalised_maxwell(1e6, moduli=(3e5, 2e5), times=(0.01, 0.3)),
    "springpot in series": series(
        spring=LinearElastic(modulus=5e6), pot=Springpot(modulus=1e6, order=0.3, lower=1e-3, upper=1e3)
    ),
    "two springs in series with a branch": series(
        a=NeoHooke(shear_modulus=1e6), b=generalised_maxwell(1e6, moduli=(3e5,), times=(0.1,))
    ),
}


def wlf(law: Element, temperature: float) -> WlfShift:
    return WlfShift(members=(("law", law),), temperature=temperature, reference=T_R)


def factor(temperature: float, c1: float = 8.86, c2: float = 101.6, reference: float = T_R) -> float:
    over = temperature - reference
    return 10.0 ** (-c1 * over / (c2 + over))


@pytest.mark.parametrize("name", INSIDE)
@pytest.mark.parametrize("temperature", [233.15, 253.15, 293.15])
def test_a_shifted_law_is_the_law_at_another_frequency(name: str, temperature: float) -> None:
    """E*(f, T) = E*(f·a_T, T_r)."""
    for frequency in (0.1, 3.0):
        found = complex_modulus(wlf(INSIDE[name], temperature), frequency)
        expected = complex_modulus(INSIDE[name], frequency * factor(temperature))
        assert found == pytest.approx(expected, rel=1e-8)


def test_the_two_published_pairs_of_constants_agree() -> None:
    """c₁, c₂ = 17.44, 51.6 K from T_g are 8.86, 101.6 K from T_g + 50 K (Williams, Landel and Ferry 1955)."""
    glass = T_R - 50.0
    for temperature in (glass + 5.0, glass + 30.0, glass + 90.0):
        law = wlf(maxwell(modulus=1e6, viscosity=1e4), temperature)
        shown = pulled(law=law).evaluate([0.0], [0.0, 0.0])["rubber.law.time_shift"]
        decades = math.log10(factor(temperature, 17.44, 51.6, glass))
        decades -= math.log10(factor(T_R, 17.44, 51.6, glass))
        assert math.log10(shown) == pytest.approx(decades, rel=3e-3, abs=0.02)


def test_arrhenius_by_its_slope() -> None:
    """d ln τ/d(1/T) is the activation energy over the gas constant: relaxation times from simulated decay."""
    activation, times = 6000.0, np.linspace(0.0, 0.05, 101)
    inverse, logarithm = [], []
    for temperature in (280.0, 300.0, 330.0):
        law = ArrheniusShift(
            members=(("law", maxwell(modulus=1e6, viscosity=3e4)),), temperature=temperature, reference=300.0,
            activation=activation,
        )  # fmt: skip
        force = run(pulled(law=law), times, lambda t: 0.1, lambda t: 0.0, 1e-11)["rubber.force"]
        inverse.append(1 / temperature)
        logarithm.append(math.log(-1 / np.polyfit(times, np.log(force), 1)[0]))
    assert np.polyfit(inverse, logarithm, 1)[0] == pytest.approx(activation, rel=1e-6)
    assert math.exp(logarithm[1]) == pytest.approx(0.03, rel=1e-6)


def test_what_goes_in_is_stored_or_lost_in_the_slower_dashpot() -> None:
    """Work = ½E(ε − ε_d)² + ∫σ²/(η·a_T); and a self-heating law around it takes that very loss as heat."""
    shifted = wlf(maxwell(modulus=1e6, viscosity=5e3), 243.15)
    law = SelfHeating(
        members=(("cold", shifted),), heat=HeatBalance(heat_capacity=1e5, cooling=0.0, softening=0.0)
    )
    times = np.linspace(0.0, 1.0, 8001)
    trace = run(
        pulled(law=law), times, lambda t: 0.2 * math.sin(11 * t), lambda t: 2.2 * math.cos(11 * t), 1e-10
    )
    work = cumulative_simpson(trace["rubber.force"] * trace["grip.speed"], x=times, initial=0.0) / VOLUME
    stress = trace["rubber.law.stress"]
    lost = cumulative_simpson(stress**2 / (5e3 * factor(243.15)), x=times, initial=0.0)
    assert np.max(np.abs(work - stress**2 / 2e6 - lost)) < 1e-6 * np.max(work)
    assert 1e5 * trace["rubber.law.warming"] == pytest.approx(lost, rel=1e-6, abs=1e-6 * lost[-1])
    assert lost[-1] > 0.2 * np.max(work)


def test_what_has_no_clock_is_not_shifted() -> None:
    """Fillers slide by strain, not by time: the same loop at any temperature."""
    times = np.linspace(0.0, 1.0, 401)
    fillers = SlidingFillers(modulus=1e6, yield_stress=5e4)
    # In series the share of the fillers' rate is an unknown of its own.
    for law in (fillers, series(spring=LinearElastic(modulus=2e6), fillers=fillers)):
        loops = [
            run(
                pulled(law=each),
                times,
                lambda t: 0.2 * math.sin(9 * t),
                lambda t: 1.8 * math.cos(9 * t),
                1e-10,
            )
            for each in (law, wlf(law, 233.15))
        ]
        assert loops[1]["rubber.force"] == pytest.approx(loops[0]["rubber.force"], rel=1e-5, abs=1e-4)


def test_the_pole_is_named() -> None:
    with pytest.raises(ValueRangeError, match=r"temperature = 150 K: must lie above .* 151\.55 K"):
        wlf(LinearElastic(modulus=1e6), 150.0)


def test_a_law_that_cools_in_real_time_is_not_shifted() -> None:
    inside = SelfHeating(
        members=(("law", LinearElastic(modulus=1e6)),),
        heat=HeatBalance(heat_capacity=1e6, cooling=1e4, softening=0.0),
    )
    with pytest.raises(ArrangementError, match=r"WlfShift member 'law'.*real time.*inside the self-heating"):
        wlf(inside, 273.15)
