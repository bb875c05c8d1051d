"""Efforts that hold a rate at zero, which follow from the motion of all else; and the switches of a model.

The acceleration v̇ of each rate that can be held is linear in all holding efforts λ: v̇ = A·λ + b. A rate that
is held gives the row v̇ = 0, one that is not held the row λ = (effort while moving). The modes stay symbols
here: what follows from them is put in at the end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ..components.core.element import StictionConstraint
from ..foundation.errors import ArrangementError
from ..foundation.symbolic import Expression, depends
from .equation_builder import EquationBuilder
from .flat import Switch, Switching

_SMOOTH = "take the smooth form of the law: smoothed(assembly)"


@dataclass(frozen=True)
class Laws:
    """The laws of the switches of a builder, in the symbols of the model and of the modes.

    ``reach`` holds one row of holding efforts for each state by name.
    """

    switches: tuple[Switch, ...]
    modes: tuple[Expression, ...]
    lasts: tuple[Expression, ...]
    first: tuple[Expression, ...]
    stays: tuple[Expression, ...]
    leads: tuple[Expression, ...]
    rates: tuple[Expression, ...]
    rebounds: tuple[Expression, ...]
    reach: Mapping[str, Sequence[Expression]]

    def columns(self) -> list[list[Expression]]:
        """Return all expressions, group by group."""
        groups = (self.lasts, self.first, self.stays, self.leads, self.rates, self.rebounds)
        return [*(list(group) for group in groups), *(list(row) for row in self.reach.values())]

    def with_columns(self, groups: Sequence[Sequence[Expression]]) -> Laws:
        """Return a copy with other expressions, in the groups of :meth:`columns`."""
        lasts, first, stays, leads, rates, rebounds = (tuple(group) for group in groups[:6])
        reach = dict(zip(self.reach, groups[6:], strict=True))
        return Laws(self.switches, self.modes, lasts, first, stays, leads, rates, rebounds, reach)


def switch_laws(builder: EquationBuilder) -> Laws:
    """Solve for all holding efforts, note them in the builder and return the laws of the switches."""
    constraints = _merged(builder)
    reach = _solved(builder, constraints) if constraints else {name: () for name in builder.derivatives}
    others = (*builder.jumps, *builder.kinks)
    kink_modes = [ca.SX.sym(f"{c.name}.mode") for c in builder.kinks]
    modes = (*(h.mode for h in constraints), *(s.mode for s in builder.jumps), *kink_modes)
    none = tuple(ca.SX(0) for _ in others)
    switches = [Switch(h.name, h.words, True) for h in constraints]
    switches += [Switch(s.name, ((1, s.above), (-1, s.below)), s in builder.jumps) for s in others]
    lasts = [ca.if_else(h.mode == 0, h.stays, h.lands) for h in constraints]
    lasts += [m * s.value for m, s in zip(modes[len(constraints) :], others, strict=True)]
    first = [*(h.first for h in constraints), *(ca.if_else(s.value >= 0, 1, -1) for s in others)]
    return Laws(
        tuple(switches), modes, tuple(lasts), tuple(first),
        (*(h.stays for h in constraints), *(ca.SX(1) for _ in others)),
        (*(h.leads for h in constraints), *none),
        (*(h.rate for h in constraints), *none), (*(h.rebound for h in constraints), *none),
        {name: (*row, *none) for name, row in reach.items()},
    )  # fmt: skip


def _merged(builder: EquationBuilder) -> list[StictionConstraint]:
    """Return the constraints with those of dry friction on the same rate made one; each gets its share."""
    merged: list[StictionConstraint] = []
    for constraint in builder.constraints:
        rate = builder.cleaned(constraint.rate)
        same = [i for i, h in enumerate(merged) if ca.is_equal(ca.simplify(h.rate - rate), ca.SX(0), 2)]
        if not same or constraint.level is None or merged[same[0]].level is None:
            merged.append(replace(constraint, rate=rate))
            continue
        first, more = merged[same[0]], constraint.level
        before = first.level if first.level is not None else ca.SX(0)
        moving = ca.substitute(constraint.moving, constraint.mode, first.mode)
        whole = ca.SX.sym(f"{first.name}.all")
        level = before + more
        share = ca.if_else(level > 0, before / ca.if_else(level > 0, level, 1), 0)
        own = ca.if_else(first.mode == 0, whole * share, first.moving)
        builder.define(first.effort, own)
        # So the sum is that of both whether they stick or not.
        builder.define(constraint.effort, whole - own)
        builder.define(constraint.mode, first.mode)
        merged[same[0]] = replace(
            first, name=f"{first.name}+{constraint.name}", effort=whole, moving=first.moving + moving,
            stays=level - ca.fabs(whole), leads=ca.if_else(whole >= 0, 1, -1), level=level,
        )  # fmt: skip
    return merged


def _solved(
    builder: EquationBuilder, constraints: Sequence[StictionConstraint]
) -> dict[str, list[Expression]]:
    efforts = ca.vertcat(*[h.effort for h in constraints])
    cleaned = ca.vertsplit(builder.cleaned(ca.vertcat(*builder.derivatives.values())))
    rates = dict(zip(builder.derivatives, cleaned, strict=True))
    for constraint in constraints:
        known = {
            e.element_hash()
            for group in (builder.states, builder.inputs, builder.parameters)
            for _, e in group.values()
        }
        known |= {s.mode.element_hash() for s in builder.jumps}
        inside = [s.element_hash() for s in ca.symvar(constraint.rate)]
        if not inside or not known.issuperset(inside):
            raise ArrangementError(
                constraint.name, "its rate is itself an unknown, as in series with another element",
                next_step=f"tie it directly between two bodies, or {_SMOOTH}",
            )  # fmt: skip
    accelerations = ca.vertcat(*[_acceleration(builder, h.rate, rates) for h in constraints])
    matrix = ca.jacobian(accelerations, efforts)
    moving = builder.cleaned(ca.vertcat(*[h.moving for h in constraints]))
    _check_linear(constraints, matrix, moving, efforts)
    free = ca.substitute(accelerations, efforts, ca.SX.zeros(efforts.shape))
    unit = ca.SX.eye(len(constraints))
    rows = [
        ca.if_else(h.mode == 0, ca.densify(matrix[i, :]), ca.densify(unit[i, :]))
        for i, h in enumerate(constraints)
    ]
    right = [ca.if_else(h.mode == 0, -free[i], moving[i]) for i, h in enumerate(constraints)]
    efforts_held = right[0] / rows[0] if len(constraints) == 1 else _eliminated(rows, right)
    for constraint, solution in zip(constraints, ca.vertsplit(efforts_held), strict=True):
        builder.define(constraint.effort, solution)
    for constraint in constraints:
        _hold_exactly(builder, constraint, rates)
    return {name: ca.horzsplit(ca.densify(ca.jacobian(rate, efforts))) for name, rate in rates.items()}


def _eliminated(rows: list[Expression], right: list[Expression]) -> Expression:
    """Solve without exchanging rows: inertia makes the matrix of the held ones definite."""
    rows, right, count = list(rows), list(right), len(rows)
    for i in range(count):
        for k in range(i + 1, count):
            factor = rows[k][i] / rows[i][i]
            rows[k], right[k] = rows[k] - factor * rows[i], right[k] - factor * right[i]
    solution: dict[int, Expression] = {}
    for i in reversed(range(count)):
        rest = sum((rows[i][k] * solution[k] for k in range(i + 1, count)), start=ca.SX(0))
        solution[i] = (right[i] - rest) / rows[i][i]
    return ca.vertcat(*[solution[i] for i in range(count)])


def _acceleration(builder: EquationBuilder, rate: Expression, rates: Mapping[str, Expression]) -> Expression:
    """Return the time derivative of a rate; what moves a driven body gets its acceleration as an input."""
    acceleration = ca.SX(0)
    for name, (_, state) in builder.states.items():
        if depends(rate, state):
            acceleration += ca.jacobian(rate, state) * rates[name]
    for name, (variable, symbol) in list(builder.inputs.items()):
        if depends(rate, symbol):
            acceleration += ca.jacobian(rate, symbol) * builder.rate_of_input(name, variable)
    return acceleration


def _check_linear(
    constraints: Sequence[StictionConstraint], matrix: Expression, moving: Expression, efforts: Expression
) -> None:
    names = " and ".join(f"'{h.name}'" for h in constraints)
    if depends(matrix, efforts) or depends(moving, efforts):
        raise ArrangementError(
            names,
            "what it takes to hold is not linear: a load contains another dry friction, or a gear loses",
            next_step=_SMOOTH,
        )
    draw = np.random.default_rng(1)
    modes = ca.vertcat(*[h.mode for h in constraints])
    matrix = ca.SX(ca.substitute(matrix, modes, ca.SX.zeros(modes.shape)))
    symbols = ca.symvar(matrix)
    numbers = ca.Function("numbers", symbols, [matrix]).call(
        [float(v) for v in draw.uniform(0.5, 1.5, len(symbols))]
    )
    inertia_matrix = np.array(ca.DM(numbers[0]))
    for i, constraint in enumerate(constraints):
        if not inertia_matrix[i, i]:
            raise ArrangementError(
                constraint.name,
                "nothing with inertia can be held by it",
                next_step="tie it to a body that moves",
            )
    scale = np.sqrt(np.abs(np.diag(inertia_matrix)))
    if np.linalg.svd(inertia_matrix / np.outer(scale, scale), compute_uv=False)[-1] < 1e-9:
        raise ArrangementError(
            names, "hold the same motion in two ways, so the share of each is not defined",
            next_step="tie dry frictions between the same bodies in the same order, use an elastic stop, "
            f"or {_SMOOTH}",
        )  # fmt: skip


def _hold_exactly(
    builder: EquationBuilder, constraint: StictionConstraint, rates: Mapping[str, Expression]
) -> None:
    """While held, let the first state in the rate follow the others, so that no rounding moves it."""
    inside = [n for n, (_, s) in builder.states.items() if depends(constraint.rate, s)]
    slopes = {n: ca.jacobian(constraint.rate, builder.states[n][1]) for n in inside}
    if not inside or any(ca.symvar(slope) for slope in slopes.values()):
        return
    first = inside[0]
    rest = _acceleration(builder, constraint.rate, dict(builder.derivatives) | {first: ca.SX(0)})
    builder.derivatives[first] = ca.if_else(
        constraint.mode == 0, -rest / slopes[first], builder.derivatives[first]
    )


def natural_modes(laws: Laws) -> Expression:
    """Return the modes at a state as expressions without modes, a column."""
    modes = ca.vertcat(*laws.modes) if laws.modes else ca.SX(0, 1)
    natural = ca.vertcat(*laws.first) if laws.first else ca.SX(0, 1)
    for _ in laws.modes:
        if not depends(natural, modes):
            break
        natural = ca.SX(ca.substitute(natural, modes, natural))
    if depends(natural, modes):
        names = ", ".join(s.name for s in laws.switches)
        raise ArrangementError(names, "on which side it is depends on itself", next_step=_SMOOTH)
    for _ in range(sum(not s.is_zero() for s in laws.rates)):
        at = ca.substitute(ca.vertcat(*laws.stays, *laws.leads), modes, natural)
        stays, leads = at[: len(laws.modes)], at[len(laws.modes) :]
        natural = ca.if_else(ca.logic_and(natural == 0, stays < 0), leads, natural)
    return ca.SX(natural)


def switching(
    laws: Laws, columns: Sequence[Expression], rows: Sequence[Sequence[Expression]], states: Sequence[str]
) -> Switching:
    """Return the functions of the switches."""
    modes, given = ca.vertcat(*laws.modes), [ca.SX(c) for c in columns[:4]]
    slope = ca.densify(ca.jacobian(ca.vertcat(*laws.rates), given[1]))
    reach = ca.vertcat(*[ca.horzcat(*laws.reach[n]) for n in states])
    branch = [ca.SX(ca.densify(ca.vertcat(*row))) for row in (rows[0], laws.lasts, laws.rates)]
    landing = [*(ca.SX(ca.vertcat(*g)) for g in (laws.rates, laws.rebounds, laws.leads)), reach, slope]
    return Switching(
        laws.switches,
        ca.Function("branch", [*given, modes], ca.cse(branch)),
        ca.Function("natural", given, [ca.densify(natural_modes(laws))]),
        ca.Function("landing", [*given, modes], ca.cse([ca.densify(e) for e in landing])),
        tuple(not rate.is_zero() for rate in laws.rates),
        ca.Function("shown", [*given, modes], [ca.SX(ca.densify(ca.vertcat(*row))) for row in rows[1:3]]),
    )
