"""The three springs in their torque loop, and what can be changed in it, one cause at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import nlsdesign as nls
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    SineResponse,
    TorqueGains,
    TorqueLaw,
    ZeroTorque,
    encoder_loop,
    sine_response,
    torque_controller,
    zero_torque,
)
from nlsdesign.feedback.observer import CascadeGain, GridByTolerance
from nlsdesign.foundation.arrays import Array

from .late_torque import late_torque

NONLINEAR, SOFT, STIFF = "nonlinear", "soft", "stiff"
DECKS = {
    NONLINEAR: "austin2015_figure_consistent",
    SOFT: "austin2015_soft_spring",
    STIFF: "austin2015_stiff_spring",
}
FILES = {NONLINEAR: "nls", SOFT: "soft_spring", STIFF: "stiff_spring"}
"""How the files of the points call the springs."""
LOW, HIGH = 0.8, 2.8
"""Amplitudes of Fig. 10 in N·m."""

REACH = GridByTolerance(lower=-2.0, upper=2.0)
"""Angles in rad that the observer of a linear spring covers: the soft one turns 1.65 rad at 2.8 N·m."""

OUTPUTS = ("motor.angle", "spring.torque")
POWER_LAW = (4.35, 2.09)
"""Torque of the nonlinear spring, N·m·(angle/rad)^2.09, as its deck has it from Fig. 8."""


def unchanged_actuator(actuator: nls.Assembly) -> nls.Assembly:
    """Leave an actuator as it is."""
    return actuator


def unchanged_plant(plant: nls.FlatModel) -> nls.FlatModel:
    """Leave a plant as it is."""
    return plant


def unchanged_gains(gains: TorqueGains) -> TorqueGains:
    """Leave gains as they are."""
    return gains


@dataclass(frozen=True, eq=False)
class Cause:
    """One change of a loop, everything else as before.

    Parameters
    ----------
    name
        What is changed, in words.
    known
        Change of the actuator that observer and controller know.
    hidden
        Change of the actuator that they do not know.
    plant
        Change of the flat plant alone.
    gains
        Change of the controller's settings.
    delay
        Samples from a current's computation to its effect.
    late
        Further samples by which the controller gets the torque late.
    """

    name: str
    known: Callable[[nls.Assembly], nls.Assembly] = unchanged_actuator
    hidden: Callable[[nls.Assembly], nls.Assembly] = unchanged_actuator
    plant: Callable[[nls.FlatModel], nls.FlatModel] = unchanged_plant
    gains: Callable[[TorqueGains], TorqueGains] = unchanged_gains
    delay: int = 1
    late: int | None = None


AS_IT_IS = Cause("as it is")


@dataclass(frozen=True, eq=False)
class Bench:
    """One spring in its torque loop.

    The observer is the cascade, which takes the numbers of the deck for granted: the exact plant, so that
    what is seen is the loop and not the estimate.

    Parameters
    ----------
    spring
        ``"nonlinear"``, ``"soft"`` or ``"stiff"``.
    gains
        Of the PID and its velocity loop. The paper prints none.
    law
        In place of the PID.
    late
        Samples by which the controller gets the torque late.
    cause
        What is changed.
    """

    spring: str
    gains: TorqueGains = field(default_factory=TorqueGains)
    law: TorqueLaw | None = None
    late: int = 0
    cause: Cause = AS_IT_IS

    def but(self, cause: Cause) -> Bench:
        """Return the same with one thing changed."""
        return replace(self, cause=cause)

    @property
    def actuator(self) -> nls.Assembly:
        """The actuator as observer and controller know it."""
        return _known_drive(self.spring, self.cause.known)[0]

    def loop(self, *, moved: bool = False) -> ClosedLoop:
        """Return the closed loop, with the load fixed or moved."""
        actuator, bench, observer = _known_drive(self.spring, self.cause.known)
        if self.law is None:
            controller = torque_controller(bench, gains=self.cause.gains(self.gains))
        else:
            controller = torque_controller(bench, law=self.law)
        real = self.cause.hidden(actuator)
        plant = nls.flatten(with_moved_load(real) if moved else real, outputs=list(OUTPUTS))
        late = self.late if self.cause.late is None else self.cause.late
        return encoder_loop(
            self.cause.plant(plant),
            observer=late_torque(observer, late),
            controller=controller,
            delay=self.cause.delay,
        )

    def response(self, amplitude: float, frequencies: Array) -> SineResponse:
        """Return desired to actual torque."""
        return sine_response(self.loop(), amplitude=amplitude, frequencies=frequencies, translate=natively)

    def felt(self, degrees: float, frequencies: Array) -> ZeroTorque:
        """Return what a load feels that is moved while no torque is wanted."""
        return zero_torque(
            self.loop(moved=True), amplitude=nls.degrees(degrees), frequencies=frequencies, translate=natively
        )


@lru_cache(maxsize=8)
def _known_drive(
    spring: str, known: Callable[[nls.Assembly], nls.Assembly]
) -> tuple[nls.Assembly, nls.FlatModel, nls.FlatModel]:
    """Return actuator, bench and observer, which whatever gains and hidden causes leave as they are."""
    actuator = known(nls.declare(nls.load_deck(DECKS[spring])))
    bench = nls.flatten(actuator, outputs=list(OUTPUTS))
    # A cam ends by itself; where there is none the observer's own range would end at 90 degrees.
    reach = None if any(spring.cams for spring in bench.springs) else REACH
    return actuator, bench, nls.design_observer(bench, gain=CascadeGain(), grid=reach)


def angle_of(torque: float) -> float:
    """Return the angle in rad at which the power law of the nonlinear spring has a torque in N·m."""
    factor, power = POWER_LAW
    return float((torque / factor) ** (1.0 / power))


def linear_spring(stiffness: float) -> Callable[[nls.Assembly], nls.Assembly]:
    """Return a change to a linear spring of a stiffness in N·m/rad, with the rest of the drive as it is."""

    def change(_: nls.Assembly) -> nls.Assembly:
        linear = nls.declare(nls.load_deck(DECKS[SOFT]))
        return linear.with_values({"spring.stiffness": stiffness})

    return change
