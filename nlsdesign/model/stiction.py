"""Efforts that hold a rate at zero, found from the motion of everything else; and the switches of a model.

The acceleration v̇ of each rate that can be held is linear in all holding efforts λ: v̇ = A·λ + b. A rate that
is held gives the row v̇ = 0, one that is not held the row λ = (effort while moving). The modes stay symbols
here: what follows from them is put in at the end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ..components.core.switches import Hold
from ..errors import ArrangementError
from ..symbolic import Expression, depends
from .equation_builder import EquationBuilder
from .switching import Switch, Switching

_SMOOTH = "take the smooth form of the law: smoothed(assembly)"


@dataclass(frozen=True)
class Laws:
    """What the switches of a builder say, in the symbols of the model and of the modes.

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
    """Solve for all holding efforts, note them in the builder and return what the switches say.

    Parameters
    ----------
    builder
        With everything that the parts have said.

    Raises
    ------
    ArrangementError
        If a rate that is to be held has no inertia, or two efforts hold the same one.
    """
    holds = _merged(builder)
    reach = _solved(builder, holds) if holds else {name: () for name in builder.derivatives}
    others = (*builder.sides, *builder.corners)
    corner_modes = [ca.SX.sym(f"{c.name}.mode") for c in builder.corners]
    modes = (*(h.mode for h in holds), *(s.mode for s in builder.sides), *corner_modes)
    none = tuple(ca.SX(0) for _ in others)
    switches = [Switch(h.name, h.words, True) for h in holds]
    switches += [Switch(s.name, ((1, s.above), (-1, s.below)), s in builder.sides) for s in others]
    lasts = [ca.if_else(h.mode == 0, h.stays, h.lands) for h in holds]
    lasts += [m * s.value for m, s in zip(modes[len(holds) :], others, strict=True)]
    first = [*(h.first for h in holds), *(ca.if_else(s.value >= 0, 1, -1) for s in others)]
    return Laws(
        tuple(switches), modes, tuple(lasts), tuple(first),
        (*(h.stays for h in holds), *(ca.SX(1) for _ in others)), (*(h.leads for h in holds), *none),
        (*(h.rate for h in holds), *none), (*(h.rebound for h in holds), *none),
        {name: (*row, *none) for name, row in reach.items()},
    )  # fmt: skip


def _merged(builder: EquationBuilder) -> list[Hold]:
    """Return the holds with those of dry friction on the same rate made one; each gets its share."""
    found: list[Hold] = []
    for hold in builder.holds:
        rate = builder.cleaned(hold.rate)
        same = [i for i, h in enumerate(found) if ca.is_equal(ca.simplify(h.rate - rate), ca.SX(0), 2)]
        if not same or hold.level is None or found[same[0]].level is None:
            found.append(replace(hold, rate=rate))
            continue
        first, more = found[same[0]], hold.level
        before = first.level if first.level is not None else ca.SX(0)
        moving = ca.substitute(hold.moving, hold.mode, first.mode)
        whole = ca.SX.sym(f"{first.name}.all")
        level = before + more
        share = ca.if_else(level > 0, before / ca.if_else(level > 0, level, 1), 0)
        own = ca.if_else(first.mode == 0, whole * share, first.moving)
        builder.define(first.effort, own)
        # So the sum is that of both whether they stick or not.
        builder.define(hold.effort, whole - own)
        builder.define(hold.mode, first.mode)
        found[same[0]] = replace(
            first, name=f"{first.name}+{hold.name}", effort=whole, moving=first.moving + moving,
            stays=level - ca.fabs(whole), leads=ca.if_else(whole >= 0, 1, -1), level=level,
        )  # fmt: skip
    return found


def _solved(builder: EquationBuilder, holds: Sequence[Hold]) -> dict[str, list[Expression]]:
    efforts = ca.vertcat(*[h.effort for h in holds])
    cleaned = ca.vertsplit(builder.cleaned(ca.vertcat(*builder.derivatives.values())))
    rates = dict(zip(builder.derivatives, cleaned, strict=True))
    for hold in holds:
        _check_rate(builder, hold)
    accelerations = ca.vertcat(*[_acceleration(builder, h.rate, rates) for h in holds])
    matrix = ca.jacobian(accelerations, efforts)
    moving = builder.cleaned(ca.vertcat(*[h.moving for h in holds]))
    _check_linear(holds, matrix, moving, efforts)
    free = ca.substitute(accelerations, efforts, ca.SX.zeros(efforts.shape))
    unit = ca.SX.eye(len(holds))
    rows = [
        ca.if_else(h.mode == 0, ca.densify(matrix[i, :]), ca.densify(unit[i, :])) for i, h in enumerate(holds)
    ]
    right = [ca.if_else(h.mode == 0, -free[i], moving[i]) for i, h in enumerate(holds)]
    found = right[0] / rows[0] if len(holds) == 1 else _eliminated(rows, right)
    for hold, solution in zip(holds, ca.vertsplit(found), strict=True):
        builder.define(hold.effort, solution)
    for hold in holds:
        _hold_exactly(builder, hold, rates)
    return {name: ca.horzsplit(ca.densify(ca.jacobian(rate, efforts))) for name, rate in rates.items()}


def _eliminated(rows: list[Expression], right: list[Expression]) -> Expression:
    """Solve without exchanging rows: inertia makes the matrix of the held ones definite."""
    rows, right, count = list(rows), list(right), len(rows)
    for i in range(count):
        for k in range(i + 1, count):
            factor = rows[k][i] / rows[i][i]
            rows[k], right[k] = rows[k] - factor * rows[i], right[k] - factor * right[i]
    found: dict[int, Expression] = {}
    for i in reversed(range(count)):
        rest = sum((rows[i][k] * found[k] for k in range(i + 1, count)), start=ca.SX(0))
        found[i] = (right[i] - rest) / rows[i][i]
    return ca.vertcat(*[found[i] for i in range(count)])


def _check_rate(builder: EquationBuilder, hold: Hold) -> None:
    known = {
        e.element_hash()
        for group in (builder.states, builder.inputs, builder.parameters)
        for _, e in group.values()
    }
    known |= {s.mode.element_hash() for s in builder.sides}
    inside = [s.element_hash() for s in ca.symvar(hold.rate)]
    if not inside or not known.issuperset(inside):
        raise ArrangementError(
            hold.name, "its rate is itself an unknown, as in series with another element",
            next_step=f"tie it directly between two bodies, or {_SMOOTH}",
        )  # fmt: skip


def _acceleration(builder: EquationBuilder, rate: Expression, rates: Mapping[str, Expression]) -> Expression:
    """Return the time derivative of a rate; what moves a driven body gets its acceleration as an input."""
    found = ca.SX(0)
    for name, (_, state) in builder.states.items():
        if depends(rate, state):
            found += ca.jacobian(rate, state) * rates[name]
    for name, (variable, symbol) in list(builder.inputs.items()):
        if depends(rate, symbol):
            found += ca.jacobian(rate, symbol) * builder.rate_of_input(name, variable)
    return found


def _check_linear(holds: Sequence[Hold], matrix: Expression, moving: Expression, efforts: Expression) -> None:
    names = " and ".join(f"'{h.name}'" for h in holds)
    if depends(matrix, efforts) or depends(moving, efforts):
        raise ArrangementError(
            names,
            "what it takes to hold is not linear: a load contains another dry friction, or a gear loses",
            next_step=_SMOOTH,
        )
    draw = np.random.default_rng(1)
    modes = ca.vertcat(*[h.mode for h in holds])
    matrix = ca.SX(ca.substitute(matrix, modes, ca.SX.zeros(modes.shape)))
    symbols = ca.symvar(matrix)
    numbers = ca.Function("numbers", symbols, [matrix]).call(
        [float(v) for v in draw.uniform(0.5, 1.5, len(symbols))]
    )
    found = np.array(ca.DM(numbers[0]))
    for i, hold in enumerate(holds):
        if not found[i, i]:
            raise ArrangementError(
                hold.name, "nothing with inertia can be held by it", next_step="tie it to a body that moves"
            )
    scale = np.sqrt(np.abs(np.diag(found)))
    if np.linalg.svd(found / np.outer(scale, scale), compute_uv=False)[-1] < 1e-9:
        raise ArrangementError(
            names, "hold the same motion in two ways, so the share of each is not defined",
            next_step="tie dry frictions between the same bodies in the same order, use an elastic stop, "
            f"or {_SMOOTH}",
        )  # fmt: skip


def _hold_exactly(builder: EquationBuilder, hold: Hold, rates: Mapping[str, Expression]) -> None:
    """While held, let the first state in the rate follow the others, so that no rounding moves it."""
    inside = [n for n, (_, s) in builder.states.items() if depends(hold.rate, s)]
    slopes = {n: ca.jacobian(hold.rate, builder.states[n][1]) for n in inside}
    if not inside or any(ca.symvar(slope) for slope in slopes.values()):
        return
    first = inside[0]
    rest = _acceleration(builder, hold.rate, dict(builder.derivatives) | {first: ca.SX(0)})
    builder.derivatives[first] = ca.if_else(hold.mode == 0, -rest / slopes[first], builder.derivatives[first])


def natural_modes(laws: Laws) -> Expression:
    """Return the modes at a state as expressions without modes, a column.

    Parameters
    ----------
    laws
        Cleaned.

    Raises
    ------
    ArrangementError
        If the side of a switch depends on itself, as inside a series.
    """
    modes = ca.vertcat(*laws.modes) if laws.modes else ca.SX(0, 1)
    found = ca.vertcat(*laws.first) if laws.first else ca.SX(0, 1)
    for _ in laws.modes:
        if not depends(found, modes):
            break
        found = ca.SX(ca.substitute(found, modes, found))
    if depends(found, modes):
        names = ", ".join(s.name for s in laws.switches)
        raise ArrangementError(names, "on which side it is depends on itself", next_step=_SMOOTH)
    for _ in range(sum(not s.is_zero() for s in laws.rates)):
        at = ca.substitute(ca.vertcat(*laws.stays, *laws.leads), modes, found)
        stays, leads = at[: len(laws.modes)], at[len(laws.modes) :]
        found = ca.if_else(ca.logic_and(found == 0, stays < 0), leads, found)
    return ca.SX(found)


def switching(
    laws: Laws, columns: Sequence[Expression], derivatives: Sequence[Expression], states: Sequence[str]
) -> Switching:
    """Return the functions of the switches.

    Parameters
    ----------
    laws
        Cleaned.
    columns
        Symbols of time, states, inputs and parameters.
    derivatives
        Of the states, with the symbols of the modes.
    states
        Names.
    """
    modes, given = ca.vertcat(*laws.modes), [ca.SX(c) for c in columns[:4]]
    slope = ca.densify(ca.jacobian(ca.vertcat(*laws.rates), given[1]))
    reach = ca.vertcat(*[ca.horzcat(*laws.reach[n]) for n in states])
    branch = [ca.SX(ca.densify(ca.vertcat(*row))) for row in (derivatives, laws.lasts, laws.rates)]
    landing = [*(ca.SX(ca.vertcat(*g)) for g in (laws.rates, laws.rebounds, laws.leads)), reach, slope]
    return Switching(
        laws.switches,
        ca.Function("branch", [*given, modes], ca.cse(branch)),
        ca.Function("natural", given, [ca.densify(natural_modes(laws))]),
        ca.Function("landing", [*given, modes], ca.cse([ca.densify(e) for e in landing])),
        tuple(not rate.is_zero() for rate in laws.rates),
    )
