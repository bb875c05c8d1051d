"""An assembly with another rubber in it."""

from __future__ import annotations

from ...foundation.errors import ArrangementError, unknown_name
from ..core.tie import Tie
from ..materials.library import Material
from ..materials.loss_tangent import Relaxation
from ..materials.material_law import law_of
from ..materials.relaxing_rubber import relaxing_law_of
from ..materials.specimen import Specimen
from .named_parts import Assembly


def with_rubber(
    actuator: Assembly,
    material: Material,
    *,
    piece: str | None = None,
    using: str | None = None,
    loss_tangent: float | Relaxation | None = None,
) -> Assembly:
    """Return a copy whose rubber is one of the library: other laws and strength, the same sizes.

    Parameters
    ----------
    actuator
        With a piece of rubber.
    material
        Of the library, for instance ``material("Dragon_Skin_30")``.
    piece
        Path of the piece, for instance ``"spring.rubber"``; not needed where there is but one.
    using
        As for :func:`~nlsdesign.components.law_of`.
    loss_tangent
        If given, the rubber relaxes with it, as for :func:`~nlsdesign.components.relaxing_law_of`; what the
        library knows of it is ``loss_of(material)``.

    Raises
    ------
    ArrangementError
        If the assembly has no piece of rubber, or several and none is named, or if nothing that is known of
        the rubber gives an elastic law.
    UnknownNameError
        If there is no such piece.
    ValueRangeError
        If the loss tangent is not above 0 and at most 2.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> from nlsdesign.components.assembly.deck_writer import declare
    >>> from nlsdesign.foundation.deck import load_deck
    >>> published = declare(load_deck("austin2015_as_printed"))
    >>> softer = with_rubber(published, material("Dragon_Skin_30"))
    >>> [quantity.source[:24] for name, quantity in softer.quantities().items() if name.endswith("modulus")]
    ['fitted to Dragon_Skin_30']
    """
    inner = ((path, part.element if isinstance(part, Tie) else part) for path, part in actuator.walk())
    pieces = {path: part for path, part in inner if isinstance(part, Specimen)}
    if piece is not None and piece not in pieces:
        raise unknown_name("piece of rubber", piece, pieces)
    if piece is None and len(pieces) != 1:
        raise ArrangementError(
            f"assembly '{actuator.name}'",
            f"has {len(pieces)} pieces of rubber" if pieces else "has no piece of rubber",
            next_step=f"say piece='...', one of: {', '.join(pieces)}" if pieces
            else "declare one with specimen(...)",
        )  # fmt: skip
    path = piece or next(iter(pieces))
    law = (
        law_of(material, using=using)
        if loss_tangent is None
        else relaxing_law_of(material, loss_tangent=loss_tangent, using=using)
    )
    return actuator.with_part(path, law.in_place_of(pieces[path]))
