"""The torque curve of a spring from walking: how much heat a motor saves, and at which gear ratio.

An actuator carries a twentieth of the torque of hip, knee or ankle of a person of 75 kg. The motor is that of
the deck ``one_sided_cable_drive``; its gear ratio is free. Rigid drive, best linear spring and best curve are
each taken at their own best ratio, so that the spring is not credited with what a gear would have done.

For the ankle a cam and its rubber are designed too, and the heat is computed with the torque that this spring
has instead of the curve that was asked for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import nlsdesign as nls
from nlsdesign.components import Rounded, StrainStiffening
from nlsdesign.design import (
    CamDesign,
    DesignSettings,
    LeastPeakPower,
    MotorAndGear,
    MotorCycle,
    RestLengthRange,
    TabulatedTorque,
    Target,
    Task,
    TaskCurve,
    TaskProblem,
    curve_for_task,
    motor_and_gear,
    motor_cycle,
    scan_gear_ratio,
    walking_task,
)
from nlsdesign.presentation import figures
from nlsdesign.presentation.report import (
    Chapter,
    FigureSection,
    TableSection,
    TextSection,
    design_sections,
    tolerance_sections,
)

from ._designed import with_machined_contour
from ._published import declared_actuator

BODY_MASS = nls.quantity(75.0, "kg")
SHARE = 0.05
RATIOS = tuple(float(ratio) for ratio in range(20, 121, 10))
COARSE = (40.0, 80.0)
FREE = ("spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length")
KEEP = (
    nls.MaximumCamRadius(nls.quantity(25.0, "mm", source="assumed: room at a shank")),
    RestLengthRange(8e-3, 100e-3),
)
ANCHOR = nls.quantity(40.0, "mm", spread=0.005, source="assumed: clear of the cam, bored within 0.2 mm")
CORNERS = nls.quantity(0.02, "1", source="assumed: rubber has no corners; the fitted law has them")


@dataclass(frozen=True)
class Results:
    """The numbers that ``expected.toml`` claims; heat per stride, each at its best gear ratio."""

    ankle_gear_ratio: float
    ankle_heat_rigid_J: float
    ankle_heat_linear_J: float
    ankle_heat_curve_J: float
    ankle_above_bound_percent: float
    ankle_peak_power_rigid_W: float
    ankle_peak_power_curve_W: float
    knee_heat_rigid_J: float
    knee_heat_curve_J: float
    hip_heat_rigid_J: float
    hip_heat_curve_J: float
    ankle_design_error_mNm_rms: float
    ankle_heat_designed_J: float
    numbers = property(asdict, doc="The results by name.")


@dataclass(frozen=True)
class Joint:
    """One joint: the curves by gear ratio, and the best of each kind."""

    name: str
    curves: dict[float, TaskCurve]

    @property
    def ratio(self) -> float:
        """Gear ratio at which the curve has the least heat."""
        return min(self.curves, key=lambda ratio: self.curves[ratio].best.heat)

    @property
    def curve(self) -> TaskCurve:
        """The curve at its best gear ratio."""
        return self.curves[self.ratio]

    @property
    def rigid_heat(self) -> float:
        """Heat of the rigid drive in J, at its best ratio."""
        return min(curve.rigid.heat for curve in self.curves.values())

    @property
    def linear_heat(self) -> float:
        """Heat with the best linear spring in J, at its best ratio."""
        return min(curve.linear.heat for curve in self.curves.values() if curve.linear)


def main(out: Path, fast: bool = False) -> Results:
    """Find the springs for three joints and write a report."""
    model = nls.flatten(nls.models.one_sided_cable_drive(nls.load_deck("one_sided_cable_drive")))
    drive = motor_and_gear(model)
    tasks = {name: walking_task(name, body_mass=BODY_MASS).scaled(SHARE) for name in ("ankle", "knee", "hip")}
    joints = {name: joint_of(name, task, drive, COARSE if fast else RATIOS) for name, task in tasks.items()}
    ankle = joints["ankle"]
    problem = TaskProblem(goal=LeastPeakPower(), pieces=8 if fast else 24)
    power = curve_for_task(tasks["ankle"], drive.geared(ankle.ratio), problem)
    usual = DesignSettings(draws=1000, look_for_size_ranges=False)
    design = designed_ankle(ankle.curve.target, replace(usual, starts=2, draws=40) if fast else usual)
    motor = motor_cycle(tasks["ankle"], drive.geared(ankle.ratio), spring=curve_of(design))
    write(out, joints.values(), power, AnkleSpring(design, motor))
    return Results(
        ankle_gear_ratio=ankle.ratio,
        ankle_heat_rigid_J=ankle.rigid_heat,
        ankle_heat_linear_J=ankle.linear_heat,
        ankle_heat_curve_J=ankle.curve.best.heat,
        ankle_above_bound_percent=100.0 * (ankle.curve.gap or 0.0),
        ankle_peak_power_rigid_W=power.rigid.peak_power,
        ankle_peak_power_curve_W=power.best.peak_power,
        knee_heat_rigid_J=joints["knee"].rigid_heat,
        knee_heat_curve_J=joints["knee"].curve.best.heat,
        hip_heat_rigid_J=joints["hip"].rigid_heat,
        hip_heat_curve_J=joints["hip"].curve.best.heat,
        ankle_design_error_mNm_rms=1e3 * design.rms,
        ankle_heat_designed_J=motor.heat,
    )


@dataclass(frozen=True)
class AnkleSpring:
    """The spring that was designed for the ankle, and its motor over a stride."""

    design: CamDesign
    motor: MotorCycle


def designed_ankle(target: Target, settings: DesignSettings) -> CamDesign:
    """Return cam and rubber for the curve of the ankle, on the published actuator's arrangement.

    The corners of its rubber's law are rounded: a corner is a jump of the stiffness, which the motor would
    have to answer by a jump of its speed.
    """
    law = "spring.rubber.stiff"
    actuator = with_machined_contour(declared_actuator(), ANCHOR)
    stiff = actuator.element(law)
    assert isinstance(stiff, StrainStiffening)
    actuator = actuator.with_part(law, replace(stiff, contact=Rounded(width=CORNERS)))
    return nls.design_cam(actuator, target=target, free=FREE, keep=KEEP, settings=settings)


def curve_of(design: CamDesign) -> TabulatedTorque:
    """Return the torque that a designed spring has, as a curve for the motor's cycle."""
    check = design.check
    return TabulatedTorque(angles=tuple(check.angles), torques=tuple(check.torques))


def joint_of(name: str, task: Task, drive: MotorAndGear, ratios: Iterable[float]) -> Joint:
    """Return the curves of one joint over the gear ratios that the motor can serve."""
    curves = scan_gear_ratio(task, drive, list(ratios))
    return Joint(name, {ratio: curve for ratio, curve in curves.items() if isinstance(curve, TaskCurve)})


def write(out: Path, joints: Iterable[Joint], power: TaskCurve, ankle: AnkleSpring) -> None:
    """Write the report."""
    joints = list(joints)
    asked = joints[0].curve.best.heat
    rows = tuple(
        (joint.name, joint.ratio, joint.rigid_heat, joint.linear_heat, joint.curve.best.heat)
        for joint in joints
    )
    scans = (
        TableSection(
            f"Gear ratios, {joint.name}",
            (
                "gear ratio",
                "rigid, J",
                "linear spring, J",
                "curve, J",
                "two-branch spring, J of heat and work",
            ),
            tuple(
                (r, c.rigid.heat, c.linear.heat if c.linear else "none", c.best.heat, c.two_branch or "none")
                for r, c in joint.curves.items()
            ),
            caption="Heat of the motor over one stride.",
            folded=True,
        )
        for joint in joints
    )
    drawn = (
        section
        for joint in joints
        for section in (
            FigureSection(
                f"Curve for the {joint.name}",
                figures.curve_of_task(joint.curve),
                caption=f"At the gear ratio of least heat, {joint.ratio:g}.",
            ),
            FigureSection(
                f"Motor of the {joint.name}",
                figures.motor_over_task(joint.curve),
                caption="One stride.",
                assumed="No friction and no loss in the gear.",
            ),
        )
    )
    nls.write_report(
        out / "report.html",
        TableSection(
            "Heat per stride",
            ("joint", "gear ratio of the curve", "rigid, J", "best linear spring, J", "curve, J"),
            rows,
            caption="Each at its own best gear ratio.",
        ),
        *drawn,
        TextSection("Least peak power at the ankle", drawing=str(power)),
        *scans,
        Chapter(
            "A spring for the ankle",
            "Cam, pretension and rubber designed for the ankle's curve, on the arrangement of the published "
            f"actuator and within what cable and rubber bear. With the torque that this spring has the motor "
            f"turns {ankle.motor.heat:.3f} J of a stride into heat; with the curve itself {asked:.3f} J.",
        ),
        *design_sections(ankle.design, of="ankle"),
        *(tolerance_sections(ankle.design.tolerance) if ankle.design.tolerance is not None else []),
        title="Torque curves from walking",
        abstract="A twentieth of the joint torques of a person of 75 kg at natural speed, Bovi et al. 2011.",
    )
