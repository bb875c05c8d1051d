"""The closed-form cam: energy equality gives extension, force and lever arm angle by angle.

    N·U(e₀ + δ(θ)) − N·U(e₀) = ∫₀^θ τ dθ,        h(θ) = dδ/dθ = τ(θ) / (N·F(e₀ + δ))

with U = ∫F de of one elastic element in equilibrium, N equal elements and the pretension e₀. It knows no
limits and no convexity: it is what every optimised cam is measured against. At angle zero

    e₀ = 0:  h(0+) = √(τ'(0)/(N·K₀)), a jump, for a cable through the centre has no lever arm at zero;
    e₀ > 0:  h(0) = 0 and τ'(0) = N·F₀·h'(0).

Source: Schepelmann et al. 2014; virtual work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError, ValueRangeError
from ..curves.target import Target
from .equilibrium import ElasticLaw

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_CELLS = 600
_LONGEST = 100.0
"""Largest extension in m that is looked at before the rubber is said to be too weak."""
_JUST_ABOVE = 1e-12
"""Extension in m."""


@dataclass(frozen=True, eq=False)
class CamProfile:
    """Lever arm over the angle and what the elements do meanwhile; arrays of shape (n,), in SI."""

    angles: Array
    extensions: Array
    lever_arms: Array
    forces: Array
    torques: Array
    elements: float
    pretension: float

    def __str__(self) -> str:
        return (
            f"closed-form profile to {np.degrees(self.angles[-1]):.4g} deg: lever arm "
            f"{1e3 * self.lever_arms[0]:.4g} to {1e3 * self.lever_arms[-1]:.4g} mm, extension "
            f"{1e3 * self.pretension:.4g} to {1e3 * (self.pretension + self.extensions[-1]):.4g} mm, force "
            f"{self.forces[0]:.4g} to {self.forces[-1]:.4g} N in each of {self.elements:g} elements"
        )


def closed_form(
    law: ElasticLaw, target: Target, *, elements: float, pretension: float = 0.0, points: int = 401
) -> CamProfile:
    """Return the closed-form cam for an elastic law."""
    if points < 3:
        raise ValueRangeError(f"points = {points}", "a profile needs at least three angles")
    angles = np.linspace(0.0, target.last_angle, points)
    torques = target.torque(angles)
    energies = target.energy(angles) / elements
    grid, stored = _stored(law, float(np.max(energies)), pretension)
    cell = np.clip(np.searchsorted(stored, energies, side="right") - 1, 0, len(grid) - 2)
    low, high = grid[cell], grid[cell + 1]
    rest = energies - stored[cell]
    extensions = low + (high - low) * rest / (stored[cell + 1] - stored[cell])
    for _ in range(40):
        missing = rest - _work(law, pretension + low, pretension + extensions)
        force = law.force(pretension + extensions)
        step = np.divide(missing, force, out=np.zeros_like(missing), where=force > 0.0)
        extensions = np.clip(extensions + step, low, high)
        if np.all(np.abs(step) <= 1e-15 * grid[-1]):
            break
    forces = law.force(pretension + extensions)
    lever_arms = np.empty(points)
    lever_arms[0] = _first_lever_arm(law, target, elements, pretension)
    lever_arms[1:] = torques[1:] / (elements * forces[1:])
    return CamProfile(angles, extensions, lever_arms, forces, torques, elements, pretension)


def _first_lever_arm(law: ElasticLaw, target: Target, elements: float, pretension: float) -> float:
    slope = target.initial_stiffness
    if float(law.force(pretension)) > 0.0 or slope < 1e-12 * target.largest:
        return 0.0
    stiffness = float(law.stiffness(pretension + _JUST_ABOVE))  # from above: laws may have a knot at zero
    if not stiffness > 0.0:
        raise InfeasibleError(
            f"'{law.element}' at angle zero", "has neither force nor stiffness, as the target's slope needs",
            next_step="give it pretension, or a target whose slope starts at zero",
        )  # fmt: skip
    # A law whose slope is infinite at zero extension needs no jump.
    return float(np.sqrt(slope / (elements * stiffness))) if np.isfinite(stiffness) else 0.0


def _work(law: ElasticLaw, start: Array, end: Array) -> Array:
    """Return ∫F de between pairs of extensions by Gauss's rule with eight points."""
    half = (end - start)[..., None] / 2
    places = start[..., None] + half * (1.0 + _GAUSS)
    result: Array = (law.force(places) * _WEIGHTS * half).sum(axis=-1)
    return result


def _stored(law: ElasticLaw, needed: float, pretension: float) -> tuple[Array, Array]:
    longest = 1e-3
    while longest < _LONGEST:
        # A few cells tell that a length is far too short.
        for cells in (_CELLS // 20, _CELLS):
            grid = longest * np.linspace(0.0, 1.0, cells + 1) ** 2
            gains = _work(law, pretension + grid[:-1], pretension + grid[1:])
            if np.sum(gains) < 0.9 * needed:
                break
        if not np.all(gains > 0.0):
            break
        stored = np.concatenate([[0.0], np.cumsum(gains)])
        if stored[-1] >= needed:
            return grid, stored
        longest *= 1.5
    raise InfeasibleError(
        f"'{law.element}'",
        f"cannot store the {needed:.4g} J that the target asks of each element",
        next_step="take more rubber, or a smaller torque or angle",
    )
