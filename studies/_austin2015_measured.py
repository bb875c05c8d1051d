"""The published actuator against the points of Figs 1, 6 and 8 of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import nlsdesign as nls

Array = NDArray[np.float64]
LOOP_FREQUENCY = 1.0  # Hz; assumed, the paper does not print it for Fig. 1
FIG6_FREQUENCY = 10.8  # Hz; its time axis says so, its caption says 4 Hz


@dataclass(frozen=True)
class AgainstFigures:
    """Curves and agreement of the model with the figures of the paper.

    Parameters
    ----------
    static
        Angles, measured torque (Fig. 8), torque of the model at rest.
    hooke
        Best linear spring at the same angles.
    agreement, hooke_agreement
        In the metrics of the paper.
    loops
        By label: measured and simulated angle and torque of Fig. 1.
    element
        By amplitude in degrees: extension, measured force, model force of Fig. 6.
    """

    static: tuple[Array, Array, Array]
    hooke: Array
    agreement: Any
    hooke_agreement: Any
    loops: dict[str, tuple[tuple[Array, Array], tuple[Array, Array]]]
    element: dict[str, tuple[Array, Array, Array]]


def points(name: str) -> Array:
    """Return the points of one figure, shape (n, 2)."""
    file = Path(__file__).parent / "austin2015_figures" / f"{name}.csv"
    return np.loadtxt(file, delimiter=",", comments="#", skiprows=2)


def compare_with_figures(actuator: Any) -> AgainstFigures:
    """Hold the actuator against the three figures.

    Parameters
    ----------
    actuator
        Assembly of the deck.
    """
    driven = actuator.with_part("motor", nls.Driven()).without_part("motor_encoder")
    model = nls.flatten(driven, outputs=["spring.torque"])
    angle, measured = points("fig08_torque_profile_nls").T
    torque = nls.equilibrium_torque(nls.flatten(actuator), "spring", angle)
    hooke = angle * float(angle @ measured / (angle @ angle))
    loops = {}
    for degrees in (25, 45):
        shown = points(f"fig01_mean_torque_{degrees}deg")
        angle_here, torque_here = simulated_loop(model, float(shown[:, 0].max()))
        # The smaller loop is drawn for positive angles only.
        side = angle_here >= min(0.0, float(shown[:, 0].min()))
        loops[f"{degrees}°"] = ((shown[:, 0], shown[:, 1]), (angle_here[side], torque_here[side]))
    element = {f"{degrees}°": element_loop(actuator, degrees) for degrees in (25, 45)}
    return AgainstFigures(
        (angle, measured, torque),
        hooke,
        nls.agreement(measured, torque),
        nls.agreement(measured, hooke),
        loops,
        element,
    )


def simulated_loop(model: Any, amplitude: float) -> tuple[Array, Array]:
    """Return angle and torque of the second cycle of a sine."""
    turn = 2.0 * np.pi * LOOP_FREQUENCY
    time = np.linspace(0.0, 2.0 / LOOP_FREQUENCY, 801)
    angle, speed = amplitude * np.sin(turn * time), amplitude * turn * np.cos(turn * time)
    trace = nls.simulate(model, time, inputs={"motor.angle": angle, "motor.speed": speed})
    return angle[400:], trace["spring.torque"][400:]


def element_loop(actuator: Any, degrees: int) -> tuple[Array, Array, Array]:
    """Return extension, measured and model force of one element over the stretches drawn in Fig. 6."""
    extension, force = (points(f"fig06_measured_{degrees}deg_force_vs_extension") * [1e-3, 1.0]).T
    rubber = nls.tie(actuator.element("spring.rubber"), "grip")
    model = nls.flatten(
        nls.assembly("element", grip=nls.Driven(domain=nls.TRANSLATION), rubber=rubber),
        outputs=["rubber.force"],
    )
    # Two stretches, as the time axis shows; it gives no extension over time, so a sine is assumed.
    time = np.linspace(0.0, 2.0 / FIG6_FREQUENCY, 801)
    turn = 2.0 * np.pi * FIG6_FREQUENCY
    path = 0.5 * extension.max() * (1.0 - np.cos(turn * time))
    rate = 0.5 * extension.max() * turn * np.sin(turn * time)
    trace = nls.simulate(model, time, inputs={"grip.position": path, "grip.speed": rate})
    return extension, force, _at_extension(extension, path[400:], trace["rubber.force"][400:])


def _at_extension(extension: Array, path: Array, force: Array) -> Array:
    """Return the mean of up and down stroke at each extension."""
    top = int(np.argmax(path))
    up = np.interp(extension, path[: top + 1], force[: top + 1])
    return 0.5 * (up + np.interp(extension, path[top:][::-1], force[top:][::-1]))
