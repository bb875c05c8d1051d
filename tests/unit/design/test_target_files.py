"""Targets and bands from CSV files: units, and every way in which a file can be wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.design import TabulatedStiffness, TabulatedTorque, read_target
from nlsdesign.design.curves.target_files import read_band
from nlsdesign.foundation.errors import MeasurementError, NlsError, UnitError, ValueRangeError


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        (tmp_path / "target.csv").write_text(text, encoding="utf-8")
        return tmp_path / "target.csv"

    return write


def test_degrees_and_millinewton_metres(written: Callable[[str], Path]) -> None:
    target = read_target(
        written("# a spring\nangle [deg], torque [mN*m], weight\n0,0,1\n\n30,500,2\n60,2000,0.5\n")
    )
    assert isinstance(target, TabulatedTorque)
    assert target.angles == pytest.approx(np.radians([0.0, 30.0, 60.0]))
    assert target.torques == pytest.approx([0.0, 0.5, 2.0])
    assert target.weights == (1.0, 2.0, 0.5)


def test_the_unit_behind_the_name_and_another_order(written: Callable[[str], Path]) -> None:
    target = read_target(written("torque_N*m,angle_rad\n0,0\n1,0.2\n3,0.5\n"))
    assert float(target.torque(0.5)) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("Winkel [°];Drehmoment in Nm\n0;0\n30;0,5\n60;2\n", "cp1252"),
        ("angle (deg)\ttorque (Nm)\n0\t0\n30\t0,5\n60\t2\n", "utf-8"),
        ("angle,torque\ndeg,mNm\n0,0\n30,500\n# the last\n60,2000\n", "utf-16"),
        ("# angle [deg], torque [N*m]\n0,0\n30,0.5\n60,2\n", "utf-8-sig"),
    ],
)
def test_a_target_is_written_as_records_are(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "curve.csv").write_text(text, encoding=encoding)
    target = read_target(tmp_path / "curve.csv")
    assert isinstance(target, TabulatedTorque)
    assert target.angles == pytest.approx(np.radians([0.0, 30.0, 60.0]))
    assert target.torques == pytest.approx([0.0, 0.5, 2.0])


def test_a_stiffness(written: Callable[[str], Path]) -> None:
    target = read_target(written("angle [deg],stiffness [N*m/deg]\n0,0.1\n10,0.1\n20,0.1\n"))
    assert isinstance(target, TabulatedStiffness)
    assert float(target.torque(np.radians(20.0))) == pytest.approx(2.0)


def test_a_band_beside_a_target(written: Callable[[str], Path]) -> None:
    path = written(
        "angle [rad],torque [N*m],lower [N*m],upper [N*m]\n0,0,-0.1,0.1\n0.4,1,0.8,1.2\n0.8,3,2.5,3.5\n"
    )
    assert read_target(path).largest == pytest.approx(3.0)
    assert read_band(path).contains(0.8, 3.4)


HEAD = "angle [deg],torque [N*m]\n"


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("", MeasurementError, r"target\.csv: is empty -> begin with heads such as 'angle \[rad\]'"),
        ("# nothing\n\n", MeasurementError, "is empty"),
        (HEAD, MeasurementError, "0 rows of numbers"),
        (HEAD + "0,0\n10,1\n", MeasurementError, "2 rows of numbers and needs at least 3"),
        (HEAD + "0,0\n10,1\n5,2\n", ValueRangeError, r"line 4, column 'angle': angles must ascend"),
        (HEAD + "0,0\n10,1\n10,2\n", ValueRangeError, "line 4, column 'angle'"),
        (HEAD + "1,0\n10,1\n20,2\n", ValueRangeError, "line 2, column 'angle': the first angle must be zero"),
        (HEAD + "0,0\n10,-1\n20,2\n", ValueRangeError, r"line 3, column 'torque' = -1: must be nowhere neg"),
        (
            HEAD + "0,0.5\n10,1\n20,2\n",
            ValueRangeError,
            r"line 2, column 'torque' = 0\.5.*start at zero torque",
        ),
        (
            HEAD + "0,0\n10,nan\n20,2\n",
            MeasurementError,
            "line 3, column 'torque': is no finite number",
        ),
        (HEAD + "0,0\n10,\n20,2\n", MeasurementError, "column 'torque .N.m.', row 3: '' is not a number"),
        (HEAD + "0,0\n10,1,5\n20,2\n", MeasurementError, "row 3: has 3 cells, the heads are 2"),
        ("angle,torque [N*m]\n0,0\n1,1\n2,2\n", UnitError, "column 'angle': names no unit"),
        (
            "angle [N],torque [N*m]\n0,0\n1,1\n2,2\n",
            UnitError,
            r"target\.csv: column 'angle \[N\]': 'N' is no unit",
        ),
        ("angle [mm],torque [N*m]\n0,0\n1,1\n2,2\n", UnitError, "unit like 'rad'"),
        ("angle [rad],torque [N*m]\n0,0\n10,1\n20,2\n", ValueRangeError, "were degrees meant"),
        ("angle [deg],torqe [N*m]\n0,0\n1,1\n2,2\n", MeasurementError, "did you mean 'torque'"),
        ("angle [deg],torque [N*m],torque [N*m]\n0,0,0\n", MeasurementError, "have the same head"),
        ("angle [deg],torque [N*m],torque_mN*m\n0,0,0\n", MeasurementError, "stands there twice"),
        ("angle [deg],lower [N*m]\n0,0\n1,1\n2,2\n", MeasurementError, "has no column 'torque'.*read_band"),
        ("torque [N*m]\n0\n1\n2\n", MeasurementError, "has no column 'angle'"),
        (
            "angle [deg],torque [N*m],stiffness [N*m/rad]\n0,0,1\n1,1,1\n2,2,1\n",
            MeasurementError,
            "keep one of them",
        ),
        (
            "angle [deg],stiffness [N*m/rad],weight\n0,0,1\n1,1,1\n2,2,1\n",
            MeasurementError,
            "column 'weight'",
        ),
        ("angle [deg],stiffness [N*m/rad]\n0,1\n1,-1\n2,1\n", ValueRangeError, "line 3, column 'stiffness'"),
        (
            HEAD.replace("\n", ",weight\n") + "0,0,1\n10,1,-1\n20,2,1\n",
            ValueRangeError,
            "line 3, column 'weight'",
        ),
    ],
)
def test_a_wrong_target_is_named(
    written: Callable[[str], Path], text: str, error: type[NlsError], words: str
) -> None:
    with pytest.raises(error, match=words):
        read_target(written(text))


def test_a_wrong_band_is_named(written: Callable[[str], Path]) -> None:
    crossed = written("angle [deg],lower [N*m],upper [N*m]\n0,0,0\n10,1,2\n20,3,2.5\n")
    with pytest.raises(ValueRangeError, match=r"line 4, column 'upper': the upper torque 2\.5 must be above"):
        read_band(crossed)
    with pytest.raises(MeasurementError, match="has no column 'lower'"):
        read_band(written(HEAD + "0,0\n10,1\n20,2\n"))


def test_no_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="cannot be read: No such file"):
        read_target(tmp_path / "missing.csv")
    (tmp_path / "photo.csv").write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_target(tmp_path / "photo.csv")
