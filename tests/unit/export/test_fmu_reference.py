"""Reference results beside an FMU: their format, and that a foreign run of the FMU agrees with them."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv, read_ref_opt_file

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_fmu, write_reference
from nlsdesign.feedback.control import torque_controller
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel
from tests.hand_built import controller, plant

VERSIONS = ("2.0", "3.0")


NAMES = ("plant", "observer", "controller", "specimen", "test_rig")


@cache
def models() -> dict[str, FlatModel]:
    actuator = flatten(declare(load_deck("austin2015_figure_consistent")))
    return {
        "plant": actuator,
        "observer": design_observer(actuator, gain=CascadeGain()),
        "controller": torque_controller(actuator),
        "specimen": flatten(declare(load_deck("vhb4910_specimen"))),
        "test_rig": flatten(declare(load_deck("test_rig"))),
    }


# A reading in counts may be one count off where the angle lies on the edge of a count.
COUNTS = {"motor_encoder.reading": "motor_encoder.quantum"}


def worst_deviation(fmu: Path, model: FlatModel) -> float:
    """Run an FMU in fmpy as its options say and return its worst deviation from the file, over the range."""
    options = read_ref_opt_file(str(fmu.with_name(f"{fmu.stem}_ref.opt")))
    reference = read_csv(str(fmu.with_name(f"{fmu.stem}_ref.csv")))
    given = read_csv(str(fmu.with_name(f"{fmu.stem}_in.csv")))
    names = list(reference.dtype.names[1:])
    result = fmpy.simulate_fmu(
        str(fmu), start_time=options["StartTime"], stop_time=options["StopTime"],
        step_size=options["StepSize"], output_interval=options["OutputIntervalLength"], input=given,
        output=names, fmi_type="CoSimulation",
    )  # fmt: skip
    np.testing.assert_allclose(result["time"], reference["time"], rtol=0, atol=1e-12)
    worst = 0.0
    for name in names:
        expected = reference[name]
        off = np.abs(result[name] - expected)
        if name in COUNTS:
            count = model.values[COUNTS[name]]
            assert np.sum(off > 0.5 * count) <= 10
            off = np.where((off > 0.5 * count) & (off < 1.5 * count), 0.0, off)
        worst = max(worst, float(off.max() / (np.ptp(expected) or 1.0)))
    return worst


QUICK = {("plant", "3.0"), ("observer", "2.0")}


@pytest.mark.long_cases("plant-3.0")
@pytest.mark.parametrize(
    ("name", "version"),
    [
        pytest.param(name, version, marks=() if (name, version) in QUICK else pytest.mark.slow)
        for name in NAMES
        for version in VERSIONS
    ],
)
def test_fmpys_run_of_the_fmu_agrees_with_the_reference(name, version, tmp_path):
    model = models()[name]
    fmu = export_fmu(model, tmp_path / f"{name}.fmu", version=version)
    write_reference(model, fmu)
    assert worst_deviation(fmu, model) < 1e-6
    # One disturbed number is found.
    file = fmu.with_name(f"{name}_ref.csv")
    rows = list(csv.reader(file.open()))
    column = len(rows[0]) - 1
    values = [float(row[column]) for row in rows[1:]]
    assert np.ptp(values) > 0.0
    rows[500][column] = repr(values[499] + 1e-4 * (max(values) - min(values)))
    file.write_text("\n".join([",".join(f'"{n}"' for n in rows[0]), *[",".join(r) for r in rows[1:]]]))
    assert worst_deviation(fmu, model) > 5e-5


@pytest.mark.parametrize("name", ["specimen", "observer"])
def test_the_files_keep_the_rules_of_the_cross_check(name, tmp_path):
    model = models()[name]
    files = write_reference(model, tmp_path / "x.fmu")
    assert sorted(f.name for f in files) == ["x_in.csv", "x_ref.csv", "x_ref.opt"]
    lines = (tmp_path / "x_ref.opt").read_text().splitlines()
    options = dict(line.split(", ") for line in lines)
    assert {"StartTime", "StopTime", "StepSize", "RelTol"} <= set(options)
    known = {v.name for g in (model.inputs, model.outputs, model.states, model.signals) for v in g}
    for part in ("in", "ref"):
        text = (tmp_path / f"x_{part}.csv").read_text()
        assert len(text) < 1_000_000
        head, *rows = text.splitlines()
        names = head.split(",")
        assert all(n.startswith('"') and n.endswith('"') for n in names)
        assert names[0] == '"time"'
        assert {n.strip('"') for n in names[1:]} <= known
        assert len(names) - 1 <= 10
        table = np.array([[float(x) for x in row.split(",")] for row in rows])
        assert np.all(np.diff(table[:, 0]) > 0)
        assert table[0, 0] == float(options["StartTime"])
        assert table[-1, 0] == float(options["StopTime"])
        if part == "in":
            assert {n.strip('"') for n in names[1:]} == {v.name for v in model.inputs}
    assert np.ptp(table[:, 1:], axis=0).max() > 0.0


def test_a_model_without_inputs_has_no_input_file_and_wrong_steps_are_refused(tmp_path):
    from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie

    spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    swing = flatten(assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring))
    swing = swing.with_values({"wheel.angle": 0.1})
    known = {v.name for v in swing.inputs}
    files = write_reference(swing, tmp_path / "swing.fmu")
    assert (tmp_path / "swing_in.csv" in files) == bool(known)
    for bad in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueRangeError, match="positive"):
            write_reference(plant(), tmp_path / "p.fmu", step=bad)
    with pytest.raises(ValueRangeError, match="sample time"):
        write_reference(controller(), tmp_path / "c.fmu", step=2e-3)
    assert not (tmp_path / "c_ref.csv").exists()
