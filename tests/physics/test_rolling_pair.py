"""Two cams that roll on one another, by other roads than their law.

Independent roads: profiles as the envelope of the lines half way between two pivots, rolled on one another by
equal arcs and opposite tangents; splines of scipy; moments about the contact; energies.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from nlsdesign.components import Driven, RollingPair, Spring, through, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import MachinedPair, contour_of_cam
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import NlsError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests.rolled import rolled_on, through_points, way_of

ROW = (0.0, 0.0, 0.004, 0.007, 0.005, 0.0, -0.004, -0.005, -0.002)
END, BASE, STIFF, PULLED = 1.3, 0.16, 3e3, 6e-3
NUMBERS = {"lever_arm": ROW, "last_angle": END, "base_distance": BASE}
PAIR = RollingPair(**NUMBERS, changeover=1e-6)  # type: ignore[arg-type]


def drive(cam: RollingPair) -> FlatModel:
    spring = tie(through(cam, pretension=PULLED, k=Spring(stiffness=STIFF)), "shaft")
    return flatten(assembly("a", shaft=Driven(), s=spring))


def envelope(half_distances: Array, directions: Array) -> Array:
    """Where each of the lines with a normal and a distance from the origin crosses the next, shape (n, 2)."""
    normals = np.column_stack([np.sin(directions), np.cos(directions)])
    pairs = np.stack([normals[:-1], normals[1:]], axis=1)
    return np.linalg.solve(pairs, np.column_stack([half_distances[:-1], half_distances[1:]])[..., None])[
        ..., 0
    ]


def test_a_profile_that_rolls_on_its_mirror_image_moves_its_pivot_as_the_law_says() -> None:
    """In the frame of one cam the other pivot goes round at half the angle, the contact half way between."""
    law, model = way_of(PAIR), drive(PAIR)
    assert law(np.linspace(0.0, END, 200)).min() < -3e-3, "the lever arm changes its sign"
    angles = np.linspace(-END, END, 6001)
    distances = BASE + np.array([law.integrate(0.0, abs(angle)) for angle in angles])
    profile = through_points(envelope(distances / 2.0, angles / 2.0))
    rolled = rolled_on(profile, profile, np.linspace(0.0, 0.047, 15))
    assert rolled.angles[-1] < -0.9 * END, "clockwise, as the contact goes"
    for turned, distance, arm in zip(rolled.angles, rolled.distances, rolled.arms, strict=True):
        found = model.evaluate([], [-turned, 0.0])
        assert BASE + found["s.k.extension"] - PULLED == pytest.approx(distance, abs=2e-7)
        # The element pulls along the line of the pivots, and the cams turn about their contact.
        assert found["s.torque"] == pytest.approx(found["s.k.force"] * -arm, abs=2e-4)


def test_both_sides_are_mirror_images_and_the_work_is_that_of_the_element() -> None:
    model = drive(PAIR)
    front, back = (model.evaluate([], [angle, 0.0]) for angle in (0.7, -0.7))
    assert front["s.torque"] == -back["s.torque"]
    assert front["s.k.extension"] == back["s.k.extension"]
    turning = {
        "shaft.angle": lambda t: 0.65 * (1.0 - math.cos(2.0 * t)),
        "shaft.speed": lambda t: 1.3 * math.sin(2.0 * t),
    }
    run = simulate(model, np.linspace(0.0, 1.5, 3001), inputs=turning)
    work = cumulative_simpson(run["s.torque"] * run["shaft.speed"], x=run.time, initial=0.0)
    stored = STIFF / 2.0 * (run["s.k.extension"] ** 2 - PULLED**2)
    assert work == pytest.approx(stored, abs=1e-6 * stored.max())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lever_arm": (0.0, 0.001, 0.002)}, "a contour needs at least 5"),
        ({"base_distance": 1e-3}, "distance of the two pivots at angle zero must lie in"),
    ],
)
def test_what_is_no_pair_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(NlsError, match=words):
        RollingPair(**{**NUMBERS, **change})  # type: ignore[arg-type]


def test_a_hollow_profile_is_refused_with_its_place_and_the_least_distance_that_mends_it() -> None:
    """By the second differences of the distance: mirror images are convex while d/2 + 2·d″ is positive."""
    law = way_of(PAIR)
    angles = np.linspace(0.0, END, 2001)
    taken = np.array([law.integrate(0.0, angle) for angle in angles])
    needed = -taken[1:-1] - 4.0 * np.diff(taken, 2) / (angles[1] - angles[0]) ** 2

    def part(base: float) -> None:
        made = replace(PAIR, base_distance=quantity(base, "m"))
        MachinedPair(edge_tolerance=1e-6).part(contour_of_cam(made, points=1001))

    with pytest.raises(
        ValueRangeError, match=r"is hollow, with a radius of .* both cams would meet"
    ) as refused:
        part(0.8 * float(needed.max()))
    (place,) = re.findall(r"edge at ([0-9.]+)°", str(refused.value))
    (more,) = re.findall(r"larger by ([0-9.]+) mm", str(refused.value))
    assert math.radians(float(place)) == pytest.approx(angles[1 + int(np.argmax(needed))], abs=3e-3)
    assert 1e-3 * float(more) == pytest.approx(0.2 * float(needed.max()), rel=0.01)
    part(1.05 * float(needed.max()))
