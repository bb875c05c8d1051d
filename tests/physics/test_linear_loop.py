"""The linearised sampled loop against a z-transform by hand, small simulated motions and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import equilibrium_torque
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    TorqueGains,
    encoder_loop,
    largest_torque,
    loop_margins,
    output_impedance,
    saturation_line,
    sine_response,
    torque_controller,
    with_fine_counts,
    zero_torque,
)
from nlsdesign.feedback.control.evaluation.linear_loop import linear_loop
from nlsdesign.feedback.control.evaluation.margins import coupled_stability
from nlsdesign.feedback.control.evaluation.responses import torque_resolution
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation.sampled_batch import run_batch
from tests.observed import linear_actuator
from tests.physics.test_control_torque import sampled_response
from tests.renamed import SCHEMES, renamed

OUTPUTS = ["motor.angle", "spring.torque"]
NLS, SOFT = "austin2015_figure_consistent", "austin2015_soft_spring"


def plants(deck: str) -> tuple[FlatModel, FlatModel]:
    actuator = declare(load_deck(deck))
    return flatten(actuator, outputs=OUTPUTS), flatten(with_moved_load(actuator), outputs=OUTPUTS)


def loops(deck: str, sample_time: float = 1e-3, **gains: float) -> tuple[ClosedLoop, ClosedLoop]:
    fixed, moved = plants(deck)
    observer = design_observer(fixed, sample_time=sample_time, gain=CascadeGain())
    controller = torque_controller(fixed, gains=TorqueGains(**gains), sample_time=sample_time)
    return tuple(
        encoder_loop(p, observer=observer, controller=controller, substeps=round(1e4 * sample_time))
        for p in (fixed, moved)
    )


def smooth(loop: ClosedLoop) -> ClosedLoop:
    """Without counts and without dry friction: nothing but what a linearisation sees."""
    plant = with_fine_counts(loop.plant).with_values({"dry_friction.sliding_effort": 0.0})
    return replace(loop, plant=plant)


@pytest.mark.parametrize(
    "gains", [TorqueGains(), TorqueGains(proportional=20.0, integral=0.0, compensation=0.0)]
)
def test_response_of_a_linear_loop_is_its_z_transform(gains: TorqueGains) -> None:
    """The z-transform is typed by hand with perfect torque feedback; one sample of delay."""
    plant = linear_actuator(1.7, moved=False)
    loop = encoder_loop(
        plant,
        observer=design_observer(plant, gain=CascadeGain()),
        controller=torque_controller(plant, gains=gains),
    )
    frequencies = [0.5, 3.0, 12.5, 80.0]
    found = linear_loop(loop, [0.2]).response(loop.torque, loop.desired, frequencies)[0]
    assert found == pytest.approx([sampled_response(1.7, gains, f) for f in frequencies], rel=1e-6)


@pytest.mark.long_cases("0.002", "0.001")
@pytest.mark.parametrize("sample_time", [1e-3, 2e-3])
def test_small_motions_of_the_simulated_loop(sample_time: float) -> None:
    loop = smooth(loops(NLS, sample_time, proportional=10.0, velocity_bandwidth=0.03 / sample_time)[0])
    linear = linear_loop(loop, np.radians([34.0]))
    found = sine_response(loop, amplitude=0.05, offset=float(linear.torque[0]), frequencies=[2.0, 6.0, 15.0],
                          translate=natively)  # fmt: skip
    expected = linear.response(loop.torque, loop.desired, found.frequency)[0]
    assert found.response == pytest.approx(expected, rel=0.005)


def test_the_mode_of_the_plant_decides() -> None:
    """Sliding, the loop of Kp = 70 is unstable at 40°; stuck in the creep of dry friction it seems stable."""
    loop = loops(NLS, proportional=70.0)[0]
    at = np.radians([40.0])
    assert not linear_loop(loop, at).stable()[0]
    assert linear_loop(loop, at, speed=0.0).stable()[0]


def test_poles_beyond_the_current_limit_are_none() -> None:
    loop = loops(NLS)[0]
    linear = linear_loop(loop, np.radians([30.0, 62.0]))
    assert linear.reached.tolist() == [True, abs(linear.current[1]) < 20.0]
    assert abs(linear.current[1]) > 20.0
    assert np.isnan(linear.poles()[1]).all()
    assert not np.isnan(linear.poles()[0]).any()


def test_tables_with_and_without_their_slope() -> None:
    loop = loops(NLS)[0]
    at = np.radians([35.0])
    sloped, frozen = (linear_loop(loop, at, frozen_tables=held).radius()[0] for held in (False, True))
    assert sloped == pytest.approx(frozen, rel=0.05)


@pytest.mark.long_cases("20.0")
@pytest.mark.parametrize("angle", [20.0, 35.0])
def test_gain_margin_is_the_factor_that_makes_the_loop_unstable(angle: float) -> None:
    loop, at = loops(NLS, integral=0.0)[0], np.radians([angle])
    margin = loop_margins(loop, at, opening=loop.desired).gain[0]
    for share, stable in ((0.99, True), (1.01, False)):
        gain = 32.0 * 10.0 ** (margin / 20.0) * share
        changed = replace(loop, controller=loop.controller.with_values({"controller.proportional": gain}))
        assert bool(linear_loop(changed, at).stable()[0]) is stable


def test_phase_margin_against_the_stability_of_a_turned_loop() -> None:
    """A delay margin of m samples: with the next whole number of samples more the loop is unstable."""
    loop, at = loops(NLS, proportional=20.0)[0], np.radians([15.0])
    margin = loop_margins(loop, at)
    samples = int(margin.delay[0] / 1e-3)
    assert margin.phase[0] == pytest.approx(360.0 * margin.delay[0] * margin.crossover[0], rel=0.05)
    late = [linear_loop(replace(loop, delay=1 + k), at).stable()[0] for k in (samples, samples + 1)]
    assert late == [True, False]


def test_impedance_of_small_motions() -> None:
    """Simulated without counts and friction; ratio of fundamentals, sign and energy."""
    loop = smooth(loops(SOFT)[1])
    found = zero_torque(loop, amplitude=0.02, frequencies=[1.0, 5.0, 20.0], translate=natively)
    linear = output_impedance(loop, [0.0], frequencies=found.frequency)
    assert found.impedance == pytest.approx(linear.impedance[0], rel=0.01)
    speed = 2 * np.pi * found.frequency * 0.02
    lost = 0.5 * linear.impedance[0].real * speed**2 / found.frequency
    assert found.energy == pytest.approx(lost, rel=0.02)


def test_below_crossover_the_impedance_is_one_over_the_gain() -> None:
    loop = loops(SOFT, integral=0.0)[1]
    found = output_impedance(loop, [0.1], frequencies=[0.5, 1.0])
    assert np.abs(found.impedance[0]) == pytest.approx(1.0 / 32.0, rel=0.05)


def test_an_active_loop_gives_energy_to_its_load() -> None:
    loop = smooth(loops(SOFT)[1])
    first = output_impedance(loop, [0.0]).first_active()[0]
    assert 20.0 < first < 200.0
    found = zero_torque(loop, amplitude=0.01, frequencies=[0.7 * first, 1.3 * first], translate=natively)
    assert found.energy[0] > 0.0 > found.energy[1]


def test_a_passive_stiffness_by_hand() -> None:
    """Far above all loops the motor does not follow: the load feels the spring alone."""
    loop = loops(SOFT)[1]
    found = output_impedance(loop, [0.0], frequencies=[400.0])
    assert np.abs(found.dynamic_stiffness[0]) == pytest.approx(1.7, rel=0.02)


@pytest.mark.parametrize("inertia", [2e-5, 1e-3])
def test_coupled_stability_against_a_simulated_load(inertia: float) -> None:
    """The load as a body with a spring to the frame, started with a small kick: it dies out, or grows."""
    loop, stiffness = smooth(loops(SOFT, proportional=90.0)[1]), 3.0
    found = coupled_stability(loop, angle=0.0, inertias=[inertia], stiffnesses=[stiffness])
    parts = dict(with_moved_load(declare(load_deck(SOFT))).parts)
    parts["load"] = Inertia(inertia=inertia)
    parts["environment"] = tie(Spring(stiffness=stiffness, domain=ROTATION), "load")
    free = flatten(assembly("free", **parts), outputs=OUTPUTS)
    series = tuple(spring for spring in free.springs if spring.name == "spring")
    plant = with_fine_counts(replace(free, springs=series)).with_values({"dry_friction.sliding_effort": 0.0})
    shown = loop.plant.variable("spring.angle.measured")
    from nlsdesign.model.transform import with_signal

    plant = with_signal(plant, shown, lambda k: k["motor_encoder.reading"] - k["load_encoder.reading"])
    coupled = replace(loop, plant=plant)
    batch = run_batch(
        coupled.system([loop.desired]), 1.0, inputs={loop.desired: 0.0}, start={"plant.load.speed": 1e-3},
        keep=("plant.load.speed",),
    )  # fmt: skip
    speed = np.abs(batch["plant.load.speed"][0])
    grows = np.max(speed[-200:]) > np.max(speed[200:400])
    assert grows is not bool(found.stable[0, 0])
    assert grows == (np.log(found.radius[0, 0]) > 0.0)


def test_the_saturation_line_of_a_linear_spring_by_hand() -> None:
    """Current of a sine of the angle: Θ·|k − Jω² + jbω| over gear ratio times torque constant."""
    fixed = smooth(loops(SOFT)[0])
    at = np.array([2.0, 20.0, 40.0])
    line = saturation_line(fixed, at, largest_angle=1.0)
    omega, values = 2 * np.pi * at, fixed.plant.values
    inertia, damping = values["motor.inertia"], values["bearing.damping"]
    per_angle = np.abs(1.7 - inertia * omega**2 + 1j * damping * omega)
    angle = np.minimum(20.0 * 0.22 / per_angle, 1.0)
    assert line.angle == pytest.approx(angle, rel=0.03)
    assert line.torque == pytest.approx(1.7 * angle, rel=0.03)
    assert line.limited_by == ("angle", "current", "current")


def test_resolution_of_a_linear_spring() -> None:
    fixed, moved = loops(SOFT)
    count = fixed.plant.values["motor_encoder.quantum"]
    assert torque_resolution(fixed, [0.0, 0.5]) == pytest.approx([1.7 * count] * 2, rel=1e-6)
    # Read between two encoders the counts add up.
    assert torque_resolution(moved, [0.0]) == pytest.approx([3.4 * count], rel=1e-6)


@pytest.mark.long_cases("in_words", "nested", "against_the_order")
@pytest.mark.parametrize("scheme", SCHEMES)
def test_names_decide_nothing(scheme: object) -> None:
    fixed, moved = loops(SOFT)
    machine = renamed(declare(load_deck(SOFT)), scheme)
    outputs = [machine.name(name) for name in OUTPUTS]
    bench = flatten(machine.assembly, outputs=outputs)
    other = encoder_loop(
        flatten(with_moved_load(machine.assembly), outputs=outputs),
        observer=design_observer(bench, gain=CascadeGain()),
        controller=torque_controller(bench, gains=TorqueGains()),
    )  # fmt: skip
    at = [0.3]
    assert output_impedance(other, at).impedance == pytest.approx(output_impedance(moved, at).impedance)
    held = encoder_loop(bench, observer=other.observer, controller=other.controller)
    assert loop_margins(held, at).gain == pytest.approx(loop_margins(fixed, at).gain)


def test_beyond_the_current_there_is_no_margin_and_elsewhere_there_is() -> None:
    """At 58° the spring of the published deck asks for more torque than its current limit can hold."""
    plant = flatten(declare(load_deck(NLS)), outputs=OUTPUTS)
    observer = design_observer(plant, gain=CascadeGain())
    loop = encoder_loop(plant, observer=observer, controller=torque_controller(plant))
    margins = loop_margins(loop, np.radians([20.0, 58.0]))
    assert margins.linear.torque[0] < largest_torque(plant)
    assert equilibrium_torque(plant, "spring", [np.radians(58.0)])[0] > largest_torque(plant)
    assert margins.linear.reached.tolist() == [True, False]
    assert np.isfinite([margins.gain[0], margins.phase[0]]).all()
    assert np.isnan([margins.gain[1], margins.phase[1], margins.delay[1]]).all()
