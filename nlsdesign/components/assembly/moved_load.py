"""An actuator whose fixed load is moved from outside, as for measuring its output impedance."""

from __future__ import annotations

from ...foundation.errors import ArrangementError
from ..core.tie import Tie
from ..mechanics.bodies import Driven, Fixed
from ..sensing.sensors import Encoder
from .named_parts import Assembly


def with_moved_load(actuator: Assembly, load: str | None = None) -> Assembly:
    """Return a copy in which the fixed load is moved, with an encoder like that of the motor.

    Where an encoder reads another body, one with the same count reads the load. An assembly whose load is
    moved already comes back as it is.

    ``load``: name of that body; the only one if it is left out.
    """
    parts = dict(actuator.parts)
    if load is None and any(isinstance(part, Driven) for part in parts.values()):
        return actuator
    ends = [end for part in parts.values() if isinstance(part, Tie) for end in part.between]
    fixed = [n for n, p in parts.items() if isinstance(p, Fixed) and n in ends and load in (None, n)]
    if len(fixed) != 1:
        result = ", ".join(f"'{name}'" for name in fixed) or "none"
        raise ArrangementError(
            f"assembly '{actuator.name}'", f"needs one fixed load to be moved, but there is {result}",
            next_step="declare the load as Fixed() and tie the spring to it",
        )  # fmt: skip
    (name,) = fixed
    driven = Driven(domain=next(p.domain for n, p in parts.items() if n == name and isinstance(p, Fixed)))
    moved = {**parts, name: driven}
    encoders = [p for p in parts.values() if isinstance(p, Encoder)]
    if encoders:
        own = next(f"{name}_encoder{i or ''}" for i in range(99) if f"{name}_encoder{i or ''}" not in parts)
        moved[own] = Encoder(of=f"{name}.{driven.motion_names[0]}",
                             quantum=encoders[0].quantum)  # fmt: skip
    return Assembly(actuator.name, tuple(moved.items()))
