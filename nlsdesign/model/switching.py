"""Where the equations of a flat model are not smooth, and what they are on each side."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class Switch:
    """A place at which the equations of a model are not smooth.

    Parameters
    ----------
    name
        Full name of the element or sensor.
    words
        What has happened when a mode begins: pairs of mode (−1, 0, 1) and text; a rebound is at 2.
    jumps
        Whether the derivatives jump or a rate is held there, so that the equations can only be integrated by
        a method that locates it. A mere corner costs other methods accuracy, but they get across.
    """

    name: str
    words: tuple[tuple[int, str], ...]
    jumps: bool

    def event_text(self, mode: int) -> str:
        """Return what has happened when a mode begins."""
        return dict(self.words)[mode]


@dataclass(frozen=True, eq=False)
class Switching:
    """The switches of a model and its equations while their modes do not change.

    Parameters
    ----------
    switches
        k of them.
    branch
        ``casadi.Function`` (t, x, u, p, m) -> (f, c, v): derivative with all modes held at m, for each
        switch a number that is not negative as long as its mode lasts, and the rate that it may hold.
    natural
        (t, x, u, p) -> m: the modes at a state; the equations of the flat model are those of these modes.
    landing
        (t, x, u, p, m) -> (v, target, leads, reach, slope) for the switches that hold a rate: the rate,
        shape (k,), what it is after landing, the mode that follows when it is let go, the change of all
        derivatives per effort, shape (states, k), and ∂v/∂x, shape (k, states). Zero for the others.
    holds
        For each switch whether it holds a rate.
    shown
        (t, x, u, p, m) -> (y, s): outputs and signals with all modes held at m.
    """

    switches: tuple[Switch, ...]
    branch: ca.Function
    natural: ca.Function
    landing: ca.Function
    holds: tuple[bool, ...]
    shown: ca.Function

    @property
    def jumps(self) -> tuple[str, ...]:
        """Names of the switches that only a method which locates them can integrate."""
        return tuple(s.name for s in self.switches if s.jumps)
