"""``nlsdesign compare``: results side by side, and what commands write as pages."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.foundation.locations import folder
from nlsdesign.model import flatten
from nlsdesign.presentation import report
from nlsdesign.presentation.report.side_by_side import torque_at_rest
from tests.command_line import Run, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
SOFT, STIFF = "austin2015_soft_spring", "austin2015_stiff_spring"
DESIGN = {
    "met": True, "torque_error_rms": 0.0123, "miss": None,
    "limits_reached": ["cam radius (MaximumCamRadius)"],
    "largest_cable_force": 215.0, "energy": 1.5, "rms_error_over_spreads": {"95 %": 0.5},
}  # fmt: skip
VERDICT = {
    "verdict": "named", "headline": "Second relaxation in the rubber",
    "effects": [
        {"name": "second_relaxation", "title": "second relaxation in the rubber", "location": "spring.rubber",
         "probability": 0.98,
         "parameters": [{"name": "a.modulus", "value": 2.0, "unit": "Pa", "standard_error": 0.1}]}
    ],
    "error": {"unit": "N", "noise_floor": 0.2, "held_out": {"before": 4.0, "after": 0.3}},
}  # fmt: skip


def result(place: Path, deck: str, **contents: object) -> Path:
    """A folder as ``design`` or ``diagnose`` leaves it."""
    place.mkdir(parents=True)
    shutil.copy(folder("models") / "decks" / f"{deck}.toml", place / "model.toml")
    for name, content in contents.items():
        (place / f"{name}.json").write_text(json.dumps(content), encoding="utf8")
    return place


def test_designs_and_verdicts_stand_side_by_side(run: Run, tmp_path: Path) -> None:
    result(tmp_path / "one", SOFT, design=DESIGN)
    result(tmp_path / "two", STIFF, verdict=VERDICT)
    status, out, err = run("compare", "one", "two", "--out", "o", "--json")
    assert status == 0, err
    content = json.loads(out)
    figures = content["key_figures"]
    assert figures["torque error, exact numbers"] == {"one": "12.3 mN·m", "two": "–"}
    assert figures["error after"] == {"one": "–", "two": "0.300 N (1.50 × noise)"}
    stiffness = next(row for name, row in content["numbers_that_differ"].items() if "stiffness" in name)
    assert stiffness["one"] != stiffness["two"]
    assert json.loads((tmp_path / "o" / "comparison.json").read_text(encoding="utf8")) == {
        name: value for name, value in content.items() if name != "files"
    }
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf8")
    assert "Second relaxation in the rubber" in page
    assert "modulus = 2.00 ± 0.10 Pa" in page
    for heading in (
        "Key figures",
        "Torque",
        "Errors before and after",
        "Effects named",
        "Numbers that differ",
    ):
        assert f">{heading}</h2>" in page


def test_the_curves_are_those_of_the_springs_at_rest() -> None:
    model = flatten(declare(load_deck(SOFT)))
    angles, torques = torque_at_rest(model)
    stiffness = next(value for name, value in model.values.items() if name.endswith("stiffness"))
    assert angles[-1] == pytest.approx(np.pi / 2)
    assert torques == pytest.approx(stiffness * angles, rel=1e-9)


def test_equal_decks_have_no_number_that_differs(run: Run, tmp_path: Path) -> None:
    for name in ("a", "b"):
        result(tmp_path / name / "design", SOFT, design=DESIGN)
    status, out, _ = run("compare", "a/design", "b/design", "--out", "o", "--json")
    assert status == 0
    content = json.loads(out)
    assert content["numbers_that_differ"] == {}
    assert list(content["results"]) == ["a/design", "b/design"]


def test_a_deck_alone_is_compared_too(run: Run, tmp_path: Path) -> None:
    decks = [result(tmp_path / name, deck) / "model.toml" for name, deck in (("a", SOFT), ("b", STIFF))]
    status, out, _ = run("compare", *map(str, decks), "--out", "o")
    assert status == 0
    assert "report: o/report.html" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("one",), "name two folders or more"),
        (("one", "nowhere"), "is no folder"),
        (("one", "empty"), "holds no model.toml"),
        (("one", "one"), "is named twice"),
        (("one", "broken"), "cannot be read as JSON"),
        (("one", "list"), "holds no names with values"),
    ],
)
def test_what_cannot_be_compared_is_named(
    run: Run, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    result(tmp_path / "one", SOFT)
    (tmp_path / "empty").mkdir()
    (result(tmp_path / "broken", SOFT) / "design.json").write_text("{")
    (result(tmp_path / "list", SOFT) / "verdict.json").write_text("[]")
    status, _, err = run("compare", *words, "--out", "o")
    assert status == 2
    assert message in err
    assert not (tmp_path / "o").exists()


def test_one_result_is_no_comparison(tmp_path: Path) -> None:
    model = flatten(declare(load_deck(SOFT)))
    one = report.ComparedResult("a", model, numbers={})
    with pytest.raises(ValueRangeError, match="at least two"):
        report.write_comparison(tmp_path / "r.html", [one])
    with pytest.raises(ValueRangeError, match="different labels"):
        report.write_comparison(tmp_path / "r.html", [one, one])
