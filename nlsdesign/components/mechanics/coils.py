"""Coil springs of round wire: what a maker states of one, or what follows from its wire."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self, TypeVar

import casadi as ca

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, quantity
from ...foundation.symbolic import Expression, positive_part
from ..core.domain import TRANSLATION, Domain
from ..core.element import Range, Scope
from ..core.part_numbers import NotDeclared, Reading, parameter, read_as, templates
from ..core.springs import Elastic, Spring

Size = TypeVar("Size", float, Expression)
INDEX = (4.0, 16.0)
"""Least and greatest spring index D/d: below wire cracks as it is coiled, above coils tangle."""
SETS = 0.45
"""Shear stress over tensile strength from which coils of cold-drawn wire set: Budynas and Nisbett 2015, Table
10-6 for pushed coils before the set is removed, Table 10-7 for pulled ones."""
STEEL = 7850.0
"""Density of spring steel in kg/m³, by which a stated mass becomes a volume of wire."""
_ROUNDED = 0.1
"""Width over which the opening of the coils is rounded, relative to the opening."""
_MILLIMETRE = 1e-3


@dataclass(frozen=True)
class CoilRate(Reading):
    """Base of the ways to state the rate of a coil."""

    @abstractmethod
    def inside(self, scope: Scope) -> Expression:
        """Return the rate k in N/m in the symbols of the coil."""


@dataclass(frozen=True)
class StatedRate(CoilRate):
    """The rate as the maker states it.

    Examples
    --------
    >>> StatedRate(rate=3000.0).rate
    3000.0
    """

    rate: Quantity = parameter("N/m", "rate k", minimum=1.0, maximum=1e7)

    def inside(self, scope: Scope) -> Expression:
        """Return the number.

        Parameters
        ----------
        scope
            Of the coil.
        """
        return scope.parameter("rate")


@dataclass(frozen=True)
class Winding(CoilRate):
    """Round wire wound to a coil: k = G·d⁴/(8·D³·n), a bar in torsion along the whole of the wire.

    Source: Budynas and Nisbett 2015, eq. (10-9).

    Raises
    ------
    ValueRangeError
        If the spring index D/d lies outside 4 to 16.

    Examples
    --------
    >>> Winding(wire_diameter=2e-3, mean_diameter=20e-3, active_coils=10.0, shear_modulus=80e9).active_coils
    10.0
    """

    wire_diameter: Quantity = parameter("m", "diameter d of the wire", minimum=1e-4, maximum=0.02)
    mean_diameter: Quantity = parameter(
        "m", "mean diameter D of the coils, that of their centre line", minimum=4e-4, maximum=0.3
    )
    active_coils: Quantity = parameter("1", "number n of coils that twist", minimum=2.0, maximum=500.0)
    shear_modulus: Quantity = parameter("Pa", "shear modulus G of the wire", minimum=1e9, maximum=1.5e11)

    def within(self, domain: Domain | None) -> Self:
        """Return a copy whose numbers and spring index are checked.

        Parameters
        ----------
        domain
            Of the coil.

        Raises
        ------
        ValueRangeError
            If the spring index lies out of range.
        """
        checked = super().within(domain)
        d, mean = checked.wire_diameter, checked.mean_diameter
        index, (low, high) = mean.number / d.number, INDEX
        # A design ends on the bound, but for its tolerance.
        if not low * (1 - 1e-6) <= index <= high * (1 + 1e-6):
            end = low if index < low else high
            raise ValueRangeError(
                f"mean_diameter = {mean} with wire_diameter = {d}",
                f"the spring index {index:.3g} must lie in [{low:g}, {high:g}]",
                next_step=f"make the mean diameter {1e3 * end * d.number:.4g} mm, or the wire "
                f"{1e3 * mean.number / end:.4g} mm; an outside diameter is larger by one wire",
            )
        return checked

    def inside(self, scope: Scope) -> Expression:
        """Return G·d⁴/(8·D³·n).

        Parameters
        ----------
        scope
            Of the coil.
        """
        return wound_rate(*(scope.parameter(name) for name in templates(Winding)))

    @property
    def diameters(self) -> tuple[float, float]:
        """Diameter of the wire and mean diameter of the coils in m."""
        return self.wire_diameter.number, self.mean_diameter.number

    @property
    def rate(self) -> float:
        """The rate in N/m."""
        return wound_rate(*self.diameters, self.active_coils.number, self.shear_modulus.number)


def wound_rate(wire: Size, mean: Size, coils: Size, modulus: Size) -> Size:
    """Return G·d⁴/(8·D³·n)."""
    return modulus * wire**4 / (8 * mean**3 * coils)


def shear_stress(force: Size, wire: Size, mean: Size) -> Size:
    """Return the shear stress at the inside of a coil: 8·K·F·D/(π·d³), K = (4C + 2)/(4C − 3), C = D/d.

    K is the factor of Bergsträsser, within 1.4 % of Wahl's; it holds curvature and direct shear.
    """
    index = mean / wire
    return 8 * (4 * index + 2) / (4 * index - 3) * force * mean / (math.pi * wire**3)


def greatest_initial_tension(wire: float, mean: float) -> float:
    """Return the initial tension in N that coiling still gives: its upper preferred stress, eq. (10-41).

    ``wire``, ``mean``: diameters in m.
    """
    index, psi = mean / wire, 6894.757
    stress = psi * (33500.0 / math.exp(0.105 * index) + 1000.0 * (4.0 - (index - 3.0) / 6.5))
    return math.pi * wire**3 * stress / (8.0 * mean)


@dataclass(frozen=True)
class WireStrength(Reading):
    """Tensile strength of drawn wire over its diameter: S = S₁·(d/1 mm)^(−m); it does not enter the law.

    Source: Budynas and Nisbett 2015, eq. (10-14), Table 10-4.

    Examples
    --------
    >>> hard_drawn = WireStrength(strength_at_1_mm=1783e6, strength_exponent=0.19)
    >>> round(tensile_strength(hard_drawn.strength_at_1_mm, hard_drawn.strength_exponent, 0.889e-3) / 1e6)
    1823
    """

    strength_at_1_mm: Quantity = parameter(
        "Pa", "tensile strength S₁ of wire of 1 mm", minimum=1e8, maximum=5e9
    )
    strength_exponent: Quantity = parameter("1", "exponent m of its fall", minimum=0.0, maximum=0.5)


def tensile_strength(at_1_mm: Size, exponent: Size, wire: Size) -> Size:
    """Return the tensile strength of wire of a diameter in m; see :class:`WireStrength`."""
    strength: Size = at_1_mm * (wire / _MILLIMETRE) ** -exponent
    return strength


@dataclass(frozen=True)
class CoilMass(Reading):
    """Mass of the coil; a third of it would move with its end. The law is that of a coil without mass.

    Examples
    --------
    >>> CoilMass(mass=0.012).mass
    0.012
    """

    mass: Quantity = parameter("kg", "mass of the coil", minimum=1e-6, maximum=50.0)


@dataclass(frozen=True, kw_only=True)
class Coil(Elastic):
    """Base of coils that are pulled or pushed."""

    domain: ClassVar[Domain] = TRANSLATION
    idle: ClassVar[tuple[str, ...]]
    """Names of its own numbers that do not enter the law."""

    free_length: Quantity = parameter("m", "length without load", minimum=1e-3, maximum=2.0)
    winding: Reading = read_as(StatedRate, Winding)
    strength: Reading = read_as(NotDeclared, WireStrength, default=NotDeclared())
    weight: Reading = read_as(NotDeclared, CoilMass, default=NotDeclared())

    def of_no_law(self) -> tuple[str, ...]:
        """Return the names of all its numbers that do not enter the law."""
        return (*self.idle, *templates(type(self.strength)), *templates(type(self.weight)))

    def signals(self) -> tuple[str, ...]:
        """Return the names of the signals that follow from what is declared of wire and mass."""
        wound, weighed = isinstance(self.winding, Winding), isinstance(self.weight, CoilMass)
        strong = wound and isinstance(self.strength, WireStrength)
        known = (wound, strong, wound or weighed, weighed)
        names = ("shear_stress", "tensile_strength", "wire_volume", "surge_frequency")
        return tuple(name for name, is_known in zip(names, known, strict=True) if is_known)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return k·e and what closed coils add, and name what follows for the wire."""
        assert isinstance(self.winding, CoilRate)
        stiffness, named = self.winding.inside(scope), self.signals()
        force = stiffness * motion + self.closed(scope, motion)
        if "surge_frequency" in named:
            surge = ca.sqrt(stiffness / scope.parameter("mass")) / 2
            scope.signal("surge_frequency", surge, "Hz", f"lowest own frequency of {scope.path}, ends held")
        if isinstance(self.winding, Winding):
            wire, mean, coils = (scope.parameter(name) for name in list(templates(Winding))[:3])
            stress = shear_stress(force, wire, mean)
            scope.signal("shear_stress", stress, "Pa", f"shear stress at the inside of {scope.path}")
            volume = math.pi**2 / 4 * wire**2 * mean * coils
        else:
            wire, volume = ca.SX(0), scope.parameter("mass") / STEEL if "wire_volume" in named else ca.SX(0)
        if "tensile_strength" in named:
            first, exponent = (scope.parameter(name) for name in templates(WireStrength))
            strength = tensile_strength(first, exponent, wire)
            scope.signal("tensile_strength", strength, "Pa", f"tensile strength of {scope.path}")
        if "wire_volume" in named:
            scope.signal("wire_volume", volume, "m^3", f"volume of the wire of {scope.path} that twists")
        return force

    def remarks(self) -> Iterator[str]:
        """Yield what initial tension, free length and travel of such wire cannot be."""
        wound, travel = self.winding, self.valid[1]
        if not isinstance(wound, Winding):
            return
        wire, mean = wound.diameters
        tension = getattr(self, "initial_tension", Quantity(0.0, "N")).number
        greatest = greatest_initial_tension(wire, mean)
        if tension > greatest:
            yield (
                f"initial_tension: coiling such wire leaves {greatest:.4g} N at most, not {tension:.4g} N -> "
                f"write at most that, or wind closer coils: a smaller mean diameter"
            )
        closed = (wound.active_coils.number + 1.0) * wire
        if closed > self.free_length.number:
            yield (
                f"free_length: {wound.active_coils.number:g} coils of this wire are {1e3 * closed:.4g} mm "
                f"long when they touch, more than {self.free_length} -> write at least that"
            )
        if isinstance(self.strength, WireStrength):
            first, exponent = self.strength.strength_at_1_mm.number, self.strength.strength_exponent.number
            most = SETS * tensile_strength(first, exponent, wire) / shear_stress(1.0, wire, mean)
            if tension + wound.rate * travel > most:
                length = 1e3 * max(most - tension, 0.0) / wound.rate
                yield (
                    f"{self.idle[1]}: over a travel of {1e3 * travel:.4g} mm the wire bears more than "
                    f"{SETS:g} of its tensile strength, and sets -> let it travel {length:.4g} mm at most"
                )

    @abstractmethod
    def closed(self, scope: Scope, motion: Expression) -> Expression:
        """Return the force beside k·e, that of coils which touch."""


@dataclass(frozen=True, kw_only=True)
class ExtensionCoil(Coil):
    """A closely wound coil that is pulled: F = k·e + F₀·min(e/e₀, 1), with the extension e ≥ 0.

    F₀ is the initial tension with which the coils lie on each other; they open over e₀, rounded over a tenth
    of it, C∞, F(0) = 0; shorter than closed it is as stiff as closed. The rate is a :class:`StatedRate` or
    that of a :class:`Winding`. Valid up to the largest extension and well below the surge frequency
    ½·√(k/m). Its wire has the shear stress 8·K·F·D/(π·d³), K = (4C + 2)/(4C − 3), C = D/d; its hooks are not
    looked at. Source: Budynas and Nisbett 2015, eqs. (10-5), (10-7), (10-9), (10-25), sec. 10-11.

    Examples
    --------
    >>> pull = {"free_length": 45e-3, "initial_tension": 5.0, "largest_extension": 40e-3}
    >>> ExtensionCoil(winding=StatedRate(rate=1500.0), **pull).valid
    (0.0, 0.04)
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "initial tension"})
    idle: ClassVar[tuple[str, ...]] = ("free_length", "largest_extension")

    initial_tension: Quantity = parameter(
        "N", "force F₀ with which closed coils lie on each other", minimum=0.0, maximum=1e5
    )
    opening: Quantity = parameter(
        "m", "extension e₀ over which the coils open", minimum=1e-6, maximum=0.01, default=1e-4
    )
    largest_extension: Quantity = parameter("m", "largest extension", minimum=1e-4, maximum=2.0)

    @property
    def valid(self) -> Range:
        """From closed coils to the largest extension."""
        return 0.0, self.largest_extension.number

    def closed(self, scope: Scope, motion: Expression) -> Expression:
        """Return F₀·min(e/e₀, 1)."""
        opening = scope.parameter("opening")
        width = _ROUNDED * opening
        opened = motion - positive_part(motion - opening, width) + positive_part(-opening, width)
        return scope.parameter("initial_tension") * opened / opening


@dataclass(frozen=True, kw_only=True)
class CompressionCoil(Coil):
    """A coil that is pushed: F = k·e, where e ≥ 0 is by how much it is shorter than its free length.

    Behind a cam the cable goes through the coil and pulls its far end; between two bodies positive motion is
    that which shortens it. Valid up to L₀ − L_s, where the coils touch, without buckling, and well below the
    surge frequency ½·√(k/m). Its wire has the shear stress 8·K·F·D/(π·d³), K = (4C + 2)/(4C − 3), C = D/d.
    Source: Budynas and Nisbett 2015, eqs. (10-5), (10-7), (10-9), (10-25).

    Raises
    ------
    ValueRangeError
        If the solid length is not below the free length.

    Examples
    --------
    >>> push = {"free_length": 60e-3, "solid_length": 24e-3}
    >>> round(CompressionCoil(winding=StatedRate(rate=2000.0), **push).valid[1], 6)
    0.036
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"elasticity", "compression"})
    idle: ClassVar[tuple[str, ...]] = ("free_length", "solid_length")

    solid_length: Quantity = parameter("m", "length at which the coils touch", minimum=1e-4, maximum=2.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.solid_length.number >= self.free_length.number:
            raise ValueRangeError(
                f"solid_length = {self.solid_length}",
                f"must be below free_length = {self.free_length}",
                next_step="exchange the two, or count the coils again: about wire diameter times all coils",
            )

    @property
    def valid(self) -> Range:
        """From the free length to that at which the coils touch."""
        return 0.0, self.free_length.number - self.solid_length.number

    def closed(self, scope: Scope, motion: Expression) -> Expression:
        """Return none: beyond the solid length the law does not hold."""
        return ca.SX(0)


def torsion_coil(
    *,
    wire_diameter: Quantity,
    mean_diameter: Quantity,
    active_coils: float,
    youngs_modulus: Quantity,
    spread: float = 0.0,
) -> Spring:
    """Return a coil that is twisted as a spring of torque over angle: k = E·d⁴/(64·D·n), wire in bending.

    Without friction between the coils and on an arbor, by which coils seem 6 % softer. Source: Budynas and
    Nisbett 2015, sec. 10-12.

    Parameters
    ----------
    wire_diameter, mean_diameter
        Lengths.
    active_coils
        Number of coils, with the part of the legs that bends.
    youngs_modulus
        Of the wire, in a unit of stress.
    spread
        Of the stiffness, relative.

    Raises
    ------
    ValueRangeError
        If a number is out of range, or the spring index outside 4 to 16.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> torsion_coil(
    ...     wire_diameter=quantity(2.0, "mm"), mean_diameter=quantity(20.0, "mm"), active_coils=5.0,
    ...     youngs_modulus=quantity(206.0, "GPa"),
    ... ).title()
    'Spring(stiffness = 0.515 N·m/rad)'
    """
    # Wire and index are checked as those of a coil that is pulled; the shear modulus plays no part.
    shear = youngs_modulus.number / 2.6
    wound = Winding(wire_diameter, mean_diameter, active_coils, shear).within(None)  # type: ignore[arg-type]
    d, mean = wound.wire_diameter.number, wound.mean_diameter.number
    stiffness = youngs_modulus.number * d**4 / (64.0 * mean * wound.active_coils.number)
    source = f"E*d^4/(64*D*n) with {wire_diameter}, {mean_diameter}, n = {active_coils:g}, {youngs_modulus}"
    return Spring(stiffness=quantity(stiffness, "N*m/rad", source=source, spread=spread))
