"""The laws and the records of the comparison of rubber models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls

from ._published import with_bench_sensors

HERE = Path(__file__).parent
FORCE, SAMPLE = "rubber.force", 0.4e-3  # s; distance of the points of Fig. 6 on its time axis
KNOTS = (0.0, 0.016, 0.0848, 0.212)
GRID = np.linspace(-1.0, 1.0, 801)
EVERY = 4
"""Of so many bench samples one is kept: 125 a second for 5 Hz."""


def laws() -> dict[str, Any]:
    """Return the laws by name; the first six are those that the paper compares or prints."""
    moduli, knots = nls.quantity((2e6, 1.5e6, 2e6, 2e6), "Pa"), nls.quantity(KNOTS, "1")
    stiffening = nls.components.StrainStiffening(modulus=moduli, knots=knots)
    width = nls.quantity(0.01, "1")
    rounded = nls.components.SmoothStrainStiffening(modulus=moduli, knots=knots, width=width)
    c1, c2, c3 = (nls.quantity(value, "Pa") for value in (0.5e6, 1e5, 1e4))
    yeoh, one = nls.components.Yeoh(c1=c1, c2=c2, c3=c3), {"modulus": 1e6, "viscosity": 2e4}
    return {
        "Hooke": nls.components.LinearElastic(modulus=nls.quantity(3e6, "Pa")),
        "Kelvin-Voigt": nls.components.kelvin_voigt(modulus=3e6, viscosity=3e3),
        "Maxwell": nls.components.maxwell(modulus=4e6, viscosity=1e6),
        "standard linear solid": nls.standard_linear_solid(3e6, **one),
        "Burgers": nls.components.burgers(modulus=4e6, flow=1e7, late_modulus=1e7, late_viscosity=1e5),
        "stiffening solid (printed)": nls.standard_linear_solid(stiffening, **one),
        "stiffening solid, rounded": nls.standard_linear_solid(rounded, **one),
        "stiffening, three times": nls.components.generalised_maxwell(
            stiffening, moduli=(5e5, 5e5, 5e5), times=(0.01, 0.1, 1.0)
        ),
        "Yeoh with one time": nls.standard_linear_solid(yeoh, **one),
    }


def element(actuator: Any, law: Any) -> Any:
    """Return one rubber element of the actuator with another law, pulled by a grip."""
    rubber = actuator.element("spring.rubber")
    piece = nls.specimen(area=rubber.area, rest_length=rubber.rest_length, law=law)
    return nls.assembly("element", grip=nls.components.DrivenPoint(), rubber=nls.tie(piece, "grip"))


def record(name: str, time: Any, extension: Any, force: Any) -> Any:
    """Return a record of extension and force of one element."""
    signals = {"grip.position": extension, FORCE: force}
    return nls.Record(name, nls.Trace(time, signals, {"grip.position": "m", FORCE: "N"}, name))


def published() -> tuple[list[Any], list[Any], int]:
    """Return the stretches of Fig. 6 at 45° and at 25°."""
    found = []
    for degrees in (45, 25):
        file = HERE / "austin2015_figures" / f"fig06_measured_{degrees}deg_force_vs_extension.csv"
        points = np.loadtxt(file, delimiter=",", comments="#", skiprows=2)
        found.append(
            record(f"{degrees}°", SAMPLE * np.arange(len(points)), 1e-3 * points[:, 0], points[:, 1])
        )
    return found[:1], found[1:], 2


def bench(actuator: Any) -> tuple[list[Any], list[Any], int]:
    """Return the bench records as extension and force, those to fit and those held out."""
    rig = with_bench_sensors(actuator)
    model = nls.flatten(rig)
    records = nls.load_records(HERE / "austin2015_bench", model)
    names = [v.name for v in model.states]
    start = model.start(model.states)

    def at(angle: float) -> float:
        start[names.index("motor.angle")] = angle
        return float(model.evaluate(list(start))["spring.cable.extension"])

    stretch = np.array([at(angle) for angle in GRID])
    found: dict[str, list[Any]] = {"fit": [], "held_out": []}
    for each in records.records:
        trace = each.trace
        extension = np.interp(trace["motor_encoder.reading"], GRID, stretch)
        rows = slice(None, None, EVERY)
        found[each.role].append(
            record(each.name, trace.time[rows], extension[rows], trace["load_cell.reading"][rows])
        )
    return found["fit"], found["held_out"], 4
