"""What an observer makes of the first reading, of one after a gap, and what it expects of the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import casadi as ca

from ....foundation.symbolic import Expression
from .plant import AngleScheduledPlant


class StepWriter(Protocol):
    """Writes the step of a scheduled observer with the entries read from its table."""

    plant: AngleScheduledPlant
    w: Expression

    def read(self, kind: str, i: int, j: int = 0) -> Expression:
        """Return one entry of a matrix."""
        ...

    def row(self, kind: str, i: int, of: Sequence[Expression]) -> Expression:
        """Return one row of a matrix times a vector."""
        ...

    def prior(self, memory: Sequence[Expression]) -> list[Expression]:
        """Return the states that are expected at a sample."""
        ...


class FirstReading:
    """Begin and expectation of a scheduled observer.

    Parameters
    ----------
    writer
        Of its step.
    memory, others
        Its states: what the estimates carry on, then previous values and filtered rates of what else is
        measured.
    angle
        The measured angle.
    """

    def __init__(
        self,
        writer: StepWriter,
        memory: Sequence[Expression],
        others: Sequence[Expression],
        angle: Expression,
    ) -> None:
        self.writer, self.plant = writer, writer.plant
        self.memory, self.others, self.angle = list(memory), list(others), angle
        self.inputs = [angle, *(ca.SX.sym(v.name) for v in self.plant.inputs)]
        self.arguments = [_column([*memory, *others]), _column(self.inputs), ca.SX(0, 1), writer.w]

    def expected(self) -> ca.Function:
        """Return what is expected of each input: of the angle what the model predicts."""
        place, _ = self.plant.moving
        predicted = self.writer.prior(self.memory)[place]
        return ca.Function("expected", self.arguments, [_column([predicted, *self.inputs[1:]])])

    def begin(self) -> ca.Function:
        """Return the states of a machine that rests at the first reading, and those after a gap."""
        plant, writer, count = self.plant, self.writer, len(self.memory)
        angle_place, speed_place = plant.moving
        measured = [writer.read("measured", i) for i in range(len(plant.measured))]
        given = {angle_place: self.angle, speed_place: ca.SX(0)}
        given |= {plant.names.index(name): y for name, y in zip(plant.measured, measured, strict=True)}
        inner = [i for i in range(count) if i not in given]
        known = [given.get(i, ca.SX(0)) for i in range(count)]
        offset = [writer.row("next", i, [*known, ca.SX(1)]) + writer.read("prior", i) for i in inner]
        carried = [[writer.read("next", i, j) for j in inner] for i in inner]
        for i, value in zip(inner, at_rest(carried, offset), strict=True):
            known[i] = value
        begun = [known[i] - writer.read("prior", i) for i in range(count)]
        resumed = list(self.memory)
        resumed[angle_place] += self.angle - writer.prior(self.memory)[angle_place]
        rates = [ca.SX(0)] * (len(self.others) - len(measured))
        results = [_column([*begun, *measured, *rates]), _column([*resumed, *measured, *rates])]
        return ca.Function("begin", self.arguments, results)


def at_rest(carried: Sequence[Sequence[Expression]], offset: Sequence[Expression]) -> list[Expression]:
    """Return the inner states that stay as they are: x = A·x + g.

    A state that never decays, such as a permanent set, has no rest of its own and begins at zero.

    Parameters
    ----------
    carried
        A, shape (n, n).
    offset
        g, shape (n,).
    """
    count = len(offset)
    lasting = [i for i in range(count) if not _decays(carried[i][i])]
    moving = [i for i in range(count) if i not in lasting]
    result = [ca.SX(0)] * count
    if not moving:
        return result
    matrix = ca.SX.eye(len(moving)) - ca.SX(
        ca.vertcat(*[ca.horzcat(*[carried[i][j] for j in moving]) for i in moving])
    )
    rest = ca.solve(matrix, _column([offset[i] for i in moving]))
    for place, i in enumerate(moving):
        result[i] = rest[place]
    return result


def _decays(kept: Expression) -> bool:
    """Return whether a share that is kept over a sample is below one, or varies with the angle."""
    return not (kept.is_constant() and float(kept) >= 1.0 - 1e-12)


def _column(items: Sequence[Expression]) -> Expression:
    return ca.SX(ca.densify(ca.vertcat(*items))) if items else ca.SX(0, 1)
