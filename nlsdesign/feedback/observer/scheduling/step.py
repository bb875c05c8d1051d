"""One step of an observer, as matrices of the measured angle that become entries of a table."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....model import Variable
from .discretise import held, linear
from .gains import GainRule, SampledPlant
from .plant import AngleScheduledPlant
from .table import Entry

Array = NDArray[np.float64]


class _Titles(NamedTuple):
    """Rows (number, variable, start of the name) and columns (number, end of the name, unit) of a matrix."""

    rows: list[tuple[int, Variable, str]]
    columns: list[tuple[int, str, str]]


@dataclass(frozen=True, eq=False)
class ObserverStep:
    """What happens between two samples, written as matrices of the measured angle.

    With y the measured angle (and what follows from it), s the memory and e the innovation:
    x̂⁻ = s + γ₁(θ), then friction, e = y − C·x̂⁻, x̂ = x̂⁻ + M(θ)·e, estimate = t(θ)·x̂ + t₀(θ), and
    s⁺ = Φ(θ)·x̂ + γ₀(θ) + Γ(θ)·d(u) + Γ_δ(θ)·δ̇. What the angle drives runs linearly between samples: γ₀ is
    its part at the beginning of a sample, γ₁ at the end, which is known only when the next angle is. In the
    published form it is held instead, γ₁ = 0: there it is the offset of a tangent in the extension.

    Parameters
    ----------
    plant
        In the form of an angle-scheduled plant.
    gain
        Chooses M.
    sample_time
        In s.
    reference
        Angles over which typical sizes of the sums are taken.
    """

    plant: AngleScheduledPlant
    gain: GainRule
    sample_time: float
    reference: Array

    def matrices(self, angles: Array) -> dict[str, Array]:
        """Return the matrices of the step at many angles.

        Parameters
        ----------
        angles
            Shape (N,).

        Returns
        -------
        dict
            ``prior`` (N, n, 1), ``correction`` (N, n, r), ``next`` (N, n, n + 1 + k + 1), ``estimate``
            (N, 1, n + 1), ``shift`` (N, n, 1) and ``measured`` (N, r − 1, 1).
        """
        plant, c = self.plant, self.plant.at(angles)
        transition, _, _ = linear(c.a, self.sample_time)
        correction = [self._correction(*row) for row in zip(angles, c.a, transition, strict=True)]
        return {**without_correction(plant, self.sample_time, angles), "correction": np.array(correction)}

    def _correction(self, angle: float, a: Array, transition: Array) -> Array:
        plant = self.plant
        return self.gain.correction(
            SampledPlant(
                float(angle),
                a,
                transition,
                plant.output_matrix,
                plant.names,
                plant.sizes,
                self.sample_time,
                plant.speed,
            )
        )

    def factors(self) -> dict[str, Array]:
        """Return the typical size of what the columns of each matrix multiply."""
        plant, sizes = self.plant, self.plant.sizes
        # How fast things happen; an innovation is at most what happens in one sample.
        angle, speed = plant.moving
        pace = sizes[speed] / sizes[angle]
        innovation = min(1.0, self.sample_time * pace) * np.abs(plant.output_matrix) @ sizes
        led = [sizes[plant.names.index(name)] for name in plant.measured] or [0.0]
        known = pace * np.concatenate([sizes[list(plant.rows)], led])
        return {
            "prior": np.ones(1),
            "correction": innovation,
            "next": np.concatenate([sizes, [1.0], known]),
            "estimate": np.concatenate([sizes, [1.0]]),
            "shift": np.ones(1),
            "measured": np.ones(1),
        }

    def scales(self) -> dict[str, Array]:
        """Return the typical size of each sum: of what it adds in one sample, not of what it carries."""
        m, factor, sizes = self.matrices(self.reference), self.factors(), self.plant.sizes
        n = len(sizes)
        added = np.abs(m["next"] - np.eye(n, m["next"].shape[2])[None]) * factor["next"]
        step = np.maximum(np.max(added, axis=(0, 2)), np.max(np.abs(m["prior"]), axis=(0, 2)))
        step = np.where(step > 0.0, step, sizes)
        estimate = np.max(np.abs(m["estimate"]) * factor["estimate"], axis=(0, 2))
        measured = [sizes[self.plant.names.index(name)] for name in self.plant.measured]
        return {
            "prior": step, "correction": step, "next": step, "estimate": estimate, "shift": sizes,
            "measured": np.array(measured),
        }  # fmt: skip

    def entries(self, angles: Array) -> list[Entry]:
        """Return all entries at many angles, with the key ``<matrix>[i][j]``.

        Parameters
        ----------
        angles
            Shape (N,).
        """
        matrices, entries = self.matrices(angles), []
        # The estimate first: where entries share a column, it is one that the estimate needs exactly.
        for kind in ("estimate", "next", "prior", "correction", "shift", "measured"):
            values, weights, titles = matrices[kind], self._weights[kind], self._titles(kind)
            for (i, row, start), (j, end, unit) in product(titles.rows, titles.columns):
                name = f"{start}.{end}" if end else start
                total = row.name if kind not in ("shift", "measured") else start
                entries.append(
                    Entry(
                        f"{kind}[{i}][{j}]",
                        total,
                        name,
                        _per(row.unit, unit),
                        values[:, i, j],
                        float(weights[i, j]),
                    )
                )
        return entries

    def _titles(self, kind: str) -> _Titles:
        """Return how rows and columns of a matrix are called in the table."""
        plant = self.plant
        of = {v.name: v for v in plant.states}
        states = [(j, f"per.{v.name}", v.unit) for j, v in enumerate(plant.states)]
        seen = [of[name] for name in (plant.angle, *plant.measured)]
        pushes = [(plant.states[r].name, f"{plant.states[r].unit}/s") for r in plant.rows]
        pushes += [(f"{name}.rate", f"{of[name].unit}/s") for name in plant.measured] or [("rate", "1")]
        n = len(states)
        ends: dict[str, list[tuple[int, str, str]]] = {
            "estimate": [*states, (n, "offset", "1")],
            "next": [
                *states,
                (n, "drive", "1"),
                *((n + 1 + j, f"push.{name}", u) for j, (name, u) in enumerate(pushes)),
            ],
            "prior": [(0, "", "1")],
            "correction": [(j, f"per.{v.name}", v.unit) for j, v in enumerate(seen)],
            "shift": [(0, "", "1")],
            "measured": [(0, "", "1")],
        }
        rows = {"estimate": [plant.estimate], "measured": seen[1:]}.get(kind, list(plant.states))
        return _Titles([(i, v, f"{kind}.{v.name}") for i, v in enumerate(rows)], ends[kind])

    @cached_property
    def _weights(self) -> dict[str, Array]:
        factors, scales = self.factors(), self.scales()
        # A sum that adds nothing has no size of its own.
        return {
            kind: factors[kind][None, :] / np.where(scales[kind] > 0.0, scales[kind], 1.0)[:, None]
            for kind in factors
        }


def _per(unit: str, other: str) -> str:
    """Return the unit of a quotient: everything in ``other`` changes sides of the fraction line."""
    if other == "1":
        return unit
    pieces = re.split(r"([*/])", other)
    signs = ["*", *pieces[1::2]]
    turned = "".join(
        ("/" if sign == "*" else "*") + atom
        for sign, atom in zip(signs, pieces[::2], strict=True)
        if atom != "1"
    )
    return f"{unit}{turned}"


def without_correction(plant: AngleScheduledPlant, sample_time: float, angles: Array) -> dict[str, Array]:
    """Return the matrices of the step at many angles that no gain decides.

    Parameters
    ----------
    plant
        In the form of an angle-scheduled plant.
    sample_time
        In s.
    angles
        Shape (N,).

    Returns
    -------
    dict
        As :meth:`ObserverStep.matrices`, without ``correction``.
    """
    c, n, count = plant.at(angles), len(plant.states), len(angles)
    transition, begin, end = linear(c.a, sample_time)
    if plant.measured:
        # Tangents at the angle of the sample: their offset belongs to their slope and is held with it.
        begin, end = begin + end, np.zeros_like(end)
    pushed = np.zeros((count, n, len(plant.rows) + 1))
    pushed[:, list(plant.rows), range(len(plant.rows))] = 1.0
    pushed[:, :, -1] = c.rate
    _, push = held(c.a, pushed, sample_time)
    drive = c.drive[:, :, None]
    return {
        "prior": end @ drive,
        "next": np.concatenate([transition, begin @ drive, push], axis=2),
        "estimate": c.estimate[:, None, :],
        "shift": c.shift[:, :, None],
        "measured": c.measured[:, :, None],
    }
