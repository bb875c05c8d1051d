"""The published actuator on the rig, and the records that the study of the published actuator reads.

Numbers as in ``models/decks/austin2015_figure_consistent.toml``, typed again; the cam follows from energy:
with the torque 4.35 N·m (θ/rad)^2.09 of Fig. 8 and the equilibrium force F* of both elements together,

    ∫₀^δ F* = ∫₀^θ τ   gives δ(θ),   h(θ) = τ(θ) / F*(δ(θ)).

The rig knows one force; here it is that of both elements, and a record of one element holds half of it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from .actuators import Actuator, Cam, Drivetrain, Rubber, Sensors
from .records import make_records

COEFFICIENT, EXPONENT = 4.35, 2.09  # N·m and 1, Fig. 8
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
)


@cache
def _profile() -> tuple[np.ndarray, np.ndarray]:
    """Extension and angle of equal energy on a fine grid, shapes (n,)."""
    extension = np.concatenate([[0.0], np.geomspace(1e-9, 8e-3, 40_000)])
    force = RUBBER.equilibrium(extension)
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(extension))])
    return extension, (energy * (EXPONENT + 1.0) / COEFFICIENT) ** (1.0 / (EXPONENT + 1.0))


def _extension(angle: np.ndarray) -> np.ndarray:
    extension, turned = _profile()
    return np.interp(angle, turned, extension)


def _lever_arm(angle: np.ndarray) -> np.ndarray:
    angle = np.asarray(angle, dtype=float)
    force = RUBBER.equilibrium(_extension(angle))
    torque = COEFFICIENT * angle**EXPONENT
    return np.divide(torque, force, out=np.zeros_like(torque), where=force > 0.0)


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
