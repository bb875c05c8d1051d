"""The torque curve of a spring from walking: how much heat a motor saves, and at which gear ratio.

An actuator carries a twentieth of the torque of hip, knee or ankle of a person of 75 kg. The motor is that of
the deck ``one_sided_cable_drive``; its gear ratio is free. Rigid drive, best linear spring and best curve are
each taken at their own best ratio, so that the spring is not credited with what a gear would have done.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import nlsdesign as nls
from nlsdesign import figures
from nlsdesign.design import (
    LeastPeakPower,
    MotorAndGear,
    Task,
    TaskCurve,
    TaskProblem,
    curve_for_task,
    motor_and_gear,
    scan_gear_ratio,
    walking_task,
)
from nlsdesign.report import FigureSection, TableSection, TextSection

BODY_MASS = nls.quantity(75.0, "kg")
SHARE = 0.05
RATIOS = tuple(float(ratio) for ratio in range(20, 121, 10))
COARSE = (20.0, 40.0, 80.0)


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
    power = curve_for_task(
        tasks["ankle"], drive.geared(ankle.ratio), TaskProblem(goal=LeastPeakPower(), pieces=24)
    )
    write(out, joints.values(), power)
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
    )


def joint_of(name: str, task: Task, drive: MotorAndGear, ratios: Iterable[float]) -> Joint:
    """Return the curves of one joint over the gear ratios that the motor can serve."""
    curves = scan_gear_ratio(task, drive, list(ratios))
    return Joint(name, {ratio: curve for ratio, curve in curves.items() if isinstance(curve, TaskCurve)})


def write(out: Path, joints: Iterable[Joint], power: TaskCurve) -> None:
    """Write the report."""
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
        title="Torque curves from walking",
        abstract="A twentieth of the joint torques of a person of 75 kg at natural speed, Bovi et al. 2011.",
    )
