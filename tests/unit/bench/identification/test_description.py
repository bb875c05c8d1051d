"""The first look at a folder of records: columns, clocks and gaps, and a mapping that loads as it stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification import load_records
from nlsdesign.bench.identification.records.description import describe_records
from nlsdesign.components import Encoder, TorqueSensor
from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import FlatModel, flatten
from tests.unit.bench.identification.test_measurement import STEP, model, table, wheel, write

__all__ = ["model"]
HEADS = ("Zeit [ms]", "Winkel [°]", "Moment in Nm")


def german(folder: Path, name: str, rows: np.ndarray, heads: tuple[str, ...] = HEADS) -> None:
    """Write rows as a spreadsheet in German writes them: semicolons, decimal commas, Windows-1252."""
    rows = rows * np.array([1e3, *np.ones(rows.shape[1] - 1)])
    cells = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in rows]
    (folder / f"{name}.csv").write_bytes("\r\n".join([";".join(heads), *cells]).encode("cp1252"))


def test_columns_units_clock_and_gaps_are_told_and_the_mapping_loads(
    tmp_path: Path, model: FlatModel
) -> None:
    for name in ("a", "b", "c"):
        german(tmp_path, name, np.delete(table(), slice(200, 230), axis=0) if name == "b" else table())
    found = describe_records(tmp_path, model)
    assert (found.time, found.time_unit, found.time_is_guessed) == ("Zeit [ms]", "ms", False)
    assert [(f.name, f.gaps) for f in found.files] == [("a.csv", 0), ("b.csv", 1), ("c.csv", 0)]
    assert [f.rate for f in found.files] == pytest.approx([1.0 / STEP] * 3)
    assert [(c.head, c.unit, c.signals) for c in found.columns] == [
        ("Winkel [°]", "°", ("encoder.reading",)),
        ("Moment in Nm", "N*m", ("cell.reading",)),
    ]
    assert found.columns[0].quantum == pytest.approx(0.1, rel=1e-3)
    assert found.columns[1].noise == pytest.approx(0.01, rel=0.2)
    assert found.problem == ""
    (tmp_path / "records.toml").write_text(found.mapping(), encoding="utf-8")
    records = load_records(tmp_path, model)
    assert [r.name for r in records.records] == ["a", "b part 1", "b part 2", "c"]


def test_a_clock_with_an_unknown_name_is_found_by_its_unit(tmp_path: Path, model: FlatModel) -> None:
    for name in ("a", "b", "c"):
        write(tmp_path, name, table(), ("Trajanje [s]", "kot [deg]", "navor [N*m]"))
    found = describe_records(tmp_path, model)
    assert (found.time, found.time_unit, found.problem) == ("Trajanje [s]", "s", "")
    (tmp_path / "records.toml").write_text(found.mapping(), encoding="utf-8")
    assert len(load_records(tmp_path, model).records) == 3


def test_what_is_not_certain_is_left_as_a_comment_with_its_choices(tmp_path: Path) -> None:
    two = flatten(
        wheel(
            encoder=Encoder(of="wheel.angle", quantum=1e-3),
            second=Encoder(of="wheel.angle", quantum=1e-3),
            cell=TorqueSensor(of="spring.torque", noise=0.01),
        )
    )
    write(tmp_path, "a", table(), ("time [s]", "theta [deg]", "load"))
    found = describe_records(tmp_path, two)
    mapping = found.mapping()
    assert "# 'theta [deg]': encoder.reading or second.reading\n# [columns.\"theta [deg]\"]" in mapping
    assert "# 'load': its head names no unit" in mapping
    assert found.records is None
    assert "a.csv: column" in found.problem


def test_a_clock_of_its_own_is_given_to_the_columns_behind_it(tmp_path: Path, model: FlatModel) -> None:
    rows = table()
    slow = rows[::2]
    lines = ["t_s,theta_deg,t2_s,torque_N*m"]
    for k, row in enumerate(rows):
        other = f"{slow[k, 0]:.6f},{slow[k, 2]:.6f}" if k < len(slow) else ","
        lines.append(f"{row[0]:.6f},{row[1]:.6f},{other}")
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = describe_records(tmp_path, model)
    assert found.clocks == ("t2_s",)
    assert [c.clock for c in found.columns] == ["", "t2_s"]
    assert f"resample_Hz = {0.5 / STEP:g}" in found.mapping(), "that of the slowest clock"
    assert found.problem == ""


def test_a_column_that_is_left_out_slows_nobody_down(tmp_path: Path, model: FlatModel) -> None:
    """The bench writes a slow column that the deck has no sensor for: what is used keeps its rate."""
    rows = table()
    lines = ["t_s,theta_deg,torque_N*m,t2_s,strain"]
    for k, row in enumerate(rows):
        slow = f"{rows[4 * k, 0]:.6f},0.1" if 4 * k < len(rows) else ","
        lines.append(",".join(f"{value:.6f}" for value in row) + f",{slow}")
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = describe_records(tmp_path, model)
    assert [c.head for c in found.undecided] == ["strain"]
    assert found.problem == ""
    assert found.records is not None
    assert sum(len(record.trace.time) for record in found.records.records) == len(rows)
    assert f"# needs resample_Hz = {0.25 / STEP:g} at the top" in found.mapping()


def test_a_clock_of_another_unit_is_left_to_be_decided(tmp_path: Path, model: FlatModel) -> None:
    """A mapping has one unit of time: with a clock in milliseconds it would be read a thousandfold wrong."""
    rows = table()
    lines = ["t_s,theta_deg,t2_ms,torque_N*m"]
    lines += [f"{row[0]:.6f},{row[1]:.6f},{1e3 * row[0]:.6f},{row[2]:.6f}" for row in rows]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = describe_records(tmp_path, model)
    assert [c.head for c in found.undecided] == ["torque_N*m"]
    assert found.question(found.undecided[0]).startswith("its clock 't2_ms' is in ms, 't_s' is in s")
    assert '# [columns."torque_N*m"]' in found.mapping()
    assert f"resample_Hz = {1.0 / STEP:g}" in found.mapping()


def test_a_time_without_unit_is_guessed_and_said(tmp_path: Path, model: FlatModel) -> None:
    rows = table()
    rows[:, 0] *= 1e3
    write(tmp_path, "a", rows, ("t", "theta_deg", "torque_N*m"))
    found = describe_records(tmp_path, model)
    assert (found.time, found.time_unit, found.time_is_guessed) == ("t", "ms", True)
    assert 'unit = "ms"    # guessed from the steps: correct it' in found.mapping()


def test_a_file_that_cannot_be_read_is_told_beside_the_others(tmp_path: Path, model: FlatModel) -> None:
    write(tmp_path, "a", table(), ("t_s", "theta_deg", "torque_N*m"))
    (tmp_path / "b.csv").write_bytes(b"\x00\x01")
    bad = describe_records(tmp_path, model).files[1]
    assert bad.name == "b.csv"
    assert "it is no text" in bad.problem
    with pytest.raises(MeasurementError, match="there is no such folder"):
        describe_records(tmp_path / "nowhere", model)


@pytest.fixture(scope="module")
def joint() -> FlatModel:
    return flatten(declare(load_template("geared-joint").deck))


def test_numbers_of_a_column_are_those_of_all_files(tmp_path: Path, joint: FlatModel) -> None:
    """The second file is larger and the third much noisier than the first."""
    time, draws = 0.002 * np.arange(600), np.random.default_rng(5).standard_normal((3, 600))
    for number, (size, noise) in enumerate(((1.0, 0.01), (4.0, 0.01), (2.0, 0.5))):
        rows = np.column_stack([time, size * np.sin(6.0 * time) + noise * draws[number], np.sin(6.0 * time)])
        head = "t_s,current_A,angle_rad"
        np.savetxt(tmp_path / f"run{number}.csv", rows, "%.6f", ",", header=head, comments="")
    described = describe_records(tmp_path, joint)
    current = next(c for c in described.columns if c.head == "current_A")
    assert current.largest > 3.9
    assert current.noise == pytest.approx(0.01, rel=0.2)
    assert "run2" in current.differs
    assert "its noise is" in current.differs
    mapping = described.mapping()
    assert mapping.count("# between_samples = ") == 4
    assert "holds each value from its stamp to the next" in mapping


def test_a_torque_beside_a_drive_may_be_that_of_the_motor(tmp_path: Path, joint: FlatModel) -> None:
    rows = np.column_stack([0.002 * np.arange(300), np.sin(0.02 * np.arange(300)), np.cos(np.arange(300))])
    for head in ("motor_torque_Nm", "tau_Nm"):
        np.savetxt(tmp_path / "a.csv", rows, "%.6f", ",", header=f"t_s,angle_rad,{head}", comments="")
        described = describe_records(tmp_path, joint)
        column = next(c for c in described.columns if c.head == head)
        assert "divide that by torque constant and gear ratio" in described.question(column)


def test_a_joint_is_no_part_of_a_table(tmp_path: Path, joint: FlatModel) -> None:
    (tmp_path / "a.csv").write_text("t_s,angle_rad\n" + "".join(f"{0.01 * k},{k}\n" for k in range(50)))
    with pytest.raises(MeasurementError, match=r"is asked of a table; heads name joints in logs of messages"):
        load_records(tmp_path, joint, joint="elbow")
