"""Decks and `records.toml` of the machines of `kinds`, with part names that change from seed to seed."""

from __future__ import annotations

from collections.abc import Mapping

from .digital_loop import Logger
from .kinds import Kind

Names = Mapping[str, str]
NAMES: tuple[Names, ...] = (
    {
        "motor": "motor", "bearing": "bearing", "load": "load", "load_bearing": "load_bearing",
        "spring": "spring", "spring_damping": "spring_damping", "arm": "arm",
        "rack": "belt_wheel", "slide": "belt", "encoder": "encoder",
        "load_encoder": "load_encoder", "ammeter": "ammeter", "time": "t_s", "place": "angle", "load_place":
        "load_angle", "current": "current_A",
    },
    {
        "motor": "hip_drive", "bearing": "grease", "load": "shank", "load_bearing": "knee_bearing",
        "spring": "torsion_bar", "spring_damping": "bar_loss", "arm": "lower_leg",
        "rack": "pinion", "slide": "moving_rack", "encoder": "resolver",
        "load_encoder": "knee_resolver", "ammeter": "phase_current", "time": "stamp", "place": "q_act",
        "load_place": "q_out", "current": "i_q",
    },
    {
        "motor": "axis_1", "bearing": "seal", "load": "table_side", "load_bearing": "guide",
        "spring": "coupling",
        "spring_damping": "coupling_loss", "arm": "boom",
        "rack": "drum", "slide": "strand", "encoder": "scale", "load_encoder": "scale_2",
        "ammeter": "amplifier_reading", "time": "clock", "place": "pos_1", "load_place": "pos_2",
        "current": "amps",
    },
)  # fmt: skip
_DECLARED = "declared by its makers"


def _number(value: float, unit: str, spread: float = 0.0, source: str = _DECLARED) -> str:
    more = f", spread = {spread}" if spread else ""
    return f'{{value = {value:.9g}, unit = "{unit}", source = "{source}"{more}}}'


def _table(name: str, component: str, **fields: str) -> str:
    lines = [f"[{name}]", f'component = "{component}"', *(f"{key} = {text}" for key, text in fields.items())]
    return "\n".join(lines)


SLIDE_SHARE = 0.1
"""Share of the driven inertia that slides with the belt of a rack; the rest turns."""


def deck_of(kind: Kind, effects: tuple[str, ...], names: Names, logger: Logger) -> str:
    """Return what the makers of a machine declare; what is hidden by leaving it out is not in it.

    Parameters
    ----------
    kind
        Of the machine.
    effects
        What is hidden.
    names
        One of :data:`NAMES`.
    logger
        Its sensors.
    """
    plant, sides, rack = kind.plant, kind.sides == 2, kind.radius > 0.0
    lines = rack or "screw" in kind.name
    motor = names["motor"]
    head = f'[deck]\nname = "{kind.name}"\ndescription = "A machine of the kind {kind.name}"'
    tables = [head, *(_rack(kind, motor, names) if rack else [_motor(kind, motor)])]
    damping, stiffness = ("N*s/m", "N/m") if lines else ("N*m*s/rad", "N*m/rad")
    driven = names["slide"] if rack else motor
    if "viscous_friction" not in effects:
        between = f'["{driven}"]'
        tables.append(
            _table(names["bearing"], "Dashpot", between=between, damping=_number(plant.damping, damping, 0.5))
        )
    arm_on = motor
    if sides:
        load, between = names["load"], f'["{driven}", "{names["load"]}"]'
        arm_on = load
        tables += [
            _table(load, "Mass", mass=_number(plant.load_inertia, "kg", 0.06))
            if rack
            else _table(load, "Inertia", inertia=_number(plant.load_inertia, "kg*m^2", 0.06)),
            _table(
                names["spring"],
                "Spring",
                between=between,
                stiffness=_number(plant.stiffness, stiffness, 0.06),
            ),
            _table(
                names["load_bearing"],
                "Dashpot",
                between=f'["{load}"]',
                damping=_number(plant.load_damping, damping, 0.5),
            ),
        ]
        if "spring_damping" not in effects:
            loss = _number(plant.spring_damping, damping, 0.5)
            tables.append(_table(names["spring_damping"], "Dashpot", between=between, damping=loss))
    if plant.weight and "gravity_load" not in effects:
        tables.append(
            _table(
                names["arm"],
                "GravityLoad",
                between=f'["{arm_on}"]',
                horizontal_torque=_number(plant.weight, "N*m", 0.06),
                hanging_angle=_number(0.0, "rad"),
            )
        )
    if rack or not lines:
        tables += _sensors(kind, names, logger)
    return "\n\n".join(tables) + "\n"


def _motor(kind: Kind, motor: str) -> str:
    plant = kind.plant
    if "screw" in kind.name:
        return _table(
            motor,
            "LinearDrive",
            mass=_number(plant.inertia, "kg", 0.06),
            force_constant=_number(plant.effort_per_ampere, "N/V", 0.06),
            voltage_limit=_number(kind.limit, "V"),
        )
    return _table(
        motor,
        "GearedMotor",
        inertia=_number(plant.inertia, "kg*m^2", 0.06),
        gear_ratio=_number(plant.gear_ratio, "1"),
        torque_constant=_number(plant.effort_per_ampere / plant.gear_ratio, "N*m/A", 0.06),
        current_limit=_number(kind.limit, "A"),
    )


def _rack(kind: Kind, motor: str, names: Names) -> list[str]:
    """Return motor, belt wheel and what slides with the belt, of which the belt's own spring is no part."""
    plant, radius = kind.plant, kind.radius
    return [
        _table(
            motor,
            "GearedMotor",
            inertia=_number((1.0 - SLIDE_SHARE) * plant.inertia * radius**2, "kg*m^2", 0.06),
            gear_ratio=_number(1.0, "1"),
            torque_constant=_number(plant.effort_per_ampere * radius, "N*m/A", 0.06),
            current_limit=_number(kind.limit, "A"),
        ),
        _table(names["slide"], "Mass", mass=_number(SLIDE_SHARE * plant.inertia, "kg", 0.06)),
        _table(
            names["rack"], "Rack", between=f'["{motor}", "{names["slide"]}"]', radius=_number(radius, "m")
        ),
    ]


def _sensors(kind: Kind, names: Names, logger: Logger) -> list[str]:
    tables = [
        _table(
            names["encoder"],
            "Encoder",
            of=f'"{names["motor"]}.angle"',
            quantum=_number(logger.quantum / (kind.radius or 1.0), "rad"),
        ),
        _table(
            names["ammeter"],
            "CurrentSensor",
            of=f'"{names["motor"]}.current"',
            bias=_number(0.0, "A", source="declared: trimmed"),
            noise=_number(logger.current_noise, "A"),
        ),
    ]
    if kind.sides == 2:
        tables.append(
            _table(
                names["load_encoder"],
                "Encoder",
                of=f'"{names["load"]}.{"position" if kind.radius else "angle"}"',
                quantum=_number(logger.load_quantum, "m" if kind.radius else "rad"),
            )
        )
    return tables


def mapping_of(kind: Kind, names: Names, logger: Logger, *, says_held: bool = False) -> str:
    """Return `records.toml`: which column shows which signal of the deck.

    Parameters
    ----------
    kind, names, logger
        As of :func:`deck_of`.
    says_held
        Whether it says that the current is held from each row to the next.
    """
    held = ['between_samples = "held"'] if says_held else []
    if "screw" in kind.name:
        columns = [
            _column(names["place"], f"{names['motor']}.position", "m", f"quantum = {logger.quantum:g}"),
            _column(
                names["current"], f"{names['motor']}.voltage", "V", f"noise = {logger.current_noise:g}", *held
            ),
        ]
    else:
        columns = [
            _column(names["place"], f"{names['encoder']}.reading", "rad"),
            _column(names["current"], f"{names['ammeter']}.reading", "A", *held),
        ]
        if kind.sides == 2:
            columns.append(
                _column(
                    names["load_place"], f"{names['load_encoder']}.reading", "m" if kind.radius else "rad"
                )
            )
    return "\n\n".join([f'[time]\ncolumn = "{names["time"]}"\nunit = "s"', *columns]) + "\n"


def _column(head: str, signal: str, unit: str, *more: str) -> str:
    return "\n".join([f"[columns.{head}]", f'signal = "{signal}"', f'unit = "{unit}"', *more])
