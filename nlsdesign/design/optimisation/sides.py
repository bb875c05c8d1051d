"""A cam with a contour of its own on each side: both are designed, on one element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import InfeasibleError, NlsError
from ...model import flatten
from ...model.origin import derived
from ...model.roles import series_cam
from ..curves.target import Target
from ..statics.declared_cam import both_sides, one_side
from ..statics.equilibrium import with_smooth_cables
from .goals import Goal
from .limits import Limit
from .result import CamDesign
from .settings import DesignSettings
from .solve import GOALS, USUAL, design_cam
from .stock import StockChoice


@dataclass(frozen=True, eq=False)
class SidesDesign:
    """A cam whose two sides were designed, and the assembly that holds it.

    Parameters
    ----------
    actuator
        Copy of the assembly with both contours and the sizes that they share.
    front, back
        The design of either side, as of a cam with two such sides; the angles and torques of the back are
        those of negative angles with both signs turned.
    chosen_by
        The side that chose what both share, ``"front"`` or ``"back"``.
    """

    actuator: Assembly
    front: CamDesign
    back: CamDesign
    chosen_by: str

    @property
    def met(self) -> bool:
        """Whether both sides meet their target."""
        return self.front.met and self.back.met

    def __str__(self) -> str:
        return f"front: {self.front}\nback: {self.back}\nwhat both share was chosen by the {self.chosen_by}"


def design_sides(
    actuator: Assembly,
    *,
    targets: tuple[Target, Target],
    free: Sequence[str | StockChoice] | None = None,
    keep: Sequence[Limit] = (),
    spring: str | None = None,
    goals: Sequence[Goal] = GOALS,
    settings: DesignSettings = USUAL,
) -> SidesDesign:
    """Design both contours of a cam whose sides differ, and what they share, each side by :func:`design_cam`.

    The side that stores more energy chooses what both share (pretension, rubber or coil, anchor), the other
    its contour alone; where one of them then misses, the other way round is tried too. So what they share is
    the best for one side and good enough for the other, not the best for both.

    Parameters
    ----------
    actuator
        Assembly whose cam spring has a :class:`~nlsdesign.components.LopsidedCam`.
    targets
        Torque curve for positive angles, and for negative ones with both signs turned.
    free, keep, spring, goals, settings
        As for :func:`design_cam`; both contours are free as ``<cam>.contour``, and limits hold on both.

    Raises
    ------
    ArrangementError
        If the cam has no two contours.
    InfeasibleError
        If the limits of a side contradict each other, whichever chooses; with the side.
    """
    names = series_cam(flatten(with_smooth_cables(actuator)), spring)
    cam = actuator[names.name]
    work = [float(target.energy(target.last_angle)) for target in targets]
    designs: list[SidesDesign] = []
    errors: list[NlsError] = []
    for first in sorted((0, 1), key=lambda side: -work[side]):
        sides: dict[int, CamDesign] = {}
        machine, released = actuator.with_part(names.name, one_side(cam, back=bool(first))), free
        try:
            for side in (first, 1 - first):
                sides[side] = design_cam(
                    machine, target=targets[side], free=released, keep=keep, spring=spring, goals=goals,
                    settings=settings,
                )  # fmt: skip
                # The other side, on what this one chose.
                machine, released = sides[side].actuator, [names.contour]
                other = one_side(cam, back=side == 0, like=machine[names.name])
                machine = machine.with_part(names.name, other)
        except InfeasibleError as error:
            errors.append(error.at(_NAMES[1 - first if sides else first]))
            continue
        both = sides[0], sides[1]
        made = both_sides(cam, *(side.actuator[names.name] for side in both))
        parts = sides[first].actuator.with_part(names.name, made).parts
        joined = derived(replace(actuator, parts=parts), actuator, "designed")
        designs.append(SidesDesign(joined, *both, _NAMES[first]))
        if designs[-1].met:
            return designs[-1]
    if not designs:
        raise errors[0]
    return min(designs, key=lambda each: max(s.rms / s.target.largest for s in (each.front, each.back)))


_NAMES = ("front", "back")
