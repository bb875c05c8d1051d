"""A one-sided cam takes up less cable over its onset, and stays behind by that from there on."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import CamDesign, DesignSettings, TabulatedTorque, design_cam

TARGET = TabulatedTorque(
    angles=tuple(np.radians([0.0, 8.0, 16.0, 24.0, 32.0, 40.0])),
    torques=(0.0, 0.2334, 0.36, 0.4977, 0.6461, 0.8),
)


def finger(*free: str) -> CamDesign:
    """Return the design of a finger of 0.8 N·m at 40°, whose lever arm jumps at angle zero."""
    settings = DesignSettings(starts=1, draws=0, look_for_size_ranges=False, look_for_remedies=False)
    declared = declare(load_template("one-sided-finger").deck)
    none = declared.quantities()["spring.pretension"].with_value(0.0, "assumed: none")
    machine = declared.with_values({"spring.pretension": none})
    names = ("spring.cam.contour", *free)
    return design_cam(machine, target=TARGET, free=names, settings=settings)


@pytest.mark.slow
def test_a_pretension_that_is_free_makes_up_for_the_travel_that_an_onset_loses() -> None:
    free = finger("spring.pretension")
    assert free.miss is None
    # Over an onset of 2° a lever arm h takes up less by h times 1°.
    arm, pretension = free.contour.lever_arms[0], free.values["spring.pretension"].number
    np.testing.assert_allclose(pretension, arm * np.radians(1.0), rtol=0.05)
    behind = free.check.angles > np.radians(4.0)
    torques = np.interp(free.check.angles[behind], free.curves.angles, free.curves.torques)
    np.testing.assert_allclose(free.check.torques[behind], torques, atol=2e-3 * TARGET.largest)
    assert not [each for each in free.remarks if "end of its range" in each]


@pytest.mark.slow
def test_one_that_is_held_is_named_as_what_would_help() -> None:
    held = finger()
    assert held.predicted_rms < 0.005 * TARGET.largest
    assert held.miss is not None
    assert "free spring.pretension" in held.miss.advice[0]
