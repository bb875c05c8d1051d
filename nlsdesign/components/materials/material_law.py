"""From what the library knows of a rubber to laws, strength, and a piece of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ...foundation.errors import ArrangementError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.rubber_library import Material, Property, materials
from ..core.dampers import ViscousMaterial
from ..core.element import Element, Range
from ..core.part_numbers import NotDeclared, Reading
from ..core.series import series
from ..core.springs import FittedLaw, FittedRange, LinearElastic, StrainStiffening
from .curve_fit import fit_curve
from .hyperelastic import NeoHooke, Ogden
from .quasilinear import QuasilinearRelaxation
from .specimen import Specimen, Strength, specimen

_CURVE, _ENGAGING, _OGDEN, _GAUSS = "nominal_stress", "engaging_moduli", "ogden_moduli", "shear_modulus"
"""How the names of properties begin from which an elastic law can be made."""


@dataclass(frozen=True)
class MaterialLaw:
    """The laws of a rubber of the library, and what it bears."""

    material: Material
    using: str  # name of the property that the elastic law comes from
    # members: laws of stress and strain that act in parallel: stiff, and relaxing where it is known
    members: tuple[tuple[str, Element], ...]
    # strength: tensile strength and elongation at break; where the library does not have them, the end of the
    # measured curve, which the rubber bears at least; not declared where there is no curve
    strength: Reading
    # rms_error, worst_error: of the stress over the points of the curve, relative; None where no curve was
    # fitted
    rms_error: float | None = None
    worst_error: float | None = None

    @property
    def strains(self) -> Range:
        """Least and greatest strain for which the elastic law is stated to hold."""
        return self._elastic.valid

    @property
    def _elastic(self) -> Element:
        """The elastic law, also where it stands inside one that relaxes."""
        law = self.members[0][1]
        return law.members[0][1] if isinstance(law, QuasilinearRelaxation) else law

    def in_place_of(self, piece: Specimen) -> Specimen:
        """Return a piece of this rubber with section and rest length of another."""
        return replace(piece, members=self.members, strength=self.strength)

    def __str__(self) -> str:
        law, (low, high) = self._elastic, self.strains
        more = "".join(f", {name}" for name, each in self.members if each is not law)
        text = (
            f"{self.material.name}: {type(law).__name__} from {self.using}{more}, strain {low:g} to {high:g}"
        )
        if self.rms_error is None or self.worst_error is None:
            return text
        rms, worst = 100 * self.rms_error, 100 * self.worst_error
        return f"{text}, off the curve by {rms:.2g} % rms, {worst:.2g} % at worst"


def missing_law(material: Material) -> str:
    """Return why a rubber gives no elastic law; empty where it gives one.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> missing_law(material("EPDM"))
    'has no elastic law: only loss tangent known'
    """
    if any(_gives_law(material, each) for each in material.properties):
        return ""
    known = ", ".join(each.name.replace("_", " ") for each in material.properties)
    return f"has no elastic law: only {known} known"


def law_of(material: Material, *, using: str | None = None) -> MaterialLaw:
    """Return the laws of a rubber: fitted to its measured curve, or made from its constants.

    A curve of nominal stress is fitted (:func:`fit_curve`); engaging moduli become a
    :class:`StrainStiffening`, with the Maxwell branch of the same publication; moduli and exponents of
    Ogden, or a shear modulus, become their laws.

    Parameters
    ----------
    material
        Of the library.
    using
        Name of the property that the law is to come from; by default the first one in the library.

    Raises
    ------
    ArrangementError
        If nothing that is known of the rubber gives an elastic law, as where only a loss tangent is.
    UnknownNameError
        If it has no such property that gives one.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> print(law_of(material("PMC-770"), using="engaging_moduli_2015"))
    PMC-770: StrainStiffening from engaging_moduli_2015, relaxing, strain 0 to 0.28
    """
    if reason := missing_law(material):
        having = [name for name, other in materials().items() if not missing_law(other)]
        raise ArrangementError(
            f"material '{material.name}'", reason,
            next_step=f"take one with a measured curve or constants: {', '.join(having)}; or add its curve",
        )  # fmt: skip
    known = [p.name for p in material.properties if _gives_law(material, p)]
    if using is not None and using not in known:
        raise unknown_name(f"{material.name}: property that gives an elastic law", using, known)
    chosen = material[using or known[0]]
    strength = _strength(material)
    if not chosen.name.startswith(_CURVE):
        return MaterialLaw(material, chosen.name, _from_constants(material, chosen), strength)
    fit = fit_curve(
        chosen.conditions["strain"].values,
        chosen.quantity.values,
        like=_cited(material, chosen, "fitted to "),
    )
    return MaterialLaw(material, chosen.name, (("stiff", fit.law),), strength, fit.rms_error, fit.worst_error)


def material_laws(path: Path | None = None) -> dict[str, MaterialLaw]:
    """Return the laws of all rubbers of a library that have one, by name."""
    everything = materials(path).items()
    return {name: law_of(m) for name, m in everything if any(_gives_law(m, p) for p in m.properties)}


def rubber_of(
    material: Material,
    *,
    rest_length: Quantity | float,
    area: Quantity | float | None = None,
    section: Reading | None = None,
    using: str | None = None,
) -> Specimen:
    """Make a piece of a rubber of the library, with its laws and its strength.

    Parameters
    ----------
    material
        Of the library, for instance ``material("Dragon_Skin_30")``.
    rest_length, area, section
        As for :func:`specimen`.
    using
        As for :func:`law_of`.

    Raises
    ------
    ArrangementError
        If nothing that is known of the rubber gives an elastic law, or the section is not given once.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> piece = rubber_of(material("natural_rubber_treloar"), area=1e-4, rest_length=0.02)
    >>> [name for name, _ in piece.members]
    ['stiff']
    """
    law = law_of(material, using=using)
    return specimen(
        rest_length=rest_length, area=area, section=section, strength=law.strength, **dict(law.members)
    )


def _gives_law(material: Material, known: Property) -> bool:
    if known.name.startswith((_CURVE, _ENGAGING)):
        return isinstance(known.quantity.value, tuple) and "strain" in known.conditions
    if known.name.startswith(_OGDEN):
        return known.name.replace("moduli", "exponents") in material
    return known.name.startswith(_GAUSS) and known.evidence != "range"


def _cited(material: Material, known: Property, how: str = "") -> Quantity:
    """Return what is known, with a source that says of which rubber and from which property."""
    return replace(known.quantity, source=f"{how}{material.name}, {known.name}: {known.quantity.source}")


def _from_constants(material: Material, known: Property) -> tuple[tuple[str, Element], ...]:
    if known.name.startswith(_ENGAGING):
        # Moduli that engage, and the branch of the same publication: names that end alike.
        moduli, end = _cited(material, known), known.name.removeprefix(_ENGAGING)
        strain = known.conditions["strain"]
        reach = f"largest_strain{end}"
        data: Reading = NotDeclared()
        if reach in material:
            data = FittedRange(_cited(material, material[reach]))
        knots = replace(strain, source=moduli.source)
        members: tuple[tuple[str, Element], ...] = (
            ("stiff", StrainStiffening(modulus=moduli, knots=knots, data=data)),
        )
        names = f"relaxing_modulus{end}", f"viscosity{end}"
        if all(name in material for name in names):
            modulus, viscosity = (_cited(material, material[name]) for name in names)
            spring, dashpot = LinearElastic(modulus=modulus), ViscousMaterial(viscosity=viscosity)
            members += (("relaxing", series(spring=spring, dashpot=dashpot)),)
        return members
    law: FittedLaw
    if known.name.startswith(_OGDEN):
        exponents = material[known.name.replace("moduli", "exponents")]
        law = Ogden(moduli=_cited(material, known), exponents=_cited(material, exponents))
    else:
        law = NeoHooke(shear_modulus=_cited(material, known))
    return (("stiff", law),)


def _strength(material: Material) -> Reading:
    stress, strain = _ends_of_curves(material)
    if "ultimate_stress" in material:
        stress = _cited(material, material["ultimate_stress"])
    if "ultimate_strain" in material:
        strain = _cited(material, material["ultimate_strain"])
    if stress is None or strain is None:
        return NotDeclared()
    return Strength(tensile_strength=stress, elongation_at_break=strain)


def _ends_of_curves(material: Material) -> tuple[Quantity | None, Quantity | None]:
    """Return the largest stress and strain of measured curves, which the rubber bears at least."""
    curves = [p for p in material.properties if p.name.startswith(_CURVE) and _gives_law(material, p)]
    if not curves:
        return None, None
    furthest = max(curves, key=lambda p: p.conditions["strain"].values[-1])
    cited = _cited(material, furthest, "assumed: at least this, for the curve goes on to it, ")
    strain = furthest.conditions["strain"]
    return (
        Quantity(furthest.quantity.values[-1], furthest.quantity.unit, cited.source, cited.spread),
        Quantity(strain.values[-1], strain.unit, cited.source),
    )
