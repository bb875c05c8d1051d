"""Modelica text as pymoca reads it: a parser and compiler that shares nothing with the package."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any
from unittest import mock

import casadi as ca
import numpy as np


class ReadModel:
    """A model that pymoca has parsed, flattened and compiled to one residual.

    Each equation defines one unknown by others, ``unknown = expression``. Starting from zeros, the unknowns
    are set to their expressions until nothing changes any more; then all equations hold exactly.
    """

    def __init__(self, text: str) -> None:
        model = self.model = _compiled(text)
        self.unknowns = [*model.der_states, *model.alg_states]
        groups = (model.states, model.inputs, model.parameters, self.unknowns)
        symbols = [ca.veccat(*[v.symbol for v in group]) for group in groups]
        self.residual = ca.Function("residual", [model.time, *symbols], [ca.veccat(*model.equations)])
        names = [v.symbol.name() for v in self.unknowns]
        self.order = [names.index(_left_side(equation)) for equation in model.equations]
        assert sorted(self.order) == list(range(len(names))), "an unknown has no equation, or two"

    def values(
        self, time: float, state: Sequence[float], inputs: Sequence[float], parameters: Sequence[float]
    ) -> dict[str, float]:
        """Every unknown by its name; the vectors in the order of the text."""
        z = np.zeros(len(self.unknowns))
        for _ in range(len(z) + 4):  # the last rounds remove rounding
            before = z.copy()
            z[self.order] -= np.array(self.residual(time, state, inputs, parameters, z)).ravel()
            # Before its operands are known a value may not be finite; it is computed again.
            z = np.where(np.isfinite(z), z, 0.0)
            if np.array_equal(z, before):
                return dict(zip(self.names(self.unknowns), z.tolist(), strict=True))
        raise AssertionError("the equations do not settle: they are no explicit sequence")

    @staticmethod
    def names(variables: Sequence[Any]) -> list[str]:
        """Names without their quotation marks."""
        return [v.symbol.name().replace("'", "") for v in variables]


def _left_side(equation: ca.MX) -> str:
    """Name on the left: pymoca turns ``a = b`` into ``a - b``, and CasADi ``a - 0`` into ``a``."""
    return str((equation if equation.is_symbolic() else equation.dep(0)).name())


def _compiled(text: str) -> Any:
    from pymoca import parser
    from pymoca.backends.casadi import generator

    (name,) = re.findall(r"^model (\w+)", text, re.MULTILINE)
    # What pymoca lacks: the division of newer CasADi, and some functions of the language.
    lacking = {
        "noEvent": lambda value: value,
        "asin": lambda x: ca.asin(x),
        "acos": lambda x: ca.acos(x),
        "atan": lambda x: ca.atan(x),
        "atan2": lambda y, x: ca.atan2(y, x),
    }
    with mock.patch.dict(generator.OP_MAP, {"/": "__truediv__"}):
        for function, meaning in lacking.items():
            setattr(ca.MX, function, meaning)
        try:
            return generator.generate(parser.parse(text), name)
        finally:
            for function in lacking:
                delattr(ca.MX, function)
