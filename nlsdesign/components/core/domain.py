"""Domains: pairs of a motion and an effort, their names and units."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Domain:
    """Names and units of the pair of quantities that an element relates.

    Parameters
    ----------
    name
        Material, translation or rotation.
    motion, motion_unit
        Strain in 1, extension in m, or angle in rad.
    rate, rate_unit
        Its derivative.
    effort, effort_unit
        Stress in Pa, force in N, or torque in N·m.
    inertia_unit
        Effort over acceleration, as it is written.
    """

    name: str
    motion: str
    motion_unit: str
    rate: str
    rate_unit: str
    effort: str
    effort_unit: str
    inertia_unit: str

    def __repr__(self) -> str:
        return self.name.upper()

    def unit(self, template: str) -> str:
        """Return a unit whose parts ``{motion}``, ``{rate}``, ``{effort}`` and ``{inertia}`` are filled in.

        Parameters
        ----------
        template
            For instance ``"{effort}*s/{motion}"``.

        Examples
        --------
        >>> ROTATION.unit("{effort}*s/{motion}"), TRANSLATION.unit("{effort}*s/{motion}")
        ('N*m*s/rad', 'N*s/m')
        >>> ROTATION.unit("rad/{motion}"), TRANSLATION.unit("rad/{motion}")
        ('1', 'rad/m')
        """
        written = template.format(
            motion=self.motion_unit, rate=self.rate_unit, effort=self.effort_unit, inertia=self.inertia_unit
        )
        return written.replace("rad/rad", "1")


MATERIAL = Domain("material", "strain", "1", "strain_rate", "1/s", "stress", "Pa", "kg/m")
TRANSLATION = Domain("translation", "extension", "m", "rate", "m/s", "force", "N", "kg")
ROTATION = Domain("rotation", "angle", "rad", "speed", "rad/s", "torque", "N*m", "kg*m^2")
