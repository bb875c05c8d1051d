"""The cascade, whose torque is corrected by what the balance of the driven body shows: the default observer.

The cascade runs as it is, at the numbers of the deck: no slow state acts on its inner states, so they decay
whatever is learned. Beside it all terms of the balance
(:mod:`~nlsdesign.feedback.observer.corrected.balance`) pass one low-pass, with the second difference of the
angle on the other side,

    e = F[J·Δ²θ/T² − Σ φⱼ] = Σ cⱼ·F[φⱼ] + c₀.

The second difference of an angle is exactly the mean of the acceleration over two samples, weighted by a
triangle; held inputs and torques that run linearly between samples have such means too. So nothing is late,
and the factors c are found by Bayesian regression, one reading at a time:

| symbol | name here | what it is |
| --- | --- | --- |
| F | ``stages`` | three equal low-passes, one after the other |
| cⱼ | ``slow`` | factors, in deviations of the deck; c₀ is an offset of the drive |
| P | ``covariance`` | of their errors |
| r² | ``noise`` | torque that no factor explains: rounding, and a share of the torque |
| λ | ``unrest`` | factor on it, from residuals that stay larger than expected |
| ln B | ``evidence`` | for factors, against an exact deck with an offset |

- What no factor explains comes again with the motion, as the rounding of the encoder does. So a reading
  counts only as one of many over the correlation time, and a reading at standstill does not count.
- Where residuals stay larger than expected, something acts that is none of the factors. What was learned then
  fades, and the torque goes back to that of the cascade.
- A residual beyond three deviations teaches the less the larger it is, and makes the less unrest: a jump of
  the encoder is no news.
- With a weight that grows with ln B from 0 to 1 the factors correct the torque. Where the numbers of the
  deck explain the readings as well, the torque is that of the cascade, so an exact deck costs nothing.
- The correction is held within stated deviations of the deck.
"""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.symbolic import Expression
from ....model import Table, Variable
from ....model.flat import stated_equations
from ..scheduling.scheduled import ObserverDesign
from .balance import DRIVE, DRY, OFFSET, RELAXING, REST, VISCOUS, Balance

BANDWIDTH, OF_SAMPLING = 40.0, 0.04
"""Cut-off of each low-pass in Hz, and its largest share of the sample rate."""
UNMODELLED, FLOOR = 0.03, 0.006
"""Torque that the terms miss, as a share of that of the moment, and of that of the duty."""
CORRELATION, DRIFT = 0.08, 60.0
"""Seconds over which it stays the same, and of motion after which nothing that was learned is left."""
SURPRISE, REACH = 3.0, 3.5
"""Deviations of a residual from which on it teaches less, and of the torque within which it is held."""
RISE, FALL, LARGEST_INFLATION = 0.3, 1.0, 1e4
"""Seconds in which residuals raise and lower the noise that is reckoned with, and the largest factor."""
RESTLESS, QUICKEST = 100.0, 0.02
"""How much faster what was learned fades per unit of unrest, and the largest share of it in one sample."""
EVIDENCE_TIME, DECIDED = 5.0, 30.0
"""Seconds after which evidence is forgotten, and how much is kept at most (a natural logarithm)."""


class CorrectionEquations:
    """Writes the equations around those of the cascade."""

    def __init__(
        self, cascade: ObserverDesign, balance: Balance, *, rounding: float, limit: tuple[float, float] | None
    ) -> None:
        self.cascade, self.model, self.balance = cascade, cascade.model, balance
        self.time = cascade.step.sample_time
        self.passed = 1.0 - math.exp(-2.0 * math.pi * min(BANDWIDTH * self.time, OF_SAMPLING))
        self.floor = math.hypot(
            FLOOR * balance.torque, balance.inertia * rounding * bend_gain(self.passed, self.time)
        )
        self.limit, self.count = limit, len(balance.terms)
        self.estimate, self.angle = cascade.step.plant.estimate, self.model.inputs[0]
        self.table = with_rest(cascade)
        self.w = ca.SX.sym("w", len(self.table.columns))
        self.memory = ca.SX.sym("memory", len(self.model.states))
        self.stages = [ca.SX.sym(f"stages_{i}", 3) for i in range(4)]
        self.slow, self.packed = ca.SX.sym("slow", self.count), ca.SX.sym("packed", len(pairs(self.count)))
        # Offset of the drive if the deck is exact, its variance, unrest, evidence, torque that may miss.
        self.others = ca.SX.sym("others", 5)
        self.u = ca.SX.sym("u", len(self.model.inputs))
        self.state = ca.vertcat(self.memory, *self.stages, self.slow, self.packed, self.others)

    # --- terms ------------------------------------------------------------------------------------------

    def signals(self, torque: Expression) -> list[Expression]:
        """Return what passes the low-pass: angle, input, torque at rest and what relaxes."""
        rest = self.w[-1]
        return [self.u[0], self.u[1 + self.balance.place], rest, torque - rest]

    def low_passed(self, signals: list[Expression]) -> list[tuple[Expression, Expression, Expression]]:
        """Return the three stages of each signal after this sample."""
        after = []
        for signal, stages in zip(signals, self.stages, strict=True):
            chain, into = [], signal
            for i in range(3):
                into = stages[i] + self.passed * (into - stages[i])
                chain.append(into)
            after.append((chain[0], chain[1], chain[2]))
        return after

    def residual_of(
        self, after: list[tuple[Expression, Expression, Expression]]
    ) -> tuple[Expression, Expression, Expression, Expression]:
        """Return residual of the balance, its terms, torque of the spring, and how far the actuator moves."""
        b, share = self.balance, self.passed / (1.0 - self.passed)

        def steps(i: int) -> tuple[Expression, Expression]:
            """Return the change of a filtered signal over this sample and over the one before."""
            _, second, last = (self.stages[i][k] for k in range(3))
            return self.passed * (after[i][1] - last), share * (second - last)

        forward, backward = steps(0)
        bend = (forward - backward) * (b.inertia / self.time**2)
        speed = (forward + backward) * (0.5 / self.time)
        torques = [self.stages[i][2] + (new - old) * (1.0 / 6.0) for i in (2, 3) for new, old in (steps(i),)]
        length = speed**2 + b.width**2
        terms = {
            DRIVE: b.drive * (self.stages[1][2] - 0.5 * steps(1)[1]), REST: -torques[0],
            RELAXING: -torques[1],
            VISCOUS: -b.viscous * speed, DRY: -b.dry * speed / ca.sqrt(length), OFFSET: ca.SX(1),
        }  # fmt: skip
        residual = bend - sum(v for k, v in terms.items() if k != OFFSET)
        scaled = ca.vertcat(*[d * terms[k] for k, d in zip(b.terms, b.deviations, strict=True)])
        return residual, scaled, torques[0], speed**2 / length

    # --- regression -------------------------------------------------------------------------------------

    def sample(self) -> ca.Function:
        """Return one sample as the equations of a discrete flat model."""
        follow = self.model.equations(ca.SX(0), self.memory, self.u, ca.SX(0, 1), self.w[:-1])
        signals = self.signals(follow[1][0])
        after = self.low_passed(signals)
        residual, terms, rest, moving = self.residual_of(after)
        slow, packed, others = self.learned(residual, terms, rest, moving)
        weight = 0.5 + 0.5 * others[3] / ca.sqrt(1.0 + others[3] ** 2)
        estimate, deviation = self.corrected(signals, slow, packed, weight)
        states = [follow[0], *(ca.vertcat(*chain) for chain in after), slow, packed, others]
        outputs = [estimate, deviation, follow[1][1:], slow, weight, others[2]]
        carried, shown = ca.cse([ca.densify(ca.vertcat(*states)), ca.densify(ca.vertcat(*outputs))])
        return stated_equations(self.state, self.u, derivative=carried, output=shown, table=self.w)

    def learned(
        self, residual: Expression, terms: Expression, rest: Expression, moving: Expression
    ) -> tuple[Expression, Expression, Expression]:
        """Return factors, their packed covariance and the other slow states after one reading."""
        offset, variance, unrest, evidence, missing = (self.others[i] for i in range(5))
        covariance = unpacked(self.packed, self.count)
        seen = ca.mtimes(covariance, terms)
        own, innovation = ca.dot(terms, seen), residual - ca.dot(terms, self.slow)
        noise = unrest * (self.floor**2 + (UNMODELLED * rest) ** 2) + missing**2
        # As many readings as lie within the correlation time count as one; at standstill none counts.
        carried = noise * (2.0 * CORRELATION / self.time) / (moving + 1e-6)
        total = own + carried
        nis = innovation**2 / (own + noise)
        heard = SURPRISE**2 / ca.fmax(nis, SURPRISE**2)
        gain = seen * (heard / total)
        # Where something acts that no factor explains, what was learned fades the faster the larger it is.
        drift = 1.0 - math.exp(-2.0 * self.time / DRIFT)
        faded = moving * ca.fmin(drift * (1.0 - RESTLESS) + drift * RESTLESS * unrest, QUICKEST)
        slow = (self.slow + gain * innovation) * (1.0 - 0.5 * faded)
        prior = upper(ca.SX(ca.DM(self.balance.correlation)))
        after = (self.packed - upper(ca.mtimes(gain, seen.T))) * (1.0 - faded) + faded * prior
        # The same readings of a machine that is exactly the deck's, but for an offset of its drive.
        size = float(self.balance.deviations[-1])
        other, alone = residual - size * offset, size**2 * variance + carried
        share = heard * size * variance / alone
        ratio = (total - alone) / alone
        news = other**2 / alone - innovation**2 / total - ratio * (6.0 + ratio) / (6.0 + 4.0 * ratio)
        forgotten = (1.0 - self.time / EVIDENCE_TIME) * evidence
        # A reading that does not move, as of a frozen encoder, says nothing of what the machine is, and the
        # jumps around it no more than any other residual that is far too large.
        excess = moving * heard * (ca.fmin(nis, SURPRISE**2) - 1.0) * self.time
        grown = unrest * (1.0 + ca.fmax(excess * (1.0 / RISE), excess * (1.0 / FALL)))
        return slow, after, ca.vertcat(
            offset + share * other,
            variance * (1.0 - share * size) * (1.0 - faded) + faded,
            ca.fmin(ca.fmax(grown, 1.0), LARGEST_INFLATION),
            ca.fmin(ca.fmax(forgotten + 0.5 * heard * news, -DECIDED), DECIDED),
            self.missing_torque(missing),
        )  # fmt: skip

    def missing_torque(self, before: Expression) -> Expression:
        """Return the torque that a drive near its limit may not give, as it fades with the low-pass.

        Of an input at the declared limit half of what lies beyond the safe one is missing on average over a
        normal limit, below that the share falls with the distance.
        """
        faded = (1.0 - self.passed / 2.0) * before
        if self.limit is None:
            return ca.SX(faded)
        safe, declared = self.limit
        beyond = ca.fmax(ca.fabs(self.u[1 + self.balance.place]) - safe, 0.0)
        share = ca.fmin(beyond * (0.5 / (declared - safe)), 1.0) if declared > safe else 1.0
        return ca.fmax(abs(self.balance.drive) * beyond * share, faded)

    def corrected(
        self, signals: list[Expression], slow: Expression, packed: Expression, weight: Expression
    ) -> tuple[Expression, Expression]:
        """Return the corrected torque, and the standard deviation that is expected of it."""
        b, (rest, relaxing) = self.balance, signals[2:]
        factors = [d * slow[k] for k, d in enumerate(b.deviations)]
        # Three terms of the series rise everywhere; what lies far off is held by the reach.
        logarithms = ca.vertcat(*[c * (1.0 - c * (0.5 - c * (1.0 / 3.0))) for c in factors])
        estimate = rest + relaxing
        for part, row, alone in zip((rest, relaxing), b.slopes, b.alone, strict=True):
            if alone > 0.0:
                scale = ca.fmin(ca.fmax(ca.dot(ca.DM(row), logarithms), -REACH * alone), REACH * alone)
                estimate += weight * part * (scale * (1.0 + scale * (0.5 + scale * (1.0 / 6.0))))
        slopes = ca.mtimes(ca.DM(np.diag(b.deviations) @ b.slopes.T), ca.vertcat(rest, relaxing))
        both = ca.vertcat(rest, relaxing)
        variance = square(packed, slopes) + square(upper(ca.SX(ca.DM(b.unseen))), both)
        return estimate, ca.sqrt(ca.fmax(variance, 0.0) + b.missed**2)

    # --- begin ------------------------------------------------------------------------------------------

    def begin(self) -> ca.Function:
        """Return the states at the first reading, and after a gap; what was learned stays."""
        assert self.model.begin is not None
        arguments = [self.memory, self.u, ca.SX(0, 1), self.w[:-1]]
        begun, resumed = self.model.begin(*arguments)
        rest = self.w[-1]
        fresh = ca.vertcat(
            *[ca.repmat(each, 3) for each in (self.u[0], rest / self.balance.drive, rest, ca.SX(0))]
        )
        # Until the low-pass has forgotten that nothing is known of what was before, nothing is learned.
        learned = ca.vertcat(self.slow, self.packed, self.others[:4], self.balance.torque)
        return ca.Function(
            "begin", [self.state, self.u, ca.SX(0, 1), self.w],
            [ca.densify(ca.vertcat(begun, fresh, learned)), ca.densify(ca.vertcat(resumed, fresh, learned))],
        )  # fmt: skip

    def expected(self) -> ca.Function:
        """Return what is expected of each input, as the cascade does."""
        assert self.model.expected is not None
        arguments = [self.memory, self.u, ca.SX(0, 1), self.w[:-1]]
        return ca.Function(
            "expected", [self.state, self.u, ca.SX(0, 1), self.w], [self.model.expected(*arguments)]
        )


def rest_torque(cascade: ObserverDesign, angles: Array) -> Array:
    """Return the torque at rest, as the cascade estimates it."""
    plant = cascade.step.plant
    c = plant.at(angles)
    result: Array = (
        np.einsum("aj,aj->a", c.estimate[:, :-1], plant.rest(angles) - c.shift) + c.estimate[:, -1]
    )
    return result


def with_rest(cascade: ObserverDesign) -> Table:
    """Return the table of the cascade with the torque at rest as its last column."""
    plant, angles = cascade.step.plant, cascade.compact.angles
    v = plant.estimate
    column = Variable(f"{v.name}.at_rest", v.unit, f"{v.name} when everything has relaxed")
    own, rest = cascade.compact.table(plant.angle), rest_torque(cascade, angles)[:, None]
    if own is None:
        return Table.over(plant.angle, angles, (column,), rest)
    return replace(own, columns=(*own.columns, column), values=np.hstack([own.values, rest]))


def bend_gain(passed: float, time: float) -> float:
    """Return the deviation of the filtered second difference of white noise, in 1/s², per deviation."""
    response, stages = [], [0.0, 0.0, 0.0]
    for k in range(round(40.0 / passed)):
        into = 1.0 if k == 0 else 0.0
        for i in range(3):
            stages[i] += passed * (into - stages[i])
            into = stages[i]
        response.append(into)
    bend = np.diff(response, 2, prepend=0.0, append=0.0) / time**2
    return float(np.linalg.norm(bend))


def pairs(size: int) -> list[tuple[int, int]]:
    """Return the places of the upper triangle of a matrix, row by row."""
    return [(i, j) for i in range(size) for j in range(i, size)]


def square(packed: Expression, vector: Expression) -> Expression:
    """Return vᵀ·M·v of a symmetric matrix that is packed."""
    total = ca.SX(0)
    rows: dict[int, Expression] = {}
    for place, (i, j) in enumerate(pairs(vector.shape[0])):
        rows[i] = rows.get(i, 0) + packed[place] * vector[j] * (1.0 if i == j else 2.0)
    for i, row in rows.items():
        total += vector[i] * row
    return total


def upper(matrix: Expression) -> Expression:
    """Return the upper triangle of a matrix, row by row."""
    return ca.SX(ca.vertcat(*[matrix[i, j] for i, j in pairs(matrix.shape[0])]))


def unpacked(packed: Expression, size: int) -> Expression:
    """Return the symmetric matrix of an upper triangle."""
    matrix = ca.SX(size, size)
    for k, (i, j) in enumerate(pairs(size)):
        matrix[i, j] = matrix[j, i] = packed[k]
    return matrix
