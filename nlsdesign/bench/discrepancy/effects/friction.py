"""Effects of friction: dry, falling with speed, growing with load, of one place, drag."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from ....components import (
    Assembly,
    AsymmetricFriction,
    CoulombFriction,
    Dashpot,
    Driven,
    Element,
    GearFriction,
    LoadFriction,
    QuadraticDrag,
    SpotFriction,
    StribeckFriction,
    Tie,
    WavyFriction,
    tie,
)
from ....components.core.domain import Domain
from ....components.mechanics.bodies import Free
from ....foundation.quantity import Quantity, significant
from .effect import SOURCE, Edit, Effect, Form, Places, Unknown, free_name, number, numbers_of, wrapped
from .places import (
    beside,
    domain_of,
    driven_ties,
    driving_end,
    laws,
    loaded_ties,
    moving_bodies,
    ties_between_bodies,
    turning_bodies,
)
from .sizes import efforts_on, span_of


def tied(assembly: Assembly, name: str, body: str, element: Element) -> tuple[Assembly, str]:
    """Return the assembly with one more element on a body, and the element's name."""
    part = free_name(assembly, name)
    return assembly.with_part(part, tie(element, body)), part


_SHARE_OF_SLOWEST = 0.2
"""Width of the sign of friction, in the slowest speed that the records resolve: there the sign is 0.9999."""
_LEAST_WIDTH = {"rad/s": 1e-6, "m/s": 1e-9}
"""The least width that a law of friction takes: records in a wrong unit would ask for less."""


def with_resolved_signs(before: Assembly, after: Assembly, slowest: Mapping[str, float]) -> Assembly:
    """Return an edited assembly whose new friction changes its sign as sharply as the records resolve.

    A width that the records could see would be paid for by something else. What is declared ``before`` stays.
    ``slowest``: least speed that the records resolve, by name of the body.
    """
    declared, widths = {id(each) for each in before.quantities().values()}, dict[str, Quantity]()
    for name, width in after.quantities().items():
        part = after[name.partition(".")[0]]
        ends = part.between if isinstance(part, Tie) else ()
        moving = [end for end in ends if isinstance(after[end], Driven | Free)]
        if name.endswith(".creep_speed") and id(width) not in declared and set(moving) <= slowest.keys():
            least = min((_SHARE_OF_SLOWEST * slowest[end] for end in moving), default=math.inf)
            if 0.0 < least < width.number:
                least = max(significant([least])[0], _LEAST_WIDTH[width.unit])
                widths[name] = number(least, width.unit)
    return after.with_values(widths) if widths else after


def _with_law(
    assembly: Assembly, place: str, wanted: str, law: Callable[[Domain], Element]
) -> tuple[Assembly, str]:
    """Return the assembly with a law on a body that moves freely or beside a strained piece, and its path.

    The law is made for the domain of the place.
    """
    if isinstance(assembly[place], Free):
        return tied(assembly, wanted, place, law(domain_of(assembly, place)))
    return beside(assembly, place, wanted, law(assembly.element(place).domain))


class _Signals(NamedTuple):
    """Signals around a place, in which numbers of friction there are counted.

    The effort is the largest one on a body, or that of a tie; motion and speed are those of the body, or of
    what drives the tie.
    """

    effort: str
    motion: str
    speed: str


def _signals_at(assembly: Assembly, place: str) -> _Signals:
    on_body = isinstance(assembly[place], Free)
    body = place if on_body else driving_end(assembly, place)
    effort = efforts_on(place) if on_body else f"{place}.{assembly.element(place).domain.effort}"
    motion, speed = assembly[body].motion_names  # type: ignore[attr-defined]
    return _Signals(effort, f"{body}.{motion}", f"{body}.{speed}")


def _coulomb(assembly: Assembly, place: str) -> Iterator[Edit]:
    def law(domain: Domain) -> Element:
        level = number(0.01, domain.effort_unit)
        return CoulombFriction(sliding_effort=level, domain=domain).smooth()

    edited, path = _with_law(assembly, place, "dry_friction", law)
    around = _signals_at(assembly, place)
    yield Edit(edited, (Unknown(f"{path}.sliding_effort", (0.05,), 1e-4, 2.0, around.effort),))


def _stribeck(assembly: Assembly, place: str) -> Iterator[Edit]:
    def law(domain: Domain) -> Element:
        level, speed = number(0.01, domain.effort_unit), number(0.2, domain.rate_unit)
        return StribeckFriction(
            sliding_effort=level, breakaway=level, stribeck_speed=speed, domain=domain
        ).smooth()

    edited, path = _with_law(assembly, place, "dry_friction", law)
    around = _signals_at(assembly, place)
    unknowns = (
        Unknown(f"{path}.sliding_effort", (0.05,), 1e-4, 2.0, around.effort),
        Unknown(f"{path}.breakaway", (0.05,), 1e-4, 2.0, around.effort),
        _stribeck_speed(path, around),
    )
    yield Edit(edited, unknowns, {"simpler": ("coulomb_friction",)})


def _stribeck_speed(path: str, around: _Signals) -> Unknown:
    name, width = f"{path}.stribeck_speed", f"{path}.creep_speed"
    return Unknown(name, (0.015, 0.08), 1e-3, 1.5, around.speed, null=None, above=width)


def _even_friction(assembly: Assembly, place: str) -> str | None:
    """Return the path of even dry friction on a body, or inside a tie."""
    for path, part in laws(assembly):
        owner = assembly[path.partition(".")[0]]
        on_body = isinstance(owner, Tie) and place in owner.between
        if type(part) is CoulombFriction and (on_body or path.startswith(f"{place}.")):
            return path
    return None


def _without(kind: type[Element], bodies: Places) -> Places:
    """Return the bodies on which no friction of a kind acts."""

    def places(assembly: Assembly) -> list[str]:
        owners = ((assembly[path.partition(".")[0]], part) for path, part in laws(assembly))
        having = [p.between for p, law in owners if isinstance(law, kind) and isinstance(p, Tie)]
        return [body for body in bodies(assembly) if not any(body in ends for ends in having)]

    return places


def _rubbing(assembly: Assembly) -> list[str]:
    """Return the bodies and ties with even dry friction, declared or added before."""
    places = [*moving_bodies(assembly), *driven_ties(assembly)]
    return [place for place in places if _even_friction(assembly, place)]


def _declared_friction(assembly: Assembly, place: str) -> str | None:
    """Return the path of even dry friction that the deck declares.

    What an effect has added has richer forms of its own.
    """
    path = _even_friction(assembly, place)
    return path if path and assembly.quantities()[f"{path}.sliding_effort"].source != SOURCE else None


def _as_declared(places: Places) -> Places:
    """Return the places with even dry friction that the deck declares."""
    return lambda assembly: [each for each in places(assembly) if _declared_friction(assembly, each)]


def _falling(assembly: Assembly, place: str) -> Iterator[Edit]:
    """Let declared friction fall with speed: its level is that of fast sliding."""
    path = _declared_friction(assembly, place)
    if path is not None:
        even, around = assembly.element(path), _signals_at(assembly, place)
        more, speed = number(0.01, even.domain.effort_unit), number(0.2, even.domain.rate_unit)
        falling = StribeckFriction(**numbers_of(even), breakaway=more, stribeck_speed=speed)
        unknowns = (
            Unknown(f"{path}.breakaway", (0.05,), 1e-4, 2.0, around.effort),
            _stribeck_speed(path, around),
        )
        yield Edit(assembly.with_part(path, falling), unknowns)


def _waving(assembly: Assembly, body: str) -> Iterator[Edit]:
    """Let declared friction come round with the angle: its level stays what it is, in the mean."""
    path = _declared_friction(assembly, body)
    if path is not None:
        kept = {name: value for name, value in numbers_of(assembly.element(path)).items() if name != "domain"}
        waving = WavyFriction(**kept, sine=number(0.0, "N*m"), cosine=number(0.0, "N*m"))
        unknowns = tuple(
            Unknown(f"{path}.{part}", (0.0,), -2.0, 2.0, efforts_on(body)) for part in ("sine", "cosine")
        )
        yield Edit(assembly.with_part(path, waving), unknowns)


def _asymmetric(assembly: Assembly, place: str) -> Iterator[Edit]:
    """Let even friction differ between the directions: its level stays what it is, in the mean."""
    path = _even_friction(assembly, place)
    if path is not None:
        even = assembly.element(path)
        uneven = AsymmetricFriction(**numbers_of(even), asymmetry=number(0.0, "1"))
        yield Edit(assembly.with_part(path, uneven), (Unknown(f"{path}.asymmetry", (0.0,), -1.0, 1.0),))


def _loaded(assembly: Assembly, name: str) -> Iterator[Edit]:
    def around(inner: str, element: Element) -> Element:
        return LoadFriction(members=((inner, element),), ratio=number(0.01, "1")).smooth()

    outside = name in driven_ties(assembly)
    edited = wrapped(assembly, name, "driven", around, read_outside=outside)
    yield Edit(edited, (Unknown(f"{name}.ratio", (0.05,), 1e-4, 0.9),))


def _geared(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Let the gear in front of a spring rub in proportion to what the spring carries."""

    def around(inner: str, element: Element) -> Element:
        return GearFriction(members=((inner, element),), ratio=number(0.01, "1")).smooth()

    edited = wrapped(assembly, name, "driven", around, read_outside=True)
    yield Edit(edited, (Unknown(f"{name}.ratio", (0.05,), 1e-4, 0.9),))


def _undamped(assembly: Assembly) -> list[str]:
    """Return the moving bodies on which no viscous friction against the resting frame is declared."""
    ties = ((path.partition(".")[0], part) for path, part in laws(assembly) if isinstance(part, Dashpot))
    ends = (assembly[name].between for name, _ in ties if isinstance(assembly[name], Tie))  # type: ignore[attr-defined]
    free = {*moving_bodies(assembly)}
    damped = {body for bodies in ends if len(free & set(bodies)) == 1 for body in bodies}
    return [body for body in moving_bodies(assembly) if body not in damped]


def _growing(power: int) -> Callable[[Assembly, str], Iterator[Edit]]:
    """Return the edit that adds friction in proportion to a power of the speed, the first or the second."""
    kind, name = ((Dashpot, "damping"), (QuadraticDrag, "drag"))[power - 1]

    def edit(assembly: Assembly, place: str) -> Iterator[Edit]:
        def law(domain: Domain) -> Element:
            unit = domain.unit("{effort}*s/{motion}" if power == 1 else "{effort}*s^2/{motion}^2")
            return kind(**{name: number(1e-3, unit)}, domain=domain)

        edited, path = _with_law(assembly, place, "viscous_friction" if power == 1 else "drag", law)
        around = _signals_at(assembly, place)
        of = " / ".join([around.effort, *[around.speed] * power])
        yield Edit(edited, (Unknown(f"{path}.{name}", (0.05,), 1e-4 * 0.1**power, 10.0, of),))

    return edit


def _spot(assembly: Assembly, place: str) -> Iterator[Edit]:
    def law(domain: Domain) -> Element:
        level, at = number(0.01, domain.effort_unit), number(0.0, domain.motion_unit)
        width = number(0.1, domain.motion_unit)
        return SpotFriction(sliding_effort=level, place=at, width=width, domain=domain).smooth()

    edited, path = _with_law(assembly, place, "rubbing", law)
    around = _signals_at(assembly, place)
    unknowns = (
        Unknown(f"{path}.sliding_effort", (0.1,), 1e-4, 5.0, around.effort),
        Unknown(f"{path}.place", (-0.7, -0.35, 0.0, 0.35, 0.7), -1.2, 1.2, around.motion, null=None),
        # A spot as wide as the motion is friction everywhere.
        Unknown(f"{path}.width", (0.25,), 0.01, 0.5, span_of(around.motion), null=None),
    )
    yield Edit(edited, unknowns, {"simpler": ("coulomb_friction",)})


def _wavy(assembly: Assembly, body: str) -> Iterator[Edit]:
    zero = number(0.0, "N*m")
    friction = WavyFriction(sliding_effort=number(0.01, "N*m"), sine=zero, cosine=zero).smooth()
    edited, part = tied(assembly, "dry_friction", body, friction)
    unknowns = (
        Unknown(f"{part}.sliding_effort", (0.05,), 1e-4, 2.0, efforts_on(body)),
        Unknown(f"{part}.sine", (0.0,), -2.0, 2.0, efforts_on(body)),
        Unknown(f"{part}.cosine", (0.0,), -2.0, 2.0, efforts_on(body)),
    )
    yield Edit(edited, unknowns, {"simpler": ("coulomb_friction",)})


def _on_bodies_and_strained_pieces(
    edits: Callable[[Assembly, str], Iterator[Edit]], signature: str, source: str, brings: str
) -> tuple[Form, Form]:
    """Return the forms of friction on a body that moves freely, and beside what is strained from outside."""
    strained = f"{signature} in the reading of a piece under test"
    return (
        Form(moving_bodies, edits, signature, source, brings),
        Form(driven_ties, edits, strained, source, brings),
    )


_DRY = "Coulomb 1785; Armstrong-Hélouvry 1991"

coulomb_friction = Effect(
    "coulomb_friction",
    "Dry friction on a body that turns or slides, or in a piece that is strained from outside.",
    10,
    _on_bodies_and_strained_pieces(
        _coulomb,
        "a constant effort against the motion, that jumps where the speed changes sign",
        _DRY,
        "dry friction",
    ),
)
stribeck_friction = Effect(
    "stribeck_friction",
    "Dry friction that falls with speed, on a body that turns or slides.",
    20,
    (
        *_on_bodies_and_strained_pieces(
            _stribeck,
            "an effort against the motion that is largest just off standstill",
            "Stribeck 1902; Armstrong-Hélouvry 1991",
            "dry friction",
        ),
        Form(
            _as_declared(_rubbing),
            _falling,
            "more friction just off standstill than is declared for all speeds",
            "Stribeck 1902; Armstrong-Hélouvry 1991",
        ),
    ),
)
load_dependent_friction = Effect(
    "load_dependent_friction",
    "Friction in proportion to the effort that a spring or a weight puts on what drives it.",
    30,
    (
        Form(
            loaded_ties,
            _loaded,
            "an effort against the motion in proportion to the load",
            "Coulomb 1785; Niemann and Winter 2003 (efficiency of gears)",
            "load friction",
        ),
        Form(
            ties_between_bodies,
            _geared,
            "a torque against the motion of the drive alone, in proportion to what it carries",
            "Coulomb 1785; Niemann and Winter 2003 (efficiency of gears)",
            "load friction",
        ),
    ),
)
viscous_friction = Effect(
    "viscous_friction",
    "Friction in proportion to the speed, on a body that turns or slides and has none declared.",
    35,
    (
        Form(
            _undamped,
            _growing(1),
            "an effort against the motion in proportion to the speed",
            "Newton 1687, book II",
        ),
    ),
)
quadratic_drag = Effect(
    "quadratic_drag",
    "Drag that grows with the square of the speed, on a body that turns or slides.",
    40,
    _on_bodies_and_strained_pieces(
        _growing(2),
        "an effort against the motion that grows with the square of the speed",
        "Newton 1687, book II; Batchelor 1967",
        "drag",
    ),
)
asymmetric_friction = Effect(
    "asymmetric_friction",
    "Dry friction that differs between the directions: in motion the same as a constant load beside it.",
    265,
    (
        Form(
            _rubbing,
            _asymmetric,
            "an effort against the motion that is larger in one direction",
            "Coulomb 1785; Armstrong-Hélouvry 1991 (levels by direction)",
        ),
    ),
)
position_dependent_friction = Effect(
    "position_dependent_friction",
    "Dry friction that depends on the place: at one spot, or coming round with the angle.",
    165,
    (
        Form(
            _without(WavyFriction, moving_bodies),
            _spot,
            "an effort against the motion in one place only",
            "Coulomb 1785; Armstrong-Hélouvry 1991 (friction that depends on position)",
            "friction of a place",
        ),
        Form(
            _without(SpotFriction, turning_bodies),
            _wavy,
            "a torque against the motion that is larger in one half of each turn",
            "Coulomb 1785; Armstrong-Hélouvry 1991 (friction that depends on position)",
            "dry friction",
        ),
        Form(
            _as_declared(turning_bodies),
            _waving,
            "more friction in one half of each turn than is declared, and less in the other",
            "Coulomb 1785; Armstrong-Hélouvry 1991 (friction that depends on position)",
        ),
    ),
)
