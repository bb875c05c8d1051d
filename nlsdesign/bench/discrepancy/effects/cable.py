"""Effects of cam and cable: compliance, slack, friction on a guide, cam turned or with a profile error."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ....components import (
    Assembly,
    Buckling,
    CamWithProfileError,
    CapstanFriction,
    Element,
    InextensibleCable,
    PullOnly,
    RollingPair,
    Slack,
    Specimen,
    StretchyCable,
    Tie,
    Turned,
    TwoSidedCam,
    WrapProduct,
)
from ....components.core.domain import TRANSLATION
from ....components.core.part import Part
from ....components.transmission.cam_drive import Through
from ....foundation.quantity import Quantity
from .effect import SOURCE, Edit, Effect, Form, Unknown, number, numbers_of, wrapped
from .places import effort_over_motion, laws, stretched, turning_ties, wrapping

_CONTROL_VALUES = 7
"""Of the error of a contour: four spans, a quarter of the contour each."""
_CREEP_SPEED = 2e-4
"""Speed in m/s at which a fitted cable still creeps over its guide."""


def _by_cable(assembly: Assembly) -> list[str]:
    """Return what cams stretch by a cable; between the pivots of a rolling pair there is none."""
    pairs = [path for path, element in laws(assembly) if _of_pair(element)]
    return [path for path in stretched(assembly) if not any(path.startswith(f"{pair}.") for pair in pairs)]


def _of_pair(part: Part) -> bool:
    return isinstance(part, Through) and isinstance(part.cam, RollingPair)


def _without_rate(assembly: Assembly) -> list[str]:
    return [path for path in _by_cable(assembly) if not assembly.element(path).needs_rate]


def _stretchy(assembly: Assembly, path: str) -> Iterator[Edit]:
    edited = wrapped(assembly, path, "elastic", wrapping(StretchyCable, stiffness=number(1e5, "N/m")))
    name, (effort, motion) = (
        f"{path.rpartition('.')[0]}.elastic.stiffness",
        effort_over_motion(assembly, path),
    )
    stiffness = Unknown(name, (3.0, 30.0), 0.1, 1e4, f"{effort} / {motion}", null=math.inf)
    yield Edit(edited, (stiffness,))


def _pulled(assembly: Assembly) -> list[str]:
    """Return what a cam stretches, with the cable of true contact that it may hang on.

    True contact asks where the piece inside rests; inside a slack wrapper it would rest anywhere.
    """
    paths = []
    for path in _by_cable(assembly):
        if assembly.element(path).domain == TRANSLATION:
            outer, owner = path, path.rpartition(".")[0]
            while owner and isinstance(assembly[owner], InextensibleCable):
                outer, owner = owner, owner.rpartition(".")[0]
            paths.append(outer)
    return paths


def _slack(assembly: Assembly, path: str) -> Iterator[Edit]:
    def around(name: str, element: Element) -> Element:
        return Slack(members=((name, element),), length=number(1e-4, "m")).smooth()

    edited = wrapped(assembly, path, "slack", around)
    yield Edit(edited, (_too_long(f"{path.rpartition('.')[0]}.slack", path),))


def _too_long(slack: str, path: str) -> Unknown:
    return Unknown(f"{slack}.length", (0.02, 0.1), 1e-4, 0.8, f"{path}.extension")


def _slack_in_grips(assembly: Assembly, name: str) -> Iterator[Edit]:
    """Yield a piece that hangs slack between its grips, which then cannot push whatever it remembers."""

    def around(inner: str, element: Element) -> Element:
        slack = Slack(members=((inner, element),), length=number(1e-4, "m")).smooth()
        return PullOnly(members=(("slack", slack),), width=number(1e-3, "N"))

    edited = wrapped(assembly, name, "piece", around, read_outside=True)
    yield Edit(edited, (_too_long(f"{name}.slack", name),))


def _tied_specimens(assembly: Assembly) -> list[str]:
    return [n for n, p in assembly.parts if isinstance(p, Tie) and isinstance(p.element, Specimen)]


def _buckling(assembly: Assembly, name: str) -> Iterator[Edit]:
    # A sensor of the force between the bodies goes on reading that, not what the piece would push.
    piece = (("piece", assembly.element(name)),)
    buckling = Buckling(members=piece, share=number(1.0, "1"), width=number(1e-3, "N"))
    # How sharp the corner is says nothing of whether it is there: that is the share.
    unknowns = (
        Unknown(f"{name}.share", (1.0,), -1.0, 2.5),
        Unknown(f"{name}.width", (0.01,), 1e-4, 0.2, f"{name}.force", null=None),
    )
    yield Edit(assembly.with_part(name, buckling), unknowns)


def _behind_cams(assembly: Assembly) -> list[str]:
    return [
        f"{path}.{p.behind[0]}" for path, p in laws(assembly) if isinstance(p, Through) and not _of_pair(p)
    ]


def _read_behind_cams(assembly: Assembly) -> list[str]:
    read = [sensor.of for sensor in assembly.sensors().values()]
    return [path for path in _behind_cams(assembly) if any(of.startswith(f"{path}.") for of in read)]


def _guided(assembly: Assembly, path: str, *, read_outside: bool = False) -> Iterator[Edit]:
    guide = wrapping(
        CapstanFriction, guide=WrapProduct(wrap=number(0.01, "1")), creep_speed=number(_CREEP_SPEED, "m/s")
    )
    edited = wrapped(assembly, path, "guide", guide, read_outside=read_outside)
    yield Edit(edited, (Unknown(f"{path.rpartition('.')[0]}.guide.wrap", (0.05,), 1e-3, 2.0),))


def _guided_inside(assembly: Assembly, path: str) -> Iterator[Edit]:
    return _guided(assembly, path, read_outside=True)


def _holds_cam(part: Part) -> bool:
    return isinstance(part, Through)


def _turning_cams(assembly: Assembly) -> list[str]:
    return turning_ties(assembly, _holds_cam)


def _turned(assembly: Assembly, name: str) -> Iterator[Edit]:
    edited = wrapped(assembly, name, "turned", wrapping(Turned, offset=number(0.0, "rad")))
    yield Edit(edited, (Unknown(f"{name}.offset", (-0.02, 0.02), -0.5, 0.5),))


def _contours(assembly: Assembly) -> list[str]:
    return [path for path, part in assembly.walk() if isinstance(part, TwoSidedCam)]


def _with_profile_error(assembly: Assembly, path: str) -> Iterator[Edit]:
    error = Quantity((0.0,) * _CONTROL_VALUES, "m", SOURCE)
    cam = CamWithProfileError(**numbers_of(assembly[path]), error=error)
    of = f"{path}.lever_arm_now"
    items = range(1, _CONTROL_VALUES + 1)
    unknowns = tuple(Unknown(f"{path}.error[{i}]", (0.0,), -0.5, 0.5, of) for i in items)
    yield Edit(assembly.with_part(path, cam), unknowns)


cable_compliance = Effect(
    "cable_compliance",
    "A cable that stretches, in series with what the cam stretches.",
    80,
    (
        Form(
            _without_rate,
            _stretchy,
            "force that falls short the more, the larger it is, without loss",
            "Hooke 1678",
            "cable compliance",
        ),
    ),
)
cable_slack = Effect(
    "cable_slack",
    "A cable that is too long, rubber that has set, or a piece that buckles instead of pushing.",
    90,
    (
        Form(
            _pulled, _slack, "no force until a certain extension, the same at any speed", "geometry", "slack"
        ),
        Form(
            _tied_specimens,
            _slack_in_grips,
            "no force until a certain extension, the same in every cycle, and never a push",
            "geometry",
            "slack",
        ),
        Form(
            _tied_specimens,
            _buckling,
            "no force on the way back from where the memory of the piece would have to push",
            "geometry",
            "unilateral contact",
        ),
    ),
)
cam_angle_offset = Effect(
    "cam_angle_offset",
    "A cam that sits turned on its shaft.",
    100,
    (
        Form(
            _turning_cams,
            _turned,
            "more force on one side than at the same angle on the other",
            "geometry",
            "angle offset",
        ),
    ),
)
cam_profile_error = Effect(
    "cam_profile_error",
    "A cam whose profile deviates from its drawing; pulleys have no profile.",
    190,
    (
        Form(
            _contours,
            _with_profile_error,
            "force and torque over the angle that are off together, at any speed and on both sides alike",
            "virtual work",
            "profile error",
        ),
    ),
)
cable_friction = Effect(
    "cable_friction",
    "A cable that rubs on a guide: between load cell and cam, or where nothing reads its force, anywhere.",
    240,
    (
        Form(
            _behind_cams,
            _guided,
            "force in proportion to the load, against the motion, between motor and load cell",
            "Euler 1769, Eytelwein 1808",
            "cable friction",
        ),
        Form(
            _read_behind_cams,
            _guided_inside,
            "a loop of force over extension in proportion to the force, at any speed",
            "Euler 1769, Eytelwein 1808",
            "cable friction",
        ),
    ),
)
