"""What differs from one made spring to the next, and by how much.

A deck that gives no spread for pretension, contour, anchor or cable does not mean that these are exact. For
them there are assumed deviations, each with its reason, shown with every result; ``spreads`` replaces any of
them.
"""

from __future__ import annotations

import math
from abc import ABC
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import unknown_name
from ...foundation.quantity import Quantity
from ...foundation.spread import EXACT, NormalSpread, RelativeSpread, Spread
from ...model import FlatModel, Variable
from ...model.roles import series_cam
from ...model.structure import CamNames
from ..curves.numbers import in_si, in_unit


def shown_unit(unit: str) -> str:
    """Return the unit in which a length, an area or a stress of a spring is shown."""
    return {"m": "mm", "m^2": "mm^2", "Pa": "MPa"}.get(unit, unit)


@dataclass(frozen=True)
class Cause(ABC):
    """Base of what differs from one made spring to the next.

    Parameters
    ----------
    name
        Full name of the number, of the row of numbers, or of what is not a number of the model.
    nominal
        Value in SI; 1 where the deviation is relative.
    deviation
        Standard deviation in SI; relative where ``unit`` is ``"1"`` and several numbers move together.
    unit
        Unit in which both are shown.
    source
        Where the deviation comes from: declared, given, or assumed with a reason.
    relative
        Whether it is a share of the numbers, so that it grows with them.
    spread
        How the deviations are distributed.
    """

    name: str
    nominal: float
    deviation: float
    unit: str
    source: str
    relative: bool
    spread: Spread

    @property
    def assumed(self) -> bool:
        """Whether the deviation is an assumption of this package."""
        return self.source.startswith("assumed")

    @property
    def size(self) -> str:
        """The standard deviation as text, in per cent where it is relative."""
        if self.unit == "1":
            return f"{100 * self.deviation:.3g} %"
        return in_unit(self.deviation, self.unit, digits=3)

    def __str__(self) -> str:
        return f"{self.name} ± {self.size} ({self.source})"


@dataclass(frozen=True)
class NumberCause(Cause):
    """Numbers behind the cam that move together."""

    # numbers: pairs of parameter name and its deviation in SI per standard deviation of the cause
    numbers: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class AnchorCause(Cause):
    """An anchor that stands nearer or farther while the made contour stays the same."""


@dataclass(frozen=True)
class WaveCause(Cause):
    """An error of the edge along its normal, a·cos(kπφ/φ_e) over the direction φ of the cable, or the angle.

    With k = 0 it is an offset: a tool of another radius, or a thicker cable or roller.
    """

    order: int


@dataclass(frozen=True)
class ProfileCause(Cause):
    """Declared numbers of the cam: the contour deviates as the lever arm changes with them."""

    # numbers: pairs of parameter name and its deviation in SI per standard deviation of the cause
    numbers: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class LastingCause(Cause):
    """Torque that time takes: the whole of it, something between, or nothing yet."""

    loss: tuple[float, ...]  # over the angles, in N·m per standard deviation, on each stroke


@dataclass(frozen=True)
class SinceMade(Spread):
    """A loss that has come about wholly, in part, or not at all, each share as likely."""

    fourth_moment = 1.8

    def number(self, value: float, x: Array) -> Array:
        """Return the value and the share of the loss, Φ(x)."""
        result: Array = value + scipy.special.ndtr(x)
        return result

    def slope(self, value: float) -> float:
        """Return the standard deviation of the share, 1/√12."""
        return 1.0 / math.sqrt(12.0)

    def text(self, shown: Callable[[float], str]) -> str:
        """Return that it lies on one side."""
        return "from nothing to the whole"


def draw_deviations(causes: Sequence[Cause], count: int, *, seed: int) -> Array:
    """Return independent deviations in units of their standard deviations.

    Each cause draws from a generator of its own, seeded by the seed and its name, so that another cause more
    or less, or another design with the same names, changes no other deviation.
    """
    columns = [
        cause.spread.deviate(np.random.default_rng([seed, *cause.name.encode()]).standard_normal(count))
        for cause in causes
    ]
    return np.column_stack(columns) if columns else np.zeros((count, 0))


_FARTHEST = 10.0
"""Distance in m from which on an anchor counts as infinitely far."""


class _Assumed(NamedTuple):
    """A standard deviation in SI that is assumed where nothing is declared."""

    deviation: float
    source: str

    @property
    def spread(self) -> Spread:
        """A normal distribution of that size."""
        return NormalSpread(self.deviation) if self.deviation > 0.0 else EXACT


_PRETENSION = _Assumed(1e-4, "assumed: set by a screw of 0.5 mm pitch to a fifth of a turn")
_ANCHOR = _Assumed(2e-4 / math.sqrt(3.0), "assumed: place of a hole within ± 0.2 mm, each place as likely")
_CONTOUR = _Assumed(5e-5 / math.sqrt(3.0), "assumed: edge within ± 0.05 mm, each place as likely")
_CABLE = _Assumed(2.5e-5 / math.sqrt(3.0), "assumed: diameter within ± 0.05 mm, each size as likely")
_ROLLER = _Assumed(2e-6 / math.sqrt(3.0), "assumed: a bearing, diameter from −8 to 0 µm, each size as likely")


@dataclass(frozen=True)
class SpreadRules:
    """How the spreads of a deck become deviations.

    Parameters
    ----------
    separate_moduli
        Whether each modulus of a piece, also each of a row, deviates on its own: the form of its curve is
        uncertain too. Else all move together: they are fitted to one curve, and what differs between batches
        and samples is mostly how stiff the whole curve is. That is also the careful choice, for deviations of
        their own would average out in the torque.
    given
        Spreads that replace declared and assumed ones, by name of the cause: a :class:`Spread`, or one
        standard deviation in the unit of the number, of rows and moduli relative as in a deck; zero for none.
    """

    separate_moduli: bool = False
    given: Mapping[str, Spread | Quantity | float] = field(default_factory=dict)


def spring_causes(model: FlatModel, spring: str | None, rules: SpreadRules) -> tuple[Cause, ...]:
    """Return everything that deviates in a cam spring, whether it matters or not.

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    cam = series_cam(model, spring)
    tie = next(each for each in model.springs if cam in each.cams)
    # The numbers of the spring that move together, by name.
    inside = set(tie.parameters) - set(_not_of_the_torque(cam))
    groups: dict[str, list[Variable]] = {}
    for variable in model.parameters:
        if variable.name in inside:
            groups.setdefault(variable.name.partition("[")[0], []).append(variable)
    for piece in cam.specimens:
        moduli = {
            name: row
            for name, row in groups.items()
            if name.startswith(f"{piece.name}.") and row[0].unit == "Pa" and any(v.spread for v in row)
        }
        groups = {name: row for name, row in groups.items() if name not in moduli}
        if rules.separate_moduli:
            groups |= {v.name: [v] for row in moduli.values() for v in row}
        elif moduli:
            groups[f"{piece.name}.moduli"] = [v for row in moduli.values() for v in row]
    others = {f"{cam.name}.contour": _CONTOUR, **_on_the_edge(model, cam)}
    valid = [*groups, *others]
    for name in rules.given:
        if name not in valid:
            raise unknown_name("spread", name, valid)
    causes: list[Cause] = []
    for name, rows in groups.items():
        causes += _of_numbers(name, rows, cam, rules)
    for name, assumed in others.items():
        given = rules.given.get(name)
        size = (
            assumed
            if given is None
            else _Assumed(_given_spread(name, given, "m").standard_error(1.0), "given")
        )
        causes += _of_the_edge(name, size)
    return tuple(cause for cause in causes if cause.deviation > 0.0)


def _on_the_edge(model: FlatModel, cam: CamNames) -> dict[str, _Assumed]:
    """Return by how much the radius of the cable or roller deviates, by name; equal cams have none."""
    if cam.rolling is not None and cam.rolling.radius is None:
        return {}
    name, size, per_size, assumed = f"{cam.name}.cable_radius", "", 0.5, _CABLE
    if cam.rolling is not None and cam.rolling.radius is not None:
        name, size, per_size, assumed = cam.rolling.radius, cam.rolling.radius, 1.0, _ROLLER
    elif cam.cable is not None:
        size = cam.cable.diameter
    declared = model.variable(size) if size else None
    if declared is not None and declared.spread:
        deviation = per_size * declared.spread.standard_error(declared.start)
        assumed = _Assumed(deviation, f"declared: {declared.spread_text}")
    return {name: assumed}


def _not_of_the_torque(cam: CamNames) -> Iterator[str]:
    """Yield the numbers that do nothing to the torque, or act as an error of the edge."""
    if cam.rolling is not None:
        yield from (name for name in (cam.rolling.base, cam.rolling.radius) if name is not None)
    for piece in cam.specimens:
        idle = (piece.tensile_strength, piece.elongation_at_break, piece.tension_set)
        yield from (name for name in idle if name is not None)
    for coil in cam.coils:
        yield from coil.idle
    if cam.cable is not None:
        yield from (cam.cable.diameter, cam.cable.breaking_force, cam.cable.bend_ratio)


def _of_numbers(name: str, rows: Sequence[Variable], cam: CamNames, rules: SpreadRules) -> list[Cause]:
    """Return the cause of a number, or of numbers that move together."""
    first, given = rows[0], rules.given.get(name)
    if name == cam.anchor_distance and first.start > _FARTHEST:
        return []
    alone = len(rows) == 1 and name == first.name and not name.endswith("]")
    if given is not None:
        spread = _given_spread(name, given, first.unit if alone else "1")
        if not alone and isinstance(spread, NormalSpread) and not isinstance(given, Spread):
            spread = RelativeSpread(spread.size)  # of the logarithm, as a declared one
        size = spread.standard_error(first.start if alone else 1.0)
        share = size / (abs(first.start) or 1.0) if alone else size
        amounts, source, relative = [size] if alone else [share * v.start for v in rows], "given", not alone
    else:
        widest = max(rows, key=lambda v: v.spread.share(v.start))
        spread, share = widest.spread, widest.spread.standard_error(widest.start) / (abs(widest.start) or 1.0)
        amounts = [math.copysign(v.spread.standard_error(v.start), v.start) for v in rows]
        source, relative = f"declared: {widest.spread_text}", isinstance(spread, RelativeSpread)
        assumed = {cam.pretension: _PRETENSION, cam.anchor_distance: _ANCHOR}.get(name)
        if assumed is not None and amounts[0] == 0.0:
            spread, amounts, source, relative = assumed.spread, [assumed.deviation], assumed.source, False
    numbers = tuple((v.name, amount) for v, amount in zip(rows, amounts, strict=True))
    # Rows and moduli are shown as relative deviations, single numbers in their own unit.
    unit = shown_unit(first.unit) if alone else "1"
    shown = (first.start, amounts[0]) if alone else (1.0, share)
    if alone and first.unit == "1":
        shown = (1.0, share)
    if name == cam.anchor_distance:
        return [AnchorCause(name, *shown, unit, source, relative, spread)]
    if name.startswith(f"{cam.name}.") and name != cam.elements:
        return [ProfileCause(name, *shown, unit, source, relative, spread, numbers)]
    return [NumberCause(name, *shown, unit, source, relative, spread, numbers)]


def _of_the_edge(name: str, whole: _Assumed) -> list[Cause]:
    """Return the causes of a contour error; one of an edge is shared equally by an offset and two waves."""
    if not name.endswith(".contour"):
        return [WaveCause(name, 0.0, whole.deviation, "mm", whole.source, False, whole.spread, 0)]
    size = whole.deviation / math.sqrt(3.0)
    causes: list[Cause] = []
    for order, (part, scale) in enumerate(
        [("offset", 1.0), ("half_wave", math.sqrt(2)), ("wave", math.sqrt(2))]
    ):
        causes.append(
            WaveCause(f"{name}.{part}", 0.0, scale * size, "mm", whole.source, False, whole.spread, order)
        )
    return causes


def _given_spread(name: str, given: Spread | Quantity | float, unit: str) -> Spread:
    """Return a spread that replaces another; a number is one standard deviation of a normal distribution."""
    if isinstance(given, Spread):
        return given
    size = in_si(f"spread of {name}", given, unit)
    return NormalSpread(size) if size > 0.0 else EXACT
