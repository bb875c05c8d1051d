"""What follows from parameters alone is computed when they are set, with the same result bit for bit."""

from __future__ import annotations

import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export import export_c
from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.controller_code import source_text
from nlsdesign.export.c.guarded_step import PARAMETER_REFUSED, GuardedModel, index_bit
from nlsdesign.export.c.writer import CWriter
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.control import torque_controller
from nlsdesign.foundation.errors import ExportError
from nlsdesign.model.flat import FlatModel, Variable
from tests import observed as ob


def smoother() -> FlatModel:
    """A low-pass whose weights are roots and quotients of two parameters: exact operations of IEEE 754."""
    x, u, both = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p", 2)
    first, second = both[0], both[1]
    keep = ca.sqrt(first) / (first + second)
    result = keep * x + (1 - keep) * u * second - ca.fabs(u) / ca.sqrt(first + second)
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, both, ca.SX.sym("w", 0)],
        [result, ca.vertcat(result, -first * u), nothing, nothing],
    )  # fmt: skip
    numbers = tuple(
        Variable(name, "1", "Number", start, 1.0, 0.1, 50.0) for name, start in (("p", 2.3), ("q", 0.7))
    )
    outputs = (Variable("y", "1", "Smoothed"), Variable("z", "1", "Scaled"))
    return FlatModel(
        "smoother", "Smooths", (Variable("x", "1", "State"),), (Variable("u", "1", "Input"),), numbers,
        outputs, (), equations, 0.1,
    )  # fmt: skip


def function(text: str, name: str) -> str:
    """Return the body of one C function."""
    found = re.search(rf"{name}\([^)]*\)\n\{{\n(.*?)\n\}}\n", text, re.S)
    assert found is not None
    return found[1]


def test_the_step_equals_python_bit_for_bit_before_and_after_parameters_are_set(tmp_path: Path) -> None:
    model, draw = smoother(), np.random.default_rng(4)
    step, reference = CompiledStep(export_c(model, tmp_path)), GuardedModel(model)
    for values in (None, [7.1, 0.3], [0.11, 49.0]):
        if values is not None:
            assert step.set_parameters(values) == 0
            changed = model.with_values({"p": values[0], "q": values[1]})
            after = GuardedModel(changed)
            after.state, after.begun = reference.state, True
            reference = after
        for u in draw.normal(size=50):
            expected, _ = reference.step([u])
            outputs, status = step([u])
            assert (status, list(outputs)) == (0, expected)


def test_a_refused_parameter_leaves_its_numbers_and_another_one_is_taken(tmp_path: Path) -> None:
    model = smoother()
    source = export_c(model, tmp_path)
    step = CompiledStep(source, [np.nan, 3.0])
    assert step.first_status == PARAMETER_REFUSED | index_bit(0)
    reference = GuardedModel(model.with_values({"q": 3.0}))
    for u in (0.3, -2.0, 1.1):
        assert list(step([u])[0]) == reference.step([u])[0]


def test_no_step_computes_what_parameters_decide() -> None:
    text = source_text(CWriter(smoother(), "s", Real.DOUBLE))
    assert "sqrt(" in function(text, "s_derive")
    assert "sqrt(" not in function(text, "s_advance")
    controller = torque_controller(ob.bench(ob.SLOW))
    text = source_text(CWriter(controller, "c", Real.FLOAT))
    assert "expf(" in function(text, "c_derive")
    assert "expf(" not in function(text, "c_advance")


def test_parameters_that_are_used_as_they_are_need_no_numbers() -> None:
    x, u, p = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p")
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, p, ca.SX.sym("w", 0)], [u, p * x - u / p, nothing, nothing]
    )
    model = FlatModel(
        "plain", "", (Variable("x", "1", ""),), (Variable("u", "1", ""),), (Variable("p", "1", "", 2.0),),
        (Variable("y", "1", ""),), (), equations, 0.1,
    )  # fmt: skip
    assert "derive" not in source_text(CWriter(model, "s", Real.DOUBLE))


def test_a_number_that_is_not_finite_holds_the_outputs(tmp_path: Path) -> None:
    """Reference: the guards in Python; one over the difference of two equal parameters."""
    u, both, nothing = ca.SX.sym("u"), ca.SX.sym("p", 2), ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), ca.SX.sym("x", 0), u, both, ca.SX.sym("w", 0)],
        [nothing, u / (both[0] - both[1]) + 1 / (both[0] - both[1]), nothing, nothing],
    )  # fmt: skip
    numbers = tuple(Variable(name, "1", "", start) for name, start in (("p", 2.0), ("q", 1.0)))
    model = FlatModel(
        "pole", "", (), (Variable("u", "1", ""),), numbers, (Variable("y", "1", ""),), (), equations, 0.1
    )
    step, reference = CompiledStep(export_c(model, tmp_path)), GuardedModel(model)
    assert step([3.0])[0] == pytest.approx(reference.step([3.0])[0])
    assert step.set_parameters([1.0, 1.0]) == 0
    outputs, status = step([5.0])
    assert (list(outputs), status) == ([4.0], GuardedModel(model.with_values({"p": 1.0})).step([5.0])[1])
    assert status != 0


def test_a_constant_that_is_no_number_is_still_refused() -> None:
    x, u, p, nothing = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p"), ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, p, ca.SX.sym("w", 0)], [u, p * ca.SX(np.nan) + u, nothing, nothing]
    )
    model = FlatModel(
        "nan", "", (Variable("x", "1", ""),), (Variable("u", "1", ""),), (Variable("p", "1", "", 2.0),),
        (Variable("y", "1", ""),), (), equations, 0.1,
    )  # fmt: skip
    with pytest.raises(ExportError, match="NaN"):
        source_text(CWriter(model, "s", Real.DOUBLE))
