"""Cable and rubber, advanced by a fixed step: history variables, elastic cable, unilateral contact.

The cam asks for the extension d; the rubber has the extension y.  Its resistance is

    R(y) = F*(y) + Σ Mᵢ(y) + Σ zⱼ(y)

    Mᵢ:  dM/dt = a kᵢ dy/dt − M/τᵢ, solved exactly for an extension that grows linearly over the step h:
         M⁺ = q M + g (y⁺ − y),  q = exp(−h/τ),  g = a k (τ/h) (1 − q)
    zⱼ:  Jenkin element, a spring in series with a dry slider:  z⁺ = clip(z + κⱼ (y⁺ − y), ±φⱼ)

The cable can only pull, with F = C ⟨d − y⟩ when it is elastic.  Each step looks for the root of the monotone

    G(y) = R(y) − C ⟨d − y⟩.

An inextensible cable is y = d as long as R(d) ≥ 0 and else, slack, R(y) = 0: the rubber relaxes on its own.
Rubber that buckles instead of pushing is y = d, no force where R(d) < 0, and never shorter than at first.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .actuators import Rubber
from .aging import Aging
from .effects import Hidden

GRID = 1.0e-5  # m, spacing of the table of F*; the knots of the rubber lie on it
LOWEST, HIGHEST = -0.01, 0.04  # m, ends of that table
SLIDERS = np.array([0.25, 0.7, 1.9, 5.0])  # yield extensions, relative
_TOLERANCE = 1.0e-9  # N

Pull = Callable[[float], tuple[float, float]]


def slider_set(force: float, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness κ (N/m) and yield force φ (N) of each of the Jenkin elements.

    All share the stiffness evenly and yield at extensions in the ratio of `SLIDERS`, so that Σκ and Σφ are
    the two arguments.
    """
    shares = np.full(SLIDERS.shape, stiffness / SLIDERS.size)
    return shares, force * SLIDERS / SLIDERS.sum()


def _equilibrium_table(rubber: Rubber, cubic: float) -> tuple[list[float], list[float], float]:
    """F* on the grid, its slope per grid cell, and the place of δ = 0 in the table."""
    origin = round(-LOWEST / GRID)
    places = (np.arange(round((HIGHEST - LOWEST) / GRID) + 1) - origin) * GRID
    force = rubber.equilibrium(places) + cubic * places**3
    return force.tolist(), np.append(np.diff(force), 0.0).tolist(), float(origin)


def pull_of(rubber: Rubber, hidden: Hidden, step: float, warmer: int = 0) -> Pull:
    """Make the stepper: extension asked for by the cam (m) → force of the cable (N), extension of the rubber.

    The rubber starts relaxed, at its natural length.  Calling the stepper advances it by `step` seconds.
    A hidden rise of temperature comes after the step number `warmer`.
    """
    value, rise, origin = _equilibrium_table(rubber, hidden.cubic)
    per_grid = 1.0 / GRID
    q1, g1 = _maxwell(rubber.shape * rubber.k, rubber.relaxation_time, step)
    q2, g2 = _maxwell(rubber.shape * hidden.branch_modulus, hidden.branch_time, step)
    sliders, aging = _Sliders(hidden), Aging(rubber, hidden, step, warmer)
    ageing = aging.present
    hysteretic = hidden.slider_force > 0.0
    rigid = bool(np.isinf(hidden.cable_stiffness))
    cable, slack = 0.0 if rigid else hidden.cable_stiffness, hidden.slack
    buckles = rubber.buckles
    x = m1 = m2 = shift = 0.0
    soft = 1.0

    def resistance(y: float) -> tuple[float, float]:
        """R and dR/dy, with the history frozen at the start of the step."""
        place = (y - shift) * per_grid + origin
        j = int(place)
        force = soft * (value[j] + (place - j) * rise[j]) + q1 * m1 + q2 * m2 + (g1 + g2) * (y - x)
        slope = soft * rise[j] * per_grid + g1 + g2
        if hysteretic:
            z, stiffness = sliders.trial(y - x)
            return force + z, slope + stiffness
        return force, slope

    def pull(asked: float) -> tuple[float, float]:
        nonlocal x, m1, m2, shift, soft
        y = asked - slack
        if buckles and y < 0.0:
            y = 0.0
        force = -1.0
        if rigid:  # the usual case: the rubber follows the cam, in line because function calls cost time
            place = (y - shift) * per_grid + origin
            j = int(place)
            force = soft * (value[j] + (place - j) * rise[j]) + q1 * m1 + q2 * m2 + (g1 + g2) * (y - x)
            if hysteretic:
                force += sliders.trial(y - x)[0]
        if force < 0.0:
            if buckles and (rigid or resistance(y)[0] < 0.0):
                force = 0.0
            else:
                d = y
                y = _root(resistance, d, cable, x)
                force = cable * max(d - y, 0.0)
        if hysteretic:
            sliders.commit()
        m1 = q1 * m1 + g1 * (y - x)
        m2 = q2 * m2 + g2 * (y - x)
        x = y
        if ageing:
            aging.advance(y, m1, m2)
            soft, shift = aging.softness, aging.set
        return force, y

    return pull


def _maxwell(stiffness: float, time: float, step: float) -> tuple[float, float]:
    """Factors q and g of a Maxwell branch (stiffness in N/m)."""
    q = float(np.exp(-step / time))
    return q, float(stiffness * time / step * -np.expm1(-step / time))


class _Sliders:
    """Parallel Jenkin elements with their forces."""

    def __init__(self, hidden: Hidden) -> None:
        stiffness, limit = slider_set(hidden.slider_force, hidden.slider_stiffness)
        self._stiffnesses, self._limits = stiffness.tolist(), limit.tolist()
        self._forces = self._tried = [0.0] * len(self._limits)

    def trial(self, increment: float) -> tuple[float, float]:
        """Force and tangent stiffness after an increment of extension that is not yet made."""
        total = tangent = 0.0
        self._tried = tried = []
        for force, stiffness, limit in zip(self._forces, self._stiffnesses, self._limits, strict=True):
            force += stiffness * increment
            if force > limit:
                force = limit
            elif force < -limit:
                force = -limit
            else:
                tangent += stiffness
            tried.append(force)
            total += force
        return total, tangent

    def commit(self) -> None:
        """Make the increment that was tried last."""
        self._forces = self._tried


def _root(resistance: Callable[[float], tuple[float, float]], d: float, cable: float, guess: float) -> float:
    """Extension y with R(y) = C ⟨d − y⟩: Newton on a piecewise linear function, kept inside a bracket."""
    low, high = LOWEST, HIGHEST
    y = guess
    for _ in range(100):
        force, slope = resistance(y)
        if y < d:
            force -= cable * (d - y)
            slope += cable
        if abs(force) < _TOLERANCE:
            return y
        if force > 0.0:
            high = y
        else:
            low = y
        y -= force / slope
        if not low < y < high:
            y = 0.5 * (low + high)
    raise RuntimeError(f"the rubber found no balance at extension {d:.6g} m: residual {force:.3g} N")
