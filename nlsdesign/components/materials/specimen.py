"""A piece of material: from stress and strain to force and extension."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.domain import MATERIAL, TRANSLATION, Domain
from ..core.element import Combination, Element, Scope
from ..core.part_numbers import parameter


@dataclass(frozen=True, kw_only=True)
class Specimen(Combination):
    """A piece of material: ε = e/L₀, F = A₀·Σσ of the laws inside, which act in parallel.

    Nominal stress and nominal strain, as in the paper: A₀ and L₀ are those of the unstretched piece.
    Source: Austin et al. 2015, eq. (1), with a = A₀/L₀.
    """

    domain: ClassVar[Domain] = TRANSLATION
    takes: ClassVar[tuple[Domain, ...]] = (MATERIAL,)
    placing: ClassVar[str | None] = "use for instance LinearElastic instead of Spring"
    picture: ClassVar[str] = "none"
    phenomena: ClassVar[frozenset[str]] = frozenset({"specimen"})

    area: Quantity = parameter("m^2", "cross-section of the unstretched piece", minimum=1e-8, maximum=1.0)
    rest_length: Quantity = parameter("m", "length of the unstretched piece", minimum=1e-4, maximum=5.0)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = A₀·Σσ(e/L₀)."""
        length = scope.parameter("rest_length")
        stress = self.inside(scope, motion / length, rate / length)
        scope.signal("strain", motion / length, "1", f"strain of {scope.path}")
        return scope.parameter("area") * stress


def specimen(*, area: Quantity | float, rest_length: Quantity | float, **laws: Element) -> Specimen:
    """Make a piece of material from laws of stress and strain that act in parallel.

    Parameters
    ----------
    area
        Cross-section in m².
    rest_length
        Unstretched length in m.
    **laws
        Elements by name.
    """
    return Specimen(area=area, rest_length=rest_length, members=tuple(laws.items()))  # type: ignore[arg-type]
