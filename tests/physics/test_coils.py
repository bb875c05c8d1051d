"""Coils: the rate against the work of the twisted wire, stress and fatigue by hand, a cam that pulls one."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import nlsdesign as nls
from nlsdesign.components import (
    CoilMass,
    CompressionCoil,
    ExtensionCoil,
    InextensibleCable,
    Mass,
    NotDeclared,
    Part,
    StatedRate,
    Winding,
    WireStrength,
    assembly,
    through,
    tie,
    torsion_coil,
)
from nlsdesign.components.assembly.deck_remarks import deck_remarks
from nlsdesign.components.mechanics.coils import Coil
from nlsdesign.design import (
    CamDesign,
    CoilStock,
    DesignSettings,
    MaximumTravel,
    NumberRange,
    Target,
    read_job,
    safe_limits,
)
from nlsdesign.foundation.errors import NlsError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from tests.cam_cases import CONCAVE, TARGET, actuator
from tests.physics.table import Row

WOUND = Winding(
    wire_diameter=quantity(2.0, "mm"),
    mean_diameter=quantity(14.0, "mm"),
    active_coils=12.0,  # type: ignore[arg-type]
    shear_modulus=quantity(79.3, "GPa"),
)
HARD_DRAWN = WireStrength(strength_at_1_mm=quantity(1783.0, "MPa"), strength_exponent=0.19)  # type: ignore[arg-type]
PULLED = ExtensionCoil(
    free_length=quantity(60.0, "mm"),
    winding=WOUND,
    strength=HARD_DRAWN,
    initial_tension=quantity(30.0, "N"),
    largest_extension=quantity(40.0, "mm"),
)
PUSHED = CompressionCoil(
    free_length=quantity(60.0, "mm"), winding=WOUND, strength=HARD_DRAWN, solid_length=quantity(28.0, "mm")
)
STATED = {
    "winding": StatedRate(quantity(4.8, "N/mm")),
    "weight": CoilMass(quantity(15.0, "g")),
    "strength": NotDeclared(),
}
EXAMPLES: tuple[Part, ...] = (
    PULLED,
    PUSHED,
    replace(PULLED, **STATED),  # type: ignore[arg-type]
    replace(PUSHED, **STATED),  # type: ignore[arg-type]
)
_ROADS = ("flat model", "Castigliano: energy of the twisted wire, integrated along it")
ROWS = tuple(
    Row(kind, "force of a coil", _ROADS, "test_coils.py::test_force_is_that_of_the_twisted_wire")
    for kind in (ExtensionCoil, CompressionCoil)
)


def forces(coil: Coil, extensions: np.ndarray, signal: str = "force") -> np.ndarray:
    """A signal of a coil between a weight and the frame."""
    model = nls.flatten(assembly("bench", weight=Mass(mass=1.0), coil=tie(coil, "weight")))
    return np.array([model.evaluate([float(e), 0.0])[f"coil.{signal}"] for e in extensions])


@pytest.mark.parametrize("coil", [PULLED, PUSHED], ids=lambda c: type(c).__name__)
def test_force_is_that_of_the_twisted_wire(coil: Coil) -> None:
    d, radius, shear = 2e-3, 7e-3, 79.3e9

    def energy(force: float) -> float:
        polar = math.pi * d**4 / 32
        return quad(lambda _: (force * radius) ** 2 / (2 * shear * polar), 0.0, 2 * math.pi * radius * 12)[0]

    step = 1.0
    compliance = (energy(10 + step) - energy(10 - step)) / (2 * step) / 10
    initial = 30.0 if isinstance(coil, ExtensionCoil) else 0.0
    at = np.linspace(2e-3, 30e-3, 8)
    assert forces(coil, at) == pytest.approx(initial + at / compliance, rel=5e-6), "the rounding takes 5e-6"
    assert forces(coil, np.zeros(1))[0] == 0.0


def test_closed_coils_open_over_their_initial_tension() -> None:
    near = forces(PULLED, np.array([-1e-5, 0.5e-4, 2e-4]))
    rate = forces(PULLED, np.array([2e-3, 3e-3])) @ [-1e3, 1e3]
    closed = rate + 30.0 / 1e-4
    assert near[:2] == pytest.approx([-1e-5 * closed, 0.5e-4 * closed], rel=1e-2)
    assert near[2] == pytest.approx(30.0 + rate * 2e-4, rel=1e-4)


def test_a_cable_lets_go_where_the_coils_close() -> None:
    """Slack beyond its free length only: the initial tension does not pull a cable that gives way."""
    rope = InextensibleCable(members=(("coil", PULLED),))
    model = nls.flatten(assembly("bench", weight=Mass(mass=1.0), rope=tie(rope, "weight")))
    force = [model.evaluate([e, 0.0])["rope.force"] for e in (-5e-3, -1e-4, 1e-3)]
    assert force == pytest.approx([0.0, 0.0, forces(PULLED, np.array([1e-3]))[0]], abs=1e-6)


def test_the_factor_of_bergstraesser_is_that_of_wahl_to_one_and_a_half_percent() -> None:
    for index in (4.0, 7.0, 16.0):
        coil = replace(PUSHED, winding=replace(WOUND, mean_diameter=index * 2e-3))  # type: ignore[arg-type]
        force, stress = (forces(coil, np.array([5e-3]), name)[0] for name in ("force", "shear_stress"))
        wahl = (4 * index - 1) / (4 * index - 4) + 0.615 / index
        assert stress == pytest.approx(8 * wahl * force * index * 2e-3 / (math.pi * 8e-9), rel=0.014)


def test_stiffness_of_a_twisted_coil_is_that_of_its_bent_wire() -> None:
    """θ = M·l/(E·I) over the length π·D·n of the wire."""
    wire = {"wire_diameter": quantity(2.0, "mm"), "mean_diameter": quantity(20.0, "mm")}
    spring = torsion_coil(**wire, active_coils=5.0, youngs_modulus=quantity(206.0, "GPa"))
    bent = 206e9 * math.pi * 2e-3**4 / 64 / (math.pi * 20e-3 * 5.0)
    assert spring.stiffness.number == pytest.approx(bent, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: replace(PULLED, winding=replace(WOUND, mean_diameter=quantity(6.0, "mm"))),
            r"spring index 3 must lie in \[4, 16\] -> make the mean diameter 8 mm, or the wire 1.5 mm",
        ),
        (
            lambda: replace(PUSHED, solid_length=quantity(61.0, "mm")),
            r"solid_length = 61 mm: must be below free_length = 60 mm",
        ),
    ],
)
def test_coils_that_cannot_be_are_named(make: object, words: str) -> None:
    with pytest.raises(ValueRangeError, match=words):
        make()  # type: ignore[operator]


def test_what_is_likely_a_slip_is_remarked_with_the_least_change() -> None:
    slips = replace(PULLED, initial_tension=quantity(60.0, "N"), free_length=quantity(20.0, "mm"))
    tension, length, travel = deck_remarks(machine(slips))
    # By hand: C = 7, 33500/e^0.735 + 1000·(4 − 4/6.5) = 19450 psi, 134.1 MPa.
    assert "initial_tension: coiling such wire leaves 30.09 N at most, not 60 N -> write at" in tension
    assert "12 coils of this wire are 26 mm long when they touch, more than 20 mm" in length
    least = float(travel.split("let it travel ")[1].split(" mm")[0]) * 1e-3
    at_end = forces(slips, np.array([least]), "shear_stress")[0]
    assert at_end == pytest.approx(0.45 * 1783e6 * 2.0**-0.19, rel=1e-3)
    assert not deck_remarks(machine(replace(slips, winding=StatedRate(4800.0))))  # type: ignore[arg-type]


def machine(coil: Coil) -> nls.components.Assembly:
    """A motor that pulls one coil over a cam."""
    bare = actuator(CONCAVE)
    cam = replace(bare["spring.cam"], elements=quantity(1.0, "1"))
    spring = tie(through(cam, coil=coil, pretension=1e-3), "motor", "load")
    return assembly("bench", motor=bare["motor"], load=bare["load"], spring=spring)


@pytest.mark.slow
def test_a_cam_and_the_wire_of_its_coil_are_designed_together() -> None:
    wire = [f"spring.coil.{name}" for name in ("wire_diameter", "mean_diameter", "active_coils")]
    design = nls.design_cam(
        machine(PULLED),
        target=TARGET,
        free=["spring.cam.contour", "spring.pretension", *wire],
        keep=[NumberRange(wire[1], 5e-3, 16e-3)],
        settings=DesignSettings(draws=0, look_for_size_ranges=False, starts=2),
    )
    assert design.met
    chosen = design.actuator.quantities()
    d, mean, n = (chosen[name].number for name in wire)
    # The torque by hand, of the drawn contour and the chosen wire.
    rate = 79.3e9 * d**4 / (8 * mean**3 * n)
    force = 30.0 + rate * design.curves.extensions
    assert design.curves.forces == pytest.approx(force, rel=1e-4)
    angles, arms = design.curves.angles, design.curves.lever_arms
    assert arms * force == pytest.approx(TARGET.torque(angles), abs=0.005)
    # Goodman by hand: it binds, by default.
    factor = (4 * mean / d + 2) / (4 * mean / d - 3)
    low, high = (8 * factor * f * mean / (math.pi * d**3) for f in (force[0], force[-1]))
    strength = 0.67 * 1783e6 * (1e3 * d) ** -0.19
    used = (high - low) / 2 / (241e6 / (1 - 379e6 / strength)) + (high + low) / 2 / strength
    assert 1 / used == pytest.approx(1.5, rel=1e-4)
    assert "GoodmanSafety" in {state.limit for state in design.limits if state.active}


def test_limits_follow_from_what_a_coil_declares() -> None:
    words = [type(each).__name__ for each in safe_limits(nls.flatten(machine(PULLED)))]
    assert words == ["MaximumTravel", "MinimumSpringIndex", "MaximumSpringIndex", "GoodmanSafety"]
    stated = safe_limits(nls.flatten(machine(replace(PULLED, **STATED))))  # type: ignore[arg-type]
    assert stated == (MaximumTravel(0.04),)


@pytest.mark.long_cases("wire", "length")
@pytest.mark.parametrize(
    ("coil", "words"),
    [
        (replace(PULLED, **STATED), "nothing limits what the wire bears"),  # type: ignore[arg-type]
        (replace(PULLED, free_length=0.02), "long when they touch, more than 0.02 m"),
    ],
    ids=["wire", "length"],
)
def test_a_design_says_what_is_not_known_or_does_not_fit(coil: Coil, words: str) -> None:
    assert [remark for remark in designed(coil).remarks if words in remark]
    assert not [remark for remark in designed(PULLED).remarks if words in remark]


@cache
def designed(coil: Coil) -> CamDesign:
    """A contour for a coil, found once."""
    settings = DesignSettings(draws=0, look_for_size_ranges=False, look_for_remedies=False, starts=1)
    return nls.design_cam(machine(coil), target=TARGET, free=["spring.cam.contour"], settings=settings)


def test_an_outside_diameter_is_larger_by_one_wire(tmp_path: Path) -> None:
    text = HEADS.replace("mean_diameter", "outer_diameter") + SMALL
    (tmp_path / "coils.csv").write_text(text, encoding="utf-8")
    ((_, drive),) = CoilStock(tmp_path / "coils.csv").options(machine(PULLED))
    assert drive.quantities()["spring.coil.mean_diameter"].number == pytest.approx(19.6e-3 - 2.8e-3)


HEADS = (
    "number,wire_diameter [mm],mean_diameter [mm],active_coils,initial_tension [N],largest_extension [mm]\n"
)
SMALL, LARGE = "2815,2.8,19.6,14,29.5,33.5\n", "3219,3.2,22.4,14,38.5,37.5\n"
WEAK = "1601,1.6,8.8,14,14.1,12.0\n"


@pytest.mark.slow
def test_the_smallest_coil_of_a_catalogue_that_holds_is_taken(tmp_path: Path) -> None:
    (tmp_path / "coils.csv").write_text("# made up\n" + HEADS + LARGE + WEAK + SMALL, encoding="utf-8")
    job = tmp_path / "job.toml"
    job.write_text(
        """free = ["spring.cam.contour", "spring.pretension"]
        [target]
        ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
        [stock]
        coil = "coils.csv"
        """,
        encoding="utf-8",
    )
    settings = DesignSettings(draws=0, look_for_size_ranges=False, look_for_remedies=False, starts=1)
    asked = read_job(job)
    assert isinstance(asked.target, Target)
    drive = nls.declare(nls.load_deck("coil_cable_drive"))
    design = nls.design_cam(drive, target=asked.target, free=asked.free, settings=settings)
    large, weak, small = design.alternatives
    assert large.met
    assert small.met
    declared, chosen = (a.quantities()["spring.coil.wire_diameter"] for a in (drive, design.actuator))
    assert chosen == quantity(2.8, "mm", source="coils.csv, line 5", spread=declared.spread)
    assert declared.spread
    turns = math.pi**2 / 4 * 2.8e-3**2 * 19.6e-3 * 14
    assert small.rubber_volume == pytest.approx(turns, rel=1e-9)
    # By hand: 14.1 N·12 mm + 1/2·7.92 N/mm·(12 mm)².
    assert "spring.coil = no. 1601 of coils.csv, line 4" in weak.choice
    assert "coil that stores 0.65" in weak.reason
    assert "the torque needs 1.9" in weak.reason


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADS + SMALL.replace("19.6", "9.6"), r"coils.csv, line 2: .*spring index 3.43 must lie in"),
        ("number,mean_diametre [mm]\n1,20\n", r"mean_diametre.*did you mean 'mean_diameter'"),
        (HEADS + SMALL + LARGE + SMALL, "coils.csv, line 4: has the number of line 2"),
        (f"rate [N/mm],{HEADS}" + f"20,{SMALL}", "rate and wire_diameter: say the same twice"),
        ("number,mass [g],strength_at_1_mm [MPa]\n1,20,1800\n", "says nothing without strength_exponent"),
    ],
)
def test_a_catalogue_that_cannot_be_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "coils.csv").write_text(text, encoding="utf-8")
    with pytest.raises(NlsError, match=words):
        list(CoilStock(tmp_path / "coils.csv").options(machine(replace(PULLED, strength=NotDeclared()))))
