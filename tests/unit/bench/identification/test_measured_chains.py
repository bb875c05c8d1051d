"""Through a chain of sensors every consumer sees the same state: screening, fits over windows, mapping."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign.bench.discrepancy import refit
from nlsdesign.bench.discrepancy.screening.causality import lagging_forces
from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.screening.wrong_numbers import out_of_reach
from nlsdesign.bench.identification import Record, RecordSet, load_records
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Dashpot,
    Drift,
    Driven,
    Encoder,
    ForceSensor,
    Mass,
    SampleAndHold,
    Sensor,
    Spring,
    Tachometer,
    TransportDelay,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.model.readings import reading_of
from nlsdesign.simulation import Trace
from tests.rig import ACTUATORS, make_records, write_records
from tests.unit.bench.identification.test_shooting import TRUE
from tests.unit.bench.identification.test_shooting import truth as slide_record

BEHIND = {
    "latch": SampleAndHold(of="motor_encoder.reading", sample_rate=1000.0),
    "delay": TransportDelay(of="motor_encoder.reading", delay=2e-3),
}


@pytest.fixture(scope="module")
def rig() -> Assembly:
    return declare(load_deck("test_rig"))


def bench_records(angle: str, size: float = 0.8) -> RecordSet:
    """One record of an angle, a current and a force, the angle under the name of its reading."""
    time = np.arange(500) * 1e-3
    swing = np.sin(2 * np.pi * 2.0 * time)
    names = {angle: "rad", "current_sensor.reading": "A", "force_sensor.reading": "N"}
    signals = dict(zip(names, (size * swing, 2.0 * swing, 50.0 * swing), strict=True))
    columns = tuple(Column(name, name, unit) for name, unit in names.items())
    return RecordSet((Record("run", Trace(time, signals, names)),), columns)


@pytest.mark.parametrize("sensor", BEHIND.values(), ids=list(BEHIND))
def test_sizes_are_those_of_the_angle_behind_the_chain(rig: Assembly, sensor: Sensor) -> None:
    direct = typical_sizes(rig, bench_records("motor_encoder.reading"))
    chained = typical_sizes(rig.with_part("log", sensor), bench_records("log.reading"))
    assert direct["spring.cable.rubber.force"] > 100.0
    assert direct["motor.angle"] == pytest.approx(0.8, abs=1e-3)
    for name, size in direct.items():
        if name != "motor_encoder.reading":
            assert chained[name] == pytest.approx(size, rel=1e-3), name


def test_a_tachometer_says_nothing_of_the_size_of_the_angle(rig: Assembly) -> None:
    fast = rig.with_part("tacho", Tachometer(of="motor_encoder.reading", bandwidth=100.0, sample_rate=1000.0))
    records = bench_records("motor_encoder.reading")
    (run,) = records.records
    speeds = run.trace.signals | {"tacho.reading": 40.0 * run.trace["motor_encoder.reading"]}
    units = {**run.trace.units, "tacho.reading": "rad/s"}
    columns = (*records.columns, Column("tacho", "tacho.reading", "rad/s"))
    both = RecordSet((replace(run, trace=Trace(run.trace.time, speeds, units)),), columns)
    assert typical_sizes(fast, both)["motor.angle"] == typical_sizes(rig, records)["motor.angle"]


@pytest.mark.parametrize("sensor", BEHIND.values(), ids=list(BEHIND))
def test_an_angle_beyond_the_cam_is_seen_through_the_chain(rig: Assembly, sensor: Sensor) -> None:
    direct = out_of_reach(rig, bench_records("motor_encoder.reading", size=3.0))
    chained = out_of_reach(rig.with_part("log", sensor), bench_records("log.reading", size=3.0))
    assert [f.text for f in chained] == [f.text for f in direct]
    assert len(direct) == 1


def pulled(**sensors: Sensor) -> Assembly:
    return assembly(
        "pulled", grip=Driven(domain=TRANSLATION), strip=tie(Spring(stiffness=1000.0), "grip"), **sensors
    )


def pulled_records(position: str, force: str, lag: float) -> RecordSet:
    time = np.arange(4000) * 1e-3
    speed = 2 * np.pi * 1.0

    def moved(t: np.ndarray) -> np.ndarray:
        return 0.01 + 0.01 * np.sin(speed * t)

    noise = np.random.default_rng(3).normal(0.0, 1e-3, len(time))
    signals = {position: moved(time), force: 1000.0 * moved(time - lag) + noise}
    units = {position: "m", force: "N"}
    columns = tuple(Column(name, name, unit) for name, unit in units.items())
    return RecordSet((Record("run", Trace(time, signals, units)),), columns)


def test_a_force_that_lags_is_seen_through_a_latch_and_excused_by_a_declared_delay() -> None:
    cell = {"cell": ForceSensor(of="strip.force")}
    plain = lagging_forces(pulled(**cell), pulled_records("grip.position", "cell.reading", 0.03))
    latched = lagging_forces(
        pulled(dial=SampleAndHold(of="grip.position", sample_rate=1e3), **cell),
        pulled_records("dial.reading", "cell.reading", 0.03),
    )
    assert len(plain.findings) == 1
    assert [f.text for f in latched.findings] == [f.text for f in plain.findings]
    late = pulled(bus=TransportDelay(of="strip.force", delay=0.03), cell=ForceSensor(of="bus.reading"))
    assert lagging_forces(late, pulled_records("grip.position", "cell.reading", 0.03)).findings == ()


def slide(**sensors: Sensor) -> Assembly:
    bare = assembly(
        "slide",
        body=Mass(mass=1.7),
        spring=tie(Spring(stiffness=90.0), "body"),
        guide=tie(Dashpot(damping=2.4), "body"),
        **sensors,
    )
    spread = {"body.mass": 0.3, "spring.stiffness": 0.3, "guide.damping": 0.4}
    return bare.with_values(
        {n: replace(q, spread=spread[n]) for n, q in bare.quantities().items() if n in spread}
    )


def slide_records(position: str, late: float) -> RecordSet:
    runs = []
    for name, seed in (("a", 1), ("b", 2)):
        trace = slide_record(seed, late=late).trace
        signals = {"body.force": trace["body.force"], position: trace["body.position"]}
        units = {"body.force": "N", position: "m"}
        runs.append(Record(name, Trace(trace.time, signals, units)))
    columns = (Column("f_N", "body.force", "N"), Column("x_m", position, "m"))
    return RecordSet(tuple(runs), columns)


LOG = SampleAndHold(of="dial.reading", sample_rate=1e4)
CHAINS = {
    "two latches": ({"dial": SampleAndHold(of="body.position", sample_rate=1e4), "log": LOG}, 0.0),
    "delay": ({"dial": TransportDelay(of="body.position", delay=0.04), "log": LOG}, 0.04),
}


@pytest.mark.long_cases("delay", "two latches")
@pytest.mark.parametrize(("sensors", "late"), CHAINS.values(), ids=list(CHAINS))
def test_a_window_begins_at_the_state_behind_the_chain(sensors: dict[str, Sensor], late: float) -> None:
    found = refit(slide(**sensors), slide_records("log.reading", late), window=2.0)
    for number in found.numbers:
        assert abs(number.fitted - TRUE[number.name]) < 3.0 * number.standard_error
        assert abs(number.fitted - TRUE[number.name]) < 0.25 * abs(number.declared - TRUE[number.name])


def test_the_value_behind_a_chain_is_inferred_from_the_last_sensor_to_the_first() -> None:
    """Reading = 2·(F + drift so far) + 1: 4 N less 0.5 N of drift is 3.5 N."""
    made = pulled(
        warming=Drift(of="strip.force", drift=0.1), cell=ForceSensor(of="warming.reading", gain=2.0, bias=1.0)
    )
    model = flatten(made)
    reading = reading_of(model.readings, "cell.reading")
    numbers = {name: ca.SX(value) for name, value in model.values.items()} | {"warming.drifted": ca.SX(0.5)}
    assert float(reading.inferred(ca.SX(9.0), numbers)) == pytest.approx(3.5)
    assert (reading.measured, reading.sensors) == ("strip.force", ("cell", "warming"))


def test_a_column_without_a_mapping_is_the_last_of_its_chain(tmp_path: Path, rig: Assembly) -> None:
    """As after a diagnosis that has put a delay and a drift before the load cell."""
    write_records(tmp_path, make_records(ACTUATORS["arm"], {}, 5, only=("sine_15deg_5.0Hz",)))
    signals = load_records(tmp_path, flatten(rig)).signals
    others = {n: p for n, p in rig.parts if n != "force_sensor"}
    faulty = assembly(
        "faulty",
        **others,
        bus=TransportDelay(of="spring.cable.force", delay=2e-3),
        warming=Drift(of="bus.reading", drift=0.1),
        force_sensor=ForceSensor(of="warming.reading", noise=0.25),
    )
    assert load_records(tmp_path, flatten(faulty)).signals == signals
    latched = faulty.with_part("log", SampleAndHold(of="motor_encoder.reading", sample_rate=1e3))
    loaded = load_records(tmp_path, flatten(latched))
    renamed = {"motor_encoder.reading": "log.reading"}
    assert loaded.signals == tuple(renamed.get(s, s) for s in signals)
    declared = {c.signal: (c.noise, c.quantum) for c in loaded.columns}
    assert declared["force_sensor.reading"] == (0.25, 0.0)
    assert declared["log.reading"] == (0.0, rig.quantities()["motor_encoder.quantum"].number)


def test_two_ends_of_one_unit_stay_ambiguous(tmp_path: Path, rig: Assembly) -> None:
    write_records(tmp_path, make_records(ACTUATORS["arm"], {}, 5, only=("sine_15deg_5.0Hz",)))
    two = rig.with_part("second", Encoder(of="motor.angle", quantum=1e-3))
    with pytest.raises(Exception, match=r"could be motor_encoder.reading or second.reading"):
        load_records(tmp_path, flatten(two))
