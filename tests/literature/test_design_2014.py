"""The cam of Schepelmann, Geberth and Geyer, "Compact Nonlinear Springs with User Defined Torque-Deflection
Profiles for Series Elastic Actuators", ICRA 2014: 5 N·m at 53°, c = 1, two rubber elements.

Printed: a largest cam radius of 17 mm and a largest rubber force of 147 N.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import Domain
from nlsdesign.components.core.element import MATERIAL, Scope
from nlsdesign.components.core.springs import Elastic
from nlsdesign.design import design_cam
from nlsdesign.foundation.symbolic import Expression
from tests.cam_cases import ALONE, CONCAVE, CONTOUR, KEEP, PRETENSION, RUBBER, TARGET, NeoHooke, actuator
from tests.closed_form import energy_profile

# Average tensile curve of PMC-770, ICRA 2014, Fig. 3: stretch, force in N of an element of 1 cm² and 12.5 mm.
TENSILE = np.array(
    [
        [1.0206, 11.4], [1.0552, 21.7], [1.1012, 33.0], [1.1473, 42.2], [1.1934, 51.5], [1.2971, 68.9],
        [1.4123, 85.9], [1.4930, 96.2], [1.6082, 110.6], [1.8156, 134.2], [2.0229, 156.8], [2.2303, 176.9],
        [2.4032, 189.2], [2.5990, 203.6], [2.7949, 213.9], [3.0023, 222.1],
    ]
)  # fmt: skip
AREA = 1e-4


@dataclass(frozen=True, kw_only=True)
class Measured(Elastic):
    """The points of the tensile curve joined by straight lines from the origin."""

    @property
    def domain(self) -> Domain:
        return MATERIAL

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        strains = np.concatenate([[0.0], TENSILE[:, 0] - 1.0])
        slopes = np.diff(np.concatenate([[0.0], TENSILE[:, 1]])) / AREA / np.diff(strains)
        changes = np.diff(np.concatenate([[0.0], slopes]))
        bends = zip(changes, strains[:-1], strict=True)
        return sum((float(k) * ca.fmax(motion - float(at), 0) for k, at in bends), start=ca.SX(0))


def neo_hookean_fit() -> NeoHooke:
    """One modulus by least squares over the curve up to three times the length."""
    shape = TENSILE[:, 0] - TENSILE[:, 0] ** -2
    return NeoHooke(modulus=float(shape @ TENSILE[:, 1] / (shape @ shape)) / AREA)


def test_the_table_is_that_of_the_published_points(shared_folder: object) -> None:
    published = np.loadtxt(
        f"{shared_folder}/paper/icra2014_fig03_tensile_average.csv", delimiter=",", skiprows=1
    )
    for stretch, force in TENSILE:
        there = np.abs(published[:, 0] - stretch) < 1e-3
        assert force == pytest.approx(published[there, 1].mean(), abs=0.06)


def test_closed_form_with_the_neo_hookean_reading_of_the_curve() -> None:
    """17.42 mm, 144 N and 11.98 mm were computed for this target before; one modulus is fitted, not these."""
    profile = energy_profile(actuator(neo_hookean_fit()), target=TARGET)
    # The modulus depends by 1 % on where the fit ends, and the three numbers by less than half of that.
    assert profile.lever_arms[-1] == pytest.approx(17.42e-3, rel=5e-3)
    assert profile.forces[-1] == pytest.approx(143.5, rel=5e-3)
    assert profile.extensions[-1] == pytest.approx(11.98e-3, rel=5e-3)


def test_closed_form_with_the_measured_curve() -> None:
    """The curve itself, which the neo-Hookean law does not quite meet, stretches the rubber less far."""
    profile = energy_profile(actuator(Measured()), target=TARGET)
    # Trapezoids over the published points, without the package: energy of one element is 0.9806 J.
    energy = np.concatenate([[0.0], TENSILE[:, 1]])
    extension = np.concatenate([[0.0], TENSILE[:, 0] - 1.0]) * 12.5e-3
    stored = np.concatenate([[0.0], np.cumsum((energy[1:] + energy[:-1]) / 2 * np.diff(extension))])
    fine = np.linspace(0.0, extension[-1], 20001)
    force = np.interp(fine, extension, energy)
    work = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(fine))])
    assert work[-1] == pytest.approx(stored[-1], rel=1e-6)
    needed = float(TARGET.energy(TARGET.last_angle)) / 2
    assert profile.extensions[-1] == pytest.approx(np.interp(needed, work, fine), rel=1e-5)
    assert profile.extensions[-1] == pytest.approx(11.33e-3, rel=5e-3)
    # Printed 17 mm and 147 N, two digits read off a drawing and a rubber that scatters by 15 %.
    assert profile.lever_arms[-1] == pytest.approx(17e-3, rel=0.03)
    assert profile.forces[-1] == pytest.approx(147.0, rel=0.03)


# The neo-Hookean reading. Rms over the angle; an average over the contour's nodes would give 268 and 24 mN·m
# for the first two, because near zero, where the error is largest, nodes lie closer together.
@pytest.mark.long_cases("contour", "and rubber")
@pytest.mark.parametrize(
    ("free", "least", "most"),
    [
        (CONTOUR, 0.240, 0.246),  # halving or doubling the number of nodes moves it by 1 mN·m
        (PRETENSION, 0.0215, 0.0230),
        (RUBBER, 0.0, 5e-5),
    ],
    ids=["contour", "and pretension", "and rubber"],
)
def test_joint_design(free: list[str], least: float, most: float) -> None:
    found = design_cam(actuator(CONCAVE), target=TARGET, free=free, keep=KEEP, settings=ALONE)
    assert least <= found.rms <= most
    assert found.rms == pytest.approx(found.predicted_rms, rel=5e-3, abs=1e-5)
    assert found.contour.radii_of_curvature.min() >= 1e-3 - 1e-9
    assert found.contour.radii.max() <= 20e-3 + 1e-8
    strains = [state.value for state in found.limits if state.limit == "MaximumStrain"]
    assert len(strains) == 1
    assert strains[0] <= 1.0 + 1e-7


def test_an_earlier_design_with_this_rubber_is_confirmed() -> None:
    """128 mm², 12.6 mm and a pretension of 5.97 mm meet the target with ρ between 2.6 and 12.6 mm."""
    rubber = {
        "spring.rubber.area": 128e-6,
        "spring.rubber.rest_length": 12.6e-3,
        "spring.pretension": 5.97e-3,
    }
    machine = actuator(CONCAVE).with_values(rubber)
    found = design_cam(machine, target=TARGET, free=CONTOUR, keep=KEEP, settings=ALONE)
    assert found.rms < 5e-5
    # Radii of curvature are second derivatives: the torque hardly feels a tenth of them.
    assert found.contour.radii_of_curvature.min() == pytest.approx(2.6e-3, rel=0.1)
    assert found.contour.radii_of_curvature.max() == pytest.approx(12.6e-3, rel=0.1)
