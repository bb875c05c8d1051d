"""Effects of the drivetrain: friction, ripple, backlash."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ...components import (
    Assembly,
    Backlash,
    CoulombFriction,
    Element,
    GearedMotor,
    Inertia,
    InertialBacklash,
    LoadFriction,
    QuadraticDrag,
    StribeckFriction,
    Through,
    Tie,
    TorqueRipple,
    TorsionSpring,
    tie,
)
from ...components.core.element import ROTATION
from ...components.mechanics.bodies import Free
from ...quantity import Quantity
from ..fitting.strategies import Continuation
from .candidate import SOURCE, Candidate, Unknown, free_name, wrapped
from .sliding import sliding_friction


def _turning(assembly: Assembly) -> list[tuple[str, str]]:
    """Return each freely turning body with the name of a torque that is typical of it."""
    ties = [(n, p) for n, p in assembly.parts if isinstance(p, Tie)]
    bodies = [n for n, p in assembly.parts if isinstance(p, Free) and p.domain == ROTATION]
    return [(b, next((f"{n}.torque" for n, p in ties if b in p.between), "")) for b in bodies]


def _has(assembly: Assembly, body: str, kind: type[Element]) -> bool:
    return any(
        isinstance(p, Tie) and body in p.between and isinstance(p.element, kind) for _, p in assembly.parts
    )


def _number(value: float, unit: str) -> Quantity:
    return Quantity(value, unit, SOURCE)


def _tied(
    assembly: Assembly, name: str, body: str, element: Element, unknowns: Callable[[str], tuple[Unknown, ...]]
) -> tuple[Assembly, tuple[Unknown, ...]]:
    part = free_name(assembly, name)
    return assembly.with_part(part, tie(element, body)), unknowns(part)


def coulomb_friction(assembly: Assembly) -> Sequence[Candidate]:
    """Dry friction on a freely turning or sliding body.

    Parameters
    ----------
    assembly
        As declared; a body that has dry friction already is left out.
    """
    found = []
    for body, torque in _turning(assembly):
        if _has(assembly, body, CoulombFriction):
            continue
        element = CoulombFriction(sliding_torque=_number(0.01, "N*m"))
        edited, unknowns = _tied(
            assembly,
            "dry_friction",
            body,
            element,
            _sliding(torque),
        )
        found.append(
            Candidate(
                "coulomb_friction",
                body,
                edited,
                unknowns,
                "a constant torque against the motion, that jumps where the speed changes sign",
                "Coulomb 1785; Armstrong-Hélouvry 1991",
            )
        )
    return [*found, *sliding_friction(assembly)]


def stribeck_friction(assembly: Assembly) -> Sequence[Candidate]:
    """Dry friction that falls with speed, on a freely turning body.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for body, torque in _turning(assembly):
        if _has(assembly, body, CoulombFriction):
            continue
        element = StribeckFriction(
            sliding_torque=_number(0.01, "N*m"),
            breakaway=_number(0.01, "N*m"),
            stribeck_speed=_number(0.2, "rad/s"),
        )
        edited, unknowns = _tied(
            assembly,
            "dry_friction",
            body,
            element,
            _stribeck(torque),
        )
        found.append(
            Candidate(
                "stribeck_friction",
                body,
                edited,
                unknowns,
                "a torque against the motion that is largest just off standstill",
                "Stribeck 1902; Armstrong-Hélouvry 1991",
            )
        )
    return found


def quadratic_drag(assembly: Assembly) -> Sequence[Candidate]:
    """Drag that grows with the square of the speed, on a freely turning body.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for body, _ in _turning(assembly):
        if _has(assembly, body, QuadraticDrag):
            continue
        element = QuadraticDrag(drag=_number(1e-3, "N*m*s^2/rad^2"))
        edited, unknowns = _tied(
            assembly, "drag", body, element, lambda part: (Unknown(f"{part}.drag", (1e-3,), 1e-7, 10.0),)
        )
        found.append(
            Candidate(
                "quadratic_drag",
                body,
                edited,
                unknowns,
                "a torque against the motion that grows with the square of the speed",
                "Newton 1687, book II; Batchelor 1967",
            )
        )
    return found


def torque_ripple(assembly: Assembly) -> Sequence[Candidate]:
    """A torque locked to the angle of a freely turning body, such as cogging.

    Parameters
    ----------
    assembly
        As declared.
    """
    orders = tuple(float(n) for n in range(4, 121, 2))
    found = []
    for body, torque in _turning(assembly):
        element = TorqueRipple(sine=_number(0.0, "N*m"), cosine=_number(0.0, "N*m"), order=_number(1.0, "1"))
        edited, unknowns = _tied(
            assembly,
            "ripple",
            body,
            element,
            _ripple(torque, orders),
        )
        found.append(
            Candidate(
                "torque_ripple",
                body,
                edited,
                unknowns,
                "a torque that repeats over the angle, the same forward and backward, at any speed",
                "Hanselman 2003",
            )
        )
    return found


def load_dependent_friction(assembly: Assembly) -> Sequence[Candidate]:
    """Friction in proportion to the torque that a spring puts on its drive.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for name in _springs(assembly, LoadFriction):
        edited = wrapped(
            assembly, name, "driven", lambda n, e: LoadFriction(members=((n, e),), ratio=_number(0.01, "1"))
        )
        found.append(
            Candidate(
                "load_dependent_friction",
                name,
                edited,
                (Unknown(f"{name}.ratio", (0.05,), 1e-4, 0.9),),
                "a torque against the motion in proportion to the load",
                "Coulomb 1785; Niemann and Winter 2003 (efficiency of gears)",
            )
        )
    return found


def _springs(assembly: Assembly, wrapper: type[Element]) -> list[str]:
    """Return ties of angle and torque that hold a spring and are not wrapped in this way already."""
    found = []
    for name, part in assembly.parts:
        if (
            isinstance(part, Tie)
            and part.element.domain == ROTATION
            and not isinstance(part.element, wrapper)
        ):
            inside = [p for path, p in assembly.walk() if path == name or path.startswith(f"{name}.")]
            if any(
                isinstance(p.element if isinstance(p, Tie) else p, Through | TorsionSpring) for p in inside
            ):
                found.append(name)
    return found


def backlash(assembly: Assembly) -> Sequence[Candidate]:
    """Play between a freely turning body and a spring tied to it, with part of the inertia behind the play.

    Parameters
    ----------
    assembly
        As declared. Where the body's inertia is declared as a whole, a tenth of it is put behind the play at
        first, and its spread allows for any share up to a third.
    """
    found = []
    for name in _springs(assembly, InertialBacklash):
        drivers = [b for b in _ends(assembly, name) if isinstance(assembly[b], GearedMotor | Inertia)]
        if not drivers:
            continue
        driver = drivers[0]
        whole = assembly.quantities()[f"{driver}.inertia"]
        own = replace(whole.with_value(0.9 * whole.number, whole.source), spread=max(whole.spread, 0.15))
        behind = Quantity(0.1 * whole.number, "kg*m^2", SOURCE)
        edited = wrapped(assembly, name, "behind_play", _loose(behind)).with_values(
            {f"{driver}.inertia": own}
        )
        found.append(
            Candidate(
                "backlash",
                name,
                edited,
                (
                    Unknown(f"{name}.gap", (0.01, 0.05), 5e-4, 0.3),
                    Unknown(f"{name}.inertia", (0.1 * whole.number,), 1e-3 * whole.number, whole.number),
                ),
                "a dead angle around zero, on both sides alike, and shocks where the load changes sign",
                "Nordin and Gutman 2002",
                # In slow motion the inertia behind the backlash hardly shows.
                Continuation(through=wrapped(assembly, name, "behind_play", _massless)),
            )
        )
    return found


def _massless(name: str, element: Element) -> Element:
    return Backlash(members=((name, element),), gap=_number(0.01, "rad"))


def _ends(assembly: Assembly, name: str) -> tuple[str, ...]:
    part = assembly[name]
    return part.between if isinstance(part, Tie) else ()


def _loose(inertia: Quantity) -> Callable[[str, Element], Element]:
    return lambda name, element: InertialBacklash(
        members=((name, element),), gap=_number(0.01, "rad"), inertia=inertia
    )


def _sliding(of: str) -> Callable[[str], tuple[Unknown, ...]]:
    return lambda part: (Unknown(f"{part}.sliding_torque", (0.05,), 1e-4, 2.0, of),)


def _stribeck(of: str) -> Callable[[str], tuple[Unknown, ...]]:
    return lambda part: (
        Unknown(f"{part}.sliding_torque", (0.05,), 1e-4, 2.0, of),
        Unknown(f"{part}.breakaway", (0.05,), 1e-4, 2.0, of),
        Unknown(f"{part}.stribeck_speed", (0.1, 0.5), 0.02, 5.0),
    )


def _ripple(of: str, orders: tuple[float, ...]) -> Callable[[str], tuple[Unknown, ...]]:
    return lambda part: (
        Unknown(f"{part}.sine", (0.0,), -2.0, 2.0, of),
        Unknown(f"{part}.cosine", (0.0,), -2.0, 2.0, of),
        Unknown(f"{part}.order", orders, 2.0, 150.0),
    )
