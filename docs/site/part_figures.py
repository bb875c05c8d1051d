"""Figures of laws: what an element answers to a motion to and fro, and what a cam makes of an angle."""

from __future__ import annotations

import numpy as np

from nlsdesign.components import (
    MATERIAL,
    ROTATION,
    TRANSLATION,
    Cam,
    Driven,
    Element,
    Part,
    Specimen,
    Spring,
    assembly,
    specimen,
    through,
    tie,
)
from nlsdesign.model import FlatModel, flatten
from nlsdesign.presentation.figures import Figure
from nlsdesign.presentation.figures.curves import curves
from nlsdesign.simulation import simulate

_AMPLITUDES = {"rotation": 0.5, "translation": 5e-3, "material": 0.5}
_REST_LENGTH = 0.02
_SPEEDS = (0.2, 2.0)
_POINTS = 240


def figure(part: Part, name: str) -> Figure | None:
    """Return a figure of the law of an element or a cam; ``None`` for other parts.

    Parameters
    ----------
    part
        With its numbers.
    name
        For the alternative text.
    """
    if isinstance(part, Cam):
        return _cam(part, name)
    if isinstance(part, Element):
        return _element(part, name)
    return None


def _element(part: Element, name: str) -> Figure:
    kind = part.domain.name
    amplitude = _AMPLITUDES[kind]
    held = specimen(area=1e-4, rest_length=_REST_LENGTH, law=part) if part.domain == MATERIAL else part
    length = _REST_LENGTH if part.domain == MATERIAL else 1.0
    if isinstance(part, Specimen):
        amplitude *= 1.5
    body = Driven(domain=ROTATION if kind == "rotation" else TRANSLATION)
    model = flatten(assembly("bench", body=body, part=tie(held, "body")))
    effort = f"part.{held.domain.effort}"
    lines = {
        f"{f:g} Hz": _loop(model, effort, amplitude * length, f, centred=kind == "rotation") for f in _SPEEDS
    }
    per, up, across = (1.0 / length, 1e-2, "strain, 1") if kind == "material" else (1.0, 1.0, "")
    if kind == "rotation":
        per, across = 180.0 / np.pi, "angle, °"
    elif kind == "translation":
        per, across = 1e3, "extension, mm"
    labels = {"material": "stress, MPa", "rotation": "torque, N·m", "translation": "force, N"}
    scaled = {k: (x * per, y * up) for k, (x, y) in lines.items()}
    if np.allclose(*(y for _, y in scaled.values()), rtol=1e-3, atol=1e-9):
        scaled = {"at any speed": scaled["0.2 Hz"]}
    words = f"{labels[kind].partition(',')[0]} of {name} over {across.partition(',')[0]}, moved to and fro"
    return curves(scaled, across=across, up=labels[kind], words=words)


def _loop(
    model: FlatModel, effort: str, amplitude: float, frequency: float, *, centred: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return motion and effort over the second of two periods."""
    time = np.linspace(0.0, 2.0 / frequency, 2 * _POINTS + 1)
    turn = 2.0 * np.pi * frequency
    shift = 0.0 if centred else 1.0
    size = amplitude if centred else amplitude / 2.0
    place, speed = (v.name for v in model.inputs)
    moved = {
        place: lambda t: size * (shift + np.sin(turn * t - shift * np.pi / 2)),
        speed: lambda t: size * turn * np.cos(turn * t - shift * np.pi / 2),
    }
    trace = simulate(model, time, inputs=moved, tolerance=1e-6)
    return np.asarray(trace[place])[_POINTS:], np.asarray(trace[effort])[_POINTS:]


def _cam(part: Cam, name: str) -> Figure:
    behind = through(part, rubber=Spring(stiffness=1000.0))
    model = flatten(assembly("bench", body=Driven(), part=tie(behind, "body")))
    time = np.linspace(-1.0, 1.0, _POINTS + 1)
    trace = simulate(model, time, inputs={"body.angle": lambda t: t, "body.speed": 1.0})
    degrees = np.degrees(time)
    lines = {
        "lever arm": (degrees, 1e3 * np.asarray(trace["part.cam.lever_arm_now"])),
        "what it takes up of the cable": (degrees, 1e3 * np.asarray(trace["part.rubber.extension"])),
    }
    words = f"lever arm and extension of {name} over the angle"
    return curves(lines, across="angle, °", up="lever arm, extension, mm", words=words)
