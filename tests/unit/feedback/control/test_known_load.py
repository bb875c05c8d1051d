"""What a controller adds for all that resists its motor, and its current for a torque, against formulas."""

from __future__ import annotations

import math

import casadi as ca
import pytest

from nlsdesign.components import (
    ROTATION,
    CommandCompression,
    ConstantLoad,
    Dashpot,
    EndStop,
    Fixed,
    GearedMotor,
    GearFriction,
    GradualSaturation,
    Spring,
    TorqueRipple,
    tie,
)
from nlsdesign.components.assembly.named_parts import Assembly, Tie, assembly
from nlsdesign.components.core.part import Part
from nlsdesign.components.mechanics.drive_chain import DrivePart
from nlsdesign.components.mechanics.drive_faults import CURRENT
from nlsdesign.feedback.control.laws.known_drive import (
    LEAST_GAIN,
    STEEPEST,
    KnownDrive,
    current_for,
    known_load,
)
from nlsdesign.feedback.control.laws.law_writer import LawWriter
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel, flatten

CONSTANT, LIMIT, STIFFNESS = 20.0 * 0.05, 10.0, 3.0
WIDTH, GAIN = 0.05, 2.0


def q(value: float, unit: str) -> Quantity:
    return Quantity(value, unit, "by hand")


def parts(spring: Spring | GearFriction | None = None, **more: Part | Tie) -> Assembly:
    motor = GearedMotor(
        inertia=q(0.01, "kg*m^2"), gear_ratio=q(20.0, "1"), torque_constant=q(0.05, "N*m/A"),
        current_limit=q(LIMIT, "A"),
    )  # fmt: skip
    inside = spring or Spring(stiffness=q(STIFFNESS, "N*m/rad"), domain=ROTATION)
    return assembly("machine", motor=motor, load=Fixed(), spring=tie(inside, "motor", "load"), **more)


def machine(spring: Spring | GearFriction | None = None, **more: Part | Tie) -> FlatModel:
    return flatten(parts(spring, **more))


def load_of(plant: FlatModel, angle: float, speed: float, torque: float) -> float:
    """The torque that is added at the declared numbers."""
    writer = LawWriter(1e-3, plant.origin)
    known = known_load(KnownDrive(plant), writer, ca.SX(WIDTH), ca.SX(GAIN))
    return at_declared(writer, known(ca.SX(angle), ca.SX(speed), ca.SX(torque)))


def at_declared(writer: LawWriter, expression: ca.SX) -> float:
    values = {v.name: v.start for v in [v for v, _ in writer._parameters.values()]}
    names = ca.symvar(expression)
    (value,) = ca.Function("value", names, [expression]).call([values[s.name()] for s in names])
    return float(value)


def test_ripple_a_constant_load_and_damping_are_added_where_the_motor_is() -> None:
    plant = machine(
        ripple=tie(TorqueRipple(sine=q(0.2, "N*m"), cosine=q(0.1, "N*m"), order=q(7.0, "1")), "motor"),
        weight=tie(ConstantLoad(load=q(0.3, "N*m"), domain=ROTATION), "motor"),
        bearing=tie(Dashpot(damping=q(0.04, "N*m*s/rad"), domain=ROTATION), "motor"),
    )
    for angle, speed in ((0.0, 3.0), (0.4, -2.0)):
        size = math.hypot(speed, WIDTH)
        expected = 0.2 * math.sin(7 * angle) + 0.1 * math.cos(7 * angle) + 0.3 + 0.04 * size * speed / size
        assert load_of(plant, angle, speed, 1.0) == pytest.approx(expected, rel=1e-9)


def test_friction_that_grows_with_the_load_is_added_but_changes_sign_no_more_steeply_than_is_stable() -> None:
    ratio, creep, torque = 0.1, 0.001, 1.5
    inside = (("inside", Spring(stiffness=q(STIFFNESS, "N*m/rad"), domain=ROTATION)),)
    plant = machine(GearFriction(ratio=q(ratio, "1"), members=inside).smooth(creep))
    width = max(WIDTH, ratio * torque / (STEEPEST * GAIN))
    assert width > WIDTH
    for speed in (2.0, 0.1, -0.4):
        expected = ratio * torque * speed / math.hypot(speed, width)
        assert load_of(plant, 0.5, speed, torque) == pytest.approx(expected, rel=1e-6)
    step = 1e-6
    slope = (load_of(plant, 0.5, step, torque) - load_of(plant, 0.5, -step, torque)) / (2 * step)
    assert slope <= STEEPEST * GAIN * (1 + 1e-6)


def test_an_end_stop_is_not_pushed_into() -> None:
    stops = EndStop(
        lower=q(-1.0, "rad"), upper=q(1.0, "rad"), stiffness=q(500.0, "N*m/rad"), damping=q(0.1, "s/rad"),
        domain=ROTATION,
    )  # fmt: skip
    plant = machine(stops=tie(stops.smooth(), "motor"))
    assert abs(load_of(plant, 1.1, 0.0, 1.0)) < 1e-9


def current_of(plant: FlatModel, torque: float) -> float:
    writer = LawWriter(1e-3, plant.origin)
    return at_declared(writer, current_for(KnownDrive(plant), writer, ca.SX(torque)))


def driven_by(fault: DrivePart) -> FlatModel:
    return flatten(parts().with_part("motor.fault", fault))


def test_a_constant_gain_is_divided_by() -> None:
    assert current_of(machine(), 0.7) == pytest.approx(0.7 / CONSTANT, rel=1e-12)


@pytest.mark.parametrize(("torque", "rel"), [(1.0, 1e-6), (-4.0, 1e-3), (6.0, 0.02)])
def test_a_gain_that_falls_with_the_current_is_inverted_and_never_overshot(torque: float, rel: float) -> None:
    """I/(1 + |I|/h) = T/k has the solution |I| = |T|/(k − |T|/h); arctan has the tangent."""
    halving, knee = 25.0, 12.0
    expected = torque / (CONSTANT - abs(torque) / halving)
    reached = current_of(driven_by(CommandCompression(halving=q(halving, "A"), domain=CURRENT)), torque)
    assert reached == pytest.approx(expected, rel=rel)
    assert abs(reached) <= abs(expected) * (1 + 1e-9)
    reached = current_of(driven_by(GradualSaturation(saturation=q(knee, "A"), domain=CURRENT)), torque)
    assert reached == pytest.approx(knee * math.tan(torque / CONSTANT / knee), rel=rel)


def test_a_torque_beyond_what_the_drive_makes_asks_for_a_finite_current_beyond_its_limit() -> None:
    plant = driven_by(GradualSaturation(saturation=q(3.0, "A"), domain=CURRENT))
    most = 3.0 * math.pi / 2 * CONSTANT
    asked = current_of(plant, 1.5 * most)
    assert LIMIT < asked < 1.5 * most / CONSTANT * (1 + 3 / LEAST_GAIN)
