"""Joint cam design against SLSQP, trust-constr and CMA-ES on six problems: best cost and time of each.

All get the same unknowns, cost and limits. The peers get them as functions compiled to C (where a compiler is
found), with the torque errors eliminated. SLSQP and trust-constr get finite differences, all of a point in
one call; CMA-ES gets an exact penalty, and the equation at the end of the contour solved for it. SLSQP begins
at each start of ours in turn, the other two at the first, until they end or their time is over. A cost counts
where no row is missed by more than 1e-6. Times are CPU seconds of one process. Printed, not asserted:
``python -m benchmarks.cam_design``. With ``--random 100`` the starts of ``design_cam`` stand beside as many
random starts of the same interior point method.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import importlib.util
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

import nlsdesign as nls
from benchmarks._tools import run_tool
from nlsdesign import components as parts
from nlsdesign import design as design_room
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.design import DesignSettings
from nlsdesign.design.optimisation.design_search import SAME_COST, Search, SeveralStarts, times_found
from nlsdesign.design.optimisation.limits import Limit
from nlsdesign.design.optimisation.problem import DesignProblem
from nlsdesign.design.optimisation.program import Rows
from nlsdesign.design.optimisation.shape import Start, start_values, starts
from nlsdesign.design.optimisation.solve import GOALS, USUAL, Wanted
from nlsdesign.export.compilation.cross_compiler import BASELINE
from nlsdesign.foundation.arrays import Array

FEASIBLE = 1e-6
"""Largest miss of a row, each scaled to about 1, at which a cost counts."""
_CLOSE = 1e-3
"""Relative distance to a cost at which a solver counts as being there."""
_STARTS = 8
_STEP = 1.5e-8
_PENALTY = 2.0
"""Penalty of CMA-ES over the largest multiplier at our solution: exact, and no steeper than needed."""
_FIRST_STEP = 0.2
_NEWTON = 5


@dataclass(frozen=True)
class Problem:
    """What is asked for.

    Parameters
    ----------
    name
        Printed.
    actuator, target, free, keep
        As for ``design_cam``.
    defaults
        Of the settings.
    """

    name: str
    actuator: nls.Assembly
    target: design_room.Target
    free: tuple[str, ...]
    keep: tuple[Limit, ...]
    defaults: tuple[Limit, ...] | None = None

    def search(self) -> Search:
        """Return the search that ``design_cam`` begins with."""
        settings = DesignSettings(defaults=self.defaults)
        question, free = Wanted(self.target, self.free, self.keep, None, GOALS).question(
            self.actuator, settings
        )
        return question.search(free)


def problems() -> list[Problem]:
    """Return the problems: the README's call and five more; the flat one has no limits of its rubber."""
    bench = nls.models.cam_rubber_actuator(nls.load_deck("austin2015_figure_consistent"))
    contour, pretension = "spring.cam.contour", "spring.pretension"
    area, rest_length = "spring.rubber.area", "spring.rubber.rest_length"
    of_2014 = nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0)
    usual = (nls.MinimumRadiusOfCurvature(1e-3), nls.MaximumCamRadius(20e-3), nls.MaximumStrain(1.0))
    one_sided = declare(nls.load_deck("one_sided_cable_drive"))
    return [
        Problem(
            "README", bench, of_2014, (contour, pretension, area, rest_length), (nls.MaximumCamRadius(20e-3),)
        ),
        Problem("flat", bench, of_2014, (contour, pretension, area), usual, ()),
        Problem(
            "study", bench, of_2014, (contour, pretension, area, rest_length),
            (*usual, design_room.RestLengthRange(8e-3, 20e-3)),
        ),
        Problem("2014", _bench_of_2014(), of_2014, (contour, pretension, area, rest_length), usual),
        Problem(
            "one-sided", one_sided,
            design_room.PowerTorque(coefficient=0.6, exponent=1.5, angle=nls.degrees(80.0)),
            (contour, pretension, "spring.cable.rope.rubber.area"),
            (nls.MaximumCamRadius(30e-3), nls.MaximumStrain(1.0)),
        ),
        Problem(
            "binding", bench,
            design_room.PowerTorque(coefficient=3.4, exponent=1.0, angle=nls.degrees(50.0)),
            (contour, pretension, area), (nls.MaximumCamRadius(12e-3),),
        ),
    ]  # fmt: skip


def _bench_of_2014() -> nls.Assembly:
    """Return two elements of 1 cm² and 12.5 mm with the printed moduli up to 9 mm; anchor at 25 mm."""
    law = parts.StrainStiffening(
        modulus=nls.quantity((0.92, 0.58, 0.74, 0.77), "MPa", spread=0.06),
        knots=(0.0, 0.016, 0.0848, 0.212),
        contact=parts.Rounded(width=0.01),
    )
    rubber = parts.specimen(
        area=nls.quantity(1.0, "cm^2"),
        rest_length=nls.quantity(12.5, "mm"),
        stiff=law,
        relaxing=parts.series(
            spring=parts.LinearElastic(modulus=0.58e6), dashpot=parts.ViscousMaterial(viscosity=411.0)
        ),
    )
    cam = parts.TwoSidedCam(
        lever_arm=tuple(0.010 + 0.0002 * i for i in range(12)), last_angle=1.0, elements=2.0,
        anchor_distance=25e-3,
    )  # fmt: skip
    return assembly(
        "bench",
        motor=parts.GearedMotor(inertia=5.97e-4, gear_ratio=4.0, torque_constant=0.055),
        load=parts.Fixed(),
        spring=parts.tie(parts.through(cam, rubber=rubber, pretension=0.0), "motor", "load"),
    )


class OutOfTimeError(Exception):
    """The time of a peer is over."""


@dataclass(frozen=True)
class Reached:
    """Best cost that counts over time: pairs of CPU seconds and cost; seconds until the end, and whether that
    was the end of its time."""

    history: tuple[tuple[float, float], ...]
    end: float
    over_time: bool

    @property
    def cost(self) -> float:
        """The best."""
        return self.history[-1][1] if self.history else np.inf

    def at(self, cost: float) -> float:
        """Return the seconds until a cost is reached to 0.1 %; infinite if never."""
        return next((t for t, one in self.history if one <= (1.0 + _CLOSE) * cost), np.inf)

    def __str__(self) -> str:
        over = ", time over" if self.over_time else ""
        return f"{self.cost:.6g} in {self.at(self.cost):.2f} s (end {self.end:.1f} s{over})"


class Watch:
    """Best cost over time of one peer.

    Parameters
    ----------
    limit
        CPU seconds at which it is stopped.
    """

    def __init__(self, limit: float) -> None:
        self.limit, self.begin = limit, time.process_time()
        self.history: list[tuple[float, float]] = []

    def saw(self, cost: float, missed: float) -> None:
        """Take note of a point; raises :class:`OutOfTimeError`."""
        now = time.process_time() - self.begin
        if missed <= FEASIBLE and (not self.history or cost < self.history[-1][1]):
            self.history.append((now, cost))
        if now > self.limit:
            raise OutOfTimeError

    def reached(self) -> Reached:
        """Return the outcome so far."""
        end = time.process_time() - self.begin
        return Reached(tuple(self.history), end, end > self.limit)


class PeerProblem:
    """A search as numbers for peers: cost, rows ≥ 0 and rows = 0, with the torque errors eliminated.

    Parameters
    ----------
    search
        As ours.
    """

    def __init__(self, search: Search) -> None:
        problem, program = search.problem, search.program
        self.count = len(problem.chosen(np.zeros(len(problem.variables))))
        states, errors = ca.vertsplit(
            program.unknowns, [0, self.count, self.count + problem.states.shape[0], len(problem.variables)]
        )[1:]
        # The last rows of the structure are share·(error − symbol) = 0, so the symbol follows from the rest.
        lifted = problem.structure[-1].expression
        share = -float(ca.evalf(ca.jacobian(lifted[0], errors[0])))
        follows = ca.substitute(lifted, errors, ca.SX.zeros(errors.shape)) / share
        follows = ca.substitute(follows, states, problem.states)
        # So do the states of the contour, whose equations stand first.
        kept = [row for row in program.rows if row not in (problem.structure[0], problem.structure[-1])]
        unknowns = program.unknowns[: self.count]
        cost, above, equal = ca.substitute(
            [program.cost, _above(kept), _equal(kept)],
            [ca.vertcat(states, errors)],
            [ca.vertcat(problem.states, follows)],
        )
        self.lower, self.upper = program.lower[: self.count], program.upper[: self.count]
        self.above, self.equal = above.shape[0], equal.shape[0]
        self.values = _compiled(ca.Function("values", [unknowns], [ca.vertcat(cost, above, equal)]))
        self.batch = self.values.map(self.count + 1)
        names = [v.name for v in problem.variables[: self.count]]
        self.last = names.index("last_direction") if self.equal else None
        self.starts = [problem.at(start)[: self.count] for start in starts(_STARTS, USUAL.seed, [])]

    def at(self, point: Array) -> Array:
        """Return cost and rows at points, shape (1 + rows,) or (1 + rows, points)."""
        found = np.array(self.values(point), dtype=float)
        return np.nan_to_num(found[:, 0] if point.ndim == 1 else found, nan=1e6, posinf=1e6, neginf=-1e6)

    def with_slopes(self, point: Array) -> tuple[Array, Array]:
        """Return cost and rows at a point, and their forward differences, from one call."""
        steps = _STEP * np.maximum(1.0, np.abs(point))
        found = np.array(self.batch(np.column_stack([point, point[:, None] + np.diag(steps)])), dtype=float)
        found = np.nan_to_num(found, nan=1e6, posinf=1e6, neginf=-1e6)
        return found[:, 0], (found[:, 1:] - found[:, :1]) / steps

    def missed(self, values: Array) -> Array:
        """Return the sum over the rows of what each is missed by, and the largest: shape (2, ...)."""
        above, equal = values[1 : 1 + self.above], values[1 + self.above :]
        each = np.concatenate([np.maximum(-above, 0.0), np.abs(equal)])
        return np.array([each.sum(axis=0), each.max(axis=0)])


class _Point:
    """Cost and rows at the point that was asked for last, and their slopes."""

    def __init__(self, problem: PeerProblem, watch: Watch) -> None:
        self.problem, self.watch = problem, watch
        self.point = self.values = self.slopes = np.zeros(0)

    def __call__(self, point: Array) -> _Point:
        if not np.array_equal(point, self.point):
            self.point = point.copy()
            self.values, self.slopes = self.problem.with_slopes(point)
            self.watch.saw(float(self.values[0]), float(self.problem.missed(self.values)[1]))
        return self


def slsqp(problem: PeerProblem, start: Array, limit: float) -> Reached:
    """SLSQP of SciPy from one start."""
    watch = Watch(limit)
    at, many = _Point(problem, watch), 1 + problem.above
    rows = [
        {"type": "ineq", "fun": lambda x: at(x).values[1:many], "jac": lambda x: at(x).slopes[1:many]},
        {"type": "eq", "fun": lambda x: at(x).values[many:], "jac": lambda x: at(x).slopes[many:]},
    ]
    with contextlib.suppress(OutOfTimeError):  # what it had reached until then counts
        minimize(
            lambda x: at(x).values[0], start, jac=lambda x: at(x).slopes[0], method="SLSQP",
            bounds=Bounds(problem.lower, problem.upper), constraints=rows[: 1 + bool(problem.equal)],
            options={"maxiter": 3000, "ftol": 1e-12},
        )  # fmt: skip
    return watch.reached()


def trust_constr(problem: PeerProblem, start: Array, limit: float) -> Reached:
    """Interior point method ``trust-constr`` of SciPy from one start."""
    watch = Watch(limit)
    at = _Point(problem, watch)
    high = np.append(np.full(problem.above, np.inf), np.zeros(problem.equal))
    rows = NonlinearConstraint(
        lambda x: at(x).values[1:], np.zeros(len(high)), high, jac=lambda x: at(x).slopes[1:], hess=BFGS()
    )
    with contextlib.suppress(OutOfTimeError):  # what it had reached until then counts
        minimize(
            lambda x: at(x).values[0], start, jac=lambda x: at(x).slopes[0], hess=BFGS(),
            method="trust-constr", bounds=Bounds(problem.lower, problem.upper), constraints=[rows],
            options={"maxiter": 10000, "gtol": 1e-9, "xtol": 1e-12},
        )  # fmt: skip
    return watch.reached()


def cma_es(problem: PeerProblem, start: Array, limit: float, penalty: float) -> Reached:
    """CMA-ES of the package ``cma`` from one start, with an exact penalty for rows that are missed."""
    cma = importlib.import_module("cma")
    watch, free = Watch(limit), np.delete(np.arange(problem.count), [problem.last] if problem.equal else [])
    evolution = cma.CMAEvolutionStrategy(
        start[free], _FIRST_STEP,
        {
            "bounds": [problem.lower[free], problem.upper[free]], "seed": 1, "verbose": -9,
            "tolfun": 1e-12, "tolfunhist": 1e-13, "maxfevals": np.inf, "maxiter": np.inf,
        },
    )  # fmt: skip
    with contextlib.suppress(OutOfTimeError):  # what it had reached until then counts
        while not evolution.stop():
            asked = np.array(evolution.ask())
            points = np.tile(start[:, None], len(asked))
            points[free] = asked.T
            _solve_last(problem, points)
            values = problem.at(points)
            missed = problem.missed(values)
            evolution.tell(list(asked), list(values[0] + penalty * missed[0]))
            for cost, largest in zip(values[0], missed[1], strict=True):
                watch.saw(float(cost), float(largest))
    return watch.reached()


def _solve_last(problem: PeerProblem, points: Array) -> None:
    """Put the last direction into points, shape (unknowns, points), at which the equation holds."""
    if problem.last is None:
        return
    for _ in range(_NEWTON):
        ahead = points.copy()
        ahead[problem.last] += 1e-7
        now, then = problem.at(points)[-1], problem.at(ahead)[-1]
        step = np.clip(now / np.where(then == now, 1.0, (then - now) / 1e-7), -0.2, 0.2)
        points[problem.last] = np.clip(
            points[problem.last] - step, problem.lower[problem.last], problem.upper[problem.last]
        )


@dataclass(frozen=True)
class Ours:
    """Set-up; cost and seconds of each start, with infinite cost where it came to no solution; largest
    multiplier of a row."""

    set_up: float
    costs: Array
    seconds: Array
    price: float

    @property
    def cost(self) -> float:
        """The best."""
        return float(self.costs.min())

    @cached_property
    def first_good(self) -> float:
        """Seconds of the fastest start that comes within 0.1 % of the best."""
        return float(self.seconds[self.costs <= (1.0 + _CLOSE) * self.cost].min())

    @property
    def all_starts(self) -> float:
        """Set-up and all starts."""
        return self.set_up + float(self.seconds.sum())


def ours(search: Search, set_up: float) -> Ours:
    """Solve from each start, one after the other.

    Parameters
    ----------
    search
        Made anew, so that nothing is prepared yet.
    set_up
        Seconds that making it took.
    """
    begin = time.process_time()
    search.program.prepare()
    points = [search.problem.at(start) for start in starts(_STARTS, USUAL.seed, [])]
    set_up += time.process_time() - begin
    costs, seconds, price = [], [], 0.0
    for point in points:
        begin = time.process_time()
        outcome = search.program.solve(point)
        seconds.append(time.process_time() - begin)
        costs.append(outcome.cost if outcome.solved else np.inf)
        price = max(price, *outcome.prices)
    return Ours(set_up, np.array(costs), np.array(seconds), price)


def _above(rows: Sequence[Rows]) -> ca.SX:
    low = [row.expression - row.lower for row in rows if row.lower != row.upper and np.isfinite(row.lower)]
    high = [row.upper - row.expression for row in rows if row.lower != row.upper and np.isfinite(row.upper)]
    return ca.vertcat(*low, *high)


def _equal(rows: Sequence[Rows]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *[row.expression - row.lower for row in rows if row.lower == row.upper])


def _compiled(function: ca.Function) -> ca.Function:
    """Return a function compiled to C, or as it is without a compiler."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    command = [compiler] if compiler else _zig()
    if not command:
        return function
    folder = Path(tempfile.mkdtemp(prefix="cam_design_"))
    function.generate("values.c")
    Path("values.c").replace(folder / "values.c")
    library = folder / "values.so"
    run_tool([*command, "-O2", "-shared", "-fPIC", "-o", str(library), str(folder / "values.c"), "-lm"])
    return ca.external(function.name(), str(library))


def _zig() -> list[str]:
    return [sys.executable, "-m", "ziglang", "cc", *BASELINE] if importlib.util.find_spec("ziglang") else []


def compared(problem: Problem, limit: float) -> None:
    """Print what comes of one problem.

    Parameters
    ----------
    problem
        Which one.
    limit
        CPU seconds for each peer.
    """
    begin = time.process_time()
    search = problem.search()
    own = ours(search, time.process_time() - begin)
    each = ", ".join(f"{c:.6g} in {t:.2f} s" for c, t in zip(own.costs, own.seconds, strict=True))
    print(
        f"{problem.name}: {len(search.problem.variables)} unknowns; set-up {own.set_up:.2f} s, {each}",
        flush=True,
    )
    peer = PeerProblem(search)
    several = [slsqp(peer, start, limit) for start in peer.starts]
    print(f"  SLSQP: {'; '.join(map(str, several))}", flush=True)
    found = {
        "SLSQP": min(several, key=lambda one: one.cost),
        "trust-constr": trust_constr(peer, peer.starts[0], limit),
        "CMA-ES": cma_es(peer, peer.starts[0], limit, _PENALTY * own.price),
    }
    for name, one in found.items():
        time_of_ours = own.first_good if name == "SLSQP" else own.all_starts
        print(
            f"  {name:13s} {one}: {one.cost / own.cost:.5g} times our cost; "
            f"at its best after {one.at(one.cost) / time_of_ours:.3g}, at ours after "
            f"{one.at(own.cost) / time_of_ours:.3g} times our {time_of_ours:.2f} s",
            flush=True,
        )


def random_point(problem: DesignProblem, draw: np.random.Generator) -> Array:
    """Return a point with random sizes, tightness and a random smooth radius of curvature.

    Parameters
    ----------
    problem
        Whose unknowns it has.
    draw
        Of all that is random in it.
    """
    assert problem.contour is not None
    sizes = [v.name for v in problem.scalars if v.name != problem.law.cam.pretension]
    factors = {name: float(np.exp(draw.normal())) for name in sizes}
    slope, tight, size = draw.uniform(0.05, 1.2), draw.uniform(0.0, 2.0), np.exp(0.6 * draw.normal())
    start = Start(float(slope), float(tight), factors, float(size))
    values = start_values(start, scalars=problem.scalars, contour=problem.contour, sizes=problem.sizes)
    radii = problem.contour.radii_of_curvature
    share = np.linspace(0.0, 1.0, len(radii))
    waves = [draw.normal(0.0, 0.5 / k) * np.cos(np.pi * k * share) for k in (1, 2, 3, 4)]
    for radius, wave in zip(radii, np.exp(np.sum(waves, axis=0)), strict=True):
        values[radius.name] *= float(wave)
    return problem.completed(values)


def beside_random(problem: Problem, count: int) -> None:
    """Print what the starts of ``design_cam`` come to, and the best of as many random starts of IPOPT.

    Parameters
    ----------
    problem
        Which one.
    count
        Number of random starts.
    """
    begin = time.process_time()
    search = problem.search()
    outcomes = SeveralStarts(search).outcomes()
    seconds, found = time.process_time() - begin, times_found(search.problem, outcomes)
    own = min(outcome.cost for outcome in outcomes if outcome.solved)
    draw, begin = np.random.default_rng(12345), time.process_time()
    random = [search.program.solve(random_point(search.problem, draw)) for _ in range(count)]
    costs = np.array([outcome.cost for outcome in random if outcome.solved])
    least = float(costs.min(initial=np.inf))
    theirs = f"{least:.8g} in {time.process_time() - begin:.1f} s"
    at_best = int(np.sum(costs <= (1 + SAME_COST) * min(own, least)))
    print(
        f"{problem.name}: {own:.8g} in {seconds:.2f} s, found {found} times in {len(outcomes)} starts; "
        f"{count} random starts: {theirs}, {at_best} at the best; ours over theirs {own / least:.6f}",
        flush=True,
    )


def main() -> None:
    """Print a table of costs and times for each problem."""
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--limit", type=float, default=60.0, help="CPU seconds for each peer")
    reader.add_argument("--only", nargs="+", help="names of problems")
    reader.add_argument("--random", type=int, help="compare with so many random starts of IPOPT instead")
    given = reader.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for problem in problems():
        if given.only is not None and problem.name not in given.only:
            continue
        if given.random is None:
            compared(problem, given.limit)
        else:
            beside_random(problem, given.random)


if __name__ == "__main__":
    main()
