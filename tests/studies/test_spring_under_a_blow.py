"""Springs under a blow, against the closed form of a linear spring and an independent integration."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlsdesign.cli import studies as runner
from studies import spring_under_a_blow as study


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, study.Results]:
    out = tmp_path_factory.mktemp("blow")
    return out, study.main(out, fast=True)


@pytest.mark.slow
def test_the_study_keeps_its_claims(results: tuple[Path, study.Results]) -> None:
    out, found = results
    assert runner.not_as_claimed(asdict(found), runner.claims("spring_under_a_blow")) == {}
    assert "energy of the blow" in (out / "report.html").read_text(encoding="utf8")


@pytest.mark.slow
def test_a_held_linear_spring_takes_the_whole_energy(results: tuple[Path, study.Results]) -> None:
    """E = T^2/(2 k), so T = sqrt(2 k E)."""
    _, found = results
    for stiffness, light, heavy, travel in (
        (1.7, found.soft_held_light_Nm, found.soft_held_heavy_Nm, found.soft_energy_in_travel_J),
        (3.4, found.stiff_held_light_Nm, found.stiff_held_heavy_Nm, found.stiff_energy_in_travel_J),
    ):
        assert light == pytest.approx(math.sqrt(2.0 * stiffness * 0.1), rel=1e-4)
        assert heavy == pytest.approx(math.sqrt(2.0 * stiffness * 0.5), rel=1e-4)
        assert travel == pytest.approx(0.5 * stiffness * math.radians(53.0) ** 2, rel=2e-3)


@pytest.mark.slow
def test_a_rotor_that_gives_way_agrees_with_an_independent_integration(
    results: tuple[Path, study.Results],
) -> None:
    """Two bodies, a linear spring, viscous and dry friction of the rotor, numbers of the decks by hand."""
    _, found = results

    def largest(stiffness: float) -> float:
        def rates(_: float, x: np.ndarray) -> list[float]:
            torque = stiffness * (x[2] - x[0])
            friction = 1e-3 * x[1] + 0.02 * math.tanh(x[1] / 0.02)
            return [x[1], (torque - friction) / 5.97e-4, x[3], -torque / 0.02]

        run = solve_ivp(
            rates,
            (0.0, 0.2),
            [0.0, 0.0, 0.0, math.sqrt(2.0 * 0.5 / 0.02)],
            rtol=1e-9,
            atol=1e-11,
            max_step=1e-4,
        )
        return float(np.abs(stiffness * (run.y[2] - run.y[0])).max())

    assert found.soft_free_heavy_Nm == pytest.approx(largest(1.7), rel=1e-3)
    assert found.stiff_free_heavy_Nm == pytest.approx(largest(3.4), rel=1e-3)
