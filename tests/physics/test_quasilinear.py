"""Relaxation by the same shares at every strain, against the hereditary integral that Fung writes.

Independent road: σ(t) = ∫ G(t − s) dσ_e(s) with G(t) = 1 + Σ gᵢ·e^(−t/τᵢ) and the neo-Hookean stress
µ·(λ − λ⁻²), by quadrature on a fine grid; small motions and losses by the complex factor written out here.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.components import (
    LinearElastic,
    NeoHooke,
    QuasilinearRelaxation,
    ViscousMaterial,
    parallel,
    series,
)
from tests.stretched import AREA, pulled, run

MODULUS, SHARES, TIMES = 0.4e6, (0.5, 0.2), (0.05, 0.6)
GUM = QuasilinearRelaxation(members=(("gum", NeoHooke(shear_modulus=MODULUS)),), shares=SHARES, times=TIMES)


def still(strain: np.ndarray) -> np.ndarray:
    return MODULUS * ((1.0 + strain) - (1.0 + strain) ** -2)


def factor(frequency: float) -> complex:
    turn = 2j * math.pi * frequency
    return 1.0 + sum(g * turn * tau / (1.0 + turn * tau) for g, tau in zip(SHARES, TIMES, strict=True))


def test_the_stress_is_the_hereditary_integral() -> None:
    times = np.linspace(0.0, 1.0, 2001)
    strain = 0.8 * (1.0 - np.cos(2.0 * math.pi * 1.5 * times)) * times
    rate = np.gradient(strain, times)
    found = run(
        pulled(law=GUM), times,
        lambda t: 0.8 * (1.0 - math.cos(3.0 * math.pi * t)) * t,
        lambda t: 0.8 * (1.0 - math.cos(3.0 * math.pi * t) + 3.0 * math.pi * t * math.sin(3.0 * math.pi * t)),
    )["rubber.force"] / AREA  # fmt: skip
    assert np.max(np.abs(rate)) > 1.0, "fast against both times"
    steps = np.diff(still(strain))
    middle = 0.5 * (times[1:] + times[:-1])
    wanted = [
        np.sum(
            steps[:k]
            * (1.0 + sum(g * np.exp(-(t - middle[:k]) / tau) for g, tau in zip(SHARES, TIMES, strict=True)))
        )
        for k, t in enumerate(times)
    ]
    assert found == pytest.approx(np.array(wanted), abs=2e-4 * np.max(wanted))


@pytest.mark.parametrize("strain", [0.1, 1.0])
def test_a_small_motion_has_the_same_loss_tangent_at_every_strain(strain: float) -> None:
    frequency, size = 2.0, 1e-3
    turn = 2.0 * math.pi * frequency
    times = np.linspace(0.0, 8.0, 16001)
    trace = run(
        pulled(law=GUM), times,
        lambda t: strain + size * math.sin(turn * t), lambda t: size * turn * math.cos(turn * t),
    )  # fmt: skip
    last = times >= 7.0
    wave = trace["rubber.force"][last][:-1] / AREA
    found = 2j * np.mean(wave * np.exp(-1j * turn * times[last][:-1])) / size
    tangent = MODULUS * (1.0 + 2.0 * (1.0 + strain) ** -3)
    assert found == pytest.approx(tangent * factor(frequency), rel=2e-3)
    # The work of a cycle is the area of its ellipse, π·E″·ε².
    moved = size * np.sin(turn * times[last])
    force = np.append(wave, wave[0])
    lost = np.sum((force[1:] + force[:-1]) / 2.0 * np.diff(moved)) / frequency
    assert lost == pytest.approx(math.pi * tangent * factor(frequency).imag * size**2, rel=5e-3)


def test_around_a_linear_law_it_is_a_prony_series() -> None:
    modulus = 1e6
    made = QuasilinearRelaxation(
        members=(("spring", LinearElastic(modulus=modulus)),), shares=SHARES, times=TIMES
    )
    branches = {
        f"b{i}": series(s=LinearElastic(modulus=g * modulus), d=ViscousMaterial(viscosity=g * modulus * tau))
        for i, (g, tau) in enumerate(zip(SHARES, TIMES, strict=True))
    }
    network = parallel(still=LinearElastic(modulus=modulus), **branches)
    times = np.linspace(0.0, 1.0, 501)
    path = (lambda t: 0.3 * math.sin(9.0 * t), lambda t: 2.7 * math.cos(9.0 * t))
    one, other = (run(pulled(law=law), times, *path)["rubber.force"] for law in (made, network))
    assert one == pytest.approx(other, abs=1e-6 * np.max(other))


def test_no_closed_path_wins_energy() -> None:
    """From rest, the work put in is never negative."""
    times = np.linspace(0.0, 2.0, 4001)
    turns, sizes = (3.1, 7.7), (0.4, 0.2)
    trace = run(
        pulled(law=GUM), times,
        lambda t: sum(a * (1.0 - math.cos(2.0 * math.pi * w * t)) for a, w in zip(sizes, turns, strict=True)),
        lambda t: sum(
            a * 2.0 * math.pi * w * math.sin(2.0 * math.pi * w * t) for a, w in zip(sizes, turns, strict=True)
        ),
    )  # fmt: skip
    force, way = trace["rubber.force"], trace["grip.position"]
    work = np.cumsum((force[1:] + force[:-1]) / 2.0 * np.diff(way))
    assert np.min(work) > -1e-6 * np.max(work)
