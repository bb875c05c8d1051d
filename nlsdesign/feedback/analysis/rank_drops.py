"""The exact angles at which the measurement loses sight of something, and what becomes of it there.

A sweep meets such an angle only by chance, and then draws it as wide as its steps. Here the angles of a sweep
only bracket it: where the determinant of the scaled observability matrix changes its sign (one output), or
its smallest singular value has a valley, the angle is refined until it is known to 1e-9 rad. Where the rank
is lost over a whole range, as in the dead zone of a one-sided cam, both ends are refined instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...model import FlatModel
from ...model.roles import measured_motion
from ...model.transform import with_outputs
from .observability import Observability, Unseen, observability_matrices, unseen_of
from .rest_points import RestPoints, rest_points

Array = NDArray[np.float64]
Points = Callable[[Array], RestPoints]

Rows = NDArray[np.intp]
Choice = Callable[[Array, Array], tuple[Rows, Rows]]

REFINED = 1e-9
"""Uncertainty in rad down to which angles are refined."""
_PARTS = 64
_NO_ARM = 1e-9
"""Lever arm in m that counts as none: a millionth of a millimetre."""


@dataclass(frozen=True, eq=False)
class RankDrop:
    """An angle, or a range of angles, at which something is not seen.

    Parameters
    ----------
    first, last
        In rad; equal for a single angle.
    unseen
        What is not seen there, with its eigenvalues; in the middle of a range.
    cause
        What vanishes there, by name, where the structure says it: the lever arm of a cam; else empty.
    open_ended
        Whether a range goes on beyond the angles that were looked at.
    """

    first: float
    last: float
    unseen: Unseen
    cause: str = ""
    open_ended: bool = False

    @property
    def isolated(self) -> bool:
        """Whether it is a single angle."""
        return self.first == self.last

    @property
    def detectable(self) -> bool:
        """Whether all that is not seen decays."""
        return self.unseen.detectable

    def __str__(self) -> str:
        first, last = (f"{round(float(np.degrees(each)), 6) + 0.0:g}°" for each in (self.first, self.last))
        where = f"at {first}" if self.isolated else f"from {first} to {last}"
        beyond = " and beyond the angles looked at" if self.open_ended else ""
        because = f" ({self.cause} is zero)" if self.cause else ""
        return f"{self.unseen.words} not seen {where}{beyond}{because}, {self.unseen.fate()}"


@dataclass(frozen=True, eq=False)
class RankDrops:
    """All angles of lost rank within a range.

    Parameters
    ----------
    first, last
        Ends of the range in rad.
    measured
        Names of what is measured.
    drops
        In ascending order.
    stuck
        What is not seen while dry friction holds the machine; ``None`` where nothing sticks, or all is seen.
    """

    first: float
    last: float
    measured: tuple[str, ...]
    drops: tuple[RankDrop, ...]
    stuck: Unseen | None = None

    @property
    def detectable(self) -> bool:
        """Whether all that is not seen anywhere, in motion or at rest, decays."""
        return all(drop.detectable for drop in self.drops) and (self.stuck is None or self.stuck.detectable)

    @property
    def angles(self) -> Array:
        """The single angles, in rad."""
        return np.array([drop.first for drop in self.drops if drop.isolated])

    def lines(self) -> list[str]:
        """Return one sentence for each drop, for the stuck machine, and the verdict last."""
        lines = [str(drop) for drop in self.drops]
        if self.stuck is not None:
            lines.append(f"{self.stuck.words} not seen while the machine sticks, {self.stuck.fate()}")
        by = " and ".join(self.measured)
        if not self.drops:
            lines.append(f"verdict: observable in motion at every angle looked at, from {by}")
        elif self.detectable:
            lines.append(f"verdict: detectable at every angle from {by}: what is not seen decays on its own")
        else:
            lost = next((d.unseen for d in self.drops if not d.detectable), self.stuck)
            words = lost.words if lost else ""
            lines.append(
                f"verdict: NOT detectable from {by}: no observer can follow {words} -> measure it as well"
            )
        return lines

    def __str__(self) -> str:
        return "\n".join(self.lines())


def rank_drops(
    model: FlatModel,
    *,
    angles: Sequence[float] | Array,
    measured: Sequence[str] = (),
    angle: str | None = None,
    consistent: Mapping[str, str] | None = None,
    scaling: Observability | None = None,
) -> RankDrops:
    """Return the exact angles at which the observability matrix loses rank, and what is not seen there.

    Parameters
    ----------
    model
        Continuous.
    angles
        Ascending, shape (N,), in rad: between two of them one drop is looked for. Two zeros of the
        determinant between neighbours are one valley, so angles closer together find more.
    measured
        States, signals or outputs that are measured; by default the angle.
    angle
        State that is swept; by default the motion of the driven body.
    consistent
        States that have to agree with a signal, as for :func:`~nlsdesign.feedback.analysis.rest.rest_states`.
    scaling
        Sizes, time scale and tolerance; those of ``Observability()`` by default.

    Returns
    -------
    RankDrops
        Prints as sentences with a verdict.

    Raises
    ------
    UnknownNameError
        If something measured does not exist.
    ValueRangeError
        If an angle is not finite, or the model has no finite slope at one.
    ConvergenceError
        If the model does not come to rest.
    ArrangementError
        If no angle is named and the structure does not say which body is driven.

    Examples
    --------
    >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
    >>> from nlsdesign.model import flatten
    >>> spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel", "rim")
    >>> pair = assembly("pair", wheel=Inertia(inertia=1e-3), rim=Inertia(inertia=2e-3), spring=spring)
    >>> drops = rank_drops(flatten(pair), angles=[0.0, 0.1], measured=["spring.angle"], angle="wheel.angle")
    >>> drops.detectable
    False
    """
    angle = measured_motion(model, angle)
    names = tuple(measured) or (angle,)
    arms = [cam.lever_arm for spring in model.springs for cam in spring.cams]
    arms = [name for name in arms if name in {v.name for v in model.signals}]
    model = with_outputs(model, list(dict.fromkeys([*names, *arms])))
    view = replace(scaling or Observability(), measured=names)
    at = np.asarray(angles, dtype=float)
    whole = rest_points(model, at, angle=angle, consistent=consistent)
    search = _Search(
        replace(view, nominal={**whole.sizes, **view.nominal}),
        lambda some: rest_points(model, some, angle=angle, consistent=consistent, like=whole),
        tuple(arms),
    )
    drops = tuple(sorted(search.drops(whole), key=lambda drop: drop.first))
    return RankDrops(float(at[0]), float(at[-1]), names, drops, search.stuck(whole))


@dataclass(frozen=True, eq=False)
class _Search:
    """How angles are refined: the scaling of the matrices, and the model at rest at further angles."""

    view: Observability
    points: Points
    arms: tuple[str, ...]

    def drops(self, whole: RestPoints) -> list[RankDrop]:
        """Return all within the angles of a sweep."""
        at, (determinant, smallest) = whole.at, self._numbers(whole)
        lost = smallest <= self.view.tolerance
        seen = ~lost
        crossed = seen[:-1] & seen[1:] & (determinant[:-1] * determinant[1:] < 0.0)
        singles = self._refined(at[:-1][crossed], at[1:][crossed], _first_change)
        middle, sides = smallest[1:-1], np.stack([smallest[:-2], smallest[2:]])
        lower = np.all(middle <= sides, axis=0) & (middle <= 0.9 * np.max(sides, axis=0))
        undisturbed = seen[:-2] & seen[1:-1] & seen[2:] & ~crossed[:-1] & ~crossed[1:]
        minima = np.flatnonzero(lower & undisturbed)
        lowest = self._refined(at[minima], at[minima + 2], _lowest)
        singles = np.concatenate([singles, lowest[self._are_zeros(lowest)]])
        return [self._drop(float(each)) for each in singles] + [self._run(at, rows) for rows in _runs(lost)]

    def stuck(self, whole: RestPoints) -> Unseen | None:
        """Return what is not seen while dry friction holds, in the middle of the sweep."""
        mode = next((each for each in whole.modes if each.allowed is not None), None)
        if mode is None or mode.allowed is None:
            return None
        row, names = len(whole.at) // 2, whole.state_names
        size = np.array([self.view.nominal.get(name, 1.0) for name in names])
        a, allowed = (each[row] * size[None, :] / size[:, None] for each in (mode.a, mode.allowed))
        c = self.view.scaled(whole)[1][row]
        seen = observability_matrices(self.view.time_scale * a[None], c[None])[0]
        # What is held is known to stand still, so those directions count as seen.
        _, singular, directions = np.linalg.svd(np.vstack([seen, np.eye(len(size)) - allowed]))
        hidden = directions[singular <= self.view.tolerance * singular[0]]
        return unseen_of(hidden, a, names) if len(hidden) else None

    # --- inside ---------------------------------------------------------------------------------------

    def _numbers(self, points: RestPoints) -> tuple[Array, Array]:
        """Return the determinant, zero where there is none, and σ_min over σ_max."""
        matrices = observability_matrices(*self.view.scaled(points))
        singular = np.linalg.svd(matrices, compute_uv=False)
        none = np.zeros(len(points.at))
        determinant = np.linalg.det(matrices) if matrices.shape[-2] == matrices.shape[-1] else none
        return determinant, singular[:, -1] / np.maximum(singular[:, 0], 1e-300)

    def _refined(self, low: Array, high: Array, choose: Choice) -> Array:
        """Return the angle in each bracket; all are divided into many parts at once, again and again."""
        shares, ends = np.linspace(0.0, 1.0, _PARTS + 1), [np.zeros(len(low))] * 2
        while len(low) and np.max(high - low) > REFINED:
            at = low[:, None] + (high - low)[:, None] * shares
            numbers = [each.reshape(at.shape) for each in self._numbers(self.points(at.ravel()))]
            first, last = choose(*numbers)
            rows = np.arange(len(at))
            low, high = at[rows, first], at[rows, last]
            ends = [numbers[0][rows, each] for each in (first, last)]
        # The determinant is a straight line over so little: where it changes its sign, it says where.
        line = ends[0] * ends[1] < 0.0
        share = np.where(line, ends[0] / np.where(line, ends[0] - ends[1], 1.0), 0.5)
        angles: Array = low + share * (high - low)
        return angles

    def _are_zeros(self, at: Array) -> NDArray[np.bool_]:
        """Tell at which angles the smallest singular value falls to nothing, and is not only low."""
        if not len(at):
            return np.zeros(0, dtype=bool)
        here, near = (self._numbers(self.points(each))[1] for each in (at, at + 1e4 * REFINED))
        zero: NDArray[np.bool_] = here <= np.maximum(self.view.tolerance, 1e-3 * near)
        return zero

    def _run(self, at: Array, rows: list[int]) -> RankDrop:
        """Return the range around angles of lost rank; one angle where it is narrower than 1e-6 rad."""
        middle = self._drop(float(at[rows[len(rows) // 2]]))
        ends = [self._edge(at, rows[0], -1, middle.cause), self._edge(at, rows[-1], 1, middle.cause)]
        if ends[1] - ends[0] < 1e-6:
            return middle
        opens = rows[0] == 0 or rows[-1] == len(at) - 1
        return replace(middle, first=ends[0], last=ends[1], open_ended=opens)

    def _edge(self, at: Array, row: int, step: int, arm: str) -> float:
        """Return the end of a range on one side: where the lever arm begins, if that is what is zero."""
        low, high = float(at[row]), float(at[row + step]) if 0 <= row + step < len(at) else float(at[row])
        while abs(high - low) > REFINED:
            between = np.linspace(low, high, _PARTS + 1)
            points = self.points(between)
            seen = self._numbers(points)[1] > self.view.tolerance
            if arm:
                seen = np.abs(points.outputs[:, points.output_names.index(arm)]) > _NO_ARM
            first = max(int(np.argmax(seen)), 1)
            low, high = float(between[first - 1]), float(between[first])
        return low

    def _drop(self, at: float) -> RankDrop:
        points = self.points(np.array([at]))
        a, c = self.view.scaled(points)
        _, singular, directions = np.linalg.svd(observability_matrices(a, c)[0])
        singular = np.pad(singular, (0, len(directions) - len(singular)))
        # The angle is known to a billionth of a radian: what is not seen there is what is least.
        limit = max(self.view.tolerance * singular[0], 10.0 * singular[-1])
        unseen = unseen_of(directions[singular <= limit], a[0] / self.view.time_scale, points.state_names)
        values = dict(zip(points.output_names, points.outputs[0], strict=True))
        arms = [name for name in self.arms if abs(values[name]) <= _NO_ARM]
        return RankDrop(at, at, unseen, arms[0] if arms else "")


def _first_change(determinant: Array, _: Array) -> tuple[Rows, Rows]:
    """Return the part in which a sign changes first; a zero ends the search."""
    sign = np.sign(determinant)
    changes = sign[:, :-1] * sign[:, 1:] <= 0.0
    first = np.argmax(changes, axis=-1)
    rows = np.arange(len(sign))
    zero = sign[rows, first + 1] == 0.0
    return np.where(zero, first + 1, first), np.where(sign[rows, first] == 0.0, first, first + 1)


def _lowest(_: Array, smallest: Array) -> tuple[Rows, Rows]:
    """Return the two parts around the smallest value."""
    least = np.argmin(smallest, axis=-1)
    return np.maximum(least - 1, 0), np.minimum(least + 1, smallest.shape[-1] - 1)


def _runs(flags: NDArray[np.bool_]) -> list[list[int]]:
    """Return the rows of each unbroken run of true flags."""
    groups = groupby(range(len(flags)), key=lambda row: bool(flags[row]))
    return [list(rows) for true, rows in groups if true]
