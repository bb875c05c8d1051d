"""Records from Parquet, MAT and HDF5: the same numbers as from CSV, and refusals with a name."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from nlsdesign.bench.identification import load_records
from nlsdesign.bench.identification.records.table_files import read_table
from nlsdesign.foundation.errors import MeasurementError, MissingLibraryError
from tests.unit.bench.identification.test_measurement import MAPPING, model, table

__all__ = ["model"]
HEADS = ("t_s", "theta_deg", "torque_Nm")


def as_parquet(file: Path, columns: dict[str, np.ndarray]) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet").write_table(pyarrow.table(columns), file)


def as_hdf5(file: Path, columns: dict[str, np.ndarray]) -> None:
    with pytest.importorskip("h5py").File(file, "w") as stream:
        for name, values in columns.items():
            stream[name] = values


def as_mat(file: Path, columns: dict[str, np.ndarray]) -> None:
    savemat(file, {name: values[:, None] for name, values in columns.items()})


WRITERS = {".parquet": as_parquet, ".h5": as_hdf5, ".mat": as_mat}


@pytest.fixture
def columns() -> dict[str, np.ndarray]:
    return dict(zip(HEADS, table().T.copy(), strict=True))


@pytest.mark.parametrize("ending", WRITERS)
def test_every_format_gives_the_same_record(
    ending: str, columns: dict[str, np.ndarray], tmp_path: Path, model: object
) -> None:
    for name in "ac":
        WRITERS[ending](tmp_path / f"{name}{ending}", columns)
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    records = load_records(tmp_path, model)  # type: ignore[arg-type]
    assert [(r.name, r.role) for r in records.records] == [("a", "fit"), ("c", "held_out")]
    trace = records.records[0].trace
    np.testing.assert_allclose(trace["encoder.reading"], np.radians(columns["theta_deg"]), rtol=1e-12)
    np.testing.assert_allclose(trace["cell.reading"], columns["torque_Nm"], rtol=1e-12)


@pytest.mark.parametrize("ending", WRITERS)
def test_a_gap_in_a_binary_file_is_named_by_file_column_and_row(
    ending: str, columns: dict[str, np.ndarray], tmp_path: Path, model: object
) -> None:
    columns["torque_Nm"][10:12] = np.nan
    WRITERS[ending](tmp_path / f"a{ending}", columns)
    (tmp_path / "records.toml").write_text(MAPPING.replace('["c*"]', "[]"), encoding="utf8")
    with pytest.raises(
        MeasurementError, match=r"a\..*column 'torque_Nm', rows 11 to 12.*not a finite number"
    ):
        load_records(tmp_path, model)  # type: ignore[arg-type]


def test_structures_and_groups_name_their_columns(tmp_path: Path) -> None:
    rows = {"time": np.arange(60.0), "force": np.ones(60)}
    savemat(tmp_path / "nested.mat", {"run": {**rows, "note": "first"}, "rate": 500.0})
    assert read_table(tmp_path / "nested.mat").heads == ("run.time", "run.force")
    as_hdf5(tmp_path / "nested.h5", {f"run/{n}": v for n, v in rows.items()})
    assert sorted(read_table(tmp_path / "nested.h5").heads) == ["run/force", "run/time"]


def test_columns_of_different_clocks_are_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "two.mat", {"t": np.arange(100.0), "f": np.ones(90)})
    found = read_table(tmp_path / "two.mat")
    with pytest.raises(MeasurementError, match=r"differ in length: 't' 100, 'f' 90.*one clock"):
        found.columns(["t", "f"])


@pytest.mark.parametrize("ending", [".parquet", ".mat", ".h5"])
def test_a_file_that_is_no_table_is_refused(ending: str, tmp_path: Path) -> None:
    pytest.importorskip({".parquet": "pyarrow", ".mat": "scipy", ".h5": "h5py"}[ending])
    file = tmp_path / f"broken{ending}"
    file.write_bytes(b"this is not a table" * 40)
    with pytest.raises(MeasurementError, match=rf"broken\{ending}.*cannot be read"):
        read_table(file)


def test_two_records_of_one_name_are_refused(
    columns: dict[str, np.ndarray], tmp_path: Path, model: object
) -> None:
    as_mat(tmp_path / "a.mat", columns)
    (tmp_path / "a.csv").write_text("t_s\n0\n", encoding="utf8")
    with pytest.raises(MeasurementError, match=r"a\.csv and a\.mat.*same name"):
        load_records(tmp_path, model)  # type: ignore[arg-type]


@pytest.mark.parametrize(("ending", "library"), [(".parquet", "pyarrow"), (".h5", "h5py")])
def test_a_missing_library_is_named_with_what_installs_it(
    ending: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = importlib.import_module

    def without(name: str, package: str | None = None) -> object:
        if name.partition(".")[0] == library:
            raise ModuleNotFoundError(name)
        return real(name, package)

    monkeypatch.setattr(importlib, "import_module", without)
    (tmp_path / f"a{ending}").write_bytes(b"")
    with pytest.raises(MissingLibraryError, match=rf"needs {library}.*pip install 'nlsdesign\[records\]'"):
        read_table(tmp_path / f"a{ending}")


@pytest.mark.parametrize("ending", WRITERS)
def test_damage_is_one_message_whatever_the_library_says(
    ending: str, columns: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """Cut at many places and with bytes turned over: what can be read is a table, the rest names the file."""
    whole = tmp_path / f"whole{ending}"
    WRITERS[ending](whole, columns)
    sound, draw = whole.read_bytes(), np.random.default_rng(8)
    refused = 0
    for number in range(60):
        damaged = bytearray(sound)
        if number % 2:
            damaged = damaged[: int(draw.integers(1, len(damaged)))]
        else:
            for place in draw.integers(0, min(len(damaged), 600), 4):
                damaged[place] ^= int(draw.integers(1, 256))
        file = tmp_path / f"damaged{ending}"
        file.write_bytes(bytes(damaged))
        try:
            assert isinstance(read_table(file).given, dict)
        except MeasurementError as error:
            refused += file.name in str(error)
    assert refused > 15


def test_a_column_of_another_file_or_of_terabytes_is_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    np.arange(100.0).tofile(tmp_path / "secret.bin")
    with h5py.File(tmp_path / "outside.h5", "w") as stream:
        stream.create_dataset("force", (100,), "f8", external=[(str(tmp_path / "secret.bin"), 0, 800)])
    with pytest.raises(MeasurementError, match=r"outside\.h5: 'force'.*from another file"):
        read_table(tmp_path / "outside.h5")
    with h5py.File(tmp_path / "huge.h5", "w") as stream:
        stream.create_dataset("force", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(MeasurementError, match=r"huge\.h5: 'force'.*declares 1e\+12 numbers"):
        read_table(tmp_path / "huge.h5")


def test_two_columns_of_one_head_in_a_binary_file_are_refused(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.table([np.arange(60.0), np.ones(60), np.zeros(60)], names=["t_s", "f_N", "f_N"])
    pytest.importorskip("pyarrow.parquet").write_table(table, tmp_path / "a.parquet")
    with pytest.raises(MeasurementError, match=r"a\.parquet: columns 2 and 3: have the same head 'f_N'"):
        read_table(tmp_path / "a.parquet")
