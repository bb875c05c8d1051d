"""A cam designed at each point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..components.assembly.named_parts import Assembly
from ..design import DesignSettings, Goal, Limit, Target, design_cam
from ..design.optimisation.solve import GOALS, require_designable
from .axis_values import si_unit
from .sweep_columns import SweepColumn
from .sweep_question import SweepQuestion, answer

QUICK = DesignSettings(starts=4, draws=0, look_for_size_ranges=False, look_for_remedies=False)
"""Four starts, no draws, no remedies: what a sweep of designs asks of each by default."""
_LEVER_ARM = ".lever_arm"
_ANSWERS = (
    answer("met", "", "1 where the design meets its target"),
    answer("torque_error_rms", "N*m", "rms torque error of the finished assembly"),
    answer("torque_error_relative", "", "the same over the largest torque of the target"),
    answer("torque_error_largest", "N*m", "largest torque error"),
    answer("cam_radius", "m", "largest radius of the contour"),
    answer("radius_of_curvature", "m", "smallest radius of curvature of the contour"),
    answer("lever_arm", "m", "largest lever arm"),
    answer("strain", "", "largest strain of the rubber"),
    answer("cable_force", "N", "largest force in a cable"),
    answer("energy", "N*m", "energy taken up from angle zero to the last angle"),
    answer("rubber_volume", "m^3", "of all elements"),
)


@dataclass(frozen=True)
class DesignQuestion(SweepQuestion):
    """The cam of a spring, and what else is free, for a target; a miss is an answer, ``met`` 0.

    A point whose limits contradict each other fails, with their names as its reason.

    Parameters
    ----------
    target
        Torque curve.
    free
        Full names of what may change besides the contour; ``None`` for the contour alone. Single numbers are
        answers too, as ``designed.NAME``.
    keep
        Limits, besides those of the settings.
    goals
        What is made small, as a sum.
    spring
        Path of the cam spring where the structure leaves it open; empty otherwise.
    settings
        Of the search.
    """

    target: Target
    free: tuple[str, ...] | None = None
    keep: tuple[Limit, ...] = ()
    goals: tuple[Goal, ...] = GOALS
    spring: str = ""
    settings: DesignSettings = QUICK

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return error, sizes, strain, force and energy, and each free single number."""
        known = assembly.quantities()
        chosen = [n for n in self.free or () if n in known and not isinstance(known[n].value, tuple)]
        numbers = [answer(f"designed.{n}", si_unit(known[n].unit), "chosen by the design") for n in chosen]
        return (*_ANSWERS, *numbers)

    def require_fit(self, assembly: Assembly) -> None:
        """Refuse free names, limits and goals that the assembly does not have."""
        require_designable(
            assembly, target=self.target, free=self.free, keep=self.keep, goals=self.goals,
            spring=self.spring or None, settings=self.settings,
        )  # fmt: skip

    def chosen(self, assembly: Assembly) -> frozenset[str]:
        """Return what is free, and the numbers of a contour that is."""
        rows = [name for name in assembly.quantities() if name.endswith(_LEVER_ARM)]
        cams = [name.removesuffix(_LEVER_ARM) for name in rows if name.startswith(self.spring)]
        if self.free is not None:
            cams = [cam for cam in cams if {f"{cam}.contour", f"{cam}{_LEVER_ARM}"} & set(self.free)]
        contours = {f"{cam}{end}" for cam in cams for end in (_LEVER_ARM, ".last_angle")}
        return frozenset({*(self.free or ()), *contours})

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return what the design is."""
        made = design_cam(
            assembly, target=self.target, free=self.free, keep=self.keep, goals=self.goals,
            spring=self.spring or None, settings=self.settings,
        )  # fmt: skip
        values = {
            "met": float(made.met),
            "torque_error_rms": made.rms,
            "torque_error_relative": made.rms / made.target.largest,
            "torque_error_largest": made.check.largest,
            "cam_radius": float(made.contour.radii.max()),
            "radius_of_curvature": float(made.contour.radii_of_curvature.min()),
            "lever_arm": float(made.contour.lever_arms.max()),
            "strain": max((float(row.max()) for row in made.curves.strains.values()), default=float("nan")),
            "cable_force": float(made.curves.forces.max()),
            "energy": made.curves.energy,
            "rubber_volume": made.rubber_volume,
        }
        changed = made.actuator.quantities()
        names = [c.name.removeprefix("designed.") for c in self.answers(assembly)[len(_ANSWERS) :]]
        return values | {f"designed.{name}": changed[name].number for name in names}
