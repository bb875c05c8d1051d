"""``nlsdesign observer``: kinds, reason, errors over the spread, head of the C code."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.cli.observer import SEARCHES
from nlsdesign.cli.options import KINDS
from nlsdesign.cli.output import show_json
from nlsdesign.components import CurrentSensor, ForceSensor
from nlsdesign.components.assembly.deck_writer import declare, write_deck
from nlsdesign.feedback.observer import choose_observer, designed_observer
from nlsdesign.feedback.observer.spread import choice
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.regeneration import fitted_poles
from tests.command_line import Run, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
DECK = "austin2015_soft_spring"


def without_spread(path: Path) -> Path:
    """The deck with no spread at all: every machine is the one that is declared."""
    write_deck(declare(load_deck(DECK)), path)
    text = re.sub(r",?\s*spread = [0-9.e+-]+", "", path.read_text("utf-8"))
    path.write_text(text, "utf-8")
    assert not any(q.spread for q in declare(load_deck(path)).quantities().values())
    return path


@pytest.mark.slow
def test_all_commands_write_what_errs_least_over_the_spread(run: Run, tmp_path: Path) -> None:
    chosen = choose_observer(flatten(declare(load_deck(DECK))))
    status, out, err = run("observer", "--deck", DECK, "--out", "o", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert found["reason"] == chosen.reason
    assert found["expected_rms"] == pytest.approx(chosen.expected)
    assert (found["kind"] == "corrected") == (chosen.expected[1] < chosen.expected[0])
    assert not found["certified"]
    assert run("export", "c", "--deck", DECK, "--out", "c")[0] == 0
    codes = [(tmp_path / folder / "observer.c").read_text("utf-8") for folder in "oc"]
    assert codes[0] == codes[1]
    head = (tmp_path / "c" / "observer.h").read_text("utf-8").splitlines()[0]
    assert chosen.reason in head
    assert "not certified" in head


@pytest.mark.long_cases("certified", "published", "kalman")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("best", "corrected")])
def test_every_kind_is_written(run: Run, tmp_path: Path, kind: str) -> None:
    deck = "austin2015_figure_consistent" if kind == "published" else DECK  # its states need a cam
    status, out, err = run("observer", "--deck", deck, "--kind", kind, "--out", "o", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert (found["kind"], found["certified"]) == (kind, kind == "certified")
    head = (tmp_path / "o" / "observer.h").read_text("utf-8").splitlines()[0]
    assert ("not certified" in head) == (kind != "certified")
    if kind == "certified":
        assert found["statement"][0] in head
        folder = str(tmp_path / "o")
        assert run("observer", "verify", f"{folder}/certificate.json", "--c", folder)[0] == 0


# The poles are those of test_fitted_poles.py.
@pytest.mark.slow
def test_poles_are_fitted_to_records(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On two records of the study, one of them held out; few steps, for what is printed is looked at."""
    monkeypatch.setattr(fitted_poles, "GRID_POINTS", 41)
    monkeypatch.setattr(fitted_poles, "_STEPS", 3)
    bench = Path(__file__).parents[3] / "studies" / "austin2015_bench"
    (tmp_path / "bench").mkdir()
    mapping = (bench / "records.toml").read_text("utf-8").replace('held_out = ["hold", "sine_2.0Hz"]', "")
    (tmp_path / "bench" / "records.toml").write_text(mapping, "utf-8")
    for name in ("sine_2.0Hz.csv", "sine_5.0Hz.csv"):
        (tmp_path / "bench" / name).write_text((bench / name).read_text("utf-8"), "utf-8")
    noise = [Quantity(value, unit, "rig") for value, unit in ((0.04, "A"), (0.3, "N"))]
    actuator = declare(load_deck("austin2015_figure_consistent"))
    sensed = actuator.with_part("ammeter", CurrentSensor(of="motor.current", noise=noise[0])).with_part(
        "load_cell", ForceSensor(of="spring.rubber.force", noise=noise[1])
    )
    write_deck(sensed, tmp_path / "d.toml")
    asked = ("observer", "--deck", "d.toml", "--kind", "published", "--fit-poles", "bench", "--out", "o")
    status, out, err = run(*asked)
    assert status == 0, err
    decay = "not fitted for spring.rubber.extension; at a standing angle the error decays with at least"
    assert f"fitted by gradient, {decay}" in out
    assert "average relative error, %" in out
    assert "ms on, after the observers have settled (a quarter of a record at most)" in " ".join(out.split())
    assert "warning: records: held out by default: " in err
    assert "held out" in out
    head = (tmp_path / "o" / "observer.h").read_text("utf-8").splitlines()[0]
    assert "poles at" in head
    assert "not certified" in head
    for wrong in (
        asked[:3] + asked[5:],
        (*asked[:5], "--fit-poles-by", "cma"),
        (*asked[:5], "--mapping", "d.toml"),
    ):
        status, _, err = run(*wrong)
        assert status == 2
        assert "--fit-poles" in err
    status, _, err = run(*asked, "--hold-out", "*")
    assert status == 2
    assert "none is left for fitting -> hold out fewer records (--hold-out, " in err
    status, _, err = run(*asked[:6], "bench/sine_2.0Hz.csv")
    assert status == 2
    assert "is a file, no folder -> name the folder of the records: bench" in err


def test_json_has_no_number_that_is_not_finite(capsys: pytest.CaptureFixture[str]) -> None:
    show_json({"errors": [{"percent": math.nan}, math.inf, -math.inf, np.array([1.5, np.nan])], 3: "NaN"})

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    content = json.loads(capsys.readouterr().out, parse_constant=refuse)
    assert content == {"errors": [{"percent": None}, None, None, [1.5, None]], "3": "NaN"}


def test_the_searches_of_the_option_are_those_of_the_fit() -> None:
    assert SEARCHES == fitted_poles.SEARCHES


def test_the_option_offers_the_kinds_that_can_be_designed() -> None:
    assert KINDS == choice.KINDS


@pytest.mark.slow
def test_kinds_differ_in_their_gains() -> None:
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    words = {kind: str(designed_observer(model, kind=kind).design.step.gain)
             for kind in ("cascade", "certified", "kalman")}  # fmt: skip
    assert len(set(words.values())) == 3
    published = designed_observer(model, kind="published").design
    assert len(published.step.plant.states) == 4  # Austin et al. 2015: angle, speed, extension, force


def test_a_deck_without_spread_gets_the_cascade_and_the_reason(run: Run, tmp_path: Path) -> None:
    deck = str(without_spread(tmp_path / "exact.toml"))
    status, out, err = run("observer", "--deck", deck, "--out", "o")
    assert status == 0, err
    assert "cascade, for it cannot be corrected: " in out
    status, out, err = run("observer", "--deck", deck, "--errors", "--out", "e")
    assert status == 2
    assert "declares no spread" in err
    assert not (tmp_path / "e").exists(), "nothing half-written"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--kind", "corrected", "--certificate"), "an observer of kind 'corrected' cannot be certified"),
        (("--kind", "cascade", "--certificate", "--decay", "5"), "--decay belongs to --kind certified"),
        (("--decay", "5"), "belong to --certificate"),
        (("--kind", "cascades"), "'cascades' is not one of"),
        (("--kind", "adaptive"), "Did you mean 'corrected'?"),
        (("--kind", "zzzzzz"), "observer --help' explains each."),
    ],
)
def test_what_does_not_fit_is_refused(run: Run, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    status, _, err = run("observer", "--deck", DECK, *words, "--out", "o")
    assert status == 2
    assert said in err
    assert not (tmp_path / "o").exists()


@pytest.mark.slow
def test_errors_are_printed_and_written(run: Run, tmp_path: Path) -> None:
    words = ("--deck", "austin2015_figure_consistent", "--kind", "cascade", "--errors", "--draws", "6")
    status, out, err = run("observer", *words, "--out", "o", "--json")
    assert status == 0, err
    errors = json.loads(out)["errors"]
    assert errors == json.loads((tmp_path / "o" / "errors.json").read_text("utf-8"))
    rows = {(row["observer"], row["frequency_Hz"]): row for row in errors["errors"]}
    assert set(rows) == {(name, f) for name in ("cascade", "published") for f in (2.0, 5.0)}
    assert errors["draws"] == 6
    assert all(row["exact"] < row["median"] < row["quantile_90"] for row in rows.values())
    # The cascade takes rubber and cam for granted and never hears the current.
    causes = errors["causes"]["cascade"]
    assert max(causes, key=causes.__getitem__).startswith("spring.")
    assert causes["motor.torque_constant"] < 0.01 * max(causes.values())
    table = list(csv.reader((tmp_path / "o" / "errors.csv").read_text("utf-8").splitlines()))
    assert len(table) == 1 + len(rows)
    assert float(table[1][3]) == pytest.approx(rows["cascade", 2.0]["median"], rel=1e-6)
    assert "<svg" in (tmp_path / "o" / "errors.svg").read_text("utf-8")
    assert "Causes, cascade" in (tmp_path / "o" / "report.html").read_text("utf-8")
