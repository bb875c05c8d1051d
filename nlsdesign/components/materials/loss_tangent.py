"""From a loss tangent to relaxation, with the error of a few branches; what the library knows of it.

A piece of a rubber of the library that relaxes with the loss that is known of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.rubber_library import Material, Property, materials
from ..core.element import Element
from ..core.part_numbers import Reading
from .material_law import MaterialLaw, law_of
from .quasilinear import QuasilinearRelaxation, relaxation_factor
from .specimen import Specimen, specimen

LOSS_TANGENT = "loss_tangent"
"""How the names of properties begin that are a loss tangent."""
BAND = (0.1, 10.0)
"""Frequencies in Hz between which the loss tangent of rubber in a torque loop matters."""
_LARGEST = 2.0
_SEEN = 200
_MOST = 12
_MARGIN = 1.6
"""The branches reach beyond the band by this factor on either side."""


@dataclass(frozen=True)
class Relaxation:
    """Shares and times of branches that give a loss tangent, and how well.

    Parameters
    ----------
    shares
        Over the modulus at equilibrium, shape (n,).
    times
        In s, shape (n,).
    frequencies, loss_tangents
        What was wanted, shape (m,) each.
    """

    shares: tuple[float, ...]
    times: tuple[float, ...]
    frequencies: tuple[float, ...]
    loss_tangents: tuple[float, ...]

    def factor(self, frequency: Array | float) -> NDArray[np.complex128]:
        """Return the complex modulus over that at equilibrium.

        Parameters
        ----------
        frequency
            In Hz, any shape.
        """
        return relaxation_factor(np.array(self.shares), np.array(self.times), frequency)

    @property
    def largest_error(self) -> float:
        """Largest relative error of the loss tangent at the frequencies that were wanted."""
        made = self.factor(np.array(self.frequencies))
        return float(np.max(np.abs(made.imag / made.real / np.array(self.loss_tangents) - 1.0)))

    def __str__(self) -> str:
        low, high = self.frequencies[0], self.frequencies[-1]
        where = f"at {low:g} Hz" if low == high else f"from {low:g} to {high:g} Hz"
        return (
            f"{len(self.shares)} branch{'es' if len(self.shares) > 1 else ''}, loss tangent "
            f"{min(self.loss_tangents):g}"
            + (f" to {max(self.loss_tangents):g}" if len(set(self.loss_tangents)) > 1 else "")
            + f" {where} within {max(100 * self.largest_error, 0.1):.2g} %"
        )


def flat_relaxation(
    loss_tangent: float, *, band: tuple[float, float] = BAND, tolerance: float = 0.05, branches: int = 0
) -> Relaxation:
    """Return branches whose loss tangent hardly changes over a band of frequencies.

    Relaxation times are spaced evenly in their logarithm over a little more than the band; the shares follow
    from least squares with none negative, since tan δ = t is linear in them. Below the band the rubber
    relaxes to its equilibrium, above it no longer does. A flat loss tangent has a price: the modulus rises by
    about 2·tan δ/π per unit of ln ω, so rubber with much loss is much stiffer in motion than at rest.
    Sources: Tschoegl 1989 (Prony series); Lawson and Hanson 1974 (least squares).

    Parameters
    ----------
    loss_tangent
        Wanted, above 0 and at most 2.
    band
        Its ends in Hz.
    tolerance
        Largest relative error of the loss tangent within the band that is good enough; the fewest branches
        that reach it are taken.
    branches
        Their number, where it is to be the same whatever the loss tangent; 0 for the fewest.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range, or so many branches are not enough.

    Examples
    --------
    >>> print(flat_relaxation(0.1))
    4 branches, loss tangent 0.1 from 0.1 to 10 Hz within 2.6 %
    """
    wanted = _loss_tangents((loss_tangent,))[0]
    low, high = band
    if not 0.0 < low < high:
        raise ValueRangeError(f"band from {low:g} to {high:g} Hz", "must rise from a frequency above zero")
    frequencies = np.geomspace(low, high, _SEEN)
    best = None
    for number in (branches,) if branches else range(2, _MOST + 1):
        corners = np.geomspace(low / _MARGIN, high * _MARGIN, number)
        made = _fitted(frequencies, np.full(_SEEN, wanted), 1.0 / (2.0 * np.pi * corners))
        best = made if best is None or made.largest_error < best.largest_error else best
        if made.largest_error <= tolerance:
            return made
    error = np.inf if best is None else best.largest_error
    raise ValueRangeError(
        f"loss tangent {wanted:g} from {low:g} to {high:g} Hz",
        f"is met within {100 * error:.2g} % only, {100 * tolerance:.2g} % are asked for",
        next_step="take a narrower band, more branches or a larger tolerance",
    )


def peaked_relaxation(loss_tangent: float, frequency: float) -> Relaxation:
    """Return the one branch whose loss tangent has its peak of a given height at a frequency.

    That is the standard linear solid, to be taken where one number at one frequency is all that is known: at
    other frequencies it says less loss than rubber has. With share g the peak is g/(2·√(1 + g)) high.
    Source: Zener 1948.

    Parameters
    ----------
    loss_tangent
        At the peak, above 0 and at most 2.
    frequency
        Of the peak, in Hz.

    Raises
    ------
    ValueRangeError
        If a number lies outside its range.

    Examples
    --------
    >>> len(peaked_relaxation(0.1, 1.0).times)
    1
    """
    wanted = _loss_tangents((loss_tangent,))[0]
    if not 0.0 < frequency < np.inf:
        raise ValueRangeError(f"frequency {frequency:g} Hz", "must be above zero")
    share = 2.0 * wanted * (wanted + np.sqrt(1.0 + wanted**2))
    time = 1.0 / (2.0 * np.pi * frequency * np.sqrt(1.0 + share))
    return Relaxation((float(share),), (float(time),), (float(frequency),), (wanted,))


def measured_relaxation(frequencies: Sequence[float], loss_tangents: Sequence[float]) -> Relaxation:
    """Return branches that follow a measured loss tangent over the frequency; two per decade.

    Parameters
    ----------
    frequencies
        In Hz, ascending, shape (m,), m ≥ 2.
    loss_tangents
        Shape (m,).

    Raises
    ------
    ValueRangeError
        If the points do not ascend, or a loss tangent lies outside its range.
    """
    at, wanted = np.asarray(frequencies, dtype=float), np.array(_loss_tangents(loss_tangents))
    if len(at) < 2 or len(at) != len(wanted) or at[0] <= 0.0 or np.any(np.diff(at) <= 0.0):
        raise ValueRangeError(
            f"loss tangent with {len(at)} frequencies and {len(wanted)} values",
            "needs two points at least, one value for each frequency, and frequencies that ascend from zero",
        )
    number = min(len(at), int(np.ceil(2.0 * np.log10(at[-1] / at[0]))) + 1)
    corners = np.geomspace(at[0] / _MARGIN, at[-1] * _MARGIN, max(number, 2))
    return _fitted(at, wanted, 1.0 / (2.0 * np.pi * corners))


def _loss_tangents(given: Sequence[float]) -> tuple[float, ...]:
    for value in given:
        if not 0.0 < value <= _LARGEST:
            raise ValueRangeError(
                f"loss tangent {value:g}", f"must lie above 0 and at most at {_LARGEST:g}",
                next_step="leave the relaxation out for rubber without loss",
            )  # fmt: skip
    return tuple(float(value) for value in given)


def _fitted(frequencies: Array, wanted: Array, times: Array) -> Relaxation:
    from scipy.optimize import nnls  # a list of parts needs no SciPy

    turn = 2.0 * np.pi * frequencies[:, None] * times
    lost, stored = turn / (1.0 + turn**2), turn**2 / (1.0 + turn**2)
    # tan δ = Σ gᵢ·lᵢ/(1 + Σ gᵢ·sᵢ) = t  ⇔  Σ gᵢ·(lᵢ − t·sᵢ) = t
    shares, _ = nnls((lost - wanted[:, None] * stored) / wanted[:, None], np.ones(len(wanted)))
    rows = (shares, times, frequencies, wanted)
    return Relaxation(*(tuple(map(float, row)) for row in rows))


class KnownLoss(NamedTuple):
    """What the library knows of the loss of a rubber.

    Parameters
    ----------
    known
        The property of the library.
    of
        Name of the entry that it is taken from: the rubber itself, or the one that stands for its family.
    lower, upper
        Least and greatest loss tangent; equal where one number or a measured curve is known.
    """

    known: Property
    of: str
    lower: float
    upper: float

    def drawn(self, count: int, seed: int = 1) -> Array:
        """Return draws of the loss tangent, evenly distributed between its ends, shape (count,).

        A range says nothing of what lies between its ends, so each value counts alike.

        Parameters
        ----------
        count
            Number of draws.
        seed
            Of the generator of random numbers.
        """
        return np.random.default_rng(seed).uniform(self.lower, self.upper, count)

    @property
    def middle(self) -> float:
        """Mean of both ends."""
        return 0.5 * (self.lower + self.upper)

    def __str__(self) -> str:
        return f"{self.known.shown}, {self.known.evidence} of {self.of}: {self.known.quantity.source}"


def loss_of(
    material: Material, *, using: str | None = None, library: Mapping[str, Material] | None = None
) -> KnownLoss:
    """Return what is known of the loss of a rubber: its own, else that of its family.

    Of several properties the one is taken that states a frequency within 0.1 to 10 Hz, else the first.

    Parameters
    ----------
    material
        Of the library.
    using
        Name of the property, where another one is wanted.
    library
        Where the family is looked for; the library that comes with the project if it is left out.

    Raises
    ------
    ArrangementError
        If neither the rubber nor another of its family has a loss tangent.
    UnknownNameError
        If it has no such property.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> known = loss_of(material("Dragon_Skin_30"))
    >>> known.of, known.lower, known.upper
    ('silicone', 0.1, 0.3)
    """
    others = [m for m in (library or materials()).values() if m.family == material.family]
    having = [m for m in (material, *others) if _losses(m)]
    if not having:
        known = [name for name, m in (library or materials()).items() if _losses(m)]
        raise ArrangementError(
            f"material '{material.name}'", f"has no loss tangent, nor has another {material.family}",
            next_step=f"give loss_tangent=..., or take one of: {', '.join(known)}",
        )  # fmt: skip
    owner = having[0]
    losses = _losses(owner)
    if using is not None and using not in losses:
        raise unknown_name(f"{owner.name}: loss tangent", using, losses)
    chosen = losses[using] if using is not None else next(filter(_in_band, losses.values()), None)
    chosen = chosen or next(iter(losses.values()))
    values = chosen.quantity.values
    return KnownLoss(chosen, owner.name, min(values), max(values))


def relaxation_of(loss: KnownLoss) -> Relaxation:
    """Return the relaxation that the library's knowledge of a loss gives.

    A measured curve over the frequency is followed; one number at one frequency gives the standard linear
    solid with its peak there; a range, or a number without a frequency, gives a flat loss tangent from 0.1 to
    10 Hz.
    """
    values = loss.known.quantity.values
    frequency = loss.known.conditions.get("frequency")
    if loss.known.evidence == "range" or frequency is None:
        return flat_relaxation(loss.middle)
    if len(values) == 1:
        return peaked_relaxation(values[0], frequency.values[0])
    return measured_relaxation(frequency.values, values)


def _losses(material: Material) -> dict[str, Property]:
    return {p.name: p for p in material.properties if p.name.startswith(LOSS_TANGENT)}


def _in_band(known: Property) -> bool:
    frequency = known.conditions.get("frequency")
    return frequency is not None and max(frequency.values) >= BAND[0] and min(frequency.values) <= BAND[1]


RELAXING = "relaxing"
"""Name of the law that relaxes, beside those of a deck."""


def relaxing_law_of(
    material: Material,
    *,
    loss_tangent: float | Relaxation | None = None,
    using: str | None = None,
) -> MaterialLaw:
    """Return the laws of a rubber of the library with the loss that is known of it.

    The elastic law of :func:`law_of` is taken as that of equilibrium: a tensile test is slow against the
    frequencies at which rubber in a torque loop works. It relaxes by the same shares at every strain
    (:class:`QuasilinearRelaxation`). A branch that the library gives for the rubber itself is replaced.

    Parameters
    ----------
    material
        Of the library, for instance ``material("Dragon_Skin_30")``.
    loss_tangent
        From 0.1 to 10 Hz; or a relaxation of one's own, see :func:`flat_relaxation`. If it is left out, what
        the library knows of the rubber or of its family, of a range the middle.
    using
        As for :func:`law_of`.

    Raises
    ------
    ArrangementError
        If nothing that is known of the rubber gives an elastic law, or no loss tangent is known nor given.
    ValueRangeError
        If the loss tangent is not above 0 and at most 2.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> print(str(relaxing_law_of(material("Dragon_Skin_30"))).partition(", strain")[0])
    Dragon_Skin_30: StrainStiffening from nominal_stress, relaxing
    """
    law = law_of(material, using=using)
    if loss_tangent is None:
        known = loss_of(material)
        relaxation, source = relaxation_of(known), f"{known}; {relaxation_of(known)}"
    elif isinstance(loss_tangent, Relaxation):
        relaxation, source = loss_tangent, f"assumed: {loss_tangent}"
    else:
        relaxation = flat_relaxation(loss_tangent)
        source = f"assumed: {relaxation}"
    name, stiff = law.members[0]
    relaxing: Element = QuasilinearRelaxation(
        members=((name, stiff),),
        shares=Quantity(relaxation.shares, "1", source),
        times=Quantity(relaxation.times, "s", source),
    )
    return replace(law, members=((RELAXING, relaxing),))


def relaxing_rubber_of(
    material: Material,
    *,
    rest_length: Quantity | float,
    area: Quantity | float | None = None,
    section: Reading | None = None,
    loss_tangent: float | Relaxation | None = None,
    using: str | None = None,
) -> Specimen:
    """Make a piece of a rubber of the library that relaxes with the loss that is known of it.

    Parameters
    ----------
    material
        Of the library.
    rest_length, area, section
        As for :func:`specimen`.
    loss_tangent, using
        As for :func:`relaxing_law_of`.

    Raises
    ------
    ArrangementError
        As :func:`relaxing_law_of`, or if the section is not given once.
    ValueRangeError
        If the loss tangent is not above 0 and at most 2.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> piece = relaxing_rubber_of(material("PMC-770"), area=1e-4, rest_length=0.0125, loss_tangent=0.08)
    >>> [name for name, _ in piece.members]
    ['relaxing']
    """
    law = relaxing_law_of(material, loss_tangent=loss_tangent, using=using)
    return specimen(
        rest_length=rest_length, area=area, section=section, strength=law.strength, **dict(law.members)
    )
