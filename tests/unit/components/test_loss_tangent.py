"""Relaxation from a loss tangent, and rubber of the library that relaxes with what is known of its loss.

Independent road: complex moduli of Maxwell branches written out here, ranges typed from the library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import (
    Assembly,
    HeatBalance,
    NeoHooke,
    QuasilinearRelaxation,
    Relaxation,
    SelfHeating,
    WorkHeat,
    flat_relaxation,
    loss_of,
    material,
    materials,
    measured_relaxation,
    peaked_relaxation,
    relaxing_law_of,
    relaxing_rubber_of,
    with_rubber,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.materials.loss_tangent import relaxation_of
from nlsdesign.components.materials.material_law import law_of
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.foundation.errors import ArrangementError, UnknownNameError, ValueRangeError
from nlsdesign.model import flatten
from tests.renamed import SCHEMES, renamed
from tests.stretched import pulled, stress_at


def tangent(made: Relaxation, frequency: np.ndarray) -> np.ndarray:
    """Loss tangent of E∞ = 1 beside branches, written out."""
    turn = 2.0 * np.pi * np.asarray(frequency)
    stored, lost = np.ones_like(turn), np.zeros_like(turn)
    for share, time in zip(made.shares, made.times, strict=True):
        x = turn * time
        stored, lost = stored + share * x**2 / (1.0 + x**2), lost + share * x / (1.0 + x**2)
    return lost / stored


@pytest.mark.parametrize("wanted", [0.02, 0.1, 0.3, 0.5])
def test_the_loss_tangent_is_flat_as_far_as_it_says(wanted: float) -> None:
    made = flat_relaxation(wanted)
    off = np.abs(tangent(made, np.geomspace(0.1, 10.0, 1001)) / wanted - 1.0)
    assert np.max(off) <= 0.0501
    assert made.largest_error == pytest.approx(np.max(off), rel=0.02)
    assert min(made.shares) >= 0.0
    # Fewer branches would not have done.
    with pytest.raises(ValueRangeError, match="is met within"):
        flat_relaxation(wanted, branches=len(made.shares) - 1)


def test_a_flat_loss_is_a_rising_modulus() -> None:
    """Far inside the band d ln E′/d ln ω = (2/π)·δ, the local form of Kramers and Kronig's relations."""
    made = flat_relaxation(0.1, band=(1e-3, 1e3), tolerance=0.02)
    low, high = np.abs(made.factor(np.array([0.5, 2.0])))
    assert np.log(high / low) / np.log(4.0) == pytest.approx(2.0 / np.pi * np.arctan(0.1), rel=0.02)


def test_one_number_gives_the_standard_linear_solid_with_its_peak_there() -> None:
    made = peaked_relaxation(0.3, 2.0)
    at = np.geomspace(0.2, 20.0, 2001)
    found = tangent(made, at)
    assert len(made.shares) == 1
    assert np.max(found) == pytest.approx(0.3, rel=1e-6)
    assert at[np.argmax(found)] == pytest.approx(2.0, rel=2e-3)


def test_a_measured_curve_is_followed() -> None:
    at, wanted = np.geomspace(0.1, 100.0, 7), np.linspace(0.05, 0.2, 7)
    made = measured_relaxation(at, wanted)
    assert np.max(np.abs(tangent(made, at) / wanted - 1.0)) < 0.05
    assert made.largest_error == pytest.approx(np.max(np.abs(tangent(made, at) / wanted - 1.0)), rel=1e-9)


def test_what_the_library_knows_of_a_loss_its_own_or_its_familys() -> None:
    assert (loss_of(material("PMC-770")).of, loss_of(material("PMC-770")).upper) == ("polyurethane", 0.2)
    assert (loss_of(material("butyl_rubber")).lower, loss_of(material("butyl_rubber")).upper) == (0.2, 0.5)
    # The one with a frequency in the band comes before the first.
    natural = loss_of(material("natural_rubber_treloar"))
    assert (natural.known.name, natural.lower, natural.upper) == ("loss_tangent_slow", 0.02, 0.1)
    assert loss_of(material("natural_rubber"), using="loss_tangent").upper == 0.15
    with pytest.raises(UnknownNameError, match="did you mean 'loss_tangent'"):
        loss_of(material("natural_rubber"), using="loss_tangnt")
    draws = natural.drawn(4000, seed=3)
    assert (draws.min() >= 0.02, draws.max() <= 0.1) == (True, True)
    assert np.mean(draws) == pytest.approx(0.06, abs=1e-3)
    assert np.std(draws) == pytest.approx(0.08 / np.sqrt(12.0), rel=0.03)


LIBRARY = """
[one]
family = "one"
grade = "made for this test"
remark = ""
[one.loss_tangent]
measures = "loss tangent"
value = 0.12
unit = "1"
frequency = {value = 5, unit = "Hz"}
source = "made for this test"
evidence = "data sheet"

[curve]
family = "curve"
grade = "made for this test"
remark = ""
[curve.loss_tangent]
measures = "loss tangent"
value = [0.1, 0.12, 0.15]
unit = "1"
frequency = {value = [1, 5, 20], unit = "Hz"}
source = "made for this test"
evidence = "measured curve"

[none]
family = "none"
grade = "made for this test"
remark = ""
[none.glass_transition]
measures = "glass transition temperature"
value = 200
unit = "K"
source = "made for this test"
evidence = "data sheet"
"""


def test_how_much_is_known_decides_how_it_relaxes(tmp_path: Path) -> None:
    path = tmp_path / "library.toml"
    path.write_text(LIBRARY, encoding="utf8")
    known = materials(path)
    one = relaxation_of(loss_of(known["one"], library=known))
    assert len(one.shares) == 1
    assert tangent(one, np.array([5.0]))[0] == pytest.approx(0.12, rel=1e-9)
    curve = relaxation_of(loss_of(known["curve"], library=known))
    assert np.max(np.abs(tangent(curve, np.array([1.0, 5.0, 20.0])) / [0.1, 0.12, 0.15] - 1.0)) < 0.05
    with pytest.raises(
        ArrangementError, match=r"has no loss tangent, nor has another none.*take one of: one"
    ):
        loss_of(known["none"], library=known)


def test_at_rest_a_relaxing_rubber_is_the_rubber_of_the_library() -> None:
    for name in ("PMC-770", "natural_rubber_treloar", "Dragon_Skin_30"):
        still, made = law_of(material(name)), relaxing_law_of(material(name))
        strains = np.linspace(0.05, 1.0, 7)
        slow = pulled(**dict(made.members))
        at_rest = []
        for strain in strains:
            elastic = stress_at(pulled(**dict(still.members)), [strain])[0]
            relaxed = [elastic] * len(slow.states)
            at_rest.append(slow.evaluate(relaxed, [strain * 0.0125, 0.0])["rubber.force"] / 1e-4 / elastic)
        assert at_rest == pytest.approx(np.ones(7), rel=1e-9)
        assert made.strains == still.strains
        assert "relaxing" in str(made)
        known = loss_of(material(name))
        law = made.members[0][1]
        assert isinstance(law, QuasilinearRelaxation)
        assert law.loss_tangent(1.0) == pytest.approx(known.middle, rel=0.05)
        assert known.known.quantity.source in law.shares.source


def test_it_is_written_into_a_deck_and_read_back(tmp_path: Path) -> None:
    deck = load_deck("austin2015_as_printed")
    changed = with_rubber(declare(deck), material("Dragon_Skin_30"), loss_tangent=0.2)
    again = declare(read_deck(deck_text(changed), tmp_path / "deck.toml"))
    one, two = (flatten(each, outputs=["spring.torque"]) for each in (changed, again))
    assert [v.name for v in one.states] == [v.name for v in two.states]
    assert one.values == two.values


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_machine_with_other_names_gets_the_same_rubber(scheme: object) -> None:
    actuator: Assembly = declare(load_deck("austin2015_as_printed"))
    machine = renamed(actuator, scheme)  # type: ignore[arg-type]
    plain = with_rubber(actuator, material("PMC-770"), loss_tangent=0.1)
    other = with_rubber(machine.assembly, material("PMC-770"), loss_tangent=0.1)
    values = [sorted(q.number for q in made.quantities().values() if isinstance(q.value, float))
              for made in (plain, other)]  # fmt: skip
    assert values[0] == values[1]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: flat_relaxation(0.0), "leave the relaxation out"),
        (lambda: flat_relaxation(3.0), "at most at 2"),
        (lambda: flat_relaxation(float("nan")), "loss tangent nan"),
        (lambda: flat_relaxation(0.1, band=(10.0, 0.1)), "must rise"),
        (lambda: flat_relaxation(0.1, tolerance=1e-9), "take a narrower band"),
        (lambda: peaked_relaxation(0.1, 0.0), "must be above zero"),
        (lambda: measured_relaxation([1.0], [0.1]), "two points"),
        (lambda: measured_relaxation([2.0, 1.0], [0.1, 0.1]), "ascend"),
        (lambda: relaxing_law_of(material("PMC-770"), loss_tangent=-0.1), "-0.1"),
        (lambda: flat_relaxation(1.9), "is met within"),
        (
            lambda: QuasilinearRelaxation(
                members=(("g", NeoHooke(shear_modulus=1e6)),), shares=(0.1,), times=(0.1, 1.0)
            ),
            "one relaxation time per share",
        ),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_with_the_next_step(call: object, words: str) -> None:
    with pytest.raises(ValueRangeError, match=words):
        call()  # type: ignore[operator]


def test_a_rubber_without_an_elastic_law_is_refused_by_name() -> None:
    with pytest.raises(ArrangementError, match="'butyl_rubber': has no elastic law"):
        relaxing_law_of(material("butyl_rubber"))


def test_heat_of_losses_that_are_not_noted_is_refused() -> None:
    law = QuasilinearRelaxation(members=(("g", NeoHooke(shear_modulus=1e6)),), shares=(0.1,), times=(0.1,))
    heat = HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3)
    with pytest.raises(ArrangementError, match="relaxes without saying what it loses"):
        SelfHeating(members=(("law", law),), heat=heat)
    piece = relaxing_rubber_of(material("PMC-770"), area=1e-4, rest_length=0.0125, loss_tangent=0.1)
    assert SelfHeating(members=(("piece", piece),), heat=WorkHeat(halving_work=40.0, cooling_time=8.0))
