"""Effects of the drive: torque that comes late, torque that saturates."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import Assembly, DelayedMotor, GearedMotor, SaturatingMotor
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, numbers_of
from .effect import ranked


def _ideal_motors(assembly: Assembly) -> list[tuple[str, GearedMotor]]:
    """Return the motors without a fault of their own."""
    return [(n, p) for n, p in assembly.parts if isinstance(p, GearedMotor) and type(p) is GearedMotor]


@ranked(160)
def drive_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A motor whose torque follows the measured current late.

    Parameters
    ----------
    assembly
        As declared; motors with a fault of their own are left out.
    """
    return [
        Candidate(
            "drive_delay",
            name,
            assembly.with_part(name, DelayedMotor(**numbers_of(motor), delay=Quantity(1e-3, "s", SOURCE))),
            (Unknown(f"{name}.delay", (0.003,), 1e-4, 0.2),),
            "torque that follows the current late, the more the faster the current changes",
            "Golub and Van Loan 2013 (Padé table)",
            explains_lag=True,
        )
        for name, motor in _ideal_motors(assembly)
    ]


@ranked(170)
def torque_constant_saturation(assembly: Assembly) -> Sequence[Candidate]:
    """A motor whose iron saturates.

    Parameters
    ----------
    assembly
        As declared; motors with a fault of their own are left out.
    """
    return [
        Candidate(
            "torque_constant_saturation",
            name,
            assembly.with_part(
                name,
                SaturatingMotor(**numbers_of(motor), saturation_current=Quantity(100.0, "A", SOURCE)),
            ),
            (Unknown(f"{name}.saturation_current", (1.5,), 0.2, 50.0, f"{name}.current"),),
            "torque that falls short the more, the larger the current, with either sign",
            "Hanselman 2003 (saturation; Froelich's curve of magnetisation)",
        )
        for name, motor in _ideal_motors(assembly)
    ]
