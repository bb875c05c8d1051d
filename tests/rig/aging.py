"""Rubber that remembers how far, how long and how hard it was stretched: softening, set, heat.

Each law is a number that is advanced by the fixed step after the balance of forces; the balance of the next
step sees F* as  softness · F*(y − set).

    softening   1 − s ⟨1 − y / y_max⟩ with y_max the largest extension so far (linear in the extension; virgin
                rubber and rubber beyond y_max are untouched)
    set         s · y_max, at once
    heat        dϑ/dt = gain · (M₁²/(a η) + M₂²/(a η₂)) − ϑ/τ,  softness 1/(1 + ϑ)
    warmer      softness 1 − s from a moment on
"""

from __future__ import annotations

from .actuators import Rubber
from .effects import Hidden


class Aging:
    """Softness and set of one piece of rubber, which starts virgin and cold."""

    def __init__(self, rubber: Rubber, hidden: Hidden, step: float, warmer: int = 0) -> None:
        self._hidden, self._step, self._left = hidden, step, warmer
        self._loss = 1.0 / (rubber.shape * rubber.eta)
        second = hidden.branch_modulus * hidden.branch_time
        self._second_loss = 1.0 / (rubber.shape * second) if second else 0.0
        self._largest = self._heat = 0.0
        self.softness, self.set = 1.0, 0.0

    @property
    def present(self) -> bool:
        """Whether anything ages at all."""
        hidden = self._hidden
        return bool(hidden.softening or hidden.permanent_set or hidden.heating or hidden.cold)

    def advance(self, extension: float, memory: float, second: float) -> None:
        """Take note of an extension (m) and the forces of both Maxwell branches (N)."""
        hidden = self._hidden
        if extension > self._largest:
            self._largest = extension
        softness = 1.0
        if hidden.softening and self._largest > 0.0:
            softness -= hidden.softening * (1.0 - max(extension, 0.0) / self._largest)
        if hidden.heating:
            power = self._loss * memory * memory + self._second_loss * second * second
            self._heat += self._step * (hidden.heating * power - self._heat / hidden.cooling_time)
            softness /= 1.0 + self._heat
        if hidden.cold:
            self._left -= 1
            if self._left < 0:
                softness *= 1.0 - hidden.cold
        self.softness, self.set = softness, hidden.permanent_set * self._largest
