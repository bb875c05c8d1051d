"""Nonsense in records.toml: one message with file, field, rule and next step, never a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.identification.records.mapping import read_mapping
from nlsdesign.foundation.errors import MeasurementError

SOUND = """
held_out = ["c*"]
held_out_after = {value = 2.0, unit = "s"}
resample_Hz = 500
[time]
column = "t_ms"
unit = "ms"
[columns.theta_deg]
signal = "encoder.reading"
unit = "deg"
noise = 0.01
time = "t2_ms"
[[align]]
column = "theta_deg"
to = "other"
"""
NONSENSE = {
    ('[time]\ncolumn = "t_ms"\nunit = "ms"', "time = 3"): r"time: 3 is not a table -> write \[time\]",
    ('column = "t_ms"', "column = 3"): r"time.column: 3 is not a text -> write column",
    ('unit = "ms"', "unit = 3"): r"time.unit: 3 is not a text",
    ('unit = "ms"', 'unit = "deg"'): r"time.unit: 'deg' is no unit of time -> write \"s\"",
    ('unit = "ms"', 'unit = "fortnights"'): r"time.unit: 'fortnights' is no unit of time",
    ('column = "t_ms"', 'colum = "t_ms"'): r"time.colum: no such field; did you mean 'column'",
    ('signal = "encoder.reading"', "signal = 3"): r"columns.theta_deg.signal: 3 is not a text",
    ('unit = "deg"', "unit = 3"): r"columns.theta_deg.unit: 3 is not a text",
    ("noise = 0.01", 'noise = "a"'): r"columns.theta_deg.noise: 'a' is not a finite number -> write noise",
    ("noise = 0.01", "noise = {a = 1}"): r"columns.theta_deg.noise: \{'a': 1\} is not a finite number",
    ("noise = 0.01", "noise = nan"): r"noise: nan is not a finite number",
    ("noise = 0.01", "noise = -1"): r"columns.theta_deg.noise: -1 is negative",
    ("noise = 0.01", "quantum = true"): r"columns.theta_deg.quantum: True is not a finite number",
    ('time = "t2_ms"', "time = 3"): r"columns.theta_deg.time: 3 is not a text",
    ('held_out = ["c*"]', "held_out = 3"): r"held_out: 3 is not a list of names.*write held_out = \[",
    ('held_out = ["c*"]', 'held_out = "c*"'): r"held_out: 'c\*' is not a list of names",
    ('held_out = ["c*"]', "held_out = [3]"): r"held_out: \[3\] is not a list of names",
    ('held_out = ["c*"]', "selection = 3"): r"selection: 3 is not a list of names",
    ("resample_Hz = 500", "resample_Hz = 1e12"): r"resample_Hz: 1000000000000.0 is not a rate between 0 and",
    ("resample_Hz = 500", "resample_Hz = -1"): r"resample_Hz: -1 is not a rate",
    ("resample_Hz = 500", 'resample_Hz = "a"'): r"resample_Hz: 'a' is not a finite number",
    ("resample_Hz = 500", f"resample_Hz = {'9' * 400}"): r"resample_Hz: 9+\.\.\. is not a finite number",
    ("resample_Hz = 500", f"resample_Hz = {'9' * 5000}"): r"cannot be read as a mapping",
    ("{value = 2.0,", '{value = "x",'): r"held_out_after: is not a time -> write held_out_after",
    ('2.0, unit = "s"}', '2.0, unit = "deg"}'): r"held_out_after: is not a time",
    ('2.0, unit = "s"}', "2.0, unit = 3}"): r"held_out_after: is not a time",
    ('to = "other"', "to = 3"): r"align: has no to -> add to",
    ('to = "other"', 'to = "other"\ntime = 3'): r"align.time: 3 is not a text",
}


@pytest.mark.parametrize("case", NONSENSE, ids=lambda case: case[1][:40])
def test_a_field_of_the_wrong_kind_is_one_message(case: tuple[str, str], tmp_path: Path) -> None:
    old, new = case
    assert old in SOUND
    file = tmp_path / "records.toml"
    file.write_text(SOUND.replace(old, new), encoding="utf8")
    with pytest.raises(MeasurementError, match=rf"(?s)records\.toml.*{NONSENSE[case]}"):
        read_mapping(file)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("columns = 3", r"columns: 3 is not a table"),
        ("[columns]\ntheta_rad = 3", r"columns.theta_rad: 3 is not a table"),
    ],
)
def test_columns_are_tables(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "records.toml").write_text(text, encoding="utf8")
    with pytest.raises(MeasurementError, match=words):
        read_mapping(tmp_path / "records.toml")


def test_what_is_no_text_is_said_to_be_none(tmp_path: Path) -> None:
    (tmp_path / "records.toml").write_bytes(b"\xff\xfe\x00\x81" * 20)
    with pytest.raises(MeasurementError, match=r"records\.toml: cannot be read: it is no text"):
        read_mapping(tmp_path / "records.toml")


def test_what_is_sound_is_read(tmp_path: Path) -> None:
    (tmp_path / "records.toml").write_text(SOUND, encoding="utf8")
    mapping = read_mapping(tmp_path / "records.toml")
    assert (mapping.time.name, mapping.resample, mapping.held_out) == ("t_ms", 500.0, ("c*",))
    assert mapping.held_out_after == 2.0
    assert mapping.columns[0].time == "t2_ms"


def test_two_columns_of_one_signal_are_refused(tmp_path: Path) -> None:
    (tmp_path / "records.toml").write_text(
        SOUND + '[columns.again]\nsignal = "encoder.reading"\nunit = "deg"\n', encoding="utf8"
    )
    with pytest.raises(
        MeasurementError, match=r"columns.again: is mapped to 'encoder.reading', as 'theta_deg' is"
    ):
        read_mapping(tmp_path / "records.toml")
