"""Effects of the drive: torque that comes late, torque that saturates."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...components import Assembly, DriveDelay, DrivePart, DriveSaturation, GearedMotor
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown
from .effect import ranked


def _motors_without(assembly: Assembly, kind: type[DrivePart]) -> list[str]:
    """Return the motors whose drive has no part of a kind yet."""
    motors = {name: part for name, part in assembly.parts if isinstance(part, GearedMotor)}
    return [n for n, motor in motors.items() if not any(isinstance(p, kind) for _, p in motor.chain)]


@ranked(160)
def drive_delay(assembly: Assembly) -> Sequence[Candidate]:
    """A motor whose torque follows the measured current late.

    Parameters
    ----------
    assembly
        As declared; motors with a delay are left out.
    """
    delay = DriveDelay(delay=Quantity(1e-3, "s", SOURCE))
    return [
        Candidate(
            "drive_delay",
            name,
            assembly.with_part(f"{name}.delay", delay),
            (Unknown(f"{name}.delay.delay", (0.003,), 1e-4, 0.2),),
            "torque that follows the current late, the more the faster the current changes",
            "Golub and Van Loan 2013 (Padé table)",
            explains_lag=True,
        )
        for name in _motors_without(assembly, DriveDelay)
    ]


@ranked(170)
def torque_constant_saturation(assembly: Assembly) -> Sequence[Candidate]:
    """A motor whose iron saturates.

    Parameters
    ----------
    assembly
        As declared; motors with a saturation are left out.
    """
    saturation = DriveSaturation(saturation_current=Quantity(100.0, "A", SOURCE))
    return [
        Candidate(
            "torque_constant_saturation",
            name,
            assembly.with_part(f"{name}.saturation", saturation),
            (
                Unknown(
                    f"{name}.saturation.saturation_current",
                    (1.5,),
                    0.2,
                    50.0,
                    f"{name}.current",
                    null=math.inf,
                ),
            ),
            "torque that falls short the more, the larger the current, with either sign",
            "Hanselman 2003 (saturation, Froelich's curve of magnetisation)",
        )
        for name in _motors_without(assembly, DriveSaturation)
    ]
