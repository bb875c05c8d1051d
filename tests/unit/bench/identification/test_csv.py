"""Text tables as benches and spreadsheets write them: read rightly, or refused with file, row and column."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification import RecordSet, load_record
from nlsdesign.bench.identification.records.table_files import read_table
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import FlatModel
from tests.unit.bench.identification.test_measurement import MAPPING, model, table

__all__ = ["model"]
HEADS = ("t_s", "encoder.reading [deg]", "cell.reading [N*m]")


def lines(heads: Sequence[str], separator: str = ",") -> list[str]:
    return [separator.join(heads), *(separator.join(f"{v:.6f}" for v in row) for row in table())]


def read(folder: Path, text: str, model: FlatModel, encoding: str = "utf-8") -> RecordSet:
    (folder / "a.csv").write_text(text, encoding=encoding)
    return load_record(folder / "a.csv", model)


PLAIN = lines(HEADS)


def with_commas(separator: str) -> list[str]:
    first, *rows = lines(HEADS, separator)
    return [first, *(row.replace(".", ",") for row in rows)]


def with_heads(*heads: str) -> list[str]:
    return [";".join(heads), *with_commas(";")[1:]]


def dated(row: str) -> str:
    seconds, comma, rest = row.partition(",")
    stamp = datetime.datetime(2026, 3, 29, 1, 59, 59) + datetime.timedelta(seconds=float(seconds))
    return stamp.isoformat(" ", "milliseconds") + comma + rest


UNITLESS = ("t", "encoder.reading", "cell.reading")
WRITTEN = {
    "plain": (PLAIN, "utf-8"),
    "byte order mark": (PLAIN, "utf-8-sig"),
    "UTF-16": (PLAIN, "utf-16"),
    "semicolons": (lines(HEADS, ";"), "utf-8"),
    "decimal commas": (with_commas(";"), "utf-8"),
    "tabs": (lines(HEADS, "\t"), "utf-8"),
    "tabs and commas": (with_commas("\t"), "utf-8"),
    "comments": (["# bench 3", "% measured in May", "// ok", "", *PLAIN], "utf-8"),
    "titles of a logger": (["Bench 3; measured in May", "", "operator: x", *PLAIN], "utf-8"),
    "titles before units": (["Bench 3", ";".join(UNITLESS), "s;deg;N*m", *with_commas(";")[1:]], "utf-16"),
    "heads in a comment": (["# bench 3", f"# {PLAIN[0]}", *PLAIN[1:]], "utf-8"),
    "a row of units": ([",".join(UNITLESS), "s,deg,N*m", *PLAIN[1:]], "utf-8"),
    "units in brackets": ([",".join(UNITLESS), "[s],[deg],[N*m]", *PLAIN[1:]], "utf-8"),
    "a separator behind each row": ([f"{row}," for row in PLAIN], "utf-8"),
    "quotes": (['"' + PLAIN[0].replace(",", '","') + '"', *PLAIN[1:]], "utf-8"),
    "Windows": ([f"{row}\r" for row in PLAIN], "utf-8"),
    "Excel in Europe": ([*with_heads("t [s]", "encoder.reading [°]", "cell.reading [N·m]")], "cp1252"),
    "dates": ([",".join(("timestamp", *HEADS[1:])), *map(dated, PLAIN[1:])], "utf-8"),
    "German heads": ([*with_heads("Zeit in s", "Winkel (°)", "Drehmoment / Nm")], "utf-8"),
    "symbols over units": ([*with_heads("t/s", "φ/°", "M/Nm")], "utf-8"),
    "a comment between rows": ([*PLAIN[:9], "# a note", "", *PLAIN[9:]], "utf-8"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRITTEN)
def test_the_same_numbers_come_from_every_way_of_writing_them(
    case: str, tmp_path: Path, model: FlatModel
) -> None:
    rows, encoding = WRITTEN[case]
    (record,) = read(tmp_path, "\n".join(rows) + "\n", model, encoding).records
    np.testing.assert_allclose(record.trace["encoder.reading"], np.radians(table()[:, 1]), atol=1e-8)
    np.testing.assert_allclose(record.trace["cell.reading"], table()[:, 2], atol=1e-6)


def spoilt(row: int, old: str, new: str) -> list[str]:
    rows = PLAIN.copy()
    assert old in rows[row - 1]
    rows[row - 1] = rows[row - 1].replace(old, new, 1)
    return rows


def cell(row: int, text: str) -> list[str]:
    rows = PLAIN.copy()
    rows[row - 1] = rows[row - 1].rpartition(",")[0] + "," + text
    return rows


REFUSED = {
    "two equal heads": (
        [",".join(("t_s", "force_N", "force_N")), *PLAIN[1:]],
        r"a\.csv: columns 2 and 3: have the same head 'force_N'.*head of its own",
    ),
    "1_000": (cell(9, "1_000"), r"column 'cell.reading \[N\*m\]', row 9: '1_000' is not a number.*thousands"),
    "full-width digits": (cell(9, "１２"), r"column 'cell.reading \[N\*m\]', row 9: '１２' is not a number"),
    "1e308": (cell(9, "1e308"), r"row 9: 1e\+308 is larger than anything that is measured"),
    "an empty cell": (cell(9, ""), r"column 'cell.reading \[N\*m\]', row 9: '' is not a number"),
    "a huge cell": (cell(9, '"' + "x" * 200_000 + '"'), r"a\.csv: row 9: cannot be read.*field"),
    "decimal commas between commas": (
        [PLAIN[0], *(row.replace(".", ",") for row in PLAIN[1:])],
        r"row 2: has 6 cells, the heads are 3 -> separate the cells by semicolons",
    ),
    "a word": (cell(9, "high"), r"row 9: 'high' is not a number -> correct the cell, or cut the record"),
    "nothing": ([], r"a\.csv: has 0 rows of numbers; at least 50 are needed -> take the file away"),
    "two units": (
        [PLAIN[0], "s,deg,N", *PLAIN[1:]],
        r"column 'cell.reading \[N\*m\]'.*is in N·m by its head and in N by the row below",
    ),
    "a time without unit": (
        [",".join(("t", *HEADS[1:])), *PLAIN[1:]],
        r"a\.csv: column 't'.*samples lie 0.002 apart, which may be seconds or milliseconds.*'t_ms'",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused_with_its_place(case: str, tmp_path: Path, model: FlatModel) -> None:
    rows, words = REFUSED[case]
    with pytest.raises(MeasurementError, match=words):
        read(tmp_path, "\n".join(rows) + "\n", model)


def test_text_that_is_no_utf_8_is_read_as_windows_writes_it_and_this_is_said(
    tmp_path: Path, model: FlatModel
) -> None:
    records = read(tmp_path, "\n".join(["# Temperatur 20 °C", *PLAIN]) + "\n", model, "cp1252")
    assert [(r.place, r.text) for r in records.remarks] == [("a.csv", "is no UTF-8 and was read as cp1252")]
    (tmp_path / "a.csv").write_bytes(b"t_s,\x81\n")
    with pytest.raises(
        MeasurementError, match=r"a\.csv: cannot be read: it is no text in UTF-8.* -> save it"
    ):
        load_record(tmp_path / "a.csv", model)


def test_rows_between_which_comments_stand_are_named_by_their_lines(tmp_path: Path, model: FlatModel) -> None:
    with pytest.raises(MeasurementError, match=r"row 11: 'high' is not a number"):
        read(tmp_path, "\n".join([*PLAIN[:5], "# one", "", *cell(9, "high")[5:]]), model)


def test_a_comment_moves_the_rows_that_messages_name(tmp_path: Path, model: FlatModel) -> None:
    with pytest.raises(MeasurementError, match=r"row 11: 'high' is not a number"):
        read(tmp_path, "\n".join(["# one", "# two", *cell(9, "high")]), model)


def test_milliseconds_are_converted_where_the_head_says_so(tmp_path: Path, model: FlatModel) -> None:
    rows = [f"{1e3 * float(row.partition(',')[0]):.3f},{row.partition(',')[2]}" for row in PLAIN[1:]]
    (record,) = read(tmp_path, "\n".join([PLAIN[0].replace("t_s", "t_ms"), *rows]), model).records
    assert record.step == pytest.approx(0.002, rel=1e-9)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3)])
def test_a_clock_that_counts_from_1970_begins_at_zero_and_this_is_said(
    unit: str, factor: float, tmp_path: Path, model: FlatModel
) -> None:
    began = datetime.datetime(2024, 5, 1, tzinfo=datetime.UTC).timestamp()
    rows = [
        f"{factor * (began + float(row.partition(',')[0])):.3f},{row.partition(',')[2]}" for row in PLAIN[1:]
    ]
    (record,) = read(tmp_path, "\n".join([PLAIN[0].replace("t_s", f"t_{unit}"), *rows]), model).records
    assert record.trace.time[0] == 0.0
    assert record.trace.time[-1] == pytest.approx(table()[-1, 0], rel=1e-6)
    assert "time counted from 17145" in record.source


def test_milliseconds_since_1970_under_a_head_in_seconds_are_asked_about(
    tmp_path: Path, model: FlatModel
) -> None:
    rows = [f"{1.7e12 + 2 * k},{row.partition(',')[2]}" for k, row in enumerate(PLAIN[1:])]
    with pytest.raises(MeasurementError, match=r"years from zero.*milliseconds, name it 't_ms'"):
        read(tmp_path, "\n".join([PLAIN[0], *rows]), model)


def test_a_mapping_names_the_heads_as_they_stand(tmp_path: Path, model: FlatModel) -> None:
    """A row of units does not change them."""
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    rows = [",".join(("t_s", "theta_deg", "torque_Nm")), "s,deg,N*m", *PLAIN[1:]]
    (record,) = read(tmp_path, "\n".join(rows), model).records
    assert len(record.trace) == len(table())


@pytest.mark.slow
def test_a_long_text_file_is_read_in_bounded_memory(tmp_path: Path) -> None:
    tracemalloc = pytest.importorskip("tracemalloc")
    count = 200_000
    block = "".join(f"{k * 0.001:.3f},{k % 7},{k % 11}.5\n" for k in range(count))
    (tmp_path / "long.csv").write_text("t_s,a_N,b_N\n" + block, encoding="utf8")
    tracemalloc.start()
    try:
        read_columns = read_table(tmp_path / "long.csv").given
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(read_columns["b_N"]) == count
    assert peak < 4 * 3 * 8 * count, "a few times the numbers themselves, not a text for every cell"
