"""Each law and wrapper against its closed form.

Independent roads: the textbook solutions of relaxation, creep and harmonic loading (Tschoegl 1989, Findley
1976), typed here. Creep is tested backwards: the grip is moved along the closed-form creep curve, and the
force has to stay what it was.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Buckling,
    CoulombFriction,
    Dashpot,
    Driven,
    Element,
    Fixed,
    GearedMotor,
    LinearElastic,
    Regularised,
    Rounded,
    Spring,
    StrainStiffening,
    ViscousMaterial,
    parallel,
    pull_only,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.linear import linearise, rest_state
from nlsdesign.simulation import simulate

AREA, LENGTH = 1e-4, 0.0125
STIFF, SOFT, VISCOSITY = 0.92e6, 0.58e6, 31e3
TIMES = np.linspace(0.0, 0.4, 81)


def pulled(**laws: Element) -> FlatModel:
    return flatten(
        assembly(
            "pulled",
            grip=Driven(domain=TRANSLATION),
            rubber=tie(specimen(area=AREA, rest_length=LENGTH, **laws), "grip"),
        ),
        outputs=["rubber.force"],
    )


def force(
    model: FlatModel,
    motion: Callable[[float], float],
    rate: Callable[[float], float],
    times: np.ndarray = TIMES,
) -> np.ndarray:
    drive = {"grip.position": motion, "grip.speed": rate}
    return simulate(model, times, inputs=drive, tolerance=1e-11)["rubber.force"]


def maxwell() -> Element:
    return series(spring=LinearElastic(modulus=SOFT), dashpot=ViscousMaterial(viscosity=VISCOSITY))


# --- relaxation -----------------------------------------------------------------------------------


def test_maxwell_relaxes_exponentially_with_viscosity_over_modulus() -> None:
    strain = 0.2
    found = force(pulled(branch=maxwell()), lambda t: strain * LENGTH, lambda t: 0.0)
    expected = AREA * SOFT * strain * np.exp(-TIMES * SOFT / VISCOSITY)
    assert found == pytest.approx(expected, rel=1e-8)
    slope = np.polyfit(TIMES, np.log(found), 1)[0]
    assert -1 / slope == pytest.approx(VISCOSITY / SOFT, rel=1e-7)


def test_standard_linear_solid_relaxes_to_its_equilibrium() -> None:
    strain = 0.2
    model = pulled(still=LinearElastic(modulus=STIFF), branch=maxwell())
    found = force(model, lambda t: strain * LENGTH, lambda t: 0.0)
    expected = AREA * strain * (STIFF + SOFT * np.exp(-TIMES * SOFT / VISCOSITY))
    assert found == pytest.approx(expected, rel=1e-9)
    held = model.with_values({"grip.position": strain * LENGTH})
    rest = held.evaluate(list(rest_state(held, {})))
    assert rest["rubber.force"] == pytest.approx(AREA * strain * STIFF, rel=1e-9)


def test_two_maxwell_branches_superpose() -> None:
    second = series(spring=LinearElastic(modulus=3e5), dashpot=ViscousMaterial(viscosity=2e3))
    found = force(pulled(one=maxwell(), two=second), lambda t: 0.1 * LENGTH, lambda t: 0.0)
    expected = AREA * 0.1 * (SOFT * np.exp(-TIMES * SOFT / VISCOSITY) + 3e5 * np.exp(-TIMES * 3e5 / 2e3))
    assert found == pytest.approx(expected, rel=1e-8)


def test_a_ramp_on_maxwell() -> None:
    """σ = η·ε̇·(1 − e^(−kt/η))."""
    speed = 0.7
    found = force(pulled(branch=maxwell()), lambda t: speed * LENGTH * t, lambda t: speed * LENGTH)
    expected = AREA * VISCOSITY * speed * -np.expm1(-TIMES * SOFT / VISCOSITY)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-9)


# --- creep, backwards -----------------------------------------------------------------------------

LOAD = 20.0
STRESS = LOAD / AREA


def creep_of_standard_linear_solid(t: float) -> float:
    slow = VISCOSITY * (STIFF + SOFT) / (STIFF * SOFT)
    return STRESS * (1 / STIFF - SOFT / (STIFF * (STIFF + SOFT)) * math.exp(-t / slow))


def creep_of_kelvin_voigt(t: float) -> float:
    return STRESS / STIFF * -math.expm1(-t * STIFF / VISCOSITY)


def creep_of_burgers(t: float) -> float:
    return STRESS * (1 / STIFF + t / 2e5 - math.expm1(-t * SOFT / VISCOSITY) / SOFT)


CREEP = {
    "standard linear solid": (
        {"still": LinearElastic(modulus=STIFF), "branch": maxwell()},
        creep_of_standard_linear_solid,
    ),
    "Kelvin and Voigt": (
        {"spring": LinearElastic(modulus=STIFF), "dashpot": ViscousMaterial(viscosity=VISCOSITY)},
        creep_of_kelvin_voigt,
    ),
    "Burgers": (
        {
            "chain": series(
                spring=LinearElastic(modulus=STIFF),
                flow=ViscousMaterial(viscosity=2e5),
                late=parallel(
                    spring=LinearElastic(modulus=SOFT), dashpot=ViscousMaterial(viscosity=VISCOSITY)
                ),
            )
        },
        creep_of_burgers,
    ),
}


@pytest.mark.parametrize("name", CREEP)
def test_along_the_creep_curve_the_force_is_constant(name: str) -> None:
    laws, creep = CREEP[name]

    def rate(t: float) -> float:
        step = 1e-5
        if t < step:
            return (-1.5 * creep(t) + 2 * creep(t + step) - 0.5 * creep(t + 2 * step)) / step
        return (creep(t + step) - creep(t - step)) / (2 * step)

    found = force(pulled(**laws), lambda t: LENGTH * creep(t), lambda t: LENGTH * rate(t))
    # The rate is a difference quotient: a relative 1e-7 of the viscous part.
    assert found == pytest.approx(np.full(len(TIMES), LOAD), rel=3e-7)


# --- complex modulus ------------------------------------------------------------------------------

MODULI: dict[str, tuple[dict[str, Element], Callable[[complex], complex]]] = {
    "Kelvin and Voigt": (
        {"k": LinearElastic(modulus=STIFF), "c": ViscousMaterial(viscosity=VISCOSITY)},
        lambda s: STIFF + s * VISCOSITY,
    ),
    "Maxwell": ({"m": maxwell()}, lambda s: SOFT * s * VISCOSITY / (SOFT + s * VISCOSITY)),
    "standard linear solid": (
        {"k": LinearElastic(modulus=STIFF), "m": maxwell()},
        lambda s: STIFF + SOFT * s * VISCOSITY / (SOFT + s * VISCOSITY),
    ),
    "Burgers": (
        CREEP["Burgers"][0],
        lambda s: 1 / (1 / STIFF + 1 / (2e5 * s) + 1 / (SOFT + s * VISCOSITY)),
    ),
}


@pytest.mark.parametrize("name", MODULI)
@pytest.mark.parametrize("frequency", [0.1, 1.0, 4.0, 9.0, 200.0])
def test_complex_modulus(name: str, frequency: float) -> None:
    laws, modulus = MODULI[name]
    s = 2j * math.pi * frequency
    model = pulled(**laws)
    linear = linearise(model, model.start(model.states))
    inner = np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B @ np.array([[1.0], [s]]))
    found = (linear.C @ inner + linear.D @ np.array([[1.0], [s]]))[0, 0]
    assert found * LENGTH / AREA == pytest.approx(modulus(s), rel=1e-9)


def test_loss_tangent_of_a_simulated_cycle_is_that_of_the_complex_modulus() -> None:
    """Time domain against frequency domain: ∮F de = π·E''·ε²·V over a steady cycle."""
    frequency, strain = 4.0, 0.1
    model = pulled(**MODULI["standard linear solid"][0])
    times = np.linspace(0.0, 2.0, 8001)
    w = 2 * math.pi * frequency
    run = simulate(
        model,
        times,
        tolerance=1e-10,
        inputs={
            "grip.position": lambda t: strain * LENGTH * math.sin(w * t),
            "grip.speed": lambda t: strain * LENGTH * w * math.cos(w * t),
        },
    )
    last = slice(-1001, None)
    work = np.trapezoid(run["rubber.force"][last] * run["grip.speed"][last], times[last])
    loss = MODULI["standard linear solid"][1](1j * w).imag
    assert work == pytest.approx(math.pi * loss * strain**2 * AREA * LENGTH, rel=1e-6)


# --- elastic laws ---------------------------------------------------------------------------------

KNOTS = (0.0, 0.016, 0.0848)
ENGAGED = (0.92e6, 0.58e6, 0.74e6)


@given(st.floats(-0.5, 1.5))
def test_strain_stiffening_is_the_sum_of_engaged_springs(strain: float) -> None:
    law = pulled(law=StrainStiffening(modulus=ENGAGED, knots=KNOTS))
    expected = sum(k * max(strain - at, 0.0) for k, at in zip(ENGAGED, KNOTS, strict=True))
    found = law.evaluate([], [strain * LENGTH, 0.0])["rubber.force"]
    assert found == pytest.approx(AREA * expected, rel=1e-12, abs=1e-12)


@given(st.floats(-0.3, 1.0), st.floats(-4.0, -1.0))
def test_smooth_strain_stiffening_stays_within_its_bound(strain: float, width: float) -> None:
    """|σ_smooth − σ_sharp| ≤ w·ln 2·Σk for ε ≥ 0, the slope rises with the strain, and σ(0) = 0."""
    w = 10.0**width
    smooth = pulled(law=StrainStiffening(modulus=ENGAGED, knots=KNOTS, contact=Rounded(width=w)))
    values = [
        smooth.evaluate([], [e * LENGTH, 0.0])["rubber.force"] / AREA for e in (0.0, strain, strain + 1e-4)
    ]
    assert abs(values[0]) < 1e-9
    assert values[2] - values[1] >= 0.92e6 * 1e-4 * (1 - 1e-6)
    if strain >= 0.0:
        sharp = sum(k * max(strain - at, 0.0) for k, at in zip(ENGAGED, KNOTS, strict=True))
        assert abs(values[1] - sharp) <= w * math.log(2.0) * sum(ENGAGED[1:]) * (1 + 1e-9)


def test_smooth_law_tends_to_the_sharp_one() -> None:
    strains = np.linspace(0.0, 0.3, 61)
    errors = []
    for width in (1e-2, 1e-3, 1e-4):
        smooth = pulled(law=StrainStiffening(modulus=ENGAGED, knots=KNOTS, contact=Rounded(width=width)))
        sharp = pulled(law=StrainStiffening(modulus=ENGAGED, knots=KNOTS))
        errors.append(
            max(
                abs(
                    smooth.evaluate([], [e * LENGTH, 0])["rubber.force"]
                    - sharp.evaluate([], [e * LENGTH, 0])["rubber.force"]
                )
                for e in strains
            )
        )
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


# --- shafts and cables ----------------------------------------------------------------------------


@given(st.floats(-3.0, 3.0))
def test_dry_friction_saturates_and_always_takes_power(speed: float) -> None:
    made = assembly(
        "a",
        shaft=Driven(),
        rub=tie(CoulombFriction(sliding_effort=0.4, contact=Regularised(creep_speed=0.02)), "shaft"),
    )
    torque = flatten(made).evaluate([], [0.0, speed])["rub.torque"]
    assert torque == pytest.approx(0.4 * math.tanh(speed / 0.02), rel=1e-12, abs=1e-15)
    assert abs(torque) <= 0.4
    assert torque * speed >= 0.0


@given(st.floats(-0.05, 0.05), st.floats(-0.5, 0.5))
def test_a_cable_only_pulls(extension: float, rate: float) -> None:
    inside = parallel(k=Spring(stiffness=1000.0), c=Dashpot(damping=30.0))
    made = assembly("a", grip=Driven(domain=TRANSLATION), rope=tie(pull_only(inside=inside), "grip"))
    found = flatten(made, outputs=["rope.force"]).evaluate([], [extension, rate])["rope.force"]
    sharp = max(1000.0 * extension + 30.0 * rate, 0.0)
    assert sharp <= found <= sharp + 0.1 * math.log(2.0) * (1 + 1e-12)


@given(st.floats(-0.05, 0.05), st.floats(0.0, 1.0))
def test_a_piece_that_buckles_pushes_as_a_rod_does_but_for_a_share(extension: float, share: float) -> None:
    inside = (("band", Spring(stiffness=1000.0)),)
    band = Buckling(members=inside, share=share, width=1e-3)
    made = assembly("a", grip=Driven(domain=TRANSLATION), band=tie(band, "grip"))
    found = flatten(made, outputs=["band.force"]).evaluate([], [extension, 0.0])["band.force"]
    rod = 1000.0 * extension
    assert found == pytest.approx(rod if rod > 0.0 else (1.0 - share) * rod, abs=1e-3 * math.log(2.0))


def test_motor_against_newton() -> None:
    """J·ω̇ = n·k_T·I − b·ω − k·θ, current held within its limit."""
    made = assembly(
        "m",
        motor=GearedMotor(inertia=5.97e-4, gear_ratio=4, torque_constant=0.055, current_limit=2.0),
        wall=Fixed(),
        oil=tie(Dashpot(damping=1e-3, domain=ROTATION), "motor"),
        spring=tie(Spring(stiffness=1.7, domain=ROTATION), "motor", "wall"),
    )
    model = flatten(made)
    for current, felt in ((1.5, 1.5), (5.0, 2.0), (-7.0, -2.0)):
        at = model.evaluate([0.3, -2.0], [current])
        expected = (4 * 0.055 * felt - 1e-3 * -2.0 - 1.7 * 0.3) / 5.97e-4
        assert at["der(motor.speed)"] == pytest.approx(expected, rel=1e-13)
        assert at["der(motor.angle)"] == -2.0
        assert at["wall.reaction"] == pytest.approx(-1.7 * 0.3)


def test_an_element_between_two_moving_bodies_feels_the_difference() -> None:
    inside = parallel(k=Spring(stiffness=3.0, domain=ROTATION), c=Dashpot(damping=0.2, domain=ROTATION))
    made = assembly("a", one=Driven(), other=Driven(), s=tie(inside, "one", "other"))
    at = flatten(made).evaluate([], [0.7, 5.0, 0.2, 1.0])
    assert at["s.torque"] == pytest.approx(3.0 * 0.5 + 0.2 * 4.0)
    assert at["one.reaction"] == pytest.approx(2.3)
    assert at["other.reaction"] == pytest.approx(-2.3)
