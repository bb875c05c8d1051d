"""From what the library knows of a rubber to laws, strength, and a piece of it.

A law fitted to a measured curve of stress over strain; the form that follows the curve best is taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from pathlib import Path

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity, significant
from ...foundation.rubber_library import Material, Property, materials
from ...foundation.spread import EXACT, Spread
from ..core.contacts import Rounded
from ..core.element import Element, Range
from ..core.part_numbers import NotDeclared, Reading
from ..core.series import series
from ..core.springs import FittedLaw, FittedRange, LinearElastic, StrainStiffening, ViscousMaterial
from .hyperelastic import NeoHooke, Ogden, Yeoh
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

    ``material``: of the library. ``using``: name of the property that the law is to come from; by default the
    first one in the library.

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


_EXPONENTS = (
    *(-8.0, -6.0, -5.0, -4.0, -3.0, -2.5, -2.0),
    *(1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0),
)
"""Exponents that Ogden's law is put together from: each alone gives a stress that never falls."""
_MOST = 3
"""Most pairs of Ogden's law, and most moduli of a piecewise law."""
_DIGITS = 6
"""Significant digits of fitted constants."""
_ROUNDING = 0.3
"""Width of the rounded knots over the least distance of measured strains."""
_DENSE = 400
"""Points between zero and the last strain at which a cubic has to rise."""


@dataclass(frozen=True)
class CurveFit:
    """A law and how far it is from the curve that it was fitted to."""

    law: FittedLaw  # with the range of the curve
    # rms_error, worst_error: of the stress, relative to the measured one, over the points
    rms_error: float
    worst_error: float


def fit_curve(strains: Sequence[float], stresses: Sequence[float], *, like: Quantity) -> CurveFit:
    """Return the law that follows a measured curve best: least squares of the relative error of the stress.

    Tried are Yeoh's cubic, Ogden's law and moduli that engage at rounded knots, with at most one constant for
    each point and three pairs or moduli. Each is linear in its constants once its exponents or knots are
    chosen, so the least of all choices is found, without a start. A law whose stress falls within the range
    is not taken. The law is stated to hold up to the last strain. Sources: Yeoh 1993; Ogden 1972; Austin et
    al. 2015, eq. (1); Lawson and Hanson 1974 (least squares with constants that are not negative).
    """
    strain, stress = np.asarray(strains, dtype=float), np.asarray(stresses, dtype=float)
    if len(strain) < 2 or len(strain) != len(stress) or np.any(np.diff(strain, prepend=0.0) <= 0.0):
        raise ValueRangeError(
            f"curve with {len(strain)} strains and {len(stress)} stresses",
            "a curve has two points at least, one stress for each strain, and strains that ascend from zero",
        )
    if np.any(stress <= 0.0):
        raise ValueRangeError("curve with stresses of zero or less", "rubber in tension has positive stress")
    forms = (_yeoh(strain, stress, like), _ogden(strain, stress, like), _engaging(strain, stress, like))
    fits = []
    for law, values in chain(*forms):
        errors = values / stress - 1.0
        fits.append(CurveFit(law, float(np.sqrt(np.mean(errors**2))), float(np.max(np.abs(errors)))))
    # To a tenth of a per mille, so that what is alike stays in the order above on every processor.
    return min(fits, key=lambda fit: round(fit.rms_error, 4))


def _yeoh(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    if len(strain) < _MOST:
        return
    columns = _yeoh_columns(strain)
    solution, *_ = np.linalg.lstsq(columns / stress[:, None], np.ones(len(stress)), rcond=None)
    constants = _short(np.asarray(solution, dtype=float))
    rising = np.diff(_yeoh_columns(np.linspace(0.0, strain[-1], _DENSE)) @ constants)
    if constants[0] > 0.0 and np.all(rising > 0.0):
        c1, c2, c3 = (_constant((float(c),), "Pa", like, row=False) for c in constants)
        yield Yeoh(c1=c1, c2=c2, c3=c3, data=_range(strain, like)), columns @ constants


def _yeoh_columns(strain: Array) -> Array:
    stretch = 1.0 + strain
    first, slope = stretch**2 + 2.0 / stretch - 3.0, 2.0 * stretch - 2.0 / stretch**2
    return np.stack([slope, 2.0 * first * slope, 3.0 * first**2 * slope], axis=1)


def _ogden(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    stretch, exponents = 1.0 + strain[:, None], np.array(_EXPONENTS)
    columns = np.sign(exponents) * (stretch ** (exponents - 1.0) - stretch ** (-exponents / 2.0 - 1.0))
    chosen, sizes = _fewest(columns, stress, first=())
    moduli = sizes * np.sign(exponents[chosen])
    law = Ogden(
        moduli=_constant(tuple(map(float, moduli)), "Pa", like),
        exponents=_constant(tuple(map(float, exponents[chosen])), "1", like, spread=EXACT),
        data=_range(strain, like),
    )
    yield law, columns[:, chosen] @ sizes


def _engaging(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    width = significant([_ROUNDING * float(np.min(np.diff(strain)))], 2)[0]
    knots = np.array([0.0, *strain[:-1]])
    rounded = _positive(strain[:, None] - knots, width) - _positive(-knots, width)
    columns = np.where(knots == 0.0, strain[:, None], rounded)
    chosen, sizes = _fewest(columns, stress, first=(0,))
    law = StrainStiffening(
        modulus=_constant(tuple(map(float, sizes)), "Pa", like),
        knots=_constant(tuple(map(float, knots[chosen])), "1", like, spread=EXACT),
        contact=Rounded(Quantity(width, "1", "assumed: a share of the distance of the measured strains")),
        data=_range(strain, like),
    )
    yield law, columns[:, chosen] @ sizes


def _positive(value: Array, width: float) -> Array:
    return width * np.logaddexp(0.0, value / width)


def _fewest(columns: Array, stress: Array, *, first: tuple[int, ...]) -> tuple[list[int], Array]:
    """Return the columns that follow a curve best with sizes that are not negative, and the sizes.

    ``columns``: shape (n, m).
    """
    from scipy.optimize import nnls  # a list of parts needs no SciPy

    count = max(1, min(_MOST, len(stress) // 2))
    relative, ones = columns / stress[:, None], np.ones(len(stress))
    rest = [i for i in range(columns.shape[1]) if i not in first]
    choices = [[*first, *more] for more in combinations(rest, max(0, count - len(first)))]
    chosen = min(choices, key=lambda choice: round(float(nnls(relative[:, choice], ones)[1]), 9))
    sizes, _ = nnls(relative[:, chosen], ones)
    kept = [(i, size) for i, size in zip(chosen, _short(sizes), strict=True) if size > 0.0]
    return [i for i, _ in kept], np.array([size for _, size in kept])


def _short(constants: Array) -> Array:
    """Return constants rounded each by itself: a small one can act at a large power."""
    return np.array([significant([constant], _DIGITS)[0] for constant in constants])


def _constant(
    values: tuple[float, ...], unit: str, like: Quantity, *, row: bool = True, spread: Spread | None = None
) -> Quantity:
    return Quantity(
        values if row else values[0], unit, like.source, like.spread if spread is None else spread
    )


def _range(strain: Array, like: Quantity) -> FittedRange:
    return FittedRange(Quantity(float(strain[-1]), "1", like.source))
