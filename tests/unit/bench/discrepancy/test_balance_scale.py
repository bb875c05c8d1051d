"""A balance is judged in a scale that no hypothesis can change: no effect wins by becoming small."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest

from nlsdesign import components as c
from nlsdesign.bench.discrepancy.screening.scale_and_sign import refitted, scale_findings
from nlsdesign.bench.discrepancy.tearing import BalanceTerms, blocks_of, scaled_balance
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.least_squares import fit
from nlsdesign.bench.identification.parameters import Parameter, declared_parameter
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import Assembly, DriveSaturation, TorqueConstantDrift, assembly, tie
from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate

TIME = np.arange(6000) * 0.001
SIGNALS = {"motor.angle": "rad", "motor.current": "A"}


def drive(*chain: tuple[str, c.DrivePart], friction: float = 0.0) -> Assembly:
    """A drive whose numbers may each be a third off."""

    def number(value: float, unit: str) -> Quantity:
        return Quantity(value, unit, "sheet", 0.3)

    motor = c.GearedMotor(
        inertia=number(0.01, "kg*m^2"), gear_ratio=25.0, torque_constant=number(0.03, "N*m/A"),
        chain=tuple(chain),
    )  # fmt: skip
    bearing = tie(c.Dashpot(damping=number(0.03, "N*m*s/rad")), "motor")
    spring = tie(c.Spring(stiffness=number(3.0, "N*m/rad")), "motor")
    dry = {"dry": tie(c.CoulombFriction(sliding_effort=friction).smooth(0.02), "motor")} if friction else {}
    return assembly("drive", motor=motor, bearing=bearing, spring=spring, **dry)


def records(made: Assembly, seed: int = 3, *, logged: float = 1.0) -> RecordSet:
    rng, result = np.random.default_rng(seed), []
    for number, (size, pace) in enumerate([(2.0, 1.0), (4.0, 1.7), (5.0, 0.6)]):
        current = size * np.sin(2 * np.pi * pace * TIME) + 0.3 * size * np.sin(2 * np.pi * 2.3 * pace * TIME)
        run = simulate(flatten(made), TIME, inputs={"motor.current": current})
        signals = {
            "motor.angle": run["motor.angle"] + 2e-5 * rng.standard_normal(len(TIME)),
            "motor.current": logged * current + 5e-3 * rng.standard_normal(len(TIME)),
        }
        result.append(Record(f"r{number}", Trace(TIME, signals, SIGNALS, f"r{number}")))
    return RecordSet(tuple(result), tuple(Column(n, n, u) for n, u in SIGNALS.items()))


DRIFTING = ("drift", TorqueConstantDrift(drift=Quantity(0.0, "1/s", "to be fitted"), settling_time=0.5))
SATURATED = ("iron", DriveSaturation(saturation_current=Quantity(50.0, "A", "to be fitted")))


def left(measured: RecordSet, hypothesis: Assembly) -> tuple[float, dict[str, float]]:
    """Mean square in noise floors and numbers of a hypothesis, fitted as a diagnosis fits it."""
    bench = Bench(measured, blocks_of(flatten(drive()), list(SIGNALS)))
    (block,) = blocks_of(flatten(hypothesis), list(SIGNALS))
    parameters = [declared_parameter(v) for v in block.model.parameters if v.spread]
    if "motor.iron.saturation_current" in block.model.values:
        parameters.append(Parameter("motor.iron.saturation_current", "A", 8.0, 8.0, 1e3, 0.05, 200.0, "log"))
    if "motor.drift.drift" in block.model.values:
        parameters.append(
            Parameter("motor.drift.drift", "1/s", 0.0, 0.0, math.inf, -5.0, 50.0, "linear", 5.0)
        )
    names = [p.name for p in parameters]
    driven = bench.driven(block, names, {p.name: p.start for p in parameters})
    best = fit(bench.evidence(driven, measured.records, {p.name: p.start for p in parameters}), parameters)
    rest = [e.residual(best.values)[0] for e in bench.evidence(driven, measured.records, best.values)]
    return float(np.mean(np.concatenate(rest) ** 2)), dict(best.values)


def test_a_drive_that_does_not_saturate_gains_nothing_by_saturation() -> None:
    """Dry friction is missing; a drive of little torque would ask for little of it."""
    measured = records(drive(friction=0.8))
    without, _ = left(measured, drive())
    with_it, _ = left(measured, drive(SATURATED))
    assert without > 100.0
    assert with_it > 0.99 * without


@pytest.mark.long_cases("1.0")
@pytest.mark.parametrize("logged", [0.0, 1.0])
def test_dry_friction_is_no_drive_whose_torque_fades_or_grows(logged: float) -> None:
    """A drive that grew without end would make any error small, and one that fades is gone."""
    measured = records(drive(friction=0.8), logged=logged)
    without, _ = left(measured, drive())
    with_it, _ = left(measured, drive(DRIFTING))
    assert without > 30.0
    assert with_it > 0.7 * without


def test_a_torque_that_fades_is_found_with_its_number() -> None:
    fading = "drift", TorqueConstantDrift(drift=-0.6, settling_time=0.5)
    measured = records(drive(fading))
    without, _ = left(measured, drive())
    with_it, numbers = left(measured, drive(DRIFTING))
    assert without > 30.0
    assert with_it < 0.02 * without
    assert numbers["motor.drift.drift"] == pytest.approx(-0.6, rel=0.03)


def test_a_drive_that_saturates_is_found_with_its_number() -> None:
    saturated = "iron", DriveSaturation(saturation_current=4.0)
    measured = records(drive(saturated))
    without, _ = left(measured, drive())
    with_it, numbers = left(measured, drive(SATURATED))
    assert without > 100.0
    assert with_it < 1e-3 * without
    assert numbers["motor.iron.saturation_current"] == pytest.approx(4.0, rel=0.03)


def test_the_scale_is_that_of_the_declared_model_whatever_the_numbers() -> None:
    """Twice all efforts and inertias: the same error of the drive."""
    measured = records(drive(friction=0.3))
    bench = Bench(measured, blocks_of(flatten(drive()), list(SIGNALS)))
    names = ("motor.inertia", "motor.torque_constant", "bearing.damping", "spring.stiffness")
    results = []
    for factor in (1.0, 0.5):
        made = drive().with_values({n: factor * drive().quantities()[n].number for n in names})
        (block,) = blocks_of(flatten(made), list(SIGNALS))
        driven = bench.driven(block, [])
        results.append(
            np.concatenate([e.residual({})[0] for e in bench.evidence(driven, measured.records, {})])
        )
    assert results[0] == pytest.approx(results[1], rel=1e-9, abs=1e-9)
    assert np.std(results[0]) > 1.0


def terms(balance: ca.SX, parameter: ca.SX, *readings: ca.SX) -> BalanceTerms:
    empty = ca.SX(0, 1)
    return BalanceTerms(balance, empty, empty, ca.vertcat(*readings), parameter, np.array([2.0, 5.0]))


def test_without_a_drive_the_error_is_that_of_the_acceleration() -> None:
    inertia, stiffness = ca.SX.sym("J"), ca.SX.sym("k")
    acceleration, angle, torque = (ca.SX.sym(n) for n in ("a", "q", "T"))
    balance, parameter = inertia * acceleration + stiffness * angle, ca.vertcat(inertia, stiffness)
    free, _ = scaled_balance(
        terms(balance, parameter, acceleration, angle), drives=[], efforts=[], inertia=inertia
    )
    at = ca.Function("at", [parameter, acceleration, angle], [free])
    assert float(at([2.0, 5.0], 1.0, 0.1)) == pytest.approx(2.5)
    assert float(at([0.2, 0.5], 1.0, 0.1)) == pytest.approx(2.5)  # all factors small: the same error
    pulled, scale = scaled_balance(
        terms(balance + torque, parameter, acceleration, angle, torque),
        drives=[], efforts=[torque], inertia=inertia,
    )  # fmt: skip
    assert scale == 1.0
    assert ca.is_equal(pulled, balance + torque, 3)


def test_a_drive_held_at_its_limit_is_in_the_scale_of_the_drive_below_it() -> None:
    """A record of a command that is clipped counts no more than any other."""
    constant, inertia = ca.SX.sym("k"), ca.SX.sym("J")
    acceleration, command = ca.SX.sym("a"), ca.SX.sym("u")
    balance = inertia * acceleration - constant * ca.fmin(ca.fmax(command, -7.4), 7.4)
    scaled, declared = scaled_balance(
        terms(balance, ca.vertcat(constant, inertia), acceleration, command),
        drives=[command], efforts=[command], inertia=inertia,
    )  # fmt: skip
    assert declared == pytest.approx(2.0)
    at = ca.Function("at", [ca.vertcat(constant, inertia), acceleration, command], [scaled])
    for size in (7.0, 7.39, 7.4):
        assert float(at([2.0, 5.0], (2.0 * size + 0.3) / 5.0, size)) == pytest.approx(0.3, rel=1e-6)
        assert float(at([1.0, 2.5], (2.0 * size + 0.3) / 5.0, size)) == pytest.approx(0.3, rel=1e-6)
    assert float(at([2.0, 5.0], (2.0 * 7.4 + 0.3) / 5.0, 14.8)) == pytest.approx(0.6, rel=1e-6)


def test_a_geared_joint_gains_nothing_by_smaller_efforts_and_worse_gears() -> None:
    """No record tells all efforts times a factor, or a load from the share of it that the gear passes on."""
    model = flatten(declare(load_template("geared-joint").deck))
    signals = ["motor_encoder.reading", "current_sensor.reading", "motor.current", "limb.torque"]
    block = next(each for each in blocks_of(model, signals) if each.name == "motor")
    names = [v.name for v in block.model.inputs]
    inputs = np.random.default_rng(7).uniform(-1.0, 1.0, (len(names), 40)) * 10.0
    inputs[names.index("limb.torque")] = 0.0  # a load from outside that was measured, and there was none
    load = {"limb.inertia": 0.8, "weight.mass": 0.8, "bearing.damping": 0.8}
    everything = {"motor.torque_constant": 0.9, "motor.inertia": 0.9, **dict.fromkeys(load, 0.9)}
    gear = load | {"gear.efficiency": 0.8, "gear.back_efficiency": 1.0 / 0.8}

    def errors(factors: dict[str, float]) -> np.ndarray:
        numbers = [v.start * factors.get(v.name, 1.0) for v in block.model.parameters]
        return np.asarray(block.model.equations(0.0, [], inputs, numbers, [])[1].full()[0])

    declared = errors({})
    assert block.effort_per_drive == pytest.approx(0.03), "the error of the current, times N·m/A"
    assert np.ptp(declared) > 0.1
    for factors in (everything, gear):
        np.testing.assert_allclose(errors(factors), declared, rtol=1e-4)


@pytest.mark.parametrize(("fault", "unit", "expected"), [(0.02, 1.0, 0), (0.0, 1e3, 2)], ids=["disc", "unit"])
def test_a_fault_of_an_encoder_beside_a_stiff_spring_is_no_other_unit(
    fault: float, unit: float, expected: int
) -> None:
    """A disc that is 20 mrad off makes the predicted torque many times as large, of another course."""
    units = {"motor.angle": "rad", "motor.current": "A", "link.angle": "rad", "spring.torque": "N*m"}
    stiffness = Quantity(2000.0, "N*m/rad", "sheet", 0.05)
    made = assembly(
        "joint",
        motor=c.GearedMotor(inertia=0.5, gear_ratio=25.0, torque_constant=0.03),
        link=c.Inertia(inertia=1.0),
        spring=tie(c.Spring(stiffness=stiffness), "motor", "link"),
        loss=tie(c.Dashpot(damping=Quantity(2.0, "N*m*s/rad")), "motor", "link"),
        weak=tie(c.Spring(stiffness=Quantity(2.0, "N*m/rad")), "link"),
    )
    rng, model, result = np.random.default_rng(5), flatten(made, outputs=["link.angle", "spring.torque"]), []
    for number, pace in enumerate([1.5, 2.2]):
        slow, quick = np.sin(2 * np.pi * 0.25 * TIME), np.sin(2 * np.pi * pace * TIME)
        current = 3.0 * slow + 4.0 * quick
        run = simulate(model, TIME, inputs={"motor.current": current})
        link = run["link.angle"] + fault * np.cos(run["link.angle"])
        read = (run["motor.angle"], current, link, unit * run["spring.torque"])
        noise = (1e-6, 5e-3, 1e-6, unit * 1e-2)
        signals = {
            name: values + size * rng.standard_normal(len(TIME))
            for name, values, size in zip(units, read, noise, strict=True)
        }
        result.append(Record(f"r{number}", Trace(TIME, signals, units, f"r{number}")))
    records = RecordSet(tuple(result), tuple(Column(n, n, u) for n, u in units.items()))
    again = refitted(made, records)
    assert again is not None
    findings = scale_findings(*again)
    assert len(findings) == expected, [str(each) for each in findings]
