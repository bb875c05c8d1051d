"""What is reported of residuals made by hand: the remainder, the gap, and refits over windows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import casadi as ca
import numpy as np
import pytest

from nlsdesign.bench.discrepancy.reporting.advice import where_they_differ
from nlsdesign.bench.discrepancy.reporting.refit import fitted_over_windows, refit, window_gaps, wiring_of
from nlsdesign.bench.discrepancy.reporting.remainder import Remainder, remainder_of
from nlsdesign.bench.discrepancy.reporting.verdict import course_of, gaps_of
from nlsdesign.bench.discrepancy.screening.scale_and_sign import Acting
from nlsdesign.bench.discrepancy.selection.comparison import Comparison, Judged
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error.evidence import Bench, NoiseFloor
from nlsdesign.bench.identification.filters import smoothing
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.records.measurement import Role
from nlsdesign.components import (
    ROTATION,
    Assembly,
    Dashpot,
    Encoder,
    Fixed,
    GearedMotor,
    Inertia,
    Spring,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

TIME = np.arange(6000) * 0.002
SIGMA = 0.1
ROLES: tuple[Role, ...] = ("fit", "fit", "fit", "held_out", "held_out")
COLUMNS = (Column("q", "encoder.reading", "rad"), Column("i", "motor.current", "A"))


def motion(seed: int) -> Record:
    """An angle of three sines and a current that has nothing to do with it."""
    draw = np.random.default_rng(seed)
    waves = [np.sin(w * TIME + p) for w, p in zip(draw.uniform(1, 9, 3), draw.uniform(0, 6, 3), strict=True)]
    signals = {"encoder.reading": sum(waves) / 3.0, "motor.current": draw.standard_normal(len(TIME))}
    units = {"encoder.reading": "rad", "motor.current": "A"}
    return Record(f"r{seed}", Trace(TIME, signals, units, f"r{seed}"), ROLES[seed])


RECORDS = RecordSet(tuple(motion(seed) for seed in range(5)), COLUMNS)


def judged(record: Record, error: Array, *, name: str = "motor", target: str | None = None) -> Judged:
    """One block on one record, its filtered error as given at every sample."""
    matrix = smoothing(len(TIME), 2.0, 5)
    floor = NoiseFloor(matrix, np.full(matrix.shape[0], SIGMA), np.full(len(TIME), SIGMA))
    output = SimpleNamespace(unit="N*m", description="torque")
    block = SimpleNamespace(
        name=name,
        target=target,
        output="motor.unbalanced",
        drives={},
        model=SimpleNamespace(
            outputs=(output,),
            inputs=(),
            symbols=lambda: SimpleNamespace(output=ca.SX(1, 1), input=ca.SX(0, 1)),
        ),
    )
    return Judged(block, record, floor, np.zeros(len(TIME)), matrix @ error / SIGMA)  # type: ignore[arg-type]


def noise(record: Record) -> Array:
    return SIGMA * np.random.default_rng(len(record.name) + int(record.name[1])).standard_normal(len(TIME))


def remainder(law: str) -> Remainder:
    def error(record: Record) -> Array:
        angle, phase = record.trace["encoder.reading"], 2.0 * int(record.name[1])
        return {
            "line": np.sin(2 * np.pi * 7.0 * TIME + phase),
            "drift": 0.3 * TIME,
            "bound": 3.0 * angle**3,
            "nothing": np.zeros_like(TIME),
        }[law] + noise(record)

    return remainder_of([judged(r, error(r)) for r in RECORDS.records], RECORDS, ["encoder.reading"])


def test_a_single_frequency_in_all_records_is_called_periodic() -> None:
    found = remainder("line")
    assert found.kind == "periodic in time at 7 Hz, whatever the motion"
    assert found.size == pytest.approx(np.sqrt(0.5), rel=0.05)
    assert found.floor == pytest.approx(SIGMA)
    assert (found.block, found.quantity, found.unit) == ("motor", "motor.unbalanced", "N*m")
    assert f"and is {found.size:.3g} N·m rms, the noise floor {found.floor:.3g} N·m." in found.words()


def test_a_line_of_one_phase_is_written_as_a_wave_in_the_formula() -> None:
    errors = [judged(r, 0.8 * np.sin(2 * np.pi * 7.0 * TIME) + noise(r)) for r in RECORDS.records]
    found = remainder_of(errors, RECORDS, ["encoder.reading"])
    assert found.kind.startswith("periodic in time at 7 Hz")
    assert found.formula is not None
    # The filter and the grid of frequencies take 2 %.
    assert found.formula.terms == {"sin(2π·7·t)": pytest.approx(0.8, rel=0.03)}


def test_the_same_course_over_time_in_all_records_is_called_a_drift() -> None:
    found = remainder("drift")
    assert found.kind.startswith("a drift")
    assert found.shapes[0][0] == "time"
    assert found.shapes[0][1] > 0.9


def test_a_curve_over_one_signal_is_said_to_be_bound_to_it() -> None:
    found = remainder("bound")
    assert found.kind.startswith("bound to encoder.reading: a curve over it alone explains 9")
    shares = dict(found.shapes)
    assert shares["encoder.reading"] > 0.9
    assert shares["motor.current"] < 0.05


def ringing(record: Record) -> Array:
    """Eight blows, each at a moment and of a sign of its own, that ring at 8 Hz and die away in 0.3 s."""
    draw = np.random.default_rng(int(record.name[1]))
    error = noise(record)
    for blow in np.arange(8) * 1.45 + draw.uniform(0.0, 0.5, 8):
        since = np.maximum(TIME - blow, 0.0)
        error += draw.choice([-1.0, 1.0]) * np.exp(-since / 0.3) * np.sin(2 * np.pi * 8.0 * since)
    return error


@pytest.mark.long_cases("30.0")
@pytest.mark.parametrize("loud", [1.0, 30.0])
def test_ringing_with_a_phase_of_its_own_is_called_a_resonance_however_loud_one_record_is(
    loud: float,
) -> None:
    """In the last record there is nothing but noise, perhaps loud: each record counts alike."""
    *ring, last = RECORDS.records
    errors = [judged(r, ringing(r)) for r in ring] + [judged(last, loud * noise(last))]
    found = remainder_of(errors, RECORDS, ["encoder.reading"])
    kind, _, rest = found.kind.partition(" near ")
    assert (kind, rest.partition(" Hz")[2]) == ("a resonance", ", with a phase of its own in every record")
    assert float(rest.partition(" Hz")[0]) == pytest.approx(8.0, abs=0.5)


def test_noise_has_no_shape() -> None:
    found = remainder("nothing")
    assert found.kind == "bound to no single measured signal and to no single frequency"
    assert found.formula is None


# --- gap ------------------------------------------------------------------------------------------


class Known:
    """A comparison that knows beforehand what it would say of two hypotheses; records in another order."""

    def __init__(self, before: list[Judged], after: list[Judged], given: list[str]) -> None:
        self._said = {"before": before, "after": after}
        self.bench = SimpleNamespace(given_order={name: k for k, name in enumerate(given)})

    def judged(self, hypothesis: SimpleNamespace) -> list[Judged]:
        return self._said[hypothesis.when]


def compared() -> Comparison:
    def of(size: float) -> list[Judged]:
        blocks = (("spring", "encoder.reading"), ("motor", None))
        return [
            judged(r, np.full(len(TIME), size * (1 + int(r.name[1]))), name=n, target=t)
            for n, t in blocks
            for r in RECORDS.records
        ]

    return cast(Comparison, Known(of(0.4), of(0.2), ["r4", "r2", "r0", "r1", "r3"]))


RESTING = assembly("resting", load=Fixed())
BEFORE, AFTER = (cast(Hypothesis, SimpleNamespace(when=when, fitted=RESTING)) for when in ("before", "after"))


def test_gaps_are_errors_in_the_unit_of_the_block_by_block_and_record_in_the_order_given() -> None:
    gaps = gaps_of(BEFORE, AFTER, compared())
    assert [(g.block, g.record) for g in gaps[:3]] == [("spring", "r4"), ("spring", "r2"), ("spring", "r0")]
    assert [g.block for g in gaps] == 5 * ["spring"] + 5 * ["motor"]
    first = gaps[0]
    assert (first.before, first.after) == (pytest.approx(2.0), pytest.approx(1.0))
    assert (first.noise_floor, first.unit, first.role) == (pytest.approx(SIGMA), "N*m", "held_out")


def test_the_course_is_that_of_the_held_out_record_with_the_largest_error() -> None:
    course = course_of(BEFORE, AFTER, compared(), "spring")
    assert (course.record, course.role, course.quantity) == ("r4", "held_out", "encoder.reading")
    seen = judged(RECORDS.records[4], np.zeros(len(TIME)), target="encoder.reading").floor
    measured = seen.filter @ RECORDS.records[4].trace["encoder.reading"]
    np.testing.assert_array_equal(course.measured, measured)
    np.testing.assert_array_equal(course.time, TIME[seen.places])
    balance = course_of(BEFORE, AFTER, compared(), "motor")
    np.testing.assert_allclose(balance.before, -2.0)
    np.testing.assert_allclose(balance.after, -1.0)


@pytest.mark.parametrize("block", ["spring", "motor"])
def test_the_error_of_the_course_is_that_of_its_record_in_the_table(block: str) -> None:
    course = course_of(BEFORE, AFTER, compared(), block)
    (gap,) = (g for g in gaps_of(BEFORE, AFTER, compared()) if (g.block, g.record) == (block, course.record))
    for when in ("before", "after"):
        error = course.measured - getattr(course, when)
        assert float(np.sqrt(np.mean(error**2))) == pytest.approx(getattr(gap, when))
    assert course.noise == pytest.approx(gap.noise_floor)
    large = np.abs(course.measured) > 0.1 * np.max(np.abs(course.measured))
    shares = np.abs((course.measured - course.after)[large] / course.measured[large])
    if large.any():
        assert gap.relative == pytest.approx(100.0 * float(np.mean(shares)))
    else:
        assert np.isnan(gap.relative)


def driven_wheel(*, with_current: bool) -> tuple[Comparison, Assembly]:
    """A motor against a spring, whose angle and perhaps current are measured while it swings by 0.5 rad."""
    source = "by hand"
    wheel = assembly(
        "wheel",
        motor=GearedMotor(
            inertia=Quantity(0.01, "kg*m^2", source),
            gear_ratio=20.0,
            torque_constant=Quantity(0.05, "N*m/A", source),
            current_limit=Quantity(50.0, "A", source),
        ),
        load=Fixed(),
        spring=tie(Spring(stiffness=Quantity(2.0, "N*m/rad", source), domain=ROTATION), "motor", "load"),
        encoder=Encoder(of="motor.angle", quantum=Quantity(1e-5, "rad", source)),
    )
    current = (2.0 - 0.01 * 9.0**2) * 0.5 * np.sin(9.0 * TIME) / (20.0 * 0.05)
    draw = np.random.default_rng(0)
    signals = {
        "encoder.reading": 0.5 * np.sin(9.0 * TIME) + 1e-5 * draw.standard_normal(len(TIME)),
        "motor.current": current + 1e-4 * draw.standard_normal(len(TIME)),
    }
    columns = COLUMNS if with_current else COLUMNS[:1]
    trace = Trace(TIME, {c.signal: signals[c.signal] for c in columns}, {c.signal: c.unit for c in columns})
    records = RecordSet((Record("r", trace, "fit"),), columns)
    bench = Bench(records, blocks_of(flatten(wheel), records.signals))
    return Comparison(bench, {}), wheel


def test_the_error_of_a_balance_stands_beside_the_torque_of_the_drive() -> None:
    comparison, wheel = driven_wheel(with_current=True)
    (seen,) = comparison.judged(Hypothesis(wheel))
    acting = Acting(comparison.bench, flatten(wheel))
    torque = 20.0 * 0.05 * seen.record.trace["motor.current"]
    assert acting.name(seen.block) == "torque of the drive"
    np.testing.assert_allclose(acting.filtered(seen), seen.floor.filter @ torque, atol=1e-9)


def test_a_balance_without_its_drive_is_refused_with_what_to_measure() -> None:
    with pytest.raises(MeasurementError, match=r"'motor\.current'; of a motor that was on its log is needed"):
        driven_wheel(with_current=False)


def apart(floors: float) -> str:
    """Two hypotheses that agree on the first record and differ on the second, most so at 6 s."""
    bump = SIGMA * floors * (1.0 + 0.5 * np.exp(-(((TIME - 6.0) / 0.5) ** 2)))
    pair = RECORDS.records[:2]
    one = [judged(r, np.zeros(len(TIME))) for r in pair]
    return where_they_differ(one, [one[0], judged(pair[1], bump)])


def test_where_two_hypotheses_differ_is_said_with_record_block_and_moment() -> None:
    said = apart(3.0)
    assert said.startswith("here they differ most in record 'r1' at `motor`, by 3")
    assert said.endswith(" noise floors, around 6 s")
    assert apart(-3.0) == said, "whichever is above"
    assert "; repeat that motion" in apart(0.1)


def test_hypotheses_that_predict_the_same_are_said_to_agree() -> None:
    assert apart(0.0) == "their predictions agree on every record"


# --- windows --------------------------------------------------------------------------------------

STIFFNESS = 2.0


def swing(stiffness: float = STIFFNESS) -> Assembly:
    number = Quantity(stiffness, "N*m/rad", "by hand", spread=0.3)
    return assembly(
        "swing",
        wheel=Inertia(inertia=1e-2),
        spring=tie(Spring(stiffness=number), "wheel"),
        damper=tie(Dashpot(damping=Quantity(5e-3, "N*m*s/rad", "by hand")), "wheel"),
        encoder=Encoder(of="wheel.angle", quantum=1e-9),
    )


def swings(*roles: Role) -> RecordSet:
    """Free swings from rest at half a radian, of a wheel whose spring is a tenth stiffer than declared."""
    time = np.arange(3000) * 0.001
    records = []
    for k, role in enumerate(roles):
        run = simulate(flatten(swing(1.1 * STIFFNESS)), time, start={"wheel.angle": 0.5 + 0.1 * k})
        angle = run["encoder.reading"] + 1e-4 * np.random.default_rng(k).standard_normal(len(time))
        trace = Trace(time, {"encoder.reading": angle}, {"encoder.reading": "rad"}, f"r{k}")
        records.append(Record(f"r{k}", trace, role))
    return RecordSet(tuple(records), (Column("q", "encoder.reading", "rad"),))


def test_windows_find_the_stiffness_behind_a_free_swing_and_predict_the_held_out_one() -> None:
    records = swings("fit", "held_out")
    values, fit = fitted_over_windows(swing(), records, {"spring.stiffness": STIFFNESS}, 0.5)
    assert values["spring.stiffness"] == pytest.approx(1.1 * STIFFNESS, rel=0.01)
    assert [p.name for p in fit.parameters] == ["spring.stiffness"]
    gaps = window_gaps(swing(), values, records, 0.5)
    assert [(g.record, g.role) for g in gaps] == [("r0", "fit"), ("r1", "held_out")]
    assert gaps[1].block == "encoder.reading over 0.5 s"
    # What is left comes from the speed at which windows begin, a derivative of noisy angles.
    assert gaps[1].before > 5.0 * gaps[1].after


def test_the_strain_of_a_refitted_number_is_its_way_in_declared_spreads() -> None:
    """A tenth more of what was declared up to a factor of 1.3: ln 1.1 of ln 1.3."""
    (stiffness,) = refit(swing(), swings("fit", "held_out")).numbers
    assert (stiffness.name, stiffness.declared) == ("spring.stiffness", STIFFNESS)
    assert stiffness.fitted == pytest.approx(1.1 * STIFFNESS, rel=0.02)
    assert stiffness.strain == pytest.approx(np.log(stiffness.fitted / STIFFNESS) / np.log(1.3), rel=0.01)


def test_windows_of_held_out_records_are_not_fitted() -> None:
    records = swings("fit", "fit")
    upper = records.records[1].trace
    slower = Trace(0.8 * upper.time, upper.signals, upper.units, "slow")
    both = RecordSet((records.records[0], Record("slow", slower, "held_out")), records.columns)
    alone = RecordSet(records.records[:1], records.columns)
    fitted = [fitted_over_windows(swing(), r, {"spring.stiffness": STIFFNESS}, 0.5)[0] for r in (alone, both)]
    assert fitted[0] == fitted[1]


def test_readings_are_wired_to_what_their_sensors_read() -> None:
    wiring = wiring_of(flatten(swing()), ["encoder.reading", "spring.torque"])
    assert wiring.inputs == {}
    assert wiring.outputs == {"encoder.reading": "wheel.angle", "spring.torque": "spring.torque"}
    with pytest.raises(MeasurementError, match="no state of the model is measured"):
        wiring_of(flatten(swing()), ["spring.torque"])
