"""The colour of the noise of what drives a body: told above all motion and by what the balance leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from benchmarks._score_run import opened
from nlsdesign.bench.discrepancy import diagnose
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error import input_noise
from nlsdesign.bench.identification.equation_error import noise as channel_noise
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import ROTATION, Assembly, Dashpot, Element, Encoder, Inertia, TorqueRipple, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.rig.conditions import first_order_noise
from tests.rig.kind_cases import write_kind_case

STEP, COUNT, WHITE, SLOW, TIME = 0.002, 3000, 0.02, 0.03, 0.03
COARSE = 4e-3
"""Counts behind which a torque as large as the white noise may turn the body unseen."""
UNITS = {"encoder.reading": "rad", "ball.torque": "N*m"}

LOSS = Dashpot(damping=0.05, domain=ROTATION)


def machine(**more: Element) -> Assembly:
    """A body that is turned by a measured torque, with more parts at it."""
    ties = {name: tie(part, "ball") for name, part in {"loss": LOSS, **more}.items()}
    return assembly(
        "machine", ball=Inertia(inertia=0.01), **ties, encoder=Encoder(of="ball.angle", quantum=1e-5)
    )


def turned(
    slow: float,
    *,
    memory: float = TIME,
    beside_reversals: float = 0.0,
    ripple: float = 0.0,
    count: float = 1e-5,
    frequencies: Sequence[float] = (0.7, 1.6),
    white: str = "",
) -> tuple[Bench, Array]:
    """Some records with noise in the torque, ``slow`` of it remembered; with the noise of the first.

    ``beside_reversals``: by how much more there is where the body is slow. ``ripple``: torque over the angle.
    ``white``: name of a record with white noise alone.
    """
    draw, time, records, noises = np.random.default_rng(7), STEP * np.arange(COUNT), [], []
    for name, frequency in zip(("slow", "quick", "between", "creeping"), frequencies, strict=False):
        pace = 2.0 * np.pi * frequency
        angle, rate = np.sin(pace * time), pace * np.cos(pace * time)
        remembered = first_order_noise(COUNT, memory / STEP, draw)
        remembered *= 1.0 + beside_reversals * (np.abs(rate) < 0.4 * pace)
        noise = WHITE * draw.standard_normal(COUNT) + (name != white) * slow * remembered
        torque = -0.01 * pace**2 * angle + 0.05 * rate + ripple * np.sin(9.0 * angle) + noise
        rows = (count * np.round(angle / count), torque)
        records.append(Record(name, Trace(time, dict(zip(UNITS, rows, strict=True)), UNITS, name)))
        noises.append(noise)
    columns = tuple(Column(name, name, unit) for name, unit in UNITS.items())
    bench = Bench(RecordSet(tuple(records), columns), blocks_of(flatten(machine()), tuple(UNITS)))
    return bench, noises[0]


def test_noise_that_remembers_is_in_the_floor_of_the_block_that_it_drives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench, noise = turned(SLOW)
    assert bench.noise.evidence["ball.torque"] == "above motion"
    assert bench.noise.deviation("ball.torque") == pytest.approx(float(np.hypot(WHITE, SLOW)), rel=0.15)
    (colour,) = bench.noise.colours["ball.torque"]["slow"].parts
    assert 0.5 * TIME < colour.time < 2.0 * TIME
    monkeypatch.setattr(input_noise, "_OPEN", np.inf)
    floors = [each.block_noise["ball"].floors["slow"] for each in (bench, turned(SLOW)[0])]
    true = float(np.std(floors[0].filter @ noise))
    assert float(np.median(floors[0].sigma)) == pytest.approx(true, rel=0.2)
    assert float(np.median(floors[1].sigma)) < 0.6 * true, "or the test would show nothing"
    assert floors[0].independent < len(floors[0].sigma)


def test_another_record_of_the_bench_has_the_mean_of_the_colours() -> None:
    noise = turned(SLOW)[0].noise
    each = [noise.in_record(name).deviation("ball.torque") for name in ("slow", "quick")]
    assert each[0] != each[1]
    assert noise.in_record("another").deviation("ball.torque") == pytest.approx(
        float(np.hypot(*each)) / 2**0.5
    )


@pytest.mark.long_cases("with the angle")
@pytest.mark.parametrize(
    ("clause", "no_clause", "what"),
    [
        ("_SEEN", -np.inf, {"slow": 0.3 * WHITE, "memory": 0.5}),
        ("_CONTRADICTED", np.inf, {"slow": SLOW, "beside_reversals": 1.5}),
        ("_CONTRADICTED", np.inf, {"slow": SLOW, "ripple": 0.2}),
    ],
    ids=["white above motion", "with reversals", "with the angle"],
)
def test_what_is_no_noise_is_not_taken_for_it(
    clause: str, no_clause: float, what: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert turned(**what)[0].noise.evidence["ball.torque"] == "white only"
    monkeypatch.setattr(channel_noise if clause == "_CONTRADICTED" else input_noise, clause, no_clause)
    assert turned(**what)[0].noise.evidence["ball.torque"] == "above motion", "this clause decides"


@pytest.mark.parametrize(("order", "shown"), [(9.0, True), (4.0, False)])
def test_what_goes_with_the_motion_hides_a_colour_until_it_is_in_the_model(order: float, shown: bool) -> None:
    bench, noise = turned(SLOW, ripple=0.2)
    ripple = TorqueRipple(domain=ROTATION, sine=0.2, cosine=0.0, order=order)
    assert bench.coloured_beside(blocks_of(flatten(machine()), tuple(UNITS))) is None
    beside = bench.coloured_beside(blocks_of(flatten(machine(ripple=ripple)), tuple(UNITS)))
    assert (beside is not None) == shown
    if beside is not None:
        assert beside.noise.evidence["ball.torque"] == "above motion"
        assert beside.noise.deviation("ball.torque") == pytest.approx(float(np.std(noise)), rel=0.15)
        before, after = (each.block_noise["ball"].floors["slow"] for each in (bench, beside))
        assert float(np.median(after.sigma)) > 1.5 * float(np.median(before.sigma))


def test_counts_that_hide_what_a_torque_does_show_no_colour() -> None:
    assert turned(SLOW, count=3e-3)[0].noise.evidence["ball.torque"] == "white only"


def test_where_counts_may_hide_it_in_all_of_three_records_what_the_balance_leaves_decides() -> None:
    three = (0.7, 1.6, 1.1)
    assert turned(SLOW, count=COARSE)[0].noise.evidence["ball.torque"] == "white only", "two are too few"
    bench, _ = turned(SLOW, count=COARSE, frequencies=three)
    assert bench.noise.evidence["ball.torque"] == "above motion"
    assert bench.noise.deviation("ball.torque") == pytest.approx(float(np.hypot(WHITE, SLOW)), rel=0.15)
    bench, _ = turned(SLOW, count=COARSE, frequencies=three, ripple=0.2)
    assert bench.noise.evidence["ball.torque"] == "white only", "what goes with the motion is no noise"


@pytest.mark.parametrize(("white", "shown"), [("", "above motion"), ("creeping", "white only")])
def test_a_record_whose_counts_hide_nothing_and_that_is_white_outweighs_three_that_may_hide(
    white: str, shown: str
) -> None:
    bench, _ = turned(SLOW, count=COARSE, frequencies=(0.7, 1.6, 1.1, 0.08), white=white)
    assert bench.noise.evidence["ball.torque"] == shown


@pytest.mark.long_cases("screw_carriage", "belt_axis")
@pytest.mark.parametrize("kind", ["screw_carriage", "belt_axis"])
def test_a_clean_machine_whose_current_has_a_colour_gets_no_name(kind: str, tmp_path: Path) -> None:
    """A drifting clock was named on the belt: its floor was too low, and half a sample of a hold was left."""
    write_kind_case(tmp_path, kind, (), 0.0, 1192, condition="coloured")
    verdict = diagnose(*opened(tmp_path))
    assert (verdict.verdict, verdict.effects) == ("none", ())


@pytest.mark.slow
def test_two_names_are_sure_once_the_noise_beside_them_is_read(tmp_path: Path) -> None:
    """With white noise alone something without a name was left, and the delay had a probability of a half."""
    write_kind_case(
        tmp_path,
        "geared_joint",
        ("drive_delay", "coulomb_friction"),
        1.0,
        1457,
        condition="coloured",
        says_held=True,
    )
    verdict = diagnose(*opened(tmp_path))
    assert {effect.name for effect in verdict.effects} == {"drive_delay", "coulomb_friction"}
    assert verdict.complete
    assert min(effect.probability for effect in verdict.effects) > 0.85
