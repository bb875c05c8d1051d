"""Limits that hold unless the designer says otherwise: they follow from what is declared of the spring.

How the search for a design is carried out, and what counts as a miss.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...foundation.errors import ValueRangeError, brief
from ...model import FlatModel
from ...model.roles import series_cam
from ...model.structure import SpecimenNames
from ..curves.numbers import in_si
from ..statics.contour import Contour
from ..tolerance.monte_carlo import FEWEST_DRAWS, MOST_DRAWS
from .coil_limits import (
    GoodmanSafety,
    MaximumPressureAngle,
    MaximumSpringIndex,
    MaximumTravel,
    MinimumHollowRadius,
    MinimumSpringIndex,
    PressedContact,
    RoomBetweenPivots,
)
from .limits import (
    Limit,
    MaximumCableTension,
    MaximumLastingStrain,
    MaximumStrain,
    MaximumStress,
    MinimumRadiusOfCurvature,
)

_LARGEST_ERROR = 0.5
_MOST_STARTS = 10_000


def no_progress() -> None:
    """Report no progress."""


@dataclass(frozen=True, kw_only=True)
class DesignSettings:
    """How the search is carried out, and what counts as a miss.

    Parameters
    ----------
    starts
        Most starting points; the first four are always the same. Six are taken, and six more each time until
        the best design has been found from two of them.
    seed
        Of the starting points after the fourth.
    largest_error
        Rms torque error, relative to the largest torque of the target, above which a design misses it.
    defaults
        Limits that hold unless one of the same kind is asked for; ``None`` for those that follow from the
        declared cable and rubber, see :func:`safe_limits`. Empty for none.
    look_for_size_ranges
        Whether the ranges of sizes that cost nothing are looked for, which takes as long as the design again.
    look_for_remedies
        Whether it is found out, at a miss, what to free.
    draws
        Number of made springs of the tolerance analysis, at least 20; zero for none.
    progress
        Called after each starting point, or after each combination of a stock.
    contour
        To which the cam of the assembly was fitted, where it is known: what limits on the shape of a contour
        that is held are judged by.

    Raises
    ------
    ValueRangeError
        If a number is none that can be.

    Examples
    --------
    >>> DesignSettings(starts=20, seed=3).largest_error
    0.01
    """

    starts: int = 24
    seed: int = 1
    largest_error: float = 0.01
    defaults: Sequence[Limit] | None = None
    look_for_size_ranges: bool = True
    look_for_remedies: bool = True
    draws: int = 200
    progress: Callable[[], None] = no_progress
    contour: Contour | None = None

    def __post_init__(self) -> None:
        in_si("largest_error", self.largest_error, "1", minimum=1e-6, maximum=1.0)
        if self.largest_error > _LARGEST_ERROR:
            raise ValueRangeError(
                f"largest_error = {self.largest_error:g}",
                f"is {100 * self.largest_error:g} % of the largest torque, which nearly any curve meets",
                next_step=f'write "{self.largest_error:g} %" if per cent were meant; at most 50 %',
            )
        if not 1 <= self.starts <= _MOST_STARTS:
            rule = f"a search has from 1 to {_MOST_STARTS} starting points"
            raise ValueRangeError(f"starts = {self.starts}", rule, next_step="take 4")
        if self.seed < 0:
            raise ValueRangeError(
                f"seed = {self.seed}", "a seed is a whole number from zero on", next_step="take 1"
            )
        if self.draws and not FEWEST_DRAWS <= self.draws <= MOST_DRAWS:
            raise ValueRangeError(
                f"draws = {brief(self.draws)}", f"a tolerance needs {FEWEST_DRAWS} to {MOST_DRAWS} draws",
                next_step="take 200, or 0 for no tolerance",
            )  # fmt: skip


CABLE_FACTOR = 5.0
"""Breaking force over largest tension: the working coefficient of ropes in Directive 2006/42/EC, annex I,
4.1.2.4, for lifting accessories; nothing better is known for the rope of an actuator."""
STRESS_FACTOR = 3.0
"""Assumed: strength of rubber scatters by 15 % from sample to sample (Schepelmann, Geberth, Geyer 2014) and
falls by about a half over many cycles."""
STRAIN_FACTOR = 3.0
"""Assumed, for the same reason as the factor of stress."""
LASTING_STRAIN = 1.0
"""Half of the extension of about 200 % beyond which the stress of natural rubber without filler relaxes at a
sharply higher rate, for crystals grow (Gent, Relaxation processes in vulcanized rubber III, Rubber Chem.
Technol. 36, 1963, 697). Assumed: the half, and that other rubbers bear as much for good."""
PRESSURE_ANGLE = math.radians(30.0)
"""Largest pressure angle of a follower that slides (Norton 2009, ch. 7)."""
WIDER = 1.25
"""Radius of a hollow over that of the roller in it. Assumed: below, they nearly fit and touch on an arc."""
TOOTH_RADIUS = 1e-3
"""Least radius in m of cams that roll on one another: that of the teeth along their edges (Wu and Mintchev
2024, Step3_ERCmodeller.m)."""
COIL_SAFETY = 1.5
"""Assumed: safety of a coil against fatigue. At it the largest shear stress is below 0.45 of the tensile
strength, up to which coils do not set, whatever the least stress is."""
BREAKS = 5.0
"""Nominal strain at which soft rubbers break, for rubber of which nothing is stated: the tensile curve of
PMC-770 ends there (Schepelmann 2014)."""


def safe_limits(model: FlatModel, spring: str | None = None) -> tuple[Limit, ...]:
    """Return the limits that follow from what is declared of cable, rubber and coil.

    Parameters
    ----------
    model
        Flat model of the actuator.
    spring
        Path of the cam spring; decided from the structure if it is left out.

    Returns
    -------
    tuple of Limit
        Empty where neither strength nor cable is declared.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant.
    """
    return tuple(_declared(model, spring))


def _declared(model: FlatModel, spring: str | None) -> Iterator[Limit]:
    cam, values = series_cam(model, spring), model.values
    if cam.cable is not None:
        radius = values[cam.cable.diameter] * values[cam.cable.bend_ratio] / 2.0
        yield MinimumRadiusOfCurvature(radius)
        yield MaximumCableTension(values[cam.cable.breaking_force] / CABLE_FACTOR)
    if cam.rolling is not None:
        yield PressedContact()
    if cam.rolling is not None and cam.rolling.radius is None:
        yield MinimumRadiusOfCurvature(TOOTH_RADIUS)
        yield RoomBetweenPivots()
    elif cam.rolling is not None and cam.rolling.radius is not None:
        radius = values[cam.rolling.radius]
        yield MaximumPressureAngle(PRESSURE_ANGLE)
        # The roller's centre turns on twice the radius of the roller at least: Norton 2009, ch. 7.
        yield MinimumRadiusOfCurvature(radius)
        yield MinimumHollowRadius(WIDER * radius)
    strengths = [values[p.tensile_strength] for p in cam.specimens if p.tensile_strength is not None]
    if strengths:
        yield MaximumStress(min(strengths), safety_factor=STRESS_FACTOR)
    elongations = [values[p.elongation_at_break] for p in cam.specimens if p.elongation_at_break is not None]
    if elongations:
        yield MaximumStrain(min(elongations) / STRAIN_FACTOR)
        yield MaximumLastingStrain(LASTING_STRAIN)
    if cam.coils:
        yield MaximumTravel(min(model.variable(coil.extension).maximum for coil in cam.coils))
    wound = [coil for coil in cam.coils if coil.winding]
    if wound:
        least, most = wound[0].index_range
        yield MinimumSpringIndex(least)
        yield MaximumSpringIndex(most)
    if any(coil.tensile_strength for coil in wound):
        yield GoodmanSafety(COIL_SAFETY)


def with_defaults(keep: Sequence[Limit], defaults: Sequence[Limit]) -> tuple[Limit, ...]:
    """Return the limits asked for, and those defaults of whose kind none was asked for."""
    kinds = {type(limit) for limit in keep}
    return (*keep, *(limit for limit in defaults if type(limit) not in kinds))


class StrainEnd(NamedTuple):
    """Strain up to which a piece of rubber may be believed, and what says so."""

    strain: float
    reason: str


def strain_ends(model: FlatModel) -> dict[str, StrainEnd]:
    """Return how far each piece of rubber behind the cam may be stretched, by its path."""
    return {piece.name: _end_of(model, piece) for piece in series_cam(model).specimens}


def _end_of(model: FlatModel, piece: SpecimenNames) -> StrainEnd:
    """Return the least of what the laws beside each other in a piece state, and its elongation at break."""
    ends = [
        StrainEnd(v.maximum, f"its law is stated to hold up to {100.0 * v.maximum:.4g} %")
        for v in model.signals
        if v.bounded
        and math.isfinite(v.maximum)
        and v.name.startswith(f"{piece.name}.")
        and v.name.endswith(".strain")
        # Laws further inside share the strain of the piece with others in series.
        and v.name.count(".") == piece.name.count(".") + 2
    ]
    if piece.elongation_at_break is not None:
        breaks = model.values[piece.elongation_at_break]
        ends.append(StrainEnd(breaks, f"it is declared to break at {100.0 * breaks:.4g} %"))
    unknown = StrainEnd(
        BREAKS, f"nothing is stated of its rubber, and soft rubbers break at {100 * BREAKS:g} %"
    )
    return min(ends, default=unknown)
