"""A motor with a current loop before a rigid gear, as a robot logs it: one body, one current, one limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.bench.discrepancy.screening.scale_and_sign import Acting, limit_findings
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.selection.trials import Step, without_twins
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.mapping import Column, ColumnMap, Inputs, with_known_sampling
from nlsdesign.components import (
    Assembly,
    CurrentDrivenMotor,
    CurrentSensor,
    Encoder,
    Gear,
    GravityLoad,
    Inertia,
    MassOnArm,
    assembly,
    tie,
)
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace

UNITS = {"encoder.reading": "rad", "ammeter.reading": "A"}
COLUMNS = (Column("q", "encoder.reading", "rad"), Column("I", "ammeter.reading", "A"))
LIMIT = 9.0


def joint(of: str = "motor.winding_current") -> Assembly:
    """A link that hangs on a geared motor; the ammeter reads what the template's does."""
    drive = CurrentDrivenMotor(
        inertia=1e-5, torque_constant=0.045, resistance=0.5, current_limit=LIMIT, voltage_limit=48.0
    )
    return assembly(
        "joint",
        motor=drive,
        limb=Inertia(inertia=0.17),
        gear=Gear(ratio=100.0, between=("motor", "limb")),
        weight=tie(GravityLoad(weight=MassOnArm(mass=2.2, arm=0.25), hanging_angle=0.0), "limb"),
        encoder=Encoder(of="limb.angle", quantum=1e-5),
        ammeter=CurrentSensor(of=of, noise=0.015),
    )


def records(scale: float) -> RecordSet:
    """One sine with the current that it takes, times a factor."""
    time = np.arange(0.0, 4.0, 0.002)
    angle = 0.5 * np.sin(2.0 * np.pi * time)
    torque = -0.27 * 0.5 * (2.0 * np.pi) ** 2 * np.sin(2.0 * np.pi * time) + 2.2 * 9.81 * 0.25 * np.sin(angle)
    current = torque / 4.5 + 0.015 * np.random.default_rng(1).standard_normal(len(time))
    signals = dict(zip(UNITS, (1e-5 * np.round(angle / 1e-5), scale * current), strict=True))
    return RecordSet((Record("sine", Trace(time, signals, UNITS, "sine")),), COLUMNS)


@pytest.mark.parametrize("of", ["motor.winding_current", "motor.current"])
def test_how_a_current_runs_between_samples_is_asked_whichever_the_ammeter_reads(of: str) -> None:
    model = flatten(joint(of))
    unsaid = tuple(replace(column, sampling=None) for column in COLUMNS)
    mapping = ColumnMap(Column("t", "", "s"), unsaid, inputs=Inputs.of(model))
    angle, current = with_known_sampling("records.toml", mapping, model).columns
    assert current.sampling is None
    assert angle.sampling is not None


def test_the_current_in_the_winding_drives_the_balance_of_the_motor() -> None:
    model, run = flatten(joint()), records(1.0)
    bench = Bench(run, blocks_of(model, tuple(UNITS)))
    (block,) = blocks_of(model, tuple(UNITS))
    assert Acting(bench, model).drives(block) == ["ammeter.reading"]


def test_a_current_far_beyond_the_declared_limit_is_no_current_of_that_drive() -> None:
    model = flatten(joint())
    assert limit_findings(model, records(1.0)) == []
    (found,) = limit_findings(model, records(1000.0))
    assert found.place == "column 'I'"
    assert "motor.current_limit is declared as 9 A; is it in thousandths" in str(found)
    commanded = max(abs(records(1.0).records[0].trace["ammeter.reading"]))
    assert limit_findings(model, records(3.0 * LIMIT / commanded)) == [], "a command may be beyond a limit"


def test_one_effect_on_both_sides_of_a_rigid_gear_is_one_answer() -> None:
    machine = joint()
    bodies = flatten(machine).bodies
    friction = {c.location: Hypothesis(machine, (c,)) for c in nls.effects.coulomb_friction(machine)}
    assert set(friction) >= {"motor", "limb"}
    drag = next(
        Hypothesis(machine, (c,)) for c in nls.effects.quadratic_drag(machine) if c.location == "limb"
    )
    step = Step(friction["motor"], "motor", 1.0, equals=(friction["limb"], drag))
    assert without_twins(step, bodies).equals == (drag,)
    apart = [replace(body, geared=()) for body in bodies]
    assert without_twins(step, apart).equals == step.equals
