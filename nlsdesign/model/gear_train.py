"""Bodies that move together: one state pair for all bodies that rigid gears, racks and screws join.

With the acceleration α of the leading body, what each gear carries follows from the bodies behind it, so the
balance of the leading body is one rising equation for α: linear where no gear has a loss, piecewise linear
otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import casadi as ca

from ..components.assembly.named_parts import Assembly
from ..components.core.element import Scope
from ..components.mechanics.bodies import Free, Motion
from ..components.mechanics.gear import LossyGear, Transmission
from ..components.transmission.stretchy_cable import newton_root
from ..foundation.symbolic import Expression, depends, solve_monotone, symbol


@dataclass(frozen=True)
class Joint:
    """A gear of a train and what is behind it, seen from the leading body.

    ``outward`` tells whether the gear's second body is the one behind.
    """

    name: str
    gear: Transmission
    outward: bool
    behind: Wheel


@dataclass(frozen=True)
class Wheel:
    """A body of a train and the gears that lead on from it."""

    name: str
    body: Free
    joints: list[Joint] = field(default_factory=list)

    def wheels(self) -> Iterator[Wheel]:
        """Yield this wheel and all behind it."""
        yield self
        for joint in self.joints:
            yield from joint.behind.wheels()

    def gears(self) -> Iterator[tuple[Wheel, Joint]]:
        """Yield every gear of the train with the wheel in front of it, nearest first."""
        for joint in self.joints:
            yield self, joint
            yield from joint.behind.gears()


def trains(assembly: Assembly) -> dict[str, Wheel]:
    """Return each train of two or more bodies by the name of its leading body, the one written first."""
    gears = [(name, part) for name, part in assembly.parts if isinstance(part, Transmission)]
    leading: dict[str, Wheel] = {}
    taken: set[str] = set()
    for name, part in assembly.parts:
        if isinstance(part, Free) and name not in taken and any(name in g.between for _, g in gears):
            leading[name] = _wheel(assembly, name, gears, taken)
    return leading


def _wheel(assembly: Assembly, name: str, gears: list[tuple[str, Transmission]], taken: set[str]) -> Wheel:
    taken.add(name)
    body = assembly[name]
    assert isinstance(body, Free)
    wheel = Wheel(name, body)
    for label, gear in gears:
        for end, other, outward in ((0, 1, True), (1, 0, False)):
            if gear.between[end] == name and gear.between[other] not in taken:
                behind = _wheel(assembly, gear.between[other], gears, taken)
                wheel.joints.append(Joint(label, gear, outward, behind))
    return wheel


def train_motions(
    root: Wheel, scopes: Mapping[str, Scope], lead: Motion
) -> dict[str, tuple[Motion, Expression]]:
    """Return the motion of each body of a train, and its turns per turn of the leading body."""
    motions = {root.name: (lead, ca.SX(1))}
    for front, joint in root.gears():
        ratio = joint.gear.turns(scopes[joint.name])
        turns = motions[front.name][1] * (1 / ratio if joint.outward else ratio)
        motions[joint.behind.name] = Motion(turns * lead.motion, turns * lead.rate), turns
    return motions


def balance_train(
    root: Wheel,
    scopes: Mapping[str, Scope],
    motions: Mapping[str, tuple[Motion, Expression]],
    efforts: Mapping[str, Expression],
) -> None:
    """Close the equations of a train with the efforts of all elements on its bodies."""
    lead, own = motions[root.name][0], scopes[root.name]
    acting = {
        w.name: w.body.drive(scopes[w.name], motions[w.name][0]) + efforts[w.name] for w in root.wheels()
    }
    turns = {name: turn for name, (_, turn) in motions.items()}
    acceleration, carried = _solved(root, scopes, turns, acting, lead.rate)
    own.derive(lead.motion, lead.rate)
    own.derive(lead.rate, acceleration)
    moved = sum(
        (w.body.inertia_of(scopes[w.name]) * turns[w.name] ** 2 for w in root.wheels()), start=ca.SX(0)
    )
    own.signal(
        "train_inertia",
        moved,
        root.body.domain.inertia_unit,
        f"inertia of all that is geared to {root.name}, seen from there",
    )
    bodies = {w.name: w.body for w in root.wheels()}
    for name, (motion, turn) in motions.items():
        domain, (place, _) = bodies[name].domain, bodies[name].motion_names
        scopes[name].signal(place, motion.motion, domain.motion_unit, f"{place} of {name}")
        scopes[name].signal("speed", motion.rate, domain.rate_unit, f"speed of {name}")
        unit = f"{domain.rate_unit[:-2]}/s^2"
        scopes[name].signal("acceleration", turn * acceleration, unit, f"acceleration of {name}")
    for name, gear in ((joint.name, joint.gear) for _, joint in root.gears()):
        given, got = carried[name]
        first, second = (motions[end][0].rate for end in gear.between)
        gives, gets = gear.joins
        scopes[name].signal(
            f"input_{gives.effort}", given, gives.effort_unit, f"what {gear.between[0]} gives to {name}"
        )
        scopes[name].signal(gets.effort, got, gets.effort_unit, f"what {gear.between[1]} gets from {name}")
        scopes[name].signal("loss", given * first - got * second, "W", f"heat in {name}")


def _solved(
    root: Wheel,
    scopes: Mapping[str, Scope],
    turns: Mapping[str, Expression],
    acting: Mapping[str, Expression],
    speed: Expression,
) -> tuple[Expression, dict[str, tuple[Expression, Expression]]]:
    """Return the acceleration of the leading body, and what each gear takes and gives."""
    # The equation is solved in stand-ins, so that a step of the solution does not repeat the whole spring.
    stand_ins = {name: symbol(f"{name}.acting") for name in acting}
    unknown, turning = symbol(f"{root.name}.sought"), symbol(f"{root.name}.turning")
    carried: dict[str, tuple[Expression, Expression]] = {}

    def missing(wheel: Wheel) -> Expression:
        """Return the torque that a wheel lacks for its acceleration; notes what the gears behind it carry."""
        torque = wheel.body.inertia_of(scopes[wheel.name]) * turns[wheel.name] * unknown
        torque -= stand_ins[wheel.name]
        for joint in wheel.joints:
            inside = scopes[joint.name]
            ratio = joint.gear.turns(inside)
            wanted = missing(joint.behind)
            first = wheel if joint.outward else joint.behind
            pace = turns[first.name] * turning
            if joint.outward:
                given = wanted / ratio / joint.gear.share(inside, wanted / ratio, pace)
                carried[joint.name] = given, wanted
                torque += given
            else:
                given = -wanted
                got = ratio * given * joint.gear.share(inside, given, pace)
                carried[joint.name] = given, got
                torque -= got
        return torque

    lacking = missing(root)
    root_of = _root(lacking, unknown)
    rest = ca.vertcat(lacking, *[torque for pair in carried.values() for torque in pair])
    results = ca.vertcat(root_of, ca.substitute(rest, unknown, root_of))
    old, new = ca.vertcat(*stand_ins.values(), turning), ca.vertcat(*acting.values(), speed)
    acceleration, remainder, *torques = ca.vertsplit(ca.SX(ca.substitute(results, old, new)))
    if any(isinstance(joint.gear, LossyGear) for _, joint in root.gears()):
        size = sum((ca.fabs(torque) for torque in torques), start=ca.SX(1))
        scopes[root.name].check(f"{root.name}.acceleration", remainder / size)
    pairs = zip(torques[::2], torques[1::2], strict=True)
    return acceleration, dict(zip(carried, pairs, strict=True))


def _root(lacking: Expression, unknown: Expression) -> Expression:
    if depends(ca.jacobian(lacking, unknown), unknown):
        return newton_root(lacking, unknown, ca.SX(0))
    return solve_monotone(lambda z: ca.substitute(lacking, unknown, z), unknown, ca.SX(0))
