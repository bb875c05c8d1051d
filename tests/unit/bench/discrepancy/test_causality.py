"""A spring whose force is recorded late: the ellipse of force over extension is run through backwards.

For δ = a·sin(ωt) and F = k·a·sin(ωt - φ), φ = ωτ, one cycle takes ∮F dδ = -π·k·a²·sin φ of
∮|F dδ| = 2·k·a²·(cos φ + φ·sin φ), and the delay that empties the loop is tan(φ)/ω to first order of the lag.
"""

from __future__ import annotations

import math

import numpy as np

from nlsdesign.bench.discrepancy.screening.causality import (
    LaggingForces,
    lagging_forces,
    modes_too_quick,
)
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import TRANSLATION, Driven, ForceSensor, Mass, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.simulation import Trace

STIFFNESS, SIZE, LATE = 1000.0, 0.02, 0.01  # N/m, m, s
UNITS = {"grip.position": "m", "cell.reading": "N"}
MODEL = assembly(
    "pulled",
    grip=Driven(domain=TRANSLATION),
    strip=tie(Spring(stiffness=STIFFNESS), "grip"),
    cell=ForceSensor(of="strip.force"),
)


def cycle(frequency: float, late: float = LATE, size: float = SIZE) -> Record:
    """One whole cycle."""
    speed = 2.0 * math.pi * frequency
    time = np.linspace(0.0, 1.0 / frequency, 2001)
    signals = {
        "grip.position": size * np.sin(speed * time),
        "cell.reading": STIFFNESS * size * np.sin(speed * (time - late)),
    }
    name = f"{frequency:g}Hz"
    return Record(name, Trace(time, signals, UNITS, name))


def lagging(*records: Record) -> LaggingForces:
    return lagging_forces(MODEL, RecordSet(records, tuple(Column(n, n, u) for n, u in UNITS.items())))


def test_the_finding_gives_work_share_and_delay_of_the_ellipse() -> None:
    ((finding,), _) = lagging(cycle(2.0))
    speed = 2.0 * math.pi * 2.0
    phase = speed * LATE
    work = math.pi * STIFFNESS * SIZE**2 * math.sin(phase)
    share = math.pi * math.sin(phase) / (2.0 * (math.cos(phase) + phase * math.sin(phase)))
    assert finding.place == "2Hz: column 'cell.reading', samples 1 to 2001"
    assert f"give {1e3 * work:.3g} mJ over a closed path" in finding.text
    assert f"< 0, {100 * share:.2g} % of the work that goes in and out" in finding.text
    assert f"at least {1e3 * math.tan(phase) / speed:.2g} ms late" in finding.text


def test_a_force_on_time_or_early_is_no_finding() -> None:
    assert lagging(cycle(2.0, late=0.0)).findings == ()
    assert lagging(cycle(2.0, late=-LATE)).findings == ()


def test_one_record_that_takes_work_clears_the_force() -> None:
    assert lagging(cycle(2.0), cycle(4.0, late=-LATE)).findings == ()


def test_a_delay_can_be_told_only_between_records_of_three_times_the_pace() -> None:
    assert not lagging(cycle(2.0)).testable
    assert not lagging(cycle(2.0), cycle(5.8)).testable
    assert lagging(cycle(2.0), cycle(6.2)).testable
    assert not lagging(cycle(2.0), cycle(4.0, size=0.1 * SIZE)).testable, "pace is no matter of size"
    assert not lagging(cycle(2.0, late=0.0), cycle(6.2, late=0.0)).testable, "nothing lags"


def test_a_log_that_is_slower_than_the_quickest_mode_is_told() -> None:
    """Two masses of 0.5 kg on a spring of 1 kN/m swing at √(k/m₁ + k/m₂)/2π = 10.07 Hz."""
    bodies = {"front": Mass(mass=0.5), "back": Mass(mass=0.5)}
    machine = assembly("train", **bodies, coupling=tie(Spring(stiffness=1000.0), "front", "back"))
    assert modes_too_quick(machine, 0.01) == ()
    (finding,) = modes_too_quick(machine, 0.025)
    assert "swings at 10.1 Hz: 4 samples a period" in finding.text
    assert finding.text.endswith("log at 121 Hz or more")
