"""Mutated records in every format, their mappings, and the other files that commands read."""

from __future__ import annotations

import io
import json
import random
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from nlsdesign.bench.calibration import read_joint_numbers
from nlsdesign.bench.identification import load_records
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import read_job, read_task
from nlsdesign.design.curves.target_files import read_band, read_target
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.locations import bundled
from nlsdesign.foundation.locations import folder as distributed
from nlsdesign.foundation.rubber_library import materials
from nlsdesign.model import flatten

from .cases import ACCEPTED, Case, Outcome
from .mutators import EVIL_NUMBERS, EVIL_TEXTS, damaged_bytes, damaged_lines, damaged_tokens

ROWS = 120
_HEADS = ("t_s", "theta_rad", "current_A", "force_N")
_MAPPING = """
held_out = ["b*"]
selection = ["c*"]
resample_Hz = 250
held_out_after = {value = 0.2, unit = "s"}

[time]
column = "t_s"
unit = "s"

[columns.theta_rad]
signal = "motor_encoder.reading"
unit = "rad"
quantum = 1e-4
noise = 0.0

[columns.current_A]
signal = "current_sensor.reading"
unit = "A"
noise = 0.05

[columns.force_N]
signal = "force_sensor.reading"
unit = "N"
time = "t_s"

[[align]]
column = "force_N"
to = "theta_rad"
longest = {value = 20, unit = "ms"}
"""
_JOB = """
free = ["spring.cam.contour", "spring.pretension"]
spring = "spring"
[target]
ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
[limits]
MaximumCamRadius = {radius = "20 mm"}
MaximumTorqueError = {rms = "20 mN*m"}
[goals]
TorqueError = {}
[stock]
"spring.rubber.thickness" = ["2 mm", "3 mm"]
rubber = ["PMC-770"]
[search]
starts = 20
largest_error = "1 %"
[tolerance]
draws = 2000
"""
_RIG = """
[rubber]
A0_m2 = 0.0001
L0_m = 0.0125
k_star_Pa = [920000.0, 580000.0]
delta_i_m = [0.0, 0.0002]
k_Pa = 580000.0
eta_Pa_s = 20000.0
[drivetrain]
J_kg_m2 = 0.009
gear_ratio = 25.0
kT_Nm_per_A = 0.0302
b_Nm_s_per_rad = 0.012
[sensors]
theta_quantum_rad = 0.000766990
current_noise_std_A = 0.04
force_noise_std_N = 0.6
"""
_TARGET = "angle [deg], torque [N*m], lower [N*m], upper [N*m]\n" + "".join(
    f"{5 * k}, {0.1 * k * k:.3f}, {0.1 * k * k - 0.1:.3f}, {0.1 * k * k + 0.1:.3f}\n" for k in range(12)
)
_TASK = "time [s], angle [deg], torque [N*m]\n" + "".join(
    f"{0.02 * k:.3f}, {20 * np.sin(0.126 * k):.4f}, {3 * np.sin(0.126 * k):.4f}\n" for k in range(51)
)
_JOINT = json.dumps({"names": ["a.b", "c.d"], "values": [1.0, 2.0], "covariance": [[0.1, 0.0], [0.0, 0.2]]})


class Records:
    """Files of a bench, and mappings, design files, curves, tasks, materials and calibrations."""

    limit = 20.0

    def __init__(self) -> None:
        self._model = flatten(declare(load_deck("test_rig")))
        time = np.arange(ROWS) * 0.004
        angle = 0.7 * np.sin(5.0 * time)
        self._columns = dict(
            zip(_HEADS, (time, angle, 2.0 * np.cos(5.0 * time), 40.0 * angle**2), strict=True)
        )
        self._csv = "\n".join([",".join(_HEADS), *(",".join(f"{v:.6g}" for v in row)
                               for row in np.column_stack(list(self._columns.values())))]) + "\n"  # fmt: skip
        self._binary = {".parquet": _parquet(self._columns), ".mat": _mat(self._columns),
                        ".h5": _hdf5(self._columns)}  # fmt: skip
        self._materials = (distributed("models") / "materials.toml").read_text(encoding="utf-8")
        cam = "\n".join(f"{0.015 * k:.3f},{0.0001 * k * k:.6f},{0.015 + 0.0002 * k:.4f}" for k in range(60))
        self._cam = f"theta_rad,delta_m,lever_arm_m\n{cam}\n"

    def made(self, random: random.Random, number: int) -> Case:
        kind = number % 10
        if kind < 2:
            return self._text_case(random, "a.csv", self._csv, odd_csv)
        if kind < 5:
            ending = (".parquet", ".mat", ".h5")[kind - 2]
            return Case({f"a{ending}": self._damaged(random, ending)}, how=f"bytes of {ending}")
        if kind == 5:
            tables = {f"{name}.csv": self._csv.encode() for name in "abc"}
            return Case({**tables, "records.toml": _text(random, _MAPPING)}, how="mapping")
        if kind == 6:
            return Case({"job.toml": _text(random, _JOB)}, how="design file")
        if kind == 7:
            name, text = random.choice((("target.csv", _TARGET), ("task.csv", _TASK), ("joint.json", _JOINT)))
            return Case({name: _text(random, text)}, how=name)
        if kind == 8:
            return Case({"materials.toml": _text(random, self._materials)}, how="materials")
        files = {"rig.toml": _RIG.encode(), "cam.csv": self._cam.encode()}
        name = random.choice(tuple(files))
        return Case({**files, name: _text(random, files[name].decode())}, how=f"rig, {name}")

    def undamaged(self) -> list[Case]:
        """Return the files as they should be, which are accepted."""
        csv = self._csv.encode()
        mapped = {**dict.fromkeys(("a.csv", "b.csv", "c.csv"), csv), "records.toml": _MAPPING.encode()}
        others = {"job.toml": _JOB, "target.csv": _TARGET, "task.csv": _TASK, "joint.json": _JOINT,
                  "materials.toml": self._materials}  # fmt: skip
        return [
            *(Case({name: text.encode()}, how=name) for name, text in others.items()),
            *(Case({f"a{ending}": content}, how=ending) for ending, content in self._binary.items()),
            Case({"a.csv": csv}, how="csv"),
            Case(mapped, how="mapping"),
            Case({"rig.toml": _RIG.encode(), "cam.csv": self._cam.encode()}, how="rig"),
        ]

    def long_csv(self, rows: int = 3000) -> bytes:
        """Return a record of some seconds, with noise, over which a diagnosis works for a while."""
        noise = np.random.default_rng(1)
        time = np.arange(rows) * 0.002
        angle = 0.5 * np.sin(6.0 * time)
        sound = (angle, 3.0 * np.sin(6.0 * time + 0.3), 60.0 * np.abs(angle))
        sizes = (5e-4, 0.04, 0.6)
        noisy = [s + size * noise.standard_normal(rows) for s, size in zip(sound, sizes, strict=True)]
        columns = (time, *noisy)
        lines = (",".join(f"{v:.6g}" for v in row) for row in np.column_stack(columns))
        return "\n".join([",".join(_HEADS), *lines, ""]).encode()

    def _text_case(
        self, chance: random.Random, name: str, text: str, other: Callable[[random.Random, str], bytes]
    ) -> Case:
        if chance.random() < 0.5:
            return Case({name: other(chance, text)}, how="odd tables")
        return Case({name: _text(chance, text)}, how="text of a table")

    def _damaged(self, chance: random.Random, ending: str) -> bytes:
        if chance.random() < 0.35:
            return _odd_binary(chance, ending, self._columns)
        return damaged_bytes(chance, self._binary[ending])

    def judged(self, case: Case, folder: Path) -> Outcome:
        names = set(case.files)
        if "job.toml" in names:
            read_job(folder / "job.toml")
        elif "materials.toml" in names:
            materials(folder / "materials.toml")
        elif "rig.toml" in names:
            bundled("models", "test_rig").test_rig_deck(folder / "rig.toml", folder / "cam.csv")
        elif "target.csv" in names:
            read_target(folder / "target.csv")
            read_band(folder / "target.csv")
        elif "task.csv" in names:
            read_task(folder / "task.csv")
        elif "joint.json" in names:
            read_joint_numbers(folder / "joint.json")
        else:
            return self._loaded(folder)
        return Outcome(ACCEPTED)

    def _loaded(self, folder: Path) -> Outcome:
        records = load_records(folder, self._model)
        for record in records.records:
            values = [record.trace.time, *record.trace.signals.values()]
            if not all(np.all(np.isfinite(each)) for each in values):
                return Outcome("read back differently", "a record holds what is not finite")
        return Outcome(ACCEPTED)


def _text(chance: random.Random, text: str) -> bytes:
    kind = chance.randrange(5)
    if kind == 0:
        return damaged_bytes(chance, text.encode())
    if kind == 1:
        return damaged_lines(chance, text, text).encode()
    if kind == 2 and "=" in text:
        return _other_kind(chance, text).encode()
    if kind == 3:
        depth = chance.choice((10, 1000, 20000))
        deep = f"{'[' * depth}{']' * depth}"
        return (
            f"{text}\nx = {deep}\n".encode() if "=" in text else re.sub(r"\d", deep, text, count=1).encode()
        )
    return damaged_tokens(chance, text).encode("utf-8", "surrogatepass")


def _other_kind(chance: random.Random, text: str) -> str:
    """Return TOML in which a field has a value of another kind, or is left out."""
    lines = text.split("\n")
    places = [k for k, line in enumerate(lines) if " = " in line]
    for _ in range(chance.choice((1, 1, 2))):
        at = chance.choice(places)
        key = lines[at].partition(" = ")[0]
        pool = (*EVIL_NUMBERS, *(f'"{each}"' for each in EVIL_TEXTS), "{value = 1, unit = 's'}", '["a", 1]')
        lines[at] = f"{key} = {chance.choice(pool)}"
    return "\n".join(lines)


def odd_csv(chance: random.Random, text: str) -> bytes:
    """Return a table as some program or hand writes it."""
    head, *rows = text.rstrip("\n").split("\n")
    kind = chance.randrange(16)
    if kind == 0:
        return b"\xef\xbb\xbf" + text.encode()
    if kind == 1:
        return text.replace(",", ";").replace(".", ",").encode()
    if kind == 2:
        return f"# made by a bench\n{text}".encode()
    if kind == 3:
        return text.encode("utf-16")
    if kind == 4:
        cells = [row.split(",") for row in rows]
        row, column = chance.randrange(len(cells)), chance.randrange(4)
        cells[row][column] = chance.choice(EVIL_NUMBERS)
        return "\n".join([head, *map(",".join, cells)]).encode()
    if kind == 5:
        factor = 10.0 ** chance.choice((-300, -100, -30, -9, -6, -3, 3, 6, 9, 30, 100, 300))
        column = chance.randrange(4)
        return _scaled(head, rows, column, factor)
    if kind == 6:
        return f"{chance.choice((head, ''))}\n".encode() * chance.choice((1, 2, 100))
    if kind == 7:
        return "\n".join([head, *rows[: chance.choice((0, 1, 2, 49, 50, 51))]]).encode()
    if kind == 8:
        return f"{head}\n{'9' * 200_000},1,2,3\n".encode() + "\n".join(rows).encode()
    if kind == 9:
        return text.replace(
            chance.choice(_HEADS), chance.choice((*_HEADS, "", '"', "x" * 500, "θ [°]", "t [ms]"))
        ).encode()
    if kind == 10:
        return f'{head}\n"{chance.choice(rows)}\n'.encode() + "\n".join(rows).encode()
    if kind == 11:
        return (head + "," + head + "\n" + "\n".join(f"{r},{r}" for r in rows)).encode()
    if kind == 12:
        return "\n".join([head, *chance.sample(rows, len(rows))]).encode()
    if kind == 13:
        return f"{head}\ns,rad,A,N\n".encode() + "\n".join(rows).encode()
    if kind == 14:
        return "\n".join([head, *(row.split(",")[0] + "," + ",".join(["5"] * 3) for row in rows)]).encode()
    return "\r".join([head, *rows]).encode()


def _scaled(head: str, rows: list[str], column: int, factor: float) -> bytes:
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[column] = f"{float(row[column]) * factor:.6g}"
    return "\n".join([head, *map(",".join, cells)]).encode()


def _parquet(columns: dict[str, Any]) -> bytes:
    import pyarrow
    import pyarrow.parquet

    stream = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(columns), stream)
    return stream.getvalue()


def _mat(columns: dict[str, Any], **options: Any) -> bytes:
    import scipy.io

    stream = io.BytesIO()
    scipy.io.savemat(stream, columns, **options)
    return stream.getvalue()


def _hdf5(columns: dict[str, Any]) -> bytes:
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        for name, values in columns.items():
            file[name] = values
    return stream.getvalue()


def _odd_binary(chance: random.Random, ending: str, columns: dict[str, Any]) -> bytes:
    """Return a binary table of unusual content."""
    kinds: tuple[Any, ...] = (
        np.array([]), np.float64(3.0), np.zeros((3, 4, 5)), np.array(["a"] * ROWS), np.full(ROWS, np.nan),
        np.full(ROWS, np.inf), np.arange(ROWS), np.ones(ROWS, dtype=bool), np.zeros(ROWS, dtype=np.int8),
        np.full(ROWS, 2**63 - 1), np.zeros(10), np.full(ROWS, 1e308), np.zeros((ROWS, 1)),
        np.zeros((1, ROWS)),
    )  # fmt: skip
    changed = {**columns, chance.choice((*_HEADS, "other")): chance.choice(kinds)}
    try:
        if ending == ".parquet":
            return _parquet(changed)
        if ending == ".mat":
            nested = {"log": changed} if chance.random() < 0.5 else changed
            whole = _mat(nested, do_compression=chance.random() < 0.5)
            return damaged_bytes(chance, whole) if chance.random() < 0.3 else whole
        return _hdf5_links(chance, changed) if chance.random() < 0.5 else _hdf5(changed)
    except (ValueError, TypeError, struct.error, OverflowError):  # a library cannot write that
        return b""


def _hdf5_links(chance: random.Random, columns: dict[str, Any]) -> bytes:
    """Return a file whose numbers stand elsewhere, do not end, or go round in a circle."""
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        for name, values in columns.items():
            file[name] = values
        name = chance.choice(_HEADS)
        del file[name]
        kind = chance.randrange(5)
        if kind == 0:
            file[name] = h5py.ExternalLink("/etc/passwd", "x")
        elif kind == 1:
            file.create_dataset(name, (ROWS,), dtype="f8", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])
        elif kind == 2:
            file.create_dataset(name, (10**12,), dtype="f8", chunks=(1024,))
        elif kind == 3:
            file[name] = h5py.SoftLink(f"/{name}")
        else:
            layout = h5py.VirtualLayout((ROWS,), dtype="f8")
            layout[:] = h5py.VirtualSource("/etc/passwd", "x", (ROWS,))
            file.create_virtual_dataset(name, layout)
    return stream.getvalue()
