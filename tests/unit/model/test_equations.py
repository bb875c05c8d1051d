"""The SymPy view says the same as the model: evaluated by ``sympy.lambdify``, compared with CasADi."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
import sympy

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CoulombFriction,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    ForceSensor,
    GearedMotor,
    LinearElastic,
    Pulley,
    Regularised,
    Rounded,
    Sharp,
    Spring,
    StrainStiffening,
    TransportDelay,
    TwoSidedCam,
    ViscousMaterial,
    parallel,
    pull_only,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ExportError
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.flat import equations
from nlsdesign.model.symbolic_view import Equations


def drive(cam: Pulley | TwoSidedCam, *, smooth: bool) -> Assembly:
    contact = Rounded(width=0.02) if smooth else Sharp()
    rubber = specimen(
        area=1e-4,
        rest_length=0.0125,
        stiff=StrainStiffening(modulus=(1e6, 2e6), knots=(0.0, 0.03), contact=contact),
        relaxing=series(spring=LinearElastic(modulus=5e5), dashpot=ViscousMaterial(viscosity=4e4)),
    )
    return assembly(
        "drive",
        motor=GearedMotor(inertia=6e-4, gear_ratio=4, torque_constant=0.055, current_limit=2.0),
        load=Fixed(),
        spring=tie(through(cam, rope=pull_only(rubber=rubber), pretension=1e-3), "motor", "load"),
        bearing=tie(
            parallel(
                oil=Dashpot(damping=1e-3, domain=ROTATION),
                rub=CoulombFriction(sliding_effort=0.02, contact=Regularised(creep_speed=0.02)),
            ),
            "motor",
        ),
        dial=Encoder(of="motor.angle", quantum=1e-3),
        bus=TransportDelay(of="spring.rope.rubber.force", delay=1e-3),
        cell=ForceSensor(of="bus.reading", gain=1.1, bias=2.0),
    )


def evaluated(model: FlatModel, view: Equations, state: list[float], inputs: list[float]) -> dict[str, float]:
    """Every right-hand side of the view, definitions first and in their order, by lambdified SymPy."""
    known = dict(zip([v.name for v in model.states], state, strict=True)) | model.values
    known |= dict(zip([v.name for v in model.inputs], inputs, strict=True)) | {"time": 0.0}

    def value(expression: sympy.Expr) -> float:
        symbols = sorted(expression.free_symbols, key=str)
        return float(sympy.lambdify(symbols, expression, "math")(*[known[s.name] for s in symbols]))

    for name, expression in view.definitions.items():
        known[name] = value(expression)
    return known | {f"der({name})": value(e) for name, e in view.derivatives.items()}


@pytest.mark.long_cases("False", "True")
@pytest.mark.parametrize("smooth", [False, True])
def test_view_and_model_give_the_same_numbers(smooth: bool) -> None:
    model = flatten(drive(Pulley(radius=0.01), smooth=smooth))
    view = equations(model)
    names = [v.name for v in model.signals + model.outputs]
    draw = np.random.default_rng(4)
    for _ in range(25):
        state = [
            draw.uniform(-0.4, 0.4),
            draw.uniform(-3, 3),
            draw.uniform(-0.1, 0.1),
            *draw.uniform(-9, 9, 2),
        ]
        inputs = [draw.uniform(-3, 3)]
        expected, found = model.evaluate(state, inputs), evaluated(model, view, state, inputs)
        for name in [*names, *[f"der({v.name})" for v in model.states]]:
            assert found[name] == pytest.approx(expected[name], rel=1e-12, abs=1e-12), name


def test_view_has_an_equation_for_every_state_and_every_name() -> None:
    model = flatten(drive(Pulley(radius=0.01), smooth=False))
    view = equations(model)
    assert list(view.derivatives) == [v.name for v in model.states]
    states = {v.name for v in model.states}
    assert {v.name for v in model.signals} <= set(view.definitions) | states
    assert sympy.Symbol("motor.speed", real=True) == view.derivatives["motor.angle"]


def test_constants_keep_all_their_digits() -> None:
    x = ca.SX.sym("x")
    none = [ca.SX.sym(n, 0) for n in "upw"]
    model = FlatModel(
        "c",
        "",
        (Variable("x", "1", "x"),),
        (),
        (),
        (),
        (),
        ca.Function(
            "e", [ca.SX.sym("t"), x, *none], [math.pi * x + 1 / 3, ca.SX(0, 1), ca.SX(0, 1), ca.SX(0, 1)]
        ),
    )
    view = equations(model)
    assert evaluated(model, view, [2.0], [])["der(x)"] == pytest.approx(2 * math.pi + 1 / 3, rel=1e-15)


UNARY = {
    "exp": ca.exp,
    "log": ca.log,
    "log1p": ca.log1p,
    "expm1": ca.expm1,
    "sqrt": ca.sqrt,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "asin": ca.asin,
    "acos": ca.acos,
    "atan": ca.atan,
    "sinh": ca.sinh,
    "cosh": ca.cosh,
    "tanh": ca.tanh,
    "atanh": ca.atanh,
    "erf": ca.erf,
    "fabs": ca.fabs,
    "sign": ca.sign,
    "floor": ca.floor,
    "ceil": ca.ceil,
    "square": lambda v: v * v,
    "twice": lambda v: v + v,
    "inverse": lambda v: 1 / v,
    "not": lambda v: ca.logic_not(v > 0.5),
}
BINARY = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
    "constpow": lambda a, b: a**2.5 + b,
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "atan2": ca.atan2,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "and": lambda a, b: ca.logic_and(a > 0.3, b > 0.3),
    "or": lambda a, b: ca.logic_or(a > 0.3, b > 0.3),
    "if_else": lambda a, b: ca.if_else(a > b, a, 3 * b),
}


@pytest.mark.parametrize("name", [*UNARY, *BINARY])
def test_every_operation_has_its_counterpart(name: str) -> None:
    x = ca.SX.sym("x", 2)
    none = [ca.SX.sym(n, 0) for n in "upw"]
    right = UNARY[name](x[0]) if name in UNARY else BINARY[name](x[0], x[1])
    model = FlatModel(
        "o",
        "",
        (Variable("a", "1", "a"), Variable("b", "1", "b")),
        (),
        (),
        (),
        (),
        ca.Function(
            "e", [ca.SX.sym("t"), x, *none], [ca.vertcat(right, 0), ca.SX(0, 1), ca.SX(0, 1), ca.SX(0, 1)]
        ),
    )
    view = equations(model)
    for point in ([0.3, 0.7], [0.7, 0.3], [0.6, 0.6], [0.25, 0.26]):
        expected = model.evaluate(point)["der(a)"]
        assert evaluated(model, view, point, [])["der(a)"] == pytest.approx(expected, rel=1e-14), point


def test_an_operation_without_counterpart_is_named() -> None:
    x = ca.SX.sym("x")
    none = [ca.SX.sym(n, 0) for n in "upw"]
    model = FlatModel(
        "e",
        "",
        (Variable("x", "1", "x"),),
        (),
        (),
        (),
        (),
        ca.Function("e", [ca.SX.sym("t"), x, *none], [ca.erfinv(x), ca.SX(0, 1), ca.SX(0, 1), ca.SX(0, 1)]),
    )
    with pytest.raises(ExportError, match="counterpart"):
        equations(model)


def test_long_definitions_are_shown_as_functions_of_what_they_depend_on() -> None:
    """The lever arm of 40 control values; everything built on it stays readable and right."""
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    view = equations(model)
    assert str(view.definitions["spring.cam.lever_arm_now"]) == (
        "f(motor.angle, spring.cam.changeover, spring.cam.last_angle, spring.cam.lever_arm)"
    )
    torque = view.definitions["spring.torque"]
    names = {s.name for s in torque.free_symbols}
    assert names == {"spring.cam.elements", "spring.cam.lever_arm_now", "spring.rubber.force"}
    assert "\\dot{" in view.latex()
    assert str(view).count("der(") == 3


def test_names_of_equal_signals_are_all_there() -> None:
    """A spring alone behind a tie: its force and that of the tie are one expression with two names."""
    made = assembly("a", p=Driven(domain=TRANSLATION), s=tie(parallel(k=Spring(stiffness=3.0)), "p"))
    view = equations(flatten(made))
    assert {"s.k.force", "s.force"} <= set(view.definitions)
