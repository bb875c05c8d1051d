"""What a deck may well declare and yet is likely to be a slip: remarks with the next step, not errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ...foundation.quantity import Quantity
from ...foundation.spread import RelativeSpread
from ..core.element import Tie
from ..mechanics.bodies import Body, GearedMotor
from ..mechanics.gear import Gear, Transmission
from ..mechanics.motor import ElectricMotor
from .named_parts import Assembly

_FASTEST, _SLOWEST = 5e5, 50.0
"""Acceleration in rad/s² that the largest current gives to the rotor alone: faster ones are tiny and without
iron, slower ones carry a flywheel. Catalogue motors from 10 W to 1 kW lie between 1e3 and 2e5."""
_WIDE, _WIDEST = 1.0, 2.0
_FITTED = ".fitted_strain"
"""The number that only a law fitted to a curve has: the strain to which it was fitted."""


def deck_remarks(machine: Assembly) -> list[str]:
    """Return what is lawful in a deck and likely to be a slip, each with the next step.

    Examples
    --------
    >>> from nlsdesign.foundation.deck import load_deck
    >>> from nlsdesign.components.assembly.deck_writer import declare
    >>> deck_remarks(declare(load_deck("austin2015_as_printed")))
    []
    """
    return [
        *_spreads(machine.quantities()),
        *_exact_rubber(machine.quantities()),
        *_ends(machine),
        *_ratios(machine),
        *_inertias(machine),
        *(f"{at}.{text}" for at, part in machine.walk() for text in part.remarks()),
    ]


def _spreads(numbers: Mapping[str, Quantity]) -> Iterator[str]:
    for name, number in numbers.items():
        relative = number.spread.relative if isinstance(number.spread, RelativeSpread) else 0.0
        if relative > _WIDEST or (relative >= _WIDE and not number.assumed):
            yield (
                f"{name}: spread = {relative:g} means a factor of {1.0 + relative:g} for one standard "
                f"deviation -> write spread = {relative / 100:g} if {relative:g} % was meant"
            )


def _exact_rubber(numbers: Mapping[str, Quantity]) -> Iterator[str]:
    """Yield the laws that are fitted to a curve and have no spread, as where a source measured one sample."""
    for fitted in (name for name in numbers if name.endswith(_FITTED)):
        law = fitted.removesuffix(_FITTED)
        constants = [number for name, number in numbers.items() if name.startswith(f"{law}.")]
        if not any(number.spread for number in constants):
            yield (
                f"{law}: its curve has no spread; tolerances, fits and observers take this rubber as exactly "
                f"known -> write its constants into [{law}] with a spread, for instance 0.1"
            )


def _ends(machine: Assembly) -> Iterator[str]:
    bodies = [name for name, part in machine.parts if isinstance(part, Body)]
    # The bodies that a motor turns, directly or through gears.
    driven = {name for name, part in machine.parts if isinstance(part, GearedMotor | ElectricMotor)}
    gears = [part.between for _, part in machine.parts if isinstance(part, Transmission)]
    for _ in gears:
        driven |= {end for pair in gears if set(pair) & driven for end in pair}
    for name, part in machine.parts:
        if not isinstance(part, Tie) or not part.element.restores:
            continue
        others = [body for body in bodies if body not in part.between and body not in driven]
        if len(part.between) == 1 and others:
            both = f'between = ["{part.between[0]}", "{others[0]}"]'
            yield (
                f"{name}: stretches between '{part.between[0]}' and the resting frame; '{others[0]}' does "
                f"not feel it -> write {both} for a spring in series"
            )
        elif len(part.between) == 2 and part.between[1] in driven and part.between[0] not in driven:
            swapped = f'between = ["{part.between[1]}", "{part.between[0]}"]'
            yield (
                f"{name}: its angle is that of '{part.between[0]}' minus that of '{part.between[1]}', so a "
                f"drive that turns forward gives a negative torque -> write {swapped} for a positive one"
            )


def _ratios(machine: Assembly) -> Iterator[str]:
    for name, part in machine.parts:
        if isinstance(part, GearedMotor):
            field, ratio = "gear_ratio", part.gear_ratio.number
        elif isinstance(part, Gear) and isinstance(machine[part.between[0]], ElectricMotor):
            field, ratio = "ratio", abs(part.ratio.number)
        else:
            continue
        if ratio < 1.0:
            turns = f"{1.0 / ratio:.4g}"
            yield (
                f"{name}.{field}: {ratio:g} motor turns per output turn make the output {turns} times as "
                f"fast as the motor, with {ratio:g} of its torque -> if {turns} motor turns per output turn "
                f"were meant, write {turns}"
            )


def _inertias(machine: Assembly) -> Iterator[str]:
    gears = {part.between[0]: part for _, part in machine.parts if isinstance(part, Gear)}
    for name, part in machine.parts:
        if isinstance(part, GearedMotor) and part.gear_ratio.number > 1.0:
            n = part.gear_ratio.number
            fast = n * n * part.torque_constant.number * part.current_limit.number / part.inertia.number
            if fast > _FASTEST:
                reflected = Quantity(float(f"{part.inertia.number * n * n:.4g}"), part.inertia.unit)
                yield (
                    f"{name}.inertia: {part.inertia} is that at the gear's output; the rotor would then have "
                    f"{Quantity(part.inertia.number / n**2, 'g*cm^2')} and speed up with {fast:.2g} rad/s², "
                    f"more than motors do -> if {part.inertia} is that of the rotor, write {reflected}, "
                    f"times {n:g}^2"
                )
        elif isinstance(part, ElectricMotor) and name in gears and abs(gears[name].ratio.number) > 1.0:
            n = abs(gears[name].ratio.number)
            current = min(part.current_limit.number, part.voltage_limit.number / part.resistance.number)
            slow = part.torque_constant.number * current / part.inertia.number
            if slow < _SLOWEST:
                own = Quantity(float(f"{part.inertia.number / n / n:.4g}"), part.inertia.unit)
                yield (
                    f"{name}.inertia: {part.inertia} is that of the rotor, in front of the gear, which the "
                    f"largest current speeds up with {slow:.2g} rad/s² only -> if it is that at the gear's "
                    f"output, write {own}, divided by {n:g}^2"
                )
