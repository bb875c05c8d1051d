"""Two bodies and what connects them, advanced by impulses: the plant behind the machines of `kinds`.

    J₁ dv₁/dt = E − b₁ v₁ − c₁ v₁|v₁| − ripple − twist − friction₁
    J₂ dv₂/dt = twist − b₂ v₂ − W sin(x₂ − x₀) − friction₂
    twist = K ⟨x₁ − x₂⟩ + D (v₁ − v₂),   with ⟨ ⟩ zero within half a gap

Positions are in rad or m. Where J₂ is zero both are one body; a tail is a share of J₂ behind a spring of its
own. Each step goes half the way, finds the impulse,
goes the other half (Moreau's midpoint rule); friction is set-valued, v⁺ = prox(v_free), so a body that sticks
has exactly zero speed. Errors fall with the square of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf, exp, pi, sin, sqrt

from .bench import plain, prox

STEP = 1.0e-4  # s


@dataclass(frozen=True)
class Plant:
    """Numbers of the two bodies, reflected to the output."""

    inertia: float  # kg·m² or kg, of the driven body; of everything where there is no second one
    effort_per_ampere: float  # N·m/A, N/V
    damping: float  # N·m·s/rad or N·s/m
    load_inertia: float = 0.0
    load_damping: float = 0.0
    stiffness: float = 0.0  # N·m/rad
    spring_damping: float = 0.0  # N·m·s/rad
    weight: float = 0.0  # N·m, of an arm held level; acts on the second body
    hanging_angle: float = 0.0  # rad
    gear_ratio: float = 1.0


@dataclass(frozen=True)
class Missing:
    """What the plant has and its makers do not declare; everything vanishes at the value given here."""

    friction: float = 0.0  # N·m or N, Coulomb's, of the driven body
    breakaway: float = 0.0  # in excess of it
    stribeck_speed: float = 1.0
    load_friction: float = 0.0  # share of what the gear carries
    place_friction: float = 0.0  # comes round once per turn
    place_phase: float = 0.0
    joint_friction: float = 0.0  # Coulomb's, of the second body
    drag: float = 0.0  # N·m·s²/rad²
    ripple: float = 0.0
    ripple_order: float = 1.0  # per rad, or per m
    ripple_phase: float = 0.0
    gap: float = 0.0
    soft_centre: float = 0.0  # share of the stiffness that the middle lacks
    soft_width: float = 1.0  # rad
    stiffness_wave: float = 0.0  # share by which the stiffness changes over the angle of the driven body
    wave_phase: float = 0.0
    drive_delay: float = 0.0  # s, beyond the hold
    saturation: float = 0.0  # 1/A: I' = arctan(s I)/s
    dead_zone: float = 0.0  # A
    current_bias: float = 0.0  # A, of the reading
    constant_effort: float = 0.0
    eccentricity: float = 0.0  # rad, of the encoder that the machine names
    disc_phase: float = 0.0
    encoder_bias: float = 0.0  # rad, of the joint's encoder
    encoder_delay: float = 0.0  # s, of the joint's encoder
    disturbance: float = 0.0
    disturbance_frequency: float = 1.0  # Hz
    disturbance_phase: float = 0.0
    push: float = 0.0
    push_place: float = 0.5
    push_time: float = 0.3  # s
    payload: float = 0.0  # N·m, comes on halfway through a record
    tail_share: float = 0.0  # of the inertia of the second body, behind a spring
    tail_frequency: float = 1.0  # Hz, of the tail while the second body is held; damped by 0.04
    stop: float = 0.0  # N·m/rad²: a soft stop beyond `stop_place`
    stop_place: float = 0.0


class TwoBodies:
    """The plant in time: `advance` takes the effort of each step, and the state is there to be read."""

    def __init__(self, plant: Plant, missing: Missing, step: float = STEP) -> None:
        self.plant, self.missing, self.step = plain(plant), plain(missing), step
        self.place = self.load_place = self.plant.hanging_angle
        self.speed = self.load_speed = 0.0
        self.tail_place, self.tail_speed = self.load_place, 0.0

    def twist(self, lead: float, place: float) -> tuple[float, float]:
        """Elastic effort of the connection on the second body, and its damping."""
        plant, missing = self.plant, self.missing
        if missing.gap:
            half = 0.5 * missing.gap
            if abs(lead) <= half:
                return 0.0, 0.0
            lead = lead - half if lead > 0.0 else lead + half
        stiffness = plant.stiffness
        if missing.soft_centre:  # the integral of a stiffness that lacks a share s·exp(−(x/w)²)
            width = missing.soft_width
            lead -= missing.soft_centre * 0.5 * sqrt(pi) * width * erf(lead / width)
        if missing.stiffness_wave:
            stiffness *= 1.0 + missing.stiffness_wave * sin(2.0 * place + missing.wave_phase)
        return stiffness * lead, plant.spring_damping

    def level(self, speed: float, place: float, carried: float) -> float:
        """Level of dry friction of the driven body."""
        missing = self.missing
        total = missing.friction + missing.load_friction * abs(carried)
        if missing.breakaway:
            total += missing.breakaway * exp(-((speed / missing.stribeck_speed) ** 2))
        if missing.place_friction:
            total += missing.place_friction * (1.0 + 0.8 * sin(2.0 * place + missing.place_phase))
        return total

    def advance(self, efforts: Sequence[float], payload: float = 0.0) -> None:
        """Go on by one step for each effort on the driven body; a payload is a weight of the second."""
        if self.plant.load_inertia:
            self._advance_both(efforts, payload)
        else:
            self._advance_one(efforts, payload)

    def _tail(self, place: float, speed: float, turn: float) -> float:
        """Go on by one step with the tail; return what a kilogram of it does to its body."""
        middle = self.tail_place + 0.5 * self.step * self.tail_speed
        pull = turn * turn * (middle - place) + 0.08 * turn * (self.tail_speed - speed)
        self.tail_speed -= self.step * pull
        self.tail_place = middle + 0.5 * self.step * self.tail_speed
        return pull

    def _own(self, place: float, speed: float) -> float:
        """What acts on the driven body by its own place and speed, but for viscous and dry friction."""
        missing = self.missing
        effort = 0.0
        if missing.ripple:
            effort -= missing.ripple * sin(missing.ripple_order * place + missing.ripple_phase)
        if missing.drag:
            effort -= missing.drag * speed * abs(speed)
        if missing.stop and abs(place) > missing.stop_place:
            way = abs(place) - missing.stop_place
            effort -= missing.stop * way * way if place > 0.0 else -missing.stop * way * way
        return effort

    def _advance_one(self, efforts: Sequence[float], payload: float) -> None:
        plant, step = self.plant, self.step
        inertia, half = plant.inertia, 0.5 * step
        drag = half * plant.damping / inertia
        weight, hanging = plant.weight + payload, plant.hanging_angle
        plain = not (self.missing.ripple or self.missing.drag or self.missing.stop)
        place, speed = self.place, self.speed
        for effort in efforts:
            place += half * speed
            load = weight * sin(place - hanging) if weight else 0.0
            push = effort - load if plain else effort - load + self._own(place, speed)
            free = ((1.0 - drag) * speed + step * push / inertia) / (1.0 + drag)
            speed = prox(free, step * self.level(speed, place, load) / inertia)
            place += half * speed
        self.place, self.speed = place, speed
        self.load_place, self.load_speed = place, speed

    def _advance_both(self, efforts: Sequence[float], payload: float) -> None:
        plant, step = self.plant, self.step
        inertia, half = plant.inertia, 0.5 * step
        tail = self.missing.tail_share * plant.load_inertia
        load_inertia = plant.load_inertia - tail
        turn = 2.0 * pi * self.missing.tail_frequency
        drag, load_drag = half * plant.damping / inertia, half * plant.load_damping / load_inertia
        mobility = 1.0 / (inertia * (1.0 + drag)) + 1.0 / (load_inertia * (1.0 + load_drag))
        weight, hanging = plant.weight + payload, plant.hanging_angle
        joint_friction = step * self.missing.joint_friction / load_inertia
        plain = not (self.missing.ripple or self.missing.drag or self.missing.stop)
        place, speed, load_place, load_speed = self.place, self.speed, self.load_place, self.load_speed
        for effort in efforts:
            place += half * speed
            load_place += half * load_speed
            twist, damping = self.twist(place - load_place, place)
            push = effort - twist if plain else effort - twist + self._own(place, speed)
            free = ((1.0 - drag) * speed + step * push / inertia) / (1.0 + drag)
            pull = twist - (weight * sin(load_place - hanging) if weight else 0.0)
            if tail:
                pull += tail * self._tail(load_place, load_speed, turn)
            load_free = ((1.0 - load_drag) * load_speed + step * pull / load_inertia) / (1.0 + load_drag)
            # The damper acts by the mean of its rate before and after the step, which it changes itself.
            rate, coupled = speed - load_speed, half * damping
            impulse = coupled * (rate + free - load_free) / (1.0 + coupled * mobility)
            free -= impulse / (inertia * (1.0 + drag))
            load_free += impulse / (load_inertia * (1.0 + load_drag))
            carried = twist + damping * rate
            speed = prox(free, step * self.level(speed, place, carried) / inertia)
            load_speed = prox(load_free, joint_friction) if joint_friction else load_free
            place += half * speed
            load_place += half * load_speed
        self.place, self.speed, self.load_place, self.load_speed = place, speed, load_place, load_speed
