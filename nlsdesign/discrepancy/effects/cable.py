"""Effects of cam and cable: compliance, slack, a turned cam."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...components import (
    Assembly,
    CableGuide,
    InextensibleCable,
    MisshapenCam,
    PullOnly,
    Slack,
    StretchyCable,
    Tie,
    Turned,
    TwoSidedCam,
)
from ...components.core.element import ROTATION, TRANSLATION, Element
from ...components.transmission.cam_drive import Through
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, numbers_of, wrapped
from .large_strain import buckling

_CONTROL_VALUES = 7
"""Of the error of a contour: four spans, a quarter of the contour each."""


def stretched(assembly: Assembly) -> list[str]:
    """Return the paths of what a cam stretches: behind the cam, and inside a cable that only pulls.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path, part in assembly.walk():
        element = part.element if isinstance(part, Tie) else part
        if isinstance(element, Through):
            inner = f"{path}.{element.behind[0]}"
            while (
                isinstance(assembly[inner], PullOnly | InextensibleCable | Slack | CableGuide)
                and len(assembly[inner].children()) == 1
            ):
                inner = f"{inner}.{next(iter(assembly[inner].children()))}"
            found.append(inner)
    return found


def is_inside(assembly: Assembly, path: str, kind: type[Element]) -> bool:
    """Tell whether a part, or any part around it, is of a kind.

    Parameters
    ----------
    assembly
        As declared.
    path
        Of the part.
    kind
        Of element.
    """
    owners = path.split(".")
    parts = [assembly[".".join(owners[: i + 1])] for i in range(len(owners))]
    return any(isinstance(p.element if isinstance(p, Tie) else p, kind) for p in parts)


def cable_compliance(assembly: Assembly) -> Sequence[Candidate]:
    """A cable that stretches, in series with what the cam stretches.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path in stretched(assembly):
        if is_inside(assembly, path, StretchyCable) or assembly.element(path).needs_rate:
            continue
        stiffness = Quantity(1e5, "N/m", SOURCE)
        edited = wrapped(assembly, path, "elastic", _stretchy(stiffness))
        name = f"{path.rpartition('.')[0]}.elastic.stiffness"
        found.append(
            Candidate(
                "cable_compliance",
                path,
                edited,
                (Unknown(name, (3e4, 3e5), 1e3, 1e7),),
                "force that falls short the more, the larger it is, without loss",
                "Hooke 1678",
            )
        )
    return found


def cable_slack(assembly: Assembly) -> Sequence[Candidate]:
    """A cable that is too long, rubber that has set, or a piece that buckles instead of pushing.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for inner in stretched(assembly):
        if is_inside(assembly, inner, Slack) or assembly[inner].domain != TRANSLATION:  # type: ignore[attr-defined]
            continue
        # True contact asks where the piece inside rests; inside a slack wrapper it would rest anywhere.
        path, owner = inner, inner.rpartition(".")[0]
        while owner and isinstance(assembly[owner], InextensibleCable):
            path, owner = owner, owner.rpartition(".")[0]
        length = Quantity(1e-4, "m", SOURCE)
        edited = wrapped(assembly, path, "slack", _slack(length))
        of = f"{path}.extension"
        found.append(
            Candidate(
                "cable_slack",
                path,
                edited,
                (Unknown(f"{path.rpartition('.')[0]}.slack.length", (0.02, 0.1), 1e-4, 0.8, of),),
                "no force until a certain extension, the same at any speed",
                "geometry",
            )
        )
    return [*found, *buckling(assembly)]


def cable_friction(assembly: Assembly) -> Sequence[Candidate]:
    """A cable that rubs on a guide: between load cell and cam, or where nothing reads its force, anywhere.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for path, part in assembly.walk():
        element = part.element if isinstance(part, Tie) else part
        if not isinstance(element, Through) or isinstance(element.behind[1], CableGuide):
            continue
        for outside in (False, True) if _is_read(assembly, f"{path}.{element.behind[0]}") else (False,):
            edited = wrapped(assembly, f"{path}.{element.behind[0]}", "guide", _guide, read_outside=outside)
            found.append(
                Candidate(
                    "cable_friction",
                    f"{path}.{element.behind[0]}",
                    edited,
                    (Unknown(f"{path}.guide.wrap", (0.05,), 1e-3, 2.0),),
                    "force in proportion to the load, against the motion, between motor and load cell"
                    if not outside
                    else "a loop of force over extension in proportion to the force, at any speed",
                    "Euler 1769, Eytelwein 1808",
                )
            )
    return found


def _guide(name: str, element: Element) -> Element:
    return CableGuide(members=((name, element),), wrap=Quantity(0.01, "1", SOURCE))


def _is_read(assembly: Assembly, path: str) -> bool:
    return any(sensor.of.startswith(f"{path}.") for sensor in assembly.sensors().values())


def cam_angle_offset(assembly: Assembly) -> Sequence[Candidate]:
    """A cam that sits turned on its shaft.

    Parameters
    ----------
    assembly
        As declared.
    """
    found = []
    for name, part in assembly.parts:
        if not isinstance(part, Tie) or part.element.domain != ROTATION or not _holds_cam(assembly, name):
            continue
        if isinstance(part.element, Turned):
            continue
        edited = wrapped(
            assembly,
            name,
            "turned",
            lambda n, e: Turned(members=((n, e),), offset=Quantity(0.0, "rad", SOURCE)),
        )
        found.append(
            Candidate(
                "cam_angle_offset",
                name,
                edited,
                (Unknown(f"{name}.offset", (-0.02, 0.02), -0.5, 0.5),),
                "more force on one side than at the same angle on the other",
                "geometry",
            )
        )
    return found


def cam_profile_error(assembly: Assembly) -> Sequence[Candidate]:
    """A cam that was not cut as it was drawn.

    Parameters
    ----------
    assembly
        As declared; pulleys have no profile.
    """
    found = []
    for path, part in assembly.walk():
        if not isinstance(part, TwoSidedCam) or isinstance(part, MisshapenCam):
            continue
        error = Quantity((0.0,) * _CONTROL_VALUES, "m", SOURCE)
        of = f"{path}.lever_arm_now"
        found.append(
            Candidate(
                "cam_profile_error",
                path,
                assembly.with_part(path, MisshapenCam(**numbers_of(part), error=error)),
                tuple(
                    Unknown(f"{path}.error[{i}]", (0.0,), -0.5, 0.5, of)
                    for i in range(1, _CONTROL_VALUES + 1)
                ),
                "force and torque over the angle that are off together, at any speed and on both sides alike",
                "virtual work",
            )
        )
    return found


def _holds_cam(assembly: Assembly, name: str) -> bool:
    return any(
        isinstance(p.element if isinstance(p, Tie) else p, Through)
        for path, p in assembly.walk()
        if path == name or path.startswith(name + ".")
    )


def _stretchy(stiffness: Quantity) -> Callable[[str, Element], Element]:
    return lambda name, element: StretchyCable(members=((name, element),), stiffness=stiffness)


def _slack(length: Quantity) -> Callable[[str, Element], Element]:
    return lambda name, element: Slack(members=((name, element),), length=length)
