"""A blow on the output: what reaches the gear through each of the three springs of the 2015 paper.

The paper claims twice that elastic actuators bear shocks; it shows no figure of it. Here a body strikes the
output, and the peak torque of the spring, which the teeth of the gear bear, is simulated: with the rotor
held (a gear that does not turn back, or a brake) and with a rotor that gives way without current.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.components import Assembly, Driven, Inertia
from nlsdesign.foundation.arrays import Array
from nlsdesign.presentation import figures
from nlsdesign.presentation.report import FigureSection, TableSection

SPRINGS = {
    "soft": "austin2015_soft_spring",
    "stiff": "austin2015_stiff_spring",
    "nonlinear": "austin2015_figure_consistent",
}
STRIKING = nls.quantity(0.02, "kg*m^2", source="assumed: a foot and half a shank, about the knee")
TRAVEL = np.radians(53.0)
"""Where the cam of the nonlinear spring ends: Schepelmann, Geberth and Geyer, ICRA 2014."""
DURATION, SAMPLES = 0.4, 2001
"""Seconds after the blow: more than half a swing of the soft spring, 0.34 s, in which the first peak lies."""


@dataclass(frozen=True)
class Results:
    """The numbers that ``expected.toml`` claims; a light blow has 0.1 J, a heavy one 0.5 J."""

    soft_held_light_Nm: float
    stiff_held_light_Nm: float
    nonlinear_held_light_Nm: float
    soft_held_heavy_Nm: float
    stiff_held_heavy_Nm: float
    nonlinear_held_heavy_Nm: float
    soft_free_heavy_Nm: float
    stiff_free_heavy_Nm: float
    nonlinear_free_heavy_Nm: float
    soft_energy_in_travel_J: float
    stiff_energy_in_travel_J: float
    nonlinear_energy_in_travel_J: float
    blow_from_which_stiff_is_gentler_J: float
    numbers = property(asdict, doc="The results by name.")


def main(out: Path, fast: bool = False) -> Results:
    """Strike each actuator with blows up to what its spring takes within the travel of the cam."""
    load = Inertia(inertia=STRIKING)
    struck = {
        name: nls.declare(nls.load_deck(deck)).with_part("load", load) for name, deck in SPRINGS.items()
    }
    held = {
        name: actuator.with_part("motor", Driven()).without_part("motor_encoder")
        for name, actuator in struck.items()
    }
    energies = np.array([0.1, 0.3, 0.5] if fast else [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    peaks = {
        case: {name: peak_torques(actuator, energies) for name, actuator in machines.items()}
        for case, machines in (("rotor held", held), ("rotor free", struck))
    }
    taken = {name: energy_within(actuator, TRAVEL) for name, actuator in held.items()}
    _write(out, energies, peaks, taken)
    light, heavy = (int(np.flatnonzero(energies == energy)[0]) for energy in (0.1, 0.5))
    rigid, loose = peaks["rotor held"], peaks["rotor free"]
    excess = rigid["nonlinear"] - rigid["stiff"]
    return Results(
        **{f"{name}_held_light_Nm": float(rigid[name][light]) for name in SPRINGS},
        **{f"{name}_held_heavy_Nm": float(rigid[name][heavy]) for name in SPRINGS},
        **{f"{name}_free_heavy_Nm": float(loose[name][heavy]) for name in SPRINGS},
        **{f"{name}_energy_in_travel_J": taken[name] for name in SPRINGS},
        blow_from_which_stiff_is_gentler_J=float(np.interp(0.0, excess, energies)),
    )


def peak_torques(actuator: Assembly, energies: Array) -> Array:
    """Return the largest torque of the spring in N·m behind blows of these energies in J, shape (n,)."""
    model = nls.flatten(actuator, outputs=["spring.torque"])
    time = np.linspace(0.0, DURATION, SAMPLES)
    speeds = np.sqrt(2.0 * energies / STRIKING.number)
    runs = [nls.simulate(model, time, start={"load.speed": float(speed)}) for speed in speeds]
    return np.array([float(np.abs(run["spring.torque"]).max()) for run in runs])


def energy_within(actuator: Assembly, angle: float) -> float:
    """Return the energy of a blow in J that turns the spring to an angle in rad, the rotor being held."""
    model = nls.flatten(actuator, outputs=["spring.torque"])
    time = np.linspace(0.0, DURATION, SAMPLES)

    def largest(energy: float) -> float:
        speed = float(np.sqrt(2.0 * energy / STRIKING.number))
        return float(np.abs(nls.simulate(model, time, start={"load.speed": speed})["load.angle"]).max())

    low, high = 0.01, 4.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if largest(middle) < angle else (low, middle)
    return 0.5 * (low + high)


def _write(
    out: Path, energies: Array, peaks: Mapping[str, Mapping[str, Array]], taken: Mapping[str, float]
) -> None:
    """Write the page: what each spring lets through, and what it takes within the travel."""
    pictures = {
        case: figures.curves(
            {name: (energies, torque) for name, torque in of_case.items()},
            across="energy of the blow (J)",
            up="largest torque (N·m)",
            words=f"Largest torque behind a blow for three springs, {case}.",
        )
        for case, of_case in peaks.items()
    }
    figures.write_figures(out, {case.replace(" ", "_"): figure for case, figure in pictures.items()})
    table = TableSection(
        "Energy within the travel",
        ("spring", "energy of a blow that turns it by 53° (J)"),
        tuple(taken.items()),
        caption="What each spring takes within the travel of the cam, the rotor being held.",
    )
    sections = [
        FigureSection(
            case.capitalize(),
            figure,
            caption="The largest torque of the spring, which the teeth of the gear bear.",
            assumed=f"A body of {STRIKING.number:g} kg·m² strikes at once and stays with the output.",
        )
        for case, figure in pictures.items()
    ]
    nls.write_report(out / "report.html", *sections, table, title="Springs under a blow")
