"""Work put in = energy stored + energy lost, over simulated trajectories; no energy from nowhere.

Independent road: powers and energies are written here from textbook formulas in the signals of the trace
(½kε², ∫ of the knots, σ²/η, b·ω²) and integrated by Simpson's rule; nothing of it is asked from the package.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Dashpot,
    Driven,
    Element,
    LinearElastic,
    Mass,
    Pulley,
    Spring,
    ViscousMaterial,
    parallel,
    pull_only,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate

from .fed_by_rate import Hardening

DECKS = ("austin2015_as_printed", "austin2015_figure_consistent")


def rubber_energy(run: Trace, numbers: dict[str, np.ndarray], prefix: str = "spring.rubber") -> np.ndarray:
    """Energy in one piece of rubber: A·L·(Σ ½kᵢ⟨ε − εᵢ⟩² + ½k·ε_s²)."""
    strain = run[f"{prefix}.stiff.strain"]
    stiff = sum(
        k / 2 * np.clip(strain - at, 0.0, None) ** 2
        for k, at in zip(numbers[f"{prefix}.stiff.modulus"], numbers[f"{prefix}.stiff.knots"], strict=True)
    )
    relaxing = numbers[f"{prefix}.relaxing.spring.modulus"] / 2 * run[f"{prefix}.relaxing.spring.strain"] ** 2
    return numbers[f"{prefix}.area"] * numbers[f"{prefix}.rest_length"] * (stiff + relaxing)


def rubber_loss(run: Trace, numbers: dict[str, np.ndarray], prefix: str = "spring.rubber") -> np.ndarray:
    """Power lost in one piece of rubber: A·L·σ²/η of the dashpot."""
    stress = run[f"{prefix}.relaxing.dashpot.stress"]
    volume = numbers[f"{prefix}.area"] * numbers[f"{prefix}.rest_length"]
    return volume * stress**2 / numbers[f"{prefix}.relaxing.dashpot.viscosity"]


def numbers_of(made: Assembly) -> dict[str, np.ndarray]:
    return {name: np.squeeze(np.array(q.values)) for name, q in made.quantities().items()}


def integral(power: np.ndarray, times: np.ndarray) -> np.ndarray:
    return cumulative_simpson(power, x=times, initial=0.0)


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("name", DECKS)
def test_the_published_actuator_balances(name: str) -> None:
    """Sine current of 4 A at 3 Hz for half a second; balance at every moment, to 1e-6 of the work done."""
    made = declare(load_deck(name))
    number, times = numbers_of(made), np.linspace(0.0, 0.5, 20_001)
    model = flatten(made)
    run = simulate(model, times, inputs={"motor.current": lambda t: 4.0 * math.sin(6 * math.pi * t)})
    speed = run["motor.speed"]
    work = integral(4 * number["motor.torque_constant"] * run["motor.current"] * speed, times)
    stored = 0.5 * number["motor.inertia"] * speed**2 + 2 * rubber_energy(run, number)
    friction = number["dry_friction.sliding_effort"] * np.tanh(speed / number["dry_friction.creep_speed"])
    lost = integral(
        2 * rubber_loss(run, number) + number["bearing.damping"] * speed**2 + friction * speed, times
    )
    assert np.max(np.abs(work - stored - lost)) < 1e-6 * np.max(np.abs(work))
    assert lost[-1] > 0.01 * np.max(np.abs(work)), "there is something to balance"
    assert np.max(stored) > 0.1 * np.max(np.abs(work))


@pytest.mark.long_cases("austin2015_figure_consistent")
@pytest.mark.parametrize("name", DECKS)
def test_the_spring_alone_balances_when_it_is_driven(name: str) -> None:
    made = declare(load_deck(name)).with_part("motor", Driven()).without_part("motor_encoder")
    made = made.without_part("bearing").without_part("dry_friction")
    number, times = numbers_of(made), np.linspace(0.0, 0.25, 10_001)
    drive = {
        "motor.angle": lambda t: 0.6 * math.sin(20 * t) + 0.2 * math.sin(47 * t),
        "motor.speed": lambda t: 12.0 * math.cos(20 * t) + 9.4 * math.cos(47 * t),
    }
    run = simulate(flatten(made), times, inputs=drive)
    work = integral(run["spring.torque"] * run["motor.speed"], times)
    balance = work - 2 * rubber_energy(run, number) - integral(2 * rubber_loss(run, number), times)
    assert np.max(np.abs(balance)) < 2e-6 * np.max(np.abs(work))
    assert run["motor.reaction"] == pytest.approx(run["spring.torque"], rel=1e-12, abs=1e-12)


# --- random networks with hardening springs -------------------------------------------------------


def network(draw: random.Random, depth: int) -> Element:
    if depth == 0 or draw.random() < 0.2:
        kind = draw.random()
        if kind < 0.35:
            return Hardening(stiffness=10.0 ** draw.uniform(0, 2), hardening=10.0 ** draw.uniform(0, 3))
        if kind < 0.55:
            return Spring(stiffness=10.0 ** draw.uniform(0, 2))
        return Dashpot(damping=10.0 ** draw.uniform(-1, 1))
    members = {f"e{i}": network(draw, depth - 1) for i in range(draw.choice((2, 2, 3)))}
    return parallel(**members) if draw.random() < 0.5 else series(**members)


def leaves(element: Element, path: str) -> Iterator[tuple[str, Element]]:
    children = element.children()
    if not children:
        yield path, element
    for name, child in children.items():
        yield from leaves(child, f"{path}.{name}")  # type: ignore[arg-type]


def nonlinear_in_series(element: Element) -> int:
    own = (
        sum(not isinstance(m, Dashpot) for _, m in element.members)
        if type(element).__name__ == "Series"
        else 0
    )  # type: ignore[attr-defined]
    return max([own, *(nonlinear_in_series(c) for c in element.children().values())])  # type: ignore[arg-type]


def account(model: FlatModel, element: Element, times: np.ndarray, run: Trace) -> np.ndarray:
    """Energy stored and lost so far, leaf by leaf."""
    total = np.zeros(len(times))
    for path, leaf in leaves(element, "net"):
        if isinstance(leaf, Dashpot):
            total += integral(run[f"{path}.force"] ** 2 / leaf.damping.number, times)
            continue
        extension = run[f"{path}.extension"]
        total += leaf.stiffness.number / 2 * extension**2  # type: ignore[attr-defined]
        if isinstance(leaf, Hardening):
            total += leaf.hardening.number / 4 * extension**4
    return total


@pytest.mark.long_cases("1", "3", "2", "0")
@pytest.mark.parametrize("batch", range(4))
def test_random_networks_with_hardening_springs_balance(batch: int) -> None:
    draw, seen = random.Random(100 + batch), 0
    times = np.linspace(0.0, 1.0, 4001)
    position = 0.3 * np.sin(9.0 * times) + 0.1 * np.cos(23.0 * times) - 0.1
    while seen < 3:
        element = network(draw, draw.randint(1, 3))
        if nonlinear_in_series(element) > 2 or len(list(leaves(element, ""))) < 3:
            continue
        model = flatten(
            assembly("net", grip=Driven(domain=TRANSLATION), net=tie(element, "grip")), outputs=["net.force"]
        )
        # Roots within roots are right too, but take long.
        if model.equations.n_instructions() > 10_000:
            continue
        seen += 1
        drive = {
            "grip.position": lambda t: 0.3 * math.sin(9.0 * t) + 0.1 * math.cos(23.0 * t) - 0.1,
            "grip.speed": lambda t: 2.7 * math.cos(9.0 * t) - 2.3 * math.sin(23.0 * t),
        }
        run = simulate(model, times, inputs=drive, tolerance=1e-10)
        assert run["grip.position"] == pytest.approx(position, abs=1e-12)
        work = integral(run["net.force"] * run["grip.speed"], times)
        found = account(model, element, times, run)
        assert np.max(np.abs(work - found)) < 1e-5 * max(np.max(np.abs(work)), 1e-6), (
            batch,
            seen,
            str(element),
        )


# --- passivity ------------------------------------------------------------------------------------


def smooth_drive(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A smooth closed path of the angle from zero to zero, with its rate, on 4,001 samples."""
    draw = np.random.default_rng(seed)
    times = np.linspace(0.0, 1.0, 4001)
    angle, speed = np.zeros_like(times), np.zeros_like(times)
    for k in range(1, 7):
        size, phase = draw.normal() * 0.5 / k, draw.uniform(0, 2 * math.pi)
        angle += size * (np.sin(2 * math.pi * k * times + phase) - math.sin(phase))
        speed += size * 2 * math.pi * k * np.cos(2 * math.pi * k * times + phase)
    return times, angle, speed


@settings(max_examples=settings.default.max_examples // 10)
@given(st.integers(0, 10**6), st.sampled_from(DECKS))
def test_no_closed_path_wins_energy_from_the_spring(seed: int, name: str) -> None:
    """From rest, ∫T dθ ≥ 0 at every moment and over the closed path: the spring is passive."""
    made = declare(load_deck(name)).with_part("motor", Driven()).without_part("motor_encoder")
    model = flatten(made.without_part("bearing").without_part("dry_friction"))
    times, angle, speed = smooth_drive(seed)
    run = simulate(model, times, inputs={"motor.angle": angle, "motor.speed": speed}, tolerance=1e-7)
    work = integral(run["spring.torque"] * speed, times)
    assert np.min(work) > -2e-5 * np.max(work)
    assert work[-1] > 0.0


@settings(max_examples=settings.default.max_examples // 10)
@given(st.integers(0, 10**6))
def test_no_path_wins_energy_from_a_cable_that_only_pulls(seed: int) -> None:
    """Relaxing rubber behind a one-sided cable, slack and taut in turn."""
    rubber = specimen(
        area=1e-4,
        rest_length=0.0125,
        still=LinearElastic(modulus=0.9e6),
        relaxing=series(spring=LinearElastic(modulus=0.6e6), dashpot=ViscousMaterial(viscosity=3e4)),
    )
    made = assembly(
        "a", shaft=Driven(), s=tie(through(Pulley(radius=0.01), rope=pull_only(r=rubber)), "shaft")
    )
    times, angle, speed = smooth_drive(seed)
    run = simulate(flatten(made), times, inputs={"shaft.angle": angle, "shaft.speed": speed}, tolerance=1e-7)
    work = integral(run["s.torque"] * speed, times)
    # The rounded corner stores up to width·ln 2 times the way on which the cable is slack.
    corner = 0.1 * math.log(2.0) * 0.01 * (np.max(angle) - np.min(angle))
    assert np.min(work) > -corner - 1e-5 * np.max(work)
    assert np.min(run["s.rope.force"]) >= 0.0


def test_a_mass_on_a_relaxing_spring_only_loses() -> None:
    """Free swing: total energy never rises, and ends below the start."""
    inside = parallel(
        still=Spring(stiffness=50.0), branch=series(k=Spring(stiffness=80.0), c=Dashpot(damping=4.0))
    )
    made = assembly("m", mass=Mass(mass=0.5), s=tie(inside, "mass"))
    times = np.linspace(0.0, 3.0, 3001)
    run = simulate(flatten(made), times, start={"mass.position": 0.1})
    energy = 0.25 * run["mass.speed"] ** 2 + 25.0 * run["mass.position"] ** 2
    energy = energy + 40.0 * run["s.branch.k.extension"] ** 2
    assert np.all(np.diff(energy) < 1e-9 * energy[0])
    assert energy[-1] < 0.2 * energy[0]
