"""Which part of a machine plays which role, decided from its structure and never from its names.

A command that needs the series spring, the driven body or the load asks here. Where the structure leaves the
answer open, one sentence says which role was looked for, what there is, and how to name the part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

from ..foundation.errors import ArrangementError, unknown_name
from .flat import FlatModel, Plausibility, Variable
from .structure import CamNames, MotorNames, MovingBody, SpringNames

Named = TypeVar("Named")


def series_spring(model: FlatModel, name: str | None = None) -> SpringNames:
    """Return the spring between drive and load: the only one with a cam, or else the only one.

    ``name``: path of the spring; decided from the structure if it is left out.
    """
    if name is not None:
        return _named("spring", name, {spring.name: spring for spring in model.springs})
    with_cam = [spring for spring in model.springs if spring.cams]
    candidates = with_cam or list(model.springs)
    if len(candidates) == 1:
        return candidates[0]
    raise _undecided(
        model,
        "the series spring (the only spring with a cam, or else the only spring)",
        _listed("spring", [spring.name for spring in candidates], "with a cam" if with_cam else ""),
        _choice(
            [f"spring='{s.name}', or its torque '{s.effort}' (--spring {s.name})" for s in candidates],
            "tie an elastic element between two bodies",
        ),
    )


def series_cam(model: FlatModel, name: str | None = None) -> CamNames:
    """Return the cam of the series spring."""
    cams = {cam.drive: cam for spring in model.springs for cam in spring.cams}
    if name is not None:
        cams |= {spring.name: spring.cams[0] for spring in model.springs if len(spring.cams) == 1}
        return _named("cam spring", name, cams)
    if len(cams) == 1:
        return next(iter(cams.values()))
    raise _undecided(
        model,
        "the cam spring (the only cam with an element behind it)",
        _listed("cam spring", list(cams)),
        _choice(
            [f"spring='{name}' (--spring {name})" for name in cams],
            "let a spring of the deck hold a cam and the element behind it; in Python through(cam, ...)",
        ),
    )


def driven_body(model: FlatModel) -> MovingBody:
    """Return the body that the drive moves: the only one with a motor, or else the only one free to move."""
    free = [body for body in model.bodies if not body.prescribed]
    motors = [body for body in free if body.motor]
    candidates, which = (motors, "with a motor") if motors else (free, "free to move")
    if len(candidates) == 1:
        return candidates[0]
    raise _undecided(
        model,
        "the driven body (the only one with a motor, or else the only one free to move)",
        _listed("body", [body.name for body in candidates], which),
        _choice(
            [f"its motion '{body.motion}' (--measured {body.motion})" for body in candidates],
            "declare a body that moves, such as a motor",
        ),
    )


def measured_motion(model: FlatModel, name: str | None = None) -> str:
    """Return the state that is measured and swept: the motion of the driven body.

    ``name``: name of the state; decided from the structure if it is left out.
    """
    if name is None:
        return driven_body(model).motion
    states = [v.name for v in model.states]
    if name not in states:
        raise unknown_name(f"model '{model.name}': state", name, states)
    return name


def spring_torque(model: FlatModel, name: str | None = None) -> str:
    """Return the signal of the torque (or force) of the series spring.

    ``name``: name of the signal; decided from the structure if it is left out.
    """
    return series_spring(model).effort if name is None else name


def motor_of(model: FlatModel) -> tuple[MovingBody, MotorNames]:
    """Return the driven body and the motor in it."""
    body = driven_body(model)
    if body.motor is None:
        raise _undecided(
            model, "the motor", f"there is none in '{body.name}', the driven body",
            "declare it as a motor, for instance a GearedMotor",
        )  # fmt: skip
    return body, body.motor


def moved_load(model: FlatModel, name: str | None = None) -> MovingBody:
    """Return the load whose motion is prescribed: at the far end of the series spring, or else the only one.

    ``name``: path of the body; decided from the structure if it is left out.
    """
    prescribed = {body.name: body for body in model.bodies if body.prescribed}
    if name is not None:
        return _named("driven load", name, prescribed)
    with_cam = [spring for spring in model.springs if spring.cams]
    ends = {end for spring in with_cam or model.springs for end in spring.between}
    candidates = [body for body in prescribed.values() if body.name in ends] or list(prescribed.values())
    if len(candidates) == 1:
        return candidates[0]
    raise _undecided(
        model,
        "the moved load (the body with a prescribed motion at the end of the series spring)",
        _listed("body", [body.name for body in candidates], "with a prescribed motion"),
        _choice([f"load='{body.name}'" for body in candidates], "declare the load as Driven()"),
    )


def _named(kind: str, name: str, parts: dict[str, Named]) -> Named:
    if name not in parts:
        raise unknown_name(kind, name, parts)
    return parts[name]


def _undecided(model: FlatModel, role: str, present: str, next_step: str) -> ArrangementError:
    return ArrangementError(f"model '{model.name}'", f"needs {role}, but {present}", next_step=next_step)


def _listed(kind: str, names: Sequence[str], which: str = "") -> str:
    if not names:
        return f"there is no {kind} {which}".rstrip()
    plural = "bodies" if kind == "body" else f"{kind}s"
    listed = ", ".join(f"'{name}'" for name in names)
    return f"there are {len(names)} {plural} {which}".rstrip() + f": {listed}"


def _choice(examples: Sequence[str], otherwise: str) -> str:
    return f"name one, for instance {examples[0]}" if examples else otherwise


def contour_ends(model: FlatModel, spring: SpringNames | None = None) -> dict[str, float]:
    """Return the angle in rad at which each cam ends, of one spring or of all; not every cam has an end.

    A cam whose sides differ has a second one, for negative angles, as ``NAME.back``.
    """
    cams = [cam for each in ([spring] if spring else model.springs) for cam in each.cams]
    ends = {cam.name: cam.last_angle for cam in cams}
    ends |= {f"{cam.name}.back": cam.back_last_angle for cam in cams}
    return {name: model.values[end] for name, end in ends.items() if end}


_SAME_ANGLE = 1e-4
"""Relative: a design finds the end of its contour numerically, and what is said of it has four digits."""


def passed_ends(model: FlatModel, lowest: float, highest: float) -> dict[str, float]:
    """Return the ends of the cams that angles in rad lie beyond, where a model goes on and no cam does."""
    ends, passed = contour_ends(model), {}
    for name, end in ends.items():
        below = 0.0 if f"{name}.back" in ends else -lowest
        furthest = -lowest if name.endswith(".back") else max(highest, below)
        if furthest > end * (1.0 + _SAME_ANGLE):
            passed[name] = end
    return passed


class DeclaredReading(NamedTuple):
    """What is declared of the sensor that shows a motion."""

    quantum: float  # one count, 0 where none is declared
    # limits: lowest and highest reading, largest rate and stale time; None where they are not declared
    limits: tuple[float, float, float, float] | None


_LIMITS = ("lowest_reading", "highest_reading", "largest_rate", "stale_time")


def declared_reading(model: FlatModel, measured: str) -> DeclaredReading:
    """Return what the deck declares of the sensor that shows a motion."""
    for reading in model.readings:
        for sensor in reading.sensors if reading.measured == measured else ():
            names = [f"{sensor}.{name}" for name in _LIMITS]
            quantum = model.values.get(f"{sensor}.quantum", 0.0)
            if all(name in model.values for name in names):
                lowest, highest, rate, stale = (model.values[name] for name in names)
                return DeclaredReading(quantum, (lowest, highest, rate, stale))
            if quantum:
                return DeclaredReading(quantum, None)
    return DeclaredReading(0.0, None)


def with_declared_reading(variable: Variable, model: FlatModel, measured: str) -> Variable:
    """Return an input that is measured, with range and largest rate that the deck declares of its readings.

    Not the stale time: without knowing what drives the machine a sensor that is dead looks like one at rest.

    ``variable``: input of a controller or an observer; unchanged where nothing is declared.
    """
    declared = declared_reading(model, measured)
    if declared.limits is None:
        return variable
    lowest, highest, rate, _ = declared.limits
    can = Plausibility(largest_rate=rate, resolution=2.0 * declared.quantum)
    return replace(variable, minimum=lowest, maximum=highest, plausibility=can)
