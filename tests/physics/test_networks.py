"""Named networks and the springpot against textbook formulas in time and frequency.

Independent roads: complex moduli, creep and relaxation as printed in Tschoegl 1989 and Findley 1976; for the
springpot the power law and the Mittag-Leffler function, by its integral over a spectrum.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson, quad
from scipy.special import erfcx, gamma

from nlsdesign.components import (
    Element,
    LinearElastic,
    Springpot,
    StrainStiffening,
    burgers,
    generalised_maxwell,
    kelvin_voigt,
    maxwell,
    parallel,
    series,
    standard_linear_solid,
)
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model.linear import linearise
from tests.stretched import AREA, LENGTH, VOLUME, pulled, run

E0, E1, ETA, FLOW, E2, ETA2 = 0.92e6, 0.58e6, 31e3, 2e5, 0.4e6, 9e3
MODULI, RELAXATION = (0.3e6, 0.2e6, 0.1e6), (0.01, 0.1, 1.0)

NAMED: dict[str, tuple[Element, Callable[[complex], complex]]] = {
    "Kelvin and Voigt": (kelvin_voigt(modulus=E0, viscosity=ETA), lambda s: E0 + s * ETA),
    "Maxwell": (maxwell(modulus=E1, viscosity=ETA), lambda s: 1 / (1 / E1 + 1 / (s * ETA))),
    "standard linear solid": (
        standard_linear_solid(E0, modulus=E1, viscosity=ETA),
        lambda s: (E0 * E1 + s * ETA * (E0 + E1)) / (E1 + s * ETA),
    ),
    "Burgers": (
        burgers(modulus=E0, flow=FLOW, delayed_modulus=E2, delayed_viscosity=ETA2),
        lambda s: 1 / (1 / E0 + 1 / (s * FLOW) + 1 / (E2 + s * ETA2)),
    ),
    "generalised Maxwell": (
        generalised_maxwell(E0, moduli=MODULI, times=RELAXATION),
        lambda s: E0 + sum(e * s * t / (1 + s * t) for e, t in zip(MODULI, RELAXATION, strict=True)),
    ),
}


def complex_modulus(law: Element, frequency: float) -> complex:
    """E* of a law by the frequency response of the piece at rest."""
    model = pulled(law=law)
    linear = linearise(model, model.start(model.states))
    s = 2j * math.pi * frequency
    drive = np.array([[1.0], [s]])
    inner = np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B @ drive)
    return complex((linear.C @ inner + linear.D @ drive)[0, 0]) * LENGTH / AREA


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("frequency", [0.02, 1.0, 30.0])
def test_complex_modulus_of_the_named_networks(name: str, frequency: float) -> None:
    law, expected = NAMED[name]
    assert complex_modulus(law, frequency) == pytest.approx(expected(2j * math.pi * frequency), rel=1e-9)


def test_the_published_law_is_a_standard_linear_solid() -> None:
    law = standard_linear_solid(StrainStiffening(modulus=(E0,), knots=(0.0,)), modulus=E1, viscosity=ETA)
    model = pulled(law=law)
    assert [v.name for v in model.states] == ["rubber.law.relaxing.dashpot.strain"]
    assert "rubber.law.stiff.knots[1]" in model.values


def test_the_loss_tangent_of_the_standard_linear_solid_peaks_where_its_docstring_says() -> None:
    law = NAMED["standard linear solid"][0]
    peak = E1 / ETA * math.sqrt(E0 / (E0 + E1)) / (2 * math.pi)
    loss = [
        complex_modulus(law, f).imag / complex_modulus(law, f).real for f in (0.98 * peak, peak, 1.02 * peak)
    ]
    assert loss[1] > max(loss[0], loss[2])


TIMES = np.linspace(0.0, 2.0, 201)


def test_generalised_maxwell_relaxes_as_its_prony_series() -> None:
    found = run(pulled(law=NAMED["generalised Maxwell"][0]), TIMES, lambda t: 0.1, lambda t: 0.0, 1e-11)
    sums = sum(e * np.exp(-TIMES / t) for e, t in zip(MODULI, RELAXATION, strict=True))
    assert found["rubber.force"] == pytest.approx(AREA * 0.1 * (E0 + sums), rel=1e-8)


def sls_creep(t: np.ndarray) -> np.ndarray:
    late = ETA * (E0 + E1) / (E0 * E1)
    return 1 / E0 - E1 / (E0 * (E0 + E1)) * np.exp(-t / late)


def burgers_creep(t: np.ndarray) -> np.ndarray:
    return 1 / E0 + t / FLOW - np.expm1(-t * E2 / ETA2) / E2


@pytest.mark.parametrize(
    ("name", "creep"), [("standard linear solid", sls_creep), ("Burgers", burgers_creep)]
)
def test_along_the_creep_curve_the_stress_stays(name: str, creep: Callable[[np.ndarray], np.ndarray]) -> None:
    stress, step = 5e4, 1e-6

    def strain(t: float) -> float:
        return stress * float(creep(np.array(t)))

    found = run(
        pulled(law=NAMED[name][0]), TIMES, strain,
        lambda t: (strain(t + step) - strain(t)) / step, 1e-10,
    )  # fmt: skip
    assert found["rubber.force"] == pytest.approx(np.full(len(TIMES), AREA * stress), rel=2e-6)


# --- springpot ------------------------------------------------------------------------------------


def springpot(order: float, lower: float = 0.01, upper: float = 100.0) -> Springpot:
    return Springpot(modulus=1e6, reference=3.0, order=order, lower=lower, upper=upper)


@settings(max_examples=settings.default.max_examples // 2, deadline=None)
@given(st.floats(0.02, 0.95), st.floats(-3.0, 0.0), st.floats(1.0, 4.0), st.floats(0.0, 1.0))
def test_the_stated_error_bounds_the_error_inside_the_band(
    order: float, low: float, decades: float, place: float
) -> None:
    """|E* − c·(iω)^α| ≤ stated error·|E*| at any frequency of the band, by the linearised flat model."""
    law = springpot(order, 10**low, 10 ** (low + decades))
    frequency = 10 ** (low + place * decades)
    coefficient = 1e6 / (2 * math.pi * 3.0) ** order
    exact = coefficient * (2j * math.pi * frequency) ** order
    found = complex_modulus(law, frequency)
    assert abs(found / exact - 1) <= law.largest_error * 1.01 + 1e-9
    assert law.largest_error < 0.02
    assert found == pytest.approx(complex(law.complex_modulus(np.array([frequency]))[0]), rel=1e-8)


def test_the_stated_error_is_reached_and_grows_with_the_band() -> None:
    wide, narrow = springpot(0.3, 1e-4, 1e4), springpot(0.3)
    assert wide.largest_error > 3 * narrow.largest_error
    assert f"largest error {100 * wide.largest_error:.2g} %" in wide.title()
    band = np.geomspace(1e-4, 1e4, 1501)
    exact = 1e6 * (1j * band / 3.0) ** 0.3
    assert np.max(np.abs(wide.complex_modulus(band) / exact - 1)) == pytest.approx(
        wide.largest_error, rel=0.01
    )


def test_outside_its_band_the_springpot_is_a_dashpot_below_and_a_spring_above() -> None:
    law = springpot(0.3)
    slow, fast = (law.complex_modulus(np.array([f, 2 * f])) for f in (1e-7, 1e7))
    assert abs(slow[1] / slow[0]) == pytest.approx(2.0, rel=1e-6)
    assert abs(fast[1] / fast[0]) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("order", [0.1, 0.5, 0.8])
def test_a_step_relaxes_by_a_power_law(order: float) -> None:
    """σ(t) = c·ε·t^(−α)/Γ(1 − α) for times well inside the band."""
    law = springpot(order, 0.005, 500.0)
    times = np.concatenate([[0.0], np.geomspace(2e-3, 5.0, 60)])
    found = run(pulled(law=law), times, lambda t: 0.1, lambda t: 0.0)["rubber.force"][1:]
    coefficient = 1e6 / (2 * math.pi * 3.0) ** order
    expected = AREA * coefficient * 0.1 * times[1:] ** -order / gamma(1 - order)
    assert found == pytest.approx(expected, rel=2 * law.largest_error)
    assert 2 * law.largest_error < 0.02


def mittag_leffler(order: float, x: float) -> float:
    """E_α(−x^α) as the integral over its relaxation spectrum (Mainardi 2010), for 0 < α < 1."""

    def spectrum(log: float) -> float:
        r = math.exp(log)
        bottom = r ** (2 * order) + 2 * r**order * math.cos(order * math.pi) + 1
        return r**order * math.exp(-r * x) * math.sin(order * math.pi) / math.pi / bottom

    return float(quad(spectrum, -60.0, 30.0, limit=500)[0])


def test_the_integral_of_the_test_itself_is_right() -> None:
    assert mittag_leffler(0.5, 0.7) == pytest.approx(float(erfcx(math.sqrt(0.7))), rel=1e-9)


@pytest.mark.parametrize("order", [0.25, 0.5])
def test_a_spring_and_a_springpot_in_series_relax_by_the_mittag_leffler_function(order: float) -> None:
    """Fractional Maxwell element: σ/(E·ε) = E_α(−(t/τ)^α) with τ^α = c/E."""
    pot = springpot(order, 1e-3, 1e3)
    law = series(spring=LinearElastic(modulus=1.5e6), pot=pot)
    times = np.concatenate([[0.0], np.geomspace(1e-2, 10.0, 40)])
    found = run(pulled(law=law), times, lambda t: 0.1, lambda t: 0.0)["rubber.force"][1:]
    tau = (1e6 / (2 * math.pi * 3.0) ** order / 1.5e6) ** (1 / order)
    expected = [AREA * 1.5e6 * 0.1 * mittag_leffler(order, t / tau) for t in times[1:]]
    assert found == pytest.approx(np.array(expected), rel=2 * pot.largest_error)


def test_the_loss_angle_is_flat_over_the_band() -> None:
    """tan δ = tan(α·π/2) at every frequency of the band."""
    for order in (0.05, 0.2, 0.5):
        law = springpot(order)
        values = law.complex_modulus(np.geomspace(0.01, 100.0, 50))
        angle = np.angle(values)
        assert np.max(np.abs(angle - order * math.pi / 2)) < law.largest_error


def test_work_on_a_springpot_is_stored_or_lost() -> None:
    """∮: work = Σ ½Eᵢ(ε − εᵢ)² + ∫Σ (Eᵢ/yᵢ)·ε̇ᵢ², branch by branch from the states alone."""
    law = springpot(0.2)
    times = np.linspace(0.0, 1.0, 8001)
    found = run(
        pulled(law=parallel(pot=law)), times,
        lambda t: 0.1 * math.sin(9 * t), lambda t: 0.9 * math.cos(9 * t), 1e-10,
    )  # fmt: skip
    strain = found["rubber.law.pot.strain"]
    work = cumulative_simpson(found["rubber.force"] * found["grip.speed"], x=times, initial=0.0)
    stored, lost, total = np.zeros_like(times), np.zeros_like(times), np.zeros_like(times)
    frequencies = np.geomspace(1e-4, 1e4, 40)
    # Moduli and rates of the branches, found again from the complex modulus alone.
    matrix = []
    rates = branch_rates()
    for rate in rates:
        s = 2j * math.pi * frequencies
        column = s / (s + rate)
        matrix.append(np.concatenate([column.real, column.imag]))
    seen = law.complex_modulus(frequencies)
    moduli = np.linalg.lstsq(np.array(matrix).T, np.concatenate([seen.real, seen.imag]), rcond=None)[0]
    for number, (modulus, rate) in enumerate(zip(moduli, rates, strict=True), start=1):
        stretch = strain - found[f"rubber.law.pot.branch_{number}"]
        stored += modulus / 2 * stretch**2
        lost += cumulative_simpson(modulus * rate * stretch**2, x=times, initial=0.0)
        total += modulus * stretch
    assert AREA * total == pytest.approx(found["rubber.force"], rel=1e-5, abs=1e-5)
    assert np.max(np.abs(work - VOLUME * (stored + lost))) < 1e-4 * np.max(np.abs(work))
    assert lost[-1] > 0.1 * np.max(stored)


def branch_rates() -> np.ndarray:
    """Half a decade beyond 0.01 to 100 Hz, ten cells; the tails by their first two moments, order 0.2."""
    low, high = 2 * math.pi * 0.01 / math.sqrt(10), 2 * math.pi * 100 * math.sqrt(10)
    edges = np.geomspace(low, high, 11)
    return np.concatenate([[low * 0.2 / 1.2], np.sqrt(edges[1:] * edges[:-1]), [high * 1.8 / 0.8]])


def test_a_band_that_does_not_rise_and_series_of_unequal_length_are_named() -> None:
    with pytest.raises(ValueRangeError, match="band must rise"):
        springpot(0.3, 10.0, 10.0)
    with pytest.raises(ValueRangeError, match=r"moduli \(2\) and times \(1\)"):
        generalised_maxwell(1e6, moduli=(1e5, 2e5), times=(0.1,))
