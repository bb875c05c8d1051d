"""Channels on other clocks: against SciPy's own resampling, against sines, and with hidden lags."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.ndimage import gaussian_filter1d
from scipy.signal import resample_poly

from nlsdesign.bench.identification import load_record, load_records
from nlsdesign.bench.identification.equation_error.evidence import estimate_noise
from nlsdesign.bench.identification.records.clocks import (
    Channel,
    lag_between,
    on_one_clock,
)
from nlsdesign.bench.identification.records.ingest import read_run
from nlsdesign.bench.identification.records.mapping import Column, ColumnMap, read_mapping
from nlsdesign.bench.identification.records.table_files import RecordTable
from nlsdesign.foundation.errors import MeasurementError, ValueRangeError
from tests.unit.bench.identification.test_measurement import COUNT, MAPPING, STEP, model, table, write

__all__ = ["model"]


def sine(frequency: float, step: float, seconds: float = 4.0, *, first: float = 0.0) -> Channel:
    time = first + np.arange(round(seconds / step)) * step
    return Channel("sine", time, np.sin(2 * np.pi * frequency * time + 0.3))


def test_a_lower_rate_is_that_of_scipy() -> None:
    values = np.random.default_rng(2).standard_normal(4000)
    found = on_one_clock([Channel("noise", np.arange(4000) * 1e-3, values)], 200.0)
    inside = slice(15, -15)  # where neither sees an end
    np.testing.assert_allclose(found.values["noise"][inside], resample_poly(values, 1, 5)[inside], atol=1e-10)
    assert found.changes == ("noise 1000 -> 200 Hz with an anti-alias filter",)


@pytest.mark.parametrize(("frequency", "kept"), [(5.0, True), (60.0, True), (150.0, False), (420.0, False)])
def test_what_the_new_clock_cannot_hold_is_removed_and_the_rest_stays_in_place(
    frequency: float, kept: bool
) -> None:
    """A new rate of 200 Hz that is no divisor of the old one; the grid begins between samples."""
    late = Channel("other", np.arange(0.1003, 3.9, 0.01), np.zeros(380))
    found = on_one_clock([sine(frequency, 1 / 1100.0), late], 200.0)
    inside = (found.time > 0.25) & (found.time < 3.7)
    expected = np.sin(2 * np.pi * frequency * found.time + 0.3) if kept else np.zeros(len(found.time))
    np.testing.assert_allclose(found.values["sine"][inside], expected[inside], atol=6e-3)


def test_a_higher_rate_goes_through_the_samples_and_nothing_is_extrapolated() -> None:
    slow = sine(2.0, 0.01, first=0.203)
    found = on_one_clock([slow, Channel("fast", np.arange(4000) * 1e-3, np.zeros(4000))], 1000.0)
    assert found.time[0] == pytest.approx(0.203)
    assert found.time[-1] <= 3.999
    np.testing.assert_allclose(np.diff(found.time), 1e-3, rtol=1e-9)
    inside = slice(20, -20)
    expected = np.sin(2 * np.pi * 2.0 * found.time + 0.3)
    np.testing.assert_allclose(found.values["sine"][inside], expected[inside], atol=1e-5)
    np.testing.assert_allclose(found.values["sine"][::10], slow.values[: len(found.time[::10])], atol=1e-12)
    assert found.changes[0] == "sine 100 -> 1000 Hz by cubic spline"
    assert any(word.startswith("first 0.203 s left out") for word in found.changes)


def test_the_same_clock_changes_nothing_and_says_nothing() -> None:
    given = sine(2.0, 0.002)
    found = on_one_clock([given], 500.0)
    assert found.changes == ()
    assert np.array_equal(found.values["sine"], given.values)


@pytest.mark.parametrize("rate", [0.0, -5.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(ValueRangeError, match="rate"):
        on_one_clock([sine(1.0, 0.01)], rate)


def test_channels_that_do_not_run_together_are_refused() -> None:
    with pytest.raises(MeasurementError, match="samples in common at 100 Hz"):
        on_one_clock([sine(1.0, 0.01), Channel("b", np.arange(200) * 0.01 + 9.0, np.ones(200))], 100.0)


def test_a_gap_longer_than_a_new_step_is_refused_and_the_rate_that_bridges_it_is_named() -> None:
    time = np.delete(np.arange(0.0, 4.0, 0.01), slice(100, 104))
    torn = Channel("force", time, np.sin(time))
    with pytest.raises(MeasurementError, match=r"force: sample 101: there is a gap of 0.05 s.*at most 20 Hz"):
        on_one_clock([torn], 100.0)
    found = on_one_clock([torn], 19.0)
    inside = slice(20, -20)
    np.testing.assert_allclose(found.values["force"][inside], np.sin(found.time[inside]), atol=3e-2)


# Lags -------------------------------------------------------------------------------------------------------

FINE = 2e-4


def shaken(seed: int, lag: float, *, noise: float = 0.05) -> tuple[Channel, Channel]:
    """Two recorders of one random motion: other rates, other units, one of them late."""
    rng = np.random.default_rng(seed)
    motion = gaussian_filter1d(rng.standard_normal(20000), 150.0)
    motion /= motion.std()
    fine = np.arange(20000) * FINE
    first, second = np.arange(0.2, 3.6, 0.002), np.arange(0.3, 3.7, 0.005)
    reference = np.interp(first, fine, motion) + noise * rng.standard_normal(len(first))
    late = 3.0 * (np.interp(second - lag, fine, motion) + noise * rng.standard_normal(len(second))) + 1.0
    return Channel("late", second, late), Channel("reference", first, reference)


def test_a_lag_is_found_finer_than_a_sample_and_its_standard_error_is_honest() -> None:
    lags = 0.0373 + 1e-3 * np.random.default_rng(0).uniform(-2.0, 2.0, 40)
    found = [lag_between(*shaken(seed, lag), longest=0.2) for seed, lag in enumerate(lags)]
    errors = np.array([f.seconds - lag for f, lag in zip(found, lags, strict=True)])
    assert np.max(np.abs(errors)) < 0.1 * 0.005
    spread = float(np.std(errors / [f.standard_error for f in found]))
    assert 0.6 < spread < 1.6
    assert all(f.correlation > 0.98 for f in found)
    early = lag_between(*shaken(3, -0.05), longest=0.2)
    assert early.seconds == pytest.approx(-0.05, abs=5e-4)


def test_channels_that_show_different_motions_are_refused() -> None:
    late, _ = shaken(1, 0.0)
    _, other = shaken(2, 0.0)
    with pytest.raises(MeasurementError, match=r"too different: correlation at most 0\.\d+.*0\.7 is needed"):
        lag_between(late, other, longest=0.2)


def test_a_lag_at_the_end_of_the_range_is_refused() -> None:
    with pytest.raises(MeasurementError, match="largest at the end of the range"):
        lag_between(*shaken(1, 0.05), longest=0.04)


def test_a_motion_that_repeats_has_no_lag_unless_it_is_looked_for_nearby() -> None:
    """Nine tenths of a second more or less is the same where the period is nine tenths of a second."""
    rng = np.random.default_rng(4)
    late, reference = sine(1 / 0.9, 0.004, 8.0, first=0.1), sine(1 / 0.9, 0.004, 8.0)
    moved = Channel("late", late.time + 0.03, late.values + 0.05 * rng.standard_normal(len(late.values)))
    with pytest.raises(MeasurementError, match="not unique: the motion repeats"):
        lag_between(moved, reference)
    assert lag_between(moved, reference, longest=0.4).seconds == pytest.approx(0.03, abs=2e-3)


def test_a_constant_channel_cannot_be_aligned_by() -> None:
    late, reference = shaken(1, 0.0)
    with pytest.raises(MeasurementError, match=r"'late': is constant"):
        lag_between(Channel("late", late.time, np.ones(len(late.time))), reference)


# Through records.toml ---------------------------------------------------------------------------------------

ASKED = MAPPING.replace('held_out = ["c*"]', "resample_Hz = {rate}")


def test_records_are_put_on_the_clock_that_the_mapping_asks_for(tmp_path: Path, model: object) -> None:
    write(tmp_path, "a", table())
    (tmp_path / "records.toml").write_text(ASKED.replace("{rate}", "125"), encoding="utf8")
    records = load_records(tmp_path, model)  # type: ignore[arg-type]
    first = records.records[0]
    assert first.step == pytest.approx(0.008)
    assert "'theta_deg' 500 -> 125 Hz with an anti-alias filter" in first.source
    # A count of 0.1 degrees and a noise of 0.01 N·m, at a quarter of the rate.
    assert first.resolution_of("encoder.reading").quantum == pytest.approx(np.radians(0.1) / 2.0, rel=1e-3)
    level = estimate_noise(records).level
    assert level["cell.reading"] == pytest.approx(0.005, rel=0.15)


def two_clocks() -> dict[str, np.ndarray]:
    rows, slow = table(), np.arange(0.0, COUNT * STEP, 0.005)
    force = 3.0 * np.radians(20.0 * np.sin(2 * np.pi * 1.5 * (slow - 0.0123)))
    return {"t_s": rows[:, 0], "theta_deg": rows[:, 1], "t2_s": slow, "torque_Nm": force}


TWO = ASKED.replace("{rate}", "250").replace("noise = 0.01", 'time = "t2_s"')
ALIGN = '[[align]]\ncolumn = "torque_Nm"\nto = "theta_deg"\nlongest = {value = 50, unit = "ms"}\n'


def as_csv(file: Path, columns: dict[str, np.ndarray]) -> None:
    longest = max(map(len, columns.values()))
    rows = [",".join(f"{c[i]:.6f}" if i < len(c) else "" for c in columns.values()) for i in range(longest)]
    file.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf8")


@pytest.mark.parametrize("ending", [".mat", ".csv"])
def test_columns_of_two_clocks_are_read_onto_one_and_aligned(
    tmp_path: Path, model: object, ending: str
) -> None:
    if ending == ".csv":
        as_csv(tmp_path / "a.csv", two_clocks())
    else:
        savemat(tmp_path / "a.mat", two_clocks())
    (tmp_path / "records.toml").write_text(TWO + ALIGN, encoding="utf8")
    first = load_records(tmp_path, model).records[0]  # type: ignore[arg-type]
    assert "torque_Nm moved 12." in first.source
    assert "'torque_Nm' 200 -> 250 Hz by cubic spline" in first.source
    rest = first.trace["cell.reading"] - 3.0 * first.trace["encoder.reading"]
    assert np.max(np.abs(rest[20:-20])) < 0.01  # 0.096 without the alignment


def test_two_clocks_without_a_rate_are_refused_with_the_way_out(tmp_path: Path, model: object) -> None:
    savemat(tmp_path / "a.mat", two_clocks())
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    with pytest.raises(MeasurementError, match=r"differ in length.*resample_Hz = <rate>.*time = '<head"):
        load_records(tmp_path, model)  # type: ignore[arg-type]


def test_a_gap_names_the_clock_on_which_it_is_none(tmp_path: Path, model: object) -> None:
    rows = np.delete(table(), slice(100, 103), axis=0)
    write(tmp_path, "a", rows)
    (tmp_path / "records.toml").write_text(MAPPING.replace('["c*"]', "[]"), encoding="utf8")
    with pytest.raises(
        MeasurementError, match=r"a\.csv: column 't_s', row 102.*resample_Hz = 120 in records"
    ):
        load_record(tmp_path / "a.csv", model)  # type: ignore[arg-type]
    (remark,) = (r for r in load_records(tmp_path, model).remarks if "gap" in r.text)  # type: ignore[arg-type]
    assert "resample_Hz = 120 in records" in remark.text
    (tmp_path / "records.toml").write_text(ASKED.replace("{rate}", "120"), encoding="utf8")
    assert load_records(tmp_path, model).records[0].step == pytest.approx(1 / 120)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("250", '"fast"', r"records.toml: resample_Hz: 'fast' is not a finite number.*resample_Hz = 500"),
        ("250", "-250", r"records.toml: resample_Hz: -250 is not a rate"),
        ("resample_Hz", "resampel_Hz", r"resampel_Hz: no such field; did you mean 'resample_Hz'"),
        ("resample_Hz = 250", "", r"columns.torque_Nm.time: is a clock of its own.*add resample_Hz"),
        ('"t2_s"', '"t3_s"', r"a\.mat: column 't3_s': is missing; did you mean 't"),
        ('to = "theta_deg"', "", r"records.toml: align: has no to"),
        ('to = "theta_deg"', 'to = "theta"', r"column 'theta': is missing; did you mean 'theta_deg'"),
        (
            'longest = {value = 50, unit = "ms"}',
            "longest = 50",
            r"align.longest: is not a time.*longest = \{",
        ),
        ("longest", "longer", r"align.longer: no such field; did you mean 'longest'"),
        ("[[align]]", "[align]", r"align: is not a list of tables"),
    ],
)
def test_a_wrong_wish_is_answered_with_the_right_form(
    tmp_path: Path, model: object, old: str, new: str, words: str
) -> None:
    savemat(tmp_path / "a.mat", two_clocks())
    (tmp_path / "records.toml").write_text((TWO + ALIGN).replace(old, new), encoding="utf8")
    with pytest.raises(MeasurementError, match=words):
        load_records(tmp_path, model)  # type: ignore[arg-type]


def test_the_mapping_in_the_documentation_is_one(root: Path, tmp_path: Path) -> None:
    text = (root / "docs" / "records.md").read_text(encoding="utf8")
    (tmp_path / "records.toml").write_text(text.split("```toml")[1].split("```")[0], encoding="utf8")
    found = read_mapping(tmp_path / "records.toml")
    assert found.resample == 500.0
    assert found.clock_of(found.columns[1]).name == "t2_ms"
    assert found.clock_of(found.columns[1]).unit == "ms"
    assert found.align[0].longest == pytest.approx(0.2)


def test_a_column_that_no_signal_stands_for_moves_the_clock_that_it_shares(
    tmp_path: Path, model: object
) -> None:
    """The second recorder saw the angle again; the force moves with that, unseen by the correlation."""
    columns = two_clocks()
    again = 20.0 * np.sin(2 * np.pi * 1.5 * (columns["t2_s"] - 0.0123))
    savemat(tmp_path / "a.mat", columns | {"again_deg": again})
    align = ALIGN.replace('"torque_Nm"', '"again_deg"\ntime = "t2_s"')
    (tmp_path / "records.toml").write_text(TWO + align, encoding="utf8")
    first = load_records(tmp_path, model).records[0]  # type: ignore[arg-type]
    assert "torque_Nm moved 12." in first.source
    assert "by the correlation 1.000 of again_deg with theta_deg" in first.source
    alone = align.replace('time = "t2_s"\n', "")
    (tmp_path / "records.toml").write_text(TWO + alone, encoding="utf8")
    with pytest.raises(MeasurementError, match=r"differ in length.*'again_deg'.*time = '<head"):
        load_records(tmp_path, model)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1e3, "2 s apart; if it counts milliseconds"), (1e-3, "2e-06 s apart; if it counts seconds"), (1.0, "")],
)
def test_a_clock_of_doubtful_unit_is_remarked_on(factor: float, words: str) -> None:
    time = 0.002 * factor * np.arange(100)
    table = RecordTable("a.csv", {"t_s": time, "x": np.sin(np.arange(100.0))})
    mapping = ColumnMap(Column("t_s", "time", "s"), (Column("x", "load.angle", "rad"),))
    remarks = [str(each) for each in read_run("a", table, mapping).remarks if "samples lie" in str(each)]
    assert [words in each for each in remarks] == [True] * bool(words)


def test_a_clock_that_no_bench_has_is_refused() -> None:
    table = RecordTable("a.csv", {"t_s": 1e-300 * np.arange(1.0, 101.0), "x": np.sin(np.arange(100.0))})
    mapping = ColumnMap(Column("t_s", "time", "s"), (Column("x", "load.angle", "rad"),))
    with pytest.raises(MeasurementError, match=r"'t_s': its samples lie 1e-300 s apart"):
        read_run("a", table, mapping)
