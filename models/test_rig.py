"""The practice rig: one rubber element behind a two-sided cam, a servoed motor, the load side held."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nlsdesign.bench.identification.records.quality import check_columns
from nlsdesign.bench.identification.records.table_files import read_table
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
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import DeckError, brief, nearest
from nlsdesign.foundation.quantity import Quantity, quantity, significant

_CONTROL_VALUES = 80
_CHANGEOVER = 2e-5  # rad; at 15 mm lever arm 0.3 µm of extension
_CAM_COLUMNS = ("theta_rad", "delta_m", "lever_arm_m")
_LARGEST = 1e100
_SPREAD, _SPREAD_OF_VISCOSITY, _SPREAD_OF_BEARING = 0.06, 0.3, 0.6


def test_rig_deck(rig_toml: Path, cam_csv: Path) -> Assembly:
    """Return the rig as its makers declare it."""
    numbers = _Numbers(load_deck(rig_toml).tables, rig_toml.name)
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
        self._tables, self.file = tables, file

    def raw(self, table: str, field: str) -> Any:
        """Return what stands in a field."""
        fields = self._tables.get(table, {})
        if not isinstance(fields, dict):
            raise DeckError(f"{self.file}: {table}", "is not a table", next_step=f"write [{table}]")
        if field not in fields:
            raise DeckError(
                f"{self.file}: {table}.{field}", "is missing", did_you_mean=nearest(field, fields),
                next_step="give the file of the rig, as its makers wrote it",
            )  # fmt: skip
        return fields[field]

    def __call__(self, table: str, field: str, unit: str, spread: float = 0.0) -> Quantity:
        """Return a number or a row of numbers with unit and spread."""
        value = self.raw(table, field)
        row = value if isinstance(value, list) else [value]
        if not row or not all(isinstance(v, int | float) and abs(v) < _LARGEST for v in row):
            raise DeckError(f"{self.file}: {table}.{field}", f"{brief(value)} is no number")
        return quantity(
            tuple(row) if isinstance(value, list) else value,
            unit,
            source=f"{self.file}, {table}.{field}",
            spread=spread,
        )


def _rubber(numbers: _Numbers) -> Specimen:
    length = numbers("rubber", "L0_m", "m")
    if length.number <= 0.0:
        raise DeckError(
            f"{numbers.file}: rubber.L0_m", f"{length.number:g} m is no length", next_step="give it in metres"
        )
    engaged = significant(d / length.number for d in numbers("rubber", "delta_i_m", "m").values)
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
    table = read_table(cam_csv)
    if table.heads != _CAM_COLUMNS:
        raise DeckError(f"{cam_csv.name}:1:1", f"the columns must be {', '.join(_CAM_COLUMNS)}")
    columns = table.columns(_CAM_COLUMNS)
    check_columns(table.file, columns, first_row=table.first_row)
    return np.column_stack([columns[name] for name in _CAM_COLUMNS])
