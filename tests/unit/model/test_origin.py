"""What is derived from a deck knows which deck: name and digest, true also after numbers were changed."""

from __future__ import annotations

import hashlib
import re
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from nlsdesign.components import Assembly
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.components.assembly.deck_writer import deck_digest, deck_problems, deck_text, declare
from nlsdesign.feedback.control import joined, torque_controller
from nlsdesign.feedback.observer import (
    CascadeGain,
    FixedGrid,
    PaperForm,
    design_observer,
)
from nlsdesign.foundation.deck import deck_names, load_deck, read_deck
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import FlatModel, Origin, flatten
from nlsdesign.model.paper_form import paper_form
from nlsdesign.model.transform import cut, with_outputs, without_idle_states

DECK = "austin2015_figure_consistent"
HERE = Path("here.toml")


def bundled(name: str = DECK) -> Assembly:
    return declare(load_deck(name))


def origin(model: FlatModel) -> Origin:
    assert model.origin is not None
    return model.origin


def digest_of(text: str) -> str:
    return origin(flatten(declare(read_deck(text, HERE)))).digest


@pytest.mark.parametrize("name", deck_names())
def test_a_written_deck_has_the_digest_of_the_one_that_it_was_written_from(name: str) -> None:
    made = bundled(name)
    found = origin(flatten(made))
    assert found.deck == load_deck(name).name
    assert re.fullmatch("[0-9a-f]{64}", found.digest)
    assert digest_of(deck_text(made)) == found.digest
    # Written by the package, the parts of a deck are its text after the first table: a stranger can check.
    parts = re.split(r"(?m)^(?=\n?\[(?!deck\]))", deck_text(made), maxsplit=1)[1]
    assert hashlib.sha256(parts.encode()).hexdigest() == found.digest


def test_each_deck_has_another_digest() -> None:
    assert len({deck_digest(bundled(name)) for name in deck_names()}) == len(deck_names())


PLAIN = """
[deck]
name = "swing"
description = "a wheel on a spring"

[wheel]
component = "Inertia"
inertia = {value = 2.5, unit = "g*m^2", source = "drawing 7", spread = 0.1}

[spring]
component = "Spring"
between = ["wheel"]
domain = "rotation"
stiffness = {value = 2.0, unit = "N*m/rad", source = "bench"}
"""

SAME: dict[str, Callable[[str], str]] = {
    "a comment": lambda t: "# measured on a Monday\n" + t.replace("[wheel]", "[wheel] # of steel"),
    "other spaces": lambda t: t.replace(" = ", "   =  ").replace("\n\n", "\n\n\n"),
    "order of fields": lambda t: t.replace('value = 2.5, unit = "g*m^2"', 'unit = "g*m^2", value = 2.5'),
    "order of lines": lambda t: t.replace(
        'between = ["wheel"]\ndomain = "rotation"\n', 'domain = "rotation"\nbetween = ["wheel"]\n'
    ),
    "another spelling of the number": lambda t: t.replace("value = 2.5", "value = 25.0e-1"),
    "another name": lambda t: t.replace('"swing"', '"seesaw"'),
    "another description": lambda t: t.replace("a wheel on a spring", "something"),
    "a parent": lambda t: t.replace(
        'name = "swing"', f'name = "swing"\nparent = {{name = "old", digest = "{"0" * 64}"}}'
    ),
}
OTHER: dict[str, Callable[[str], str]] = {
    "value": lambda t: t.replace("2.5", "2.5000000000000004"),
    "unit": lambda t: t.replace('2.5, unit = "g*m^2"', '2.5e-3, unit = "kg*m^2"'),
    "source": lambda t: t.replace("drawing 7", "drawing 8"),
    "spread": lambda t: t.replace("spread = 0.1", "spread = 0.2"),
    "no spread": lambda t: t.replace(", spread = 0.1", ""),
    "name of a part": lambda t: t.replace("[wheel]", "[disc]").replace('["wheel"]', '["disc"]'),
    "another part": lambda t: t + '\n[wall]\ncomponent = "Fixed"\ndomain = "rotation"\n',
    "other ends": lambda t: (
        t.replace('["wheel"]', '["wheel", "wall"]') + '\n[wall]\ncomponent = "Fixed"\ndomain = "rotation"\n'
    ),
}


@pytest.mark.parametrize("change", SAME)
def test_what_says_nothing_of_the_machine_leaves_the_digest(change: str) -> None:
    assert SAME[change](PLAIN) != PLAIN
    assert digest_of(SAME[change](PLAIN)) == digest_of(PLAIN)


def test_every_number_unit_source_spread_and_the_arrangement_change_the_digest() -> None:
    digests = [digest_of(PLAIN), *(digest_of(change(PLAIN)) for change in OTHER.values())]
    assert len(set(digests)) == len(digests)


def test_every_number_of_a_deck_counts() -> None:
    made = bundled()
    whole = deck_digest(made)
    for name, old in made.quantities().items():
        nudged = (*old.values[:-1], old.values[-1] * (1.0 + 1e-15) or 1e-300)
        value = nudged if isinstance(old.value, tuple) else nudged[0]
        assert deck_digest(made, {name: old.with_value(value, old.source)}) != whole, name


VIEWS: dict[str, Callable[[FlatModel], FlatModel]] = {
    "other outputs": lambda m: with_outputs(m, ["spring.torque"]),
    "cut": lambda m: cut(m, ["spring.rubber.extension"]),
    "without idle states": lambda m: without_idle_states(m, ["spring.torque", "motor.angle"]),
    "paper form": paper_form,
    "default observer": lambda m: design_observer(m, grid=FixedGrid(-1.5, 1.5, 33)),
    "observer in the published form": lambda m: design_observer(
        m, form=PaperForm(), grid=FixedGrid(-1.5, 1.5, 33)
    ),
    "controller": torque_controller,
}


@pytest.mark.long_cases("default observer")
@pytest.mark.parametrize("view", VIEWS)
def test_what_is_derived_from_a_model_carries_its_origin(view: str) -> None:
    plant = flatten(bundled())
    made = VIEWS[view](plant)
    assert origin(made).deck == DECK
    assert origin(made).digest == deck_digest(bundled())
    assert origin(made).changed == ()


def test_other_numbers_have_the_digest_of_the_deck_that_they_would_make() -> None:
    made = bundled()
    arm = made.quantities()["spring.cam.lever_arm"]
    values = {
        "motor.inertia": 7e-4,
        "spring.rubber.area": quantity(90.0, "mm^2", source="caliper", spread=0.01),
        "spring.cam.lever_arm[3]": 1.01 * arm.values[2],
    }
    changed = flatten(made).with_values(values)
    assert set(origin(changed).changed) == {"motor.inertia", "spring.rubber.area", "spring.cam.lever_arm"}
    assert origin(changed).digest == deck_digest(made.with_values(values)) != deck_digest(made)
    assert origin(changed).numbers["motor.inertia"].number == 7e-4
    observer = design_observer(changed, gain=CascadeGain(), grid=FixedGrid(-1.5, 1.5, 33))
    assert origin(observer).digest == origin(changed).digest
    back = changed.with_values({n: made.quantities()[n] for n in ("motor.inertia", "spring.rubber.area")})
    assert origin(back).changed == ("spring.cam.lever_arm",)
    assert origin(back.with_values({"spring.cam.lever_arm[3]": arm.values[2]})).digest == deck_digest(made)


def test_numbers_that_no_deck_declares_leave_the_digest() -> None:
    made = bundled()
    plant = flatten(made).with_values({"motor.angle": 0.2, "motor.current": 1.0})
    assert origin(plant).digest == deck_digest(made)
    controller = torque_controller(plant)
    gain = next(v.name for v in controller.parameters if v.name.startswith("controller."))
    assert origin(controller.with_values({gain: 1.5})).digest == deck_digest(made)
    other = controller.with_values({"motor.inertia": 1e-3})
    assert origin(other).changed == ("motor.inertia",)
    assert origin(other).digest != deck_digest(made)


def test_a_moved_load_is_another_arrangement() -> None:
    assert origin(flatten(with_moved_load(bundled()))).digest != deck_digest(bundled())


def test_observer_and_controller_of_two_decks_are_of_neither() -> None:
    plant, grid = flatten(bundled()), FixedGrid(-1.5, 1.5, 33)
    other = plant.with_values({"motor.inertia": 7e-4})
    observer = design_observer(plant, gain=CascadeGain(), grid=grid)
    one = joined(observer, torque_controller(plant))
    assert origin(one).digest == deck_digest(bundled())
    mixed = origin(joined(observer, torque_controller(other)))
    assert mixed.digest not in (origin(plant).digest, origin(other).digest)
    assert mixed.deck == f"{DECK} and {DECK}"
    assert mixed.numbers == {}
    without = joined(replace(observer, origin=None), torque_controller(plant))
    assert origin(without).deck == f"no deck and {DECK}"
    assert origin(without).digest != origin(plant).digest


def test_an_origin_that_was_given_by_hand_is_not_kept_with_other_numbers() -> None:
    given = Origin("bench", "0" * 64)
    one, other = given.with_values({"spring.stiffness": 2.0}), given.with_values({"spring.stiffness": 3.0})
    assert len({given.digest, one.digest, other.digest}) == 3
    assert one.changed == ("spring.stiffness",)
    assert given.with_values({}) == given


def test_an_origin_costs_nothing_before_it_is_asked_for() -> None:
    plant = flatten(bundled("test_rig"))

    def taken(work: Callable[[], object]) -> float:
        begin = time.perf_counter()
        work()
        return time.perf_counter() - begin

    values = {"motor.inertia": 1e-3}
    changing = min(taken(lambda: plant.with_values(values).origin) for _ in range(50))
    writing = min(taken(lambda: deck_text(bundled("test_rig"))) for _ in range(3))
    assert changing < 0.5 * writing
    # Asked for once, it is known.
    asked = origin(plant)
    assert asked.digest is asked.digest


def test_a_parent_is_read_and_written() -> None:
    earlier = f'{{name = "b", digest = "{"2" * 64}"}}'
    line = f'{{name = "a", digest = "{"1" * 64}", change = "designed", parent = {earlier}}}'
    made = declare(read_deck(PLAIN.replace('name = "swing"', f'name = "swing"\nparent = {line}'), HERE))
    assert made.parent is not None
    line_of_it = [(p.name, p.digest[0], p.change) for p in made.parent.line()]
    assert line_of_it == [("a", "1", "designed"), ("b", "2", "")]
    assert declare(read_deck(deck_text(made), HERE)) == made
    assert origin(flatten(made)).parent == made.parent


WRONG = {
    'parent = "swing"': "here.toml:4:1: deck.parent: is 'swing', not a deck",
    'parent = {name = "a"}': "deck.parent.digest: is missing",
    'parent = {name = "a", digest = "12"}': "'12' is no SHA-256",
    f'parent = {{nam = "a", digest = "{"1" * 64}"}}': "did you mean 'name'",
    f'parent = {{name = 3, digest = "{"1" * 64}"}}': "deck.parent.name: is 3, not a text",
    f'parent = {{name = "a", digest = "{"1" * 64}", parent = 2}}': "deck.parent.parent: is 2",
}


@pytest.mark.parametrize("line", WRONG)
def test_a_parent_that_is_none_is_refused_with_its_place(line: str) -> None:
    deck = read_deck(PLAIN.replace('name = "swing"', f'name = "swing"\n{line}'), HERE)
    words = "\n".join(str(problem) for problem in deck_problems(deck))
    assert WRONG[line] in words
