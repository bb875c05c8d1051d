"""A model whose sensors do not count: every rounding to whole numbers is left out.

A linearisation needs it, because the slope of a staircase is zero or infinite everywhere, and a simulation
that is compared with one. The instructions of the equations are read one by one and written again with
floor(v) = v − 1/2, the middle of the staircase.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from ...model import FlatModel


def with_fine_counts(model: FlatModel) -> FlatModel:
    """Return a copy of a model in which no reading is rounded.

    Parameters
    ----------
    model
        Continuous or discrete.
    """
    function = model.equations
    codes = [function.instruction_id(k) for k in range(function.n_instructions())]
    if ca.OP_FLOOR not in codes:
        return model
    arguments = [ca.SX.sym(function.name_in(i), function.sparsity_in(i)) for i in range(function.n_in())]
    results = [ca.SX.zeros(function.sparsity_out(i)) for i in range(function.n_out())]
    work: dict[int, ca.SX] = {}
    for k, code in enumerate(codes):
        out, into = function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_OUTPUT:
            results[out[0]].nz[out[1]] = work[into[0]]
        elif code == ca.OP_INPUT:
            work[out[0]] = arguments[into[0]].nz[into[1]]
        elif code == ca.OP_CONST:
            work[out[0]] = ca.SX(function.instruction_constant(k))
        elif code == ca.OP_FLOOR:
            work[out[0]] = work[into[0]] - 0.5
        else:
            operands = [work[i] for i in into]
            work[out[0]] = (ca.SX.binary if len(operands) == 2 else ca.SX.unary)(code, *operands)
    names = ([function.name_in(i) for i in range(function.n_in())],
             [function.name_out(i) for i in range(function.n_out())])  # fmt: skip
    return replace(model, equations=ca.Function(function.name(), arguments, results, *names))
