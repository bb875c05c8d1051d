"""The error of an observer in continuous time: ė = (A(θ) − L·C)·e, with A anywhere in verified ranges.

The angle is measured, so whatever depends on it is known and A has no column for it. What is left of A are
slopes of the equations of the model: symbolic, and bounded by interval arithmetic over every angle, hence
every engaged segment of the rubber's law, and, for dry friction, over every speed. Friction enters as a
sector: of any two speeds it leaves a difference of their rates of q times their distance, with q between
these bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import casadi as ca
import numpy as np

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ArrangementError, ConvergenceError
from ....model import FlatModel
from ....model.paper_form import GEOMETRIC, paper_form
from ....model.transform import named, with_outputs, without_idle_states
from ..scheduling.angle_form import AngleScheduledPlant, Minimal, PaperForm, plant_over
from .exact import Matrix, corners
from .intervals import Bounds, enclose, halved
from .polytope import SPEED_LIMIT, scaling
from .torque_bound import NARROWEST

CELLS = 256
REFINEMENTS, TOLERANCE = 24, 2e-3
"""How often cells are halved, and how far beyond values at points a bound may stay, by the largest value."""


@dataclass(frozen=True, eq=False)
class ErrorSystem:
    """All matrices A of ė = (A − L·C)·e, entry by entry."""

    states: tuple[str, ...]  # names, in the order of the observer
    # sizes: typical sizes of the states, shape (n,); V = eᵀPe is written in states over these
    sizes: tuple[float, ...]
    moving: tuple[int, int]  # places of angle and speed
    seen: tuple[int, ...]  # places of the measured states
    angles: tuple[float, float]  # range of the angle in rad
    # lower, upper: bounds of each entry of A, shape (n, n)
    lower: tuple[tuple[float, ...], ...]
    upper: tuple[tuple[float, ...], ...]

    @property
    def friction(self) -> tuple[float, float]:
        """Least and greatest slope of the acceleration over the speed, in 1/s."""
        speed = self.moving[1]
        return self.lower[speed][speed], self.upper[speed][speed]

    def exact_corners(self, gain: tuple[tuple[float, ...], ...]) -> Iterator[Matrix]:
        """Yield every corner of A − L·C in scaled states, in fractions.

        ``gain``: L, shape (n, r).
        """
        n = len(self.states)
        size = [Fraction(s) for s in self.sizes]
        for values in corners([v for r in self.lower for v in r], [v for r in self.upper for v in r]):
            a = [[Fraction(values[i * n + j]) for j in range(n)] for i in range(n)]
            for i in range(n):
                for k, place in enumerate(self.seen):
                    a[i][place] -= Fraction(gain[i][k])
            yield [[a[i][j] * size[j] / size[i] for j in range(n)] for i in range(n)]

    def scaled_corners(self) -> Array:
        """Return the corners of A alone in scaled states, shape (corners, n, n)."""
        nothing = ((0.0,) * len(self.seen),) * len(self.states)
        return np.array([[[float(v) for v in row] for row in a] for a in self.exact_corners(nothing)])


def error_system(
    model: FlatModel,
    form: Minimal | PaperForm,
    *,
    estimate: str,
    measured: str,
    angles: tuple[float, float],
) -> ErrorSystem:
    """Return the error of an observer in continuous time, with verified ranges of its entries."""
    plant = plant_over(form, model, estimate, measured, angles)
    theta, speed, slopes = _slopes(model, form, plant)
    n, (_, fast) = len(plant.names), plant.moving
    over_speed = np.zeros((n, n), dtype=bool)
    over_speed[fast, fast] = True
    others = ca.vec(ca.densify(slopes).T)
    for k in range(n * n):
        if k != fast * n + fast and ca.depends_on(others[k], speed):
            raise ArrangementError(
                f"rate of '{plant.names[k // n]}'",
                f"is not linear in '{plant.names[k % n]}' at a given angle",
                next_step="a certificate in continuous time needs friction that depends on the speed alone",
            )  # fmt: skip
    entries = ca.Function("slopes", [theta, speed], [others])
    friction = ca.Function("friction", [theta, speed], [ca.densify(slopes[fast, fast])])
    still, whole = (np.zeros(1), np.zeros(1)), (np.array([angles[0]]), np.array([angles[1]]))

    def by_angle(cells: Bounds) -> tuple[Array, Array, Mask]:
        bounds = enclose(entries, [[cells], [still]])
        return bounds.outputs[0].lower, bounds.outputs[0].upper, bounds.undecided

    def by_speed(cells: Bounds) -> tuple[Array, Array, Mask]:
        bounds = enclose(friction, [[whole], [cells]])
        return bounds.outputs[0].lower, bounds.outputs[0].upper, np.zeros(len(cells[0]), dtype=bool)

    low, high = (v.reshape(n, n) for v in hull(by_angle, np.linspace(*angles, CELLS + 1)))
    speeds = np.concatenate([[0.0], np.geomspace(1e-6, SPEED_LIMIT, 2000)])
    (low[fast, fast],), (high[fast, fast],) = hull(by_speed, np.concatenate([-speeds[:0:-1], speeds]))
    if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
        i, j = np.argwhere(~np.isfinite(low + high))[0]
        raise ConvergenceError(
            "certificate in continuous time",
            f"the slope of the rate of '{plant.names[i]}' by '{plant.names[j]}' has no bound",
            next_step="narrow the angles, or give dry friction a creep speed")  # fmt: skip
    low, high = _rounded(low, high)
    return ErrorSystem(
        states=plant.names, sizes=scaling(plant), moving=plant.moving,
        seen=tuple(int(np.argmax(row)) for row in plant.output_matrix),
        angles=(float(angles[0]), float(angles[1])),
        lower=tuple(map(tuple, low.tolist())), upper=tuple(map(tuple, high.tolist())),
    )  # fmt: skip


def _slopes(
    model: FlatModel, form: Minimal | PaperForm, plant: AngleScheduledPlant
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return angle, speed, and A as a function of both, in the order of the observer."""
    published = isinstance(form, PaperForm)
    wanted = [plant.estimate.name, plant.angle]
    model = paper_form(model, form.names) if isinstance(form, PaperForm) else model
    model = model if published else without_idle_states(with_outputs(model, wanted), wanted)
    s, names = model.symbols(), [v.name for v in model.states]
    order = [names.index(name) for name in plant.names]
    x, rates = s.state[order], s.derivative[order]
    angle, speed = plant.moving
    slopes = ca.densify(ca.jacobian(rates, x))
    inner = [i for i in range(len(order)) if i not in plant.moving]
    slopes[:, angle] = 0
    for i in inner:  # what follows the speed is carried as a function of the measured angle
        slopes[i, speed] = 0
    known = [(s.parameter, ca.SX(ca.DM(model.start(model.parameters))))]
    if published:
        known.append((s.input, ca.SX(ca.DM(model.start(model.inputs)))))
        own = named(model, s)
        known += [(own[name], own[f"{name}.{GEOMETRIC}"]) for name in plant.measured]
    for symbol, value in reversed(known):
        slopes = ca.substitute(slopes, symbol, value)
    left = ca.vertcat(s.time, s.input, *[x[i] for i in inner])
    if ca.depends_on(slopes, left):
        raise ArrangementError(
            f"model '{model.name}'", "has an error whose coefficients do not depend on the angle alone",
            next_step="inner states of the rubber have to enter linearly",
        )  # fmt: skip
    return x[angle], x[speed], ca.densify(slopes)


def hull(ranges: Callable[[Bounds], tuple[Array, Array, Mask]], edges: Array) -> tuple[Array, Array]:
    """Return bounds of many functions over a range, from cells that are halved where they are too wide.

    ``ranges``: takes cells and returns lower and upper bounds, shape (cells, functions), and which cells
    reach over the edge of a piece; of these what is narrower than 1e-7 rad is left out.
    """
    cells: Bounds = (edges[:-1], edges[1:])
    points = ranges((edges, edges))
    near, far = _decided(points)
    low, high = near.copy(), far.copy()
    for step in range(REFINEMENTS):
        least, greatest, undecided = ranges(cells)
        middle = cells[0] + (cells[1] - cells[0]) / 2.0
        seen = _decided(ranges((middle, middle)))
        near, far = np.fmin(near, seen[0]), np.fmax(far, seen[1])
        spare = TOLERANCE * np.maximum(np.abs(near), np.abs(far)) + 1e-300
        wide = np.any((least < near - spare) | (greatest > far + spare), axis=1) | undecided
        wide &= ~(undecided & (cells[1] - cells[0] <= NARROWEST))
        taken = ~undecided if step == REFINEMENTS - 1 else ~wide & ~undecided
        low = np.minimum(low, np.min(least[taken], axis=0, initial=np.inf))
        high = np.maximum(high, np.max(greatest[taken], axis=0, initial=-np.inf))
        if not np.any(wide):
            break
        cells = halved(cells, middle, wide)
    return low, high


def _decided(bounds: tuple[Array, Array, Mask]) -> tuple[Array, Array]:
    kept = ~bounds[2]
    return (
        np.min(bounds[0][kept], axis=0, initial=np.inf),
        np.max(bounds[1][kept], axis=0, initial=-np.inf),
    )


def _rounded(low: Array, high: Array) -> tuple[Array, Array]:
    """Return bounds widened to nine digits; an entry that is one number stays one."""
    scale = 10.0 ** (np.floor(np.log10(np.maximum(np.maximum(np.abs(low), np.abs(high)), 1e-300))) - 8.0)
    same = high - low <= 1e-12 * np.maximum(np.abs(low), np.abs(high))
    below, above = np.floor(low / scale) * scale, np.ceil(high / scale) * scale
    return np.where(same & (low == 0.0), 0.0, below), np.where(same & (high == 0.0), 0.0, above)
