"""What may be wrong between the commanded current and the torque, and between rubber and cam.

Each maker returns None where nothing is wrong, so that a clean bench pays nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import atan, exp

from .commands import STEP
from .effects import Hidden


def acting_current(hidden: Hidden) -> Callable[[float], float] | None:
    """Current that makes torque (A) from the one that is measured, step by step.

    delay        the current of so many steps ago: a pure transport delay
    dead zone    sign(I) ⟨|I| − zone⟩
    saturation   I_s arctan(I / I_s)
    hot winding  I / (1 + ϑ), dϑ/dt = gain I² − ϑ/τ
    drift        I (1 − rate t)
    """
    late = round(hidden.drive_delay / STEP)
    usual = late or hidden.dead_zone or hidden.saturation or hidden.winding_heat
    if not (usual or hidden.constant_drift):
        return None
    past, heat, constant = deque([0.0] * late), 0.0, 1.0
    falling = hidden.constant_drift * STEP
    zone, softening, gain = hidden.dead_zone, hidden.saturation, hidden.winding_heat
    cooling = STEP / hidden.winding_time

    def act(current: float) -> float:
        nonlocal heat, constant
        if late:
            past.append(current)
            current = past.popleft()
        if zone:
            current = max(current - zone, 0.0) + min(current + zone, 0.0)
        if softening:
            current = atan(current * softening) / softening
        if gain:
            heat += STEP * gain * current * current - cooling * heat
            current /= 1.0 + heat
        if falling:
            current *= constant
            constant -= falling
        return current

    return act


def capstan(hidden: Hidden) -> Callable[[float, float], float] | None:
    """Force of the cable at the cam (N) from that at the rubber and the extension asked for (m).

    The cable lies on a fixed guide with the wrap µα. It slips when the ratio of the forces reaches e^(±µα)
    (Euler) and sticks in between, where the guide holds it like a stiff spring: a Jenkin element whose limits
    move with the load.
    """
    if not hidden.wrap:
        return None
    most, least = exp(hidden.wrap), exp(-hidden.wrap)
    held, before = 0.0, 0.0

    def pass_on(force: float, extension: float) -> float:
        nonlocal held, before
        held += hidden.guide_stiffness * (extension - before)
        before = extension
        held = min(max(held, force * (least - 1.0)), force * (most - 1.0))
        return force + held

    return pass_on
