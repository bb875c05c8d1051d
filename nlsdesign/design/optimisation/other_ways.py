"""What is tried where neither sizes nor limits help: another kind of cam, more elements, a hollow contour."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import NlsError
from ..statics.declared_cam import declared_cam, one_sided, with_roller
from .design_search import Search, row_of, spans_of
from .limits import MaximumCableTension, MinimumRadiusOfCurvature
from .loosening import Freed, Loosened
from .program import Program, Rows
from .shape import starts

_STARTS = 4
_MOST = 1e3
_HOLLOW = 1e-6
"""Radius of curvature below zero, relative to the size of the contour, from which it counts as hollow."""
_SHOWS = 0.01
"""Part of the deepest hollow from which a place is named."""


@dataclass(frozen=True)
class OtherSpring:
    """Another spring that was tried with the same free numbers and limits."""

    words: str  # what it is
    machine: Assembly  # the actuator with it, not designed yet
    error: float  # rms torque error in N·m that is then left

    def __str__(self) -> str:
        return f"take {self.words}"


def percent(error: float, largest: float) -> str:
    """Return an rms error relative to the largest torque, as text."""
    return f"{100.0 * error / largest:.2g} % of the largest torque"


def other_springs(search: Search, free: Sequence[str]) -> tuple[OtherSpring, ...]:
    """Return the other springs for which a cam was found within the limits."""
    springs = []
    for words, machine in _others(search):
        try:
            question = search.question.of(machine)
            kept = [name for name in free if name in question.names]
            other = question.search(kept)
            begin = [other.problem.at(start) for start in starts(_STARTS, 0, [])]
            outcomes = [outcome for outcome in other.program.solve_all(begin) if outcome.solved]
        except NlsError:
            # A limit or a free number of this spring that the other does not have: it is no other way.
            continue
        if outcomes:
            best = min(outcomes, key=lambda outcome: outcome.cost)
            springs.append(OtherSpring(words, machine, other.problem.rms(best.point)))
    return tuple(springs)


def _others(search: Search) -> Iterator[tuple[str, Assembly]]:
    """Yield the other springs in words, with their machines."""
    machine, cam = search.question.machine, search.problem.law.cam
    part = machine[cam.name]
    if search.problem.contour is not None and declared_cam(part).through_centre:
        other = one_sided(part, search.question.target.last_angle)
        words = "a one-sided cam (OneSidedCam), which pulls to one side only"
        yield words, machine.with_part(cam.name, other)
    if search.problem.contour is not None and cam.roller is None:
        words = "a cam with a roller follower (RollerCam), whose edge may be hollow"
        rolling = with_roller(part, search.problem.sizes.arm, search.question.target.last_angle)
        yield words, machine.with_part(cam.name, rolling)
    # Elements share the torque as areas do, but only they share the force of the cable.
    if any(bound.limit == MaximumCableTension.__name__ for bound in search.bounds):
        count = 2 * round(search.question.model.values[cam.elements])
        if count <= 100:
            yield f"{cam.elements} = {count}", machine.with_values({cam.elements: float(count)})


@dataclass(frozen=True)
class Hollow:
    """Where a contour would have to be hollow for all limits to be kept."""

    spans: str  # in words, over the angle
    deepest: float  # least radius of curvature in m, below zero
    freed: Freed | None  # what has to be freed besides; None for nothing

    def __str__(self) -> str:
        besides = "" if self.freed is None else f" ({self.freed} besides)"
        return (
            f"ConvexContour: the contour would have to be hollow {self.spans}, with radii of curvature "
            f"down to {1e3 * self.deepest:.3g} mm{besides}; a taut cable lifts off there; the roller of a "
            "follower (RollerCam) does not, nor does a rolling pair, which is not designed here"
        )


def hollow_contour(loose: Loosened) -> Hollow | None:
    """Return where the contour would have to be hollow, as little as will do; ``None`` where none does.

    All limits are kept but those on its curvature, with what is free, or else with all sizes freed.
    """
    problem = loose.open.problem
    if problem.contour is None or not problem.contour.radii_of_curvature:
        return None
    names = [v.name for v in problem.variables]
    radii = [names.index(v.name) for v in problem.contour.radii_of_curvature]
    hollow = ca.SX.sym("hollow", len(radii))
    kept = [row_of(each) for each in loose.bounds if each.limit != MinimumRadiusOfCurvature.__name__]
    convex = Rows(ca.vertcat(*[problem.variables[i].symbol for i in radii]) + hollow, 0.0, ca.inf)
    for freed in dict.fromkeys(((), loose.candidates)):
        lower, upper = (ends[: loose.count] for ends in loose.box(freed))
        lower[radii] = -upper[radii]
        rows = (*problem.structure, *kept, convex)
        program = Program(problem.vector, lower, upper, ca.sumsqr(hollow), rows)
        program = program.with_unknowns(hollow, 0.0, _MOST)
        begin = np.append(np.clip(loose.starts[0], lower, upper), np.ones(len(radii)))
        outcome = program.solve(begin)
        rho = problem.evaluate(problem.design.radii_of_curvature, outcome.point[: loose.count])
        where = rho < _SHOWS * min(rho)
        if outcome.solved and min(rho) < -_HOLLOW * problem.sizes.arm:
            angles = problem.evaluate(problem.design.angles, outcome.point[: loose.count])
            also = loose.freed(freed, outcome) if freed else None
            return Hollow(spans_of(angles, where), float(rho.min()), also)
    return None


def tried_otherwise(loose: Loosened, search: Search, free: Sequence[str]) -> list[str]:
    """Return in words what else keeps limits that contradict each other."""
    largest = search.question.target.largest
    ways = [
        f"{one}: it keeps all limits and leaves {percent(one.error, largest)}"
        for one in other_springs(search, free)
    ]
    hollow = hollow_contour(loose)
    ways = [*([] if hollow is None else [str(hollow)]), *ways]
    sizes = f"all sizes free ({', '.join(loose.candidates)})" if loose.candidates else "no size left to free"
    return ways or [f"nothing that was tried keeps them: {sizes}, another kind of cam, a hollow contour"]
