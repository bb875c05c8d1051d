"""The closed-form cam against an integrated differential equation, by hand, and at angle zero."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.components import Assembly, Element, LinearElastic, StrainStiffening
from nlsdesign.components.core.element import Scope
from nlsdesign.design import PowerTorque, elastic_law, equilibrium_torque
from nlsdesign.design.optimisation.finish import torque_check
from nlsdesign.design.statics.declared_cam import cam_from_profile
from nlsdesign.design.statics.energy import CamProfile
from nlsdesign.foundation.errors import InfeasibleError
from nlsdesign.foundation.symbolic import Expression
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, CONVEX, TARGET, actuator
from tests.closed_form import energy_profile

LAWS: dict[str, Element] = {
    "linear": LinearElastic(modulus=1.2e6),
    "concave": CONCAVE,
    "convex": CONVEX,
    "piecewise": StrainStiffening(modulus=(0.92e6, 0.58e6, 0.74e6), knots=(0.0, 0.016, 0.0848)),
}


@pytest.mark.long_cases(
    "0.0005-linear", "0.0005-concave", "0.0005-convex", "0.004-linear", "0.004-concave", "0.004-piecewise"
)
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("pretension", [0.5e-3, 4e-3])
def test_extension_solves_the_balance_of_torques(name: str, pretension: float) -> None:
    """dδ/dθ = τ/(N·F(e₀ + δ)), integrated over the angle instead of inverted over the energy."""
    machine = actuator(LAWS[name], pretension=pretension)
    profile = energy_profile(machine, target=TARGET, points=41)
    law = elastic_law(flatten(machine), "spring")

    def rate(angle: float, extension: np.ndarray) -> np.ndarray:
        return TARGET.torque(angle) / (2.0 * law.force(pretension + extension))

    # Every law here is at least continuous: the integrator may stumble over a knot, but not beyond 1e-8.
    found = solve_ivp(
        rate, (0.0, TARGET.last_angle), [0.0], t_eval=profile.angles, rtol=1e-9, atol=1e-13, max_step=0.01
    )
    assert found.success
    assert profile.extensions == pytest.approx(found.y[0], rel=1e-6, abs=1e-10)
    assert 2.0 * profile.lever_arms * profile.forces == pytest.approx(profile.torques, abs=1e-12)


@pytest.mark.parametrize("pretension", [0.0, 3e-3])
def test_linear_rubber_and_linear_target(pretension: float) -> None:
    """N·k·((e₀ + δ)² − e₀²)/2 = c·θ²/2: without pretension the cam is a round one."""
    stiffness = 1.2e6 * 1e-4 / 12.5e-3
    slope = 4.0
    target = PowerTorque(coefficient=slope, exponent=1.0, angle=0.9)
    profile = energy_profile(actuator(LAWS["linear"], pretension=pretension), target=target)
    whole = np.sqrt(pretension**2 + slope * profile.angles**2 / (2 * stiffness))
    assert profile.extensions == pytest.approx(whole - pretension, abs=1e-15)
    if pretension == 0.0:
        assert profile.lever_arms == pytest.approx(np.sqrt(slope / (2 * stiffness)), rel=1e-9)


@pytest.mark.long_cases("linear", "concave", "piecewise")
@pytest.mark.parametrize("name", LAWS)
def test_without_pretension_the_lever_arm_jumps_at_zero(name: str) -> None:
    """h(0+) = √(τ'(0)/(N·K₀)), here with the stiffness K₀ as a difference of forces."""
    machine = actuator(LAWS[name])
    law = elastic_law(flatten(machine), "spring")
    stiffness = float(law.force(1e-9)) / 1e-9
    slope = 5.0 / np.expm1(np.radians(53.0))
    profile = energy_profile(machine, target=TARGET, points=2001)
    assert profile.lever_arms[0] == pytest.approx(np.sqrt(slope / (2 * stiffness)), rel=1e-6)
    # It is the limit of what follows: the next angle is 0.46 mrad away.
    assert profile.lever_arms[1] == pytest.approx(profile.lever_arms[0], rel=1e-2)


@pytest.mark.long_cases("linear", "convex", "piecewise")
@pytest.mark.parametrize("name", LAWS)
def test_with_pretension_the_lever_arm_starts_at_zero_with_a_slope(name: str) -> None:
    """τ'(0) = N·F₀·h'(0)."""
    machine = actuator(LAWS[name], pretension=2e-3)
    profile = energy_profile(machine, target=TARGET, points=2001)
    slope = 5.0 / np.expm1(np.radians(53.0))
    assert profile.lever_arms[0] == 0.0
    first = profile.lever_arms[1] / profile.angles[1]
    assert 2.0 * float(profile.forces[0]) * first == pytest.approx(slope, rel=1e-2)


def test_stiffness_at_zero_of_a_cable_through_the_centre_without_pretension_is_zero() -> None:
    """However the contour looks: torque starts with the cube of the angle, inside the change of sides."""
    machine = actuator(CONVEX)
    model = flatten(_with_cam(machine, energy_profile(machine, target=TARGET)))
    small, smaller = equilibrium_torque(model, "spring", [2e-5, 1e-5])
    assert small / smaller == pytest.approx(8.0, rel=1e-2)
    assert smaller / 1e-5 < 1e-3 * TARGET.initial_stiffness


@pytest.mark.parametrize("law", [CONCAVE, CONVEX], ids=["concave", "convex"])
def test_declared_cam_gives_the_target(law: Element) -> None:
    """With pretension the closed form has no jump, and the assembly with that cam gives the target."""
    machine = actuator(law, pretension=3e-3)
    profile = energy_profile(machine, target=TARGET)
    check = torque_check(flatten(_with_cam(machine, profile)), target=TARGET)
    # 2e-6 m of 10 mm are what 60 control values miss of a law with knots rounded over 1 % strain.
    assert check.largest < 5.0 * 2e-6 / 10e-3
    assert check.rms < 2e-4


class Fading(LinearElastic):
    """A law whose force fades away, so that its energy is bounded."""

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        return scope.parameter("modulus") * motion / (1 + motion**2) ** 2


def test_rubber_that_is_too_weak_is_named() -> None:
    weak = PowerTorque(coefficient=4.0, exponent=1.0, angle=0.9)
    machine = actuator(Fading(modulus=1e3))
    with pytest.raises(InfeasibleError, match=r"'spring.rubber': cannot store the 0.81 J"):
        energy_profile(machine, target=weak)


def _with_cam(machine: Assembly, profile: CamProfile) -> Assembly:
    fit = cam_from_profile(profile.angles, profile.lever_arms, like=machine["spring.cam"], count=60)
    found = {"spring.cam.lever_arm": fit.cam.lever_arm, "spring.cam.last_angle": fit.cam.last_angle}
    return machine.with_values(found)
