"""Reading decks: every kind of bad input gets one message with place, rule, nearest name and next step.

Independent road: the line and column that a message must name are counted in the text here, by the marker
that each case puts into the deck.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nlsdesign.components.assembly.deck_writer import deck_problems, declare
from nlsdesign.foundation.deck import Deck, deck_names, load_deck, read_deck
from nlsdesign.foundation.errors import DeckError, NlsError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.spread import RelativeSpread

SOUND = """\
[deck]
name = "bench"
description = "a mass-less bench"

[motor]
component = "GearedMotor"
inertia = {value = 5.97, unit = "kg*cm^2", source = "sheet", spread = 0.1}
gear_ratio = {value = 4, unit = "1", source = "sheet"}
torque_constant = {value = 55.0, unit = "mN*m/A", source = "sheet"}

[load]
component = "Fixed"

[spring]
component = "Through"
between = ["motor", "load"]

[spring.cam]
component = "Pulley"
radius = {value = 10.0, unit = "mm", source = "drawing"}

[spring.rubber]
component = "Specimen"
area = {value = 1.0, unit = "cm^2", source = "drawing"}
rest_length = {value = 12.5, unit = "mm", source = "drawing"}

[spring.rubber.stiff]
component = "StrainStiffening"
modulus = {value = [0.92, 0.58], unit = "MPa", source = "tensile test"}
knots = {value = [0.0, 1.6], unit = "%", source = "tensile test"}

[spring.rubber.relaxing]
component = "Series"

[spring.rubber.relaxing.spring]
component = "LinearElastic"
modulus = {value = 0.58, unit = "MPa", source = "tensile test"}

[spring.rubber.relaxing.dashpot]
component = "ViscousMaterial"
viscosity = {value = 411.0, unit = "Pa*s", source = "assumed: for the test"}

[encoder]
component = "Encoder"
of = "motor.angle"
quantum = {value = 0.767, unit = "mrad", source = "sheet"}
"""


def read(text: str) -> Deck:
    return read_deck(text, Path("bench.toml"))


def changed(old: str, new: str) -> str:
    assert SOUND.count(old) == 1, f"{SOUND.count(old)} times {old!r}"
    return SOUND.replace(old, new)


def test_the_sound_deck_is_sound() -> None:
    found = declare(read(SOUND))
    assert deck_problems(read(SOUND)) == []
    numbers = found.quantities()
    assert numbers["motor.inertia"].number == pytest.approx(5.97e-4, rel=1e-15)
    assert numbers["spring.rubber.stiff.knots"].values == pytest.approx((0.0, 0.016), rel=1e-15)
    assert numbers["spring.rubber.area"].source == "drawing"
    assert numbers["motor.inertia"].spread == RelativeSpread(0.1)


# what is replaced, by what (§ marks the place that the message must name), error, said, nearest, next step
MISSPELT = [
    ("viscosity = {", "§viscositi = {", DeckError, "no field 'viscositi'", "viscosity", "fields are"),
    ("quantum = {", "§quantumm = {", DeckError, "no field 'quantumm'", "quantum", "fields are"),
    ("area = {value", "§area = {vallue", DeckError, "unknown field 'vallue'", "value", None),
    ('between = ["motor"', '§betwen = ["motor"', DeckError, "no field 'betwen'", "between", "fields are"),
    ('of = "motor.angle"', '§off = "motor.angle"', DeckError, "no field 'off'", "of", "fields are"),
    ('name = "bench"', '§nmae = "bench"', DeckError, "not a field of [deck]", "name", None),
    (
        'component = "Series"',
        '§compnent = "Series"',
        DeckError,
        "has no component",
        "component",
        "component =",
    ),
]
UNITS = [
    ('area = {value = 1.0, unit = "cm^2"', "§area = {value = 1.0", UnitError, "has no unit", None, "unit ="),
    ('"Pa*s"', '"Pass"', UnitError, "not a known unit", "Pa", "SI units"),
    ('"Pa*s"', '"Pas"', UnitError, "stands for a product", None, "write 'Pa*s'"),
    (
        'rest_length = {value = 12.5, unit = "mm"',
        '§rest_length = {value = 12.5, unit = "m"',
        ValueRangeError,
        "must lie in",
        None,
        "was 'mm' meant?",
    ),
    (
        'area = {value = 1.0, unit = "cm^2"',
        '§area = {value = 50.0, unit = "m^2"',
        ValueRangeError,
        "must lie in",
        None,
        "was 'mm^2' meant?",
    ),
    (
        'knots = {value = [0.0, 1.6], unit = "%"',
        '§knots = {value = [0.0, 30.0], unit = "1"',
        ValueRangeError,
        "must lie in",
        None,
        "was '%' meant?",
    ),
    (
        'area = {value = 1.0, unit = "cm^2"',
        '§area = {value = 1.0, unit = "cm"',
        UnitError,
        "does not measure",
        None,
        "m^2",
    ),
    (
        'gear_ratio = {value = 4, unit = "1"',
        "§gear_ratio = {value = 4, unit = 1",
        DeckError,
        "is not a text",
        None,
        'unit = "..."',
    ),
]
NUMBERS = [
    (
        'area = {value = 1.0, unit = "cm^2", source = "drawing"}',
        "§area = 1.0",
        DeckError,
        "bare value",
        None,
        "unit",
    ),
    ("viscosity = {value = 411.0", '§viscosity = {value = "411"', DeckError, "not a number", None, None),
    ("viscosity = {value = 411.0", "§viscosity = {value = nan", ValueRangeError, "finite", None, None),
    ("viscosity = {value = 411.0", "§viscosity = {value = true", DeckError, "not a number", None, None),
    (
        "viscosity = {value = 411.0",
        "§viscosity = {value = [1.0, 2.0]",
        ValueRangeError,
        "one number",
        None,
        "brackets",
    ),
    (
        "modulus = {value = [0.92, 0.58]",
        "§modulus = {value = []",
        ValueRangeError,
        "at least one",
        None,
        None,
    ),
    (
        "viscosity = {value = 411.0",
        "§viscosity = {value = -411.0",
        ValueRangeError,
        "must lie in",
        None,
        None,
    ),
    ("spread = 0.1", "spread = -0.1", ValueRangeError, "spread", None, None),
    (', source = "assumed: for the test"', "", DeckError, "has no source", None, "add source"),
    ('"assumed: for the test"', '""', DeckError, "is not a text", None, 'source = "..."'),
    ("viscosity = {value = 411.0, ", "§viscosity = {", DeckError, "has no value", None, "add value"),
]
ARRANGEMENTS = [
    ('component = "Pulley"', '§component = "Puley"', DeckError, "not a component", "Pulley", "use one of"),
    ('component = "Series"', "§component = 7", DeckError, "not a component", None, "use one of"),
    ('["motor", "load"]', '["motr", "load"]', UnknownNameError, "no such name", "motor", "load, motor"),
    (
        'between = ["motor", "load"]',
        '§between = "motor"',
        DeckError,
        "not a list of names",
        None,
        "between =",
    ),
    ('between = ["motor", "load"]', '§between = ["load"]', NlsError, "can never move", None, "moves"),
    (
        'between = ["motor", "load"]',
        '§between = ["motor", "motor"]',
        NlsError,
        "can never move",
        None,
        "moves",
    ),
    ('between = ["motor", "load"]', "§between = []", NlsError, "has 0 ends", None, "one or two"),
    ('of = "motor.angle"\n', "", DeckError, "needs 'of'", None, "of ="),
    (
        "[spring.rubber.relaxing.spring]",
        "[spring.rubber.relaxing.dash-pot]",
        NlsError,
        "not a plain word",
        None,
        "letters",
    ),
]


@pytest.mark.parametrize("case", MISSPELT + UNITS + NUMBERS + ARRANGEMENTS, ids=lambda case: case[1][:40])
def test_one_mistake_gives_one_clear_message(
    case: tuple[str, str, type[NlsError], str, str | None, str | None],
) -> None:
    old, new, kind, said, near, step = case
    text = changed(old, new)
    marked = re.search("§", text)
    text = text.replace("§", "")
    problems = deck_problems(read(text))
    about = [p for p in problems if said in str(p)]
    assert len(about) == 1, [str(p) for p in problems]
    problem = about[0]
    assert isinstance(problem, kind)
    place = re.match(r"bench\.toml:(\d+):(\d+): ", problem.thing)
    assert place, problem.thing
    if marked:
        before = text[: marked.start()]
        assert int(place[1]) == before.count("\n") + 1
        assert int(place[2]) == len(before) - before.rfind("\n")
    assert problem.did_you_mean == near
    assert step is None or step in (problem.next_step or ""), problem.next_step
    with pytest.raises(NlsError):
        declare(read(text))


def test_a_missing_number_is_named_with_its_unit() -> None:
    (problem,) = deck_problems(
        read(changed('torque_constant = {value = 55.0, unit = "mN*m/A", source = "sheet"}\n', ""))
    )
    assert str(problem).startswith("bench.toml:5:1: motor: GearedMotor needs 'torque_constant'")
    assert 'unit = "N*m/A"' in str(problem.next_step)


IMPOSSIBLE = {
    "crossing knots": (changed("[0.0, 1.6]", "[1.6, 0.0]"), "knots cross", "spring.rubber.stiff"),
    "one modulus too many": (changed("[0.0, 1.6]", "[0.0]"), "one knot per modulus", "spring.rubber.stiff"),
    "a spring of N/m in a specimen": (
        changed(
            'component = "LinearElastic"\nmodulus = {value = 0.58, unit = "MPa"',
            'component = "Spring"\nstiffness = {value = 0.58, unit = "N/m"',
        ),
        "relates",
        "spring.rubber.relaxing",
    ),
    "a torsion spring behind a cam": (
        SOUND[: SOUND.index("[spring.rubber]")]
        + """[spring.coil]
component = "Spring"
stiffness = {value = 1, unit = "N*m/rad", source = "sheet"}
""",
        "a cam needs a force",
        "spring",
    ),
    "a linear spring on a shaft": (
        SOUND
        + """[other]
component = "Spring"
between = ["motor"]
stiffness = {value = 1, unit = "N/m", source = "sheet"}
""",
        "but 'motor' has a angle",
        "other.between",
    ),
    "a cam that is tied to nothing": (
        SOUND
        + """[other]
component = "Pulley"
radius = {value = 1, unit = "cm", source = "sheet"}
""",
        "is a Pulley",
        "other",
    ),
    "a body behind a cam": (
        SOUND[: SOUND.index("[spring.rubber]")]
        + """[spring.weight]
component = "Mass"
mass = {value = 1, unit = "kg", source = "sheet"}
""",
        "not an element",
        "spring",
    ),
    "no element behind a cam": (
        SOUND[: SOUND.index("[spring.rubber]")],
        "one table for the element",
        "spring",
    ),
    "an empty series": (
        SOUND[: SOUND.index("[spring.rubber.relaxing.spring]")],
        "at least one element",
        "spring.rubber.relaxing",
    ),
    "a spring inside a motor": (
        SOUND
        + """[motor.coil]
component = "Spring"
stiffness = {value = 1, unit = "N/m", source = "sheet"}
""",
        "does not lie between a command and its effort",
        "motor",
    ),
    "no body": ("""[deck]\nname = "none"\n""", "has no body", "deck"),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_impossible_arrangement_is_named_at_its_place(name: str) -> None:
    text, said, where = IMPOSSIBLE[name]
    problems = deck_problems(read(text))
    assert len(problems) == 1, [str(p) for p in problems]
    assert said in str(problems[0])
    assert re.match(rf"bench\.toml:\d+:\d+: {re.escape(where)}(: |$)", problems[0].thing), problems[0].thing


def test_all_problems_of_a_deck_are_named() -> None:
    """Seven mistakes in different parts, on different levels: seven messages, in one go."""
    text = SOUND
    for old, new in (
        ('name = "bench"', 'nmae = "bench"'),
        ("torque_constant = {", "torque_constnat = {"),
        ('between = ["motor", "load"]', 'between = ["motor", "laod"]'),
        (
            'unit = "mm", source = "drawing"}\n\n[spring.rubber]',
            'unit = "kg", source = "drawing"}\n\n[spring.rubber]',
        ),
        ("[0.0, 1.6]", "[1.6, 0.0]"),
        ("viscosity = {value = 411.0", "viscosity = {value = -1"),
        ('of = "motor.angle"\n', ""),
    ):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    found = [str(p) for p in deck_problems(read(text))]
    for said in (
        "deck.nmae",
        "torque_constnat",
        "body 'laod'",
        "spring.cam.radius",
        "knots cross",
        "viscosity = -1",
        "needs 'of'",
    ):
        assert sum(said in message for message in found) == 1, (said, found)
    assert len(found) == 7, found


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [('[deck]\nname = "a"\nvalue 3\n', 3, 7), ("[a]\n[a]\n", 2, 3), ('[a]\nb = "open', 2, 10)],
)
def test_text_that_is_no_toml_is_placed(text: str, line: int, column: int) -> None:
    with pytest.raises(DeckError, match=rf"^bench\.toml:{line}:{column}: is not valid TOML") as caught:
        read(text)
    assert caught.value.next_step


def test_places_know_dotted_and_quoted_names() -> None:
    deck = read('[ spring . cam ]\n  elements.x = 1\n"a b" = 2\n[[row]]\nkey=3\n')
    assert deck.place("spring.cam.elements.x") == "bench.toml:2:3: spring.cam.elements.x"
    assert deck.place("row.key") == "bench.toml:5:1: row.key"
    assert deck.place("spring.cam.nothing.at.all").startswith("bench.toml:1:1: ")


def test_number_of_a_deck_by_name() -> None:
    deck = read(SOUND)
    assert deck.quantity("spring.cam.radius").number == 0.01
    with pytest.raises(UnknownNameError) as caught:
        deck.quantity("spring.cam.raduis")
    assert caught.value.did_you_mean == "spring.cam.radius"
    assert "motor.inertia" in deck.numbers()


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    for name in ("folder.toml", "binary.toml"):
        with pytest.raises(DeckError, match=r"cannot be read|is no file"):
            load_deck(tmp_path / name)
    with pytest.raises(DeckError, match="no such file"):
        load_deck(tmp_path / "absent.toml")
    with pytest.raises(UnknownNameError) as caught:
        load_deck("austin2015_as_prined")
    assert caught.value.did_you_mean == "austin2015_as_printed"


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    (tmp_path / "bom.toml").write_text(SOUND, encoding="utf-8-sig")
    assert declare(load_deck(tmp_path / "bom.toml")) == declare(read(SOUND))


@pytest.mark.parametrize("name", deck_names())
def test_decks_of_the_project_are_sound_and_every_number_has_a_source(name: str) -> None:
    deck = load_deck(name)
    assert deck_problems(deck) == []
    for full, number in declare(deck).quantities().items():
        assert number.source.strip(), full
        assert number.source != "not stated", full
        if number.source.startswith("assumed"):
            assert len(number.source) > len("assumed: "), f"{full} says no reason"
