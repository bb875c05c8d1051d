"""Effects apply wherever they make sense, whatever parts are called and in whatever order they stand."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects import ALL, Candidate, Unknown
from nlsdesign.bench.discrepancy.effects.places import turns_per_turn
from nlsdesign.bench.discrepancy.effects.sizes import LONGEST, QUICKEST, Sizes, efforts_on, span_of
from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import (
    Assembly,
    DriveDelay,
    Inertia,
    Mass,
    Part,
    Screw,
    Sensor,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import read_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.effect_machines import MACHINES, bare, joint, servo, slide, tensile, torsion, wheels
from tests.renamed import SCHEMES, Renamed, Scheme, renamed
from tests.selection import quick_only

ONE_KIND_OF_MACHINE = {"cam_profile_error", "cable_friction"}
"""What only a contour, or a cable with something around it, can have: it is looked at on the rig alone."""


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.__name__)
def test_every_effect_is_offered_on_two_machines(effect: object) -> None:
    machines = {name: (made(), bare(made())) for name, made in MACHINES.items()}
    able = {name for name, pair in machines.items() if any(effect(each) for each in pair)}  # type: ignore[operator]
    wanted = 1 if effect.__name__ in ONE_KIND_OF_MACHINE else 2  # type: ignore[attr-defined]
    assert len(able) >= wanted, (
        f"offered on {able}: add machines that can have it to tests/effect_machines.py"
    )


@pytest.mark.long_cases("rig")
@pytest.mark.parametrize("name", quick_only(MACHINES, ["rig"]))
def test_each_candidate_is_a_deck_and_begins_within_its_bounds(name: str) -> None:
    machine = bare(MACHINES[name]())
    for effect in ALL:
        for found in effect(machine):
            values = flatten(found.assembly).values
            for unknown in found.unknowns:
                assert unknown.name in values
                assert all(unknown.lower < start < unknown.upper for start in unknown.starts), unknown
                if unknown.null is not None and unknown.lower < 0.0:
                    assert unknown.lower < unknown.null < unknown.upper
            assert any(unknown.null is not None for unknown in found.unknowns), effect.__name__
            assert declare(read_deck(deck_text(found.assembly), Path("x.toml"))) == found.assembly


def test_what_can_be_missing_on_springs_that_a_machine_strains() -> None:
    for made in (tensile, torsion):
        offered = {effect.__name__ for effect in ALL if effect(made())}
        assert offered >= {
            "coulomb_friction", "stribeck_friction", "load_dependent_friction",
            "rate_independent_hysteresis", "strain_stiffening", "second_relaxation", "stress_softening",
            "self_heating", "force_sensor_bias", "force_sensor_gain", "force_sensor_delay",
            "force_sensor_drift", "force_sensor_nonlinearity", "clock_drift",
        }  # fmt: skip
        assert offered.isdisjoint({"drive_delay", "torque_ripple", "backlash", "gravity_load"})


def test_friction_of_a_strained_spring_is_read_by_its_cell() -> None:
    machine = tensile()
    (found,) = [c for e in ALL if e.__name__ == "coulomb_friction" for c in e(machine)]
    model = flatten(found.assembly.with_values({found.unknowns[0].name: 3.0}))
    forward, backward = (model.evaluate([], [0.01, rate])["cell.reading"] for rate in (0.1, -0.1))
    assert (forward, backward) == (pytest.approx(9.0 + 3.0), pytest.approx(9.0 - 3.0))


def test_a_law_beside_a_spring_is_read_with_it_and_offered_once() -> None:
    for name in ("rate_independent_hysteresis", "strain_stiffening", "second_relaxation"):
        (effect,) = [e for e in ALL if e.__name__ == name]
        for machine in (slide(), torsion()):
            for found in effect(machine):
                assert [c for c in effect(found.assembly) if c.location.startswith(found.location)] == []
                cell = found.assembly.sensors()["cell"].of
                assert cell == machine.sensors()["cell"].of


def test_any_drive_may_be_late_saturate_be_compressed_grow_warm_or_drift() -> None:
    faults = {
        "drive_delay", "torque_constant_saturation", "command_compression", "winding_heat",
        "torque_constant_drift",
    }  # fmt: skip
    for made in (joint, servo, slide, MACHINES["drive"]):
        assert {e.__name__ for e in ALL if e(made())} >= faults
    # A wheel beside a motor is no drive of its own, unless something tells so.
    beside = joint().with_part("wheel", Inertia(inertia=1e-3))
    assert {c.location for e in ALL if e.__name__ in faults for c in e(beside)} == {"motor"}
    late = beside.with_part("wheel", Inertia(inertia=1e-3, chain=(("late", DriveDelay(delay=1e-3)),)))
    assert "wheel" in {c.location for e in ALL if e.__name__ == "winding_heat" for c in e(late)}


def test_ripple_begins_at_odd_orders_and_at_those_of_shafts_behind_gears() -> None:
    (effect,) = [e for e in ALL if e.__name__ == "torque_ripple"]
    (found,) = effect(joint())
    order = next(u for u in found.unknowns if u.name.endswith(".order"))
    assert {7.0, 14.0, 21.0, 50.0, 350.0, 2100.0} <= set(order.starts)
    assert order.lower < min(order.starts)
    assert max(order.starts) < order.upper
    assert turns_per_turn(wheels(), "first") == [1.0, pytest.approx(0.2)]
    assert turns_per_turn(wheels(), "second") == [1.0, 5.0]


def test_friction_that_was_named_may_differ_between_the_directions() -> None:
    (coulomb,) = [e for e in ALL if e.__name__ == "coulomb_friction"]
    (uneven,) = [e for e in ALL if e.__name__ == "asymmetric_friction"]
    for made in (joint, slide, tensile):
        assert not uneven(made())
        (even,) = coulomb(made())
        (found,) = uneven(even.assembly)
        assert found.location == even.location
        level = even.unknowns[0].name
        off = found.assembly.with_values({level: 2.0, found.unknowns[0].name: 0.25})
        tied, model = level.rpartition(".")[0], flatten(off)
        speeds = [v.name.endswith(".speed") for v in (*model.states, *model.inputs)]
        count = len(model.states)
        efforts = []
        for rate in (1.0, -1.0):
            values = [rate if is_speed else 0.0 for is_speed in speeds]
            now = model.evaluate(values[:count], values[count:])
            efforts.append(now.get(f"{tied}.torque", now.get(f"{tied}.force")))
        assert efforts == [pytest.approx(2.5), pytest.approx(-1.5)]
        assert not uneven(off)


# --- names and order ------------------------------------------------------------------------------


def reordered(machine: Assembly) -> Assembly:
    """The machine with its tables in another order; sensors stay behind what they read."""
    sensors = [pair for pair in machine.parts if isinstance(pair[1], Sensor)]
    others: list[tuple[str, Part]] = [pair for pair in machine.parts if not isinstance(pair[1], Sensor)]
    return replace(machine, parts=(*reversed(others), *sensors))


def summary(candidate: Candidate, machine: Renamed | None = None) -> tuple[object, ...]:
    """What a candidate is, in the names of the original."""
    back = {new: old for old, new in machine.paths.items()} if machine else {}

    def original(name: str) -> str:
        for path in sorted(back, key=len, reverse=True):
            if name == path or name.startswith(f"{path}."):
                return back[path] + name[len(path) :]
        return name

    def size(unknown: Unknown) -> str:
        return " ".join(
            kind + original(name)
            for word in re.split(r" (?=[*/] )|(?<=[*/]) ", unknown.of)
            for kind, name in [re.fullmatch(r"(efforts on |span of |)(.*)", word).groups()]  # type: ignore[union-attr]
        )

    numbers = tuple((u.starts, u.lower, u.upper, u.null, size(u)) for u in candidate.unknowns)
    return candidate.effect, original(candidate.location), numbers, candidate.simpler


@pytest.mark.parametrize("name", MACHINES)
def test_candidates_do_not_depend_on_the_order_of_tables(name: str) -> None:
    machine = MACHINES[name]()
    written = {summary(c) for effect in ALL for c in effect(machine)}
    assert {summary(c) for effect in ALL for c in effect(reordered(machine))} == written


@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=lambda s: s.__name__)
@pytest.mark.parametrize("name", ["rig", "joint", "servo", "tensile", "wheels"])
def test_candidates_do_not_depend_on_names(name: str, scheme: Scheme) -> None:
    machine = MACHINES[name]()
    other = renamed(machine, scheme)
    written = {summary(c) for effect in ALL for c in effect(machine)}
    assert {summary(c, other) for effect in ALL for c in effect(other.assembly)} == written


# --- sizes ----------------------------------------------------------------------------------------


def swing(machine: Assembly, signals: dict[str, tuple[str, float]], *, spike: float = 0.0) -> RecordSet:
    """One record of sines at 2 Hz, for 3 s."""
    time = np.arange(1500) * 2e-3
    wave = np.sin(4.0 * np.pi * time)
    values = {name: size * wave for name, (_, size) in signals.items()}
    first = next(iter(values))
    values[first] = values[first] + spike * (np.arange(1500) == 700)
    units = {name: unit for name, (unit, _) in signals.items()}
    columns = tuple(Column(name, name, unit) for name, unit in units.items())
    return RecordSet((Record("run", Trace(time, values, units)),), columns)


JOINT = {"ammeter.reading": ("A", 3.0), "encoder.reading": ("rad", 0.4), "cell.reading": ("N*m", 30.0)}


def test_the_size_of_efforts_is_that_of_the_largest_in_whatever_order_they_stand() -> None:
    sizes = typical_sizes(joint(), swing(joint(), JOINT))
    # The spring with 80 N·m/rad at 0.4 rad; the drive gives 4.5 N·m, the oil 0.05 N·m.
    assert sizes[efforts_on("motor")] == pytest.approx(32.0, rel=0.02)
    assert sizes["oil.torque"] == pytest.approx(0.01 * 0.4 * 4.0 * np.pi, rel=0.05)
    turned = reordered(joint())
    again = typical_sizes(turned, swing(turned, JOINT))
    assert {name: again[name] for name in sizes} == pytest.approx(dict(sizes))


def test_where_nothing_but_inertia_is_there_the_effort_is_that_of_the_motion() -> None:
    free = assembly("free", wheel=Inertia(inertia=0.5))
    sizes = typical_sizes(free, swing(free, {"wheel.angle": ("rad", 0.4)}))
    assert sizes[QUICKEST] == pytest.approx(1.0 / (4.0 * np.pi), rel=0.03)
    assert sizes[efforts_on("wheel")] == pytest.approx(0.5 * 0.4 * (4.0 * np.pi) ** 2, rel=0.06)
    assert sizes[LONGEST] == pytest.approx(2.998)


def test_what_is_seen_behind_a_screw_has_the_sizes_of_what_is_in_front_of_it() -> None:
    """A carriage on a screw of 10 mm, its scale at 50 mm and 2 Hz: motor, thread and carriage by hand."""
    made = assembly(
        "axis",
        servo=Inertia(inertia=2e-4),
        carriage=Mass(mass=30.0),
        screw=Screw(between=("servo", "carriage"), lead=0.01),
    )
    sizes, turns = typical_sizes(made, swing(made, {"carriage.position": ("m", 0.05)})), 2.0 * np.pi / 0.01
    speed, quickest = 0.05 * 4.0 * np.pi, 1.0 / (4.0 * np.pi)
    effort = (2e-4 * turns + 30.0 / turns) * speed / quickest
    expected = {
        "carriage.position": 0.05, "carriage.speed": speed, "servo.angle": 0.05 * turns,
        "servo.speed": speed * turns, QUICKEST: quickest, efforts_on("servo"): effort,
        efforts_on("carriage"): effort * turns, span_of("servo.angle"): 0.1 * turns,
        span_of("carriage.position"): 0.1,
    }  # fmt: skip
    assert {name: sizes[name] for name in expected} == pytest.approx(expected, rel=0.06)


def test_one_sample_that_stands_out_is_no_size() -> None:
    clean, spiked = (typical_sizes(joint(), swing(joint(), JOINT, spike=spike)) for spike in (0.0, 300.0))
    for name, size in clean.items():
        assert spiked[name] == pytest.approx(size, rel=0.02), name


def test_sizes_multiply_and_follow_a_piece_into_its_wrapper() -> None:
    sizes = Sizes({"a.b.force": 6.0, "a.b.extension": 0.5, LONGEST: 4.0})
    assert sizes["a.b.force / a.b.extension"] == 12.0
    assert sizes[f"1 / {LONGEST} * a.b.force"] == 1.5
    assert sizes["a.slack.b.force"] == 6.0
    for unknown in ("b.force", "a.slack.force", "a.b.torque", f"{QUICKEST}"):
        assert unknown not in sizes
