"""Designs from programs that are kept: each begins beside the one before."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.quantity import Quantity
from ...model.origin import derived
from ..optimisation.limits import MaximumCableTension, MaximumStrain, MaximumStress
from ..optimisation.result import CamDesign, DesignCurves, LimitState
from ..statics.contour import Contour, contour_from_curvature
from ..statics.declared_cam import cam_from_profile, contour_of_cam
from .cam_question import CamQuestion
from .parametric_program import ParametricProgram, SearchOutcome, SearchPoint, structure_of

_MOST_PROGRAMS = 4
"""Programs that are kept; one takes about 30 MB."""
_NO_VALUES: Mapping[str, float] = {}
_ACTIVE = 1e-3
_CONTROL_VALUES = 64
_SOURCE = "designed, quick answer"
_PER_INTERVAL = 8
"""Points of a contour per interval of its program."""


@dataclass(frozen=True, eq=False)
class DesignedNumbers:
    """The numbers of a quick design, without the program that they were found with."""

    question: CamQuestion  # that was asked
    values: dict[str, float]  # sizes and variables of the contour in SI by name, to begin another search with
    contour: Contour
    shaped: bool  # whether the contour was designed; otherwise it is that of the machine

    def machine(self) -> Assembly:
        """Return the changed assembly: the numbers of the design, and a cam fitted to its contour."""
        cam, machine = self.question.cam.name, self.question.actuator
        known = machine.quantities()
        changes: dict[str, Quantity] = {
            name: known[name].with_value(value, _SOURCE)
            for name, value in self.values.items()
            if name in self.question.free
        }
        if self.shaped:
            anchor = None if self.question.cam.anchor_distance is None else self.contour.anchor_distance
            # The search reaches the last angle to a few parts in a thousand million; the cam ends at it.
            angles = self.contour.angles
            ends = np.linspace(0.0, self.question.target.last_angle - angles[-1], len(angles))
            fit = cam_from_profile(
                angles + ends, self.contour.lever_arms, like=machine[cam], count=_CONTROL_VALUES,
                anchor_distance=anchor,
            )  # fmt: skip
            changes |= {f"{cam}.{field}": given for field, given in fit.changes().items()}
        return derived(machine.with_values(changes), self.question.machine.assembly, "designed")


@dataclass(frozen=True, eq=False)
class ParametricDesign:
    """A solved question."""

    program: ParametricProgram  # of its structure
    question: CamQuestion  # that was asked
    point: SearchPoint  # where the program was solved
    cost: float  # sum of the goals there

    @cached_property
    def _numbers(self) -> dict[str, Array]:
        return self.program.outputs.columns(self.point.unknowns, self.question)

    @cached_property
    def contour(self) -> Contour:
        """Contour of the cam."""
        anchor = self.question.cam.anchor_distance
        rows = self._numbers
        if self.program.rows.problem.contour is None:
            return contour_of_cam(self.question.machine.cam_part, last_angle=self.question.target.last_angle)
        return contour_from_curvature(
            rows["direction"],
            rows["radius_of_curvature"],
            first_slope=float(rows["first_slope"][0]),
            first_lever_arm=float(rows["lever_arm"][0]),
            anchor_distance=np.inf if anchor is None else self.values[anchor],
            refine=_PER_INTERVAL,
        )

    @property
    def values(self) -> dict[str, float]:
        """Sizes of the design in SI by name."""
        names = [v.name for v in self.program.rows.problem.scalars]
        chosen = dict(zip(names, self._numbers["sizes"].tolist(), strict=True))
        return {name: chosen.get(name, n.value) for name, n in self.question.numbers.items()}

    @cached_property
    def numbers(self) -> DesignedNumbers:
        """What of it is kept when its program is not."""
        chosen = self.program.outputs.chosen_values(self.point.unknowns) | self.values
        shaped = self.program.rows.problem.contour is not None
        return DesignedNumbers(self.question, chosen, self.contour, shaped)

    @property
    def rms(self) -> float:
        """Rms torque error in N·m."""
        return float(np.sqrt(max(self._numbers["mean_square"][0], 0.0)))

    @property
    def rubber_volume(self) -> float:
        """Volume of all rubber in m³."""
        return float(self._numbers["volume"][0])

    @property
    def targets(self) -> Array:
        """Torque that is wanted at the nodes of the contour, in N·m."""
        return self._numbers["wanted"]

    @property
    def curves(self) -> DesignCurves:
        """What cam and rubber do at the nodes of the contour."""
        rows = self._numbers
        pieces = list(self.program.rows.problem.design.strains)
        size = (len(pieces), len(rows["angle"]))
        strains, stresses = (rows[key].reshape(size) for key in ("strains", "stresses"))
        return DesignCurves(
            angles=rows["angle"], lever_arms=rows["lever_arm"], radii=rows["radius"],
            radii_of_curvature=rows["radius_of_curvature"], torques=rows["torque"],
            stiffnesses=rows["stiffness"], extensions=rows["extension"], forces=rows["force"],
            strains=dict(zip(pieces, strains, strict=True)),
            stresses=dict(zip(pieces, stresses, strict=True)),
        )  # fmt: skip

    @property
    def limits(self) -> tuple[LimitState, ...]:
        """How it stands to all limits, kept or only shown."""
        states = []
        for i, (bound, wanted) in enumerate(
            zip(self.program.rows.shown_bounds, self.program.rows.values_of(self.question), strict=True)
        ):
            values = self._numbers[f"bound {i}"]
            value = float(values.max() if bound.upper else values.min())
            active = abs(value - wanted) <= _ACTIVE * (abs(wanted) or 1.0)
            states.append(LimitState(bound.limit, bound.of, value, wanted, bound.upper, bound.unit, active))
        return tuple(states)


class ParametricSolver:
    """The programs of one session, the latest first out last."""

    def __init__(self) -> None:
        self._programs: OrderedDict[tuple[Any, ...], ParametricProgram] = OrderedDict()
        self._contradicted: ParametricProgram | None = None

    def program(self, question: CamQuestion) -> ParametricProgram:
        """Return the program of a question, made where there is none yet."""
        key = structure_of(question)
        if key not in self._programs or not self._programs[key].rows.fits(question):
            self._programs[key] = ParametricProgram(question)
            self._programs[key].prepare()
        self._programs.move_to_end(key)
        while len(self._programs) > _MOST_PROGRAMS:
            self._programs.popitem(last=False)
        return self._programs[key]

    def keeps(self, design: ParametricDesign) -> bool:
        """Tell whether the program of a design is still kept."""
        return any(each is design.program for each in self._programs.values())

    def answer(
        self, question: CamQuestion, last: ParametricDesign | None, values: Mapping[str, float] = _NO_VALUES
    ) -> tuple[ParametricDesign | None, SearchOutcome]:
        """Return the design for a question, and how it was come by.

        ``values``: its numbers in SI by name, where its program is not kept; empty where there is no design.
        """
        program = self.program(question)
        begin = _Beginning(program, question, values if last is None else last.numbers.values)
        contradicted, self._contradicted = self._contradicted is program, None
        if contradicted:
            # Limits that contradicted each other a moment ago are asked first.
            kept = program.softened.conflict(question, begin.unknowns)
            if kept.state == "infeasible":
                self._contradicted = program
                return None, kept
        outcome = self._tried(begin, last)
        if outcome.state != "solved" and not contradicted:
            kept = program.softened.conflict(question, begin.unknowns)
            if kept.state == "infeasible":
                self._contradicted = program
                return None, kept
            if kept.point is not None:
                outcome = program.from_point(question, kept.point, kept.room)
        if outcome.state != "solved":
            outcome = program.from_starts(question)
        if outcome.state != "solved" or outcome.point is None:
            words = f"not solved yet: {outcome.words}{_unlimited(question)}"
            return None, replace(outcome, state="not solved", words=words)
        return ParametricDesign(program, question, outcome.point, outcome.cost), outcome

    def beside_design(self, question: CamQuestion, design: CamDesign) -> ParametricDesign | None:
        """Return the quick design at a finished one, for the next drag to begin from."""
        program = self.program(question)
        values = values_of_design(program, design)
        outcome = program.from_values(question, program.outputs.scaled_values(values))
        if outcome.state != "solved" or outcome.point is None:
            return None
        return ParametricDesign(program, question, outcome.point, outcome.cost)

    def _tried(self, begin: _Beginning, last: ParametricDesign | None) -> SearchOutcome:
        program, question = begin.program, begin.question
        known = last is not None and last.program is program
        if last is not None and known:
            outcome = program.beside(question, last.point)
            if outcome.state in ("solved", "infeasible"):
                return outcome
        if not begin.values:
            return program.from_starts(question)
        outcome = program.from_values(question, begin.values)
        return outcome if known or outcome.state == "solved" else program.from_starts(question)


@dataclass(frozen=True, eq=False)
class _Beginning:
    """Where a search begins; computed where it is asked for, which most drags do not."""

    program: ParametricProgram
    question: CamQuestion
    numbers: Mapping[str, float]

    @cached_property
    def values(self) -> dict[str, float]:
        """Numbers that the program knows, scaled."""
        return self.program.outputs.scaled_values(self.numbers)

    @cached_property
    def unknowns(self) -> Array:
        """All unknowns of the program."""
        return self.program.rows.completed(self.question, self.values)


def _unlimited(question: CamQuestion) -> str:
    """Return what to do where nothing limits how far a search may stretch the rubber."""
    limited = {MaximumStrain.__name__, MaximumStress.__name__, MaximumCableTension.__name__}
    pretension = question.cam.pretension
    if limited & set(question.limit_values) or pretension not in question.free:
        return ""
    return (
        f". Nothing limits how far the search stretches the rubber, and {pretension} is free: it may run to "
        f"where the law of the rubber has no value. Add a largest strain, or hold {pretension}"
    )


def values_of_design(program: ParametricProgram, design: CamDesign) -> dict[str, float]:
    """Return the variables of a finished design in SI by name."""
    values = {name: given.number for name, given in design.changes if len(given.values) == 1}
    shape, contour = program.rows.contour, design.contour
    if shape is None:
        return values
    for radius, value in zip(
        shape.radii_of_curvature, contour.radii_of_curvature[::_PER_INTERVAL], strict=True
    ):
        values[radius.name] = float(value)
    values[shape.first_slope.name] = float(contour.slopes[0])
    last = shape.last.name
    values[last] = float(contour.directions[-1] if last == "last_direction" else contour.lever_arms[0])
    return values
