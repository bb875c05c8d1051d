"""Generated C says which deck it is from, with which numbers, when it was made, and whether it was edited."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from nlsdesign.components.assembly.deck_writer import deck_digest, declare
from nlsdesign.export import export_c
from nlsdesign.export.c.c_text import Real, stamp_of, stamped
from nlsdesign.export.c.controller_code import header_text
from nlsdesign.export.c.writer import CSource, CWriter
from nlsdesign.feedback.control import torque_controller
from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.foundation.deck import ParentDeck, load_deck
from nlsdesign.foundation.errors import ExportError
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.transform import with_outputs
from tests.hand_built import observer as hand_built_observer
from tests.renamed import SCHEMES, Scheme, renamed

DECKS = ("austin2015_as_printed", "test_rig", "austin2015_soft_spring")


@cache
def observer(name: str = DECKS[0]) -> FlatModel:
    """The kind that is designed most quickly."""
    plant = flatten(declare(load_deck(name)))
    return design_observer(plant, gain=CascadeGain(), grid=FixedGrid(-0.9, 0.9, 33))


def macro(text: str, name: str) -> str:
    (value,) = re.findall(rf"(?m)^#define \w+_{name} (\S+)", text)
    assert isinstance(value, str)
    return value.strip('"')


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("name", DECKS)
def test_header_and_source_name_the_deck_and_its_digest(name: str, tmp_path: Path) -> None:
    source = export_c(observer(name), tmp_path, name="eye")
    digest = deck_digest(declare(load_deck(name)))
    header, text = source.header.read_text("utf-8"), source.source.read_text("utf-8")
    assert macro(header, "DECK_DIGEST") == digest
    assert macro(header, "DECK") == load_deck(name).name
    assert macro(header, "PARENT_DIGEST") == ""
    for each in (header, text):
        assert f"Deck {load_deck(name).name}, {digest[:12]} " in each[:2000]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_machine_of_other_names_is_named_as_well(scheme: Scheme) -> None:
    made = renamed(declare(load_deck(DECKS[0])), scheme).assembly
    controller = torque_controller(flatten(made))
    header = header_text(CWriter(controller, "law", Real.FLOAT))
    assert macro(header, "DECK_DIGEST") == deck_digest(made) != deck_digest(declare(load_deck(DECKS[0])))


@pytest.mark.parametrize("name", DECKS)
def test_the_header_lists_every_number_of_the_deck_with_unit_and_source(name: str) -> None:
    made = declare(load_deck(name))
    text = " ".join(
        header_text(CWriter(observer(name), "eye", Real.DOUBLE)).partition("Numbers of the deck")[2].split()
    )
    for full, number in made.quantities().items():
        factor = parse_unit(number.unit).factor
        found = re.search(rf"(?<![\w.]){re.escape(full)} = (\[[^]]*\]|\S+) ", text)
        assert found, full
        shown = [float(v) for v in re.findall(r"-?\d[\d.e+-]*", found[1].partition(" (")[0])]
        if len(number.values) > 6:
            assert shown == pytest.approx([v / factor for v in (*number.values[:3], number.values[-1])])
            assert f"({len(number.values)} numbers)" in found[1]
        else:
            assert shown == pytest.approx([v / factor for v in number.values], rel=1e-11)
        after = text[found.end() :]
        unit = "" if number.unit == "1" else f"{number.unit} "
        spread = f"+- {100.0 * number.spread.share(1.0):g} % " if number.spread else ""
        assert after.startswith(f"{unit}{spread}({' '.join(number.source.split())})"), full


def test_numbers_that_were_changed_are_shown_as_they_are_and_said_to_be_changed() -> None:
    made = declare(load_deck(DECKS[0]))
    model = torque_controller(flatten(made).with_values({"motor.inertia": 7e-4}))
    header = header_text(CWriter(model, "law", Real.DOUBLE))
    assert "Not as in the deck that was read: motor.inertia." in header
    assert "   motor.inertia = 0.0007 kg*m^2" in header
    assert macro(header, "DECK_DIGEST") == deck_digest(made.with_values({"motor.inertia": 7e-4}))


def test_parents_are_named_the_latest_first() -> None:
    eldest = ParentDeck("paper", "a" * 64)
    made = replace(
        declare(load_deck(DECKS[0])), name="better", parent=ParentDeck("bench", "b" * 64, "diagnosed", eldest)
    )
    header = header_text(CWriter(torque_controller(flatten(made)), "law", Real.DOUBLE))
    assert macro(header, "PARENT_DIGEST") == "b" * 64
    first = header.index("Deck better, ")
    second = header.index(f"From bench, {'b' * 12} (diagnosed).")
    third = header.index(f"From paper, {'a' * 12}.")
    assert first < second < third


def test_a_model_without_a_deck_says_so() -> None:
    header = header_text(CWriter(hand_built_observer(), "eye", Real.DOUBLE))
    assert "Made without a deck." in header
    assert macro(header, "DECK_DIGEST") == ""
    assert "Numbers of the deck" not in header


def test_what_a_person_wrote_cannot_leave_the_comment_or_the_string() -> None:
    hostile = 'x" */ int main(void) { return 1; } /* \\'
    made = replace(declare(load_deck(DECKS[0])), name=hostile, parent=ParentDeck(hostile, "c" * 64, hostile))
    made = made.with_values({"motor.inertia": made.quantities()["motor.inertia"].with_value(1e-3, hostile)})
    header = header_text(CWriter(torque_controller(flatten(made)), "law", Real.DOUBLE))
    bare = re.sub(r'/\*.*?\*/|"(?:[^"\\]|\\.)*"', "", header, flags=re.DOTALL)
    assert "main" not in bare


# --- date and stamp -------------------------------------------------------------------------------


def test_every_file_ends_with_the_date_and_the_hash_of_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = torque_controller(flatten(declare(load_deck(DECKS[0]))))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86399")
    first = export_c(model, tmp_path / "a", name="law")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(86400 * 365 + 60))
    other = export_c(model, tmp_path / "b", name="law")
    for one, two in zip(paths(first), paths(other), strict=True):
        rest, _, last = one.read_text("utf-8").rpartition("/* ")
        assert "on 1970-01-01 23:59 UTC" in last
        assert last.split()[-2] == hashlib.sha256(rest.encode()).hexdigest()
        assert "on 1971-01-01 00:01 UTC" in two.read_text("utf-8")
        assert two.read_text("utf-8").rpartition("/* ")[0] == rest


EMPTY = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
"""SHA-256 of nothing, as in RFC 6234 and FIPS 180-4 test data."""


def paths(source: CSource) -> tuple[Path, ...]:
    return source.header, source.source, source.selftest


def test_an_edited_file_no_longer_has_its_hash() -> None:
    text = stamped("int x = 1;\n", hand_built_observer())
    digest = hashlib.sha256(b"int x = 1;\n").hexdigest()
    assert stamp_of(text) == ("", digest, digest)
    edited = stamp_of(text.replace("= 1", "= 2"))
    assert edited is not None
    assert edited.stated == digest != edited.actual
    assert stamp_of("int x = 1;\n") is None
    model = torque_controller(flatten(declare(load_deck(DECKS[0]))))
    assert stamp_of(stamped("", model)) == (deck_digest(declare(load_deck(DECKS[0])))[:12], *2 * [EMPTY])


@pytest.mark.parametrize("given", ["yesterday", "1e400", "99999999999999999999", "1.5"])
def test_a_date_that_is_none_is_refused(given: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", given)
    with pytest.raises(ExportError, match=re.escape(given)):
        export_c(hand_built_observer(), tmp_path)
    assert list(tmp_path.iterdir()) == []


# --- interface ------------------------------------------------------------------------------------


def interface(model: FlatModel, real: Real = Real.DOUBLE, name: str = "law") -> str:
    return macro(header_text(CWriter(model, name, real)), "INTERFACE_VERSION")


def test_the_interface_version_follows_the_structures_and_nothing_else() -> None:
    made = declare(load_deck(DECKS[0]))
    model = torque_controller(flatten(made))
    stays = {
        "another number": torque_controller(flatten(made.with_values({"motor.inertia": 1e-3}))),
        "another sample time": torque_controller(flatten(made), sample_time=2e-3),
        "another description": replace(model, description="something else"),
        "another deck": torque_controller(flatten(replace(made, name="other"))),
    }
    assert {why: interface(each) for why, each in stays.items()} == dict.fromkeys(stays, interface(model))
    first, *others = model.inputs
    more = {
        "another order": replace(model, inputs=(*others, first)),
        "another unit": replace(model, inputs=(replace(first, unit="mN*m"), *others)),
        "another name": replace(model, inputs=(replace(first, name="wish"), *others)),
        "another output": with_outputs(model, [model.outputs[0].name, model.signals[0].name]),
    }
    versions = [interface(model), interface(model, Real.FLOAT), *(interface(each) for each in more.values())]
    assert len(set(versions)) == len(versions)
