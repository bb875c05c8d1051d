"""The printed law of the rubber, the published loops and the drivetrain, against the decks.

Independent roads: the force at seven extensions as rounded by hand elsewhere; the loss per cycle from a
slow-motion quadrature that knows no relaxation at all; the area of a published loop.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import TRANSLATION, Assembly, Driven, Specimen, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.linear import rest_state
from nlsdesign.simulation import Trace, simulate

from .published import AREA, BRANCH, ENGAGING, FORCES, MODULI, REST_LENGTH, VISCOSITY

PRINTED, CONSISTENT = "austin2015_as_printed", "austin2015_figure_consistent"


def rubber(name: str) -> FlatModel:
    piece = declare(load_deck(name))["spring.rubber"]
    assert isinstance(piece, Specimen)
    return flatten(
        assembly("piece", grip=Driven(domain=TRANSLATION), rubber=tie(piece, "grip")),
        outputs=["rubber.force"],
    )


def static_force(model: FlatModel, extension: float) -> float:
    held = model.with_values({"grip.position": extension})
    return held.evaluate(list(rest_state(held, {})))["rubber.force"]


@pytest.mark.parametrize(("extension", "force"), FORCES)
def test_force_of_the_printed_law(extension: float, force: float) -> None:
    """Equal to the rounded number, and the figure-consistent deck has 2.55 times it."""
    digits = 0.5 if force >= 97.0 else 0.05
    found = static_force(rubber(PRINTED), extension)
    assert abs(found - force) <= digits * 1.02
    by_hand = (
        AREA / REST_LENGTH * sum(k * max(extension - at, 0.0) for k, at in zip(MODULI, ENGAGING, strict=True))
    )
    assert found == pytest.approx(by_hand, rel=1e-9)
    assert static_force(rubber(CONSISTENT), extension) == pytest.approx(2.55 * by_hand, rel=1e-9)


def test_the_deck_holds_the_printed_numbers() -> None:
    numbers = declare(load_deck(PRINTED)).quantities()
    assert numbers["spring.rubber.area"].number == pytest.approx(AREA, rel=1e-15)
    assert numbers["spring.rubber.rest_length"].number == pytest.approx(REST_LENGTH, rel=1e-15)
    assert numbers["spring.rubber.stiff.modulus"].values == pytest.approx(MODULI, rel=1e-12)
    knots = np.array(numbers["spring.rubber.stiff.knots"].values) * REST_LENGTH
    assert knots == pytest.approx(ENGAGING, abs=1e-12)
    assert numbers["spring.rubber.relaxing.spring.modulus"].number == pytest.approx(BRANCH)
    assert numbers["spring.rubber.relaxing.dashpot.viscosity"].number == VISCOSITY
    assert pytest.approx(0.71e-3, abs=0.005e-3) == VISCOSITY / BRANCH
    assert numbers["motor_encoder.quantum"].number == pytest.approx(2 * math.pi / 8192, rel=1e-3)
    constant = numbers["motor.gear_ratio"].number * numbers["motor.torque_constant"].number
    assert constant == pytest.approx(0.220, rel=1e-12)


# --- loops ----------------------------------------------------------------------------------------


def spring_alone(made: Assembly) -> FlatModel:
    bare = made.with_part("motor", Driven()).without_part("motor_encoder")
    return flatten(bare.without_part("bearing").without_part("dry_friction"), outputs=["spring.torque"])


def steady_cycle(model: FlatModel, amplitude: float, frequency: float, samples: int = 2001) -> Trace:
    """The second of two cycles of a sine."""
    w = 2 * math.pi * frequency
    times = np.linspace(0.0, 2.0 / frequency, 2 * samples - 1)
    run = simulate(
        model,
        times,
        inputs={
            "motor.angle": lambda t: amplitude * math.sin(w * t),
            "motor.speed": lambda t: amplitude * w * math.cos(w * t),
        },
    )
    return Trace(times[-samples:], {n: v[-samples:] for n, v in run.signals.items()}, run.units, run.name)


def lost_and_put_in(run: Trace) -> tuple[float, float]:
    """Energy lost over a cycle, and energy put in while the spring is being wound."""
    power = run["spring.torque"] * run["motor.speed"]
    return float(np.trapezoid(power, run.time)), float(np.trapezoid(np.clip(power, 0, None), run.time))


def figure_cam_with_printed_rubber() -> Assembly:
    return declare(load_deck(PRINTED)).with_part("spring.cam", declare(load_deck(CONSISTENT))["spring.cam"])


@pytest.mark.long_cases("1.0-0.4", "0.1-0.04")
@pytest.mark.parametrize(("frequency", "stated"), [(0.1, 0.04), (1.0, 0.4), (4.0, 1.5), (9.0, 3.3)])
def test_loss_per_cycle_with_the_printed_viscosity(frequency: float, stated: float) -> None:
    """Energy lost over energy put in, 45° amplitude, printed rubber behind the cam of Fig. 8.

    Stated in the design notes: 0.04, 0.4, 1.5, 3.3 %. Found: 0.040, 0.402, 1.59, 3.52 %. With the stiffer
    cam of the as-printed deck it is 0.034, 0.34, 1.32, 2.82 %: the number depends on the cam, its order of
    magnitude does not, and 17 % is out of reach.
    """
    run = steady_cycle(spring_alone(figure_cam_with_printed_rubber()), math.radians(45), frequency)
    lost, put_in = lost_and_put_in(run)
    assert 100 * lost / put_in == pytest.approx(stated, rel=0.08)
    other = steady_cycle(spring_alone(declare(load_deck(PRINTED))), math.radians(45), frequency)
    lost, put_in = lost_and_put_in(other)
    assert 100 * lost / put_in == pytest.approx(stated, rel=0.2)


@pytest.mark.parametrize("frequency", [0.1, 1.0])
def test_slow_loss_is_that_of_a_plain_dashpot(frequency: float) -> None:
    """Far below η/k the branch is a dashpot: lost = N·(A/L)·η·∫δ̇² dt over a cycle, by quadrature."""
    model = spring_alone(declare(load_deck(PRINTED)))
    run = steady_cycle(model, math.radians(45), frequency)
    lost, _ = lost_and_put_in(run)
    stretch_rate = run["spring.cam.lever_arm_now"] * run["motor.speed"]
    expected = 2 * AREA / REST_LENGTH * VISCOSITY * float(np.trapezoid(stretch_rate**2, run.time))
    assert lost == pytest.approx(expected, rel=0.01)


def closed_area(angle: np.ndarray, torque: np.ndarray) -> float:
    """∮T dθ of a polygon, closed by its last side, in drawing order."""
    return float(np.sum((torque + np.roll(torque, -1)) / 2 * (np.roll(angle, -1) - angle)))


def test_area_of_the_45_degree_loop_of_fig_1(shared_folder: Path) -> None:
    """IROS 2015, Fig. 1: 0.086 N·m·rad; the figure-consistent deck at 1 Hz has the same within 3 %.

    The viscosity of that deck was chosen so; what is tested is that it still does what its source says, and
    that the area is that of the figure. In drawing order the area is negative: the loop is drawn backwards.
    """
    table = np.loadtxt(shared_folder / "paper" / "fig01_mean_torque_45deg.csv", delimiter=",", skiprows=1)
    angle, torque = table.T
    area = closed_area(angle, torque)
    assert area == pytest.approx(-0.086, abs=0.0005)
    model = spring_alone(declare(load_deck(CONSISTENT)))
    run = steady_cycle(model, float(np.max(angle)), 1.0)
    lost, put_in = lost_and_put_in(run)
    assert lost == pytest.approx(abs(area), rel=0.03)
    assert np.max(run["spring.torque"]) == pytest.approx(np.max(torque), rel=0.01)
    assert 0.05 < lost / put_in < 0.10


def test_area_of_the_25_degree_loop_is_half_as_well_met(shared_folder: Path) -> None:
    """IROS 2015, Fig. 1: a one-sided loop of 9.4 mN·m·rad; half of the simulated two-sided one is 12 at 1 Hz.

    One relaxation time cannot meet both: the loops of the figure widen less with the amplitude.
    """
    table = np.loadtxt(shared_folder / "paper" / "fig01_mean_torque_25deg.csv", delimiter=",", skiprows=1)
    area = abs(closed_area(*table.T))
    assert area == pytest.approx(9.35e-3, abs=0.05e-3)
    run = steady_cycle(spring_alone(declare(load_deck(CONSISTENT))), float(np.max(table[:, 0])), 1.0)
    half = lost_and_put_in(run)[0] / 2
    assert 1.1 * area < half < 1.5 * area
