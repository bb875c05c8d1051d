"""Files as a bench leaves them: `rig.toml`, `cam.csv` and one CSV for each record."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from .actuators import Actuator

_RIG = """\
# The actuator as its makers declare it. The records beside this file were measured on the real one.
# Every record starts at rest, with the rubber relaxed, cold and never stretched before. \
The cable only pulls (force >= 0).
# One-sided spread of the declared numbers: 6 % on k_star, k, J and gear_ratio*kT; \
a factor 1.3 on eta; a factor 1.6 on b.
[rubber]               # standard linear solid with strain-dependent stiffness
A0_m2 = {area}
L0_m = {length}
k_star_Pa = {k_star}
delta_i_m = {engage}
k_Pa = {k}
eta_Pa_s = {eta}
[drivetrain]
J_kg_m2 = {inertia}   # total, reflected to the cam; the cam side carries J_cam_fraction of it
J_cam_fraction = {cam_share}
gear_ratio = {gear_ratio}
kT_Nm_per_A = {torque_constant}
b_Nm_s_per_rad = {viscosity}
[cam]
table = "cam.csv"      # theta_rad, delta_m, lever_arm_m = d(delta)/d(theta); \
delta even, lever arm odd in theta
[sensors]
theta_quantum_rad = {quantum:.9f}
current_noise_std_A = {current_noise}
force_noise_std_N = {force_noise}
sample_rate_Hz = {sample_rate}
"""


def write_declaration(folder: Path, actuator: Actuator) -> None:
    """Write `rig.toml` and `cam.csv` of the declared actuator into a folder."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rubber, drivetrain = vars(actuator.rubber), vars(actuator.drivetrain)
    text = _RIG.format(
        **{name: list(value) if isinstance(value, tuple) else value for name, value in rubber.items()},
        **drivetrain,
        quantum=actuator.sensors.angle_quantum,
        current_noise=actuator.sensors.current_noise,
        force_noise=actuator.sensors.force_noise,
        sample_rate=actuator.sensors.sample_rate,
    )
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    angles = np.linspace(0.0, actuator.cam.last_angle, actuator.cam.rows)
    rows = zip(angles, actuator.cam.extension(angles), actuator.cam.lever_arm(angles), strict=True)
    lines = ["theta_rad,delta_m,lever_arm_m", *(",".join(f"{number:.8g}" for number in row) for row in rows)]
    (folder / "cam.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_records(folder: Path, records: Mapping[str, np.ndarray]) -> None:
    """Write one CSV for each record into a folder."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in records.items():
        np.savetxt(
            folder / f"{name}.csv",
            table,
            fmt=(_clock(table[:, 0]), "%.6f", "%.3f", "%.2f"),
            delimiter=",",
            header="t_s,theta_rad,current_A,force_N",
            comments="",
        )


def _clock(time: np.ndarray) -> str:
    """Digits of the time: milliseconds unless the samples lie between them."""
    between = np.any(np.abs(1e3 * time - np.round(1e3 * time)) > 1e-6)
    return "%.4f" if between else "%.3f"


def write_set(folder: Path, actuator: Actuator, records: Mapping[str, np.ndarray]) -> None:
    """Write a set that stands alone: six CSVs with `rig.toml` and `cam.csv` beside them."""
    write_declaration(folder, actuator)
    write_records(folder, records)


def write_collection(
    folder: Path, actuator: Actuator, sets: Mapping[str, tuple[Iterable[str], Mapping[str, np.ndarray]]]
) -> None:
    """Write several sets of one actuator: declaration and `labels.json`, and a folder for each set.

    `sets` gives for each name the hidden effects and the records.
    """
    folder = Path(folder)
    write_declaration(folder, actuator)
    for name, (_, records) in sets.items():
        write_records(folder / name, records)
    labels = {name: sorted(set(effects) - {"none"}) for name, (effects, _) in sets.items()}
    (folder / "labels.json").write_text(json.dumps(labels, indent=1), encoding="utf-8")
