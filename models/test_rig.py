"""The practice rig: one rubber element behind a two-sided cam, a servoed motor, the load side held."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nlsdesign.components import (
    ROTATION,
    Assembly,
    CurrentSensor,
    Dashpot,
    Encoder,
    Fixed,
    ForceSensor,
    GearedMotor,
    LinearElastic,
    Specimen,
    StrainStiffening,
    TwoSidedCam,
    ViscousMaterial,
    control_values,
    pull_only,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.errors import DeckError, nearest
from nlsdesign.quantity import Quantity, quantity, significant

_CONTROL_VALUES = 80
_CHANGEOVER = 2e-5  # rad; at 15 mm lever arm 0.3 µm of extension
_SPREAD, _SPREAD_OF_VISCOSITY, _SPREAD_OF_BEARING = 0.06, 0.3, 0.6


def test_rig_deck(rig_toml: Path, cam_csv: Path) -> Assembly:
    """Return the rig as its makers declare it.

    Parameters
    ----------
    rig_toml
        Tables ``rubber``, ``drivetrain`` and ``sensors``, units in the names of the fields.
    cam_csv
        Columns ``theta_rad, delta_m, lever_arm_m`` for θ ≥ 0.

    Returns
    -------
    Assembly
        With the spreads that the file states in words: 6 % on the moduli, the inertia and the torque constant
        (of the product gear_ratio·kT), a factor of 1.3 on the viscosity and of 1.6 on the bearing.

    Raises
    ------
    DeckError
        If a field is missing.
    """
    try:
        rig = tomllib.loads(rig_toml.read_text(encoding="utf8"))
    except tomllib.TOMLDecodeError as error:
        raise DeckError(rig_toml.name, f"is not valid TOML: {error}") from None
    numbers = _Numbers(rig, rig_toml.name)
    return assembly(
        "test_rig",
        description="Practice rig: rubber behind a two-sided cam, servoed motor, load side held",
        motor=GearedMotor(
            inertia=numbers("drivetrain", "J_kg_m2", "kg*m^2", _SPREAD),
            gear_ratio=numbers("drivetrain", "gear_ratio", "1"),
            torque_constant=numbers("drivetrain", "kT_Nm_per_A", "N*m/A", _SPREAD),
            current_limit=quantity(100.0, "A", source="assumed: the rig states none, and none is reached"),
        ),
        load=Fixed(),
        spring=tie(through(_cam(cam_csv), cable=pull_only(rubber=_rubber(numbers))), "motor", "load"),
        bearing=tie(
            Dashpot(
                damping=numbers("drivetrain", "b_Nm_s_per_rad", "N*m*s/rad", _SPREAD_OF_BEARING),
                domain=ROTATION,
            ),
            "motor",
        ),
        motor_encoder=Encoder(of="motor.angle", quantum=numbers("sensors", "theta_quantum_rad", "rad")),
        current_sensor=CurrentSensor(
            of="motor.current", noise=numbers("sensors", "current_noise_std_A", "A")
        ),
        force_sensor=ForceSensor(of="spring.cable.force", noise=numbers("sensors", "force_noise_std_N", "N")),
    )


class _Numbers:
    """The numbers of the file as quantities."""

    def __init__(self, tables: Mapping[str, Any], file: str) -> None:
        self._tables, self._file = tables, file

    def raw(self, table: str, field: str) -> Any:
        """Return what stands in a field."""
        fields = self._tables.get(table, {})
        if field not in fields:
            raise DeckError(
                f"{self._file}: {table}.{field}", "is missing", did_you_mean=nearest(field, fields),
                next_step="give the file of the rig, as its makers wrote it",
            )  # fmt: skip
        return fields[field]

    def __call__(self, table: str, field: str, unit: str, spread: float = 0.0) -> Quantity:
        """Return a number or a row of numbers with unit and spread."""
        raw = self.raw(table, field)
        value = tuple(float(v) for v in raw) if isinstance(raw, list) else float(raw)
        return quantity(value, unit, source=f"{self._file}, {table}.{field}", spread=spread)


def _rubber(numbers: _Numbers) -> Specimen:
    length = numbers("rubber", "L0_m", "m")
    engaged = significant(d / length.number for d in numbers.raw("rubber", "delta_i_m"))
    return specimen(
        area=numbers("rubber", "A0_m2", "m^2"),
        rest_length=length,
        stiff=StrainStiffening(
            modulus=numbers("rubber", "k_star_Pa", "Pa", _SPREAD),
            knots=quantity(engaged, "1", source="rig.toml, rubber.delta_i_m over rubber.L0_m"),
        ),
        relaxing=series(
            spring=LinearElastic(modulus=numbers("rubber", "k_Pa", "Pa", _SPREAD)),
            dashpot=ViscousMaterial(viscosity=numbers("rubber", "eta_Pa_s", "Pa*s", _SPREAD_OF_VISCOSITY)),
        ),
    )


def _cam(cam_csv: Path) -> TwoSidedCam:
    table = _cam_table(cam_csv)
    values = significant(control_values(table[:, 0], table[:, 2], _CONTROL_VALUES))
    source = f"{cam_csv.name}, lever_arm_m, as a cubic spline"
    return TwoSidedCam(
        lever_arm=quantity(values, "m", source=source),
        last_angle=quantity(float(table[-1, 0]), "rad", source=f"{cam_csv.name}, last row"),
        changeover=quantity(_CHANGEOVER, "rad", source="assumed: far below one encoder count"),
    )


def _cam_table(cam_csv: Path) -> NDArray[np.float64]:
    with cam_csv.open(newline="", encoding="utf8") as stream:
        rows = list(csv.reader(stream))
    wanted = ["theta_rad", "delta_m", "lever_arm_m"]
    if not rows or rows[0] != wanted:
        raise DeckError(f"{cam_csv.name}:1:1", f"the columns must be {', '.join(wanted)}")
    try:
        return np.array(rows[1:], dtype=float)
    except ValueError as error:
        raise DeckError(cam_csv.name, f"holds something that is not a number: {error}") from None
