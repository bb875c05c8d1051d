"""The noise of a channel as a bench sees it: slow noise at rest, floors, and how well these are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error.block_noise import noise_floor
from nlsdesign.bench.identification.equation_error.evidence import Bench, NoiseFloor
from nlsdesign.bench.identification.equation_error.noise import (
    Noise,
    NoisePart,
    estimate_noise,
    independent_number,
)
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.residuals import effective_size
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.rig.conditions import first_order_noise
from tests.unit.bench.identification.test_order_of_records import COLUMNS, SIGNALS, record

FORCE, STEP, COUNT = "force", 0.002, 6000
FLICKER = [NoisePart(0.16, time) for time in (0.004, 0.0225, 0.126, 0.71, 4.0)]
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


def driven_by_counts(gain: float) -> RecordSet:
    """A motion in coarse counts, and a current with white noise that follows their filtered rate."""
    draw, time = np.random.default_rng(5), STEP * np.arange(COUNT)
    angle = 1e-3 * np.round(0.4e3 * np.sin(3.0 * time))
    rate = lfilter([0.5], [1.0, -0.5], np.diff(angle, prepend=angle[0]) / STEP)
    current = np.cos(3.0 * time) - gain * rate + 0.02 * draw.standard_normal(COUNT)
    units = {"angle": "rad", "current": "A"}
    trace = Trace(time, {"angle": angle, "current": current}, units, "loop")
    columns = (Column("angle", "angle", "rad", quantum=1e-3), Column("current", "current", "A"))
    return RecordSet((Record("loop", trace, "fit"),), columns)


def test_a_current_that_jumps_with_the_counts_of_an_encoder_is_not_the_noise_of_the_ammeter() -> None:
    quiet, loud = driven_by_counts(0.0), driven_by_counts(1.0)
    # The differences of the current cannot tell its jumps from noise.
    assert loud.records[0].resolution_of("current").noise > 0.1
    assert estimate_noise(loud).level["current"] == pytest.approx(0.02, rel=0.05)
    assert estimate_noise(quiet).level["current"] == pytest.approx(0.02, rel=0.05)


def floors_with(parts: tuple[NoisePart, ...]) -> dict[str, NoiseFloor]:
    """Floors of a bench whose force has noise that remembers, seen in ten rests of 0.1 s."""
    records = RecordSet((record("a", 0.2, 1e-3),), COLUMNS)
    noise = estimate_noise(records)
    name = "force_sensor.reading"
    slow = tuple(p._replace(variance=p.variance * noise.level[name] ** 2) for p in parts)
    seen = {name: (0.1,) * 10} if parts else {}
    bench = Bench(records, list(BLOCKS.values()),
                  noise=Noise(noise.level, noise.rounded, {name: slow}, {}, seen))  # fmt: skip
    for block in BLOCKS:
        assert bench.block_noise[block].known == pytest.approx(bench.block_noise[block].floors["a"].known)
    return {block: bench.block_noise[block].floors["a"] for block in BLOCKS}


def test_the_share_of_a_signal_in_a_floor_is_what_the_floor_lacks_without_its_noise() -> None:
    run = record("a", 0.2, 1e-3)
    bench = Bench(RecordSet((run,), COLUMNS), list(BLOCKS.values()))
    read = bench.block_noise["motor"]
    shares = read.floors["a"].shares
    for name in ("current_sensor.reading", "force_sensor.reading"):
        without = replace(bench.noise, level={**bench.noise.level, name: 0.0})
        whole, rest = (
            float(np.mean(noise_floor(read.block, run, noise, read.filters).sigma ** 2))
            for noise in (bench.noise, without)
        )
        # Of all samples, where the floor is that of the rows.
        assert 0.01 < shares[name] == pytest.approx(1.0 - rest / whole, rel=0.1)


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
