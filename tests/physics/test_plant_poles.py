"""Poles of the plant sliding and stuck against matrices typed by hand, and sharp against smooth friction."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from nlsdesign.components import (
    ROTATION,
    CoulombFriction,
    Dashpot,
    Inertia,
    LoadFriction,
    Regularised,
    Spring,
    parallel,
    series,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import Assembly, assembly
from nlsdesign.feedback.analysis import (
    Stability,
    empirical_gramian,
    over_angle,
    rank_drops,
    rest_points,
    sampled_poles,
)
from nlsdesign.feedback.analysis.sweep import least_damped
from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.feedback.observer.scheduling.scheduled import error_matrices
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.locations import folder
from nlsdesign.model import FlatModel, flatten

J, K, BRANCH, ETA, VISCOUS, LEVEL, CREEP = 2e-3, 5.0, 3.0, 0.04, 1e-3, 0.02, 0.02


def rubbing(friction: CoulombFriction | None, **more: object) -> FlatModel:
    """An inertia on a standard linear solid, with dry friction."""
    branch = series(
        spring=Spring(stiffness=BRANCH, domain=ROTATION), dashpot=Dashpot(damping=ETA, domain=ROTATION)
    )
    law = parallel(spring=Spring(stiffness=K, domain=ROTATION), relaxing=branch)
    parts = {
        "body": Inertia(inertia=J),
        "spring": tie(law, "body"),
        "bearing": tie(Dashpot(damping=VISCOUS, domain=ROTATION), "body"),
        **({"rub": tie(friction, "body")} if friction else {}),
        **more,
    }
    return flatten(assembly("rubbing", **parts), outputs=["body.angle", "spring.torque"])


def sliding_by_hand() -> np.ndarray:
    """States angle, speed, angle of the dashpot z: J·ω̇ = −K·θ − k·(θ − z) − b·ω, η·ż = k·(θ − z)."""
    return np.array(
        [
            [0.0, 1.0, 0.0],
            [-(K + BRANCH) / J, -VISCOUS / J, BRANCH / J],
            [BRANCH / ETA, 0.0, -BRANCH / ETA],
        ]
    )


def sorted_(values: np.ndarray) -> np.ndarray:
    return np.sort_complex(np.asarray(values, complex))


@pytest.mark.parametrize(
    "friction",
    [
        CoulombFriction(sliding_effort=LEVEL),
        CoulombFriction(sliding_effort=LEVEL, contact=Regularised(creep_speed=CREEP)),
        CoulombFriction(sliding_effort=LEVEL, contact=Regularised(creep_speed=1e-5)),
    ],
    ids=["sharp", "smooth", "nearly sharp"],
)
def test_sliding_is_the_plant_without_the_corner_and_stuck_what_relaxes(friction: CoulombFriction) -> None:
    points = rest_points(rubbing(friction), np.array([0.0, 0.4, -0.7]), angle="body.angle")
    sliding, stuck = points.modes
    assert (sliding.name, stuck.name) == ("sliding", "stuck")
    for found in sliding.eigenvalues:
        assert sorted_(found) == pytest.approx(sorted_(np.linalg.eigvals(sliding_by_hand())), rel=1e-9)
    # Held, the dashpot relaxes against the branch alone.
    assert stuck.eigenvalues == pytest.approx(np.full((3, 1), -BRANCH / ETA), rel=1e-9)


def test_poles_of_a_sampled_system_are_those_that_it_samples() -> None:
    step, a = 1e-3, sliding_by_hand()
    radius, sampled = sampled_poles(np.array([expm(a * step)] * 2), step)
    eigenvalues = np.linalg.eigvals(a)
    assert radius == pytest.approx(np.exp(step * np.max(eigenvalues.real)))
    expected = [float(each[0]) for each in least_damped(eigenvalues[None])]
    assert [float(each[1]) for each in sampled] == pytest.approx(expected, rel=1e-9)
    assert expected[1] == pytest.approx(np.max(eigenvalues.imag) / (2.0 * np.pi))


def test_the_error_of_an_observer_has_its_poles_over_the_angle() -> None:
    """The cascade leaves the memory of the rubber to its own decay, −k/η."""
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    observer = design_observer(model, gain=CascadeGain(), grid=FixedGrid(-0.9, 0.9, points=61))
    matrices = error_matrices(observer, np.radians([-40.0, 0.0, 5.0, 40.0]))
    _, (decay, _, _) = sampled_poles(matrices, 1e-3)
    assert decay == pytest.approx(np.full(4, -1.479e6 / 21e3), rel=1e-6)


def test_without_dry_friction_there_is_one_mode() -> None:
    (free,) = rest_points(rubbing(None), np.array([0.1]), angle="body.angle").modes
    assert free.name == "free"
    assert sorted_(free.eigenvalues[0]) == pytest.approx(
        sorted_(np.linalg.eigvals(sliding_by_hand())), rel=1e-9
    )


@pytest.mark.parametrize("contact", [None, Regularised(creep_speed=CREEP)], ids=["sharp", "smooth"])
def test_two_bodies_that_rub_on_each_other_stick_together(contact: Regularised | None) -> None:
    """Stuck they are one body of both inertias; the other body's friction does not hold it to the frame."""
    given = {} if contact is None else {"contact": contact}
    second, law = 3e-3, CoulombFriction(sliding_effort=LEVEL, **given)
    parts = {
        "body": Inertia(inertia=J),
        "rim": Inertia(inertia=second),
        "spring": tie(Spring(stiffness=K, domain=ROTATION), "body"),
        "holder": tie(Spring(stiffness=1.0, domain=ROTATION), "rim"),
        "rub": tie(law, "body", "rim"),
    }
    model = flatten(assembly("two", **parts), outputs=["body.angle"])
    modes = rest_points(model, np.array([0.1]), angle="body.angle").modes
    assert [mode.name for mode in modes] == ["sliding", "stuck"]
    apart = [1j * np.sqrt(K / J), 1j * np.sqrt(1.0 / second)]
    assert sorted_(modes[0].eigenvalues[0]) == pytest.approx(
        sorted_(np.array([*apart, *np.conj(apart)])), rel=1e-9, abs=1e-6
    )
    together = 1j * np.sqrt((K + 1.0) / (J + second))
    assert sorted_(modes[1].eigenvalues[0]) == pytest.approx(
        sorted_(np.array([together, -together])), rel=1e-6, abs=1e-4
    )


def test_friction_that_grows_with_the_load_has_another_stiffness_in_each_direction() -> None:
    """T = K·θ·(1 ± µ) for a positive load."""
    share = 0.2
    inside = (("spring", Spring(stiffness=K, domain=ROTATION)),)
    law = LoadFriction(ratio=share, contact=Regularised(creep_speed=CREEP), members=inside)
    model = flatten(assembly("geared", body=Inertia(inertia=J), spring=tie(law, "body")))
    ahead, back = rest_points(model, np.array([0.3]), angle="body.angle").modes[:2]
    for mode, sign in ((ahead, 1.0), (back, -1.0)):
        expected = np.sqrt(K * (1.0 + sign * share) / J)
        assert np.max(mode.eigenvalues.imag) == pytest.approx(expected, rel=1e-9), mode.name


def declared(deck: str) -> Assembly:
    return declare(load_deck(deck))


def numbers(deck: str) -> dict[str, dict]:
    return tomllib.loads((folder("models") / "decks" / f"{deck}.toml").read_text(encoding="utf8"))


def by_hand(deck: str, model: FlatModel, angle: float) -> np.ndarray:
    """States angle, speed, strain of the dashpot, from the numbers of the deck; the lever arm from the model.

    J·ω̇ = −N·h·F − b·ω, F = A·(Σkᵢ*·⟨ε − εᵢ⟩ + k·(ε − z)), η·ż = k·(ε − z), ε = δ/L₀, dδ/dθ = h.
    """
    table = numbers(deck)
    rubber, cam = table["spring"]["rubber"], table["spring"]["cam"]
    area, length = rubber["area"]["value"] * 1e-4, rubber["rest_length"]["value"] * 1e-3
    moduli = 1e6 * np.array(rubber["stiff"]["modulus"]["value"])
    knots = np.array(rubber["stiff"]["knots"]["value"])
    k = 1e6 * rubber["relaxing"]["spring"]["modulus"]["value"]
    eta = rubber["relaxing"]["dashpot"]["viscosity"]["value"]
    inertia, damping = table["motor"]["inertia"]["value"], table["bearing"]["damping"]["value"]
    step = 1e-6
    at = [model.evaluate([angle + s, 0.0, 0.0]) for s in (-step, 0.0, step)]
    before, arm, after = (each["spring.cam.lever_arm_now"] for each in at)
    strain = at[1]["spring.rubber.extension"] / length
    force = area * float(np.sum(moduli * np.maximum(strain - knots, 0.0)))
    slope = area / length * (float(np.sum(moduli[knots < strain])) + k)
    count = cam["elements"]["value"]
    fast = count * (arm**2 * slope + (after - before) / (2.0 * step) * force)
    return np.array(
        [
            [0.0, 1.0, 0.0],
            [-fast / inertia, -damping / inertia, count * arm * area * k / inertia],
            [k / eta * arm / length, 0.0, -k / eta],
        ]
    )


@pytest.mark.parametrize("deck", ["austin2015_as_printed", "austin2015_figure_consistent"])
def test_poles_of_the_published_actuator(deck: str) -> None:
    model = flatten(declare(load_deck(deck)), outputs=["motor.angle", "spring.torque"])
    angles = np.radians([-31.0, 1.0, 5.5, 25.0, 45.0])
    sliding, stuck = rest_points(model, angles, angle="motor.angle").modes
    for angle, found in zip(angles, sliding.eigenvalues, strict=True):
        expected = np.linalg.eigvals(by_hand(deck, model, angle))
        assert sorted_(found) == pytest.approx(sorted_(expected), rel=1e-5), np.degrees(angle)
    relaxing = numbers(deck)["spring"]["rubber"]["relaxing"]
    rate = 1e6 * relaxing["spring"]["modulus"]["value"] / relaxing["dashpot"]["viscosity"]["value"]
    assert stuck.eigenvalues == pytest.approx(np.full((5, 1), -rate), rel=1e-9)


def test_the_plant_swings_where_the_smoothed_corner_creeps() -> None:
    """Reviewed by hand: −4.6 ± 114i 1/s at 45°, 1.9 Hz at 1°; the corner has −6.9 1/s and no oscillation."""
    model = flatten(
        declare(load_deck("austin2015_figure_consistent")), outputs=["motor.angle", "spring.torque"]
    )
    chart = over_angle(model, [Stability()], angles=np.radians([1.0, 45.0]))
    assert chart["sliding.decay"][1] == pytest.approx(-4.6, abs=0.05)
    assert 2.0 * np.pi * chart["sliding.frequency"] == pytest.approx([12.2, 114.4], abs=0.1)
    assert chart["sliding.damping_ratio"] == pytest.approx([0.11, 0.04], abs=0.002)
    corner = rest_points(model, np.radians([45.0]), angle="motor.angle").a[0]
    assert np.max(np.linalg.eigvals(corner).real) == pytest.approx(-6.9, abs=0.05)


def test_the_angle_of_lost_rank_is_found_between_the_angles_of_a_sweep() -> None:
    model = flatten(declared("austin2015_as_printed"))
    for angles in (np.radians([-3.0, 2.0, 45.0]), np.radians(np.linspace(-40.0, 41.0, 60))):
        found = rank_drops(model, angles=angles)
        (drop,) = found.drops
        assert abs(drop.first) < 1e-9
        assert drop.isolated
        assert drop.cause == "spring.cam.lever_arm_now"
        assert drop.unseen.words == "spring.rubber.relaxing.dashpot.strain"
        assert drop.unseen.eigenvalues == pytest.approx([-0.58e6 / 411.0])
        assert found.detectable
        assert "at 0° (spring.cam.lever_arm_now is zero), decays with -1.41e+03 1/s" in str(found)


def test_a_dead_zone_hides_the_memory_over_a_range_up_to_where_the_lever_arm_begins() -> None:
    model = flatten(declared("one_sided_cable_drive"))
    found = rank_drops(model, angles=np.radians(np.linspace(-31.0, 53.0, 37)))
    (drop,) = found.drops
    assert drop.open_ended
    assert not drop.isolated
    assert drop.first == pytest.approx(np.radians(-31.0))
    arms = [
        model.evaluate([drop.last + step, 0.0, 0.0])["spring.cam.lever_arm_now"] for step in (-1e-8, 1e-8)
    ]
    assert arms[0] <= 1e-9 < arms[1]
    assert drop.unseen.eigenvalues == pytest.approx([-29.0])


def test_a_rank_that_only_comes_near_a_drop_is_no_drop() -> None:
    """Two outputs, θ and θ + 1e-3·z: the memory is seen at zero angle too, if badly."""
    model = flatten(declared("austin2015_figure_consistent"))
    names = ["motor.angle", "spring.rubber.relaxing.stress"]
    found = rank_drops(model, angles=np.radians(np.linspace(-40.0, 41.0, 60)), measured=names)
    assert found.drops == ()
    assert found.detectable


def test_what_neither_is_seen_nor_decays_is_not_detectable() -> None:
    """Only the deflection of two bodies is measured: where both stand is never known."""
    spring = tie(Spring(stiffness=K, domain=ROTATION), "body", "rim")
    model = flatten(assembly("pair", body=Inertia(inertia=J), rim=Inertia(inertia=J), spring=spring))
    found = rank_drops(model, angles=[0.0, 0.1, 0.2], measured=["spring.angle"], angle="body.angle")
    assert not found.detectable
    (drop,) = found.drops
    assert (drop.first, drop.last) == (0.0, 0.2)
    assert drop.unseen.eigenvalues == pytest.approx([0.0, 0.0], abs=1e-6)
    assert "does not decay (eigenvalue 0): not detectable" in str(found)
    assert "verdict: NOT detectable from spring.angle" in str(found)
    assert "measure" in str(found)


def test_the_empirical_gramian_of_a_linear_model_is_the_gramian() -> None:
    a, horizon = sliding_by_hand(), 0.05
    times = np.linspace(0.0, horizon, 2001)
    model = rubbing(None)
    sizes = {"body.angle": 0.3, "body.speed": 20.0, "spring.relaxing.dashpot.angle": 0.2}
    found = empirical_gramian(model, times, measured=["body.angle"], sizes=sizes)
    order = [list(sizes).index(name) for name in found.states]
    scale = np.diag([list(sizes.values())[i] for i in order])
    own = a[np.ix_(order, order)]
    row = np.array([[1.0 if n == "body.angle" else 0.0 for n in found.states]]) @ scale / 0.3

    def product(t: float) -> np.ndarray:
        seen = row @ np.linalg.inv(scale) @ expm(own * t) @ scale
        return seen.T @ seen

    expected = quad_vec(product, 0.0, horizon, epsrel=1e-9)[0]
    assert found.matrix == pytest.approx(expected, rel=1e-4, abs=1e-9)
    assert found.condition == pytest.approx(np.linalg.cond(expected), rel=1e-2)


def test_at_rest_in_the_dead_zone_a_motion_shows_nothing_of_the_memory() -> None:
    model = flatten(declared("one_sided_cable_drive"))
    times = np.linspace(0.0, 0.05, 51)
    found = empirical_gramian(model, times, start={"motor.angle": -0.5})
    assert found.condition == np.inf
    assert found.weakest == "spring.cable.rope.rubber.relaxing.dashpot.strain"
