"""Wrappers that carry an element from one domain to another: specimen, cam, pull-only contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, positive_part
from ..core.element import (
    MATERIAL,
    ROTATION,
    TRANSLATION,
    Combination,
    Domain,
    Element,
    Scope,
    observed_effort,
)
from ..core.part import RESERVED, Part, check_names, parameter
from .cam import Cam


@dataclass(frozen=True, kw_only=True)
class Specimen(Combination):
    """A piece of material: ε = e/L₀, F = A₀·Σσ of the laws inside, which act in parallel.

    Nominal stress and nominal strain, as in the paper: A₀ and L₀ are those of the unstretched piece.
    Source: Austin et al. 2015, eq. (1), with a = A₀/L₀.
    """

    picture: ClassVar[str] = "none"

    area: Quantity = parameter("m^2", "cross-section of the unstretched piece", minimum=1e-8, maximum=1.0)
    rest_length: Quantity = parameter("m", "length of the unstretched piece", minimum=1e-4, maximum=5.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != MATERIAL:
            raise ArrangementError(
                f"Specimen member '{self.members[0][0]}'",
                "a specimen needs laws of stress and strain",
                next_step="use for instance LinearElastic instead of Spring",
            )

    @property
    def domain(self) -> Domain:
        """Extension and force."""
        return TRANSLATION

    @property
    def needs_rate(self) -> bool:
        """True if any law inside needs the rate."""
        return any(member.needs_rate for _, member in self.members)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = A₀·Σσ(e/L₀)."""
        length = scope.parameter("rest_length")
        stresses = [
            observed_effort(m, scope.child(n), motion / length, rate / length) for n, m in self.members
        ]
        scope.signal("strain", motion / length, "1", f"strain of {scope.path}")
        return scope.parameter("area") * sum(stresses[1:], start=stresses[0])


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
    """

    cam: Cam
    behind: tuple[str, Element]
    pretension: Quantity = parameter(
        "m", "extension of the element at angle zero", minimum=0.0, maximum=1.0, default=0.0
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
    def domain(self) -> Domain:
        """Angle and torque."""
        return ROTATION

    @property
    def needs_rate(self) -> bool:
        """True if the element behind the cam needs the rate."""
        return self.behind[1].needs_rate

    @property
    def restores(self) -> bool:
        """Whether the element behind the cam restores."""
        return self.behind[1].restores

    def children(self) -> Mapping[str, Part]:
        """Return cam and element."""
        return {"cam": self.cam, self.behind[0]: self.behind[1]}

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with another cam or element."""
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
        extension = scope.parameter("pretension") + self.cam.extension(inside, motion)
        name, element = self.behind
        force = observed_effort(element, scope.child(name), extension, lever_arm * rate)
        return inside.parameter("elements") * lever_arm * force


@dataclass(frozen=True, kw_only=True)
class PullOnly(Combination):
    """A cable that only pulls: F = max(F inside, 0), rounded over ``width``, C∞.

    While the cable is slack the element inside is still led by the extension, so its memory is that of a
    rod, not of a free piece: good for short slack times, see the known gaps.
    Source: Signorini 1933 (unilateral contact); this rounding is the softplus of Dugas et al. 2001.
    """

    width: Quantity = parameter(
        "N", "force over which the corner is rounded", minimum=1e-6, maximum=1e3, default=0.1
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != TRANSLATION:
            raise ArrangementError("PullOnly", "acts on extension and force")

    @property
    def needs_rate(self) -> bool:
        """True if any element inside needs the rate."""
        return any(member.needs_rate for _, member in self.members)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the smooth positive part of the sum of forces."""
        forces = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        return positive_part(sum(forces[1:], start=forces[0]), scope.parameter("width"))


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


def specimen(*, area: Quantity | float, rest_length: Quantity | float, **laws: Element) -> Specimen:
    """Make a piece of material from laws of stress and strain that act in parallel.

    Parameters
    ----------
    area
        Cross-section in m².
    rest_length
        Unstretched length in m.
    **laws
        Elements by name.
    """
    return Specimen(area=area, rest_length=rest_length, members=tuple(laws.items()))  # type: ignore[arg-type]


def pull_only(**elements: Element) -> PullOnly:
    """Let elements in parallel only pull.

    Parameters
    ----------
    **elements
        Elements of extension and force by name.
    """
    return PullOnly(members=tuple(elements.items()))
