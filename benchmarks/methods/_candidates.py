"""What may act beside the declared terms, as columns of the torque balances of a case.

The list is that of textbooks on friction and drives, and of what an encoder or an ammeter may read wrongly.
It has an entry for each name that the data set can hide in the machines of its usual kinds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from scipy import signal

from benchmarks.methods._balance import Array, Balance, Candidate, Columns, Deck, Motion, slope

Shapes = Mapping[str, float]
Sides = tuple[Array, Array]
SHARP = 0.01
"""Speed over the largest one at which the sign of friction is smoothed."""


def candidates(balance: Balance) -> list[Candidate]:
    """Return what may act on the machine of a case.

    Parameters
    ----------
    balance
        Of the case.
    """
    deck, motions = balance.deck, balance.motions
    largest = {
        "speed": max(np.max(np.abs(m.speed)) for m in motions),
        "place": max(np.max(np.abs(m.place)) for m in motions),
        "bend": max(np.max(np.abs(m.acceleration)) for m in motions),
        "lead": max(np.max(np.abs(m.place - m.load_place)) for m in motions),
        "current": max(np.max(np.abs(m.current)) for m in motions),
    }
    made = list(_of_motor(deck, largest))
    if deck.load:
        made += _of_load(deck, largest)
    return made


def _motor(*columns: Array) -> Sides:
    """Return columns of the motor's balance alone."""
    both = np.column_stack(columns)
    return both, np.zeros_like(both)


def _load(*columns: Array) -> Sides:
    """Return columns of the load's balance alone."""
    both = np.column_stack(columns)
    return np.zeros_like(both), both


def _of_motor(deck: Deck, largest: Shapes) -> Iterator[Candidate]:
    part, slow = deck.motor, SHARP * largest["speed"]

    def sign(m: Motion) -> Array:
        return np.tanh(m.speed / slow)

    def friction_of_place(m: Motion, d: Deck, s: Shapes) -> Sides:
        once = 1.0 if d.turns else np.pi / largest["place"]
        waves = [f(n * once * m.place) for n in (1.0, 2.0) for f in (np.sin, np.cos)]
        return _motor(*(sign(m) * wave for wave in (1.0, *waves)))

    def stribeck(m: Motion, d: Deck, s: Shapes) -> Sides:
        return _motor(sign(m), sign(m) * np.exp(-((m.speed / s["speed"]) ** 2)))

    def load_friction(m: Motion, d: Deck, s: Shapes) -> Sides:
        return _motor(sign(m) * np.abs(m.place - m.load_place if d.load else np.sin(m.place)))

    def ripple(m: Motion, d: Deck, s: Shapes) -> Sides:
        return _motor(np.sin(s["order"] * m.place), np.cos(s["order"] * m.place))

    def saturation(m: Motion, d: Deck, s: Shapes) -> Sides:
        return _motor(d.per_ampere * (m.current - np.arctan(s["bend"] * m.current) / s["bend"]))

    def delay(m: Motion, d: Deck, s: Shapes) -> Sides:
        return _motor(d.per_ampere * (m.current - m.delayed(m.current, s["delay"])))

    yield Candidate("coulomb_friction", part, lambda m, d, s: _motor(sign(m)))
    yield Candidate(
        "stribeck_friction", part, stribeck, {"speed": (0.02 * largest["speed"], 0.5 * largest["speed"])}
    )
    if not deck.has["damping"]:
        yield Candidate("viscous_friction", part, lambda m, d, s: _motor(m.speed))
    yield Candidate("quadratic_drag", part, lambda m, d, s: _motor(m.speed * np.abs(m.speed)))
    if deck.load or deck.has["weight"]:
        yield Candidate("load_dependent_friction", part, load_friction)
    yield Candidate("position_dependent_friction", part, friction_of_place)
    orders = (3.0 / largest["place"], 200.0 / largest["place"])
    yield Candidate("torque_ripple", part, ripple, {"order": orders})
    if deck.gear_ratio > 1.0:
        yield Candidate("torque_ripple", part, lambda m, d, s: ripple(m, d, {"order": d.gear_ratio}))
    yield Candidate("current_sensor_bias", part, lambda m, d, s: _motor(np.ones_like(m.place)))
    yield Candidate("torque_constant_saturation", part, saturation,
                    {"bend": (0.1 / largest["current"], 5.0 / largest["current"])})  # fmt: skip
    yield Candidate("drive_delay", part, delay, {"delay": (5e-4, 0.05)})
    yield Candidate("drivetrain_resonance", part, _tail(load=False), {"turn": (6.0, 200.0)})
    if deck.turns and not deck.has["weight"]:
        yield Candidate("gravity_load", deck.load or part, _weight)
    if not deck.load:
        bends = (0.01 * largest["bend"], 0.5 * largest["bend"])
        yield Candidate("backlash", part, _flanks, {"bend": bends})
    if deck.turns and not deck.load:
        yield Candidate("angle_sensor_eccentricity", part, _disc_on_motor)


def _of_load(deck: Deck, largest: Shapes) -> Iterator[Candidate]:
    part, slow = str(deck.load), SHARP * largest["speed"]

    def gap(m: Motion, d: Deck, s: Shapes) -> Sides:
        inside = np.clip(m.place - m.load_place, -s["half"], s["half"])[:, None]
        return -inside, inside

    def late(m: Motion, d: Deck, s: Shapes) -> Sides:
        jerk = slope(m.load_acceleration, m.step)
        pull = d.stiffness * m.load_speed
        return -pull[:, None], (pull + d.load_inertia * jerk)[:, None]

    yield Candidate("coulomb_friction", part, lambda m, d, s: _load(np.tanh(m.load_speed / slow)))
    if not deck.has["load_damping"]:
        yield Candidate("viscous_friction", part, lambda m, d, s: _load(m.load_speed))
    yield Candidate("quadratic_drag", part, lambda m, d, s: _load(m.load_speed * np.abs(m.load_speed)))
    yield Candidate("drivetrain_resonance", part, _tail(load=True), {"turn": (6.0, 200.0)})
    yield Candidate("backlash", deck.motor, gap, {"half": (0.02 * largest["lead"], 0.5 * largest["lead"])})
    if not deck.has["spring_damping"]:
        yield Candidate("spring_damping", deck.motor, _loss)
    yield Candidate("angle_sensor_bias", part, _reads_off)
    yield Candidate("angle_sensor_delay", part, late)
    yield Candidate("angle_sensor_eccentricity", part, _disc_on_load)


def _tail(*, load: bool) -> Columns:
    """Return the pull of an inertia behind a spring, from rest, per unit of inertia; damped by 0.05."""

    def columns(m: Motion, d: Deck, s: Shapes) -> Sides:
        turn = s["turn"]
        tail = signal.bilinear([0.1 * turn, turn**2], [1.0, 0.1 * turn, turn**2], 1.0 / m.step)
        moved = signal.lfilter(*tail, m.load_acceleration if load else m.acceleration)
        return _load(moved) if load else _motor(moved)

    return columns


def _weight(m: Motion, d: Deck, s: Shapes) -> Sides:
    pull = np.sin(m.load_place), np.cos(m.load_place)
    return _load(*pull) if d.load else _motor(*pull)


def _flanks(m: Motion, d: Deck, s: Shapes) -> Sides:
    """Return a stand-in for the inertia behind a gap, which comes off where the acceleration changes sign."""
    return _motor(np.clip(m.acceleration, -s["bend"], s["bend"]))


def _disc_on_motor(m: Motion, d: Deck, s: Shapes) -> Sides:
    waves = (np.sin(m.place), np.cos(m.place))
    return _motor(*(d.inertia * slope(slope(w, m.step), m.step) for w in waves))


def _loss(m: Motion, d: Deck, s: Shapes) -> Sides:
    rate = (m.speed - m.load_speed)[:, None]
    return rate, -rate


def _reads_off(m: Motion, d: Deck, s: Shapes) -> Sides:
    twist = np.full((len(m.place), 1), d.stiffness)
    return twist, -twist


def _disc_on_load(m: Motion, d: Deck, s: Shapes) -> Sides:
    waves = d.stiffness * np.column_stack([np.sin(m.load_place), np.cos(m.load_place)])
    return waves, -waves
