"""A model whose sensors do not count: every rounding to whole numbers is left out.

A linearisation needs it, because the slope of a staircase is zero or infinite everywhere, and a simulation
that is compared with one. The instructions of the equations are read one by one and written again with
floor(v/q + 1/2) = v/q where q is the count of an encoder of the model; other uses of floor, such as the
interval of a spline, stay.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from ....model import FlatModel

_PARAMETER = 3
_FOLLOWS: dict[tuple[object, ...], str] = {
    (ca.OP_DIV, "", "count"): "ratio",
    (ca.OP_ADD, "ratio", ""): "shifted",
    (ca.OP_ADD, "", "ratio"): "shifted",
}


def with_fine_counts(model: FlatModel) -> FlatModel:
    """Return a copy of a model in which no reading is rounded.

    Parameters
    ----------
    model
        Continuous or discrete.
    """
    quanta = {f"{sensor}.quantum" for reading in model.readings for sensor in reading.sensors}
    places = {i for i, v in enumerate(model.parameters) if v.name in quanta}
    if not places:
        return model
    function = model.equations
    arguments = [ca.SX.sym(function.name_in(i), function.sparsity_in(i)) for i in range(function.n_in())]
    results = [ca.SX.zeros(function.sparsity_out(i)) for i in range(function.n_out())]
    work: dict[int, ca.SX] = {}
    # What a place of the working memory holds: a count, something over a count, or half a count more.
    kinds: dict[int, str] = {}
    ratios: dict[int, ca.SX] = {}
    for k in range(function.n_instructions()):
        code, out, into = (
            function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        )  # fmt: skip
        if code == ca.OP_OUTPUT:
            results[out[0]].nz[out[1]] = work[into[0]]
            continue
        if code == ca.OP_INPUT:
            value = arguments[into[0]].nz[into[1]]
            kind = "count" if into[0] == _PARAMETER and into[1] in places else ""
        elif code == ca.OP_CONST:
            value, kind = ca.SX(function.instruction_constant(k)), ""
        else:
            read = [kinds.get(i, "") for i in into]
            kind = _FOLLOWS.get((code, *read), "")
            operands = [work[i] for i in into]
            if kind == "shifted":
                ratio = operands[read.index("ratio")]
            if code == ca.OP_FLOOR and read == ["shifted"]:
                value = ratios[into[0]]
            else:
                value = (ca.SX.binary if len(operands) == 2 else ca.SX.unary)(code, *operands)
            if kind == "shifted":
                ratios[out[0]] = ratio
        work[out[0]], kinds[out[0]] = value, kind
    names = ([function.name_in(i) for i in range(function.n_in())],
             [function.name_out(i) for i in range(function.n_out())])  # fmt: skip
    return replace(model, equations=ca.Function(function.name(), arguments, results, *names))
