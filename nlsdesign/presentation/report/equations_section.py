"""The equations of a flat model as a section; SymPy is loaded when such a section is written, not before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from .sections import PagePosition, Section

if TYPE_CHECKING:
    from ...model.equations import Equations


@dataclass(frozen=True, eq=False)
class EquationsSection(Section):
    """The equations of a flat model.

    Parameters
    ----------
    equations
        From :func:`nlsdesign.model.equations.equations`.
    caption
        What they describe.
    folded
        Whether they are closed until the reader opens them.
    """

    equations: Equations
    caption: str = ""
    folded: bool = False
    template: ClassVar[str] = "equations.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the rows of the derivatives and of the definitions."""
        from .mathml import equation_rows

        states, signals = equation_rows(self.equations)
        return {"states": states, "signals": signals, "caption": self.caption, "folded": self.folded}
