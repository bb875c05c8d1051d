"""Event location: a step ends where the model is not smooth and continues with the next equations.

Between events the modes of all switches are constant, so each step has smooth equations. For each switch the
model gives an event function that is not negative while its mode lasts; it is evaluated in the middle and at
the end of each step. Where one is negative, the step is repeated with shorter lengths until the time of the
event is known.
Source: Shampine and Thompson 2000; Pfeiffer and Glocker 1996 (laws that hold a rate).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError
from ..model import FlatModel
from ..model.flat import Switch, Switching
from .buffered import Buffered

LOCATED = 1e-12
"""Accuracy of an event time, as a share of the sample interval; at best four units in the last place."""

REBOUND = 2
"""Mode number under which a rebound is recorded."""
MOST_AT_ONCE = 40
"""Largest number of mode changes at one time."""
MOST_DRIFT = 1e-6
"""Largest change of a constrained rate in one step, relative to the nominal size."""

MOST_EVENTS, EVENT_WINDOW = 200, 1e-7
"""This number of events within this share of the simulated time counts as accumulation (Zeno)."""


@dataclass(frozen=True)
class Event:
    """A change of mode at a point in time."""

    time: float
    name: str
    what: str

    def __str__(self) -> str:
        return f"{self.time:.9g} s: {self.name} {self.what}"


def locate_event(lasts: Callable[[float], float], length: float, finest: float) -> float:
    """Return the shortest known step length at which a mode has ended.

    Source: Chandrupatla 1997, bracketing with inverse quadratic interpolation where that is safe.

    ``lasts``: event function of the step length, not negative while all modes last. Its last call has the
    result.
    """
    # At length zero a mode may just have changed, so the event function is not evaluated there.
    one, at_one, other, at_other = length, lasts(length), 0.0, np.inf
    share, last = 0.5, length
    while abs(other - one) > finest:
        least = finest / (2 * abs(other - one))
        last = one + min(max(share, least), 1.0 - least) * (other - one)
        value = lasts(last)
        if (value < 0.0) == (at_one < 0.0):
            third, at_third = one, at_one
        else:
            third, at_third, other, at_other = other, at_other, one, at_one
        one, at_one = last, value
        share = _share(one, at_one, other, at_other, third, at_third)
    ended = one if at_one < 0.0 else other
    if last != ended:
        lasts(ended)
    return ended


def _share(one: float, at_one: float, other: float, at_other: float, third: float, at_third: float) -> float:
    """Return the next point in the bracket, as a share of its width."""
    if at_third in (at_one, at_other) or not (math.isfinite(at_other) and math.isfinite(at_third)):
        return 0.5
    place, value = (one - other) / (third - other), (at_one - at_other) / (at_third - at_other)
    if value**2 >= place or (1.0 - value) ** 2 >= 1.0 - place:
        return 0.5
    first = at_one / (at_other - at_one) * at_third / (at_other - at_third)
    second = at_one / (at_third - at_one) * at_other / (at_third - at_other)
    return first + (third - one) / (other - one) * second


class EventLog:
    """The events so far; raises an error where they accumulate.

    ``switches``: in the order of their numbers.
    """

    def __init__(self, model: str, switches: Sequence[Switch], span: float) -> None:
        self._model, self._switches, self._window = model, switches, EVENT_WINDOW * span
        self._recent: deque[float] = deque(maxlen=MOST_EVENTS)
        self.events: list[Event] = []

    def record(self, time: float, i: int, mode: int) -> None:
        """Record that a mode of a switch has begun."""
        switch = self._switches[i]
        self.events.append(Event(time, switch.name, dict(switch.words)[mode]))
        self._recent.append(time)
        if len(self._recent) == MOST_EVENTS and time - self._recent[0] < self._window:
            raise self.accumulation(i, time)

    def accumulation(self, i: int, time: float) -> ConvergenceError:
        """Return the error for events that accumulate."""
        return ConvergenceError(
            f"simulation of {self._model}",
            f"events of '{self._switches[i].name}' accumulate at t = {time:g} s",
            next_step="give a stop a speed below which it rests, or take the smooth form of the law",
        )

    def drift(self, i: int, time: float) -> ConvergenceError:
        """Return the error for a rate that should stay constant and does not."""
        return ConvergenceError(
            f"simulation of {self._model}",
            f"'{self._switches[i].name}' sticks, but its rate has changed by t = {time:g} s",
            next_step="give the acceleration of the driven body as an input too",
        )


class Modes:
    """The modes of all switches, their changes and the events."""

    def __init__(self, model: FlatModel, span: float) -> None:
        if model.switching is None:
            raise ValueError("the model has no switches")
        self._laws = model.switching
        laws, n = self._laws, len(model.states)
        self._time, self._state, self._inputs = np.zeros(1), np.zeros(n), np.zeros(len(model.inputs))
        self.now = np.zeros(len(laws.switches))
        self.numbers = model.start(model.parameters)
        given = (self._time, self._state, self._inputs, self.numbers)
        self._branch, self._natural = Buffered(laws.branch, (*given, self.now)), Buffered(laws.natural, given)
        self._land = Buffered(laws.landing, (*given, self.now))
        self._nominal = np.array([v.nominal for v in model.states])
        self.log = EventLog(model.name, laws.switches, span)
        self.held = np.zeros(0, dtype=int)

    @property
    def jump(self) -> bool:
        """Whether the equations are discontinuous at a switch."""
        return bool(self._laws.jumps)

    def begin(self, time: float, state: Array, inputs: Array) -> None:
        """Set the modes that belong to a state, which must lie within all stops."""
        self.now[:] = self._at(self._natural, time, state, inputs)[0]
        self.settle(time, state, inputs, record=False)

    def settle(self, time: float, state: Array, inputs: Array, *, record: bool = True) -> None:
        """Change the modes that have ended, and the state where it jumps, until no mode ends.

        ``time``, ``state``, ``inputs``: at the event; the state is changed in place.
        """
        before = self.now.copy()
        rebounds: list[int] = []
        for _ in range(MOST_AT_ONCE):
            ended = np.flatnonzero(self._lasts(time, state, inputs) < 0.0)
            if not len(ended):
                break
            for i in ended.tolist():
                rebounds += self._changed(i, time, state, inputs)
        else:
            raise self.log.accumulation(int(ended[0]), time)
        self.held = np.flatnonzero((self.now == 0.0) & np.array(self._laws.holds))
        self.keep(time, state, inputs)
        if record:
            for i in rebounds:
                self.log.record(time, i, REBOUND)
            for i, (old, new) in enumerate(zip(before.tolist(), self.now.tolist(), strict=True)):
                if old != new:
                    self.log.record(time, i, int(new))

    def keep(self, time: float, state: Array, inputs: Array) -> None:
        """Set the constrained rates to exactly zero, without changing any momentum."""
        if not len(self.held):
            return
        rate, _, _, reach, slope = self._landing(time, state, inputs)
        held = self.held
        if np.any(rate[held]):
            change = np.linalg.solve(slope[held] @ reach[:, held], -rate[held])
            state += reach[:, held] @ change
            if np.max(np.abs(reach[:, held] @ change) / self._nominal) > MOST_DRIFT:
                raise self.log.drift(int(held[0]), time)
            for i in held.tolist():
                # The remaining rounding error.
                left = self._landing(time, state, inputs)[0][i]
                first = int(np.argmax(np.abs(slope[i])))
                state[first] -= left / slope[i, first]

    def _changed(self, i: int, time: float, state: Array, inputs: Array) -> list[int]:
        """Change one mode that has ended; return its number if it has rebounded."""
        if not self._laws.holds[i]:
            self.now[i] = -self.now[i]
            return []
        rate, target, leads, reach, slope = self._landing(time, state, inputs)
        if self.now[i] == 0.0:
            self.now[i] = leads[i]
            return []
        impulse = (target[i] - rate[i]) / (slope[i] @ reach[:, i])
        state += reach[:, i] * impulse
        if target[i] != 0.0:
            self._others_after_impact(i, time, state, inputs)
            return [i]
        if abs(rate[i]) > 1e-9:
            self._others_after_impact(i, time, state, inputs)
        first = int(np.argmax(np.abs(slope[i])))
        state[first] -= self._landing(time, state, inputs)[0][i] / slope[i, first]
        self.now[i] = 0.0
        if self._lasts(time, state, inputs)[i] < 0.0:
            self.now[i] = self._landing(time, state, inputs)[2][i]
        return []

    def _others_after_impact(self, i: int, time: float, state: Array, inputs: Array) -> None:
        natural = self._at(self._natural, time, state, inputs)[0]
        others = np.array(self._laws.holds) & (np.arange(len(self.now)) != i)
        self.now[others] = natural[others]

    def _at(self, function: Buffered, time: float, state: Array, inputs: Array) -> tuple[Array, ...]:
        self._time[0], self._state[:], self._inputs[:] = time, state, inputs
        function.evaluate()
        return function.results

    def _lasts(self, time: float, state: Array, inputs: Array) -> Array:
        return self._at(self._branch, time, state, inputs)[1]

    def _landing(self, time: float, state: Array, inputs: Array) -> tuple[Array, ...]:
        rate, target, leads, reach, slope = (r.copy() for r in self._at(self._land, time, state, inputs))
        n, k = len(state), len(rate)
        return rate, target, leads, reach.reshape((n, k), order="F"), slope.reshape((k, n), order="F")


def branch_of(switching: Switching | None, equations: ca.Function) -> ca.Function:
    """Return (t, x, u, p, m) -> (f, c, v) of a model; m, c and v are empty where it has no switches."""
    if switching is not None:
        return switching.branch
    given = [ca.SX.sym(name, equations.size1_in(i)) for i, name in enumerate("txup")]
    rate = equations.call([*given, ca.SX(0, 1)])[0]
    return ca.Function("branch", [*given, ca.SX.sym("m", 0)], [rate, ca.SX(0, 1), ca.SX(0, 1)])
