"""A piece of a rubber of the library that relaxes with the loss that is known of it."""

from __future__ import annotations

from dataclasses import replace

from ...foundation.quantity import Quantity
from ...foundation.rubber_library import Material
from ..core.element import Element
from ..core.part_numbers import Reading
from .loss_tangent import Relaxation, flat_relaxation, loss_of, relaxation_of
from .material_law import MaterialLaw, law_of
from .quasilinear import QuasilinearRelaxation
from .specimen import Specimen, specimen

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
