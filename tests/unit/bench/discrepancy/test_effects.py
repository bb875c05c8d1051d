"""The catalogue: each effect edits an assembly as it says, and only where it can sit."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy.effects import (
    ALL,
    Candidate,
    Effect,
    Unknown,
    angle_sensor_eccentricity,
    backlash,
    cable_friction,
    cam_angle_offset,
    force_sensor_drift,
    load_dependent_friction,
    permanent_set,
    self_heating,
    stress_softening,
)
from nlsdesign.bench.discrepancy.effects.effect import EffectFunction, wrapped
from nlsdesign.bench.discrepancy.effects.places import stretched
from nlsdesign.bench.discrepancy.selection.comparison import moved_numbers
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    Driven,
    Encoder,
    ForceSensor,
    GearedMotor,
    Inertia,
    LossHeat,
    SampleAndHold,
    SelfHeating,
    Spring,
    TorqueSensor,
    TransportDelay,
    WorkHeat,
    parallel,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from tests.effect_machines import KNOWN, machine_for


def test_no_effect_is_lost() -> None:
    assert {effect.__name__ for effect in ALL} >= KNOWN
    # A sliding body, and friction to begin with, are not on the rig.
    rig = declare(load_deck("test_rig"))
    assert {effect.__name__ for effect in ALL if effect(rig)} >= KNOWN - {
        "constant_force",
        "asymmetric_friction",
    }


@pytest.fixture(scope="module")
def rig() -> Assembly:
    return declare(load_deck("test_rig"))


def swing() -> Assembly:
    return assembly(
        "swing", wheel=Inertia(inertia=1e-3), spring=tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    )


# Of all effects on one machine: ``test_effects_everywhere.py``, where each candidate is a deck.
@pytest.mark.long_cases(*(e.__name__ for k, e in enumerate(ALL) if k % 4))
@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.__name__)
def test_an_effect_is_a_whole_assembly_with_its_own_numbers(effect: Effect) -> None:
    machine = machine_for(effect)
    declared = deck_text(machine)
    for candidate in effect(machine):
        assert candidate.effect == effect.__name__
        assert candidate.signature
        assert candidate.source
        assert candidate.location in dict(machine.walk())
        numbers = flatten(candidate.assembly).values
        for unknown in candidate.unknowns:
            assert unknown.name in numbers
            assert all(unknown.lower <= start <= unknown.upper for start in unknown.starts)
        # The deck of the edited assembly is one that every command reads.
        text = deck_text(candidate.assembly)
        assert declare(read_deck(text, Path("edited.toml"))) == candidate.assembly
    assert deck_text(machine) == declared


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.__name__)
def test_an_effect_is_not_added_twice_at_the_same_place(effect: Effect) -> None:
    machine = machine_for(effect)
    first, *_ = effect(machine)
    off = {
        u.name: (2.0 if u.name.endswith(".gain") else 0.01)
        for u in first.unknowns
        if u.name in machine.quantities()
    }
    again = [c for c in effect(first.assembly.with_values(off)) if c.location == first.location]
    if effect.__name__ == "position_dependent_friction":
        # Friction that comes round with the angle may stand beside that of a spot, not the same once more.
        again = [
            c for c in again if len(c.unknowns) == len(first.unknowns) and "rubbing" in c.unknowns[0].name
        ]
    # A ripple may have several orders, each a part of its own; any other effect is offered once.
    assert again == [] or effect.__name__ == "torque_ripple", "say in its forms what the effect brings"
    for second in again:
        assert {u.name for u in second.unknowns}.isdisjoint(u.name for u in first.unknowns)


def test_effects_stay_away_from_what_cannot_have_them() -> None:
    able = {effect.__name__ for effect in ALL if effect(swing())}
    assert able & KNOWN == {
        "coulomb_friction", "stribeck_friction", "load_dependent_friction", "quadratic_drag", "torque_ripple",
        "backlash", "constant_torque", "gravity_load", "drivetrain_resonance", "position_dependent_friction",
        "drive_delay", "torque_constant_saturation", "command_compression", "winding_heat",
        "torque_constant_drift", "second_relaxation", "rate_independent_hysteresis", "strain_stiffening",
        "stress_softening", "self_heating",
    }  # fmt: skip


def test_sensors_go_on_reading_what_they_read(rig: Assembly) -> None:
    model = flatten(rig)
    state = [0.4 if v.name == "motor.angle" else 0.0 for v in model.states]
    before = model.evaluate(state)["force_sensor.reading"]
    for effect in (cam_angle_offset, backlash, load_dependent_friction):
        candidate, *_ = effect(rig)
        neutral = {u.name: 0.0 for u in candidate.unknowns if not u.name.endswith(".inertia")}
        edited = flatten(candidate.assembly.with_values(neutral))
        same = [0.4 if v.name in ("motor.angle", "spring.inner_angle") else 0.0 for v in edited.states]
        assert edited.evaluate(same)["force_sensor.reading"] == pytest.approx(before, rel=1e-3)


def test_what_a_cam_stretches_is_found_inside_its_cable(rig: Assembly) -> None:
    assert stretched(rig) == ["spring.cable.rubber"]
    assert stretched(swing()) == []


def test_a_wrapper_takes_its_place_among_its_neighbours() -> None:
    both = parallel(left=Spring(stiffness=1.0, domain=ROTATION), right=Spring(stiffness=2.0, domain=ROTATION))
    declared = assembly(
        "two",
        wheel=Inertia(inertia=1e-3),
        spring=tie(both, "wheel"),
        cell=TorqueSensor(of="spring.left.torque"),
    )
    found = wrapped(declared, "spring.left", "pair", lambda name, old: parallel(**{name: old}))
    assert [path for path, _ in found.walk()][:5] == [
        "wheel",
        "spring",
        "spring.pair",
        "spring.pair.left",
        "spring.right",
    ]
    assert found.sensors()["cell"].of == "spring.pair.left.torque"


def test_a_user_adds_an_effect_with_one_function() -> None:
    def soft_mount(declared: Assembly) -> list[Candidate]:
        edited = declared.with_part("mount", tie(Spring(stiffness=1.0, domain=ROTATION), "wheel"))
        return [
            Candidate("soft_mount", "wheel", edited, (Unknown("mount.stiffness", (1.0,), 0.1, 10.0),), "", "")
        ]

    effect: EffectFunction = soft_mount
    (found,) = effect(swing())
    assert "mount.stiffness" in flatten(found.assembly).values
    assert isinstance(found.assembly.element("mount"), Spring)


def test_a_specimen_without_motor_ages_and_its_cell_reads_the_aged_force() -> None:
    strip = declare(load_deck("vhb4910_specimen"))
    able = {effect.__name__ for effect in ALL if effect(strip)}
    assert {"stress_softening", "permanent_set", "self_heating", "strain_stiffening"} <= able
    assert able.isdisjoint(
        {"drive_delay", "cam_profile_error", "angle_sensor_eccentricity", "cable_friction"}
    )
    bare_piece = strip.element("strip.rubber")
    tied = assembly(
        "tied",
        grip=Driven(domain=TRANSLATION),
        piece=tie(bare_piece, "grip"),
        cell=ForceSensor(of="piece.force"),
    )
    for effect in (stress_softening, permanent_set, self_heating):
        for found in effect(tied):
            assert found.assembly.sensors()["cell"].of == "piece.force"
            assert flatten(found.assembly).states
    softened, *_ = stress_softening(tied)
    model = flatten(softened.assembly.with_values({"piece.softening": 0.5}))
    largest = [0.02 if v.name == "piece.largest" else 0.0 for v in model.states]
    soft, virgin = (model.evaluate(state, [0.01, 0.0]) for state in (largest, [0.0] * len(largest)))
    # Half of half is lost, and the Maxwell branches are softened with the rest.
    assert soft["cell.reading"] == pytest.approx(0.75 * virgin["cell.reading"])


def test_a_motor_without_a_spring_has_the_effects_of_a_drive() -> None:
    motor = GearedMotor(inertia=1e-3, gear_ratio=10.0, torque_constant=0.05)
    drive = assembly("drive", motor=motor, encoder=Encoder(of="motor.angle", quantum=1e-3))
    able = {effect.__name__: len(effect(drive)) for effect in ALL if effect(drive)}
    assert {name: count for name, count in able.items() if name in KNOWN} == {
        "coulomb_friction": 1, "stribeck_friction": 1, "quadratic_drag": 1, "torque_ripple": 1,
        "drive_delay": 1, "torque_constant_saturation": 2, "angle_sensor_eccentricity": 2,
        "constant_torque": 1, "gravity_load": 1, "position_dependent_friction": 2, "drivetrain_resonance": 1,
        "command_compression": 1, "winding_heat": 1, "torque_constant_drift": 2, "backlash": 1,
    }  # fmt: skip
    once, on_motor = (
        c.assembly.quantities()["encoder_eccentricity.order"].number for c in angle_sensor_eccentricity(drive)
    )
    assert (once, on_motor) == (1.0, 10.0)


def test_a_guide_stands_on_either_side_of_the_load_cell(rig: Assembly) -> None:
    before, behind = cable_friction(rig)
    assert before.assembly.sensors()["force_sensor"].of == "spring.guide.cable.force"
    assert behind.assembly.sensors()["force_sensor"].of == "spring.guide.force"


def test_a_drifting_cell_is_read_without_its_drift(rig: Assembly) -> None:
    """The balance of the motor sees the force behind the reading: reading less drift so far, at 2 N/s."""
    (found,) = force_sensor_drift(rig)
    drifting = found.assembly.with_values({"force_sensor_drift.drift": 2.0})
    signals = ["motor_encoder.reading", "current_sensor.reading", "force_sensor.reading"]
    plain, edited = (
        {b.name: b.model for b in blocks_of(flatten(a), signals)}["motor"] for a in (rig, drifting)
    )
    assert [v.name for v in edited.states] == ["force_sensor_drift.drifted"]
    assert edited.evaluate([0.0], [0.0] * len(edited.inputs)).keys() >= {"motor.unbalanced"}
    place = [v.name for v in plain.inputs].index("force_sensor.reading")
    given = [0.3 if v.name == "motor_encoder.reading" else 0.0 for v in plain.inputs]
    given[place] = 50.0
    same = dict(zip([v.name for v in plain.inputs], given, strict=True))
    later = [same[v.name] + (7.0 if v.name == "force_sensor.reading" else 0.0) for v in edited.inputs]
    assert edited.evaluate([7.0], later)["motor.unbalanced"] == pytest.approx(
        plain.evaluate([], given)["motor.unbalanced"]
    )


def offered(declared: Assembly, location: str) -> set[str]:
    return {c.effect for effect in ALL for c in effect(declared) if c.location == location}


def test_behind_one_fault_of_a_load_cell_every_other_one_is_offered(rig: Assembly) -> None:
    faults = {
        "force_sensor_delay": {"force_sensor_delay.delay": 4e-3},
        "force_sensor_drift": {"force_sensor_drift.drift": 0.2},
        "force_sensor_bias": {"force_sensor.bias": 3.0},
        "force_sensor_gain": {"force_sensor.gain": 1.1},
        "force_sensor_nonlinearity": {"force_sensor_nonlinearity.nonlinearity": 1e-4},
        "clock_drift": {"force_sensor_clock.rate": 1e-4},
    }
    assert offered(rig, "force_sensor") & KNOWN == set(faults)
    for effect, numbers in faults.items():
        at_the_cell = (c for e in ALL for c in e(rig) if c.location == "force_sensor")
        (candidate,) = (c for c in at_the_cell if c.effect == effect)
        faulty = candidate.assembly.with_values(numbers)
        # Of a delay and a clock that drifts records show the sum alone.
        lag = {"force_sensor_delay", "clock_drift"}
        assert offered(faulty, "force_sensor") & KNOWN == set(faults) - (lag if effect in lag else {effect})
        # Whatever is added next, the records go on measuring the same signal.
        assert {r.signal for r in flatten(faulty).readings} >= {"force_sensor.reading"}


def test_a_delay_declared_anywhere_on_the_line_is_not_offered_again(rig: Assembly) -> None:
    late = rig.with_part("bus", TransportDelay(of="force_sensor.reading", delay=2e-3))
    assert "force_sensor_delay" not in offered(late, "force_sensor")
    assert "force_sensor_drift" in offered(late, "force_sensor")


def test_a_late_motor_may_saturate_and_one_that_saturates_may_be_late(rig: Assembly) -> None:
    faults = {"drive_delay", "torque_constant_saturation"}
    assert offered(rig, "motor") >= faults
    for first, second in (
        ("drive_delay", "torque_constant_saturation"),
        ("torque_constant_saturation", "drive_delay"),
    ):
        # Saturation has two forms, a delay one.
        one = next(c for e in ALL for c in e(rig) if c.effect == first)
        assert offered(one.assembly, "motor") & faults == {second}
        two = next(c for e in ALL for c in e(one.assembly) if c.effect == second)
        assert {u.name for c in (one, two) for u in c.unknowns} <= set(flatten(two.assembly).values)
        assert list(two.assembly["motor"].children()) == [
            u.name.split(".")[1] for u in (*one.unknowns, *two.unknowns)
        ]


def test_a_disc_behind_a_gear_is_offered_for_an_encoder_that_is_sampled(rig: Assembly) -> None:
    sampled = _latched_before(rig)
    orders = [
        c.assembly.quantities()["motor_encoder_eccentricity.order"].number
        for c in angle_sensor_eccentricity(sampled)
    ]
    assert orders == [1.0, 25.0]
    latched = rig.with_part("latch", SampleAndHold(of="motor_encoder.reading", sample_rate=1e3))
    assert {c.location for c in angle_sensor_eccentricity(latched)} == {"motor_encoder"}


def _latched_before(rig: Assembly) -> Assembly:
    others = {n: p for n, p in rig.parts if n != "motor_encoder"}
    return assembly(
        "sampled",
        **others,
        samples=SampleAndHold(of="motor.angle", sample_rate=1e3),
        motor_encoder=Encoder(of="samples.reading", quantum=1e-3),
    )


@pytest.mark.parametrize("first", ALL, ids=lambda e: e.__name__)
def test_a_second_effect_keeps_the_numbers_of_the_first(first: Effect, rig: Assembly) -> None:
    """Whatever is added next, an effect's own numbers stay, under a name that the search finds again."""
    for one in first(rig):
        for second in ALL:
            for two in second(one.assembly):
                numbers = {n.partition("[")[0] for n in two.assembly.quantities()}
                assert {u.name.partition("[")[0] for u in two.unknowns} <= numbers, two.effect
                moved = moved_numbers(one.assembly, two.assembly)
                rows = (u.name.partition("[")[0] for u in one.unknowns)
                names = {moved.get(row, row) for row in rows}
                assert names <= numbers, f"{one.effect}, then {two.effect}"


def test_rubber_may_grow_warm_by_all_work_or_by_its_loss_and_soften_in_part_or_as_a_whole(
    rig: Assembly,
) -> None:
    """What heats and what softens is not known beforehand: one name, three forms."""
    heats = []
    for candidate in self_heating(rig):
        where = candidate.unknowns[0].name.rpartition(".")[0]
        warm = candidate.assembly.element(where)
        assert isinstance(warm, SelfHeating)
        share = warm.heat.relaxing_share.number if isinstance(warm.heat, LossHeat) else None
        heats.append((type(warm.heat), share))
    assert sorted(heats, key=str) == sorted([(WorkHeat, None), (LossHeat, 0.0), (LossHeat, 1.0)], key=str)
