"""Drawings: what the files say, that they are whole or not there, and the fingerprint."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.design import Contour, fingerprint, write_drawings
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.errors import ExportError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from tests.dxf_reading import entities_of, header_of, polylines_of


@pytest.fixture
def contour() -> Contour:
    nodes = np.linspace(0.0, 1.4, 8)
    return contour_from_curvature(nodes, np.full(8, 6e-3), first_slope=9e-3, anchor_distance=25e-3)


def test_three_files_with_unit_and_note(tmp_path: Path, contour: Contour) -> None:
    files = write_drawings(
        tmp_path / "new", contour, name="lip", note="0123abcd, 5 N*m & more", cable_radius=0.5e-3
    )
    assert [file.name for file in files] == ["lip.csv", "lip.svg", "lip.dxf"]
    assert sorted(item.name for item in (tmp_path / "new").iterdir()) == ["lip.csv", "lip.dxf", "lip.svg"]
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert "mm" in text or "millimetres" in text
        assert "0123abcd" in text


def test_csv_holds_the_contour_in_millimetres(tmp_path: Path, contour: Contour) -> None:
    file, *_ = write_drawings(tmp_path, contour, cable_radius=0.5e-3)
    lines = file.read_text(encoding="utf-8").splitlines()
    assert lines[3].split(",")[2:4] == ["x_mm", "y_mm"]
    table = np.array([[float(item) for item in line.split(",")] for line in lines[4:]])
    assert table[:, 2:4] == pytest.approx(1e3 * contour.surface(0.5e-3), abs=1e-6)
    assert table[:, 0] == pytest.approx(np.degrees(contour.angles), abs=1e-6)
    assert table[:, 5] == pytest.approx(5.5)


def test_dxf_of_the_contour_says_its_unit_and_that_it_is_no_edge(tmp_path: Path, contour: Contour) -> None:
    *_, file = write_drawings(tmp_path, contour, note="größer", cable_radius=0.5e-3)
    text = file.read_text(encoding="ascii")
    assert header_of(text)["$INSUNITS"].strip() == "4"
    lower, upper = polylines_of(text, "CONTOUR")
    assert lower[:, :2] == pytest.approx(1e3 * contour.outlines(cable_radius=0.5e-3)[0][:-1], abs=1e-6)
    assert upper == pytest.approx(-lower)
    assert polylines_of(text, "EDGE") == []
    said = "; ".join(value for item in entities_of(text) for value in item.values.get(1, []))
    assert "no edge to be cut" in said
    assert r"gr\U+00F6\U+00DFer" in said


def test_svg_is_well_formed_and_to_scale(tmp_path: Path, contour: Contour) -> None:
    _, file, _ = write_drawings(tmp_path, contour, note="<5 & 6>")
    root = ElementTree.parse(file).getroot()
    assert root.attrib["width"].endswith("mm")
    assert root.attrib["viewBox"].split()[2] == root.attrib["width"].removesuffix("mm")
    assert root.attrib["viewBox"].split()[3] == root.attrib["height"].removesuffix("mm")
    halves = [item for item in root.iter("{http://www.w3.org/2000/svg}path") if item.attrib.get("fill")]
    assert len(halves) == 2
    numbers = [
        float(item)
        for item in halves[0].attrib["d"].replace("M", "").replace("L", "").replace("Z", "").split()
    ]
    assert max(numbers[::2]) == pytest.approx(1e3 * contour.points[:, 0].max(), abs=1e-3)


def test_a_contour_too_sharp_for_the_cable_writes_nothing(tmp_path: Path, contour: Contour) -> None:
    with pytest.raises(ValueRangeError, match="cable radius 7 mm"):
        write_drawings(tmp_path, contour, cable_radius=7e-3)
    assert list(tmp_path.iterdir()) == []


def test_a_write_that_fails_leaves_the_old_file(
    tmp_path: Path, contour: Contour, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cam.csv").write_text("old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(ExportError, match=r"cam\.csv: cannot be written \(disk full\)"):
        write_drawings(tmp_path, contour)
    assert [(item.name, item.read_text()) for item in tmp_path.iterdir()] == [("cam.csv", "old")]


def test_fingerprint_depends_on_names_and_numbers_only() -> None:
    values = {"a": quantity(1.0, "mm"), "b": quantity((1.0, 2.0), "N")}
    same = {"b": quantity((1.0, 2.0), "N", source="elsewhere"), "a": quantity(0.001, "m")}
    assert fingerprint(values) == fingerprint(same)
    assert len(fingerprint(values)) == 12
    assert fingerprint(values) != fingerprint({**values, "a": quantity(1.0000001, "mm")})
    assert fingerprint(values) != fingerprint({"c": values["a"], "b": values["b"]})
