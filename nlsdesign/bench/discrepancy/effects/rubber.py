"""Effects of rubber or another spring: more relaxation, hysteresis that knows no rate, stiffening."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ....components import (
    MATERIAL,
    Assembly,
    BoucWen,
    Dashpot,
    FlowingChains,
    HardeningSpring,
    Hyperelastic,
    LinearElastic,
    Rounded,
    SlidingFillers,
    SoftWindup,
    Specimen,
    Spring,
    StrainStiffening,
    ViscousMaterial,
    series,
)
from ....foundation.quantity import Quantity
from .effect import SOURCE, Edit, Effect, Form, Unknown, number
from .places import beside, effort_over_motion, laws, lumped_springs_without
from .sizes import LONGEST

_MOST_BRANCHES = 3
_TIMES = {1: ((3e-3, 3e-2, 0.3),), 2: ((3e-3, 3e-2), (0.3,))}
"""Relaxation times, in longest records, where fits begin, by the number of branches: from quick to slow."""


def _stress(assembly: Assembly, path: str) -> tuple[float, str, str]:
    """Return one over the section, and the sizes of force and of force over strain of a piece of material.

    Number and size together are those of stress and of modulus.
    """
    piece = assembly.element(path)
    assert isinstance(piece, Specimen)
    return 1.0 / piece.cross_section.square_metres, f"{path}.force", f"{path}.force / {path}.strain"


def specimens(assembly: Assembly, *, without: str = "") -> list[str]:
    """Return the paths of pieces of material."""
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
    inner, (per_area, _, stiffness) = f"{path}.second_relaxing", _stress(assembly, path)
    unknowns = _maxwell(inner, ("modulus", "viscosity"), per_area, stiffness)
    yield Edit(assembly.with_part(inner, branch), unknowns)


def _maxwell(inner: str, names: tuple[str, str], size: float, stiffness: str) -> tuple[Unknown, Unknown]:
    """Return the numbers of a branch; stiffness and time of relaxation are what the starts are of."""
    spring, dashpot = names
    times = (0.01, 0.1, 0.6)
    return (
        Unknown(f"{inner}.spring.{spring}", (0.2 * size,), 1e-4 * size, 100.0 * size, stiffness),
        Unknown(
            f"{inner}.dashpot.{dashpot}",
            tuple(0.2 * size * time for time in times),
            1e-7 * size,
            1e4 * size,
            f"{stiffness} * {LONGEST}",
            null=None,
        ),
    )


def _lumped_relaxation(assembly: Assembly, path: str) -> Iterator[Edit]:
    domain, (effort, motion) = assembly.element(path).domain, effort_over_motion(assembly, path)
    branch = series(
        spring=Spring(stiffness=number(1.0, domain.unit("{effort}/{motion}")), domain=domain),
        dashpot=Dashpot(damping=number(1.0, domain.unit("{effort}*s/{motion}")), domain=domain),
    )
    edited, inner = beside(assembly, path, "second_relaxing", branch)
    yield Edit(edited, _maxwell(inner, ("stiffness", "damping"), 1.0, f"{effort} / {motion}"))


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
    for count in _TIMES:
        if count <= len(left):
            yield _branches(assembly, path, left[:count])


def _branches(assembly: Assembly, path: str, names: Sequence[str]) -> Edit:
    size, _, stiffness = _stress(assembly, path)
    law = FlowingChains(shear_modulus=number(1e5, "Pa"), viscosity=number(1e6, "Pa*s"))
    unknowns: tuple[Unknown, ...] = ()
    for name, times in zip(names, _TIMES[len(names)], strict=True):
        assembly = assembly.with_part(name, law)
        starts, of = tuple(0.3 * size * time for time in times), f"{stiffness} * {LONGEST}"
        unknowns += (
            Unknown(f"{name}.shear_modulus", (0.3 * size,), 1e-4 * size, 100.0 * size, stiffness),
            Unknown(f"{name}.viscosity", starts, 1e-6 * size, 1e4 * size, of, null=None),
        )
    return Edit(assembly, unknowns)


def _fillers(assembly: Assembly, path: str) -> Iterator[Edit]:
    law = SlidingFillers(modulus=number(1e6, "Pa"), yield_stress=number(1e5, "Pa"))
    inner, (size, force, stiffness) = f"{path}.fillers", _stress(assembly, path)
    unknowns = (
        Unknown(f"{inner}.modulus", (0.5 * size,), 1e-3 * size, 300.0 * size, stiffness),
        Unknown(f"{inner}.yield_stress", (0.05 * size,), 1e-4 * size, 3.0 * size, force, null=None),
    )
    yield Edit(assembly.with_part(inner, law), unknowns)
    yield _round(assembly, path, size, (force, stiffness))


def _round(assembly: Assembly, path: str, size: float, sizes: tuple[str, str]) -> Edit:
    """Return a form with one state and a way of its own from sticking to sliding."""
    piece, (effort, stiffness) = assembly.element(path), sizes
    domain = MATERIAL if isinstance(piece, Specimen) else piece.domain
    law = BoucWen(
        stiffness=number(1.0, domain.unit("{effort}/{motion}")),
        yield_effort=number(1.0, domain.effort_unit),
        exponent=number(1.0, "1"),
        domain=domain,
    )
    edited, inner = beside(assembly, path, "sliding", law)
    unknowns = (
        Unknown(f"{inner}.stiffness", (0.5 * size,), 1e-3 * size, 300.0 * size, stiffness),
        Unknown(f"{inner}.yield_effort", (0.05 * size,), 1e-4 * size, 3.0 * size, effort, null=None),
        Unknown(f"{inner}.exponent", (1.0,), 0.15, 15.0, null=None, limiting=True),
    )
    return Edit(edited, unknowns)


def _lumped_sliding(assembly: Assembly, path: str) -> Iterator[Edit]:
    effort, motion = effort_over_motion(assembly, path)
    yield _round(assembly, path, 1.0, (effort, f"{effort} / {motion}"))


def _without_stiffening(assembly: Assembly) -> list[str]:
    return specimens(assembly, without="stiffening")


def _stiffening(assembly: Assembly, path: str) -> Iterator[Edit]:
    law = StrainStiffening(
        modulus=Quantity((1e5,), "Pa", SOURCE),
        knots=Quantity((0.1,), "1", SOURCE),
        contact=Rounded(width=number(0.02, "1")),
    )
    inner, (size, _, stiffness) = f"{path}.stiffening", _stress(assembly, path)
    unknowns = (
        Unknown(f"{inner}.modulus[1]", (0.3 * size,), 1e-4 * size, 300.0 * size, stiffness),
        Unknown(f"{inner}.knots[1]", (0.4, 0.75), 0.01, 0.98, f"{path}.strain", null=None),
    )
    yield Edit(assembly.with_part(inner, law), unknowns)
    yield from _hardening(assembly, path, size, (stiffness, f"{path}.strain"))


def _hardening(assembly: Assembly, path: str, size: float, sizes: tuple[str, str]) -> Iterator[Edit]:
    """Yield the smooth forms: a cubic, and one that grows exponentially beyond a scale of its own."""
    piece, (stiffness, motion) = assembly.element(path), sizes
    domain = MATERIAL if isinstance(piece, Specimen) else piece.domain
    far = Quantity(1e3, domain.motion_unit, "definition: so far away that the law is a cubic")
    law = HardeningSpring(cubic=number(1.0, domain.unit("{effort}/{motion}^3")), scale=far, domain=domain)
    edited, inner = beside(assembly, path, "stiffening", law)
    of = f"{stiffness} / {motion} / {motion}"
    cubic = Unknown(f"{inner}.cubic", (0.1 * size,), 1e-5 * size, 1e3 * size, of)
    yield Edit(edited, (cubic,))
    scale = Unknown(f"{inner}.scale", (0.5,), 0.05, 3.0, motion, null=None)
    yield Edit(edited.with_values({scale.name: number(1.0, domain.motion_unit)}), (cubic, scale))


def _lumped_stiffening(assembly: Assembly, path: str) -> Iterator[Edit]:
    effort, motion = effort_over_motion(assembly, path)
    yield from _hardening(assembly, path, 1.0, (f"{effort} / {motion}", motion))


def _soft_windup(assembly: Assembly, path: str) -> Iterator[Edit]:
    domain, (effort, motion) = assembly.element(path).domain, effort_over_motion(assembly, path)
    missing, width = number(0.0, domain.unit("{effort}/{motion}")), number(1.0, domain.motion_unit)
    edited, inner = beside(assembly, path, "windup", SoftWindup(missing=missing, width=width, domain=domain))
    unknowns = (
        Unknown(f"{inner}.missing", (0.4,), 1e-4, 0.95, f"{effort} / {motion}"),
        Unknown(f"{inner}.width", (0.1, 0.3), 0.02, 0.7, motion, null=None),
    )
    yield Edit(edited, unknowns)


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
        Form(
            lumped_springs_without("viscous friction"),
            _lumped_relaxation,
            "effort that creeps towards rest with a time constant of its own",
            "Maxwell 1867; Zener 1948",
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
        Form(
            lumped_springs_without("hysteresis"),
            _lumped_sliding,
            "loops of effort over motion as wide when slow as when fast, and no creep at rest",
            "Bouc 1967; Wen 1976",
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
        Form(
            lumped_springs_without("strain stiffening"),
            _lumped_stiffening,
            "effort that grows more than declared where the motion is large, the same at any speed",
            "Fung 1967; Ogden 1972",
            "strain stiffening",
        ),
    ),
)
soft_windup = Effect(
    "soft_windup",
    "A spring that is softer around its rest than beyond.",
    178,
    (
        Form(
            lumped_springs_without("soft wind-up"),
            _soft_windup,
            "effort that grows less than declared where the motion is small, the same at any speed",
            "Tuttle 1992",
            "soft wind-up",
        ),
    ),
)
