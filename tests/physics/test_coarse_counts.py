"""Inertia, damping and dry friction of a body, whatever the sampling rate and the counts of its encoder.

The body is simulated here, J·dω/dt = T − b·ω − T_c·sgn ω with friction as an impulse that holds at rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from nlsdesign.bench.discrepancy import Refit, predict, refit
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet
from nlsdesign.bench.identification.equation_error.block_noise import rate_span
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.records.measurement import Record
from nlsdesign.components import (
    ROTATION,
    CoulombFriction,
    Dashpot,
    Inertia,
    Regularised,
    assembly,
    tie,
)
from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace

TRUE = {"stage.inertia": 0.05, "viscous.damping": 0.08, "dry.sliding_effort": 0.06}
FINE, TORQUE_NOISE = 1e-4, 0.01
COLUMNS = (Column("q", "stage.angle", "rad"), Column("T", "stage.torque", "N*m"))
UNITS = {"stage.angle": "rad", "stage.torque": "N*m"}


def motion(seed: int, *, fastest: float = 1.7, seconds: float = 8.0) -> tuple[Array, Array, Array]:
    """Time, angle and torque at every step, from rest."""
    draw = np.random.default_rng(seed)
    time = np.arange(round(seconds / FINE)) * FINE
    torque = np.zeros_like(time)
    for share in (0.24, 0.53, 1.0):
        torque += 0.5 * share * np.sin(2 * np.pi * share * fastest * time + draw.uniform(0, 2 * np.pi))
    torque *= np.clip(time / 0.5, 0.0, 1.0)
    inertia, damping, friction = TRUE.values()
    angle, speed, place, most = np.empty_like(time), 0.0, 0.0, FINE * friction / inertia
    for k, push in enumerate(torque.tolist()):
        angle[k] = place
        free = speed + FINE * (push - damping * speed) / inertia
        speed = free - most if free > most else free + most if free < -most else 0.0
        place += FINE * speed
    return time, angle, torque


def record(history: tuple[Array, Array, Array], name: str, rate: float, counts: int, seed: int) -> Record:
    """What a bench samples: the encoder stands anywhere, the torque is noisy."""
    draw, every = np.random.default_rng([seed, counts]), round(1.0 / (rate * FINE))
    time, angle, torque = (row[::every] for row in history)
    quantum = 2.0 * np.pi / counts
    read = quantum * np.round((angle + draw.uniform(0.0, quantum)) / quantum)
    noisy = torque + TORQUE_NOISE * draw.standard_normal(len(time))
    return Record(name, Trace(time, {"stage.angle": read, "stage.torque": noisy}, UNITS, name))


def declared() -> Assembly:
    """Numbers a third too large, known to a factor of four."""
    rubbing = CoulombFriction(sliding_effort=0.08, domain=ROTATION, contact=Regularised(creep_speed=1e-3))
    body = assembly(
        "body",
        stage=Inertia(inertia=0.067),
        viscous=tie(Dashpot(damping=0.107, domain=ROTATION), "stage"),
        dry=tie(rubbing, "stage"),
    )
    numbers = body.quantities()
    return body.with_values({name: replace(numbers[name], spread=3.0) for name in TRUE})


def fitted(seed: int, rate: float, counts: int) -> Refit:
    histories = [motion(10 * seed + k) for k in range(2)]
    runs = [record(h, f"r{k}", rate, counts, 10 * seed + k) for k, h in enumerate(histories)]
    return refit(declared(), RecordSet((*runs, replace(runs[1], name="held", role="held_out")), COLUMNS))


def scores(found: Refit) -> dict[str, float]:
    """How far each number is from the truth, in its standard errors."""
    return {n.name: (n.fitted - TRUE[n.name]) / n.standard_error for n in found.numbers}


@pytest.mark.long_cases("1000.0", "500.0", "200.0")
@pytest.mark.parametrize("rate", [1000.0, 500.0, 200.0, 100.0])
def test_the_same_motion_gives_the_same_numbers_at_every_sampling_rate(rate: float) -> None:
    found = fitted(1, rate, 4096)
    assert np.max(np.abs(list(scores(found).values()))) < 3.0
    for number in found.numbers:
        assert number.fitted == pytest.approx(TRUE[number.name], rel=0.03)
    (inertia,) = (n for n in found.numbers if n.name == "stage.inertia")
    assert inertia.fitted == pytest.approx(0.05, rel=0.005)
    assert inertia.standard_error < 0.005 * 0.05


def coverage(seeds: range, counts: int) -> tuple[Array, Array]:
    """Share of the seeds whose intervals hold each true number, and the mean of their scores."""
    all_scores = np.array([list(scores(fitted(seed, 500.0, counts)).values()) for seed in seeds])
    return np.mean(np.abs(all_scores) < 1.96, axis=0), np.mean(all_scores, axis=0)


@pytest.mark.long_cases("8192")
@pytest.mark.parametrize("counts", [512, 8192])
def test_intervals_hold_the_truth_at_coarse_and_at_fine_counts(counts: int) -> None:
    held, mean = coverage(range(3, 5), counts)
    assert np.mean(held) > 0.8
    assert np.max(np.abs(mean)) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("counts", [512, 2048, 8192])
def test_intervals_of_many_seeds_hold_the_truth_as_often_as_they_say(counts: int) -> None:
    held, mean = coverage(range(40), counts)
    assert np.all(held >= 0.9)
    assert np.max(np.abs(mean)) < 0.8


def test_an_acceleration_that_is_mostly_rounding_is_no_measurement_of_an_inertia() -> None:
    """At 64 counts it would be 0.023 kg·m² with an error of 0.006, where 0.05 is true."""
    with pytest.raises(MeasurementError, match=r"block 'stage': \d+ % of the power of its acceler"):
        fitted(3, 500.0, 64)
    (inertia,) = (n for n in fitted(3, 500.0, 128).numbers if n.name == "stage.inertia")
    assert inertia.fitted == pytest.approx(0.05, abs=3.0 * inertia.standard_error)


def test_filters_are_widths_in_time_and_held_out_records_do_not_move_them() -> None:
    histories = [motion(k) for k in range(2)]
    model = flatten(declared())

    def filters_of(rate: float, *, fast: bool = False) -> tuple[float, float]:
        runs = [record(h, f"r{k}", rate, 4096, k) for k, h in enumerate(histories)]
        last = record(motion(5, fastest=4.0), "held", rate, 64, 5) if fast else runs[1]
        records = RecordSet((*runs, replace(last, name="held", role="held_out")), COLUMNS)
        return Bench(records, blocks_of(model, records.signals)).block_noise["stage"].filters[:2]

    fine, coarse = filters_of(1000.0), filters_of(200.0)
    assert coarse == pytest.approx(fine, rel=0.5)
    assert 0.01 < fine[0] < 0.05
    assert filters_of(200.0, fast=True) == coarse


def swung(rate: float) -> RecordSet:
    """A swing of 5 Hz and the torque that it takes."""
    time = np.arange(0.0, 20.0, 1.0 / rate)
    turn = 2.0 * np.pi * 5.0
    inertia, damping, friction = TRUE.values()
    angle, speed = np.sin(turn * time + 0.3), turn * np.cos(turn * time + 0.3)
    torque = damping * speed + friction * np.sign(speed) - inertia * turn**2 * angle
    noisy = torque + TORQUE_NOISE * np.random.default_rng(1).standard_normal(len(time))
    signals = {"stage.angle": np.round(angle / 1e-4) * 1e-4, "stage.torque": noisy}
    run = Record("r0", Trace(time, signals, UNITS, "r0"))
    return RecordSet((run, replace(run, name="held", role="held_out")), COLUMNS)


def test_a_motion_that_is_sampled_too_coarsely_says_how_often_it_would_need() -> None:
    with pytest.raises(MeasurementError, match=r"sampled too coarsely at 25 Hz -> sample at 60 Hz or more"):
        refit(declared(), swung(25.0))


def test_ten_samples_a_period_are_enough_for_an_inertia() -> None:
    history = motion(1, fastest=2.5)
    runs = [record(history, "r0", 25.0, 8192, 1)]
    found = refit(declared(), RecordSet((*runs, replace(runs[0], name="h", role="held_out")), COLUMNS))
    numbers = {n.name: n.fitted for n in found.numbers}
    assert numbers["stage.inertia"] == pytest.approx(0.05, rel=0.05)


def reversed_sharply(quantum: float) -> RecordSet:
    """A body that turns at a nearly even speed and reverses each second within a tenth of a second."""
    count, half = np.arange(80_000), 0.05
    time, turn, since = FINE * count, (count + 5000) // 10_000, FINE * ((count + 5000) % 10_000 - 5000)
    edge = np.sin(0.5 * np.pi * np.clip(since / half, -1.0, 1.0))
    speed = edge * (1.0 - 2.0 * (turn % 2)) + 0.3 * np.sin(1.9 * time)
    inertia, damping, friction = TRUE.values()
    torque = inertia * np.gradient(speed, FINE) + damping * speed + friction * np.sign(speed)
    history, counts = (time, np.cumsum(speed) * FINE, torque), round(2.0 * np.pi / quantum)
    runs = [record(history, name, 1000.0, counts, k) for k, name in enumerate("ab")]
    return RecordSet((runs[0], replace(runs[1], role="held_out")), COLUMNS)


@pytest.mark.slow
def test_rates_follow_sharp_reversals_as_closely_as_the_counts_of_an_encoder_allow() -> None:
    numbers = declared().quantities()
    truth = declared().with_values({name: numbers[name].with_value(v, "") for name, v in TRUE.items()})
    spans, unbalanced = [], []
    for quantum in (1e-6, 1e-3, 2e-2):
        records = reversed_sharply(quantum)
        spans.append(
            Bench(records, blocks_of(flatten(truth), records.signals)).block_noise["stage"].filters.span
        )
        short_of = gaussian_filter1d(predict(truth, records, "b")["stage.unbalanced"], 8.0)[200:-200]
        unbalanced.append(float(np.sqrt(np.mean(short_of**2))))
        assert np.max(np.abs(list(scores(refit(declared(), records)).values()))) < 3.0
        # A block takes a shorter one where that of the motion takes too much from its rates.
        assert spans[-1] < 1.2 * rate_span(records.records, "stage.angle")
    # A reversal takes 0.1 s; coarse counts need a longer time for the same noise of a rate.
    assert spans[0] < 0.06
    assert spans == sorted(spans)
    assert spans[2] > 2.0 * spans[0]
    # The noise of the torque behind the same filter is 0.0019 N*m.
    assert unbalanced[0] < 0.0025
