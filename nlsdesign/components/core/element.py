"""The algebra of one-port elements: what every element is, in parallel and in series.

An element relates a motion (strain, extension, angle) to an effort (stress, force, torque). One predicate
decides the causality: ``needs_rate`` says whether the effort depends directly on the rate of the motion.

What a law says of the places where it is not smooth, so that simulation can find them.

Three kinds. At a *kink* the effort is continuous and only its derivative jumps. At a *jump* the effort itself
jumps, so the law is written with a symbol that is 1 on one side and −1 on the other. A *stiction constraint*
keeps a rate at zero by an effort that follows from the motion of everything else: dry friction that sticks, a
body at rest against a stop.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, Self, TypeAlias

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression, symbol
from .domain import MATERIAL as MATERIAL
from .domain import ROTATION as ROTATION
from .domain import TRANSLATION as TRANSLATION
from .domain import Domain as Domain
from .part import RESERVED, Part, check_names


@dataclass(frozen=True)
class Kink:
    """A place at which an effort has a kink."""

    name: str  # full name, for messages and events
    value: Expression  # vanishes at the kink
    # above, below: what has happened when the value has become positive, or negative
    above: str
    below: str


@dataclass(frozen=True)
class Jump(Kink):
    """A place at which an effort jumps."""

    mode: Expression  # symbol that is 1 where the value is positive and −1 where it is negative


@dataclass(frozen=True)
class StictionConstraint:
    """An effort that keeps a rate at zero, and what acts while it does not."""

    name: str  # full name, for messages and events
    effort: Expression  # symbol of the effort against the rate
    mode: Expression  # symbol that is 0 while the rate is held, otherwise 1 or −1
    rate: Expression  # what is held at zero
    moving: Expression  # effort while the rate is not held
    stays: Expression  # not negative as long as the effort can hold
    lands: Expression  # not negative as long as the rate stays free
    leads: Expression  # mode that follows when the effort cannot hold any longer
    rebound: Expression  # rate after landing; zero where it is held from then on
    first: Expression  # mode before anything is known of the effort: 0 where it might hold
    # words: what has happened when a mode begins: pairs of mode and text; the text of a rebound is at 2
    words: tuple[tuple[int, str], ...]
    # level: largest effort of dry friction while it holds; several on one rate share the load in this ratio
    level: Expression | None = None


class Switches(Protocol):
    """Takes what laws say of the places where they are not smooth."""

    path: str

    def kink(self, value: Expression, *, above: str, below: str, name: str = "") -> None:
        """Declare that the effort has a kink where a value vanishes."""
        ...

    def jump(self, value: Expression, *, above: str, below: str, name: str = "") -> Expression:
        """Return a symbol that is 1 where a value is positive and −1 where it is negative."""
        ...

    def stiction(self, constraint: StictionConstraint) -> Expression:
        """Take an effort that holds a rate at zero, and return it."""
        ...


def dry(
    scope: Switches, rate: Expression, slipping: Callable[[Expression], Expression], sticking: Expression
) -> Expression:
    """Return the effort of dry friction with true sticking."""
    mode, effort = symbol(f"{scope.path}.mode"), symbol(f"{scope.path}.holding")
    return scope.stiction(
        StictionConstraint(
            scope.path, effort, mode, rate,
            moving=mode * slipping(mode * rate),
            stays=sticking - ca.fabs(effort),
            lands=mode * rate,
            leads=ca.if_else(effort >= 0, 1, -1),
            rebound=ca.SX(0),
            first=ca.sign(rate),
            words=((0, "sticks"), (1, "slips forward"), (-1, "slips backward")),
            level=sticking,
        )
    )  # fmt: skip


Range: TypeAlias = tuple[float, float]
UNBOUNDED: Range = (-math.inf, math.inf)


class OwnNames(Protocol):
    """What an element may name in the model that is being written: its numbers, inputs, states, signals."""

    path: str

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one of the part's own numbers."""
        ...

    def row(self, name: str) -> list[Expression]:
        """Return the symbols of one of the part's own rows of numbers."""
        ...

    def input(self, name: str, unit: str, description: str) -> Expression:
        """Declare an input."""
        ...

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Declare a state; its derivative is given by :meth:`derive`."""
        ...

    def signal(
        self, name: str, value: Expression, unit: str, description: str, *, valid: Range = UNBOUNDED
    ) -> None:
        """Give a name to an expression, and the range in which the law behind it is stated to hold."""
        ...


class Scope(OwnNames, Switches, Protocol):
    """What an element sees of the model that is being written: its own names, nothing else."""

    def child(self, name: str) -> Scope:
        """Return the scope of a part inside."""
        ...

    def derive(self, state: Expression, derivative: Expression) -> None:
        """Give the derivative of a state."""
        ...

    def loss(self, power: Expression) -> None:
        """Note power that turns into heat inside the part, in effort times rate."""
        ...

    def losses(self) -> Expression:
        """Return the sum of what the part and all parts inside it have noted as lost."""
        ...

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Give the solution of an unknown that stands in expressions given before."""
        ...

    def check(self, name: str, residual: Expression) -> None:
        """Record a residual that must vanish."""
        ...

    def total_rate(self, value: Expression, moving: Mapping[Expression, Expression]) -> Expression:
        """Return the time derivative of an expression of states and the given moving symbols."""
        ...

    def rate_is_used(self, rate: Expression) -> bool:
        """Tell whether anything given so far contains this symbol."""
        ...


@dataclass(frozen=True, kw_only=True)
class Element(Part):
    """A one-port element; final classes say their law in :meth:`effort`."""

    picture: ClassVar[str] = "box"
    """How it is drawn, by a name of ``GLYPHS`` in :mod:`.circuit`; ``"none"`` for its members alone."""

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """The pair of quantities that the element relates."""

    @property
    @abstractmethod
    def needs_rate(self) -> bool:
        """Whether the effort depends directly on the rate of the motion."""

    @property
    def dissipates(self) -> bool:
        """Whether all power that goes into the element is lost in it; other laws say :meth:`Scope.loss`."""
        return False

    @property
    def restores(self) -> bool:
        """Whether a displacement is answered by a restoring effort, as by a spring."""
        return False

    @property
    def is_smooth(self) -> bool:
        """Whether the law has no corner that simulation must locate."""
        return True

    def smooth(self, width: float | None = None) -> Element:
        """Return the smooth form of a law that is not smooth; how far it differs stands in its description.

        Parameters
        ----------
        width
            Speed, angle, extension, strain or force over which it is rounded; the law proposes one.
        """
        return self

    @property
    def valid(self) -> Range:
        """Least and greatest motion for which the law is stated to hold; results name it when it is left."""
        return UNBOUNDED

    @abstractmethod
    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort at a motion and its rate.

        Parameters
        ----------
        scope
            Gives parameters, takes states, signals and unknowns.
        motion, rate
            Scalars in the units of the domain.
        """

    def at_first_end(self, scope: Scope, effort: Expression, rate: Expression) -> Expression | None:
        """Return what acts against the first end of the tie alone, beside the effort; nothing for most laws.

        Parameters
        ----------
        scope
            Of the element.
        effort
            Of the element.
        rate
            Of the first body.
        """
        return None


def observed_effort(element: Element, scope: Scope, motion: Expression, rate: Expression) -> Expression:
    """Return the effort of an element and give names to its motion and effort."""
    effort = element.effort(scope, motion, rate)
    domain = element.domain
    if element.dissipates:
        scope.loss(effort * rate)
    meaning = f"{domain.motion} of {scope.path}"
    scope.signal(domain.motion, motion, domain.motion_unit, meaning, valid=element.valid)
    scope.signal(domain.effort, effort, domain.effort_unit, f"{domain.effort} of {scope.path}")
    return effort


@dataclass(frozen=True, kw_only=True)
class Combination(Element):
    """Several elements of one domain by name.

    Parameters
    ----------
    members
        Pairs of name and element.

    Raises
    ------
    ArrangementError
        If there is no member, one is no element, or they relate other quantities than this one takes.
    """

    picture: ClassVar[str] = "around"
    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION, ROTATION, MATERIAL)
    """Domains of the members that it can hold."""

    placing: ClassVar[str | None] = None
    """Where to put it instead, when it is put around something else."""

    members: tuple[tuple[str, Element], ...]

    def __post_init__(self) -> None:
        kind = type(self).__name__
        if not self.members:
            raise ArrangementError(
                kind, "needs at least one element", next_step="name elements, for instance spring=..."
            )
        for name, member in self.members:
            if not isinstance(member, Element):
                raise ArrangementError(
                    f"{kind} member '{name}'", f"is a {type(member).__name__}, not an element"
                )
            if member.domain != self._inner:
                raise ArrangementError(
                    f"{kind} member '{name}'",
                    f"relates {member.domain.motion} and {member.domain.effort}, the others "
                    f"{self._inner.motion} and {self._inner.effort}",
                    next_step="put a cam or pulley (through) or a specimen between the two",
                )
        if self._inner not in self.takes:
            pairs = " or ".join(f"{domain.motion} and {domain.effort}" for domain in self.takes)
            raise ArrangementError(
                f"{kind} member '{self.members[0][0]}'",
                f"relates {self._inner.motion} and {self._inner.effort}; {kind} acts on {pairs}",
                next_step=self.placing,
            )
        super().__post_init__()
        check_names(kind, [name for name, _ in self.members], taken=RESERVED | set(self.parameters()))

    @property
    def _inner(self) -> Domain:
        return self.members[0][1].domain

    @property
    def domain(self) -> Domain:
        """The domain of the members."""
        return self._inner

    @classmethod
    def domains(cls) -> tuple[Domain, ...]:
        """Return its own domain, or those of the members that it can hold."""
        return super().domains() or cls.takes

    @property
    def needs_rate(self) -> bool:
        """True if any member needs the rate."""
        return any(member.needs_rate for _, member in self.members)

    def inside(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum of the efforts of the members, which share a motion.

        Parameters
        ----------
        scope
            Of the combination.
        motion, rate
            What the members see.
        """
        efforts = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        return sum(efforts[1:], start=efforts[0])

    @property
    def restores(self) -> bool:
        """Whether any member restores."""
        return any(member.restores for _, member in self.members)

    def children(self) -> Mapping[str, Part]:
        """Return the members by name."""
        return dict(self.members)

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other members."""
        # The kind of each member is checked where the copy is made.
        return replace(self, members=tuple(children.items()))  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class Parallel(Combination):
    """Elements that share the motion; their efforts add."""

    picture: ClassVar[str] = "none"

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum of the efforts."""
        return self.inside(scope, motion, rate)


def parallel(**members: Element) -> Parallel:
    """Put elements in parallel: same motion, efforts add.

    Parameters
    ----------
    **members
        Elements by name.
    """
    return Parallel(members=tuple(members.items()))


@dataclass(frozen=True, kw_only=True)
class Tie(Part):
    """An element between two bodies; its motion is that of the first minus that of the second.

    Parameters
    ----------
    element
        What relates motion and effort.
    between
        Names of the two bodies; one name means: against the resting frame.

    Raises
    ------
    ArrangementError
        If what is tied is no element, or there are not one or two ends.
    """

    element: Element
    between: tuple[str, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.element, Element):
            raise ArrangementError("tie", f"holds an element, not a {type(self.element).__name__}")
        if not 1 <= len(self.between) <= 2:
            raise ArrangementError(
                "tie", f"has {len(self.between)} ends; an element has two", next_step="name one or two bodies"
            )

    def children(self) -> Mapping[str, Part]:
        """Return the parts of the element: the tie adds no level to the names."""
        return self.element.children()

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other parts in the element."""
        return replace(self, element=self.element.with_children(children))

    def around(self, part: Part) -> Self:
        """Return a copy around another element.

        Parameters
        ----------
        part
            The element.

        Raises
        ------
        ArrangementError
            If the part is not an element.
        """
        # The kind is checked where the copy is made.
        return replace(self, element=part)  # type: ignore[arg-type]

    def parameters(self) -> dict[str, Quantity]:
        """Return the numbers of the element."""
        return self.element.parameters()


def tie(element: Element, *between: str) -> Tie:
    """Tie an element between two bodies, or between one body and the resting frame.

    Parameters
    ----------
    element
        For instance a spring.
    *between
        One or two names of bodies.
    """
    return Tie(element=element, between=between)


def delayed(scope: Scope, value: Expression, unit: str) -> Expression:
    """Return a value as it was a time τ ago, in (2,2) Padé approximation, C∞.

    e^(−sτ) ≈ (1 − sτ/2 + s²τ²/12)/(1 + sτ/2 + s²τ²/12). The gain is 1 at every frequency, the phase error
    lies below (ωτ)⁵/720: 4e-5 rad at ωτ = 0.5. The states are a, which rests at the value, and b = τ·ȧ; the
    delayed value is v − b. Source: Golub and Van Loan 2013 (Padé table of the exponential).

    ``scope``: of a part with a number ``delay`` in s; takes the states ``lag`` and ``lag_change``.
    """
    tau = scope.parameter("delay")
    lag = scope.state("lag", unit, f"lagging value inside the delay of {scope.path}")
    change = scope.state("lag_change", unit, f"its change over one delay, in {scope.path}")
    scope.derive(lag, change / tau)
    scope.derive(change, (12 * (value - lag) - 6 * change) / tau)
    return value - change
