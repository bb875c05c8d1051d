"""Relaxation at large stretch against the same physics written another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Driven,
    Element,
    FlowingChains,
    LinearElastic,
    ViscousMaterial,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate

MODULUS, VISCOSITY, LENGTH, AREA = 0.1e6, 0.3e6, 0.08, 1e-5


def pulled(law: Element) -> Assembly:
    return assembly(
        "pulled",
        grip=Driven(domain=TRANSLATION),
        strip=tie(specimen(area=AREA, rest_length=LENGTH, law=law), "grip"),
    )


def run(law: Element, largest: float, time: np.ndarray) -> tuple[Trace, np.ndarray, np.ndarray]:
    turn = 2.0 * np.pi / time[-1]
    strain = 0.5 * largest * (1.0 - np.cos(turn * time))
    rate = 0.5 * largest * turn * np.sin(turn * time)
    inputs = {"grip.position": LENGTH * strain, "grip.speed": LENGTH * rate}
    return simulate(flatten(pulled(law)), time, inputs=inputs), strain, rate


def test_work_is_stored_or_lost() -> None:
    """The elastic stretch follows λ̇ₑ/λₑ = λ̇/λ − σ/(3η), σ = µ(λₑ² − 1/λₑ), with nothing of the law's code."""
    time = np.linspace(0.0, 20.0, 4001)
    trace, strain, rate = run(FlowingChains(shear_modulus=MODULUS, viscosity=VISCOSITY), 1.8, time)

    def elastic_rate(t: float, e: np.ndarray) -> np.ndarray:
        stretch, speed = 1.0 + np.interp(t, time, strain), np.interp(t, time, rate)
        return e * (speed / stretch - MODULUS * (e**2 - 1.0 / e) / (3.0 * VISCOSITY))

    e = solve_ivp(elastic_rate, (0.0, 20.0), [1.0], t_eval=time, rtol=1e-9, atol=1e-11, method="LSODA").y[0]
    power = trace["strip.force"] * LENGTH * rate / (AREA * LENGTH)
    work = cumulative_trapezoid(power, time, initial=0.0)
    stored = MODULUS / 2.0 * (e**2 + 2.0 / e - 3.0)
    true_stress = MODULUS * (e**2 - 1.0 / e)
    lost = cumulative_trapezoid(true_stress**2 / (3.0 * VISCOSITY), time, initial=0.0)
    assert work == pytest.approx(stored + lost, abs=2e-4 * work.max())
    assert lost[-1] > 0.3 * work.max()
    assert trace["strip.force"].min() < 0.0, "what has flown has to be pushed back"


def test_small_strain_is_the_linear_maxwell_branch() -> None:
    time = np.linspace(0.0, 20.0, 2001)
    linear = series(
        spring=LinearElastic(modulus=3.0 * MODULUS), dashpot=ViscousMaterial(viscosity=3.0 * VISCOSITY)
    )
    differences = []
    for largest in (1e-2, 1e-3):
        large = run(FlowingChains(shear_modulus=MODULUS, viscosity=VISCOSITY), largest, time)[0][
            "strip.force"
        ]
        small = run(linear, largest, time)[0]["strip.force"]
        differences.append(np.max(np.abs(large - small)) / np.max(np.abs(small)))
    assert differences[0] < 2e-2
    assert differences[1] == pytest.approx(0.1 * differences[0], rel=0.1), "first order in the strain"
