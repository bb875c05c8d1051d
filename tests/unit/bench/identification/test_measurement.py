"""Reading records: what is accepted, what is refused, and how the refusal is worded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification import RecordSet, load_record, load_records
from nlsdesign.components import ROTATION, Assembly, Encoder, Inertia, Spring, TorqueSensor, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import FlatModel, flatten

STEP, COUNT = 0.002, 400
HEADS = ("t_s", "theta_deg", "torque_Nm")


def wheel(**sensors: object) -> Assembly:
    return assembly(
        "wheel",
        wheel=Inertia(inertia=0.01),
        spring=tie(Spring(stiffness=3.0, domain=ROTATION), "wheel"),
        **sensors,
    )


@pytest.fixture
def model() -> FlatModel:
    return flatten(
        wheel(
            encoder=Encoder(of="wheel.angle", quantum=1e-3), cell=TorqueSensor(of="spring.torque", noise=0.01)
        )
    )


def table() -> np.ndarray:
    time = np.arange(COUNT) * STEP
    noise = np.random.default_rng(1).standard_normal(COUNT) * 0.01
    angle = 20.0 * np.sin(2 * np.pi * 1.5 * time)
    return np.column_stack([time, np.round(angle, 1), 3.0 * np.radians(angle) + noise])


def write(folder: Path, name: str, rows: np.ndarray, heads: tuple[str, ...] = HEADS) -> Path:
    lines = [",".join(heads), *(",".join(f"{v:.6f}" for v in row) for row in rows)]
    file = folder / f"{name}.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf8")
    return file


MAPPING = """
held_out = ["c*"]
[columns.theta_deg]
signal = "encoder.reading"
unit = "deg"
[columns.torque_Nm]
signal = "cell.reading"
unit = "N*m"
noise = 0.01
"""


def test_a_record_that_is_alone_is_read_whole(tmp_path: Path, model: FlatModel) -> None:
    file = write(tmp_path, "a", table())
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    (only,) = load_record(file, model).records
    assert (only.name, len(only.trace), only.role) == ("a", COUNT, "held_out")
    with pytest.raises(MeasurementError, match=r"did you mean 'a\.csv'"):
        load_record(tmp_path / "b.csv", model)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in "abcd":
        write(tmp_path, name, table())
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    return tmp_path


def read(folder: Path, model: FlatModel) -> RecordSet:
    return load_records(folder, model)


def test_numbers_arrive_in_si_under_the_names_of_the_model(folder: Path, model: FlatModel) -> None:
    records = read(folder, model)
    first = records.records[0]
    assert first.step == pytest.approx(STEP, rel=1e-12)
    np.testing.assert_allclose(first.trace["encoder.reading"], np.radians(table()[:, 1]), atol=1e-9)
    assert first.trace.units["encoder.reading"] == "rad"
    assert records.column("cell.reading").noise == 0.01
    assert [r.role for r in records.records] == ["fit", "fit", "held_out", "fit"]


@pytest.mark.parametrize("names", ["abcd", "dcba", "bdac"])
def test_without_a_rule_the_record_inside_the_others_is_held_out_whatever_its_name(
    names: str, tmp_path: Path, model: FlatModel
) -> None:
    sizes = dict(zip(names, (0.2, 0.7, 1.0, 0.4), strict=True))
    for name, size in sizes.items():
        rows = table()
        rows[:, 1:] *= size
        write(tmp_path, name, rows)
    (tmp_path / "records.toml").write_text(MAPPING.replace('held_out = ["c*"]', ""), encoding="utf8")
    records = read(tmp_path, model)
    (held,) = records.of("held_out")
    assert 0.2 < sizes[held.name] < 1.0
    (remark,) = records.remarks
    assert f"held out by default: {held.name}, inside the range" in str(remark)
    assert not records.findings


def test_a_single_record_is_cut_in_time(folder: Path, model: FlatModel) -> None:
    for name in "bcd":
        (folder / f"{name}.csv").unlink()
    (folder / "records.toml").write_text(MAPPING.replace('held_out = ["c*"]', ""), encoding="utf8")
    seen, unseen = read(folder, model).records
    assert (seen.role, unseen.role) == ("fit", "held_out")
    assert seen.trace.time[-1] < unseen.trace.time[0]
    assert len(seen.trace) + len(unseen.trace) == COUNT


def test_a_table_without_time_is_not_a_record(folder: Path, model: FlatModel) -> None:
    write(folder, "cam", np.ones((60, 2)), ("theta_rad", "delta_m"))
    assert len(read(folder, model).records) == 4


def test_heads_with_units_need_no_mapping(tmp_path: Path) -> None:
    rig = wheel(
        encoder=Encoder(of="wheel.angle", quantum=1e-3),
        cell=TorqueSensor(of="spring.torque"),
        meter=TorqueSensor(of="wheel.torque"),
    )
    write(tmp_path, "a", table(), ("time [s]", "theta_deg", "cell.reading [N*m]"))
    found = load_records(tmp_path, flatten(rig))
    assert found.signals == ("encoder.reading", "cell.reading")


def test_an_ambiguous_head_asks_for_a_mapping(tmp_path: Path) -> None:
    rig = wheel(left=Encoder(of="wheel.angle", quantum=1e-3), right=Encoder(of="wheel.angle", quantum=1e-3))
    write(tmp_path, "a", table()[:, :2], ("t_s", "theta_rad"))
    with pytest.raises(MeasurementError, match=r"theta_rad.*left.reading or right.reading.*records.toml"):
        load_records(tmp_path, flatten(rig))


def spoiled(change: Callable[[np.ndarray], None]) -> np.ndarray:
    rows = table()
    change(rows)
    return rows


def nan(rows: np.ndarray) -> None:
    rows[100:103, 2] = np.nan


def back(rows: np.ndarray) -> None:
    rows[200:, 0] -= 0.1


def still(rows: np.ndarray) -> None:
    rows[50, 0] = rows[49, 0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (nan, r"b\.csv: column 'torque_Nm', rows 102 to 104.*not a finite number \(3 in all\)"),
        (back, r"b\.csv: column 't_s', row 202.*runs backwards"),
        (still, r"b\.csv: column 't_s', row 52.*stands still"),
    ],
)
def test_a_spoiled_record_is_named_by_file_column_and_rows(
    folder: Path, model: FlatModel, change: Callable[[np.ndarray], None], words: str
) -> None:
    write(folder, "b", spoiled(change))
    with pytest.raises(MeasurementError, match=words):
        read(folder, model)


def test_a_word_in_place_of_a_number_is_named_by_cell(folder: Path, model: FlatModel) -> None:
    text = (folder / "b.csv").read_text().splitlines()
    text[7] = text[7].rpartition(",")[0] + ",high"
    (folder / "b.csv").write_text("\n".join(text), encoding="utf8")
    with pytest.raises(MeasurementError, match=r"b\.csv: column 'torque_Nm', row 8: 'high' is not a number"):
        read(folder, model)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "deg"', 'unit = "m"', r"theta_deg.*is in m, but encoder.reading is measured in rad"),
        ('"encoder.reading"', '"encoder.reding"', r"does not have; did you mean 'encoder.reading'"),
        ("theta_deg]", "theta_grad]", r"column 'theta_grad': is missing; did you mean 'theta_deg'"),
        ('unit = "deg"', "", r"columns.theta_deg: has no unit"),
        ("noise", "nose", r"columns.torque_Nm.nose: no such field; did you mean 'noise'"),
        ('["c*"]', '["sine*"]', r"'sine\*': no record has such a name"),
        ('["c*"]', '["*"]', r"none is left for fitting"),
    ],
)
def test_a_wrong_mapping_is_answered_with_the_nearest_right_one(
    folder: Path, model: FlatModel, old: str, new: str, words: str
) -> None:
    (folder / "records.toml").write_text(MAPPING.replace(old, new), encoding="utf8")
    with pytest.raises(MeasurementError, match=words):
        read(folder, model)


def test_a_folder_without_records_is_refused(tmp_path: Path, model: FlatModel) -> None:
    (tmp_path / "nothing").mkdir()
    with pytest.raises(MeasurementError, match="holds no CSV file"):
        load_records(tmp_path / "nothing", model)


def test_a_dead_and_a_saturated_channel_make_data_suspect(folder: Path, model: FlatModel) -> None:
    rows = table()
    rows[:, 1] = 4.0
    write(folder, "a", rows)
    rows = table()
    rows[:, 2] = np.clip(rows[:, 2], -0.7, 0.7)
    write(folder, "d", rows)
    found = [str(f) for f in read(folder, model).findings]
    assert len(found) == 2
    assert "a.csv: column 'theta_deg'" in found[0]
    assert "constant at 4" in found[0]
    assert "d.csv: column 'torque_Nm'" in found[1]
    assert "clipped" in found[1]


def test_a_machine_at_rest_and_a_limited_command_are_remarked_alone(tmp_path: Path, model: FlatModel) -> None:
    """All channels rest for 11 samples; then one record rests throughout; then a command meets its limit."""
    resting, limited = table(), table()
    # Up to a peak of the motion, 11 samples there, and on.
    passed = np.interp(np.arange(COUNT), [0, 83, 94, COUNT], [0, 83, 83, COUNT - 11]) * STEP
    resting[:, 1] = 20.0 * np.sin(2 * np.pi * 1.5 * passed)
    resting[:, 2] = 3.0 * np.radians(resting[:, 1])
    limited[:, 2] = np.clip(limited[:, 2], -0.7, 0.7)
    still = table()
    still[:, 1:] = 0.0
    write(tmp_path, "a", resting)
    write(tmp_path, "b", still)
    write(tmp_path, "c", limited)
    text = MAPPING.replace("cell.reading", "wheel.torque")
    (tmp_path / "records.toml").write_text(text, encoding="utf8")
    records = read(tmp_path, model)
    assert records.findings == ()
    said = [str(r) for r in records.remarks]
    assert any("b.csv: column 'theta_deg'" in each and "is constant at 0" in each for each in said), said
    assert any("c.csv: column 'torque_Nm'" in each and "a limit of the drive" in each for each in said), said


def test_what_a_controller_commands_may_rest_at_its_limit(tmp_path: Path) -> None:
    servo = flatten(declare(load_deck("xl330_pendulum")))
    time = np.arange(0.0, 6.0, 5e-3)
    volts = 9.0 * np.sin(4.0 * time) + 0.05 * np.random.default_rng(1).standard_normal(len(time))
    rows = np.column_stack([time, np.sin(4.0 * time - 1.0), np.clip(volts, -7.4, 7.4)])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="t_s,angle_rad,volts_V", comments="")
    (tmp_path / "records.toml").write_text(
        '[time]\ncolumn = "t_s"\nunit = "s"\n'
        '[columns.angle_rad]\nsignal = "encoder.reading"\nunit = "rad"\n'
        '[columns.volts_V]\nsignal = "servo.wanted_voltage"\nunit = "V"\n',
        encoding="utf8",
    )
    records = load_records(tmp_path, servo)
    assert records.findings == ()
    assert any("a limit of the drive" in str(remark) for remark in records.remarks)


def test_uneven_steps_are_interpolated_and_said(folder: Path, model: FlatModel) -> None:
    rows = table()
    rows[1:-1, 0] += 0.2 * STEP * np.sin(np.arange(1, COUNT - 1))
    rows[:, 1] = np.degrees(0.5 * rows[:, 0])
    write(folder, "a", rows)
    first = read(folder, model).records[0]
    assert "interpolated to a uniform grid" in first.source
    np.testing.assert_allclose(np.diff(first.trace.time), STEP, rtol=1e-9)
    # What was linear in time still is.
    np.testing.assert_allclose(first.trace["encoder.reading"], 0.5 * first.trace.time, atol=1e-6)


def test_a_motion_that_is_sampled_too_coarsely_says_how_often_it_should_be(
    tmp_path: Path, model: FlatModel
) -> None:
    """Ten samples a period at 50 Hz: about twice as many would do."""
    (tmp_path / "records.toml").write_text(MAPPING.replace('held_out = ["c*"]', ""), encoding="utf8")
    time = np.arange(COUNT) * 0.02
    angle = 20.0 * np.sin(2 * np.pi * 5.0 * time + 0.3)
    write(tmp_path, "a", np.column_stack([time, angle, 3.0 * np.radians(angle)]))
    remarks = [str(r) for r in read(tmp_path, model).remarks]
    (text,) = [each for each in remarks if "samples a period" in each]
    assert "a.csv: column 'theta_deg': has about 10 samples a period" in text
    assert "record at 98 Hz or more" in text
