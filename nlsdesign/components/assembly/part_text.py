"""Parts as the text of a deck: tables, numbers that read back exactly, texts.

Names that components and their numbers had before, and what to write instead.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from decimal import Context
from fractions import Fraction
from itertools import chain

from ...foundation.deck import Written
from ...foundation.errors import UnknownNameError
from ...foundation.quantity import Quantity, parse_unit
from ...foundation.spread import NormalSpread, RelativeSpread, UniformSpread
from ..core.part import Part


def part_lines(
    path: str, part: Part, *, structure: Sequence[str] = (), changed: Mapping[str, Quantity] | None = None
) -> list[str]:
    """Return the lines of a part and of everything in it, the first one empty."""
    new = changed or {}
    lines = ["", f"[{path}]", f"component = {text_of(type(part).__name__)}", *structure]
    domain = part.stated_domain()
    if domain:
        lines.append(f"domain = {text_of(domain.name)}")
    for name, declared in part.parameters().items():
        lines.append(f"{name} = {number_of(new.get(f'{path}.{name}', declared))}")
    for name, child in part.children().items():
        lines += part_lines(f"{path}.{name}", child, changed=new)
    return lines


def number_of(given: Quantity) -> str:
    """Return a number as an inline table that reads back as the same number."""
    factor, spread = parse_unit(given.unit).factor, given.spread
    if isinstance(spread, UniformSpread):
        ends = (given.number - spread.half_width, given.number + spread.half_width)
        number = f"range = [{', '.join(_shortest(v, factor) for v in ends)}]"
    else:
        items = [_shortest(v, factor) for v in given.values]
        number = f"value = {'[' + ', '.join(items) + ']' if isinstance(given.value, tuple) else items[0]}"
    text = f"{{{number}, unit = {text_of(given.unit)}, source = {text_of(given.source)}"
    if isinstance(spread, RelativeSpread):
        return text + (f", spread = {spread.relative!r}}}" if spread else "}")
    if isinstance(spread, NormalSpread):
        size = f"{_shortest(spread.size, factor)} {given.unit}"
        return f"{text}, spread = {text_of(size)}}}"
    return text + "}"


def text_of(text: str) -> str:
    """Return a text as TOML writes it, which is as JSON does but for the delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _shortest(value: float, factor: float) -> str:
    """Return the shortest decimal that reads back as the same number in SI."""
    exact = Fraction(value) / Fraction(factor)
    short = (repr(float(f"{float(exact):.{digits}g}")) for digits in (6, 12, 15))
    # Where no float times the factor is the value, the text has more digits than a float.
    long = (str(Context(prec=n).divide(exact.numerator, exact.denominator)) for n in range(17, 40))
    return next(text for text in chain(short, long) if Written(text).times(factor) == value)


COMPONENTS: dict[str, str] = {
    "CableGuide": "CapstanFriction with guide=WrapProduct(wrap=...); in a deck with wrap",
    "ConstantForce": "ConstantLoad, with its load in N",
    "DryFriction": "CoulombFriction, which sticks unless it has a creep_speed",
    "DryLoadFriction": "LoadFriction, which sticks unless it has a creep_speed",
    "DryStribeckFriction": "StribeckFriction, which sticks unless it has a creep_speed",
    "DelayedForceSensor": "TransportDelay of the force, and a ForceSensor of its reading",
    "DelayedMotor": 'GearedMotor with chain=(("delay", DriveDelay(...)),); in a deck with [motor.delay]',
    "DriftingForceSensor": "Drift of the force, and a ForceSensor of its reading",
    "DrivenPoint": 'Driven with domain=TRANSLATION; in a deck with domain = "translation"',
    "EccentricEncoder": "Eccentricity of the angle, and an Encoder of its reading",
    "FixedPoint": 'Fixed with domain=TRANSLATION; in a deck with domain = "translation"',
    "InertialBacklash": "Backlash with contact=Inertial(inertia=...); in a deck with inertia",
    "LooseCable": "Slack, which is sharp unless it has a width",
    "MisshapenCam": "CamWithProfileError",
    "Play": "Backlash, which is sharp unless it has a width or an inertia",
    "RoundedEndStop": "EndStop with contact=Rounded(width=...); in a deck with width",
    "SampledEncoder": "SampleAndHold of the angle, and an Encoder of its reading",
    "SaturatingMotor": 'GearedMotor with chain=(("saturation", DriveSaturation(...)),); '
    "in a deck with [motor.saturation]",
    "SlidingFriction": "CoulombFriction, with its sliding_effort in N",
    "SmoothStrainStiffening": "StrainStiffening with contact=Rounded(width=...); in a deck with width",
    "Softening": "StressSoftening with curve=OgdenRoxburgh(...); in a deck with strength and scale",
    "TensionSet": "PermanentSet with memory=Following(...); in a deck with following",
    "TorsionDashpot": "Dashpot, with its damping in N·m·s/rad",
    "TorsionSpring": "Spring, with its stiffness in N·m/rad",
    "ViscousHeating": "SelfHeating with heat=ViscousHeat(...); in a deck with halving_speed",
    "WorkHeating": "SelfHeating with heat=WorkHeat(...); in a deck with halving_work",
}
"""What stands for a component of an old name: the new name first, then what else to say."""

NUMBERS: dict[str, str] = {"sliding_force": "sliding_effort", "sliding_torque": "sliding_effort"}
"""New name of a number by its old one."""


def renamed(name: str) -> UnknownNameError | None:
    """Return the error that says the new name of a component; ``None`` if the name was never one."""
    if name not in COMPONENTS:
        return None
    return UnknownNameError(
        f"component '{name}'", "has another name now", next_step=f"write {COMPONENTS[name]}"
    )
