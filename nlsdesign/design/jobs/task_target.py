"""A target that follows from a task: read from a design file, made for the motor of the deck."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ...foundation.errors import InfeasibleError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...model import FlatModel
from ..curves.beside import SpringChoice, choose_spring
from ..curves.compliance import OddSpring, SpringSymmetry
from ..curves.motor_and_gear import motor_and_gear
from ..curves.numbers import in_si
from ..curves.target import TabulatedTorque
from ..curves.task import read_task, walking_task
from ..curves.task_curve import LeastEnergy, TaskGoal, TaskProblem


@dataclass(frozen=True, kw_only=True)
class TaskTarget:
    """The torque curve of least motor energy, or peak power, for a task.

    Parameters
    ----------
    file
        Record of one period, beside the design file; see :func:`~nlsdesign.design.read_task`.
    joint
        Instead of a file: ``"ankle"``, ``"knee"`` or ``"hip"`` in walking.
    body_mass
        Mass of the body in kg, where the torques are stated per body mass.
    scale
        Share of the torque that the actuator gives.
    gear_ratio
        Another gear ratio than the declared one, a pure number.
    goal
        What is made small over the task: ``LeastEnergy`` or ``LeastPeakPower``.
    symmetry
        ``OddSpring``, ``OneSidedSpring`` or ``TwoBranchSpring``; of a spring in series.
    gear_ratios
        Instead of one: the least and the greatest, of which the best is found together with the spring.
    place
        ``"series"``, or ``"beside"`` for one from joint to frame that acts beyond an angle, in one direction.

    Raises
    ------
    UnknownNameError
        If there is no such place.
    ValueRangeError
        If the range of the gear ratio is none, or neither a file nor a joint is given, or both are.
    """

    file: str = ""
    joint: str = ""
    body_mass: Quantity | float | None = None
    scale: Quantity | float = 1.0
    gear_ratio: Quantity | float | None = None
    goal: TaskGoal = field(default_factory=LeastEnergy)
    symmetry: SpringSymmetry = field(default_factory=OddSpring)
    gear_ratios: tuple[Quantity | float, ...] = ()
    place: str = "series"

    def __post_init__(self) -> None:
        if self.place not in _PLACES:
            raise unknown_name("task: place", self.place, _PLACES)
        if self.gear_ratios and (len(self.gear_ratios) != 2 or self.gear_ratio is not None):
            raise ValueRangeError(
                "task: gear_ratios", "is the least and the greatest, and stands instead of gear_ratio",
                next_step="write gear_ratios = [20.0, 120.0]",
            )  # fmt: skip
        if bool(self.file) == bool(self.joint):
            raise ValueRangeError(
                "task", "needs a file or a joint, and not both",
                next_step='write file = "task.csv", or joint = "ankle" with body_mass = "75 kg"',
            )  # fmt: skip
        in_si("scale", self.scale, "1", minimum=1e-6, maximum=1e3)

    def choice(self, model: FlatModel, folder: Path) -> SpringChoice:
        """Return what springs in each place do for the motor of a model.

        Parameters
        ----------
        model
            Flat model of the actuator.
        folder
            Of the design file.

        Raises
        ------
        ValueRangeError
            If the body mass is missing, or a number is out of range.
        NlsError
            If the task cannot be read, the motor declares too little, or no spring keeps its limits.
        """
        if self.file:
            task = read_task(folder / self.file, body_mass=self.body_mass)
        else:
            mass = self.body_mass
            if mass is None:
                raise ValueRangeError(
                    "task: body_mass", "is missing; the tables are per body mass",
                    next_step='write body_mass = "75 kg"',
                )  # fmt: skip
            task = walking_task(self.joint, body_mass=mass)
        drive = motor_and_gear(model)
        if self.gear_ratio is not None:
            drive = drive.geared(in_si("gear_ratio", self.gear_ratio, "1", minimum=1e-3, maximum=1e4))
        ratios = (self.gear_ratios[0], self.gear_ratios[1]) if self.gear_ratios else None
        problem = TaskProblem(goal=self.goal, symmetry=self.symmetry, gear_ratios=ratios)
        return choose_spring(task.scaled(in_si("scale", self.scale, "1")), drive, problem)

    def target(self, choice: SpringChoice) -> TabulatedTorque:
        """Return the curve of the spring in the place that is asked for.

        Parameters
        ----------
        choice
            Of this task.

        Raises
        ------
        InfeasibleError
            If no spring in that place keeps the limits, or one beside the drive would not help.
        """
        if self.place == "series" and choice.series:
            return choice.series.target
        if self.place == "beside" and choice.beside and choice.beside.sides:
            return choice.beside.sides[0].target
        raise InfeasibleError(
            f"task: a spring with place = '{self.place}'",
            "keeps no limit or does not help",
            next_step=f"take the other place, or another motor or gear ratio. {choice.reason}",
        )


_PLACES = ("series", "beside")
