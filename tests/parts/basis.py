"""Springs, dampers, combinations, bodies, cams and sensors with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Area,
    Backlash,
    Buckling,
    Cable,
    CoulombFriction,
    CurrentSensor,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    ForceSensor,
    GearedMotor,
    Inertia,
    Inertial,
    InextensibleCable,
    LinearElastic,
    LoadFriction,
    Mass,
    Part,
    Pulley,
    PullOnly,
    QuadraticDrag,
    ReadingLimits,
    Regularised,
    Rounded,
    Slack,
    SlidingFillers,
    Specimen,
    Spring,
    StrainStiffening,
    StretchyCable,
    StribeckFriction,
    Strip,
    Through,
    TorqueRipple,
    Turned,
    TwoSidedCam,
    ViscousMaterial,
    parallel,
    series,
    tie,
)
from nlsdesign.components.materials.specimen import Strength

SPRING, STEEL, HOUSING = (
    Spring(stiffness=2500.0),
    Spring(stiffness=9e5),
    Spring(stiffness=3.4, domain=ROTATION),
)
RUBBER = LinearElastic(modulus=0.9e6)
MODULI, KNOTS = (0.92e6, 0.58e6), (0.0, 0.085)
FORCE = "spring.rubber.force"
ROW = (0.0, 2e-3, 5e-3, 8e-3, 11e-3, 14e-3, 15e-3)
CABLE = Cable(cable_diameter=9e-4, cable_breaking_force=1285.0, cable_bend_ratio=5.0)

_PARTS: tuple[Part, ...] = (
    Backlash(members=(("cam", HOUSING),), gap=0.01, contact=Rounded(width=5e-4)),
    Backlash(members=(("cam", HOUSING),), gap=0.01, contact=Inertial(inertia=9e-4, contact_time=1e-2)),
    CoulombFriction(sliding_effort=0.02, contact=Regularised(creep_speed=0.02)),
    CurrentSensor(of="motor.current", bias=0.05),
    Dashpot(damping=12.0),
    Driven(),
    Driven(domain=TRANSLATION),
    Encoder(of="motor.angle", quantum=7.67e-4),
    Encoder(
        of="motor.angle",
        quantum=7.67e-4,
        limits=ReadingLimits(lowest_reading=-1.5, highest_reading=1.5, largest_rate=90.0, stale_time=0.1),
    ),
    Fixed(),
    Fixed(domain=TRANSLATION),
    ForceSensor(of=FORCE, gain=1.02, bias=0.3),
    GearedMotor(inertia=6e-4, gear_ratio=4.0, torque_constant=0.055),
    Inertia(inertia=6e-4),
    InextensibleCable(members=(("rubber", SPRING),)),
    RUBBER,
    LoadFriction(members=(("gear", HOUSING),), ratio=0.05, contact=Regularised(creep_speed=0.02)),
    Mass(mass=0.4),
    Pulley(radius=0.01),
    Pulley(radius=0.01, cable=CABLE),
    Buckling(members=(("rubber", SPRING),), share=0.95),
    PullOnly(members=(("rubber", SPRING),)),
    QuadraticDrag(drag=1e-4),
    Slack(members=(("rubber", SPRING),), length=1e-3, contact=Rounded(width=1e-5)),
    SlidingFillers(modulus=0.5e6, yield_stress=4e4),
    StrainStiffening(modulus=MODULI, knots=KNOTS, contact=Rounded(width=0.01)),
    Specimen(members=(("still", RUBBER),), section=Area(1e-4), rest_length=0.0125),
    Specimen(
        members=(("still", RUBBER),),
        section=Strip(width=0.03, thickness=3.4e-3),
        rest_length=0.0125,
        strength=Strength(tensile_strength=5.17e6, elongation_at_break=5.0),
    ),
    SPRING,
    StrainStiffening(modulus=MODULI, knots=KNOTS),
    StretchyCable(stiffness=9e5, members=(("rubber", SPRING),)),
    StribeckFriction(
        sliding_effort=0.02, contact=Regularised(creep_speed=0.02), breakaway=0.01, stribeck_speed=0.5
    ),
    Through(cam=Pulley(radius=0.01), behind=("rubber", SPRING)),
    TorqueRipple(sine=0.01, cosine=0.005, order=28.0),
    Dashpot(damping=1e-3, domain=ROTATION),
    HOUSING,
    Turned(members=(("cam", HOUSING),), offset=0.02),
    TwoSidedCam(lever_arm=ROW, last_angle=0.925),
    TwoSidedCam(lever_arm=ROW, last_angle=0.925, cable=CABLE),
    ViscousMaterial(viscosity=31e3),
    parallel(a=SPRING, b=Dashpot(damping=12.0)),
    series(a=SPRING, b=Dashpot(damping=12.0)),
    tie(HOUSING, "shaft"),
)
EXAMPLES: tuple[Part, ...] = _PARTS
