"""Records that cannot be diagnosed: each gets one named answer, and nothing is written."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import ALL, diagnose, write_verdict
from nlsdesign.bench.discrepancy.reporting.advice import more_excitation
from nlsdesign.bench.identification import Parameter, load_records
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.cli import main
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import deck_digest, declare, write_deck
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import flatten
from nlsdesign.regeneration.exported_machine import ExportedMachine
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, write_declaration, write_records
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

HEADS = "t_s,theta_rad,current_A,force_N"
TIME, ANGLE, CURRENT, FORCE = range(4)
SHORT = "sine_15deg_5.0Hz"
TWO = tuple(each for each in ALL if each.__name__ in ("coulomb_friction", "second_relaxation"))


@pytest.fixture(scope="module")
def clean() -> np.ndarray:
    """Three seconds of a rig with nothing to hide."""
    return make_records(ACTUATORS["arm"], {}, 11, only=(SHORT,))[SHORT]


@pytest.fixture
def rig(tmp_path: Path) -> Assembly:
    write_declaration(tmp_path, ACTUATORS["arm"])
    return declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")


def nan(rows: np.ndarray) -> np.ndarray:
    rows[700:703, FORCE] = np.nan
    return rows


def late_throughout(rows: np.ndarray) -> np.ndarray:
    return rows[np.arange(len(rows)) % 40 < 30]


def backwards(rows: np.ndarray) -> np.ndarray:
    rows[700:, TIME] -= 0.5
    return rows


REFUSED = {
    "nan": (nan, "a.csv: column 'force_N', rows 702 to 704", "is not a finite number", "cut the record"),
    "late": (late_throughout, "a.csv: column 't_s', row 32", "there is a gap of 0.022 s", "resample_Hz = 45"),
    "backwards": (backwards, "a.csv: column 't_s', row 702", "time runs backwards", "sort the record"),
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.parametrize("command", ["diagnose", "fit"])
def test_what_cannot_be_read_is_named_and_nothing_is_written(
    case: str,
    command: str,
    rig: Assembly,
    clean: np.ndarray,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    change, *words = REFUSED[case]
    records, out = tmp_path / "records", tmp_path / "out"
    write_records(records, {"a": change(clean.copy())})
    write_deck(rig, tmp_path / "deck.toml")
    called = ["nlsdesign", command, "--deck", str(tmp_path / "deck.toml"), "--records", str(records)]
    monkeypatch.setattr(sys, "argv", [*called, "--out", str(out), "--force"])
    with pytest.raises(SystemExit) as leaving:
        main()
    assert leaving.value.code == 2
    said = capsys.readouterr().err
    assert all(each in said for each in words), said
    assert not out.exists()


def constant(rows: np.ndarray) -> np.ndarray:
    rows[:, FORCE] = 12.0
    return rows


def clipped(rows: np.ndarray) -> np.ndarray:
    rows[:, FORCE] = np.minimum(rows[:, FORCE], 0.6 * rows[:, FORCE].max())
    return rows


@pytest.mark.slow
def test_files_of_an_earlier_run_do_not_stay_beside_a_verdict_that_has_none(
    rig: Assembly, clean: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    records, out = tmp_path / "records", tmp_path / "out"
    write_records(records, {"a": constant(clean.copy()), "b": clean})
    write_deck(rig, tmp_path / "deck.toml")
    out.mkdir()
    for name in ("next_record.csv", "regeneration.json", "notes.txt"):
        (out / name).write_text("earlier", encoding="utf8")
    called = ["nlsdesign", "diagnose", "--deck", str(tmp_path / "deck.toml"), "--records", str(records)]
    code = out / "c" / "observer.c"

    def exported(*_: object, **__: object) -> ExportedMachine:
        code.parent.mkdir()
        code.write_text("")
        return ExportedMachine({code: "observer in C99"}, ())

    monkeypatch.setattr("nlsdesign.regeneration.export_machine", exported)
    monkeypatch.setattr(sys, "argv", [*called, "--export", "--out", str(out), "--force"])
    main()
    assert (out / "verdict.json").exists()
    assert 'href="c/observer.c"' in (out / "report.html").read_text("utf-8")
    assert not (out / "next_record.csv").exists()
    assert not (out / "regeneration.json").exists()
    assert (out / "notes.txt").exists(), "what is not ours stays"


@pytest.mark.slow
def test_code_of_the_better_deck_is_written_with_the_verdict(
    rig: Assembly, clean: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    records, out = tmp_path / "records", tmp_path / "out"
    write_records(records, {"a": constant(clean.copy()), "b": clean})
    write_deck(rig, tmp_path / "deck.toml")
    called = ["nlsdesign", "diagnose", "--deck", str(tmp_path / "deck.toml"), "--records", str(records)]
    monkeypatch.setattr(sys, "argv", [*called, "--export", "--out", str(out)])
    main()
    better = declare(load_deck(out / "model.toml"))
    assert better.name == f"{rig.name}_diagnosed_{deck_digest(better)[:8]}"
    assert better.parent is not None
    assert better.parent.digest == deck_digest(rig)
    for name in ("observer", "controller", "torque_loop"):
        assert f'_DECK_DIGEST "{deck_digest(better)}"' in (out / "c" / f"{name}.h").read_text("utf-8")
        assert (out / f"{name}.fmu").exists()
    assert (out / "plant.fmu").exists()
    assert 'href="plant.fmu"' in (out / "report.html").read_text("utf-8")


def in_millinewton(rows: np.ndarray) -> np.ndarray:
    rows[:, FORCE] *= 1e3
    return rows


def in_degrees(rows: np.ndarray) -> np.ndarray:
    rows[:, ANGLE] = np.degrees(rows[:, ANGLE])
    return rows


def spike(rows: np.ndarray) -> np.ndarray:
    rows[700, FORCE] += 300.0
    return rows


def dropout(rows: np.ndarray) -> np.ndarray:
    rows[730:735, FORCE] = 0.0
    return rows


def encoder_at_zero(rows: np.ndarray) -> np.ndarray:
    rows[733, ANGLE] = 0.0
    return rows


def huge_current(rows: np.ndarray) -> np.ndarray:
    rows[700, CURRENT] = 50.0
    return rows


MASKED = {
    "spike": (spike, "force_N", "row 702: spike by 3", 700),
    "dropout": (dropout, "force_N", "rows 732 to 736: samples off by", 730),
    "encoder": (encoder_at_zero, "theta_rad", "row 735: spike by", 733),
    "current": (huge_current, "current_A", "row 702: spike by", 700),
}


@pytest.mark.parametrize("case", MASKED)
def test_a_faulty_sample_is_masked_and_said_and_suspects_nothing(
    case: str, rig: Assembly, clean: np.ndarray, tmp_path: Path
) -> None:
    change, head, words, place = MASKED[case]
    write_records(tmp_path / "records", {"a": change(clean.copy())})
    records = load_records(tmp_path / "records", flatten(rig))
    assert records.findings == ()
    said = [str(each) for each in records.remarks]
    assert any(f"a.csv: column '{head}', {words}" in each for each in said), said
    assert any(f"at {clean[place, TIME]:g} s" in each and "masked" in each for each in said), said
    (signal,) = (c.signal for c in records.columns if c.name == head)
    assert place in np.flatnonzero(records.records[0].masked_in([signal]))


@pytest.mark.slow
def test_a_faulty_sample_does_not_change_the_diagnosis(
    rig: Assembly, clean: np.ndarray, tmp_path: Path
) -> None:
    other = make_records(ACTUATORS["arm"], {}, 11, only=("sine_25deg_2.0Hz",))["sine_25deg_2.0Hz"]
    verdicts = []
    for name, rows in (("sound", clean), ("spoilt", spike(clean.copy()))):
        write_records(tmp_path / name, {"a": rows, "b": other})
        records = load_records(tmp_path / name, flatten(rig), hold_out=["b"])
        verdicts.append(diagnose(rig, records, catalogue=TWO))
    assert verdicts[0].verdict == verdicts[1].verdict
    assert verdicts[0].where == verdicts[1].where


def test_many_faulty_samples_make_a_record_suspect(rig: Assembly, clean: np.ndarray, tmp_path: Path) -> None:
    rows = clean.copy()
    rows[20:-20:60, FORCE] += 300.0
    write_records(tmp_path / "records", {"a": rows})
    (finding,) = load_records(tmp_path / "records", flatten(rig)).findings
    assert "column 'force_N'" in str(finding)
    assert "1.7 % of its samples are faulty: check cable and recorder" in str(finding) or "1.6 %" in str(
        finding
    )


def turned_current(rows: np.ndarray) -> np.ndarray:
    rows[:, CURRENT] *= -1.0
    return rows


def in_milliampere(rows: np.ndarray) -> np.ndarray:
    rows[:, CURRENT] *= 1e3
    return rows


SUSPECT: dict[str, tuple[Callable[[np.ndarray], np.ndarray], str]] = {
    "clipped": (clipped, "a.csv: column 'force_N', rows "),
    "millinewton": (in_millinewton, "is it in thousandths of the stated unit?"),
    "degrees": (in_degrees, "the declared cam ends at"),
    "turned": (turned_current, "column 'current_A': is -"),
    "milliampere": (in_milliampere, "is it in thousandths of the stated unit?"),
}
SLOW = pytest.param("milliampere", marks=pytest.mark.slow)
"""The turned current takes the same way."""


@pytest.mark.long_cases("millinewton", "degrees", "turned")
@pytest.mark.parametrize("case", [c for c in SUSPECT if c != "milliampere"] + [SLOW])
def test_what_looks_wrong_is_suspected_before_any_effect_is_tried(
    case: str, rig: Assembly, clean: np.ndarray, tmp_path: Path
) -> None:
    change, words = SUSPECT[case]
    write_records(tmp_path / "records", {"a": change(clean.copy())})
    found = diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=(_never,))
    assert found.verdict == "data_suspect"
    assert found.effects == ()
    assert any(words in each for each in found.where), found.where
    assert "suspect" in found.words()


def test_a_dead_channel_is_named_because_its_block_cannot_be_judged(
    rig: Assembly, clean: np.ndarray, tmp_path: Path
) -> None:
    write_records(tmp_path / "records", {"a": constant(clean.copy())})
    with pytest.raises(
        MeasurementError,
        match=r"a\.csv: column 'force_N', rows 2 to 1501: is constant at 12, so block 'spring' cannot",
    ):
        diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=(_never,))


@pytest.mark.slow
def test_a_channel_that_is_dead_in_one_record_makes_the_set_suspect(
    rig: Assembly, clean: np.ndarray, tmp_path: Path
) -> None:
    write_records(tmp_path / "records", {"a": clean, "b": constant(clean.copy()), "c": clean})
    found = diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=(_never,))
    assert found.verdict == "data_suspect"
    assert any("b.csv: column 'force_N', rows 2 to 1501: is constant at 12" in each for each in found.where)


def _never(assembly: Assembly) -> list[object]:
    raise AssertionError("no effect should be tried on suspect data")


@pytest.mark.slow
def test_records_of_a_rig_with_other_numbers_are_said_to_be_that(tmp_path: Path, rig: Assembly) -> None:
    """Rubber of twice the stiffness: effects would explain a part, other numbers explain all of it.

    From a single fitted record the two could not be told apart.
    """
    arm = ACTUATORS["arm"]
    stiff = replace(arm.rubber, k_star=tuple(2.0 * k for k in arm.rubber.k_star), k=2.0 * arm.rubber.k)
    motions = (SHORT, "sine_25deg_2.0Hz", "sine_45deg_0.5Hz", "sine_25deg_0.1Hz")
    of_another = make_records(replace(arm, rubber=stiff), {}, 5, only=motions)
    write_records(tmp_path / "records", of_another)
    found = diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=TWO)
    assert found.verdict == "data_suspect"
    (told,) = [each for each in found.where if "may be of another rig" in each]
    assert "modulus" in told
    assert "standard deviations away" in told
    assert found.effects == ()


@pytest.mark.slow
def test_a_hidden_effect_is_not_taken_for_another_rig_and_is_named_the_same_twice(
    tmp_path: Path, rig: Assembly
) -> None:
    hidden = make_records(ACTUATORS["arm"], {"coulomb_friction": 1.0}, 5, only=(SHORT, "sine_25deg_2.0Hz"))
    write_records(tmp_path / "records", hidden)
    found, again = (
        diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=TWO) for _ in range(2)
    )
    assert found.verdict == "named"
    assert [e.name for e in found.effects] == ["coulomb_friction"]
    assert not any("another rig" in each for each in found.where)
    # The same records give the same verdict, to the last byte.
    written = [[f.read_bytes() for f in write_verdict(each, tmp_path / "out")] for each in (found, again)]
    assert written[0] == written[1]
    assert b"coulomb_friction" in written[0][0]


def test_signals_that_the_model_does_not_have_name_the_deck_as_a_way_out(
    tmp_path: Path, rig: Assembly, clean: np.ndarray
) -> None:
    write_records(tmp_path / "records", {"a": clean})
    file = tmp_path / "records" / "a.csv"
    file.write_text(file.read_text().replace("current_A", "supply_V"), encoding="utf8")
    with pytest.raises(
        MeasurementError,
        match=r"a\.csv: column 'supply_V'.*no sensor of the model reads in V.*deck of",
    ):
        load_records(tmp_path / "records", flatten(rig))
    mapping = '[columns.force_N]\nsignal = "tensile.reading"\nunit = "N"\n'
    (tmp_path / "records" / "records.toml").write_text(mapping, encoding="utf8")
    with pytest.raises(MeasurementError, match=r"'tensile.reading', which the model does not have.*deck of"):
        load_records(tmp_path / "records", flatten(rig))


def test_records_that_hardly_move_say_how_fast_they_should(
    tmp_path: Path, rig: Assembly, clean: np.ndarray
) -> None:
    """A twentieth of a degree: a few counts of the encoder."""
    rows = clean.copy()
    quantum = ACTUATORS["arm"].sensors.angle_quantum
    rows[:, ANGLE] = quantum * np.round(rows[:, ANGLE] / (300.0 * quantum))
    write_records(tmp_path / "records", {"a": rows})
    with pytest.raises(
        MeasurementError,
        match=r"block 'motor': no record moves enough.*encoder.reading changes faster than [\d.]+ rad/s",
    ):
        diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=TWO)


def test_what_records_leave_open_comes_with_the_experiment_that_decides() -> None:
    """Two numbers of which only the product is known, and one that is known."""
    names = ("motor.inertia", "bearing.damping", "spring.rubber.modulus")
    units = ("kg*m^2", "N*m*s/rad", "Pa")
    numbers = tuple(
        Parameter(n, u, 1.0, 1.0, np.inf, 0.1, 10.0, "log") for n, u in zip(names, units, strict=True)
    )
    open_pair = np.array([[0.5, -0.49, 0.0], [-0.49, 0.5, 0.0], [0.0, 0.0, 1e-6]])
    fit = Fit(numbers, dict.fromkeys(names, 1.0), open_pair, 1.0, {}, True)
    (said,) = more_excitation([fit])
    assert "motor.inertia up with bearing.damping down" in said or "motor.inertia down" in said
    assert "faster reversals" in said
    assert "a third and at three times the speed" in said
    assert "larger amplitude" not in said
