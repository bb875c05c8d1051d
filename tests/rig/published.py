"""The published actuator on the rig, and the records that the study of the published actuator reads.

Numbers as in ``models/decks/austin2015_figure_consistent.toml``, typed again; the cam is milled as declared:
the control values of its lever arm h, a uniform cubic B-spline over the angle, are read from that file, and
the extension is the integral of h.

The rig knows one force; here it is that of both elements, and a record of one element holds half of it.
"""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline

from .actuators import Actuator, Cam, Drivetrain, Rubber, Sensors
from .records import make_records

HIDDEN = {"coulomb_friction": 0.07, "second_relaxation": 1.0}
"""The declared dry friction (0.02 N·m), and a second relaxation of the rubber that nobody declared."""
SEED = 2015

RUBBER = Rubber(
    area=2.0e-4,
    length=0.0125,
    k_star=tuple(2.55e6 * k for k in (0.92, 0.58, 0.74, 0.77, 0.47, 1.06)),
    engage=(0.0, 2.0e-4, 1.06e-3, 2.65e-3, 9.04e-3, 9.05e-3),
    k=2.55e6 * 0.58,
    eta=21.0e3,
    buckles=False,
)


@cache
def _lever_arm_spline() -> tuple[BSpline, BSpline]:
    """Return lever arm and extension over the angle."""
    deck = Path(__file__).resolve().parents[2] / "models" / "decks" / "austin2015_figure_consistent.toml"
    cam = tomllib.loads(deck.read_text(encoding="utf8"))["spring"]["cam"]
    assert (cam["lever_arm"]["unit"], cam["last_angle"]["unit"]) == ("mm", "deg")
    values = 1e-3 * np.array(cam["lever_arm"]["value"])
    step = np.radians(cam["last_angle"]["value"]) / (len(values) - 3)
    lever_arm = BSpline(step * (np.arange(len(values) + 4) - 3.0), values, 3)
    return lever_arm, lever_arm.antiderivative()


def _extension(angle: np.ndarray) -> np.ndarray:
    integral = _lever_arm_spline()[1]
    return integral(angle) - integral(0.0)


def _lever_arm(angle: np.ndarray) -> np.ndarray:
    return _lever_arm_spline()[0](angle)


PUBLISHED = Actuator(
    name="published",
    rubber=RUBBER,
    drivetrain=Drivetrain(
        inertia=5.97e-4, cam_share=0.1, gear_ratio=4.0, torque_constant=0.055, viscosity=1e-3
    ),
    cam=Cam(extension=_extension, lever_arm=_lever_arm, last_angle=np.radians(60.0), rows=241),
    sensors=Sensors(current_noise=0.04, force_noise=0.6),
    ripple_order=4,
)


def study_records() -> dict[str, np.ndarray]:
    """Return the records of the study: time, angle, current, force of one element; shapes (n, 4)."""
    found = make_records(PUBLISHED, HIDDEN, seed=SEED)
    return {name: table * np.array([1.0, 1.0, 1.0, 0.5]) for name, table in found.items()}


def study_table(table: np.ndarray) -> str:
    """Return one record as the study keeps it: every second sample, digits as fine as the sensors."""
    lines = ["t_s,motor_angle_rad,motor_current_A,element_force_N"]
    lines += [f"{t:.3f},{angle:.6f},{current:.3f},{force:.2f}" for t, angle, current, force in table[::2]]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the records of the study: ``python -m tests.rig.published``."""
    folder = Path(__file__).resolve().parents[2] / "studies" / "austin2015_bench"
    for name, table in study_records().items():
        (folder / f"{record_name(name)}.csv").write_text(study_table(table), encoding="utf8")


def record_name(name: str) -> str:
    """Return the name in the study: the soft servo does not reach the amplitudes of the rig's own names."""
    kind, *rest = name.split("_")
    return f"{kind}_{rest[-1]}" if rest else kind


if __name__ == "__main__":
    main()
