"""Effects of the rubber: more relaxation, hysteresis that knows no rate."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import (
    Assembly,
    LinearElastic,
    SlidingFillers,
    SmoothStrainStiffening,
    Specimen,
    Tie,
    ViscousMaterial,
    series,
)
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown
from .large_strain import large_strain_relaxation


def _specimens(assembly: Assembly, taken: str) -> list[str]:
    walked = ((path, part.element if isinstance(part, Tie) else part) for path, part in assembly.walk())
    return [path for path, piece in walked if isinstance(piece, Specimen) and taken not in piece.children()]


def second_relaxation(assembly: Assembly) -> Sequence[Candidate]:
    """One more Maxwell branch in a piece of material.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path in _specimens(assembly, "second_relaxing"):
        branch = series(
            spring=LinearElastic(modulus=Quantity(1e5, "Pa", SOURCE)),
            dashpot=ViscousMaterial(viscosity=Quantity(1e5, "Pa*s", SOURCE)),
        )
        inner = f"{path}.second_relaxing"
        found.append(
            Candidate(
                "second_relaxation",
                path,
                assembly.with_part(inner, branch),
                (
                    Unknown(f"{inner}.spring.modulus", (3e5,), 1e3, 1e8),
                    Unknown(f"{inner}.dashpot.viscosity", (3e4, 3e5, 2e6), 1e2, 1e10),
                ),
                "force that creeps towards rest with a time constant of its own",
                "Maxwell 1867; Wiechert 1893 (Prony series)",
            )
        )
    return [*found, *large_strain_relaxation(assembly)]


def rate_independent_hysteresis(assembly: Assembly) -> Sequence[Candidate]:
    """Dry sliders inside a piece of material.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path in _specimens(assembly, "fillers"):
        law = SlidingFillers(modulus=Quantity(1e6, "Pa", SOURCE), yield_stress=Quantity(1e5, "Pa", SOURCE))
        inner = f"{path}.fillers"
        found.append(
            Candidate(
                "rate_independent_hysteresis",
                path,
                assembly.with_part(inner, law),
                (
                    Unknown(f"{inner}.modulus", (1e6,), 1e4, 1e9),
                    Unknown(f"{inner}.yield_stress", (1e5,), 1e3, 1e8),
                ),
                "loops of force over extension as wide when slow as when fast, and no creep at rest",
                "Iwan 1967; Bouc 1967, Wen 1976",
            )
        )
    return found


def strain_stiffening(assembly: Assembly) -> Sequence[Candidate]:
    """One more elastic law in a piece of material, that engages at a strain.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path in _specimens(assembly, "stiffening"):
        law = SmoothStrainStiffening(
            modulus=Quantity((1e5,), "Pa", SOURCE),
            knots=Quantity((0.1,), "1", SOURCE),
            width=Quantity(0.02, "1", SOURCE),
        )
        inner = f"{path}.stiffening"
        found.append(
            Candidate(
                "strain_stiffening",
                path,
                assembly.with_part(inner, law),
                (
                    Unknown(f"{inner}.modulus[1]", (3e5,), 1e2, 1e9),
                    Unknown(f"{inner}.knots[1]", (0.4, 0.75), 0.01, 0.98, f"{path}.strain"),
                ),
                "force that grows more than declared where the strain is large, the same at any speed",
                "Treloar 1975; Austin et al. 2015, eq. (1)",
            )
        )
    return found
