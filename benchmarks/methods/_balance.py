"""Torque balances of a case as somebody without this package would set them up, and candidates for them.

The usual inverse dynamic identification: positions are low-passed forward and backward and differentiated,
each term of the balance is computed, and both sides are low-passed again and thinned to the rows that are
resolved. A machine with two encoders has two balances, of its motor and of its load, which share what acts on
both. Only ``tomllib``, NumPy and SciPy read the case.
"""

from __future__ import annotations

import copy
import csv
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal, sparse

Array = np.ndarray
EDGE = 0.3  # s at both ends of a record, where a filter that goes both ways has nothing to go by
MOTION, RESOLVED = 40.0, 20.0
"""Hz: of the filter before differentiation, and of the rows of the balance."""


@dataclass(frozen=True)
class Deck:
    """What a deck declares, by what the parts are; ``None`` where there is no such part."""

    motor: str
    load: str | None
    per_ampere: float
    inertia: float
    stiffness: float
    load_inertia: float
    has: Mapping[str, bool]
    turns: bool
    gear_ratio: float


@dataclass(frozen=True)
class Motion:
    """Signals of one record, shape (n,), all through the same filter.

    A machine of one body has the same signals for motor and load.
    """

    step: float
    place: Array
    speed: Array
    acceleration: Array
    load_place: Array
    load_speed: Array
    load_acceleration: Array
    current: Array

    def delayed(self, values: Array, by: float) -> Array:
        """Return values as they were some time before."""
        time = self.step * np.arange(len(values))
        return np.interp(time - by, time, values)


Columns = Callable[[Motion, Deck, Mapping[str, float]], tuple[Array, Array]]
"""From a record and shapes to columns of the motor's balance and of the load's, both of shape (n, k)."""


@dataclass(frozen=True)
class Candidate:
    """An effect that may act: what it adds to the balances, with the shapes that stand in it non-linearly.

    Parameters
    ----------
    name, part
        As an answer gives them.
    columns
        What it adds, per unit of its sizes.
    shapes
        Lowest and largest value of each shape; all are positive and searched on a logarithmic scale.
    """

    name: str
    part: str
    columns: Columns
    shapes: Mapping[str, tuple[float, float]] = field(default_factory=dict)


class Balance:
    """Rows of the balances of all records of a case, in units of what the declared terms leave."""

    def __init__(self, folder: Path) -> None:
        self.deck, self.motions = _read(folder)
        self._thinned = [_thinning(len(m.place), m.step) for m in self.motions]
        known, terms = zip(*(_declared(m, self.deck) for m in self.motions), strict=True)
        target, base = self._rows(known)[:, 0], self._rows(terms)
        two = self.deck.load is not None
        self._owner = np.concatenate([np.repeat([0, 1][: 1 + two], t.shape[0]) for t in self._thinned])
        rest = target - base @ np.linalg.lstsq(base, target, rcond=None)[0]
        self._scale = np.array([np.sqrt(np.mean(rest[self._owner == k] ** 2)) for k in range(1 + two)])
        weight = 1.0 / self._scale[self._owner]
        self._basis, _ = np.linalg.qr(base * weight[:, None])
        self.left = target * weight
        self.left -= self._basis @ (self._basis.T @ self.left)

    def _rows(self, sides: Iterable[tuple[Array, Array]]) -> Array:
        """Return both balances low-passed and thinned, the load of a record below its motor."""
        count = 1 if self.deck.load is None else 2
        return np.concatenate(
            [t @ each for t, both in zip(self._thinned, sides, strict=True) for each in both[:count]]
        )

    def columns(self, candidate: Candidate, shapes: Mapping[str, float]) -> Array:
        """Return what a candidate adds beside what is there, shape (rows, k), in columns of length one."""
        rows = self._rows([candidate.columns(m, self.deck, shapes) for m in self.motions])
        rows = rows / self._scale[self._owner][:, None]
        whole = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        rows = rows - self._basis @ (self._basis.T @ rows)
        size = np.linalg.norm(rows, axis=0)
        # A column that is in the span of what is there already says nothing.
        return np.where(size > 1e-6 * whole, rows / np.maximum(size, 1e-300), 0.0)

    def rest(self, columns: Array) -> float:
        """Return the sum of squares that is left beside the columns of a candidate."""
        fitted, *_ = np.linalg.lstsq(columns, self.left, rcond=1e-6)
        rest = self.left - columns @ fitted
        return float(rest @ rest)

    def beside(self, columns: Array) -> Balance:
        """Return the balance with these columns among what is there."""
        more = copy.copy(self)
        directions, sizes, _ = np.linalg.svd(columns, full_matrices=False)
        more._basis = np.column_stack([self._basis, directions[:, sizes > 1e-6]])
        more.left = self.left - more._basis @ (more._basis.T @ self.left)
        return more


def criterion(rest: float, rows: int, numbers: int) -> float:
    """Return n ln(rest/n) + k ln n, that of Schwarz."""
    return float(rows * np.log(rest / rows) + numbers * np.log(rows))


# --- reading --------------------------------------------------------------------------------------


def _read(folder: Path) -> tuple[Deck, list[Motion]]:
    parts = tomllib.loads((folder / "deck.toml").read_text(encoding="utf-8"))
    mapping = tomllib.loads((folder / "records.toml").read_text(encoding="utf-8"))
    deck = _deck(parts)
    column = {_what(entry["signal"], parts, deck): name for name, entry in mapping["columns"].items()}
    motions = [_motion(file, mapping["time"]["column"], column) for file in sorted(folder.glob("*.csv"))]
    return deck, motions


def _deck(parts: Mapping[str, Any]) -> Deck:
    def of(kind: str) -> list[str]:
        return [name for name, part in parts.items() if part.get("component") == kind]

    def number(name: str, key: str) -> float:
        return float(parts[name][key]["value"])

    drives, loads, springs = [*of("GearedMotor"), *of("LinearDrive")], of("Inertia"), of("Spring")
    motor, load = drives[0], loads[0] if loads else None
    ratio = number(motor, "gear_ratio") if of("GearedMotor") else 1.0
    pull = ratio * number(motor, "torque_constant") if of("GearedMotor") else number(motor, "force_constant")
    ties = [tuple(parts[name]["between"]) for name in of("Dashpot")]
    return Deck(
        motor, load, pull, number(motor, "inertia" if of("GearedMotor") else "mass"),
        number(springs[0], "stiffness") if springs else 0.0,
        number(load, "inertia") if load else 0.0,
        {
            "damping": (motor,) in ties, "load_damping": load is not None and (load,) in ties,
            "spring_damping": any(len(tie) == 2 for tie in ties), "weight": bool(of("GravityLoad")),
        },
        bool(of("GearedMotor")), ratio,
    )  # fmt: skip


def _what(read: str, parts: Mapping[str, Any], deck: Deck) -> str:
    """Return whether a column shows the place of the motor, that of the load, or the current."""
    name, _, what = read.partition(".")
    of = str(parts[name]["of"]) if what == "reading" else read
    if of.endswith((".current", ".voltage")):
        return "current"
    return "load_place" if deck.load and of.startswith(f"{deck.load}.") else "place"


def _motion(file: Path, time: str, column: Mapping[str, str]) -> Motion:
    with file.open(encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    table = {key: np.array([float(row[name]) for row in rows]) for key, name in column.items()}
    clock = np.array([float(row[time]) for row in rows])
    step = float(np.median(np.diff(clock)))
    place = _moved(table["place"], step)
    load = _moved(table["load_place"], step) if "load_place" in table else place
    # A current that is held from row to row acts half a row later than it is written.
    beside = np.concatenate(
        [table["current"][:1], table["current"][:1], table["current"], table["current"][-1:]]
    )
    held = np.convolve(beside, [-0.0625, 0.5625, 0.5625, -0.0625], "valid")
    return Motion(step, *place, *load, _low(held, step, MOTION))


def _moved(read: Array, step: float) -> tuple[Array, Array, Array]:
    place = _low(read, step, MOTION)
    speed = slope(place, step)
    return place, speed, slope(speed, step)


def slope(values: Array, step: float) -> Array:
    """Return the derivative by differences of fourth order, which is right as far as rows are resolved."""
    near, far = (values[2 + n : len(values) - 2 + n] - values[2 - n : len(values) - 2 - n] for n in (1, 2))
    made = np.gradient(values, step)
    made[2:-2] = (8.0 * near - far) / (12.0 * step)
    return made


def _low(values: Array, step: float, corner: float) -> Array:
    """Return what a filter of fourth order lets through, forward and backward, so without a delay."""
    sections = signal.butter(2, min(corner * 2.0 * step, 0.9), output="sos")
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0))


def _thinning(rows: int, step: float) -> sparse.csr_array:
    """Return the matrix that low-passes a signal and keeps the rows that are resolved."""
    every = max(round(0.5 / (RESOLVED * step)), 1)
    edge = round(EDGE / step)
    kept = np.arange(edge, rows - edge, every)
    # Forward and backward the filter is its own adjoint: its answer to a pulse is the row of that instant.
    answers = _low((np.arange(rows)[:, None] == kept).astype(float), step, RESOLVED).T
    return sparse.csr_array(np.where(np.abs(answers) > 1e-6 * np.abs(answers).max(), answers, 0.0))


def _declared(m: Motion, deck: Deck) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the known sides of both balances, of declared drive and spring, and the declared terms."""
    none = np.zeros_like(m.place)
    lead, rate = m.place - m.load_place, m.speed - m.load_speed
    pull = np.sin(m.load_place)
    terms = [(m.acceleration, none)]
    if deck.has["damping"]:
        terms.append((m.speed, none))
    if deck.load:
        terms += [(none, m.load_acceleration), (lead, none)]
        if deck.has["load_damping"]:
            terms.append((none, m.load_speed))
        if deck.has["spring_damping"]:
            terms.append((rate, -rate))
    if deck.has["weight"]:
        terms.append((none, pull) if deck.load else (pull, none))
    motor, load = (np.column_stack(side) for side in zip(*terms, strict=True))
    return (deck.per_ampere * m.current[:, None], deck.stiffness * lead[:, None]), (motor, load)
