"""What holds at one angle of a design: mechanism to scale, observability, poles, and the torque loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..components.assembly.named_parts import Assembly
from ..design import Contour
from ..design.drawing.making import Mounting, carrying_note
from ..design.statics.contour import cable_up_to, turn
from ..feedback.analysis import Observability
from ..feedback.analysis.rest_points import RestPoints, rest_points
from ..foundation.arrays import Array
from ..foundation.errors import NlsError
from ..model import FlatModel, flatten
from ..model.roles import measured_motion, series_spring
from ..model.structure import CamNames
from ..model.transform import with_outputs
from .answers import (
    AngleAnswer,
    DesignView,
    Lazy,
    LoopResponse,
    Mechanism,
    PoleGroup,
    SeenStates,
    WorkStage,
)

_CLEARANCE = 3e-3
"""Least distance in m between guide and clamp of the rubber, so that both can be seen."""
_THICKNESS = 6e-3
"""Drawn height in m of unstretched rubber whose width is not to scale."""
_REACH = 2.5
"""A guide further away than this many radii of the cam is drawn there."""


def mechanism_at(
    contour: Contour, angle: float, *, extensions: tuple[float, float, float], rest_length: float
) -> Mechanism:
    """Return the mechanism at one angle.

    ``contour``: of the cam; a finite anchor for a cable through the centre.
    """
    both = bool(np.isfinite(contour.anchor_distance))
    angle = float(np.clip(angle, -contour.angles[-1] if both else 0.0, contour.angles[-1]))
    radius = max(float(np.max(contour.radii)), 1e-3)
    guide = min(contour.anchor_distance, _REACH * radius)
    shown = min(rest_length + extensions[0], guide)
    wall = guide + _CLEARANCE + extensions[2] - extensions[0] + shown
    line = cable_up_to(contour, angle, guide, from_centre=both)
    contact, end = line[-2:]
    clamp = np.array([wall - shown - (extensions[1] - extensions[0]), end[1]])
    half = 0.5 * _THICKNESS * float(np.sqrt(rest_length / max(rest_length + extensions[1], 1e-6)))
    up = np.array([0.0, half])
    corners = np.array([clamp + up, [wall, end[1] + half], [wall, end[1] - half], clamp - up])
    cable = np.vstack([line, clamp])
    sides = (1.0, -1.0) if both else (1.0,)
    # Of one lip the sector between it and the centre is drawn.
    lip = np.vstack([[0.0, 0.0], contour.points, [0.0, 0.0]])
    outlines = contour.outlines(angle) if both else (turn(lip, angle),)
    low, beside = radius + _THICKNESS, float(end[1]) - _THICKNESS
    short = "; the rubber is drawn shorter than it is" if shown < rest_length + extensions[0] else ""
    return Mechanism(
        angle=angle,
        halves=tuple(outlines),
        cables=tuple(side * cable for side in sides),
        contacts=tuple(side * contact for side in sides),
        guides=tuple(side * end for side in sides),
        rubbers=tuple(side * corners for side in sides),
        edges=(),
        holes=(),
        dimensions=(
            ("cam radius", -radius, -low, 0.0, -low, radius),
            *((("to the guide", 0.0, -low, guide, -low, guide),) if guide == contour.anchor_distance else ()),
            ("rubber", float(clamp[0]), beside, wall, beside, rest_length + extensions[1]),
        ),
        extent=(wall + 2e-3, radius + 1.6 * _THICKNESS),
        remark="extension, cam and cable are to scale, the height of the rubber is not" + short,
    )


def with_part(drawn: Mechanism, mounting: Mounting) -> Mechanism:
    """Return a mechanism with the edges, holes and sizes of its part, turned with the cam."""
    part = mounting.part
    names = {"thickness": "plate", "body_radius": "body radius", "bolt_circle": "bolt circle"}
    sizes = [f"{words} {1e3 * part.number(n):.3g} mm" for n, words in names.items() if n in part.numbers]
    carried = carrying_note(part, mounting.torque)
    return replace(
        drawn,
        edges=tuple(turn(outline.polygon(_CHORD), drawn.angle) for outline in part.outlines),
        holes=tuple(
            (float(x), float(y), hole.diameter / 2.0)
            for hole in part.holes
            for x, y in turn(hole.centre[None, :], drawn.angle)
        ),
        remark=f"{drawn.remark}. The part: {', '.join(sizes)}. {carried}",
    )


_CHORD = 2e-5
"""Distance in m by which a drawn edge may cut the corner of its arcs."""
_GRID = 21
"""Angles over which the typical sizes of states are taken, as observability is scaled by them."""
_LOOP_ANGLES = 41
_FREQUENCIES = np.geomspace(0.1, 100.0, 61)
_SAMPLE_TIME = 1e-3


@dataclass(frozen=True, eq=False)
class AngleView:
    """A design that can be looked at angle by angle."""

    view: DesignView  # what is shown of it over the angle
    contour: Contour  # of its cam
    cam: CamNames  # names around it
    make: Callable[[], Assembly]  # gives the changed assembly; asked when it is first needed
    mounting: Mounting | None = None  # the part as it is made, once it is checked

    @cached_property
    def machine(self) -> Assembly:
        """The changed assembly."""
        return self.make()

    def seen_as(self, view: DesignView) -> AngleView:
        """Return the same design under another revision, with what was computed of it."""
        changed = replace(self, view=view)
        for name in ("machine", "model", "_grid"):
            if name in self.__dict__:
                changed.__dict__[name] = self.__dict__[name]
        return changed

    @property
    def rest_length(self) -> float:
        """Length of the rubber in m, as it is drawn."""
        numbers = {each.name: each.value for each in self.view.numbers}
        lengths = [numbers[name] for name in self.cam.lengths if name in numbers]
        return lengths[0] if lengths else 2.0 * float(self.contour.radii.max())

    @cached_property
    def model(self) -> FlatModel:
        """Flat model of the changed assembly with the measured angle and the torque as outputs."""
        whole = flatten(self.machine)
        return with_outputs(whole, [measured_motion(whole), series_spring(whole).effort])

    @cached_property
    def _grid(self) -> RestPoints:
        last = float(self.view.columns[0].values[-1])
        return rest_points(
            self.model, np.linspace(0.0, last, _GRID), angle=measured_motion(self.model), consistent=None
        )

    def mechanism(self, angle: float) -> Mechanism:
        """Return cam, cable and rubber at one angle."""
        column = self.view.column("extension").values
        now = float(np.interp(abs(angle), self.view.columns[0].values, column))
        extensions = (float(column[0]), now, float(column[-1]))
        drawn = mechanism_at(self.contour, angle, extensions=extensions, rest_length=self.rest_length)
        return drawn if self.mounting is None else with_part(drawn, self.mounting)

    def answer(self, angle: float, loop: Lazy) -> AngleAnswer:
        """Return what holds at one angle besides the mechanism."""
        points: list[RestPoints] = []

        def rest() -> RestPoints:
            if not points:
                here = np.array([*self._grid.at, angle])
                points.append(rest_points(self.model, here, angle=self._grid.angle, consistent=None))
            return points[0]

        observability = self._lazily(lambda: seen_states(rest()))
        return AngleAnswer(angle, observability, self._lazily(lambda: pole_groups(rest())), loop)

    def _lazily(self, make: Callable[[], object]) -> Lazy:
        try:
            return Lazy(WorkStage.DONE, self.view.revision, make())
        except NlsError as error:
            return Lazy(WorkStage.FAILED, self.view.revision, None, str(error))


def seen_states(points: RestPoints) -> SeenStates:
    """Return what the sensor of the angle shows at the last of some rest points."""
    columns = Observability(measured=(points.angle,)).over(points)
    values = dict(zip((v.name for v in columns.columns), columns.values[-1], strict=True))
    return SeenStates(
        measured=points.angle,
        rank=round(values["observability.rank"]),
        states=len(points.state_names),
        condition=float(values["observability.condition"]),
        verdict=columns.words["verdict"][-1],
    )


def pole_groups(points: RestPoints) -> tuple[PoleGroup, ...]:
    """Return the poles of the plant at the last of some rest points, by mode of its dry friction."""
    return tuple(
        PoleGroup(mode.name, mode.words, mode.eigenvalues[-1].real.copy(), mode.eigenvalues[-1].imag.copy())
        for mode in points.modes
    )


def loop_responses(
    stage: Callable[[str], None], machine: Assembly, last: float
) -> tuple[Array, list[LoopResponse]]:
    """Return the torque loop of a machine over its angle, with controller and observer by default.

    Result: angles, shape (n,), and the response at each.
    """
    from ..feedback.control import encoder_loop, torque_controller
    from ..feedback.control.evaluation.linear_loop import linear_loop
    from ..feedback.observer import CascadeGain, design_observer

    whole = flatten(machine)
    torque = series_spring(whole).effort
    plant = with_outputs(whole, [measured_motion(whole), torque])
    stage("designs the observer")
    observer = design_observer(plant, sample_time=_SAMPLE_TIME, gain=CascadeGain())
    controller = torque_controller(plant, sample_time=_SAMPLE_TIME)
    stage("linearises the loop")
    angles = np.linspace(0.0, last, _LOOP_ANGLES)
    loop = encoder_loop(plant, observer=observer, controller=controller, delay=1, substeps=10)
    linear = linear_loop(loop, angles)
    answers = linear.response(f"plant.{torque}", loop.desired, _FREQUENCIES)
    words = (
        "torque over wanted torque, small deviations around the torque that is held there: "
        f"{controller.description}, "
        "cascade observer, 1 kHz, one sample of delay, numbers of the deck; limits and counts take no part"
    )
    stable, reached = linear.stable(), linear.reached
    with np.errstate(divide="ignore"):
        size = 20.0 * np.log10(np.abs(answers))
    phase = np.degrees(np.unwrap(np.angle(answers), axis=1))
    return angles, [
        LoopResponse(
            _FREQUENCIES, size[k], phase[k], bool(stable[k]), str(linear.mode),
            words if reached[k] else "the loop cannot rest at this angle within its limits; " + words,
        )
        for k in range(len(angles))
    ]  # fmt: skip
