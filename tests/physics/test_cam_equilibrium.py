"""The elastic law cut out of a flat model against networks written by hand and against long waits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from nlsdesign.components import (
    Assembly,
    Dashpot,
    Element,
    Fixed,
    Inertia,
    LinearElastic,
    Spring,
    TwoSidedCam,
    ViscousMaterial,
    parallel,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import elastic_law, equilibrium_torque
from nlsdesign.foundation.errors import ArrangementError, UnknownNameError
from nlsdesign.model import flatten
from nlsdesign.simulation import simulate
from tests.cam_cases import CONCAVE, CONVEX, actuator

PLACES = np.array([0.0, 0.1e-3, 0.7e-3, 3e-3, 9e-3])


def bench(element: Element, *, pretension: float = 0.0) -> Assembly:
    cam = TwoSidedCam(lever_arm=(0.008, 0.009, 0.010, 0.011, 0.012, 0.013), last_angle=1.0, elements=2.0)
    spring = tie(through(cam, rubber=element, pretension=pretension), "wheel", "load")
    return assembly("bench", wheel=Inertia(inertia=1e-3), load=Fixed(), spring=spring)


def concave(extension: np.ndarray) -> np.ndarray:
    stretch = 1 + extension / 12.5e-3
    return 84.56 * (stretch - stretch**-2)


def test_relaxation_carries_nothing_at_rest() -> None:
    law = elastic_law(flatten(actuator(CONCAVE, pretension=2e-3)), "spring")
    assert law.element == "spring.rubber"
    assert law.specimens == ("spring.rubber",)
    assert law.force(PLACES) == pytest.approx(concave(PLACES), rel=1e-12, abs=1e-12)
    stretch = 1 + PLACES / 12.5e-3
    assert law.stiffness(PLACES) == pytest.approx(84.56 / 12.5e-3 * (1 + 2 * stretch**-3), rel=1e-12)


def test_strain_and_stress_are_nominal() -> None:
    law = elastic_law(flatten(actuator(CONVEX)), "spring")
    force, _, strain, stress = (float(item) for item in law.function(3e-3, law.numbers)[:4])
    assert strain == pytest.approx(0.24)
    assert stress == pytest.approx(force / 1e-4)


def test_several_relaxations_in_one_network() -> None:
    """A standard solid in series with a Kelvin–Voigt element: at rest two springs in series."""
    solid = parallel(
        spring=Spring(stiffness=4e3),
        branch=series(spring=Spring(stiffness=9e3), dashpot=Dashpot(damping=20.0)),
    )
    voigt = parallel(spring=Spring(stiffness=6e3), dashpot=Dashpot(damping=5.0))
    law = elastic_law(flatten(bench(series(solid=solid, voigt=voigt))), "spring")
    assert law.force(PLACES) == pytest.approx(PLACES / (1 / 4e3 + 1 / 6e3), rel=1e-12, abs=1e-12)
    assert law.specimens == ()


def test_compliant_cable_in_series_with_curved_rubber() -> None:
    rubber = specimen(area=1e-4, rest_length=12.5e-3, stiff=CONCAVE)
    law = elastic_law(flatten(bench(series(cable=Spring(stiffness=5e4), rubber=rubber))), "spring")
    by_hand = [brentq(lambda f, e=e: concave(e - f / 5e4) - f, -1.0, 500.0, xtol=1e-13) for e in PLACES]
    assert law.force(PLACES) == pytest.approx(by_hand, rel=1e-9, abs=1e-9)


def test_a_curved_spring_behind_a_dashpot_still_relaxes_to_nothing() -> None:
    """The branch's rest is found by Newton's method, since its law is not linear."""
    branch = series(spring=CONCAVE, dashpot=ViscousMaterial(viscosity=3e3))
    rubber = specimen(area=1e-4, rest_length=12.5e-3, stiff=LinearElastic(modulus=1e6), relaxing=branch)
    law = elastic_law(flatten(bench(rubber)), "spring")
    assert law.force(PLACES) == pytest.approx(1e6 * 1e-4 / 12.5e-3 * PLACES, rel=1e-9, abs=1e-9)


def test_torque_is_what_is_left_after_a_long_wait() -> None:
    """The wheel is let go against a steady torque; where it comes to rest the law must give that torque."""
    rubber = specimen(
        area=1e-4,
        rest_length=12.5e-3,
        stiff=CONVEX,
        relaxing=series(spring=LinearElastic(modulus=5e5), dashpot=ViscousMaterial(viscosity=1e5)),
        damping=ViscousMaterial(viscosity=2e5),
    )
    model = flatten(bench(rubber, pretension=1e-3))
    time = np.linspace(0.0, 20.0, 201)
    trace = simulate(model, time, inputs={"wheel.torque": lambda t: 2.0})
    rest = trace["wheel.angle"][-1]
    assert 0.1 < rest < 0.9
    assert equilibrium_torque(model, "spring", [rest])[0] == pytest.approx(2.0, rel=1e-5)
    # Before that the relaxing branch still carried something.
    assert abs(equilibrium_torque(model, "spring", [trace["wheel.angle"][2]])[0] - 2.0) > 0.01


def test_the_order_of_the_bodies_and_negative_angles_do_not_matter() -> None:
    model = flatten(actuator(CONVEX, pretension=1e-3))
    torque = equilibrium_torque(model, "spring", [-0.5, -0.1, 0.0, 0.1, 0.5])
    assert torque == pytest.approx(-torque[::-1], abs=1e-12)
    assert torque[4] > torque[3] > 0.0


def test_what_is_no_cam_spring_is_named() -> None:
    model = flatten(actuator(CONVEX))
    with pytest.raises(UnknownNameError, match=r"cam spring 'sprung'.*did you mean 'spring'"):
        elastic_law(model, "sprung")
    with pytest.raises(UnknownNameError, match="spring 'springs'"):
        equilibrium_torque(model, "springs", [0.1])


def test_a_wheel_has_the_law_too() -> None:
    """Any element behind a cam; a second one cannot be, since through() takes one."""
    law = elastic_law(flatten(bench(Spring(stiffness=4e3), pretension=2e-3)), "spring")
    assert law.force(2e-3) == pytest.approx(8.0)
    with pytest.raises(ArrangementError, match="exactly one stands behind a cam"):
        through(
            TwoSidedCam(lever_arm=(0.01,) * 6, last_angle=1.0),
            a=Spring(stiffness=1.0),
            b=Spring(stiffness=1.0),
        )
