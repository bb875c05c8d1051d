"""Effects of rubber that remembers its past: softening, set, heat."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeAlias

from ....components import (
    MATERIAL,
    TRANSLATION,
    Assembly,
    DamageByMotion,
    Element,
    Following,
    LargestMotion,
    LossHeat,
    PermanentSet,
    SelfHeating,
    Specimen,
    StressSoftening,
    ViscousHeat,
    WorkHeat,
)
from ....components.materials.self_heating import Heat, is_equilibrium
from ....foundation.quantity import Quantity
from .effect import Edit, Effect, Form, Unknown, free_inside, number, wrapped
from .places import effort_over_motion, lumped_springs, stretched, wrapping
from .rubber import specimens
from .sizes import LONGEST, QUICKEST

Wrapper: TypeAlias = Callable[[str, Element], Element]


def _pieces(assembly: Assembly) -> list[str]:
    """Return the paths of what may age: specimens, what else a cam stretches, and lumped springs."""
    pieces = specimens(assembly)
    for others in (stretched(assembly), lumped_springs(assembly)):
        inside = [
            p for p in others if not any(f"{p}.".startswith(f"{s}.") or s.startswith(f"{p}.") for s in pieces)
        ]
        pieces += [path for path in inside if assembly.element(path).domain != MATERIAL]
    return pieces


def _extending_pieces(assembly: Assembly) -> list[str]:
    return [path for path in _pieces(assembly) if assembly.element(path).domain == TRANSLATION]


def _around(assembly: Assembly, path: str, name: str, wrapper: Wrapper) -> tuple[Assembly, str]:
    """Return the assembly with a wrapper around a piece, and the wrapper's path."""
    owner = path.rpartition(".")[0]
    # A tie keeps its name and takes the wrapper; the piece in it is named unlike any number of it.
    edited = wrapped(assembly, path, name if owner else "piece", wrapper, read_outside=True)
    return edited, f"{owner}.{name}" if owner else path


def _relaxing_specimens(assembly: Assembly) -> list[str]:
    """Return the pieces with laws of equilibrium beside others, none of them read by a sensor."""
    read = [sensor.of for sensor in assembly.sensors().values()]
    result = []
    for path in specimens(assembly):
        laws = dict(assembly.element(path).children())
        elastic = _equilibrium(assembly, path)
        if (
            elastic
            and len(elastic) < len(laws)
            and not any(of.startswith(f"{path}.{n}.") for of in read for n in laws)
        ):
            result.append(path)
    return result


def _equilibrium(assembly: Assembly, path: str) -> list[str]:
    laws = assembly.element(path).children()
    return [name for name, law in laws.items() if isinstance(law, Element) and is_equilibrium(law)]


def _inside(
    assembly: Assembly, path: str, name: str, wrapper: Callable[[tuple[tuple[str, Element], ...]], Element]
) -> tuple[Assembly, str]:
    """Return the assembly with a wrapper around the equilibrium of a piece of material, and its path."""
    piece = assembly.element(path)
    own = _equilibrium(assembly, path)
    free = free_inside(piece, name)
    members = tuple((n, assembly.element(f"{path}.{n}")) for n in own)
    rest = {n: part for n, part in piece.children().items() if n not in own}
    return assembly.with_part(path, piece.with_children({free: wrapper(members), **rest})), f"{path}.{free}"


def _softening(assembly: Assembly, path: str) -> Iterator[Edit]:
    by_motion = LargestMotion(softening=number(0.1, "1"))
    edited, where = _around(assembly, path, "softening", wrapping(StressSoftening, curve=by_motion))
    yield Edit(edited, _softened(where))
    domain, (_, motion) = assembly.element(path).domain, effort_over_motion(assembly, path)
    damage = DamageByMotion(damage=number(0.1, "1"), damage_motion=number(1.0, domain.motion_unit))
    edited, where = _around(assembly, path, "softening", wrapping(StressSoftening, curve=damage))
    unknowns = (
        Unknown(f"{where}.damage", (0.15,), 1e-3, 0.97),
        Unknown(f"{where}.damage_motion", (0.5,), 0.03, 10.0, motion, null=None),
    )
    yield Edit(edited, unknowns)


def _softened(where: str) -> tuple[Unknown, ...]:
    return (
        Unknown(f"{where}.softening", (0.15,), 1e-3, 0.97),
        Unknown(f"{where}.exponent", (1.0,), 0.15, 15.0, null=None),
    )


def _softening_equilibrium(assembly: Assembly, path: str) -> Iterator[Edit]:
    curve = LargestMotion(softening=number(0.1, "1"))
    edited, where = _inside(assembly, path, "softening", lambda m: StressSoftening(members=m, curve=curve))
    yield Edit(edited, _softened(where))


def _set(assembly: Assembly, path: str) -> Iterator[Edit]:
    longer = wrapping(PermanentSet, share=number(0.01, "1"), memory=Following())
    edited, where = _around(assembly, path, "setting", longer)
    yield Edit(edited, (Unknown(f"{where}.share", (0.03,), 1e-3, 0.85),))


def _set_equilibrium(assembly: Assembly, path: str) -> Iterator[Edit]:
    share = number(0.01, "1")
    edited, where = _inside(
        assembly, path, "setting", lambda m: PermanentSet(members=m, share=share, memory=Following())
    )
    yield Edit(edited, (Unknown(f"{where}.share", (0.03,), 1e-3, 0.85),))


def _heating(assembly: Assembly, path: str) -> Iterator[Edit]:
    """Yield heat of all work, and heat of loss where nothing in the piece says what it loses."""
    domain, (effort, motion) = assembly.element(path).domain, effort_over_motion(assembly, path)
    cooling = number(10.0, "s")
    by_work = WorkHeat(halving_work=number(100.0, "J"), cooling_time=cooling)
    forms: list[tuple[Heat, Unknown]] = [
        (by_work, Unknown("halving_work", (30.0,), 1e-3, 1e6, f"{effort} * {motion}", null=math.inf))
    ]
    if path not in _relaxing_specimens(assembly):
        by_loss = ViscousHeat(halving_speed=number(1.0, domain.rate_unit), cooling_time=cooling)
        speed = f"{motion} / {QUICKEST}"
        forms.append((by_loss, Unknown("halving_speed", (1.0,), 1e-2, 1e3, speed, null=math.inf)))
    for heat, size in forms:
        edited, where = _around(assembly, path, "heating", wrapping(SelfHeating, heat=heat))
        yield Edit(edited, (replace(size, name=f"{where}.{size.name}"), _cooling(where)))


def _cooling(where: str) -> Unknown:
    return Unknown(f"{where}.cooling_time", (0.7,), 0.02, 50.0, LONGEST, null=None)


def _heating_by_loss(assembly: Assembly, path: str) -> Iterator[Edit]:
    """Yield heat of what the laws of a piece lose, which softens all of them or the equilibrium alone."""
    piece = assembly.element(path)
    assert isinstance(piece, Specimen)
    volume = piece.cross_section.square_metres * piece.rest_length.number
    free = free_inside(piece, "heating")
    members = tuple((n, assembly.element(f"{path}.{n}")) for n in piece.children())
    where = f"{path}.{free}"
    for share in (0.0, 1.0):
        heat = LossHeat(
            halving_loss=number(1e6, "Pa"),
            cooling_time=number(10.0, "s"),
            relaxing_share=Quantity(share, "1", "definition: what softens"),
        )
        warm = SelfHeating(members=members, heat=heat)
        edited = assembly.with_part(path, piece.with_children({free: warm}))
        loss = Unknown(
            f"{where}.halving_loss",
            (5.0 / volume,),
            1e-4 / volume,
            1e6 / volume,
            f"{path}.force * {path}.extension",
            null=math.inf,
        )
        yield Edit(edited, (loss, _cooling(where)))


stress_softening = Effect(
    "stress_softening",
    "Rubber that is softer below the largest stretch it has had (Mullins effect).",
    210,
    (
        Form(
            _pieces,
            _softening,
            "the first stretch stiffer than the later ones, until the largest stretch is passed again",
            "Mullins 1969; Ogden and Roxburgh 1999; Simo 1987",
            "stress softening",
        ),
        Form(
            _relaxing_specimens,
            _softening_equilibrium,
            "the first stretch stiffer than the later ones, at rest as well, with the same relaxation",
            "Mullins 1969; Ogden and Roxburgh 1999",
            "stress softening",
        ),
    ),
)
permanent_set = Effect(
    "permanent_set",
    "Rubber whose rest length has grown by a share of the largest stretch it has had.",
    220,
    (
        Form(
            _extending_pieces,
            _set,
            "no force until a certain extension, which grows with the largest stretch before",
            "Gent 2012",
            "permanent set",
        ),
        Form(
            _relaxing_specimens,
            _set_equilibrium,
            "a rest length that grows with the largest stretch before, with the same relaxation",
            "Gent 2012",
            "permanent set",
        ),
    ),
)
self_heating = Effect(
    "self_heating",
    "Rubber that grows soft as it is worked and recovers at rest: heat of all work, or of loss.",
    230,
    (
        Form(
            _pieces,
            _heating,
            "force that falls while the rubber is worked hard, and comes back at rest",
            "first law of thermodynamics; Medalia 1991",
            "self-heating",
        ),
        Form(
            _relaxing_specimens,
            _heating_by_loss,
            "force that falls while the rubber is worked fast, and comes back at rest",
            "first law of thermodynamics; Medalia 1991; Schapery 1964",
            "self-heating",
        ),
    ),
)
