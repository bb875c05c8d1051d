"""What the page of a sweep says of its numbers holds for the way in which the points were chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.named_parts import Assembly
from nlsdesign.foundation.work_sharing import InThisProcess
from nlsdesign.presentation.sweep_report import write_sweep_report
from nlsdesign.presentation.sweep_report.shown_points import shown_unit
from nlsdesign.sweeps import FunctionQuestion, GridAxis, LatinHypercube, SobolSample, sweep
from nlsdesign.sweeps.axes import AxisSet
from tests.sweeping import AREA, INERTIA, actuator
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

pytest.importorskip("SALib")

INTERVALS = "bars around them their 95 % intervals."
STROKES = "Black strokes are 95 % intervals"


def mass(made: Assembly) -> dict[str, float]:
    numbers = made.quantities()
    return {"mass": 1e4 * numbers[AREA].number + 1e5 * numbers[INERTIA].number}


def page_of(folder: Path, *axes: AxisSet) -> str:
    asked = FunctionQuestion(mass, {"mass": ""})
    table = sweep(actuator(), axes=axes, ask=asked, out=folder / "out", executor=InThisProcess())
    return write_sweep_report(table, folder / "page").page.read_text(encoding="utf-8")


def drawn(name: str, ends: tuple[str, str], count: int, seed: int) -> AxisSet:
    return LatinHypercube({name: ends}, count, seed)


AREAS, INERTIAS = ("10 mm^2", "100 mm^2"), ("20 g*cm^2", "40 g*cm^2")


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> str:
    return page_of(tmp_path_factory.mktemp("sample"), SobolSample({AREA: AREAS, INERTIA: INERTIAS}, 256, 1))


def test_crossed_samples_have_fewer_draws_than_points_and_get_no_interval(
    tmp_path: Path, sample: str
) -> None:
    # Five areas, each twenty times: an interval from 100 draws of the area would be far too narrow.
    crossed = page_of(tmp_path, drawn(AREA, AREAS, 5, 1), drawn(INERTIA, INERTIAS, 20, 2))
    assert INTERVALS not in crossed
    assert "samples that are crossed are no independent draws" in crossed
    assert INTERVALS in sample


def test_intervals_are_spoken_of_where_there_are_some(tmp_path: Path, sample: str) -> None:
    page = page_of(tmp_path, GridAxis(AREA, *AREAS, 6), GridAxis(INERTIA, *INERTIAS, 5))
    assert "exact shares of the variance" in page
    assert STROKES not in page
    assert STROKES in sample


def test_volumes_are_shown_in_a_unit_that_people_read() -> None:
    unit, factor = shown_unit("m^3")
    assert unit == "cm^3"
    assert factor * 8e-6 == pytest.approx(8.0)
    assert np.isclose(shown_unit("m^2")[1] * 1e-4, 100.0)
