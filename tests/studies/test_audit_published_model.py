"""The audit keeps its claims, its verdicts can turn, and its numbers come out again on other roads.

Independent roads, with no code of the study: printed matrices and a cycle of the branch integrated in time by
scipy; numerical ranks and determinant; the area of a loop by triangles; the points of the figures against the
published tables.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from nlsdesign.cli.studies import claims, run_study
from studies.audit_published_model import figures, law, paper
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

NAME = "audit_published_model"
A, BRANCH, VISCOSITY = 8e-3, 0.58e6, 411.0
MODULI = (0.92e6, 0.58e6, 0.74e6, 0.77e6, 0.47e6, 1.06e6)
KNOTS = (0.0, 0.2e-3, 1.06e-3, 2.65e-3, 9.04e-3, 9.05e-3)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    out = tmp_path_factory.mktemp("audit")
    return out, run_study(NAME, out)


@pytest.fixture(scope="module")
def audit(done: tuple[Path, dict[str, float]]) -> dict[str, Any]:
    return dict(json.loads((done[0] / "audit.json").read_text(encoding="utf8")))


def test_the_audit_keeps_its_claims(done: tuple[Path, dict[str, float]]) -> None:
    expected = claims(NAME)
    assert set(done[1]) == set(expected)
    for name, claim in expected.items():
        assert claim.holds(done[1][name]), (name, done[1][name], claim)


def test_the_verdicts_are_those_expected(root: Path, audit: dict[str, Any]) -> None:
    tables = tomllib.loads((root / "studies" / "expected.toml").read_text(encoding="utf8"))
    assert {f["key"]: f["verdict"] for f in audit["findings"]} == tables["verdicts"][NAME]
    for verdict, count in audit["counts"].items():
        assert count == sum(f["verdict"] == verdict for f in audit["findings"])
    # One statement for each item of the list at least, and more around it.
    assert {f["key"].split(".")[0] for f in audit["findings"]} >= {str(i) for i in range(11)} | set("ABC")


def test_each_statement_shows_its_calculation(
    done: tuple[Path, dict[str, float]], audit: dict[str, Any]
) -> None:
    page = (done[0] / "report.html").read_text(encoding="utf8")
    for found in audit["findings"]:
        assert found["calculation"], found["key"]
        assert found["why"], found["key"]
        for line in found["calculation"]:
            assert bool(line["formula"]) == bool(line["latex"]), line
    formulas = sum(bool(line["formula"]) for f in audit["findings"] for line in f["calculation"])
    assert page.count("<math") == formulas > 60
    assert page.count("<svg") >= 8
    assert "http://" not in page.replace("http://www.w3.org", "")
    text = (done[0] / "audit.txt").read_text(encoding="utf8")
    assert all(f"[{f['verdict']}]" in text for f in audit["findings"])


# --- verdicts can turn ----------------------------------------------------------------------------


def verdict(findings: list[Any], key: str) -> str:
    (found,) = [f for f in findings if f.key == key]
    return str(found.verdict)


def test_another_parameter_turns_the_table_of_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper, "MODULI", paper.MODULI * 1.01)
    assert verdict(law.findings(), "0.3") == "does not hold"


def test_a_lost_term_turns_the_derivation(monkeypatch: pytest.MonkeyPatch) -> None:
    lost = paper.CORRECT_FORCE_RATE + paper.A * paper.K * paper.RATE
    monkeypatch.setattr(paper, "CORRECT_FORCE_RATE", lost)
    assert verdict(law.findings(), "0.1") == "does not hold"


def test_a_wrong_unit_turns_the_dimensional_audit(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = {"(1)": (paper.F, paper.F_STAR + paper.ETA * paper.RATE)}
    monkeypatch.setattr(law, "EQUATIONS", wrong)
    assert verdict(law.findings(), "0.4") == "does not hold"


def test_loops_that_run_the_other_way_turn_the_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    forward = figures.element_loop

    def backward(degrees: int, kind: str = "measured") -> tuple[np.ndarray, np.ndarray]:
        x, force = forward(degrees, kind)
        return x[::-1], force[::-1]

    monkeypatch.setattr(figures, "element_loop", backward)
    found = figures.findings()
    assert verdict(found, "8.4") == "does not hold"
    assert verdict(found, "8.5") == "holds"


# --- other roads ----------------------------------------------------------------------------------


def static(extension: float) -> float:
    return sum(A * k * max(extension - at, 0.0) for k, at in zip(MODULI, KNOTS, strict=True))


def test_matrices_as_printed_come_to_rest_at_the_claimed_forces(
    done: tuple[Path, dict[str, float]],
) -> None:
    """Rows of A and E of (3) integrated from F = 0 at a held extension; the other sign gives F*."""
    for name, x in (("3.5", 3.5e-3), ("12", 12e-3)):
        on = [(k, at) for k, at in zip(MODULI, KNOTS, strict=True) if x >= at]
        for sign, wanted in ((1, done[1][f"printed_rest_at_{name}_mm_N"]), (-1, static(x))):
            push = A * BRANCH / VISCOSITY * sum(k * (x + sign * at) for k, at in on)
            run = solve_ivp(lambda _, f, c=push: c - BRANCH / VISCOSITY * f, (0.0, 0.02), [0.0], rtol=1e-9)
            assert run.y[0, -1] == pytest.approx(wanted, rel=1e-4)


def extension_behind_fig8(angle: float) -> float:
    """δ where two elements of 2.55·F* hold the energy of 4.35·θ^2.09."""
    wanted = 4.35 * abs(angle) ** 3.09 / 3.09

    def miss(x: float) -> float:
        stored = sum(A * k * max(x - at, 0.0) ** 2 / 2 for k, at in zip(MODULI, KNOTS, strict=True))
        return 2 * 2.55 * stored - wanted

    return float(brentq(miss, 0.0, 20e-3, xtol=1e-12))


def test_the_loss_of_a_cycle_comes_out_in_the_time_domain(done: tuple[Path, dict[str, float]]) -> None:
    """The branch integrated over two cycles of 9 Hz; lost is the integral of N·F_M²/(a·η)."""
    frequency = 9.0
    phase = np.linspace(0.0, 0.25, 1201)
    quarter = np.array([extension_behind_fig8(np.pi / 4 * np.sin(2 * np.pi * v)) for v in phase])
    whole = np.concatenate([quarter, quarter[-2::-1], quarter[1:], quarter[-2::-1]])
    times = np.linspace(0.0, 1.0 / frequency, len(whole))
    rate = np.gradient(whole, times)

    def change(time: float, force: np.ndarray) -> np.ndarray:
        moving = np.interp(time % times[-1], times, rate)
        return A * BRANCH * moving - BRANCH / VISCOSITY * force

    at = times[-1] + times
    branch = solve_ivp(
        change, (0.0, 2 * times[-1]), [0.0], "LSODA", at, rtol=1e-8, atol=1e-9, max_step=2e-5
    ).y[0]
    lost = 2 * np.trapezoid(branch**2, times) / (A * VISCOSITY)
    power = 2 * (np.array([static(x) for x in whole]) + branch) * rate
    put_in = np.trapezoid(np.clip(power, 0.0, None), times)
    assert 100 * lost / put_in == pytest.approx(done[1]["loss_at_9_Hz_percent"], rel=5e-3)


def test_ranks_of_the_published_form_by_numbers(done: tuple[Path, dict[str, float]]) -> None:
    measured = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    for lever, name in ((0.7, "rank_of_the_published_form"), (0.0, "rank_where_the_lever_arm_vanishes")):
        a = np.zeros((4, 4))
        a[0, :2], a[2, 3], a[3, 0] = (-1.4, 0.9), 1.0, -2 * lever
        stacked = np.vstack([measured @ np.linalg.matrix_power(a, n) for n in range(4)])
        assert np.linalg.matrix_rank(stacked) == done[1][name]


@pytest.mark.parametrize("degrees", [25, 45])
def test_the_area_of_fig6_by_triangles(root: Path, done: tuple[Path, dict[str, float]], degrees: int) -> None:
    file = root / "studies" / "austin2015_figures" / f"fig06_measured_{degrees}deg_force_vs_extension.csv"
    x, y = np.genfromtxt(file, delimiter=",", skip_header=2, unpack=True)
    triangles = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    assert -triangles == pytest.approx(done[1][f"fig6_loop_{degrees}_deg_mJ"], rel=1e-9)


def test_an_ideal_cam_for_fig8_is_hollow_by_differences(done: tuple[Path, dict[str, float]]) -> None:
    """h'' of the lever arm by finite differences, for a rubber that starts with 1 N/mm."""
    m, angle, step = done[1]["power_of_fig8"], 0.05, 1e-3

    def extension(at: float) -> float:
        return float(np.sqrt(2 * at ** (m + 1) / ((m + 1) * 2 * 1e3)))

    def lever(at: float) -> float:
        return (extension(at + 1e-6) - extension(at - 1e-6)) / 2e-6

    bend = (lever(angle + step) - 2 * lever(angle) + lever(angle - step)) / step**2
    assert bend * angle**2 / lever(angle) == pytest.approx(done[1]["curvature_number_of_fig8"], rel=1e-3)
    assert lever(angle) + bend < 0.0


def test_the_determinant_by_numbers(audit: dict[str, Any]) -> None:
    """θ, dθ/dt, d²θ/dt² of a state (F_M, θ, ω) with arbitrary other entries, against the printed formula."""
    lever, inertia, elements = 0.011, 6e-4, 2
    a = np.array([[-1411.0, 33.0, 55.0], [0.0, 0.0, 1.0], [-elements * lever / inertia, -7.0, -0.3]])
    stacked = np.vstack([np.array([0.0, 1.0, 0.0]) @ np.linalg.matrix_power(a, n) for n in range(3)])
    (found,) = [f for f in audit["findings"] if f["key"] == "3.3"]
    (formula,) = [line["formula"] for line in found["calculation"] if line["formula"]]
    right = sympy.sympify(
        formula.removeprefix("Eq(det O, ").removesuffix(")"), locals={"N": sympy.Symbol("N")}
    )
    value = right.subs({"N": elements, "h": lever, "J": inertia})
    assert float(value) == pytest.approx(np.linalg.det(stacked), rel=1e-9)


def test_the_points_of_the_project_are_those_published(root: Path, shared_folder: Path) -> None:
    compared = 0
    for file in sorted((root / "studies" / "austin2015_figures").glob("fig06_*.csv")):
        ours = np.loadtxt(file, delimiter=",", comments="#", skiprows=2)
        table = (shared_folder / "paper" / file.name).read_text(encoding="utf8").splitlines()[1:]
        theirs = np.array([[float(c) for c in row.split(",")] for row in table if row.count(",") == 1])
        assert ours == pytest.approx(theirs, rel=1e-12)
        compared += len(ours)
    assert compared > 800
