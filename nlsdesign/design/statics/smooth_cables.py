"""Cables that go slack, in the form that an optimiser can follow and that is quick to evaluate."""

from __future__ import annotations

from ...components.assembly.named_parts import Assembly
from ...components.core.element import Element


def with_smooth_cables(actuator: Assembly) -> Assembly:
    """Return the assembly with every cable that goes slack in its smooth form.

    Within the range of a design the cable is taut, where the two forms agree.
    """
    for path, part in actuator.walk():
        if "unilateral contact" in part.phenomena and isinstance(part, Element) and not part.is_smooth:
            actuator = actuator.with_part(path, part.smooth())
    return actuator
