"""A piece of material: from stress and strain to force and extension."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, TRANSLATION, Domain
from ..core.element import Combination, Element, Scope
from ..core.part_numbers import NotDeclared, Reading, parameter, read_as, templates


@dataclass(frozen=True)
class CrossSection(Reading):
    """Base of the ways to state the cross-section of a piece: as the product of numbers."""

    @property
    def square_metres(self) -> float:
        """The cross-section in m²."""
        return float(math.prod(getattr(self, name).number for name in templates(type(self))))

    def inside(self, scope: Scope) -> Expression:
        """Return the cross-section in m² in the symbols of a piece.

        Parameters
        ----------
        scope
            Of the piece.
        """
        first, *others = (scope.parameter(name) for name in templates(type(self)))
        for other in others:
            first = first * other
        return first


@dataclass(frozen=True)
class Area(CrossSection):
    """A cross-section of any form, A₀.

    Examples
    --------
    >>> Area(area=1e-4).area
    0.0001
    """

    area: Quantity = parameter("m^2", "cross-section of the unstretched piece", minimum=1e-8, maximum=1e-2)


@dataclass(frozen=True)
class Strip(CrossSection):
    """A strip cut from sheet, A₀ = width · thickness.

    Examples
    --------
    >>> Strip(width=30e-3, thickness=3.4e-3).thickness
    0.0034
    """

    width: Quantity = parameter("m", "width of the unstretched strip", minimum=1e-4, maximum=0.5)
    thickness: Quantity = parameter("m", "thickness of the unstretched strip", minimum=1e-5, maximum=0.05)


@dataclass(frozen=True)
class Strength(Reading):
    """What the material of a piece bears once; it does not enter the law. Source: ISO 37 (both terms).

    Examples
    --------
    >>> Strength(tensile_strength=5.17e6, elongation_at_break=5.0).elongation_at_break
    5.0
    """

    tensile_strength: Quantity = parameter("Pa", "nominal stress at break", minimum=1e3, maximum=1e9)
    elongation_at_break: Quantity = parameter("1", "strain at break", minimum=0.01, maximum=20.0)


@dataclass(frozen=True)
class TensionSet(Reading):
    """What is left of a strain that lasted; it does not enter the law. Source: ISO 2285.

    Examples
    --------
    >>> TensionSet(tension_set=0.05).tension_set
    0.05
    """

    tension_set: Quantity = parameter("1", "part of a lasting strain that stays", minimum=0.0, maximum=0.9)


@dataclass(frozen=True, kw_only=True)
class Specimen(Combination):
    """A piece of material: ε = e/L₀, F = A₀·Σσ of the laws inside, which act in parallel.

    Nominal stress and nominal strain, as in the paper: A₀ and L₀ are those of the unstretched piece. The
    section is an :class:`Area` or a :class:`Strip`; a :class:`Strength` may be declared, for limits, and a
    :class:`TensionSet`, for tolerances.
    Source: Austin et al. 2015, eq. (1), with a = A₀/L₀.
    """

    domain: ClassVar[Domain] = TRANSLATION
    takes: ClassVar[tuple[Domain, ...]] = (MATERIAL,)
    placing: ClassVar[str | None] = "use for instance LinearElastic instead of Spring"
    picture: ClassVar[str] = "none"
    phenomena: ClassVar[frozenset[str]] = frozenset({"specimen"})

    rest_length: Quantity = parameter("m", "length of the unstretched piece", minimum=1e-4, maximum=1.0)
    section: Reading = read_as(Area, Strip)
    strength: Reading = read_as(NotDeclared, Strength, default=NotDeclared())
    lasting: Reading = read_as(NotDeclared, TensionSet, default=NotDeclared())

    @property
    def cross_section(self) -> CrossSection:
        """The section, as what has an area."""
        assert isinstance(self.section, CrossSection)
        return self.section

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = A₀·Σσ(e/L₀)."""
        length = scope.parameter("rest_length")
        stress = self.inside(scope, motion / length, rate / length)
        scope.signal("strain", motion / length, "1", f"strain of {scope.path}")
        return self.cross_section.inside(scope) * stress


def specimen(
    *,
    rest_length: Quantity | float,
    area: Quantity | float | None = None,
    section: Reading | None = None,
    strength: Reading | None = None,
    **laws: Element,
) -> Specimen:
    """Make a piece of material from laws of stress and strain that act in parallel.

    Parameters
    ----------
    rest_length
        Unstretched length in m.
    area
        Cross-section in m².
    section
        In place of the area, for instance ``Strip(width=..., thickness=...)``.
    strength
        What the material bears, ``Strength(...)``; not declared by default.
    **laws
        Elements by name.

    Raises
    ------
    ArrangementError
        If there is neither area nor section, or both.

    Examples
    --------
    >>> from nlsdesign.components import LinearElastic, Strip
    >>> strip = Strip(width=30e-3, thickness=3.4e-3)
    >>> specimen(section=strip, rest_length=12.5e-3, law=LinearElastic(modulus=1e6)).title()
    'Specimen(rest_length = 0.0125 m, width = 0.03 m, thickness = 0.0034 m)'
    """
    if (area is None) == (section is None):
        raise ArrangementError(
            "specimen",
            "has no cross-section" if area is None else "has an area and a section",
            next_step="give either area=..., or section=Strip(width=..., thickness=...)",
        )
    return Specimen(
        section=Area(area) if section is None else section,  # type: ignore[arg-type]
        rest_length=rest_length,  # type: ignore[arg-type]
        strength=strength or NotDeclared(),
        members=tuple(laws.items()),
    )
