"""The published actuator as several studies use it: points of its figures, records and sensors of its bench.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015. The points were read off the vector graphics of the paper. The bench records are
simulated, by code that the package does not contain.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.components import CurrentSensor, ForceSensor, InextensibleCable, Through
from nlsdesign.components.assembly.deck_writer import deck_digest
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import ParentDeck

FIG6_SAMPLE = 0.4e-3  # s; distance of the points of Fig. 6 on its time axis
_HERE = Path(__file__).parent


def declared_actuator() -> nls.Assembly:
    """Return the actuator with the numbers that agree with the figures of the paper."""
    return nls.models.cam_rubber_actuator(nls.load_deck("austin2015_figure_consistent"))


def figure_points(name: str) -> Array:
    """Return the points of one figure, shape (n, 2), in the units of the figure."""
    return np.loadtxt(_HERE / "austin2015_figures" / f"{name}.csv", delimiter=",", comments="#", skiprows=2)


def element_loop(degrees: int, kind: str = "measured") -> tuple[Array, Array]:
    """Return extension in m and force in N of Fig. 6, in drawing order."""
    extension, force = figure_points(f"fig06_{kind}_{degrees}deg_force_vs_extension").T
    return extension * 1e-3, force


def with_bench_sensors(actuator: nls.Assembly) -> nls.Assembly:
    """Return the actuator as it stands on the bench: its cable only pulls, load cell and ammeter are read."""
    spring = actuator.element("spring")
    assert isinstance(spring, Through)
    cable = InextensibleCable(members=(("rubber", actuator.element("spring.rubber")),))
    cell, ammeter = (nls.quantity(noise, unit, source="rig simulation") for noise, unit in _BENCH_NOISE)
    bench = (
        actuator.with_part("spring", nls.through(spring.cam, cable=cable, pretension=spring.pretension))
        .with_part("load_cell", ForceSensor(of="spring.cable.force", noise=cell))
        .with_part("ammeter", CurrentSensor(of="motor.current", noise=ammeter))
    )
    numbers, before = bench.quantities(), ParentDeck(actuator.name, deck_digest(actuator), "bench sensors")
    bench = replace(bench, parent=before)
    return bench.with_values({n: q.with_spread(0.0) for n, q in numbers.items() if _is_dimension(n)})


_BENCH_NOISE = ((0.3, "N"), (0.04, "A"))


def _is_dimension(name: str) -> bool:
    """Tell whether a number is a dimension: measured on the bench, so a refit leaves it alone."""
    return name.startswith("spring.cam.") or name.rpartition(".")[2] in ("area", "rest_length", "knots")


def bench_records(bench: nls.Assembly) -> nls.RecordSet:
    """Return the records of the actuator with its bench sensors."""
    return nls.load_records(_HERE / "austin2015_bench", nls.flatten(bench))
