"""Coils: the rate against the work of the twisted wire, stress and fatigue by hand, a cam that pulls one."""

from __future__ import annotations

import math
from dataclasses import replace

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
    tie,
    torsion_coil,
)
from nlsdesign.components.mechanics.coils import Coil
from nlsdesign.components.assembly.deck_remarks import deck_remarks
from nlsdesign.design import DesignSettings, GoodmanSafety, MaximumTravel, NumberRange, safe_limits
from nlsdesign.foundation.errors import InfeasibleError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity, quantity
from tests.cam_cases import TARGET, actuator
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
