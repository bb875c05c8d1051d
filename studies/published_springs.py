"""Theirs, ours: two springs that each of three other groups published, designed on their own task.

ETH Zurich: a pair of cams that roll on each other with a coil between their pivots (Wu and Mintchev 2024).
University of Michigan: a cam around a motor, on which a roller is pressed by a coil (Nestani 2024).
Worcester Polytechnic Institute: a pulley with a cable and a coil (Khalandovsky 2017). Each spring is asked
for with the curve, the range and the coil that they give. What they do not print of their own design, the
radius or the force, is computed here from their numbers by the balance of work; the table says which.

Source: Wu and Mintchev 2024; Nestani 2024; Khalandovsky 2017.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

import nlsdesign as nls
from nlsdesign.components import (
    Assembly,
    Cam,
    CompressionCoil,
    ExtensionCoil,
    Fixed,
    Inertia,
    OneSidedCam,
    RollerCam,
    RollingPair,
    StatedRate,
    TwoSidedCam,
)
from nlsdesign.design import (
    AnchorDistance,
    CamDesign,
    DesignSettings,
    LeastSize,
    Limit,
    MaximumPressureAngle,
    MinimumRadiusOfCurvature,
    NumberRange,
    PowerTorque,
    SmoothContour,
    TabulatedTorque,
    Target,
    TorqueError,
    contour_from_lever_arm,
)
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.text_files import write_text
from nlsdesign.presentation import figures
from nlsdesign.presentation.report import Chapter, FigureSection, FoldedSection, Section, TableSection

POUND, INCH = 4.4482216153, 0.0254
"""N and m."""
GOALS = (TorqueError(), SmoothContour(), LeastSize(weight=1e-4))
"""Of springs that follow the curve alike the smallest."""
CONTOUR, PRETENSION, ANCHOR = "spring.cam.contour", "spring.pretension", "spring.cam.anchor_distance"
EDGE = MinimumRadiusOfCurvature(
    nls.quantity(0.5, "mm", source="assumed: they state no cable; a thin one lies on this edge")
)
START = nls.quantity(5.0, "mm", source="assumed: a start for the design")


@dataclass(frozen=True, eq=False)
class Published:
    """A spring as its authors describe it; radius and force are the largest, in m and N."""

    key: str
    name: str
    targets: Mapping[str, Target]  # by side
    coil: ExtensionCoil | CompressionCoil
    elements: float
    radius: float
    force: float
    follows: str  # how their design follows the curve
    source: str


class JointCam(NamedTuple):
    """Largest force in N, distance of the roller's centre in m, and pressure angle in degrees."""

    force: float
    centre_radius: float
    pressure_angle: float


@dataclass(frozen=True, eq=False)
class Ours:
    """One answer to a published spring: a design for each side."""

    published: Published
    key: str
    kind: str
    sides: Mapping[str, CamDesign]
    verdict: str  # better, or the reason why not

    @cached_property
    def radius(self) -> float:
        """The largest distance of the cam from its centre in m."""
        return max(float(design.contour.radii.max()) for design in self.sides.values())

    @cached_property
    def force(self) -> float:
        """The largest force of one coil in N."""
        return max(float(design.curves.forces.max()) for design in self.sides.values())

    @cached_property
    def largest_miss(self) -> float:
        """The largest error of the torque over the largest torque of its side."""
        return max(design.check.largest / design.target.largest for design in self.sides.values())

    @property
    def as_theirs(self) -> bool:
        """Whether preload or anchor are those of the authors, too."""
        return self.key in ("at_their_preload", "on_their_anchor")

    @property
    def met(self) -> bool:
        """Whether all sides meet their targets."""
        return all(design.met for design in self.sides.values())


@dataclass(frozen=True, eq=False)
class Results:
    """All answers, in the order of the table."""

    answers: tuple[Ours, ...]

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        numbers = {}
        for ours in self.answers:
            theirs = ours.published
            numbers[f"{theirs.key}_theirs_radius_mm"] = 1e3 * theirs.radius
            numbers[f"{theirs.key}_theirs_force_N"] = theirs.force
            numbers[f"{theirs.key}_{ours.key}_radius_mm"] = 1e3 * ours.radius
            numbers[f"{theirs.key}_{ours.key}_force_N"] = ours.force
            numbers[f"{theirs.key}_{ours.key}_largest_miss_percent"] = 100.0 * ours.largest_miss
        return numbers


def main(out: Path, fast: bool = False) -> Results:
    """Design each spring on its own task, and write table and report; not fast, draw the new ones."""
    results = Results((*rolling_pairs(), *cams_at_the_joint(), *pulleys()))
    write(out, results, drawn=not fast)
    return results


# What they publish ---------------------------------------------------------------------------------------


def line() -> Published:
    """A line over ±90°."""
    source = "Wu and Mintchev 2024, Step1_SpringSelector.m of 19 Feb 2025, Example 1"
    target = PowerTorque(
        coefficient=0.25 / math.radians(90.0), exponent=1.0, angle=nls.quantity(90.0, "deg", source=source)
    )
    coil = extension_coil(
        "Wu and Mintchev 2024, Step2_ERCdesigner.m of 19 Feb 2025: coil 8/1/1, the one that is set",
        length=39.47e-3, travel=20e-3, most=35.09, least=1.75,
    )  # fmt: skip
    radius, force = rolling_pair(target, coil, 1.0)
    return Published(
        "eth_line", "ETH, line of 0.25 N·m over ±90°", {"both": target}, coil, 1.0, radius, force,
        "exact by its energy", source,
    )  # fmt: skip


def fall() -> Published:
    """A jump to 0.125 N·m at angle zero, then a fall to nothing at 90°."""
    angles = np.radians([0.0, 0.2, 90.0])
    target = TabulatedTorque(angles=tuple(angles), torques=(0.0, 0.125, 0.0))
    coil = line().coil
    assert isinstance(coil, ExtensionCoil)
    radius, force = rolling_pair(target, coil, 1.0)
    return Published(
        "eth_fall", "ETH, jump to 0.125 N·m, falls over ±90°", {"both": target}, coil, 1.0, radius, force,
        "exact by its energy", "Wu and Mintchev 2024, Step1_SpringSelector.m of 19 Feb 2025, Example 4",
    )  # fmt: skip


def hills() -> Published:
    """A hill at 30° and a valley at 60°, the case of their guide."""
    angles = np.radians([0.0, 5.0, 30.0, 60.0, 89.8])
    target = TabulatedTorque(angles=tuple(angles), torques=(0.0, 0.035, 0.07, 0.0, 0.035))
    coil = extension_coil(
        "Wu and Mintchev 2024, README.md, Spring Selection: coil 5/1/1",
        length=30.27e-3, travel=15.87e-3, most=18.82, least=0.0,
    )  # fmt: skip
    radius, force = rolling_pair(target, coil, 2.0)
    return Published(
        "eth_hills", "ETH, hills of 0.07 N·m over ±90°", {"both": target}, coil, 2.0, radius, force,
        "negligible rms deviation at their safety factor 2",
        "Wu and Mintchev 2024, README.md and Step1_SpringSelector.m, Example on repository; joint of 27 g",
    )  # fmt: skip


MOTOR_CAM, ROLLER = 51e-3, 6.5e-3
"""Nestani 2024: radius of the cam where the torque is zero, set by the motor inside, and of the roller."""
SPRING_RATE, SPRING_TRAVEL, SPRING_LENGTH = 61.183 * POUND / INCH, 1.17 * INCH, 3.858 * INCH
"""Nestani 2024, src/OptimizationWrapper.m: MW Components 76328."""
PRELOAD = math.sqrt(2.0 * 0.01 * 4.7314 / SPRING_RATE)
"""Its extension with 1 % of the energy that the spring holds, where their search begins and ends."""


def knee() -> Published:
    """The cam of the released program: from −1.944 to 0.024 rad, without torque at −0.252 rad."""
    targets = {
        "long side": cubic((2.82107791, -2.11789187, 1.66518795), 1.944065314 - 0.252421590),
        "short side": cubic((2.82107791, 165.591348, -515.067492), 0.023909116 + 0.252421590),
    }
    return around_a_motor(
        "michigan_knee", "Michigan, knee, 6.8 N·m over 97° and 3.2 N·m over 16°", targets, 75.8686e-3,
        "Nestani 2024, app/src/Rpsi_debug.mat and src/camXYZ.txt",
    )  # fmt: skip


def second_cam() -> Published:
    """A cam of an earlier state of the repository: from −1.244 to 0.024 rad, no torque at −0.262 rad."""
    targets = {
        "long side": cubic((17.09892235, -44.662806, 29.21310475), 1.2439913894 - 0.26237276),
        "short side": cubic((17.09892235, -1.73074087, -89.02193438), 0.023909116 + 0.26237276),
    }
    return around_a_motor(
        "michigan_second", "Michigan, second cam, 1.9 N·m over 56° and 2.7 N·m over 16°", targets, 61.6541e-3,
        "Nestani 2024, Rpsi_debug.mat and camXYZ.txt of commit fb49ca2, 26 Jun 2024",
    )  # fmt: skip


def around_a_motor(
    key: str, name: str, targets: Mapping[str, Target], radius: float, source: str
) -> Published:
    """Return a cam of Michigan with the radius of its published points."""
    cam = joint_cam(targets)
    return Published(
        key, name, targets, compression_coil("Nestani 2024, src/OptimizationWrapper.m: spring 76328"), 1.0,
        radius, cam.force, f"exact by its energy; pressure angle {cam.pressure_angle:.0f}°", source,
    )  # fmt: skip


def knee_pulley() -> Published:
    """A line up to π N·m over 90°, for the knee of a biped."""
    target = PowerTorque(coefficient=2.0, exponent=1.0, angle=nls.quantity(90.0, "deg"))
    source = "Khalandovsky 2017, misc/energy_calc/knee_pulley.m"
    return wound("wpi_knee", "WPI, knee, line of 3.1 N·m over 90°", target, source,
                 rate=28e3, most=560.0, anchor=math.hypot(50e-3, 10e-3))  # fmt: skip


def gravity_pulley() -> Published:
    """The weight of an arm, 2.2 lbf·in·sin(angle) from where it hangs to level."""
    angles = np.linspace(0.0, math.pi / 2.0, 61)
    torques = 2.2 * POUND * INCH * np.sin(angles)
    slopes = 2.2 * POUND * INCH * np.cos(angles)
    target = TabulatedTorque(angles=tuple(angles), torques=tuple(torques), slopes=tuple(slopes))
    source = "Khalandovsky 2017, misc/energy_calc/logan_pulley.m"
    return wound("wpi_gravity", "WPI, weight of an arm, 0.25 N·m over 90°", target, source,
                 rate=3.0 * POUND / INCH, most=7.0 * POUND, anchor=8.0 * INCH)  # fmt: skip


# What follows from their numbers -------------------------------------------------------------------------


def rolling_pair(target: Target, coil: ExtensionCoil, elements: float) -> tuple[float, float]:
    """Return radius and force of a pair of equal cams that roll on each other, their coil full at the end.

    By symmetry the point of contact halves the coil. With R half its length and θ half the angle of the joint
    the contour has the support function R(θ), so its radius is √(R² + (dR/dθ)²), with dR/dθ = torque/force.
    """
    assert isinstance(coil.winding, StatedRate)
    rate, travel = coil.winding.rate.number, coil.largest_extension.number
    angles = np.linspace(0.0, target.last_angle, 400)
    tension = coil.initial_tension.number
    full = 0.5 * (2.0 * tension + rate * travel) * travel
    work = target.energy(angles) / elements
    ways = np.sqrt(2.0 * (full - work[-1] + work) / rate)
    forces = rate * ways
    halves = (coil.free_length.number + ways) / 2.0
    radii = np.hypot(halves, target.torque(angles) / (elements * forces))
    return float(radii.max()), float(forces.max())


def joint_cam(targets: Mapping[str, Target]) -> JointCam:
    """Return what a cam of Michigan does: k·(e₀ + x)²/2 is the work of their preload and of the curve."""
    forces, radii, slopes = [], [], []
    for target in targets.values():
        angles = grid(target)
        ways = np.sqrt(PRELOAD**2 + 2.0 * target.energy(angles) / SPRING_RATE)
        forces.append(SPRING_RATE * ways)
        radii.append(MOTOR_CAM + ROLLER + ways - PRELOAD)
        slopes.append(target.torque(angles) / forces[-1])
    steepest = np.max(np.abs(np.concatenate(slopes) / np.concatenate(radii)))
    return JointCam(
        float(np.max(np.concatenate(forces))),
        float(np.max(np.concatenate(radii))),
        math.degrees(math.atan(steepest)),
    )


def pulley(target: Target, *, rate: float, most: float, anchor: float) -> tuple[float, float]:
    """Return the radius of a pulley and its least radius of curvature in m; its coil is full at the end."""
    angles = grid(target)
    stored = target.energy(angles)
    forces = np.sqrt(most**2 - 2.0 * rate * (stored[-1] - stored))
    contour = contour_from_lever_arm(angles, target.torque(angles) / forces, anchor_distance=anchor)
    return float(contour.radii.max()), float(contour.radii_of_curvature.min())


def wound(
    key: str, name: str, target: Target, source: str, *, rate: float, most: float, anchor: float
) -> Published:
    """Return a pulley whose coil bears ``most`` at the end of the range."""
    radius, curvature = pulley(target, rate=rate, most=most, anchor=anchor)
    hollow = curvature < -1e-6
    follows = f"not exact: hollow by {-1e3 * curvature:.1f} mm at worst" if hollow else "exact"
    travel = most / rate
    coil = ExtensionCoil(
        free_length=nls.quantity(2.0 * travel, "m", source="assumed: their program asks for none"),
        initial_tension=nls.quantity(0.0, "N", source=source),
        largest_extension=nls.quantity(travel, "m", source=f"{source}: largest force over rate"),
        winding=StatedRate(rate=nls.quantity(rate, "N/m", source=source)),
    )
    return Published(key, name, {"both": target}, coil, 1.0, radius, most, follows, source)


def cubic(coefficients: tuple[float, float, float], last: float) -> TabulatedTorque:
    """Return c₁·θ + c₂·θ² + c₃·θ³ up to the last angle."""
    angles = np.linspace(0.0, last, 61)
    first, second, third = coefficients
    torques = angles * (first + angles * (second + angles * third))
    slopes = first + angles * (2.0 * second + angles * 3.0 * third)
    return TabulatedTorque(angles=tuple(angles), torques=tuple(torques), slopes=tuple(slopes))


def grid(target: Target) -> Array:
    """Return angles over the range of a target."""
    return np.linspace(0.0, target.last_angle, 2001)


def extension_coil(source: str, *, length: float, travel: float, most: float, least: float) -> ExtensionCoil:
    """Return a coil of their list: length and force when it is full, and force at rest."""
    return ExtensionCoil(
        free_length=nls.quantity(length - travel, "m", source=source),
        initial_tension=nls.quantity(least, "N", source=source),
        largest_extension=nls.quantity(travel, "m", source=source),
        winding=StatedRate(rate=nls.quantity((most - least) / travel, "N/m", source=source)),
    )


def compression_coil(source: str) -> CompressionCoil:
    """Return the coil of Michigan's cams."""
    return CompressionCoil(
        free_length=nls.quantity(SPRING_LENGTH, "m", source=source),
        solid_length=nls.quantity(SPRING_LENGTH - SPRING_TRAVEL, "m", source=f"{source}, its largest travel"),
        winding=StatedRate(rate=nls.quantity(SPRING_RATE, "N/m", source=source)),
    )


# Ours ----------------------------------------------------------------------------------------------------


def rolling_pairs() -> list[Ours]:
    """Answer ETH: a cable for the line, a roller and a pair as theirs for the hills, a pair for the fall."""
    straight, curved, falling = line(), hills(), fall()
    return [
        one_design(
            straight, "cable", "cable through the centre", TwoSidedCam,
            "Smaller. The coil lies beside the cam, which needs a bearing; theirs has it between its pivots.",
        ),
        one_design(
            curved, "roller", "roller", RollerCam,
            "Smaller. Not better at angle zero: their curve jumps, and the way of a roller has no corner, so "
            "the jump takes 5° here.",
        ),
        one_design(
            curved, "pair", "pair that rolls", RollingPair,
            "The same: coil and curve allow one pair where the coil uses all its travel.",
        ),
        one_design(
            falling, "pair", "pair that rolls", RollingPair,
            "Smaller, with their jump: both cams have a flat facet at angle zero.",
        ),
    ]  # fmt: skip


def cams_at_the_joint() -> list[Ours]:
    """Answer Michigan: at their preload, with all travel of their coil, and without the motor inside."""
    answers = []
    for theirs in (knee(), second_cam()):
        around = [NumberRange("spring.cam.base_radius", MOTOR_CAM + ROLLER, MOTOR_CAM + ROLLER + 1e-6)]
        steep = [*around, MaximumPressureAngle(nls.quantity(45.0, "deg"))]
        preloaded = nls.quantity(PRELOAD, "m", source=theirs.source)
        same = {
            side: designed(theirs, side, RollerCam, keep=steep, free=(CONTOUR,), pretension=preloaded)
            for side in theirs.targets
        }
        answers += [
            Ours(
                theirs, "at_their_preload", "roller, around their motor, their preload", same,
                "The same cam: curve, coil, preload and radius at zero torque allow one only.",
            ),
            Ours(
                theirs, "around_their_motor", "roller, around their motor", both_sides(theirs, around),
                "Smaller, and a pressure angle of at most 30°: more preload asks for less way. Not better in "
                "force: the coil uses all its travel.",
            ),
            Ours(
                theirs, "alone", "roller, no motor inside", both_sides(theirs, ()),
                "Smaller; theirs goes around its motor and this one does not. Not better in force.",
            ),
        ]  # fmt: skip
    return answers


def both_sides(theirs: Published, keep: Sequence[Limit]) -> dict[str, CamDesign]:
    """Design the side that stores more first; the other takes its pretension, both the larger radius."""
    long, short = theirs.targets
    first = designed(theirs, long, RollerCam, keep=keep)
    chosen = first.values[PRETENSION]
    second = designed(theirs, short, RollerCam, keep=keep, free=(CONTOUR,), pretension=chosen)
    radii = [side.values["spring.cam.base_radius"].number for side in (first, second)]
    if abs(radii[1] - radii[0]) < 1e-5:
        return {long: first, short: second}
    common = [NumberRange("spring.cam.base_radius", max(radii), max(radii) + 1e-6)]
    return {
        side: designed(theirs, side, RollerCam, keep=common, free=(CONTOUR,), pretension=chosen)
        for side in theirs.targets
    }


def pulleys() -> list[Ours]:
    """Answer WPI: on their anchor, and with what makes it better."""
    rising, weight = knee_pulley(), gravity_pulley()
    nearer = AnchorDistance(nls.quantity(30.0, "mm"), nls.quantity(8.0 * INCH, "m"))
    return [
        one_design(
            rising, "on_their_anchor", "cable, their anchor", with_anchor(math.hypot(50e-3, 10e-3)),
            "The same: curve, coil and force allow one lever arm.",
        ),
        one_design(
            rising, "round", "cable, at rest without tension", OneSidedCam,
            "Less force, and a round drum: a linear coil without pretension gives a linear torque. Not "
            "better in size, for less force needs a longer arm.",
        ),
        one_design(
            weight, "on_their_anchor", "cable, their anchor", with_anchor(8.0 * INCH),
            "No convex contour follows; this is the nearest.",
        ),
        one_design(
            weight, "nearer_anchor", "cable, anchor free", with_anchor(8.0 * INCH),
            "Follows, and smaller, at no more force: the anchor is nearer.",
            free=(CONTOUR, PRETENSION, ANCHOR), keep=[nearer],
        ),
    ]  # fmt: skip


def with_anchor(distance: float) -> Callable[..., Cam]:
    """Return what makes a cam whose cable ends at a distance from the centre in m."""

    def made(**numbers: object) -> Cam:
        return TwoSidedCam(**numbers, anchor_distance=nls.quantity(distance, "m"))  # type: ignore[arg-type]

    return made


def one_design(
    theirs: Published, key: str, kind: str, cam: Callable[..., Cam], verdict: str,
    *, free: Sequence[str] = (CONTOUR, PRETENSION), keep: Sequence[Limit] = (),
) -> Ours:  # fmt: skip
    """Answer with one design for both signs of the angle."""
    design = designed(theirs, "both", cam, free=free, keep=keep)
    return Ours(theirs, key, kind, {"both": design}, verdict)


def designed(
    theirs: Published, side: str, cam: Callable[..., Cam],
    *, keep: Sequence[Limit] = (), free: Sequence[str] = (CONTOUR, PRETENSION),
    pretension: nls.Quantity = START,
) -> CamDesign:  # fmt: skip
    """Return a cam for one side, with the coil of the authors."""
    return nls.design_cam(
        machine(theirs, theirs.targets[side].last_angle, cam, pretension),
        target=theirs.targets[side],
        free=list(free),
        keep=keep if cam in (RollerCam, RollingPair) else [EDGE, *keep],
        goals=GOALS,
        settings=DesignSettings(starts=2, draws=0, look_for_size_ranges=False, look_for_remedies=False),
    )


def machine(theirs: Published, last: float, cam: Callable[..., Cam], pretension: nls.Quantity) -> Assembly:
    """Return a body that turns a cam on their coil; inertias do not matter at rest."""
    numbers = {"last_angle": nls.quantity(last, "rad", source=theirs.source), "elements": theirs.elements}
    if cam is RollingPair:
        numbers["base_distance"] = nls.quantity(40e-3, "m", source="a start for the design")
        arms = (0.0, *[1.0] * 19)
    elif cam is RollerCam:
        michigan = isinstance(theirs.coil, CompressionCoil)
        numbers["roller_radius"] = nls.quantity(
            ROLLER if michigan else 3e-3, "m",
            source=theirs.source if michigan else "assumed: a ball bearing MR63",
        )  # fmt: skip
        numbers["base_radius"] = nls.quantity(
            MOTOR_CAM + ROLLER if michigan else 10e-3, "m", source="a start for the design"
        )
        arms = (0.0, *[3.0] * 19)
    else:
        arms = (5.0,) * 16
    made = cam(lever_arm=nls.quantity(arms, "mm", source="a start for the design"), **numbers)
    spring = nls.tie(nls.through(made, pretension=pretension, coil=theirs.coil), "motor", "load")
    body = Inertia(inertia=nls.quantity(1.0, "g*m^2", source="assumed: of no account at rest"))
    return nls.assembly(theirs.key, motor=body, load=Fixed(), spring=spring)


# What is written -----------------------------------------------------------------------------------------

HEADS = ("spring", "ours", "radius, mm", "force, N", "largest miss, %", "verdict")


def rows_of(results: Results) -> list[tuple[str, ...]]:
    """Return the rows of the table."""
    return [
        (
            ours.published.name,
            ours.kind,
            f"{1e3 * ours.published.radius:.1f} → {1e3 * ours.radius:.1f}",
            f"{ours.published.force:.1f} → {ours.force:.1f}",
            f"{100.0 * ours.largest_miss:.2f}" + ("" if ours.met else ", missed"),
            ours.verdict,
        )
        for ours in results.answers
    ]


def write(out: Path, results: Results, *, drawn: bool) -> None:
    """Write table, decks and report, and pictures of the parts if they are to be drawn."""
    rows = rows_of(results)
    lines = [" | ".join(row) for row in (HEADS, *rows)]
    write_text(out / "theirs_ours.txt", "\n".join(lines) + "\n")
    folded: dict[Published, list[Section]] = {}
    for ours in results.answers:
        for side, design in ours.sides.items():
            name = f"{ours.published.key}_{ours.key}_{side.replace(' ', '_')}"
            nls.write_deck(design.actuator, out / name / "designed.toml")
            if drawn and not ours.as_theirs and side == next(iter(ours.sides)):
                figures.DesignPictures(deck=ours.published.name).of_design(design, out / name)
            curve = {"ours": (design.check.angles, design.check.torques)}
            folded.setdefault(ours.published, []).append(
                FigureSection(
                    f"Torque, {ours.kind}, {side}",
                    figures.torque_against_target(design.target, curve),
                    caption=f"Of the finished assembly, whose deck is {name}/designed.toml.",
                )
            )
    nls.write_report(
        out / "report.html",
        TableSection(
            "Theirs, ours",
            HEADS,
            tuple(rows),
            caption="Theirs → ours. Radius: the largest distance of the cam from its centre. Force: the "
            "largest of one coil. Theirs of ETH and WPI follow from their numbers by the balance of work; "
            "radii of Michigan are of their published points, their forces follow. Miss: of the largest "
            "torque of its side.",
        ),
        *(
            section
            for theirs, parts in folded.items()
            for section in (
                Chapter(theirs.name, f"Theirs: {theirs.follows}. Source: {theirs.source}."),
                FoldedSection("Torque of ours over the angle", tuple(parts)),
            )
        ),
        title="Springs that others published",
        abstract="Each on its own task: curve, range and coil are theirs. Masses are not compared, for none "
        "gives that of its spring alone; ETH's joint of the hills weighs 27 g with both cams and coils.",
    )
