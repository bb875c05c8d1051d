"""Names by which a torque loop is wired: those of the plant."""

from __future__ import annotations

from dataclasses import dataclass

from ....foundation.errors import ArrangementError
from ....model import FlatModel
from ....model.roles import motor_of, series_spring

DESIRED = "desired"
"""What is added to the name of the torque for the torque that the spring should have."""


@dataclass(frozen=True)
class LoopNames:
    """Names of the variables by which a torque loop is wired: those of the plant.

    Parameters
    ----------
    angle, speed
        Motion of the motor and its rate.
    torque
        Torque of the series spring.
    current
        Input of the motor.
    """

    angle: str
    speed: str
    torque: str
    current: str

    @property
    def desired(self) -> str:
        """Name of the torque that the spring should have."""
        return f"{self.torque}.{DESIRED}"

    @property
    def desired_rate(self) -> str:
        """Name of the rate of the torque that the spring should have, where a controller is given it."""
        return f"{self.desired}.rate"


def loop_names(plant: FlatModel) -> LoopNames:
    """Return the names of a plant by which its torque loop is wired, decided from its structure.

    Parameters
    ----------
    plant
        With one series spring and one motor that is driven by a current.

    Raises
    ------
    ArrangementError
        If the structure does not decide, or the motor is not driven by a current.
    """
    body, motor = motor_of(plant)
    if motor.command is None or plant.variable(motor.command).unit != "A":
        raise ArrangementError(
            f"motor '{body.name}'", "is not driven by a current, which a torque controller gives",
            next_step="declare it as a GearedMotor and keep its current among the inputs",
        )  # fmt: skip
    return LoopNames(body.motion, body.rate, series_spring(plant).effort, motor.command)
