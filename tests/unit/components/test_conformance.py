"""What holds for every component alike: units, words, sources, derivatives, pickle, print, deck, C.

The components are found where a deck finds them, so a new one is tested from its first day: it needs an
example in ``tests/parts``.
"""

from __future__ import annotations

import inspect
import pickle
import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import (
    Cam,
    Element,
    Parallel,
    Part,
    Sensor,
    Series,
    smoothed,
)
from nlsdesign.components.assembly.deck_writer import declare, write_deck
from nlsdesign.components.core.part import walk
from nlsdesign.components.core.part_numbers import readings
from nlsdesign.export.compilation.cross_compiler import compiler, run_compiler
from nlsdesign.export.fmi.fmu import fmi_headers, fmu_texts
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ExportError
from nlsdesign.foundation.extensions import extended_by
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model import FlatModel, flatten
from tests.documented_law import documented_law
from tests.parts import declarable, examples, missing_examples
from tests.parts.systems import around, named
from tests.selection import quick_only

STEP = 1e-6
"""Relative to the size of each variable, for the finite difference."""


def flat(part: Part) -> FlatModel:
    return flatten(around(part))


EXAMPLES = {named(part): part for part in examples()}


@pytest.fixture(params=EXAMPLES)
def part(request: pytest.FixtureRequest) -> Part:
    return EXAMPLES[request.param]


@pytest.mark.parametrize("kind", declarable(), ids=lambda c: c.__name__)
def test_every_component_has_an_example_in_each_of_its_readings(kind: type[Part]) -> None:
    assert not missing_examples(kind), missing_examples(kind)


def test_a_law_without_an_example_is_noticed(tmp_path: Path) -> None:
    with extended_by(documented_law(tmp_path)):
        (kind,) = (c for c in declarable() if c.__name__ == "WireBundle")
        assert missing_examples(kind) == (
            "WireBundle has no example: add one to EXAMPLES of a file in tests/parts"
        )


@pytest.mark.parametrize("kind", declarable(), ids=lambda c: c.__name__)
def test_every_element_states_what_it_brings(kind: type[Part]) -> None:
    if issubclass(kind, Element) and kind not in (Parallel, Series):
        assert kind.phenomena
        assert all(word == word.lower() for word in kind.phenomena)


def test_units_are_declared_and_symbols_described(part: Part) -> None:
    for name, info in part.infos().items():
        assert parse_unit(info.unit), name
        assert info.description.strip(), name
        assert info.minimum < info.maximum, name
    model = flat(part)
    for v in model.states + model.inputs + model.parameters + model.outputs + model.signals:
        assert parse_unit(v.unit), v.name
        assert v.description.strip(), v.name


def test_the_law_is_stated_with_its_source(part: Part) -> None:
    text = inspect.getdoc(type(part)) or ""
    assert text, "has no words"
    if isinstance(part, Element | Cam) and type(part).__name__ not in ("Parallel", "Series"):
        assert re.search(r"\bSources?:", text), "names no source of its law"
    if part.infos():
        assert "=" in text or "·" in text or ":" in text, "shows no equation"


def test_every_number_says_where_it_comes_from(part: Part) -> None:
    for _, each in walk(part):
        for name, info in each.infos().items():
            number = each.parameters()[name]
            assert info.checked(name, number) == number
        for holder in (each, *(getattr(each, field) for field in readings(type(each)))):
            for field in holder.__dataclass_fields__.values():
                if hasattr(field.default, "source"):
                    assert field.default.source.startswith("assumed"), field.name


def test_the_derivative_is_that_of_the_finite_difference(part: Part) -> None:
    """CasADi's Jacobian of the rates over states, inputs and parameters at a point without a corner."""
    model = flat(part)
    s = model.symbols()
    everything = ca.vertcat(s.state, s.input, s.parameter)
    values = ca.vertcat(s.derivative, s.output, s.signal)
    if isinstance(part, Sensor) and "quantum" in part.parameter_infos():
        values = s.derivative  # a reading in whole counts has no derivative
    law = ca.Function("law", [everything], [values])
    jacobian = ca.Function("jacobian", [everything], [ca.jacobian(values, everything)])
    sizes = np.array([v.nominal for v in model.states + model.inputs])
    moving = sizes * 0.0137 * (1.0 - 0.07 * np.arange(len(sizes)))  # no two alike: there laws have corners
    point = np.concatenate([moving, model.start(model.parameters)])
    sizes = np.where(point == 0.0, 1.0, np.abs(point))
    found = np.array(jacobian(point))
    assert np.all(np.isfinite(found))
    for column, size in enumerate(sizes):
        ahead, behind = point.copy(), point.copy()
        ahead[column] += STEP * size
        behind[column] -= STEP * size
        slope = (np.array(law(ahead)) - np.array(law(behind))).ravel() / (2 * STEP * size)
        at = np.abs(np.array(law(point)).ravel())
        roundoff = 1e-15 * (at + np.abs(found) @ sizes) / (STEP * size)
        # The last term: what cancels inside a law leaves the rounding of its terms.
        allowed = 1e-5 * np.abs(slope) + 100 * roundoff + 1e-12 * np.max(np.abs(slope))
        assert np.all(np.abs(found[:, column] - slope) <= allowed), everything[column].name()


def test_it_pickles_and_prints(part: Part) -> None:
    assert pickle.loads(pickle.dumps(part)) == part
    made = around(part)
    assert pickle.loads(pickle.dumps(made)) == made
    assert type(part).__name__ in part.title()
    assert "part" in str(made)


def test_a_deck_says_the_same(part: Part, tmp_path: Path) -> None:
    made = around(part)
    write_deck(made, tmp_path / "deck.toml")
    again = declare(load_deck(tmp_path / "deck.toml"))
    assert [(n, type(p)) for n, p in again.walk()] == [(n, type(p)) for n, p in made.walk()]
    assert {n: q.values for n, q in again.quantities().items()} == {
        n: q.values for n, q in made.quantities().items()
    }
    assert again == made


def smooth(part: Part) -> FlatModel:
    """What can be exported of a part: where it is sharp, its smooth form."""
    return flatten(smoothed(around(part)))


def sources(part: Part, folder: Path) -> Path:
    for name, content in fmu_texts(smooth(part), version="3.0", step=1e-3).items():
        if name.startswith("sources/"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
    return folder / "sources"


# Each takes a run of the compiler; a new component is compiled by the thorough run.
@pytest.mark.long_cases("Buckling", "GravityLoad-MassOnArm", "SampleAndHold", "CapstanFriction-WrapProduct")
@pytest.mark.parametrize("name", quick_only(EXAMPLES, list(EXAMPLES)[::12]))
def test_it_becomes_c_that_compiles(name: str, tmp_path: Path) -> None:
    part = EXAMPLES[name]
    folder = sources(part, tmp_path)
    text = (folder / "model.c").read_text(encoding="utf-8")
    for v in smooth(part).parameters:
        assert f'"{v.name}' in text, v.name
    try:
        compiler()
    except ExportError as missing:
        # The compiler is an extra: the package works without, and what is skipped needs one by its nature.
        pytest.skip(str(missing))
    flags = ["-c", "-std=c99", "-Wall", "-Wextra", "-Werror", f"-I{fmi_headers()}"]
    run_compiler([*flags, folder / "fmi3.c", "-o", tmp_path / "fmi3.o"], about=type(part).__name__)
    assert (tmp_path / "fmi3.o").stat().st_size > 0
