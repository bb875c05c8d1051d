"""What a function of SX computes, operation by operation: the one reader of its instructions.

CasADi keeps values in places of a working memory that it uses again and again. Here every value has a number
of its own, that of its instruction, and :func:`fold` goes through them in the order of computation. Who
prints, bounds, counts or evaluates a function brings a table of what each operation means to him.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import casadi as ca

from ..foundation.symbolic import Expression

_Value = TypeVar("_Value")


class Instruction(NamedTuple):
    """One operation of CasADi, such as ``casadi.OP_MUL``, and the numbers of the instructions it takes.

    ``extra`` is the value of a constant, or argument and element of an input.
    """

    operation: int
    operands: tuple[int, ...]
    extra: Any = None


class Graph(NamedTuple):
    """The instructions in the order of computation, and the number behind each nonzero of each result.

    ``last_uses`` has for each instruction the operands that nothing needs after it.
    """

    steps: tuple[Instruction, ...]
    results: dict[tuple[int, int], int]
    last_uses: tuple[tuple[int, ...], ...]


def read_graph(function: ca.Function) -> Graph:
    """Return what a function of SX computes."""
    steps: list[Instruction] = []
    results: dict[tuple[int, int], int] = {}
    numbers: dict[int, int] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        out, into = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            results[out[0], out[1]] = numbers[into[0]]
            continue
        if operation == ca.OP_INPUT:
            step = Instruction(operation, (), (into[0], into[1]))
        elif operation == ca.OP_CONST:
            step = Instruction(operation, (), float(function.instruction_constant(k)))
        else:
            step = Instruction(operation, tuple(numbers[i] for i in into))
        steps.append(step)
        numbers[out[0]] = len(steps) - 1
    last = {operand: number for number, step in enumerate(steps) for operand in step.operands}
    last |= dict.fromkeys(results.values(), len(steps))
    last_uses = [tuple(i for i in {*step.operands} if last[i] == k) for k, step in enumerate(steps)]
    return Graph(tuple(steps), results, tuple(last_uses))


def fold(
    graph: Graph,
    given: Callable[[int, int], _Value],
    constant: Callable[[float], _Value],
    *,
    combined: Callable[[int, Sequence[_Value]], _Value],
) -> dict[tuple[int, int], _Value]:
    """Return a value for each nonzero of each result, by result and nonzero.

    ``given`` is asked for the value of an element of an argument, ``constant`` for that of a number, and
    ``combined`` for that of an operation on values. Each value is let go after its last use.
    """
    values: dict[int, _Value] = {}
    for number, (operation, operands, extra) in enumerate(graph.steps):
        if operands:
            values[number] = combined(operation, [values[i] for i in operands])
            for i in graph.last_uses[number]:
                del values[i]
        else:
            values[number] = given(*extra) if operation == ca.OP_INPUT else constant(extra)
    return {place: values[number] for place, number in graph.results.items()}


def applied(operation: int, operands: Sequence[Expression]) -> Expression:
    """Return an operation on expressions, as CasADi writes it."""
    return ca.SX.unary(operation, *operands) if len(operands) == 1 else ca.SX.binary(operation, *operands)


def as_results(function: ca.Function, values: Mapping[tuple[int, int], Expression]) -> list[Expression]:
    """Return expressions for the results of a function, each with its sparsity, from their nonzeros."""
    results = [ca.SX.zeros(function.sparsity_out(i)) for i in range(function.n_out())]
    for (result, nonzero), value in values.items():
        results[result].nz[nonzero] = value
    return results


def operation_name(operation: int) -> str:
    """Return what CasADi calls an operation, such as ``"fmin"``."""
    known = (name for name in vars(ca) if name.startswith("OP_") and getattr(ca, name) == operation)
    return next(known, f"number {operation}").removeprefix("OP_").lower()
