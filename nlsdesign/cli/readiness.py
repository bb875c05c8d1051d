"""Which commands a deck is ready for, found out with what the commands themselves call first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ..foundation.errors import NlsError

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly
    from ..model import FlatModel

_SAMPLE_TIME = 1e-3
_ANGLES = 5
_POINTS = 33


class Readiness(NamedTuple):
    """Whether a command takes a deck.

    Parameters
    ----------
    command
        As it is typed, without ``nlsdesign``.
    reason
        Why not, with the next step; ``None`` where the deck is ready.
    """

    command: str
    reason: NlsError | None

    @property
    def ready(self) -> bool:
        """Whether the command takes the deck."""
        return self.reason is None

    @property
    def shown(self) -> str:
        """The command, with what else it asks for."""
        return shown_command(self.command)


@dataclass(frozen=True, eq=False)
class _Machine:
    """A deck as declared, and its flat model."""

    declared: Assembly
    model: FlatModel

    def design(self) -> None:
        """Do what a design does before its search."""
        from ..design import ExponentialTorque
        from ..design.optimisation.solve import GOALS, USUAL, Wanted
        from ..model.roles import series_cam

        cam = series_cam(self.model)
        angle = 0.8 * self.model.values[cam.last_angle] if cam.last_angle else 0.5
        target = ExponentialTorque(maximum=1.0, angle=angle, shape=1.0)
        question, free = Wanted(target, None, (), None, GOALS).question(self.declared, USUAL)
        question.search(free)

    def angle(self) -> None:
        """Bring the machine to rest over its angle."""
        import numpy as np

        from ..feedback.analysis.rest_points import rest_points
        from ..model.roles import series_spring
        from .range_remarks import swept_angle

        series_spring(self.model)
        rest_points(self.model, np.linspace(0.0, self.reach, _ANGLES), angle=swept_angle(self.model, None))

    def observer(self) -> None:
        """Design the step of a cascade, which every other kind of observer needs too."""
        self._step(self.model)

    def controller(self) -> None:
        """Write the torque controller that is exported by default."""
        from .controller import controller_of

        controller_of(self.model, _SAMPLE_TIME, law="scheduled", bandwidth=None, velocity_bandwidth=None)

    def both(self) -> None:
        """Design observer and controller."""
        self.observer()
        self.controller()

    def loop(self) -> None:
        """Do what the evaluation of the torque loop does before it simulates."""
        from ..components.assembly.changed_copies import with_moved_load
        from ..feedback.control import torque_controller
        from ..model import flatten

        flatten(with_moved_load(self.declared))
        self._step(self.model)
        torque_controller(self.model, sample_time=_SAMPLE_TIME)

    def plant(self) -> None:
        """Nothing more than the flat model is asked for."""

    def records(self) -> None:
        """Cut the machine at what its sensors, or states where there are none, and its inputs measure."""
        from ..bench.discrepancy.tearing import blocks_of

        blocks_of(self.model, self.measured)

    @property
    def measured(self) -> list[str]:
        """Signals that records of this machine have."""
        readings = [r.signal for r in self.model.readings if r.sensors]
        shown = readings or [v.name for v in self.model.states]
        return [*shown, *(v.name for v in self.model.inputs)]

    @property
    def reach(self) -> float:
        """Angle up to which the cams have a contour, in rad."""
        from ..feedback.observer.scheduling.scheduled import whole_contour

        return whole_contour(self.model).upper

    def _step(self, model: FlatModel) -> None:
        from ..feedback.observer import CascadeGain, design_observer_with_details
        from ..feedback.observer.scheduling.table import FixedGrid

        # The size of the table is chosen by the commands; here any does.
        grid = FixedGrid(-self.reach, self.reach, points=_POINTS)
        design_observer_with_details(model, gain=CascadeGain(), sample_time=_SAMPLE_TIME, grid=grid)


_NEEDS = {
    "design": "a target",
    "fit": "records",
    "diagnose": "records",
}


def readiness(declared: Assembly) -> list[Readiness]:
    """Return for each command that takes a deck whether it takes this one."""
    from ..model import flatten

    machine = _Machine(declared, flatten(declared))
    asked: dict[str, Callable[[], None]] = {
        "simulate": machine.plant,
        "design": machine.design,
        "analyse angle": machine.angle,
        "analyse loop": machine.loop,
        "observer": machine.observer,
        "export c": machine.observer,
        "export controller": machine.controller,
        "export fmu": machine.plant,
        "fit": machine.records,
        "diagnose": machine.records,
    }
    reasons: dict[str, NlsError | None] = {}
    for work in dict.fromkeys(asked.values()):
        try:
            work()
            reasons[work.__name__] = None
        except NlsError as error:
            reasons[work.__name__] = error
    return [Readiness(name, reasons[work.__name__]) for name, work in asked.items()]


def shown_command(command: str) -> str:
    """Return a command with what else it asks for, as ``fit (with records)``."""
    return f"{command} (with {_NEEDS[command]})" if command in _NEEDS else command
