"""Diagnosis of the bench records of the published actuator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import nlsdesign as nls


def diagnosed(actuator: Any, out: Path, steps: Any) -> Any:
    """Say what the declared actuator lacks that the records show, and write verdict and better deck."""
    bench = with_bench_sensors(actuator)
    records = nls.load_records(Path(__file__).parent / "austin2015_bench", nls.flatten(bench))
    verdict = nls.diagnose(bench, records, progress=steps.note)
    nls.write_verdict(verdict, out / "diagnosis")
    return verdict


def with_bench_sensors(actuator: Any) -> Any:
    """Return the actuator as it stands on the bench: its cable only pulls, load cell and ammeter are read."""
    rubber = nls.components.InextensibleCable(members=(("rubber", actuator.element("spring.rubber")),))
    before = actuator.element("spring")
    spring = nls.through(before.cam, cable=rubber, pretension=before.pretension)
    cell, meter = (nls.quantity(*number, source="rig simulation") for number in ((0.3, "N"), (0.04, "A")))
    bench = (
        actuator.with_part("spring", spring)
        .with_part("load_cell", nls.components.ForceSensor(of="spring.cable.force", noise=cell))
        .with_part("ammeter", nls.components.CurrentSensor(of="motor.current", noise=meter))
    )
    return bench.with_values(
        {name: replace(q, spread=0.0) for name, q in bench.quantities().items() if geometry(name)}
    )


def geometry(name: str) -> bool:
    """Tell whether a number is a dimension: measured on the bench, so a refit leaves it alone."""
    return name.startswith("spring.cam.") or name.rpartition(".")[2] in ("area", "rest_length", "knots")
