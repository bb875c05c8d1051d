"""One instance of each sensor, motor, gear, cam and cable."""

from __future__ import annotations

from nlsdesign.components import (
    AnchoredCam,
    Cable,
    CapstanFriction,
    CurrentDrivenMotor,
    CurrentSensor,
    Drift,
    Encoder,
    ForceSensor,
    Gear,
    Guide,
    LossyGear,
    OneSidedCam,
    Part,
    RollerCam,
    RollingPair,
    SampleAndHold,
    SlidingGuide,
    Spring,
    Tachometer,
    TorqueSensor,
    TransportDelay,
    VoltageDrivenMotor,
)

ROW = (0.009, 0.0105, 0.0128, 0.0147, 0.0158, 0.0161, 0.0155, 0.0142)
ROLLED = (0.0, 0.0, 0.004, 0.006, 0.003, -0.002, -0.004, -0.001)
GUIDE = SlidingGuide(guide_friction=0.15, guide_creep_speed=1e-3)
CABLE = Cable(cable_diameter=1.2e-3, cable_breaking_force=989.0, cable_bend_ratio=10.0)
WINDING = {
    "inertia": 1.4e-5,
    "torque_constant": 0.0302,
    "resistance": 0.3,
    "current_limit": 20.0,
    "voltage_limit": 24.0,
}

EXAMPLES: tuple[Part, ...] = (
    Encoder(of="motor.angle", quantum=0.767e-3),
    Tachometer(of="motor.angle", bandwidth=60.0, sample_rate=1000.0),
    SampleAndHold(of="motor.speed", sample_rate=1000.0),
    TransportDelay(of="motor.speed", delay=1e-3),
    ForceSensor(of="spring.rubber.force", gain=1.02, bias=-0.4, noise=0.2),
    Drift(of="spring.rubber.force", drift=0.01),
    TorqueSensor(of="spring.torque", gain=0.98, bias=0.01, noise=0.005),
    CurrentSensor(of="motor.current", bias=0.02, noise=0.04),
    CurrentDrivenMotor(**WINDING),
    VoltageDrivenMotor(**WINDING, inductance=8.2e-5),
    OneSidedCam(lever_arm=ROW, last_angle=1.2, onset=0.02),
    OneSidedCam(lever_arm=ROW, last_angle=1.2, onset=0.02, cable=CABLE),
    AnchoredCam(support=ROW, last_direction=1.2, anchor_distance=0.035),
    AnchoredCam(support=ROW, last_direction=1.2, anchor_distance=0.035, cable=CABLE),
    RollerCam(lever_arm=ROLLED, last_angle=1.2, base_radius=0.02, roller_radius=0.004),
    RollerCam(lever_arm=ROLLED, last_angle=1.2, base_radius=0.02, roller_radius=0.004, guide=GUIDE),
    RollingPair(lever_arm=ROLLED, last_angle=1.2, base_distance=0.07),
    CapstanFriction(
        members=(("rubber", Spring(stiffness=2500.0)),), guide=Guide(friction=0.15, wrap_angle=1.57)
    ),
    Gear(between=("motor", "wheel"), ratio=4.0),
    LossyGear(between=("motor", "wheel"), ratio=4.0, efficiency=0.8, back_efficiency=0.7),
)
