"""Fig. 6 of the paper as records: the force lags the extension, so the diagnosis doubts the data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models import cam_rubber_actuator
from nlsdesign.bench.discrepancy import diagnose, effects
from nlsdesign.bench.discrepancy.screening.causality import lagging_forces
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.residuals import loop_of
from nlsdesign.components import TRANSLATION, Assembly, Driven, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten

FIGURES = Path(__file__).parents[2] / "studies" / "austin2015_figures"
SAMPLE = 0.4e-3  # s; distance of the points on the time axis of the figure
MAPPING = """
held_out = ["fig6_45deg"]
[columns.extension_mm]
signal = "grip.position"
unit = "mm"
[columns.force_N]
signal = "rubber.force"
unit = "N"
"""


def points(degrees: int) -> np.ndarray:
    file = FIGURES / f"fig06_measured_{degrees}deg_force_vs_extension.csv"
    return np.loadtxt(file, delimiter=",", comments="#", skiprows=2)


def element() -> Assembly:
    """One rubber element of the actuator between a driven grip and the bench."""
    rubber = cam_rubber_actuator(load_deck("austin2015_figure_consistent")).element("spring.rubber")
    found = assembly("element", grip=Driven(domain=TRANSLATION), rubber=tie(rubber, "grip"))
    measured = ("area", "rest_length", "knots")
    return found.with_values(
        {n: replace(q, spread=0.0) for n, q in found.quantities().items() if n.rpartition(".")[2] in measured}
    )


def written(folder: Path, *, order: int) -> RecordSet:
    """Write the points as records, in drawing order or against it."""
    for degrees in (25, 45):
        rows = points(degrees)[::order]
        table = np.column_stack([SAMPLE * np.arange(len(rows)), rows])
        file = folder / f"fig6_{degrees}deg.csv"
        np.savetxt(file, table, delimiter=",", header="t_s,extension_mm,force_N", comments="")
    (folder / "records.toml").write_text(MAPPING, encoding="utf8")
    return load_records(folder, flatten(element()))


@pytest.mark.parametrize(
    "catalogue",
    [
        (effects.second_relaxation, effects.rate_independent_hysteresis),
        pytest.param(effects.ALL, marks=pytest.mark.slow),
    ],
    ids=["what delays a force", "all"],
)
def test_the_points_of_fig_6_are_suspect_and_the_reason_is_said(
    tmp_path: Path, catalogue: tuple[effects.Effect, ...]
) -> None:
    records = written(tmp_path, order=1)
    assert records.findings == (), "nothing about the channels by themselves is odd"
    verdict = diagnose(element(), records, catalogue=catalogue)
    assert verdict.verdict == "data_suspect"
    assert verdict.effects == ()
    said = [text for text in verdict.where if "lags rubber.extension" in text]
    assert [text.partition(":")[0] for text in said] == ["fig6_25deg.csv"], "the other one is held out"
    assert "∮F dδ < 0" in said[0]
    both = lagging_forces(element(), records).findings
    assert [each.place.partition(":")[0] for each in both] == ["fig6_25deg.csv", "fig6_45deg.csv"]
    assert "28.2 mJ" in both[1].text
    assert "at least 0.44 ms late" in both[1].text


def test_the_same_points_drawn_the_other_way_are_not_suspect(tmp_path: Path) -> None:
    found = lagging_forces(element(), written(tmp_path, order=-1))
    assert found.findings == ()


@pytest.mark.parametrize(("degrees", "work"), [(25, -6.12e-3), (45, -28.15e-3)])
def test_the_work_is_the_area_of_the_polygon(degrees: int, work: float) -> None:
    """Against the shoelace formula, which knows no trapezia."""
    x, force = points(degrees).T * [[1e-3], [1.0]]
    area = 0.5 * float(np.sum(x * np.roll(force, -1) - np.roll(x, -1) * force))
    loop = loop_of(x, force, SAMPLE, noise=0.1)
    assert loop is not None
    assert -area == pytest.approx(work, rel=5e-3)
    assert loop.work == pytest.approx(-area, rel=0.02)
    assert loop.gives
    assert not loop.takes


def test_a_force_that_comes_late_is_found_with_its_delay() -> None:
    time = np.arange(0.0, 1.0, 1e-3)
    path = 0.5 * (1.0 - np.cos(2.0 * np.pi * 5.0 * time))
    late = 0.5 * 3.0 * (1.0 - np.cos(2.0 * np.pi * 5.0 * (time - 4e-3)))
    loop = loop_of(path, late, 1e-3)
    assert loop is not None
    assert loop.gives
    # The first order of the lag: sin(ωτ) for ωτ.
    assert loop.late_by == pytest.approx(np.tan(2.0 * np.pi * 5.0 * 4e-3) / (2.0 * np.pi * 5.0), rel=0.01)
    assert loop_of(np.linspace(0.0, 1.0, 100), np.ones(100), 1e-3) is None, "the path does not come back"
