"""Worked examples of coil springs in textbooks, in the units in which they are printed.

Numbers given and results are those of Budynas and Nisbett, Shigley's Mechanical Engineering Design, 10th
edition, 2015, examples 10-1 (p. 519) and 10-6 (p. 561). They were taken at second hand, from public tests of
other software that transcribe them with page numbers; the book itself was not at hand.
"""

from __future__ import annotations

from typing import Any

import pytest

import nlsdesign as nls
from nlsdesign.components import CompressionCoil, ExtensionCoil, Mass, Winding, assembly, tie
from nlsdesign.components.mechanics.coils import Coil, greatest_initial_tension

INCH, POUND = 0.0254, 4.4482216
KPSI = 1e3 * POUND / INCH**2


def wound(d: float, mean: float, coils: float, shear_mpsi: float) -> Winding:
    return Winding(d * INCH, mean * INCH, coils, shear_mpsi * 1e3 * KPSI)  # type: ignore[arg-type]


def at(coil: Coil, inches: float) -> dict[str, float]:
    model = nls.flatten(assembly("bench", weight=Mass(mass=1.0), coil=tie(coil, "weight")))
    return model.evaluate([inches * INCH, 0.0])


def test_extension_spring_of_hard_drawn_wire() -> None:
    """Example 10-6: 0.035 in wire, 0.248 in outside, 12.17 turns + G/E, 1.19 lbf initial tension."""
    body: dict[str, Any] = {"free_length": 0.817 * INCH, "largest_extension": 0.3 * INCH}
    winding = wound(0.035, 0.213, 12.17 + 11.6 / 28.7, 11.6)
    coil = ExtensionCoil(winding=winding, initial_tension=1.19 * POUND, **body)  # type: ignore[arg-type]
    rate = (at(coil, 0.2)["coil.force"] - at(coil, 0.1)["coil.force"]) / (0.1 * POUND)
    assert rate == pytest.approx(17.91, abs=0.01)
    loaded = at(coil, 0.227)
    assert loaded["coil.force"] / POUND == pytest.approx(5.25, abs=0.01)
    assert loaded["coil.shear_stress"] / KPSI == pytest.approx(82.0, abs=0.2)
    assert greatest_initial_tension(0.035 * INCH, 0.213 * INCH) > 1.19 * POUND


def test_compression_spring_of_music_wire() -> None:
    """Example 10-1: no. 16 music wire of 0.037 in, 0.400 in mean, 10.5 active coils, solid at 0.500 in."""
    coil = CompressionCoil(
        winding=wound(0.037, 0.400, 10.5, 11.85), free_length=2.06 * INCH, solid_length=0.5 * INCH
    )  # type: ignore[arg-type]
    loaded = at(coil, 1.56)
    assert loaded["coil.force"] / POUND / 1.56 == pytest.approx(4.13, abs=0.01)
    assert loaded["coil.shear_stress"] / KPSI == pytest.approx(146.0, abs=0.5)
    assert coil.valid[1] / INCH == pytest.approx(1.56, abs=1e-9)
