"""Laws given by their energy: stress against the energy, limits, order between laws, ranges.

Independent roads: energies typed here from the papers in the principal stretches; work as the integral of the
stress by quadrature (``scipy.integrate.quad``); moduli at small strain by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from nlsdesign.components import ExtendedTube, Hyperelastic, NeoHooke, Ogden, Yeoh
from nlsdesign.foundation.errors import ValueRangeError
from tests.stretched import pulled, stress_at

MODULI, EXPONENTS = (0.618e6, 1.18e3, -9.81e3), (1.3, 5.0, -2.0)
LAWS: dict[str, Hyperelastic] = {
    "neo-Hooke": NeoHooke(shear_modulus=0.39e6),
    "Yeoh": Yeoh(c1=0.2e6, c2=-1.9e3, c3=45.0),
    "Ogden": Ogden(moduli=MODULI, exponents=EXPONENTS),
    "extended tube": ExtendedTube(crosslinks=0.1867e6, entanglements=0.2169e6, release=0.2, end=0.09693),
}


def neo_hooke_energy(stretches: np.ndarray) -> float:
    """Treloar: the entropy of Gaussian chains."""
    return 0.39e6 / 2 * float(np.sum(stretches**2 - 1.0))


def yeoh_energy(stretches: np.ndarray) -> float:
    first = float(np.trace(np.diag(stretches) @ np.diag(stretches))) - 3.0
    return sum(c * first**power for c, power in ((0.2e6, 1), (-1.9e3, 2), (45.0, 3)))


def ogden_energy(stretches: np.ndarray) -> float:
    return sum(m / a * float(np.sum(stretches**a) - 3.0) for m, a in zip(MODULI, EXPONENTS, strict=True))


def extended_tube_energy(stretches: np.ndarray) -> float:
    """Kaliske and Heinrich 1999, with the deviatoric invariant D = Σλ²."""
    d, delta, beta = float(np.sum(stretches**2)), 0.09693, 0.2
    linked = (1 - delta**2) * (d - 3) / (1 - delta**2 * (d - 3)) + math.log(1 - delta**2 * (d - 3))
    return 0.1867e6 / 2 * linked + 2 * 0.2169e6 / beta**2 * float(np.sum(stretches**-beta - 1.0))


ENERGY: dict[str, Callable[[np.ndarray], float]] = {
    "neo-Hooke": neo_hooke_energy,
    "Yeoh": yeoh_energy,
    "Ogden": ogden_energy,
    "extended tube": extended_tube_energy,
}
MODULUS = {
    "neo-Hooke": 3 * 0.39e6,
    "Yeoh": 6 * 0.2e6,
    "Ogden": 1.5 * sum(m * a for m, a in zip(MODULI, EXPONENTS, strict=True)),
    "extended tube": 3 * (0.1867e6 * (1 - 2 * 0.09693**2) + 0.2169e6),
}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("strain", [-0.35, 0.05, 0.4, 2.0, 4.5])
def test_work_put_in_is_the_energy_of_the_paper(name: str, strain: float) -> None:
    """∫σ dε from rest equals W(λ, λ^(−1/2), λ^(−1/2))."""
    model = pulled(law=LAWS[name])
    work = quad(lambda e: float(stress_at(model, [e])[0]), 0.0, strain, epsrel=1e-10)[0]
    stretch = 1.0 + strain
    expected = ENERGY[name](np.array([stretch, stretch**-0.5, stretch**-0.5]))
    assert work == pytest.approx(expected, rel=1e-8)
    assert work > 0.0


@pytest.mark.parametrize("name", LAWS)
def test_at_small_strain_the_modulus_is_three_times_the_shear_modulus(name: str) -> None:
    model = pulled(law=LAWS[name])
    low, rest, high = stress_at(model, [-1e-5, 0.0, 1e-5])
    assert rest == pytest.approx(0.0, abs=1e-6)
    assert (high - low) / 2e-5 == pytest.approx(MODULUS[name], rel=1e-7)


@settings(max_examples=settings.default.max_examples)
@given(st.floats(-0.5, 4.0), st.floats(1e4, 1e7))
def test_ogden_and_yeoh_contain_neo_hooke(strain: float, modulus: float) -> None:
    """One pair with the exponent 2, and a cubic without square and cube, are neo-Hooke: μ·(λ − λ⁻²)."""
    expected = modulus * (1 + strain - (1 + strain) ** -2)
    for law in (
        NeoHooke(shear_modulus=modulus),
        Ogden(moduli=(modulus,), exponents=(2.0,)),
        Yeoh(c1=modulus / 2, c2=0.0, c3=0.0),
    ):
        found = stress_at(pulled(law=law), [strain])[0]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * modulus)


def test_a_tube_without_end_and_entanglements_tends_to_neo_hooke() -> None:
    strains = np.linspace(-0.4, 1.0, 15)
    expected = stress_at(pulled(law=NeoHooke(shear_modulus=0.3e6)), strains)
    off = []
    for end in (0.1, 0.01):
        law = ExtendedTube(crosslinks=0.3e6, entanglements=0.0, release=0.5, end=end)
        off.append(np.max(np.abs(stress_at(pulled(law=law), strains) - expected)))
    assert off[1] < off[0] / 90, "the difference falls with the square of the inextensibility"
    assert off[1] < 1e-3 * np.max(np.abs(expected))


def test_the_range_of_the_tube_ends_before_its_chains_do() -> None:
    law = LAWS["extended tube"]
    stretch = 1.0 + law.valid[1]
    assert 0.09693**2 * (stretch**2 + 2 / stretch - 3) == pytest.approx(0.9, rel=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_in_its_range_the_stress_rises_with_the_strain(name: str) -> None:
    low, high = LAWS[name].valid
    assert low < 0.0 < high
    assert np.all(np.diff(stress_at(pulled(law=LAWS[name]), np.linspace(low, high, 200))) > 0.0)


def test_pairs_that_soften_are_named() -> None:
    with pytest.raises(ValueRangeError, match=r"modulus -1000 Pa with exponent 2: .*positive"):
        Ogden(moduli=(1e6, -1e3), exponents=(1.3, 2.0))
    with pytest.raises(ValueRangeError, match=r"moduli \(2\) and exponents \(1\)"):
        Ogden(moduli=(1e6, 1e3), exponents=(1.3,))
    with pytest.raises(ValueRangeError, match="shear modulus"):
        NeoHooke(shear_modulus=-0.4e6)
