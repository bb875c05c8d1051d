"""Records on a finer clock: what a model does between samples is evaluated, and nothing else changes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.block_prediction import band_errors, predict
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error import block_noise, evidence, inferred_sampling
from nlsdesign.bench.identification.equation_error.block import Block
from nlsdesign.bench.identification.equation_error.evidence import Bench, covered, on_clock
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.records.sampling import HELD, SAMPLED
from nlsdesign.components import ROTATION, Dashpot, Encoder, Inertia, Spring, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, measure, simulate

CAM = declare(load_deck(str(Path(__file__).parents[4] / "models" / "templates" / "cam-actuator.toml")))
STEP = 5e-3
MEASURED = ("motor_encoder.reading", "motor.current")


def sine(frequency: float = 3.0) -> Record:
    """Four seconds at 200 Hz; the cable changes sides of the cam in less than a sample."""
    fine = 1e-3 * np.arange(4001)
    current = 0.3 * np.sin(math.tau * frequency * fine)
    run = simulate(flatten(CAM), fine, inputs={"motor.current": current}, tolerance=1e-7)
    angle = measure(run, CAM, seed=1)["motor_encoder.reading"]
    signals = {"motor_encoder.reading": angle[::5], "motor.current": current[::5]}
    return Record("sine", Trace(fine[::5], signals, dict(zip(MEASURED, ("rad", "A"), strict=True)), "sine"))


RECORDS = RecordSet((sine(),), tuple(Column(n, n, u) for n, u in zip(MEASURED, ("rad", "A"), strict=True)))


def squares(bench: Bench) -> float:
    (block,) = bench_blocks()
    (each,) = bench.evidence(bench.driven(block, []), bench.records.records, {})
    return float(np.mean(each.residual({})[0] ** 2))


def bench_blocks() -> list[Block]:
    return list(blocks_of(flatten(CAM), MEASURED))


def test_a_corner_that_is_passed_between_samples_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(RECORDS, bench_blocks())
    assert bench.clock < 0.6 * STEP
    assert squares(bench) < 1.4
    (remark,) = bench.records.remarks
    assert "sampled so slowly" in str(remark)
    monkeypatch.setattr(evidence, "resolving_step", lambda *_: math.inf)
    assert squares(Bench(RECORDS, bench_blocks())) > 1.4, "or the test would show nothing"


def test_what_is_predicted_stays_on_the_samples_as_measured() -> None:
    assert predict(CAM, RECORDS, "sine").time.shape == RECORDS.records[0].trace.time.shape
    (error,) = band_errors(CAM, RECORDS, "sine").values()
    assert error.error < 1.2 * error.noise_floor


def test_samples_stay_between_which_others_are_put() -> None:
    whole = RECORDS.records[0]
    finer = whole.refined(4)
    assert finer.step == pytest.approx(0.25 * STEP)
    for name in MEASURED:
        np.testing.assert_allclose(finer.trace[name][::4], whole.trace[name], atol=1e-12)
        assert finer.resolution_of(name).quantum == pytest.approx(2.0 * whole.resolution_of(name).quantum)
    assert on_clock(RECORDS, STEP) is RECORDS


def test_a_masked_sample_has_no_part_in_what_is_put_beside_it() -> None:
    whole = RECORDS.records[0]
    mask = np.zeros(len(whole.trace), dtype=bool)
    mask[200] = True
    spoilt = whole.trace["motor.current"].copy()
    spoilt[200] += 1e3
    signals = {**whole.trace.signals, "motor.current": spoilt}
    one, other = (
        replace(whole, masked={"motor.current": mask}, trace=trace).refined(2)
        for trace in (whole.trace, replace(whole.trace, signals=signals))
    )
    np.testing.assert_array_equal(one.trace["motor.current"], other.trace["motor.current"])
    assert list(np.flatnonzero(one.masked["motor.current"])) == [399, 400, 401]


@pytest.mark.parametrize("least", [block_noise.LEAST_COVERED, 0.0])
def test_a_quick_swing_is_read_across_its_reversals(monkeypatch: pytest.MonkeyPatch, least: float) -> None:
    """Nine samples a period, in the last tenth fifteen: only there a filter fits between two reversals."""
    swing = assembly(
        "swing",
        ball=Inertia(inertia=0.02),
        loss=tie(Dashpot(damping=1e-3, domain=ROTATION), "ball"),
        spring=tie(Spring(stiffness=3.0, domain=ROTATION), "ball"),
        encoder=Encoder(of="ball.angle", quantum=1e-5),
    )
    period = np.where(np.arange(4000) < 3600, 9.0, 15.0)
    angle = 1e-5 * np.round(1e5 * np.sin(math.tau * np.cumsum(1.0 / period)))
    units = {"encoder.reading": "rad", "ball.torque": "N*m"}
    trace = Trace(0.01 * np.arange(4000), dict(zip(units, (angle, 0.0 * angle), strict=True)), units, "swing")
    columns = tuple(Column(name, name, unit) for name, unit in units.items())
    monkeypatch.setattr(block_noise, "LEAST_COVERED", least)
    bench = Bench(RecordSet((Record("swing", trace),), columns), blocks_of(flatten(swing), tuple(units)))
    (floor,) = bench.block_noise["ball"].floors.values()
    if least:
        assert len(floor.sigma) > 3000
        assert covered(bench)["ball"] > 0.9
        assert bench.records.remarks == ()
    else:
        assert len(floor.sigma) < 100
        (remark,) = bench.records.remarks
        assert "is judged on rows with 1 % of the power of its motion" in str(remark)


def test_a_balance_whose_numbers_are_all_free_does_not_vanish_with_them() -> None:
    """J·a = k·i with both J and k free: no number is no answer, and the current is sampled as it was."""
    draw, time = np.random.default_rng(3), 2e-3 * np.arange(400)
    current = {late: np.sin(30.0 * (time - late * 2e-3)) for late in (0.0, 0.5, -0.5)}
    accelerating = current[0.0] + 1e-2 * draw.standard_normal(len(time))
    residuals = np.array([accelerating - current[late] for late in (0.0, 0.5, -0.5)]) / 1e-2
    # The slopes are those of the last way to run: with them the balance is made of its own numbers.
    numbers = {"motor.inertia": accelerating / 1e-2, "motor.torque_constant": -current[-0.5] / 1e-2}
    rows = inferred_sampling.BlockRows(residuals, numbers, np.zeros((len(time), 0)))
    found = inferred_sampling._likelihood([rows])
    assert found is not None
    assert abs(found.shift) < 0.1
    assert found.taken() == (SAMPLED, "")


def test_a_noisy_balance_does_not_drown_what_another_tells() -> None:
    """One tells that a signal is held; another, with a hundred times its noise, leans the other way."""
    draw, time = np.random.default_rng(3), 2e-3 * np.arange(400)
    slope = np.cos(30.0 * time)
    clear, noisy = draw.standard_normal((2, len(time)))
    residuals = [
        np.array([own + size * (late - shift) * slope for late in (0.0, 0.5, -0.5)])
        for own, size, shift in ((clear, 2.0, 0.5), (100.0 * noisy, 4.0, -0.5))
    ]
    rows = [inferred_sampling.BlockRows(each, {}, np.zeros((len(time), 0))) for each in residuals]
    alone, both = (inferred_sampling._likelihood(some) for some in (rows[:1], rows))
    assert alone is not None
    assert both is not None
    assert alone.taken()[0] is HELD
    assert both.taken()[0] is HELD
    assert both.error == pytest.approx(alone.error, rel=0.01)
