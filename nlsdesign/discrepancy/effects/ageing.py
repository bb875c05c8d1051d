"""Effects of rubber that remembers its past: softening, set, heat."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...components import Assembly, Specimen, StressSoftening, TensionSet, ViscousHeating, WorkHeating
from ...components.core.element import TRANSLATION, Element
from ...quantity import Quantity
from .cable import is_inside, stretched
from .candidate import SOURCE, Candidate, Unknown, wrapped


def _pieces(assembly: Assembly, kind: type[Element]) -> list[str]:
    """Return the paths of what may age: specimens, and what else a cam stretches; not those that do."""
    specimens = [path for path, part in assembly.walk() if _is_specimen(assembly, path)]
    others = [p for p in stretched(assembly) if not any(s == p or s.startswith(f"{p}.") for s in specimens)]
    springs = [p for p in others if assembly.element(p).domain == TRANSLATION]
    return [path for path in (*specimens, *springs) if not is_inside(assembly, path, kind)]


def _is_specimen(assembly: Assembly, path: str) -> bool:
    part = assembly[path]
    return isinstance(getattr(part, "element", part), Specimen)


def _around(
    assembly: Assembly, path: str, name: str, wrapper: Callable[[str, Element], Element]
) -> tuple[Assembly, str]:
    """Return the assembly with a wrapper around a piece, and the wrapper's path."""
    owner = path.rpartition(".")[0]
    # A tie keeps its name and takes the wrapper; the piece in it is named unlike any number of it.
    edited = wrapped(assembly, path, name if owner else "piece", wrapper, read_outside=True)
    return edited, f"{owner}.{name}" if owner else path


def stress_softening(assembly: Assembly) -> Sequence[Candidate]:
    """Rubber that is softer below the largest stretch it has had (Mullins effect).

    Parameters
    ----------
    assembly
        As declared.
    """
    share = Quantity(0.1, "1", SOURCE)
    found = []
    for path in _pieces(assembly, StressSoftening):
        edited, where = _around(
            assembly, path, "softening", lambda n, e: StressSoftening(members=((n, e),), softening=share)
        )
        found.append(
            Candidate(
                "stress_softening",
                path,
                edited,
                (
                    Unknown(f"{where}.softening", (0.15,), 1e-3, 0.95),
                    Unknown(f"{where}.exponent", (1.0,), 0.2, 10.0),
                ),
                "the first stretch stiffer than the later ones, until the largest stretch is passed again",
                "Mullins 1969; Ogden and Roxburgh 1999",
            )
        )
    return found


def permanent_set(assembly: Assembly) -> Sequence[Candidate]:
    """Rubber whose rest length has grown by a share of the largest stretch it has had.

    Parameters
    ----------
    assembly
        As declared.
    """
    share = Quantity(0.01, "1", SOURCE)
    found = []
    for path in _pieces(assembly, TensionSet):
        edited, where = _around(
            assembly, path, "setting", lambda n, e: TensionSet(members=((n, e),), share=share)
        )
        found.append(
            Candidate(
                "permanent_set",
                path,
                edited,
                (Unknown(f"{where}.share", (0.03,), 1e-3, 0.7),),
                "no force until a certain extension, which grows with the largest stretch before",
                "Gent 2012",
            )
        )
    return found


def self_heating(assembly: Assembly) -> Sequence[Candidate]:
    """Rubber that grows soft as it is worked and recovers at rest: heat of all work, or of loss.

    Parameters
    ----------
    assembly
        As declared.
    """
    work, speed = Quantity(100.0, "J", SOURCE), Quantity(1.0, "m/s", SOURCE)
    cooling = Quantity(10.0, "s", SOURCE)
    found = []
    for path in _pieces(assembly, WorkHeating):
        if is_inside(assembly, path, ViscousHeating):
            continue
        by_work = _around(
            assembly,
            path,
            "heating",
            lambda n, e: WorkHeating(members=((n, e),), halving_work=work, cooling_time=cooling),
        )
        by_loss = _around(
            assembly,
            path,
            "heating",
            lambda n, e: ViscousHeating(members=((n, e),), halving_speed=speed, cooling_time=cooling),
        )
        sizes = ("halving_work", (20.0,), 1e-3, 1e5), ("halving_speed", (0.2,), 1e-3, 1e2)
        for (edited, where), (size, starts, low, high) in zip((by_work, by_loss), sizes, strict=True):
            unknowns = (
                Unknown(f"{where}.{size}", starts, low, high),
                Unknown(f"{where}.cooling_time", (10.0,), 0.5, 500.0),
            )
            found.append(
                Candidate(
                    "self_heating",
                    path,
                    edited,
                    unknowns,
                    "force that falls while the rubber is worked hard, and comes back at rest",
                    "first law of thermodynamics; Medalia 1991",
                )
            )
    return found
