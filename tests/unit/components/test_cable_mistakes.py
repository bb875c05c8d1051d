"""Cams and cables: what they refuse, with names."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from nlsdesign.components import ROTATION, AnchoredCam, CapstanFriction, Guide, OneSidedCam, Part, Spring
from nlsdesign.foundation.errors import ArrangementError, NlsError, UnitError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from tests.parts.cable import ROW


def capstan(**numbers: object) -> CapstanFriction:
    guide = Guide(**{"friction": 0.1, "wrap_angle": 1.0, **numbers})  # type: ignore[arg-type]
    return CapstanFriction(members=(("k", Spring(stiffness=1e3)),), guide=guide)


def anchored(**numbers: object) -> AnchoredCam:
    given = {"support": ROW, "last_direction": 1.2, "anchor_distance": 0.035, **numbers}
    return AnchoredCam(**given)  # type: ignore[arg-type]


WRONG: dict[str, tuple[Callable[[], Part], type[NlsError], str]] = {
    "an anchor inside the cam": (
        lambda: anchored(anchor_distance=0.015),
        ArrangementError,
        r"anchor_distance = 0\.015 m.*reaches its anchor: support up to 15\.96 mm",
    ),
    "a contact beyond the anchor": (
        lambda: anchored(support=tuple(0.03 * i for i in range(8)), anchor_distance=0.2),
        ArrangementError,
        r"reaches its anchor.*contact up to",
    ),
    "too few control values": (
        lambda: anchored(support=(0.01, 0.02)),
        ValueRangeError,
        "support with 2 control values.*at least 5",
    ),
    "one control value": (
        lambda: OneSidedCam(lever_arm=(0.01,) * 3, last_angle=1.0),
        ValueRangeError,
        "lever_arm with 3 control values",
    ),
    "an onset of degrees taken for radians": (
        lambda: OneSidedCam(lever_arm=ROW, last_angle=1.0, onset=5.0),
        ValueRangeError,
        "onset = 5 rad",
    ),
    "a distance in newtons": (
        lambda: anchored(anchor_distance=quantity(3.0, "N")),
        UnitError,
        "anchor_distance = 3 N.*like 'm'",
    ),
    "negative friction": (lambda: capstan(friction=-0.1), ValueRangeError, "friction = -0.1"),
    "negative wrap": (lambda: capstan(wrap_angle=-1.0), ValueRangeError, "wrap_angle = -1 rad"),
    "a guide for torques": (
        lambda: CapstanFriction(
            members=(("k", Spring(stiffness=1.0, domain=ROTATION)),),
            guide=Guide(friction=0.1, wrap_angle=1.0),
        ),
        ArrangementError,
        "acts on extension and force.*behind the cam",
    ),
}


@pytest.mark.parametrize(("make", "kind", "message"), WRONG.values(), ids=list(WRONG))
def test_it_is_named(make: Callable[[], Part], kind: type[NlsError], message: str) -> None:
    with pytest.raises(kind, match=message):
        make()


def test_the_same_numbers_without_the_mistake_are_sound() -> None:
    assert capstan().parameters()["friction"].number == 0.1
    assert anchored().anchor_distance.number == 0.035
