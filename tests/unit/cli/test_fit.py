"""``nlsdesign fit`` on records of the independent rig, whose true numbers are known."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import refit
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import Assembly, Dashpot, Mass, Spring, tie
from nlsdesign.components.assembly.deck_writer import deck_digest, declare, write_deck
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import flatten
from tests.command_line import Run, run
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, truth, write_declaration, write_records
from tests.undrawn import undrawn
from tests.unit.bench.identification.test_shooting import NOISE, TRUE
from tests.unit.bench.identification.test_shooting import truth as slide_record

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
PARTS = ("observer", "controller", "torque_loop")
SHORT = "sine_15deg_5.0Hz"
"""Three seconds are enough where it does not matter how well the numbers are known."""
SEED, ONLY = 5, ("sine_25deg_2.0Hz", "sine_15deg_5.0Hz", "multisine")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with records of a rig that hides nothing, and the deck as its makers declare it."""
    folder = tmp_path_factory.mktemp("bench")
    write_declaration(folder, ACTUATORS["arm"])
    made = make_records(ACTUATORS["arm"], {}, SEED, only=ONLY)
    write_records(folder / "records", made)
    write_records(folder / "short", {SHORT: made[SHORT]})
    write_deck(declared_rig(folder / "rig.toml", folder / "cam.csv"), folder / "deck.toml")
    return folder


def assembly_of(deck: Path) -> Assembly:
    return declare(load_deck(deck))


@pytest.mark.slow
def test_the_numbers_of_the_rig_come_back_with_an_honest_error(run: Run, bench: Path, tmp_path: Path) -> None:
    called = ("fit", "--deck", str(bench / "deck.toml"), "--records", str(bench / "records"))
    status, out, _ = run(*called, "--hold-out", "multi*", "--out", str(tmp_path / "out"), "--json")
    assert status == 0
    found = json.loads(out[out.index("{") :])
    page = Path(found.pop("report")).read_text(encoding="utf8")
    assert "Refitted numbers" in page
    assert page.count('<span class="before">') == len(found["errors"])
    assert found == json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf8"))
    built, _ = truth(ACTUATORS["arm"], {}, SEED)
    expected = {
        "motor.inertia": built.drivetrain.inertia,
        "bearing.damping": built.drivetrain.viscosity,
        "spring.cable.rubber.relaxing.spring.modulus": built.rubber.k,
        "spring.cable.rubber.relaxing.dashpot.viscosity": built.rubber.eta,
        "spring.cable.rubber.stiff.modulus[1]": built.rubber.k_star[0],
    }
    numbers = {each["name"]: each for each in found["numbers"]}
    scores = [
        (numbers[name]["fitted"] - value) / numbers[name]["standard_error"]
        for name, value in expected.items()
    ]
    assert np.max(np.abs(scores)) < 4.0
    assert np.sqrt(np.mean(np.square(scores))) > 0.1
    for name, value in expected.items():
        assert numbers[name]["fitted"] == pytest.approx(value, rel=0.03)
    held = [e for e in found["errors"] if e["role"] == "held_out"]
    assert {e["block"] for e in held} == {"spring", "motor"}
    for each in held:
        assert each["fitted"] < 1.2 * each["noise_floor"] < each["declared"]
    assert not any("explain the records" in w for w in found["words"])
    # The noise of the force is far below what it measures.
    force = next(e for e in held if e["block"] == "spring")
    assert 0.0 < force["relative"] < 3.0
    assert f"on average {force['relative']:.3g}" in page
    # The multisine is held out, and 25 degrees do not engage the last segment of the rubber.
    assert any("next to nothing of spring.cable.rubber.stiff.modulus[6]" in w for w in found["words"])
    assert {r["record"] for r in found["records"] if r["role"] == "held_out"} == {"multisine"}


def test_the_deck_that_is_written_is_accepted_and_says_where_its_numbers_come_from(
    run: Run, bench: Path, tmp_path: Path
) -> None:
    status, out, _ = run(
        "fit", "--deck", str(bench / "deck.toml"), "--records", str(bench / "short"), "--out", "fitted"
    )
    assert status == 0
    assert "noise floor" in out
    assert "motor.inertia" in out
    deck = tmp_path / "fitted" / "model.toml"
    assert run("deck", "check", str(deck))[0] == 0
    fitted, declared = assembly_of(deck).quantities(), assembly_of(bench / "deck.toml").quantities()
    source, before = fitted["motor.inertia"].source, declared["motor.inertia"].source
    records = f" in {bench / 'short'}, "
    assert re.fullmatch(
        rf"fitted to bench records \w.*{re.escape(records)}\d{{4}}-\d\d-\d\d; declared: {re.escape(before)}",
        source,
    )
    assert fitted["motor.inertia"].spread == declared["motor.inertia"].spread
    record = str(bench / "short" / f"{SHORT}.csv")
    errors = []
    for each in (deck, bench / "deck.toml"):
        status, out, _ = run("simulate", "--deck", str(each), "--record", record, "--out", "y.csv", "--json")
        assert status == 0
        errors.append(json.loads(out)["rms"]["force_sensor.reading"])
    # Unfiltered, so that the noise of the sensor is in both.
    noise = ACTUATORS["arm"].sensors.force_noise
    assert errors[0] == pytest.approx(noise, rel=0.05)
    assert errors[1] ** 2 - errors[0] ** 2 > 0.2 * noise**2


@pytest.mark.slow
def test_a_number_at_the_end_of_its_range_is_not_passed_over(bench: Path) -> None:
    deck = assembly_of(bench / "deck.toml")
    inertia = deck.quantities()["motor.inertia"]
    wrong = deck.with_values({"motor.inertia": replace(inertia, value=2.0 * inertia.number)})
    found = refit(wrong, load_records(bench / "short", flatten(wrong)))
    (number,) = [n for n in found.numbers if n.name == "motor.inertia"]
    assert number.strain == pytest.approx(-3.0, abs=0.01)
    assert any("motor.inertia stands at the end of its range, -3.0 standard" in w for w in found.words())
    assert any(w.startswith("No numbers explain the records: motor is left at") for w in found.words())


def test_a_deck_that_leaves_nothing_free_is_refused(bench: Path) -> None:
    deck = assembly_of(bench / "deck.toml")
    numbers = deck.quantities()
    known = deck.with_values({n: replace(q, spread=0.0) for n, q in numbers.items() if q.spread})
    with pytest.raises(MeasurementError, match=r"declares no spread.*spread = 0\.1"):
        refit(known, load_records(bench / "short", flatten(known)))


def test_a_glob_that_holds_nothing_out_is_named_and_nothing_is_written(
    run: Run, bench: Path, tmp_path: Path
) -> None:
    status, _, err = run(
        "fit", "--deck", str(bench / "deck.toml"), "--records", str(bench / "records"),
        "--hold-out", "multisin", "--out", "out",
    )  # fmt: skip
    assert status == 2
    assert "'multisin': no record has such a name; did you mean 'multisine'" in err
    assert not (tmp_path / "out").exists()


def test_a_drive_that_moves_freely_is_fitted_by_simulation_over_windows() -> None:
    """A slide simulated by SciPy; slow sampling blurs its balance of forces, not its simulation."""
    spread = {"body.mass": (1.7, 0.3), "spring.stiffness": (90.0, 0.3), "guide.damping": (2.4, 0.4)}
    slide = assembly(
        "slide",
        body=Mass(mass=1.0),
        spring=tie(Spring(stiffness=30.0), "body"),
        guide=tie(Dashpot(damping=1.0), "body"),
    )
    numbers = slide.quantities()
    wide = {n: replace(numbers[n].with_value(v, "assumed"), spread=s) for n, (v, s) in spread.items()}
    declared = slide.with_values(wide)
    columns = (Column("f_N", "body.force", "N"), Column("x_m", "body.position", "m"))
    runs = (replace(slide_record(1), name="a"), replace(slide_record(2), name="b", role="held_out"))
    found = refit(declared, RecordSet(runs, columns), window=2.0)
    for number in found.numbers:
        away = abs(number.fitted - TRUE[number.name])
        assert away < 3.0 * number.standard_error
        assert away < 0.25 * abs(number.declared - TRUE[number.name])
        assert number.declared == spread[number.name][0]
        assert abs(number.strain) <= 1.0
    (held,) = [e for e in found.errors() if e.block == "body.position over 2 s" and e.role == "held_out"]
    assert held.unit == "m"
    assert held.noise_floor == pytest.approx(NOISE, rel=0.15)
    assert held.fitted < 0.5 * held.declared
    assert found.actuator.quantities()["body.mass"].number == pytest.approx(2.0, rel=0.03)


@pytest.mark.slow
def test_the_fitted_machine_is_exported_and_belongs_to_its_deck(
    run: Run, bench: Path, tmp_path: Path
) -> None:
    called = ("fit", "--deck", str(bench / "deck.toml"), "--records", str(bench / "records"))
    status, out, _ = run(
        *called, "--out", str(tmp_path / "out"), "--export", "--sample-time", "2 ms", "--json"
    )
    assert status == 0
    content = json.loads(out[out.index("{") :])
    assert content["not_exported"] == []
    names = {str(Path(path).relative_to(tmp_path / "out")) for path in content["exported"]}
    code = {f"c/{part}{end}" for part in PARTS for end in (".c", ".h", "_selftest.c")}
    assert names == code | {"plant.fmu", *(f"{part}.fmu" for part in PARTS)}
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert all(f'href="{name}"' in page for name in names)
    declared, fitted = assembly_of(bench / "deck.toml"), assembly_of(tmp_path / "out" / "model.toml")
    assert fitted.name == f"{declared.name}_refitted_{deck_digest(fitted)[:8]}"
    for part in PARTS:
        header = (tmp_path / "out" / "c" / f"{part}.h").read_text("utf-8")
        assert f'_DECK_DIGEST "{deck_digest(fitted)}"' in header
        assert f'_PARENT_DIGEST "{deck_digest(declared)}"' in header
        assert "SAMPLE_TIME 0.002 " in header
    status, out, _ = run(
        "export", "check", str(tmp_path / "out"), "--deck", str(tmp_path / "out" / "model.toml")
    )
    assert status == 0, out
    assert "All 14 files belong" in out
    status, out, _ = run("export", "check", str(tmp_path / "out"), "--deck", str(bench / "deck.toml"))
    assert status == 1
