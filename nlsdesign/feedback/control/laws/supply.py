"""What the supply of a motor can push through its winding."""

from __future__ import annotations

from ....foundation.symbolic import Expression
from .known_drive import KnownDrive
from .law_writer import LawWriter


def voltage_is_limited(drive: KnownDrive) -> bool:
    """Tell whether the plant's motor declares a resistance and a largest voltage.

    Parameters
    ----------
    drive
        What is known of the plant.
    """
    declared = {v.name for v in drive.plant.parameters}
    return {f"{drive.body.name}.resistance", f"{drive.body.name}.voltage_limit"} <= declared


def currents_of_supply(
    drive: KnownDrive, writer: LawWriter, speed: Expression
) -> tuple[Expression, Expression] | None:
    """Return the least and the largest current that the supply can push at a speed, (∓U_max − k·ω)/R.

    ``None`` where the motor declares no resistance: then no voltage is limited.

    Parameters
    ----------
    drive
        What is known of the plant.
    writer
        Of the controller; it is given the parameters that enter.
    speed
        Of the motor in rad/s.
    """
    if not voltage_is_limited(drive):
        return None
    resistance, supply = (
        writer.number(drive.plant.variable(f"{drive.body.name}.{own}"))
        for own in ("resistance", "voltage_limit")
    )
    induced = drive.torque_per_current(writer) * speed
    return (-supply - induced) / resistance, (supply - induced) / resistance
