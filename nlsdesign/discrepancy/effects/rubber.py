"""Effects of a piece of rubber: more relaxation, hysteresis that knows no rate, stiffening."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...components import (
    Assembly,
    FlowingChains,
    Hyperelastic,
    LinearElastic,
    Rounded,
    SlidingFillers,
    Specimen,
    StrainStiffening,
    ViscousMaterial,
    series,
)
from ...quantity import Quantity
from .candidate import SOURCE, Unknown
from .effect import Edit, Effect, Form
from .friction import number
from .places import laws

_MOST_BRANCHES = 3
_STARTS = {1: ((3e4, 3e5, 3e6),), 2: ((3e4, 3e5), (3e6,))}
"""Viscosities in Pa·s where fits begin, by the number of branches: from quick to slow."""


def specimens(assembly: Assembly, *, without: str = "") -> list[str]:
    """Return the paths of pieces of material.

    Parameters
    ----------
    assembly
        As declared.
    without
        Name of a law that they must not have yet.
    """
    return [
        p for p, piece in laws(assembly) if isinstance(piece, Specimen) and without not in piece.children()
    ]


def _without_second(assembly: Assembly) -> list[str]:
    return specimens(assembly, without="second_relaxing")


def _second_relaxation(assembly: Assembly, path: str) -> Iterator[Edit]:
    branch = series(
        spring=LinearElastic(modulus=number(1e5, "Pa")),
        dashpot=ViscousMaterial(viscosity=number(1e5, "Pa*s")),
    )
    inner = f"{path}.second_relaxing"
    unknowns = (
        Unknown(f"{inner}.spring.modulus", (3e5,), 1e3, 1e8),
        Unknown(f"{inner}.dashpot.viscosity", (3e4, 3e5, 2e6), 1e2, 1e10, null=None),
    )
    yield Edit(assembly.with_part(inner, branch), unknowns)


def _at_large_stretch(assembly: Assembly) -> list[str]:
    """Return the pieces whose equilibrium law is one of large stretch."""
    pieces = ((path, piece) for path, piece in laws(assembly) if isinstance(piece, Specimen))
    return [path for path, p in pieces if any(isinstance(law, Hyperelastic) for _, law in p.members)]


def _flowing(assembly: Assembly, path: str) -> Iterator[Edit]:
    """Add one or two branches; two at once are a hypothesis of their own.

    What one time constant leaves over is small beside what it explains, however plain it is.
    """
    there = assembly.element(path).children()
    names = [f"flowing_{n}" for n in range(1, _MOST_BRANCHES + 1)]
    left = [f"{path}.{name}" for name in names if name not in there]
    for count in _STARTS:
        if count <= len(left):
            yield _branches(assembly, left[:count])


def _branches(assembly: Assembly, names: Sequence[str]) -> Edit:
    law = FlowingChains(shear_modulus=number(1e5, "Pa"), viscosity=number(1e6, "Pa*s"))
    unknowns: tuple[Unknown, ...] = ()
    for name, starts in zip(names, _STARTS[len(names)], strict=True):
        assembly = assembly.with_part(name, law)
        unknowns += (
            Unknown(f"{name}.shear_modulus", (3e4,), 1e2, 1e9),
            Unknown(f"{name}.viscosity", starts, 1e1, 1e12, null=None),
        )
    return Edit(assembly, unknowns)


def _fillers(assembly: Assembly, path: str) -> Iterator[Edit]:
    law = SlidingFillers(modulus=number(1e6, "Pa"), yield_stress=number(1e5, "Pa"))
    inner = f"{path}.fillers"
    unknowns = (
        Unknown(f"{inner}.modulus", (1e6,), 1e4, 1e9),
        Unknown(f"{inner}.yield_stress", (1e5,), 1e3, 1e8, null=None),
    )
    yield Edit(assembly.with_part(inner, law), unknowns)


def _without_stiffening(assembly: Assembly) -> list[str]:
    return specimens(assembly, without="stiffening")


def _stiffening(assembly: Assembly, path: str) -> Iterator[Edit]:
    law = StrainStiffening(
        modulus=Quantity((1e5,), "Pa", SOURCE),
        knots=Quantity((0.1,), "1", SOURCE),
        contact=Rounded(width=number(0.02, "1")),
    )
    inner = f"{path}.stiffening"
    unknowns = (
        Unknown(f"{inner}.modulus[1]", (3e5,), 1e2, 1e9),
        Unknown(f"{inner}.knots[1]", (0.4, 0.75), 0.01, 0.98, f"{path}.strain", null=None),
    )
    yield Edit(assembly.with_part(inner, law), unknowns)


second_relaxation = Effect(
    "second_relaxation",
    "One more relaxing branch in a piece of material, or one or two at large stretch.",
    110,
    (
        Form(
            _without_second,
            _second_relaxation,
            "force that creeps towards rest with a time constant of its own",
            "Maxwell 1867; Wiechert 1893 (Prony series)",
        ),
        Form(
            _at_large_stretch,
            _flowing,
            "force that creeps towards rest with a time constant of its own, less so the further stretched",
            "Green and Tobolsky 1946; Reese and Govindjee 1998",
        ),
    ),
)
rate_independent_hysteresis = Effect(
    "rate_independent_hysteresis",
    "Dry sliders inside a piece of material.",
    120,
    (
        Form(
            specimens,
            _fillers,
            "loops of force over extension as wide when slow as when fast, and no creep at rest",
            "Iwan 1967; Bouc 1967, Wen 1976",
            "hysteresis",
        ),
    ),
)
strain_stiffening = Effect(
    "strain_stiffening",
    "One more elastic law in a piece of material, that engages at a strain.",
    180,
    (
        Form(
            _without_stiffening,
            _stiffening,
            "force that grows more than declared where the strain is large, the same at any speed",
            "Treloar 1975; Austin et al. 2015, eq. (1)",
        ),
    ),
)
