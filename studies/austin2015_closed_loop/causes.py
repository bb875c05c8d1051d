"""The causes that are switched off, or added, one at a time."""

from __future__ import annotations

from dataclasses import replace

import nlsdesign as nls
from nlsdesign.components import Backlash, Rounded, Tie
from nlsdesign.feedback.control import LoopJudge, TorqueGains, with_fine_counts

from .benches import NONLINEAR, Bench, Cause, angle_of, linear_spring

FAST_VELOCITY = 100.0  # Hz; the largest that a loop of 1 kHz carries
SLOW_VELOCITY = 15.0  # Hz
MUCH = 1e3  # A and rad/s, beyond anything that is reached
GAP = nls.degrees(1.0)  # assumed: backlash of a small geared drive
VISCOUS = 20.0  # times the viscosity of the deck
COARSE = 4.0  # times the count of the deck
LATE = 8  # ms, at 1 kHz


def secant_spring(torque: float) -> Cause:
    """Replace the cam by a linear spring that reaches a torque at the same angle: no dead zone."""
    return Cause("linear spring of the same secant", known=linear_spring(torque / angle_of(torque)))


def tangent_spring(torque: float) -> Cause:
    """Replace the cam by a linear spring as stiff as the cam is anywhere up to a torque."""
    slope = LoopJudge(Bench(NONLINEAR).loop()).stiffness(angle_of(torque))
    return Cause("linear spring of the largest tangent stiffness", known=linear_spring(slope))


def _without_relaxation(actuator: nls.Assembly) -> nls.Assembly:
    # A branch of 1 Pa carries nothing beside moduli of MPa.
    return actuator.with_values({"spring.rubber.relaxing.spring.modulus": 1.0})


def _without_friction(actuator: nls.Assembly) -> nls.Assembly:
    return actuator.with_values({"dry_friction.sliding_effort": 0.0, "bearing.damping": 0.0})


def _without_integral(gains: TorqueGains) -> TorqueGains:
    return replace(gains, integral=0.0)


def _fast_velocity(gains: TorqueGains) -> TorqueGains:
    return replace(gains, velocity_bandwidth=FAST_VELOCITY)


def _slow_velocity(gains: TorqueGains) -> TorqueGains:
    return replace(gains, velocity_bandwidth=SLOW_VELOCITY)


def _without_limit(actuator: nls.Assembly) -> nls.Assembly:
    return actuator.with_values({"motor.current_limit": MUCH})


NO_INTEGRAL = Cause("no integral", gains=_without_integral)
NO_DELAY = Cause("current acts at once", delay=0)
NO_LATE = Cause("torque not late", late=0)
NO_COUNTS = Cause("no counts", plant=with_fine_counts)
NO_FRICTION = Cause("no friction", known=_without_friction)
NO_RELAXATION = Cause("no relaxation", known=_without_relaxation)
NO_LIMIT = Cause("no current limit", known=_without_limit)
FAST_LOOP = Cause(f"velocity loop {FAST_VELOCITY:g} Hz", gains=_fast_velocity)

SWITCHED_OFF = (
    NO_INTEGRAL, NO_DELAY, NO_COUNTS, NO_FRICTION, NO_RELAXATION, NO_LIMIT, FAST_LOOP,
)  # fmt: skip


def _with_backlash(actuator: nls.Assembly) -> nls.Assembly:
    spring = next(part for name, part in actuator.parts if name == "spring")
    assert isinstance(spring, Tie)
    gap = nls.quantity(GAP, "rad", source="assumed: backlash of a small geared drive")
    width = nls.quantity(GAP / 20.0, "rad", source="assumed: far below the gap")
    loose = Backlash(members=(("element", spring.element),), gap=gap, contact=Rounded(width=width))
    return actuator.with_part("spring", loose)


def _viscous(actuator: nls.Assembly) -> nls.Assembly:
    name = "spring.rubber.relaxing.dashpot.viscosity"
    viscosity = actuator.quantities()[name]
    return actuator.with_values({name: viscosity.with_value(VISCOUS * viscosity.number)})


def _coarse_load(plant: nls.FlatModel) -> nls.FlatModel:
    name = "load_encoder.quantum"
    return plant.with_values({name: COARSE * plant.variable(name).start})


ADDED = (
    Cause("backlash of 1°", hidden=_with_backlash),
    Cause(f"{VISCOUS:g} times the viscosity", known=_viscous),
    Cause("load counted 4 times coarser", plant=_coarse_load),
    Cause(f"velocity loop {SLOW_VELOCITY:g} Hz", gains=_slow_velocity),
    Cause(f"torque {LATE} ms late", late=LATE),
)
"""What could lift the torque of Fig. 9 above 2 Hz."""
