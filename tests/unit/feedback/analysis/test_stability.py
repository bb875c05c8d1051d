"""Eigenvalues and stiffness at rest against textbook formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.components import ROTATION, Dashpot, Inertia, Spring, parallel, series, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.analysis import Stability, over_angle
from nlsdesign.model import flatten
from tests import observed as ob

INERTIA, STIFF, DAMPING = 2e-3, 5.0, 0.04


def test_an_oscillator_has_its_textbook_eigenvalues() -> None:
    law = parallel(
        spring=Spring(stiffness=STIFF, domain=ROTATION), dashpot=Dashpot(damping=DAMPING, domain=ROTATION)
    )
    model = flatten(assembly("swing", motor=Inertia(inertia=INERTIA), spring=tie(law, "motor")))
    chart = over_angle(model, [Stability()], angles=[0.0, 0.4])
    omega = np.sqrt(STIFF / INERTIA)
    ratio = DAMPING / (2.0 * np.sqrt(STIFF * INERTIA))
    assert chart["free.damping_ratio"] == pytest.approx([ratio] * 2)
    assert chart["free.decay"] == pytest.approx([-ratio * omega] * 2)
    frequency = omega * np.sqrt(1.0 - ratio**2) / (2.0 * np.pi)
    assert chart["free.frequency"] == pytest.approx([frequency] * 2)
    assert chart["stiffness.slow"] == pytest.approx([STIFF] * 2)
    assert chart["stiffness.fast"] == pytest.approx([STIFF] * 2)


def test_a_relaxing_branch_is_stiff_only_when_moved_fast() -> None:
    branch = series(
        spring=Spring(stiffness=3.0, domain=ROTATION), dashpot=Dashpot(damping=0.5, domain=ROTATION)
    )
    law = parallel(spring=Spring(stiffness=STIFF, domain=ROTATION), relaxing=branch)
    model = flatten(assembly("swing", motor=Inertia(inertia=INERTIA), spring=tie(law, "motor")))
    chart = over_angle(model, [Stability()], angles=[0.2])
    assert chart["stiffness.slow"][0] == pytest.approx(STIFF)
    assert chart["stiffness.fast"][0] == pytest.approx(STIFF + 3.0)
    assert chart.words["free.stability"] == ("stable or at its limit",)


@pytest.mark.parametrize("state", ["strain", "force"])
def test_the_stiffness_of_the_cam_does_not_depend_on_the_state(state: str) -> None:
    """dT/dθ = N·(h²·K + h'·F) slow; with the relaxing modulus added to K when fast."""
    model = ob.bench(ob.SLOW)
    chart = over_angle(
        ob.on_relaxing_force(model) if state == "force" else model, [Stability()], angles=[0.5]
    )
    at, step = model.evaluate([0.5, 0.0, 0.0]), 1e-5
    arms = [model.evaluate([0.5 + s, 0.0, 0.0])["spring.cam.lever_arm_now"] for s in (-step, step)]
    arm, bend = at["spring.cam.lever_arm_now"], (arms[1] - arms[0]) / (2.0 * step)
    force, slope = ob.equilibrium_force(at[ob.EXTENSION]), ob.stiffness(at[ob.EXTENSION])
    slow = ob.ELEMENTS * (arm**2 * slope + bend * force)
    assert chart["stiffness.slow"][0] == pytest.approx(slow, rel=1e-6)
    assert chart["stiffness.fast"][0] == pytest.approx(
        slow + ob.ELEMENTS * arm**2 * ob.STIFF * ob.RELAXING, rel=1e-6
    )


def test_negative_stiffness_is_called_unstable() -> None:
    # Such as gravity on an upright pendulum; no component has it, so the number is negated in the model.
    model = flatten(
        assembly(
            "swing",
            motor=Inertia(inertia=INERTIA),
            spring=tie(parallel(a=Spring(stiffness=1.0, domain=ROTATION)), "motor"),
        )
    )
    turned = tuple(
        replace(v, start=-v.start) if v.name.endswith("stiffness") else v for v in model.parameters
    )
    flipped = replace(model, parameters=turned)
    chart = over_angle(flipped, [Stability()], angles=[0.0])
    assert chart["free.decay"][0] == pytest.approx(np.sqrt(1.0 / INERTIA))
    assert chart.words["free.stability"] == ("unstable",)
