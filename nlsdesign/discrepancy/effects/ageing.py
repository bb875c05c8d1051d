"""Effects of rubber that remembers its past: softening, set, heat."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from ...components import (
    Assembly,
    Element,
    Following,
    LargestMotion,
    PermanentSet,
    SelfHeating,
    StressSoftening,
    ViscousHeat,
    WorkHeat,
)
from ...components.core.domain import TRANSLATION
from .candidate import Unknown, wrapped
from .effect import Edit, Effect, Form
from .friction import number
from .places import stretched, wrapping
from .rubber import specimens


def _pieces(assembly: Assembly) -> list[str]:
    """Return the paths of what may age: specimens, and what else a cam stretches."""
    pieces = specimens(assembly)
    others = [p for p in stretched(assembly) if not any(s == p or s.startswith(f"{p}.") for s in pieces)]
    return [*pieces, *(path for path in others if assembly.element(path).domain == TRANSLATION)]


def _around(
    assembly: Assembly, path: str, name: str, wrapper: Callable[[str, Element], Element]
) -> tuple[Assembly, str]:
    """Return the assembly with a wrapper around a piece, and the wrapper's path."""
    owner = path.rpartition(".")[0]
    # A tie keeps its name and takes the wrapper; the piece in it is named unlike any number of it.
    edited = wrapped(assembly, path, name if owner else "piece", wrapper, read_outside=True)
    return edited, f"{owner}.{name}" if owner else path


def _softening(assembly: Assembly, path: str) -> Iterator[Edit]:
    softer = wrapping(StressSoftening, curve=LargestMotion(softening=number(0.1, "1")))
    edited, where = _around(assembly, path, "softening", softer)
    unknowns = (
        Unknown(f"{where}.softening", (0.15,), 1e-3, 0.95),
        Unknown(f"{where}.exponent", (1.0,), 0.2, 10.0, null=None),
    )
    yield Edit(edited, unknowns)


def _set(assembly: Assembly, path: str) -> Iterator[Edit]:
    longer = wrapping(PermanentSet, share=number(0.01, "1"), memory=Following())
    edited, where = _around(assembly, path, "setting", longer)
    yield Edit(edited, (Unknown(f"{where}.share", (0.03,), 1e-3, 0.7),))


def _heating(assembly: Assembly, path: str) -> Iterator[Edit]:
    cooling = number(10.0, "s")
    by_work = WorkHeat(halving_work=number(100.0, "J"), cooling_time=cooling)
    by_loss = ViscousHeat(halving_speed=number(1.0, "m/s"), cooling_time=cooling)
    sizes = ("halving_work", (20.0,), 1e-3, 1e5), ("halving_speed", (0.2,), 1e-3, 1e2)
    for heat, (size, starts, low, high) in zip((by_work, by_loss), sizes, strict=True):
        edited, where = _around(assembly, path, "heating", wrapping(SelfHeating, heat=heat))
        unknowns = (
            Unknown(f"{where}.{size}", starts, low, high, null=math.inf),
            Unknown(f"{where}.cooling_time", (10.0,), 0.5, 500.0, null=None),
        )
        yield Edit(edited, unknowns)


stress_softening = Effect(
    "stress_softening",
    "Rubber that is softer below the largest stretch it has had (Mullins effect).",
    210,
    (
        Form(
            _pieces,
            _softening,
            "the first stretch stiffer than the later ones, until the largest stretch is passed again",
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
            _pieces,
            _set,
            "no force until a certain extension, which grows with the largest stretch before",
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
    ),
)
