"""Effects of drives: effort that comes late, saturates, is compressed, or changes with heat and time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from ....components import (
    Assembly,
    CommandCompression,
    CommandSaturation,
    DriveDelay,
    DrivePart,
    DriveSaturation,
    GradualSaturation,
    TorqueConstantDrift,
    WindingHeat,
)
from ....components.core.domain import Domain
from ....components.mechanics.bodies import Free
from ....components.mechanics.drive_faults import CURRENT, command_domain
from ....foundation.quantity import same_dimension
from .effect import Edit, Effect, Form, Places, Unknown, free_inside, number
from .sizes import LONGEST, QUICKEST, SHIFT

_FALLS_AT = (0.2, 1.5)
"""Where a drive may lose effort, in largest commands: short motions command several times what others do."""


def drives(assembly: Assembly) -> list[str]:
    """Return the bodies that are driven by a command.

    A command that is no effort, a chain, or a sensor of the command tells a drive; where nothing tells one,
    any body that moves freely may be driven.
    """
    bodies = {name: part for name, part in assembly.parts if isinstance(part, Free)}
    read = {assembly.measured(f"{name}.reading")[0] for name in assembly.sensors()}
    driven = [
        name
        for name, body in bodies.items()
        if body.chain
        or not same_dimension(body.command[1], body.domain.effort_unit)
        or f"{name}.{body.command[0]}" in read
    ]
    return driven or list(bodies)


def _without(*kinds: type[DrivePart]) -> Places:
    """Return the drives in whose chain none of some kinds of part stands."""

    def places(assembly: Assembly) -> list[str]:
        return [
            n for n in drives(assembly) if not any(isinstance(p, kinds) for _, p in _drive(assembly, n).chain)
        ]

    return places


def _drive(assembly: Assembly, name: str) -> Free:
    part = assembly[name]
    assert isinstance(part, Free)
    return part


def _put(assembly: Assembly, name: str, wanted: str, part: DrivePart) -> tuple[Assembly, str]:
    """Return the assembly with one more part behind the chain of a drive, and the path of the part."""
    path = f"{name}.{free_inside(assembly[name], wanted)}"
    return assembly.with_part(path, part), path


def _commanded(assembly: Assembly, name: str) -> tuple[Domain, str] | None:
    """Return the kind of a drive's command and the name of its signal; nothing for another kind."""
    signal, unit = _drive(assembly, name).command
    kind = command_domain(unit)
    return (kind, f"{name}.{signal}") if kind else None


def _delay(assembly: Assembly, name: str) -> Iterator[Edit]:
    edited, path = _put(assembly, name, "delay", DriveDelay(delay=number(1e-3, "s")))
    unknown = Unknown(f"{path}.delay", (0.1,), 1e-3, 6.0, QUICKEST, beyond=SHIFT)
    yield Edit(edited, (unknown,), {"explains_lag": True})


def _falling(
    wanted: str, field: str, make: Callable[[Domain], DrivePart], starts: tuple[float, ...]
) -> Callable[[Assembly, str], Iterator[Edit]]:
    """Return the edit that puts a part with one number, in the unit of the command, into a chain."""

    def edits(assembly: Assembly, name: str) -> Iterator[Edit]:
        commanded = _commanded(assembly, name)
        if commanded:
            kind, signal = commanded
            edited, path = _put(assembly, name, wanted, make(kind))
            yield Edit(edited, (Unknown(f"{path}.{field}", starts, 0.02, 1e3, signal, null=math.inf),))

    return edits


def _iron(kind: Domain) -> DrivePart:
    if kind == CURRENT:
        return DriveSaturation(saturation_current=number(100.0, "A"))
    return CommandSaturation(saturation=number(100.0, kind.effort_unit), domain=kind)


def _saturation(assembly: Assembly, name: str) -> Iterator[Edit]:
    commanded = _commanded(assembly, name)
    field = "saturation_current" if commanded and commanded[0] == CURRENT else "saturation"
    yield from _falling("saturation", field, _iron, _FALLS_AT)(assembly, name)


def _gradual(kind: Domain) -> DrivePart:
    return GradualSaturation(saturation=number(100.0, kind.effort_unit), domain=kind)


def _heat(assembly: Assembly, name: str) -> Iterator[Edit]:
    commanded = _commanded(assembly, name)
    if commanded:
        kind, signal = commanded
        part = WindingHeat(
            halving=number(100.0, kind.effort_unit), cooling_time=number(10.0, "s"), domain=kind
        )
        edited, path = _put(assembly, name, "heat", part)
        unknowns = (
            Unknown(f"{path}.halving", _FALLS_AT, 0.02, 1e3, signal, null=math.inf),
            Unknown(f"{path}.cooling_time", (0.7,), 0.01, 100.0, LONGEST, null=None),
        )
        yield Edit(edited, unknowns)


def _drift(assembly: Assembly, name: str) -> Iterator[Edit]:
    edited, path = _put(assembly, name, "drift", TorqueConstantDrift(drift=number(0.0, "1/s")))
    drift = Unknown(f"{path}.drift", (0.0,), -0.9, 0.9, f"1 / {LONGEST}")
    yield Edit(edited, (drift,))
    settling = edited.with_values({f"{path}.settling_time": number(1.0, "s")})
    wider = Unknown(f"{path}.drift", (-0.3, 0.3), -30.0, 30.0, f"1 / {LONGEST}")
    yield Edit(settling, (wider, Unknown(f"{path}.settling_time", (0.2,), 0.01, 5.0, LONGEST, null=None)))


drive_delay = Effect(
    "drive_delay",
    "A drive whose effort follows the measured command late.",
    160,
    (
        Form(
            _without(DriveDelay),
            _delay,
            "effort that follows the command late, the more the faster the command changes",
            "Golub and Van Loan 2013 (Padé table)",
        ),
    ),
)
torque_constant_saturation = Effect(
    "torque_constant_saturation",
    "A drive whose effort saturates, as iron does.",
    170,
    (
        Form(
            _without(DriveSaturation, CommandSaturation, GradualSaturation),
            _saturation,
            "effort that falls short the more, the larger the command, with either sign",
            "Hanselman 2003 (saturation, Froelich's curve of magnetisation)",
        ),
        Form(
            _without(DriveSaturation, CommandSaturation, GradualSaturation),
            _falling("saturation", "saturation", _gradual, _FALLS_AT),
            "effort that falls short the more, the larger the command, and gradually",
            "Hanselman 2003 (saturation, arctangent as curve of magnetisation)",
        ),
    ),
)
command_compression = Effect(
    "command_compression",
    "A drive whose gain falls with the command from the first, or whose resistance grows with the duty.",
    172,
    (
        Form(
            _without(CommandCompression),
            _falling(
                "compression",
                "halving",
                lambda kind: CommandCompression(halving=number(100.0, kind.effort_unit), domain=kind),
                (0.5, 4.0),
            ),
            "effort that falls short in proportion to the square of the command, with its sign",
            "Hanselman 2003 (Froelich's curve of magnetisation in its first form)",
        ),
    ),
)
winding_heat = Effect(
    "winding_heat",
    "A drive that loses effort as its winding and magnets grow warm.",
    174,
    (
        Form(
            _without(WindingHeat),
            _heat,
            "effort per command that falls while the drive works hard, and comes back at rest",
            "first law of thermodynamics; Hanselman 2003 (magnets and temperature)",
        ),
    ),
)
torque_constant_drift = Effect(
    "torque_constant_drift",
    "A torque or force constant that changes with time, steadily or until it settles.",
    176,
    (
        Form(
            _without(TorqueConstantDrift),
            _drift,
            "effort per command that changes from the start of each record, whatever the drive does",
            "Hanselman 2003 (magnets and temperature)",
        ),
    ),
)
