"""A cam carries an element of extension and force to angle and torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Element, Scope, observed_effort
from ..core.part import RESERVED, Part, check_names
from ..core.part_numbers import parameter
from .cam import Cam


@dataclass(frozen=True, kw_only=True)
class Through(Element):
    """An element behind a cam: e = e₀ + δ(θ), T = N·h(θ)·F(e), with h = dδ/dθ and N equal elements.

    Source: virtual work, T·dθ = N·F·dδ, with an inextensible cable; Austin et al. 2015, eq. (4), without N.

    Parameters
    ----------
    cam
        Turns the angle into an extension.
    behind
        Name and element.

    Raises
    ------
    ArrangementError
        If the first is no cam, or what is behind it is no element of extension and force.
    """

    domain: ClassVar[Domain] = ROTATION
    phenomena: ClassVar[frozenset[str]] = frozenset({"cam"})

    cam: Cam
    behind: tuple[str, Element]
    pretension: Quantity = parameter(
        "m", "extension of the element at angle zero", minimum=0.0, maximum=0.5, default=0.0
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        name, element = self.behind
        check_names("through", [name], taken=RESERVED | {"cam", *self.parameter_infos()})
        if not isinstance(element, Element):
            raise ArrangementError(f"through: '{name}'", f"is a {type(element).__name__}, not an element")
        if not isinstance(self.cam, Cam):
            raise ArrangementError(
                "through", f"the first thing must be a cam, not a {type(self.cam).__name__}"
            )
        if element.domain != TRANSLATION:
            raise ArrangementError(
                f"through: '{name}'",
                f"relates {element.domain.motion} and {element.domain.effort}; a cam needs a force",
                next_step="put a specimen around a material, or use a linear spring",
            )

    @property
    def needs_rate(self) -> bool:
        """True if the element behind the cam, or what the cam loses, needs the rate."""
        return self.behind[1].needs_rate or self.cam.needs_rate

    @property
    def restores(self) -> bool:
        """Whether the element behind the cam restores."""
        return self.behind[1].restores

    def children(self) -> Mapping[str, Part]:
        """Return cam and element."""
        return {"cam": self.cam, self.behind[0]: self.behind[1]}

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with another cam or element.

        Raises
        ------
        ArrangementError
            If there is not one cam and one element behind it.
        """
        rest = [(name, part) for name, part in children.items() if name != "cam"]
        cam = children["cam"]
        if len(rest) != 1 or not isinstance(rest[0][1], Element) or not isinstance(cam, Cam):
            raise ArrangementError("through", "needs one cam and one element behind it")
        return replace(self, cam=cam, behind=(rest[0][0], rest[0][1]))

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T = N·h(θ)·F(e₀ + δ(θ))."""
        inside = scope.child("cam")
        lever_arm = self.cam.lever_arm_at(inside, motion)
        inside.signal("lever_arm_now", lever_arm, "m", "lever arm at the present angle")
        taken, speed = self.cam.extension(inside, motion), lever_arm * rate
        name, element = self.behind
        force = observed_effort(element, scope.child(name), scope.parameter("pretension") + taken, speed)
        return (
            inside.parameter("elements")
            * lever_arm
            * self.cam.raised(inside, lever_arm, (taken, speed))
            * force
        )


def through(cam: Cam, *, pretension: Quantity | float | None = None, **behind: Element) -> Through:
    """Put an element behind a cam or pulley.

    Parameters
    ----------
    cam
        Turns the angle into an extension.
    pretension
        Extension at angle zero in m; none by default.
    **behind
        Exactly one element by name, for instance ``rubber=...``.

    Raises
    ------
    ArrangementError
        If there is not exactly one element.
    """
    if len(behind) != 1:
        raise ArrangementError(
            f"through: {len(behind)} elements",
            "exactly one stands behind a cam",
            next_step="combine several with parallel(...) or series(...)",
        )
    from_name = next(iter(behind.items()))
    if pretension is None:
        return Through(cam=cam, behind=from_name)
    return Through(cam=cam, behind=from_name, pretension=pretension)  # type: ignore[arg-type]
