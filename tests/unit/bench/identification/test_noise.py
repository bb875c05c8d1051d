"""The noise of a channel as a bench sees it: slow noise at rest, floors, and how well these are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error.block_noise import noise_of_blocks
from nlsdesign.bench.identification.equation_error.evidence import Bench, BlockNoise
from nlsdesign.bench.identification.equation_error.noise import (
    Noise,
    NoisePart,
    estimate_noise,
    independent_number,
)
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.residuals import effective_size, rmse
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.rig.conditions import first_order_noise
from tests.unit.bench.identification.test_order_of_records import COLUMNS, SIGNALS, record

FORCE, STEP, COUNT = "force", 0.002, 6000
ANGLE, CURRENT, FORCE_READING = SIGNALS
FLICKER = [NoisePart(0.16, time) for time in (0.004, 0.0225, 0.126, 0.71, 4.0)]
EFFORT_PER_AMPERE = 25.0 * 0.0302
"""Gear ratio times torque constant of the rig, in N·m/A."""
BLOCKS = {b.name: b for b in blocks_of(flatten(declare(load_deck("test_rig"))), tuple(SIGNALS))}


def steps(seed: int) -> RecordSet:
    """An encoder that rests for 1.7 s at each of seven places, and a force of nothing but 1/f noise."""
    draw = np.random.default_rng(seed)
    angle = 100.0 * (np.arange(COUNT) // 858)
    slow = [math.sqrt(p.variance) * first_order_noise(COUNT, p.time / STEP, draw) for p in FLICKER]
    force = np.sum(slow, axis=0) + 0.6 * draw.standard_normal(COUNT)
    units = {"angle": "rad", FORCE: "N"}
    trace = Trace(STEP * np.arange(COUNT), {"angle": angle, FORCE: force}, units, "steps")
    columns = (Column("angle", "angle", "rad", quantum=1.0), Column(FORCE, FORCE, "N"))
    return RecordSet((Record("steps", trace, "fit"),), columns)


def test_the_deviation_of_flicker_noise_is_told_from_rests_that_are_shorter_than_it_remembers() -> None:
    found = [estimate_noise(steps(seed), {FORCE}) for seed in range(8)]
    true = 0.36 + sum(p.variance for p in FLICKER)
    assert np.median([noise.deviation(FORCE) ** 2 for noise in found]) == pytest.approx(true, rel=0.2)
    for noise in found:
        assert noise.evidence[FORCE] == "rest"
        # Of each rest the last two thirds.
        assert len(noise.seen[FORCE]) == 7
        assert noise.seen[FORCE] == pytest.approx((1.144,) * 7, abs=0.02)


def floors_with(parts: tuple[NoisePart, ...]) -> dict[str, BlockNoise]:
    """Floors of a bench whose force has noise that remembers, seen in ten rests of 0.1 s."""
    records = RecordSet((record("a", 0.2, 1e-3),), COLUMNS)
    noise = estimate_noise(records)
    name = "force_sensor.reading"
    slow = tuple(p._replace(variance=p.variance * noise.level[name] ** 2) for p in parts)
    seen = {name: (0.1,) * 10} if parts else {}
    bench = Bench(records, list(BLOCKS.values()),
                  noise=Noise(noise.level, noise.rounded, {name: slow}, {}, seen))  # fmt: skip
    for block in BLOCKS:
        assert bench.known_from(block) == pytest.approx(bench.floors[block, "a"].known)
    return {block: bench.floors[block, "a"] for block in BLOCKS}


def test_slow_noise_leaves_fewer_independent_rows_and_a_floor_that_is_less_known() -> None:
    white, slow = floors_with(()), floors_with((NoisePart(1.0, 0.05),))
    for block in BLOCKS:
        assert white[block].independent == white[block].known == math.inf
        assert slow[block].independent < len(slow[block].sigma)
        # All rests together are 1 s long.
        assert slow[block].known < 1.0 / STEP
    # The force is all that is noisy behind a spring, and one of several inputs of a motor.
    assert slow["spring"].independent / len(slow["spring"].sigma) < 0.5
    assert slow["motor"].independent > slow["spring"].independent * 0.5


def test_a_short_sample_of_slow_noise_seems_to_hold_more_independent_rows_than_it_does() -> None:
    """So the smaller of both numbers counts."""
    count, whole = COUNT // 4, 0.36 + sum(p.variance for p in FLICKER)
    shares = [p._replace(variance=p.variance / whole) for p in FLICKER]
    seen = [effective_size(steps(seed).records[0].trace[FORCE][::4]) for seed in range(9)]
    assert np.median(seen) > 1.5 * independent_number(shares, count, 4 * STEP)


def driven(seed: int, *, slow: float, jolts: float = 0.0, count: float = 1e-5) -> tuple[RecordSet, Array]:
    """A body of 0.01 A·s²/rad, its angle in counts, and a current with noise; with both the noise alone.

    The noise is white, of 0.02 A, and ``slow`` A that remember for 20 ms. What drives the body is a sine and
    ``jolts`` A that remember for 20 ms too.
    """
    draw, time = np.random.default_rng(seed), STEP * np.arange(COUNT)
    remembered = [first_order_noise(COUNT, 0.02 / STEP, draw) for _ in range(2)]
    noise = 0.02 * draw.standard_normal(COUNT) + slow * remembered[0]
    current = np.sin(2.0 * np.pi * 1.3 * time) + jolts * remembered[1]
    angle = np.cumsum(np.cumsum(current / 0.01) * STEP) * STEP
    angle -= np.polynomial.Polynomial.fit(time, angle, 3)(time)
    rows = (count * np.round(angle / count), current + noise, 100.0 * angle)
    trace = Trace(time, dict(zip(SIGNALS, rows, strict=True)), SIGNALS, "sine")
    quanta = {ANGLE: count, FORCE_READING: 1e-3}
    columns = tuple(Column(name, name, unit, quantum=quanta.get(name, 0.0)) for name, unit in SIGNALS.items())
    return RecordSet((Record("sine", trace, "fit"),), columns), noise


def test_noise_of_a_current_that_remembers_is_seen_above_all_motion() -> None:
    ratios = []
    for seed in range(5):
        records, noise = driven(seed, slow=0.03)
        seen = estimate_noise(records, (), [CURRENT])
        assert seen.evidence[CURRENT] == "above motion"
        ratios.append(seen.deviation(CURRENT) / float(np.std(noise)))
    assert 0.85 < np.median(ratios) < 1.25
    plain = estimate_noise(records)
    assert plain.deviation(CURRENT) < 0.75 * float(np.std(noise)), "or the test would show nothing"


def test_white_noise_of_a_current_stays_white() -> None:
    for seed in range(5):
        seen = estimate_noise(driven(seed, slow=0.0)[0], (), [CURRENT])
        assert seen.deviation(CURRENT) == pytest.approx(0.02, rel=0.05)


def test_a_current_that_moves_the_body_is_no_noise() -> None:
    """What the noise of the other test does to the body would be seen in its counts: so it is not there."""
    for seed in range(5):
        seen = estimate_noise(driven(seed, slow=0.0, jolts=0.03)[0], (), [CURRENT])
        assert seen.deviation(CURRENT) < 0.026


def test_counts_that_hide_what_a_current_does_show_no_colour() -> None:
    seen = estimate_noise(driven(0, slow=0.03, count=0.05)[0], (), [CURRENT])
    assert seen.evidence[CURRENT] == "white only"


def test_the_floor_of_a_block_holds_the_colour_of_the_current_that_drives_it() -> None:
    records, noise = driven(0, slow=0.03)
    blocks = list(BLOCKS.values())
    bench = Bench(records, blocks)
    floor = noise_of_blocks(blocks, records, bench.noise, bench.filters)[1]["motor", "sine"]
    true = EFFORT_PER_AMPERE * float(np.std(floor.filter @ noise))
    assert 0.7 * true < rmse(floor.sigma) < 1.6 * true
    plain = noise_of_blocks(blocks, records, estimate_noise(records), bench.filters)[1]["motor", "sine"]
    assert rmse(plain.sigma) < 0.5 * true, "or the test would show nothing"
