"""The waist: names, order, choice of inputs and outputs, copies with other numbers, tables, what is refused.

Independent road: names and numbers are typed here from the declaration; the element that asks for its
symbols in the wrong order is one of this file.
"""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    GearedMotor,
    Inertia,
    LinearElastic,
    Mass,
    Pulley,
    Spring,
    StrainStiffening,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.element import Scope
from nlsdesign.components.core.part import parameter
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import (
    ArrangementError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import Quantity, quantity
from nlsdesign.foundation.spread import RelativeSpread
from nlsdesign.foundation.symbolic import Expression
from nlsdesign.model import FlatModel, Table, Variable, flatten
from tests.physics.fed_by_rate import OneDimensional


@dataclass(frozen=True, kw_only=True)
class Backwards(OneDimensional):
    """A spring with two numbers that asks for the second first."""

    first: Quantity = parameter("N/m", "first")
    second: Quantity = parameter("N/m", "second")

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        later = scope.parameter("second") * motion
        return scope.parameter("first") * motion + later


def bench() -> Assembly:
    rubber = specimen(
        area=1e-4,
        rest_length=0.0125,
        stiff=StrainStiffening(modulus=(1e6, 2e6), knots=(0.0, 0.1)),
        relaxing=series(dashpot=ViscousMaterial(viscosity=4e4), spring=LinearElastic(modulus=5e5)),
    )
    return assembly(
        "bench",
        motor=GearedMotor(inertia=6e-4, gear_ratio=4, torque_constant=0.055),
        hand=Driven(),
        spring=tie(through(Pulley(radius=0.01), rubber=rubber), "motor", "hand"),
        bearing=tie(Dashpot(damping=1e-3, domain=ROTATION), "motor"),
        encoder=Encoder(of="motor.angle", quantum=1e-3),
    )


# --- order and names ------------------------------------------------------------------------------


def test_parameters_stand_in_written_order_whatever_the_laws_ask_first() -> None:
    made = assembly(
        "a",
        p=Driven(domain=TRANSLATION),
        s=tie(series(x=Backwards(first=1, second=2), y=Spring(stiffness=3)), "p"),
    )
    assert [v.name for v in flatten(made).parameters] == ["s.x.first", "s.x.second", "s.y.stiffness"]


def test_every_vector_stands_in_written_order() -> None:
    """Bodies say their motion before their drive, yet the current comes first, as in the deck."""
    model = flatten(bench())
    assert [v.name for v in model.inputs] == ["motor.current", "hand.angle", "hand.speed"]
    assert [v.name for v in model.states] == [
        "motor.angle",
        "motor.speed",
        "spring.rubber.relaxing.dashpot.strain",
    ]
    assert [v.name for v in model.parameters] == [
        *("motor.inertia", "motor.gear_ratio", "motor.torque_constant", "motor.current_limit"),
        *("spring.pretension", "spring.cam.elements", "spring.cam.radius"),
        *("spring.rubber.rest_length", "spring.rubber.area"),
        *("spring.rubber.stiff.modulus[1]", "spring.rubber.stiff.modulus[2]"),
        *("spring.rubber.stiff.knots[1]", "spring.rubber.stiff.knots[2]"),
        *("spring.rubber.relaxing.dashpot.viscosity", "spring.rubber.relaxing.spring.modulus"),
        *("bearing.damping", "encoder.quantum"),
    ]
    owners = [v.name.rpartition(".")[0] for v in model.signals]
    walked = [path for path, _ in bench().walk()]
    assert owners == sorted(owners, key=walked.index)


@pytest.mark.parametrize(
    "name", ["austin2015_as_printed", "austin2015_figure_consistent", "austin2015_soft_spring"]
)
def test_names_are_unique_and_say_what_they_are(name: str) -> None:
    model = flatten(declare(load_deck(name)), outputs=["motor.angle"])
    everything = model.states + model.inputs + model.parameters + model.signals
    assert len({v.name for v in everything}) == len(everything)
    for variable in everything + model.outputs:
        assert variable.unit
        assert variable.description
    for variable in model.parameters:
        assert variable.source


def test_a_bare_number_does_not_keep_the_citation_of_the_old_one() -> None:
    declared = declare(load_deck("austin2015_as_printed"))
    name, told = "spring.rubber.area", "not stated; changed from 1 cm²: Austin, Schepelmann, Geyer"
    changed = declared.with_values({name: 2e-4})
    assert changed.quantities()[name].source.startswith(told)
    assert flatten(changed).variable(name).source.startswith(told)
    late = flatten(declared).with_values({name: 2e-4}).variable(name)
    assert late.source.startswith("not stated; changed from 0.0001 m²: Austin, Schepelmann, Geyer")
    same = flatten(declared).with_values({name: 1e-4}).variable(name)
    assert same == flatten(declared).variable(name)
    row = declared.with_values({"spring.rubber.stiff.modulus[2]": 0.6e6}).quantities()
    assert row["spring.rubber.stiff.modulus"].source.startswith("not stated; changed from 6 numbers in MPa")


def test_numbers_travel_with_source_and_spread() -> None:
    made = bench().with_values(
        {"bearing.damping": quantity(2.0, "mN*m*s/rad", source="run-down", spread=0.3)}
    )
    variable = flatten(made).variable("bearing.damping")
    assert (variable.start, variable.unit, variable.source, variable.spread) == (
        2e-3,
        "N*m*s/rad",
        "run-down",
        RelativeSpread(0.3),
    )


# --- inputs and outputs ---------------------------------------------------------------------------


def test_outputs_are_chosen_by_name_or_are_the_sensors_or_the_ties() -> None:
    assert [v.name for v in flatten(bench()).outputs] == ["encoder.reading"]
    assert [v.name for v in flatten(bench().without_part("encoder")).outputs] == [
        "spring.torque",
        "bearing.torque",
    ]
    chosen = flatten(bench(), outputs=["spring.torque", "motor.angle", "motor.current"])
    assert [v.name for v in chosen.outputs] == ["spring.torque", "motor.angle", "motor.current"]
    at = chosen.evaluate([0.2, 1.0, 0.01], [3.0, 0.0, 0.0])
    assert (at["motor.angle"], at["motor.current"]) == (0.2, 3.0)
    assert [v.name for v in flatten(bench(), outputs="spring.torque").outputs] == ["spring.torque"]


def test_inputs_that_are_not_chosen_rest() -> None:
    model = flatten(bench(), inputs=["hand.angle"], outputs=["spring.torque"])
    assert [v.name for v in model.inputs] == ["hand.angle"]
    whole = flatten(bench(), outputs=["spring.torque"])
    state = [0.2, 1.0, 0.01]
    assert model.evaluate(state, [0.05]) == whole.evaluate(state, [0.0, 0.05, 0.0])
    once = flatten(bench(), inputs=["motor.current", "motor.current"])
    assert [v.name for v in once.inputs] == ["motor.current"]


@pytest.mark.parametrize(
    ("given", "near"),
    [({"inputs": ["motor.curent"]}, "motor.current"), ({"outputs": ["spring.torqe"]}, "spring.torque")],
)
def test_wrong_names_of_inputs_and_outputs(given: dict[str, list[str]], near: str) -> None:
    with pytest.raises(UnknownNameError) as caught:
        flatten(bench(), **given)
    assert caught.value.did_you_mean == near


def test_a_body_keeps_its_motion_even_if_nothing_asks_for_it() -> None:
    assert [v.name for v in flatten(assembly("a", wheel=Inertia(inertia=1.0))).states] == [
        "wheel.angle",
        "wheel.speed",
    ]


def test_a_state_that_changes_nothing_is_dropped() -> None:
    """The place of a dashpot between dashpots: only its rate matters."""
    model = flatten(
        assembly(
            "a", p=Driven(domain=TRANSLATION), s=tie(series(x=Dashpot(damping=1), y=Dashpot(damping=2)), "p")
        )
    )
    assert all(np.isfinite(list(model.evaluate([0.0] * len(model.states), [0.0, 1.0]).values())))
    assert model.evaluate([0.0] * len(model.states), [0.0, 3.0])["s.force"] == pytest.approx(2.0)


# --- refused --------------------------------------------------------------------------------------

SINGULAR = {
    "a torsion dashpot of zero in series": lambda: assembly(
        "a",
        p=Driven(),
        s=tie(series(k=Spring(stiffness=1.0, domain=ROTATION), c=Dashpot(damping=0.0, domain=ROTATION)), "p"),
    ),
    "two dashpots of zero in series": lambda: assembly(
        "a",
        p=Driven(),
        s=tie(series(k=Dashpot(damping=0.0, domain=ROTATION), c=Dashpot(damping=0.0, domain=ROTATION)), "p"),
    ),
    "two springs of zero in series": lambda: assembly(
        "a",
        p=Driven(domain=TRANSLATION),
        s=tie(series(k=Backwards(first=0.0, second=0.0), c=Backwards(first=0.0, second=0.0)), "p"),
    ),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_singular_equations_are_refused(name: str) -> None:
    with pytest.raises(ArrangementError, match="singular"):
        flatten(SINGULAR[name]())


def test_a_sensor_of_nothing_is_refused() -> None:
    made = bench().with_part("encoder", Encoder(of="motor.angel", quantum=1e-3))
    with pytest.raises(UnknownNameError) as caught:
        flatten(made)
    assert caught.value.did_you_mean == "motor.angle"
    assert "encoder" in str(caught.value)


# --- copies ---------------------------------------------------------------------------------------


def test_copies_have_other_numbers_and_the_original_stays() -> None:
    model = flatten(bench(), outputs=["bearing.torque"])
    other = model.with_values(
        {"bearing.damping": 5e-3, "motor.angle": 0.3, "hand.speed": quantity(60, "rpm")}
    )
    assert other.values["bearing.damping"] == 5e-3
    assert other.start(other.states)[0] == 0.3
    assert other.variable("hand.speed").start == pytest.approx(2 * np.pi)
    assert model.values["bearing.damping"] == 1e-3
    assert other.evaluate([0.0, 2.0, 0.0])["bearing.torque"] == pytest.approx(1e-2)
    assert model.evaluate([0.0, 2.0, 0.0])["bearing.torque"] == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("values", "kind", "said"),
    [
        ({"bearing.damping": -1.0}, ValueRangeError, "must lie in"),
        ({"bearing.damping": float("nan")}, ValueRangeError, "must lie in"),
        ({"bearing.damping": quantity(1.0, "N*m")}, UnitError, "does not measure"),
        ({"bearing.dampign": 1.0}, UnknownNameError, "bearing.damping"),
        ({"spring.torque": 1.0}, UnknownNameError, "no such name"),
        ({"spring.rubber.stiff.modulus": 1.0}, UnknownNameError, "did you mean"),
    ],
)
def test_copies_that_cannot_be(values: dict[str, float], kind: type[NlsError], said: str) -> None:
    with pytest.raises(kind, match=said.replace("[", r"\[")):
        flatten(bench()).with_values(values)


def test_models_pickle_with_their_equations() -> None:
    model = flatten(bench())
    copy = pickle.loads(pickle.dumps(model))
    state, inputs = [0.2, 1.0, 0.01], [1.0, 0.1, 0.2]
    assert copy.evaluate(state, inputs) == model.evaluate(state, inputs)
    assert copy.parameters == model.parameters
    assert str(copy) == str(model)


def test_symbols_are_fresh_and_name_everything() -> None:
    model = flatten(bench())
    one, other = model.symbols(), model.symbols()
    assert str(one.state[0]) == "motor.angle"
    assert not ca.is_equal(one.state[0], other.state[0])


def test_variable_by_name() -> None:
    model = flatten(bench())
    assert model.variable("spring.torque").unit == "N*m"
    with pytest.raises(UnknownNameError):
        model.variable("spring.torqe")


def test_units_are_typeset_where_people_read_them() -> None:
    model = flatten(bench(), outputs=["spring.torque"])
    text = str(model)
    assert "N·m·s/rad" in text
    assert "*" not in text
    assert "spring.torque [N·m]" in model._repr_html_()
    with pytest.raises(ValueRangeError, match=r"bearing.damping = -1 N·m·s/rad: must lie in .* N·m·s/rad"):
        model.with_values({"bearing.damping": -1.0})


# --- tables ---------------------------------------------------------------------------------------


def table() -> Table:
    columns = (Variable("a", "1", "a"), Variable("b", "1", "b"))
    return Table("x", -1.0, 0.5, columns, np.array([[0.0, 5.0], [1.0, 5.0], [4.0, 5.0], [9.0, 6.0]]))


@pytest.mark.parametrize("at", [-1.0, -0.75, -0.5, 0.1, 0.49, 0.5])
def test_table_runs_in_lines(at: float) -> None:
    """Reference: ``numpy.interp``."""
    grid = -1.0 + 0.5 * np.arange(4)
    expected = [np.interp(at, grid, column) for column in table().values.T]
    assert table().look_up(at) == pytest.approx(expected, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(("at", "row"), [(-1.1, 0), (-np.inf, 0), (0.6, 3), (1e30, 3), (np.inf, 3)])
def test_table_is_held_at_its_ends(at: float, row: int) -> None:
    assert table().look_up(at).tolist() == table().values[row].tolist()


def test_table_at_no_number_gives_no_number() -> None:
    assert np.all(np.isnan(table().look_up(float("nan"))))


UNEVEN = np.array([-1.0, -0.2, -0.19, 0.7, 0.75])


@pytest.mark.parametrize("at", [-1.0, -0.5, -0.2, -0.195, -0.19, 0.0, 0.7, 0.72, 0.75, -1.5, 2.0, np.inf])
def test_table_over_breakpoints_runs_in_lines(at: float) -> None:
    """Reference: ``numpy.interp``, also beyond the ends."""
    values = np.array([[0.0, 5.0], [1.0, 5.0], [-4.0, 5.0], [9.0, 6.0], [2.0, 1.0]])
    columns = (Variable("a", "1", "a"), Variable("b", "1", "b"))
    uneven = Table.over("x", UNEVEN, columns, values)
    expected = [np.interp(at, UNEVEN, column) for column in values.T]
    assert uneven.look_up(at) == pytest.approx(expected, rel=1e-13, abs=1e-13)
    assert np.all(np.isnan(uneven.look_up(math.nan)))
    assert uneven.grid.tolist() == UNEVEN.tolist()


@pytest.mark.parametrize(
    "points", [[0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, math.inf], [0.0, 1.0], []]
)
def test_breakpoints_ascend_and_are_one_for_each_row(points: list[float]) -> None:
    with pytest.raises(ValueRangeError, match="over 'x': needs finite, ascending breakpoints"):
        Table.over("x", np.array(points), (Variable("a", "1", "a"),), np.zeros((3, 1)))


def test_table_of_one_row_is_a_constant() -> None:
    one = Table("x", 0.0, 1.0, (Variable("a", "1", "a"),), np.array([[7.0]]))
    assert [one.look_up(at)[0] for at in (-1.0, 0.0, 0.5, 2.0)] == [7.0] * 4


def test_model_looks_its_tables_up_by_state_and_input() -> None:
    x, u, p, w = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p", 0), ca.SX.sym("w", 3)
    second = Table("drive", 0.0, 1.0, (Variable("c", "1", "c"),), np.array([[10.0], [20.0]]))
    model = FlatModel(
        "m",
        "",
        (Variable("x", "1", "x"),),
        (Variable("drive", "1", "u"),),
        (),
        (Variable("y", "1", "y"),),
        (),
        ca.Function("e", [ca.SX.sym("t"), x, u, p, w], [x, ca.sum1(w), ca.SX(0, 1), ca.SX(0, 1)]),
        1e-3,
        (table(), second),
    )
    assert model.look_up([-0.75], [0.25]).tolist() == pytest.approx([0.5, 5.0, 12.5])
    assert model.evaluate([-0.75], [0.25])["y"] == pytest.approx(18.0)


def test_reactions_hold_what_the_elements_ask() -> None:
    """Newton's third law: what moves the one end is what the other end holds."""
    made = assembly(
        "a", m=Mass(mass=2.0), p=Driven(domain=TRANSLATION), s=tie(Spring(stiffness=5.0), "p", "m")
    )
    at = flatten(made, outputs=["s.force"]).evaluate([0.0, 0.0], [0.0, 0.3, 0.0])
    assert at["s.force"] == pytest.approx(1.5)
    assert at["p.reaction"] == pytest.approx(1.5)
    assert at["m.acceleration"] == pytest.approx(0.75)
    wall = assembly(
        "b", m=Inertia(inertia=2.0), w=Fixed(), s=tie(Spring(stiffness=5.0, domain=ROTATION), "m", "w")
    )
    assert flatten(wall).evaluate([0.3, 0.0])["w.reaction"] == pytest.approx(-1.5)
