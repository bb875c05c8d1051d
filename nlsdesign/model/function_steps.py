"""The instructions of an SX function in static single assignment: each operand names what computed it."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

_NO_OPERANDS = frozenset([ca.OP_CONST, ca.OP_INPUT])


class Instruction(NamedTuple):
    """One operation.

    Parameters
    ----------
    operation
        Code of CasADi, such as ``casadi.OP_MUL``.
    operands
        Numbers of the instructions whose values it takes; CasADi names two also where there is one.
    extra
        The value of a constant, or argument and element of an input.
    """

    operation: int
    operands: tuple[int, ...]
    extra: Any


class Instructions(NamedTuple):
    """What a function computes.

    Parameters
    ----------
    steps
        In the order of computation.
    results
        Number of the instruction behind each element of each result.
    """

    steps: tuple[Instruction, ...]
    results: dict[tuple[int, int], int]


def read_instructions(function: ca.Function) -> Instructions:
    """Return the instructions of an SX function."""
    steps: list[Instruction] = []
    results: dict[tuple[int, int], int] = {}
    held: dict[int, int] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        out, into = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            results[out[0], out[1]] = held[into[0]]
            continue
        extra = function.instruction_constant(k) if operation == ca.OP_CONST else into
        operands = () if operation in _NO_OPERANDS else tuple(held[i] for i in into)
        steps.append(Instruction(operation, operands, extra))
        held[out[0]] = len(steps) - 1
    return Instructions(tuple(steps), results)
