"""The cascade, whose torque is corrected by what the balance of the driven body shows: the default observer.

The cascade runs as it is, at the numbers of the deck: no slow state acts on its inner states, so they decay
whatever is learned. Beside it all terms of the balance (:mod:`~nlsdesign.feedback.observer.adaptive.balance`)
pass one low-pass, with the second difference of the angle on the other side,

    e = F[J·Δ²θ/T² − Σ φⱼ] = Σ cⱼ·F[φⱼ] + c₀.

The second difference of an angle is exactly the mean of the acceleration over two samples, weighted by a
triangle; held inputs and torques that run linearly between samples have such means too. So nothing is late, and
the factors c are found by Bayesian regression, one reading at a time:

| symbol | name here | what it is |
| --- | --- | --- |
| F | ``stages`` | three equal low-passes, one after the other |
| cⱼ | ``slow`` | factors, in standard deviations of the deck; c₀ is an offset of the drive |
| P | ``covariance`` | of their errors |
| r² | ``noise`` | torque that no factor explains: rounding, a share of the torque, all that friction may hold |
| λ | ``unrest`` | factor on it, from residuals that stay larger than expected |
| ln B | ``evidence`` | for factors against an exact deck with an offset, over the last seconds |

- What no factor explains comes again with the motion, as the rounding of the encoder does. So a reading counts only
  as one of many over the correlation time, and a reading at standstill does not count.
- A residual beyond three deviations teaches the less the larger it is: a jump of the encoder is no news.
- With weight 1/(1 + 1/B) the factors correct the torque. Where the numbers of the deck explain the readings as well,
  the torque is that of the cascade, so an exact deck costs nothing.
- The correction is held within stated deviations of the deck.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ....foundation.quantity import typeset_unit
from ....foundation.symbolic import Expression
from ....foundation.written_numbers import prefixed
from ....model import FlatModel, Table, Variable
from ....model.roles import measured_motion, spring_torque
from ....simulation.prior import declared_prior
from ..scheduling.angle_form import minimal_form
from ..scheduling.scheduled import MEMORY, ObserverDesign, design_observer_with_details, whole_contour
from ..scheduling.step import ObserverStep
from ..scheduling.table import Compact, Grid
from .adaptive_observer import DEVIATION, INFLATION, LOW_PASS, SPREAD, encoder_quantum, safe_inputs
from .balance import DRIVE, DRY, OFFSET, RELAXING, REST, TERMS, VISCOUS, Balance, balance_of
from .duty_and_directions import AdaptiveSettings
from .filter_equations import pairs

AT_REST, WEIGHT, EVIDENCE = "at_rest", "weight", "evidence"
"""Endings of the name of the estimate: its part at rest, and how far and why the factors correct it."""
BANDWIDTH, OF_SAMPLING = 40.0, 0.04
"""Cut-off of each low-pass in Hz, and its largest share of the sample rate."""
UNMODELLED, FLOOR = 0.02, 0.004
"""Torque that the terms miss, as a share of the torque of the moment, and of that of the duty."""
CORRELATION, DRIFT = 0.05, 60.0
"""Seconds over which it stays the same, and of motion after which a machine may lie anywhere in its spreads."""
SURPRISE, REACH = 3.0, 3.5
"""Deviations of a residual from which on it teaches less, and of the torque's scale within which it is held."""
INFLATION_TIME, LARGEST_INFLATION = 1.0, 1e4
"""Seconds in which residuals raise the noise that is reckoned with, and the largest factor on its variance."""
EVIDENCE_TIME, DECIDED = 5.0, 30.0
"""Seconds after which evidence is forgotten, and how much is kept at most (a natural logarithm)."""
LEAST, MOST = -0.5, 0.9
"""Range of a factor in which its logarithm is taken, by three terms of the series."""


class _Correction:
    """Writes the equations around those of the cascade."""

    def __init__(
        self, cascade: ObserverDesign, balance: Balance, *, rounding: float, limit: tuple[float, float] | None
    ) -> None:
        self.cascade, self.model, self.balance = cascade, cascade.model, balance
        self.time = cascade.step.sample_time
        self.passed = 1.0 - math.exp(-2.0 * math.pi * min(BANDWIDTH * self.time, OF_SAMPLING))
        self.floor = math.hypot(FLOOR * balance.torque, balance.inertia * rounding * _bend_gain(self.passed, self.time))
        self.limit, self.count = limit, len(balance.terms)
        self.estimate, self.angle = cascade.step.plant.estimate, self.model.inputs[0]
        self.table = _with_rest(cascade)
        self.w = ca.SX.sym("w", len(self.table.columns))
        self.memory = ca.SX.sym("memory", len(self.model.states))
        self.stages = [ca.SX.sym(f"stages_{i}", 3) for i in range(4)]
        self.slow, self.packed = ca.SX.sym("slow", self.count), ca.SX.sym("packed", len(pairs(self.count)))
        # Offset of the drive with an exact deck, its variance, unrest, evidence, torque that the drive may not give.
        self.others = ca.SX.sym("others", 5)
        self.u = ca.SX.sym("u", len(self.model.inputs))
        self.state = ca.vertcat(self.memory, *self.stages, self.slow, self.packed, self.others)

    # --- terms ------------------------------------------------------------------------------------------

    def _signals(self, torque: Expression) -> list[Expression]:
        """Return what passes the low-pass: angle, input, torque at rest and what relaxes."""
        rest = self.w[-1]
        return [self.u[0], self.u[1 + self.balance.place], rest, torque - rest]

    def _passed(self, signals: list[Expression]) -> list[tuple[Expression, Expression, Expression]]:
        """Return the three stages of each signal after this sample."""
        after = []
        for signal, stages in zip(signals, self.stages, strict=True):
            chain, into = [], signal
            for i in range(3):
                into = stages[i] + self.passed * (into - stages[i])
                chain.append(into)
            after.append((chain[0], chain[1], chain[2]))
        return after

    def _residual(
        self, after: list[tuple[Expression, Expression, Expression]]
    ) -> tuple[Expression, Expression, Expression, Expression]:
        """Return residual of the balance, its terms, torque of the spring, and how far the actuator moves."""
        b, share = self.balance, self.passed / (1.0 - self.passed)

        def steps(i: int) -> tuple[Expression, Expression]:
            """The change of a filtered signal over this sample and over the one before."""
            return self.passed * (after[i][1] - self.stages[i][2]), share * (self.stages[i][1] - self.stages[i][2])

        forward, backward = steps(0)
        bend, speed = (forward - backward) / self.time**2, (forward + backward) / (2.0 * self.time)
        torques = [self.stages[i][2] + (new - old) / 6.0 for i in (2, 3) for new, old in (steps(i),)]
        length = speed**2 + b.width**2
        terms = {
            DRIVE: b.drive * (self.stages[1][2] - steps(1)[1] / 2.0), REST: -torques[0], RELAXING: -torques[1],
            VISCOUS: -b.viscous * speed, DRY: -b.dry * speed / ca.sqrt(length), OFFSET: ca.SX(1),
        }  # fmt: skip
        residual = b.inertia * bend - sum(v for k, v in terms.items() if k != OFFSET)
        scaled = ca.vertcat(*[d * terms[k] for k, d in zip(b.terms, b.deviations, strict=True)])
        return residual, scaled, torques[0], speed**2 / length

    # --- regression -------------------------------------------------------------------------------------

    def sample(self) -> ca.Function:
        """Return one sample as the equations of a discrete flat model."""
        follow = self.model.equations(ca.SX(0), self.memory, self.u, ca.SX(0, 1), self.w[:-1])
        signals = self._signals(follow[1][0])
        after = self._passed(signals)
        residual, terms, rest, moving = self._residual(after)
        slow, covariance, others = self._learned(residual, terms, rest, moving)
        weight = 1.0 / (1.0 + ca.exp(-others[3]))
        estimate, deviation = self._estimate(signals, slow, covariance, weight)
        states = [follow[0], *(ca.vertcat(*chain) for chain in after), slow, _packed(covariance), others]
        outputs = [estimate, deviation, follow[1][1:], slow, weight, others[2]]
        results = ca.cse([ca.densify(ca.vertcat(*states)), ca.densify(ca.vertcat(*outputs))])
        return ca.Function(
            "equations", [ca.SX.sym("time"), self.state, self.u, ca.SX(0, 1), self.w],
            [*results, ca.SX(0, 1), ca.SX(0, 1)],
            ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
        )  # fmt: skip

    def _learned(
        self, residual: Expression, terms: Expression, rest: Expression, moving: Expression
    ) -> tuple[Expression, Expression, Expression]:
        """Return factors, their covariance and the other slow states after one reading."""
        offset, variance, unrest, evidence, missing = (self.others[i] for i in range(5))
        covariance = _unpacked(self.packed, self.count)
        seen = ca.mtimes(covariance, terms)
        own, innovation = ca.dot(terms, seen), residual - ca.dot(terms, self.slow)
        noise = unrest * (self.floor**2 + (UNMODELLED * rest) ** 2) + missing**2
        # As many readings as lie within the correlation time count as one; at standstill none counts.
        carried = noise * (2.0 * CORRELATION / self.time) / (moving + 1e-6)
        total = own + carried
        nis = innovation**2 / (own + noise)
        heard = ca.fmin(1.0, SURPRISE**2 / (nis + 1e-12))
        gain = seen * (heard / total)
        kept = moving * (1.0 - math.exp(-2.0 * self.time / DRIFT))
        slow = self.slow + gain * innovation
        after = (covariance - ca.mtimes(gain, seen.T)) * (1.0 - kept) + kept * ca.DM(self.balance.correlation)
        # The same readings of a machine that is exactly the deck's, but for an offset of its drive.
        size = float(self.balance.deviations[-1])
        other, alone = residual - size * offset, size**2 * variance + carried
        share = heard * size * variance / alone
        ratio = (total - alone) / alone
        news = other**2 / alone - innovation**2 / total - ratio * (6.0 + ratio) / (6.0 + 4.0 * ratio)
        forgotten = (1.0 - self.time / EVIDENCE_TIME) * evidence
        excess = ca.fmin(nis, SURPRISE**2) - 1.0
        return slow, after, ca.vertcat(
            offset + share * other,
            variance * (1.0 - share * size) * (1.0 - kept) + kept,
            ca.fmin(ca.fmax(unrest * (1.0 + self.time / INFLATION_TIME * excess), 1.0), LARGEST_INFLATION),
            ca.fmin(ca.fmax(forgotten + heard * news / 2.0, -DECIDED), DECIDED),
            self._missing(missing),
        )  # fmt: skip

    def _missing(self, before: Expression) -> Expression:
        """Return the torque that a drive near its limit may not give, in deviations of that limit, as it fades.

        Of an input at the declared limit half of what lies beyond the safe one is missing on average over a
        normal limit, below that the share falls with the distance.
        """
        faded = (1.0 - self.passed / 2.0) * before
        if self.limit is None:
            return ca.SX(faded)
        safe, declared = self.limit
        beyond = ca.fmax(ca.fabs(self.u[1 + self.balance.place]) - safe, 0.0)
        share = ca.fmin(0.5 * beyond / (declared - safe), 1.0) if declared > safe else 1.0
        return ca.fmax(abs(self.balance.drive) * beyond * share, faded)

    def _estimate(
        self, signals: list[Expression], slow: Expression, covariance: Expression, weight: Expression
    ) -> tuple[Expression, Expression]:
        """Return the corrected torque, and the standard deviation that is expected of it."""
        b, (rest, relaxing) = self.balance, signals[2:]
        factors = [ca.fmin(ca.fmax(d * slow[k], LEAST), MOST) for k, d in enumerate(b.deviations)]
        logarithms = ca.vertcat(*[c - c**2 / 2.0 + c**3 / 3.0 for c in factors])
        estimate = rest + relaxing
        for part, row, alone in zip((rest, relaxing), b.slopes, b.alone, strict=True):
            if alone > 0.0:
                scale = ca.fmin(ca.fmax(ca.dot(ca.DM(row), logarithms), -REACH * alone), REACH * alone)
                estimate += weight * part * (scale + scale**2 / 2.0 + scale**3 / 6.0)
        slopes = ca.mtimes(ca.DM(np.diag(b.deviations) @ b.slopes.T), ca.vertcat(rest, relaxing))
        both = ca.vertcat(rest, relaxing)
        variance = ca.dot(slopes, ca.mtimes(covariance, slopes)) + ca.dot(both, ca.mtimes(ca.DM(b.unseen), both))
        return estimate, ca.sqrt(ca.fmax(variance, 0.0) + b.missed**2)

    # --- begin ------------------------------------------------------------------------------------------

    def begin(self) -> ca.Function:
        """Return the states at the first reading, and after a gap; what was learned stays."""
        assert self.model.begin is not None
        arguments = [self.memory, self.u, ca.SX(0, 1), self.w[:-1]]
        begun, resumed = self.model.begin(*arguments)
        rest = self.w[-1]
        fresh = ca.vertcat(*[ca.repmat(each, 3) for each in (self.u[0], rest / self.balance.drive, rest, ca.SX(0))])
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

    # --- names ------------------------------------------------------------------------------------------

    def _slow(self) -> list[Variable]:
        words = [f"factor of {TERMS[k]}" for k in self.balance.terms]
        sizes = [f"one is {100.0 * d:.3g} %" for d in self.balance.deviations[:-1]]
        sizes.append(f"one is {self.balance.deviations[-1]:.3g} {typeset_unit(self.estimate.unit)}")
        return [
            Variable(f"{self.estimate.name}.{DEVIATION}[{k + 1}]", "1", f"{w} in standard deviations; {s}")
            for k, (w, s) in enumerate(zip(words, sizes, strict=True))
        ]

    def states(self) -> tuple[Variable, ...]:
        """Return what is carried on from sample to sample."""
        name, drive = self.estimate.name, self.model.inputs[1 + self.balance.place]
        rest = Variable(f"{name}.{AT_REST}", self.estimate.unit, "", nominal=self.balance.torque)
        filtered = (self.angle, drive, rest, replace(rest, name=f"{name}.relaxing"))
        states = list(self.model.states)
        for v in filtered:
            for k in range(3):
                words = f"{v.name} behind {k + 1} low-pass{'es' if k else ''}"
                states.append(Variable(f"{v.name}.{LOW_PASS}[{k + 1}]", v.unit, words, nominal=v.nominal))
        states += [replace(v, name=f"{v.name}.{MEMORY}") for v in self._slow()]
        for i, j in pairs(self.count):
            start = float(self.balance.correlation[i, j])
            words = f"covariance of the errors of factors {i + 1} and {j + 1}, in deviations"
            states.append(Variable(f"covariance[{i + 1},{j + 1}]", "1", words, start))
        states += [
            Variable(f"{name}.offset", "1", "offset of the drive if the deck is exact, in deviations"),
            Variable(f"{name}.offset.variance", "1", "variance of its error", 1.0),
            Variable(f"{name}.{INFLATION}.{MEMORY}", "1", "factor on the variance of what is not explained", 1.0),
            Variable(f"{name}.{EVIDENCE}", "1", "for factors against an exact deck, a natural logarithm"),
            Variable(f"{name}.missing", self.estimate.unit, "torque that a drive near its limit may not give"),
        ]
        return tuple(states)

    def outputs(self) -> tuple[Variable, ...]:
        """Return those of the cascade, with what is expected of the estimate and what was learned."""
        first, *rest = self.model.outputs
        name = first.name
        return (
            first,
            Variable(f"{name}.{SPREAD}", first.unit, "standard deviation that is expected of it"),
            *rest,
            *self._slow(),
            Variable(f"{name}.{WEIGHT}", "1", "share of the correction: 0 where the deck explains all, up to 1"),
            Variable(f"{name}.{INFLATION}", "1", "factor on the variance of what no factor explains; 1 at best"),
        )  # fmt: skip

    def flat(self) -> FlatModel:
        """Return the observer as a discrete flat model."""
        words = self.model.description.replace("observer of", "corrected observer of", 1)
        return replace(
            self.model,
            description=f"{words}, {self.count} factors learned from the balance of the drive",
            states=self.states(), outputs=self.outputs(), equations=self.sample(), tables=(self.table,),
            begin=self.begin(), expected=self.expected(),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CorrectedDesign:
    """A cascade with a correction of its torque, and what went into it.

    Parameters
    ----------
    model
        The observer: discrete, scheduled over one table.
    cascade
        The observer whose torque is corrected.
    balance
        Terms whose factors are learned, and what they tell of the torque.
    """

    model: FlatModel
    cascade: ObserverDesign
    balance: Balance

    @property
    def step(self) -> ObserverStep:
        """Step of the cascade as exact functions of the angle."""
        return self.cascade.step

    @property
    def compact(self) -> Compact:
        """Table of the cascade; that of :attr:`model` has the torque at rest besides."""
        return self.cascade.compact

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values of an observer that begins while the actuator rests at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        plant, at = self.step.plant, np.array([angle])
        rest = float(_rest_torque(self.cascade, at)[0])
        start = self.cascade.start(angle)
        for k in range(3):
            start[f"{plant.angle}.{LOW_PASS}[{k + 1}]"] = float(angle)
            start[f"{plant.estimate.name}.{AT_REST}.{LOW_PASS}[{k + 1}]"] = rest
        return start

    def __str__(self) -> str:
        balance, unit = self.balance, typeset_unit(self.step.plant.estimate.unit)
        lines = [f"{self.cascade}", "  corrected by factors of the balance of the drive, each with its deviation:"]
        lines += [f"    {TERMS[k]}: {100.0 * d:.3g} %" for k, d in zip(balance.terms[:-1], balance.deviations, strict=False)]
        lines.append(f"    {TERMS[OFFSET]}: {prefixed(float(balance.deviations[-1]), unit)}")
        return "\n".join([*lines, f"  changes of form, which no factor describes: {prefixed(balance.missed, unit, digits=2)}"])


def design_corrected_observer(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    settings: AdaptiveSettings | None = None,
    grid: Grid | None = None,
) -> CorrectedDesign:
    """Design a cascade whose torque is corrected by factors that the balance of the drive shows.

    Inputs and outputs are those of :func:`~nlsdesign.feedback.observer.design_observer`; added to the outputs are
    the standard deviation that is expected of the estimate, the factors, the weight of the correction, and how much
    larger than expected the unexplained torque is.

    Parameters
    ----------
    model
        Continuous, load fixed.
    estimate
        Output or signal that is wanted; by default the torque of the series spring.
    measured
        State that is measured; by default the motion of the driven body.
    sample_time
        In s.
    settings
        What is known, and what the actuator does; their trust is that of the adaptive observer.
    grid
        Range and number of grid points; the whole contour of the cam by default.

    Raises
    ------
    ArrangementError
        If no number of the deck is uncertain, no encoder of the angle is declared, something else than the
        spring moves the body at rest, or the equations cannot be scheduled over one angle.
    ValueRangeError
        If the model is discrete, the estimate is far from linear in the inner states, or a setting is out of
        range.
    ConvergenceError
        If the table does not keep its error bound.
    """
    settings = settings or AdaptiveSettings()
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    rounding = encoder_quantum(model, measured) / math.sqrt(12.0)
    cascade = design_observer_with_details(
        model, estimate=estimate, measured=measured, sample_time=sample_time, grid=grid
    )
    over = grid or whole_contour(model)
    form, _ = minimal_form(
        model, estimate=estimate, angle=measured, angles=np.linspace(over.lower, over.upper, 65)
    )
    prior = settings.prior or declared_prior(model)
    balance = balance_of(form, prior, settings.duty)
    drive = cascade.model.inputs[1 + balance.place]
    safe = safe_inputs(model, prior).get(drive.name)
    limit = None if safe is None or drive.maximum is None else (safe, drive.maximum)
    writer = _Correction(cascade, balance, rounding=rounding, limit=limit)
    design = CorrectedDesign(writer.flat(), cascade, balance)
    return replace(design, model=design.model.with_values(design.start(0.0)))


def _rest_torque(cascade: ObserverDesign, angles: Array) -> Array:
    """Return the torque at rest, as the cascade estimates it."""
    plant = cascade.step.plant
    c = plant.at(angles)
    result: Array = np.einsum("aj,aj->a", c.estimate[:, :-1], plant.rest(angles) - c.shift) + c.estimate[:, -1]
    return result


def _with_rest(cascade: ObserverDesign) -> Table:
    """Return the table of the cascade with the torque at rest as its last column."""
    plant, angles = cascade.step.plant, cascade.compact.angles
    v = plant.estimate
    column = Variable(f"{v.name}.{AT_REST}", v.unit, f"{v.name} when everything has relaxed")
    own, rest = cascade.compact.table(plant.angle), _rest_torque(cascade, angles)[:, None]
    if own is None:
        return Table.over(plant.angle, angles, (column,), rest)
    return replace(own, columns=(*own.columns, column), values=np.hstack([own.values, rest]))


def _bend_gain(passed: float, time: float) -> float:
    """Return the deviation of the filtered second difference of white noise, in 1/s², per deviation."""
    response, stages = [], [0.0, 0.0, 0.0]
    for k in range(round(40.0 / passed)):
        into = 1.0 if k == 0 else 0.0
        for i in range(3):
            stages[i] += passed * (into - stages[i])
            into = stages[i]
        response.append(into)
    bend = np.diff(response, 2, prepend=0.0, append=0.0) / time**2
    if not np.all(np.isfinite(bend)):
        raise ConvergenceError("low-pass of the balance", "does not stay finite")
    return float(np.linalg.norm(bend))


def _packed(matrix: Expression) -> Expression:
    return ca.SX(ca.vertcat(*[matrix[i, j] for i, j in pairs(matrix.shape[0])]))


def _unpacked(packed: Expression, size: int) -> Expression:
    matrix = ca.SX(size, size)
    for k, (i, j) in enumerate(pairs(size)):
        matrix[i, j] = matrix[j, i] = packed[k]
    return matrix
