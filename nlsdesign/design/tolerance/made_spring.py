"""Torque of made springs at rest, for many draws of everything that deviates at once, and to first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...model import FlatModel
from ...model.structure import CamNames
from ..curves.target import Target
from ..statics.equilibrium import cam_function, elastic_law
from .causes import Cause, NumberCause
from .made_cam import MadeCam, made_cam

_LONG = 2000
"""Number of instructions of a law from which on it is not written out for each angle."""


@dataclass(frozen=True, eq=False)
class MadeSpring:
    """The springs that are made from one design, over angle and stroke.

    Columns are the angles, and where guides of the cable have friction the angles twice: pulling in, with
    T·e^(µφ), then letting out, with T·e^(−µφ).

    Parameters
    ----------
    cam
        Names around the cam.
    causes
        What deviates, and what may be trimmed.
    angles
        θ in rad, ascending from zero, shape (n,).
    targets
        Torque that is asked for, shape (n,), in N·m.
    importance
        Weight of the error that the target gives each angle, shape (n,).
    contour
        The made cam.
    force
        ``casadi.Function`` (extension, moved numbers) -> force of one element.
    moved
        Names of the moved numbers.
    numbers
        Their values without deviations.
    ranges
        Their least and largest values, shape (moved, 2).
    """

    cam: CamNames
    causes: tuple[Cause, ...]
    angles: Array
    targets: Array
    importance: Array
    contour: MadeCam
    force: ca.Function = field(repr=False)
    moved: tuple[str, ...]
    numbers: Array
    ranges: Array

    @property
    def rubs(self) -> bool:
        """Whether guides of the cable have friction."""
        return bool(self.cam.guides)

    @cached_property
    def wanted(self) -> Array:
        """Targets of all columns."""
        return np.tile(self.targets, 2) if self.rubs else self.targets

    @cached_property
    def weights(self) -> Array:
        """Weights of the columns in the mean over angle and stroke, as the target says; their sum is 1."""
        steps = np.diff(self.angles)
        weights = self.importance * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
        weights = weights / np.sum(weights)
        result: Array = np.tile(weights / 2, 2) if self.rubs else weights
        return result

    @cached_property
    def nominal(self) -> Array:
        """Torque without deviations, shape (columns,)."""
        result: Array = self.torques(np.zeros((1, len(self.causes))))[0]
        return result

    @cached_property
    def _forces(self) -> ca.Function:
        """The force at all angles, (extensions (n,), moved numbers) -> (n,)."""
        stretch, numbers = ca.MX.sym("stretch", len(self.angles)), ca.MX.sym("numbers", len(self.moved))
        mapped = self.force.map(len(self.angles))(stretch.T, numbers)
        forces = ca.Function("forces", [stretch, numbers], [mapped.T])
        return forces.expand() if self.force.n_instructions() < _LONG else forces

    @cached_property
    def _amounts(self) -> Array:
        """Change of each moved number per standard deviation of each cause, shape (causes, moved)."""
        amounts = np.zeros((len(self.causes), len(self.moved)))
        for k, cause in enumerate(self.causes):
            if isinstance(cause, NumberCause):
                for name, amount in cause.numbers:
                    amounts[k, self.moved.index(name)] += amount
        return amounts

    def rms(self, torques: Array) -> Array:
        """Return the root of the mean over angle and stroke of the squared error.

        ``torques``: shape (draws, columns), in N·m.
        """
        result: Array = np.sqrt((torques - self.wanted) ** 2 @ self.weights)
        return result

    def held(self, deviations: Array) -> int:
        """Return in how many draws a number had to be held at the end of its range.

        ``deviations``: in units of the standard deviations, shape (draws, causes).
        """
        free = self.numbers + deviations @ self._amounts
        outside = np.any((free < self.ranges[:, 0]) | (free > self.ranges[:, 1]), axis=1)
        near = self.contour.distance(self.causes, deviations) < self.contour.nearest_anchor
        return int(np.sum(outside | near))

    def torques(self, deviations: Array, touched: tuple[Array, Array] | None = None) -> Array:
        """Return the torque of made springs.

        ``deviations``: in units of the standard deviations, shape (draws, causes). Result: shape (draws,
        columns), in N·m.
        """
        arms, longer = touched or self.contour.deviating(self.causes, deviations)
        numbers = np.clip(self.numbers + deviations @ self._amounts, self.ranges[:, 0], self.ranges[:, 1])
        column = {name: numbers[:, k, None] for k, name in enumerate(self.moved)}
        stretch = column[self.cam.pretension] + longer
        forces = np.array(self._forces(np.maximum(stretch, 0.0).T, numbers.T), dtype=float).T
        # A slack cable does not push.
        torques = column[self.cam.elements] * arms * np.where(stretch >= 0.0, forces, 0.0)
        if not self.rubs:
            return torques
        exponent = self._exponent(numbers)[:, None]
        return np.concatenate([torques * np.exp(exponent), torques * np.exp(-exponent)], axis=1)

    def _exponent(self, numbers: Array) -> Array:
        """Return the sum of µφ of all guides, shape (draws,)."""
        total = np.zeros(len(numbers))
        for guide in self.cam.guides:
            total = total + np.prod(numbers[:, [self.moved.index(name) for name in guide]], axis=1)
        return total

    @cached_property
    def sensitivities(self) -> Array:
        """Change of the torque per standard deviation of each cause, to first order, (causes, columns)."""
        place = {name: k for k, name in enumerate(self.moved)}
        stretch, numbers = ca.SX.sym("stretch"), ca.SX.sym("numbers", len(self.moved))
        force = self.force.call([stretch, numbers])[0]
        slopes = ca.Function(
            "slopes", [stretch, numbers],
            [force, ca.jacobian(force, stretch), ca.jacobian(force, numbers).T],
        )  # fmt: skip
        pretension, elements = (self.numbers[place[n]] for n in (self.cam.pretension, self.cam.elements))
        arms = self.contour.lever_arms
        at = slopes((pretension + self.contour.extensions).reshape(1, -1), self.numbers)
        pull, stiffness = (np.array(item, dtype=float).ravel() for item in at[:2])
        by_number = np.array(at[2], dtype=float)
        by_number[place[self.cam.pretension]] += stiffness
        by_number[place[self.cam.elements]] += pull / elements
        rows = []
        for cause, amounts in zip(self.causes, self._amounts, strict=True):
            arm, longer = self.contour.sensitivity(cause)
            row = elements * (arm * pull + arms * (stiffness * longer + amounts @ by_number))
            rows.append(self._both_strokes(row, elements * arms * pull, amounts))
        return np.array(rows).reshape(len(self.causes), len(self.wanted))

    def _both_strokes(self, row: Array, torque: Array, amounts: Array) -> Array:
        if not self.rubs:
            return row
        numbers = self.numbers[None, :]
        exponent = float(self._exponent(numbers)[0])
        change = 0.0
        for guide in self.cam.guides:
            places = [self.moved.index(name) for name in guide]
            for k in places:
                others = np.prod([self.numbers[j] for j in places if j != k])
                change += float(amounts[k] * others)
        signs = np.array([[1.0], [-1.0]])
        return np.ravel(np.exp(signs * exponent) * (row + signs * change * torque))


def made_spring(
    model: FlatModel, spring: str | None, *, target: Target, causes: Sequence[Cause], angles: int
) -> MadeSpring:
    """Return the springs that are made from a model's numbers.

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    law = elastic_law(model, spring)
    cam, grid = law.cam, np.linspace(0.0, target.last_angle, angles)
    place = {v.name: k for k, v in enumerate(model.parameters)}
    named = [name for cause in causes if isinstance(cause, NumberCause) for name, _ in cause.numbers]
    guided = [name for guide in cam.guides for name in guide]
    moved = tuple(dict.fromkeys([cam.pretension, cam.elements, *guided, *named]))
    known = [model.parameters[place[name]] for name in moved]
    stretch, numbers = ca.SX.sym("stretch"), ca.SX.sym("numbers", len(moved))
    everything = ca.SX(law.numbers)
    for k, name in enumerate(moved):
        everything[place[name]] = numbers[k]
    force = law.function.call([stretch, everything])[0]
    ranges = np.array([(v.minimum, v.maximum) for v in known])
    ranges[moved.index(cam.pretension), 0] = -np.inf  # below zero the cable is slack
    return MadeSpring(
        cam=cam,
        causes=tuple(causes),
        angles=grid,
        targets=target.torque(grid),
        importance=target.weight(grid),
        contour=made_cam(law, cam_function(model, spring), grid, causes),
        force=ca.Function("force", [stretch, numbers], [force]),
        moved=moved,
        numbers=np.array([v.start for v in known]),
        ranges=ranges,
    )
