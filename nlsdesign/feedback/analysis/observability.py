"""What can be seen of the states: at rest, along a motion, and the exact angles where something is lost.

At rest: rank, condition and Gramian, and what becomes of what is not seen. Rank alone misleads: a rank of
four with a condition number of nine thousand is no estimate. All numbers are of scaled matrices; the scaling
is stated with them.

Along a motion: a Gramian at rest holds for motions so small that nothing changes. Where a motion is large, or
goes through sticking, slack and dead zones, the empirical Gramian is taken of the model itself: its start is
moved a little in each state, both ways, and the change of the measured outputs is summed up.

Where the rank drops: a sweep meets such an angle only by chance, and then draws it as wide as its steps.
Here the angles of a sweep only bracket it: where the determinant of the scaled observability matrix changes
its sign (one output), or its smallest singular value has a valley, the angle is refined until it is known to
1e-9 rad. Where the rank is lost over a whole range, as in the dead zone of a one-sided cam, both ends are
refined instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array, Indices, Mask
from ...foundation.errors import ValueRangeError, unknown_name
from ...model import FlatModel, Variable
from ...model.roles import measured_motion
from ...model.transform import with_outputs
from ...simulation import simulate
from ...simulation.input_signals import Drive
from .rest_points import RestPoints, rest_points
from .sweep import Columns, View, exponential_and_gramian, transposed

_STILL = 1e-9
"""Share of the largest slope below which the eigenvalue of what is not seen counts as zero."""


class Unseen(NamedTuple):
    """What a measurement does not see at one angle.

    ``directions``: orthonormal in units of the typical sizes, shape (k, n); ``eigenvalues``: of the motion
    within them, shape (k,); ``words``: names and shares of the states.
    """

    directions: Array
    eigenvalues: NDArray[np.complex128]
    words: str

    @property
    def detectable(self) -> bool:
        """Whether all that is not seen decays."""
        return bool(np.all(self.eigenvalues.real < 0.0))

    def fate(self) -> str:
        """Return in words what becomes of it."""
        slowest = self.eigenvalues[int(np.argmax(self.eigenvalues.real))]
        if slowest.real < 0.0:
            return f"decays with {slowest.real:.3g} 1/s: detectable"
        if slowest.real == 0.0:
            return "does not decay (eigenvalue 0): not detectable"
        return f"grows with {slowest.real:+.3g} 1/s: not detectable"


@dataclass(frozen=True)
class Observability(View):
    """Rank and condition of the observability matrix, and the finite-horizon Gramian.

    The matrix is that of Ã = T·S⁻¹·A·S and C̃ = R⁻¹·C·S with S the nominal sizes of the states, R those of the
    outputs and T the time scale: rows C̃, C̃Ã, … up to the power n − 1. A is that of the machine that moves:
    dry friction has its sliding level. While it sticks, an angle shows nothing of the inner states.

    Parameters
    ----------
    nominal
        Sizes by name of state or output in SI; the typical sizes over the sweep for those left out.
    time_scale
        T in s, by default one sample at 1 kHz.
    tolerance
        Singular values below ``tolerance`` times the largest count as zero.
    horizon
        Length of the Gramian ∫e^(Aᵀt)CᵀCe^(At)dt in s.
    measured
        Outputs that are measured; all of them by default.

    Notes
    -----
    The linearisation is exact, so it contains −N·h′(θ)·F/J, the change of the lever arm with the angle. An
    observer that reads its matrices at the measured angle does not need it; rank and null vector are equal.

    The angles of a sweep meet an angle where the rank drops by chance only;
    :func:`~nlsdesign.feedback.analysis.observability.rank_drops` finds them exactly.
    """

    nominal: Mapping[str, float] = field(default_factory=dict)
    time_scale: float = 1e-3
    tolerance: float = 1e-9
    horizon: float = 0.1
    measured: tuple[str, ...] = ()

    def over(self, points: RestPoints) -> Columns:
        """Return the numbers; in words the direction that is not seen, or least, and what becomes of it.

        Raises
        ------
        UnknownNameError
            If something measured is no output of the model, or a size is of something that is not in it.
        """
        outputs = {v.name for v in points.model.outputs}
        known = outputs | {v.name for v in points.model.states}
        for name in self.nominal:
            if name not in known:
                raise unknown_name("state or output", name, known)
        for name in self.measured:
            if name not in outputs:
                raise unknown_name("measured output", name, outputs)
        a, c = self.scaled(points)
        _, singular, directions = np.linalg.svd(observability_matrices(a, c), full_matrices=True)
        # Directions that no row can see have the singular value zero.
        singular = np.pad(singular, ((0, 0), (0, a.shape[-1] - singular.shape[-1])))
        seen = singular > self.tolerance * singular[:, :1]
        _, gramians = exponential_and_gramian(a / self.time_scale, transposed(c) @ c, self.horizon)
        gramian = np.asarray(np.linalg.eigvalsh(gramians), dtype=float)
        # The Gramian is quadratic in the output: its eigenvalues count as zero below tolerance squared, but
        # not below what double precision can tell.
        values = (
            np.sum(seen, axis=-1).astype(float),
            _ratio(singular[:, 0], singular[:, -1], self.tolerance),
            singular[:, -1],
            _ratio(gramian[:, -1], gramian[:, 0], max(self.tolerance**2, 1e-15)),
            np.maximum(gramian[:, 0], 0.0),
        )
        names = points.state_names
        unseen = [
            None if all(row) else unseen_of(v[~row], each / self.time_scale, names)
            for row, v, each in zip(seen, directions, a, strict=True)
        ]
        words = {
            "null vector": tuple(each.words if each else "" for each in unseen),
            "weakest direction": tuple(in_words(v[-1], names) for v in directions),
            "verdict": tuple(f"{e.words} not seen, {e.fate()}" if e else "observable" for e in unseen),
        }
        return Columns(self._columns(points), np.column_stack(values), words)

    def scaled(self, points: RestPoints) -> tuple[Array, Array]:
        """Return Ã and C̃, shapes (N, n, n) and (N, r, n).

        Parameters
        ----------
        points
            The model at rest at each angle.
        """
        sizes = {**points.sizes, **self.nominal}
        chosen = [i for i, n in enumerate(points.output_names) if not self.measured or n in self.measured]
        state = np.array([sizes.get(name, 1.0) for name in points.state_names])
        output = np.array([sizes.get(points.output_names[i], 1.0) for i in chosen])
        a = self.time_scale * points.moving.a * state[None, :] / state[:, None]
        return a, points.moving.c[:, chosen] * state[None, :] / output[:, None]

    def _columns(self, points: RestPoints) -> tuple[Variable, ...]:
        scale = f"scaled, time scale {self.time_scale:g} s, mode {points.moving.name!r}"
        gramian = f"of the Gramian over {self.horizon:g} s, scaled"
        return (
            Variable("observability.rank", "1", f"rank, tolerance {self.tolerance:g}"),
            Variable("observability.condition", "1", f"condition of the observability matrix, {scale}"),
            Variable("observability.smallest", "1", f"smallest singular value of that matrix, {scale}"),
            Variable("gramian.condition", "1", f"condition {gramian}"),
            Variable("gramian.smallest", "1", f"smallest eigenvalue {gramian}"),
        )


def observability_matrices(a: Array, c: Array) -> Array:
    """Return the rows C, CA, … up to the power n − 1, shape (N, r·n, n).

    ``a``, ``c``: shapes (N, n, n) and (N, r, n).
    """
    powers = [c]
    for _ in range(a.shape[-1] - 1):
        powers.append(powers[-1] @ a)
    return np.concatenate(powers, axis=1)


def unseen_of(directions: Array, a: Array, names: tuple[str, ...]) -> Unseen:
    """Return what becomes of directions that are not seen.

    ``directions``: orthonormal, shape (k, n), in units of the sizes. ``a``: slopes in the same units, shape
    (n, n), in 1/s.
    """
    eigenvalues = np.linalg.eigvals(directions @ a @ directions.T).astype(complex)
    zero = np.abs(eigenvalues) <= _STILL * np.max(np.abs(a))
    return Unseen(
        directions,
        np.where(zero, 0.0, eigenvalues),
        " and ".join(in_words(each, names) for each in directions),
    )


def in_words(direction: Array, names: tuple[str, ...]) -> str:
    """Return the names of the states in a unit vector, largest share first, shares below 5 % left out."""
    order = np.argsort(-np.abs(direction))
    sign = np.sign(direction[order[0]])
    large = [i for i in order if abs(direction[i]) > 0.05]
    if len(large) == 1:
        return names[int(large[0])]
    return " ".join(f"{sign * direction[i]:+.2f} {names[i]}" for i in large)


def _ratio(largest: Array, smallest: Array, tolerance: float) -> Array:
    counts = smallest > tolerance * largest
    return np.where(counts, largest / np.where(counts, smallest, 1.0), np.inf)


@dataclass(frozen=True, eq=False)
class EmpiricalGramian:
    """The empirical Gramian of one motion, in units of the typical sizes.

    Parameters
    ----------
    states
        Names, in the order of the rows.
    matrix
        In s, shape (n, n): ∫|Δy/R|² dt per (Δx/S)².
    duration
        Of the motion in s.
    measured
        Names of what is measured.
    """

    states: tuple[str, ...]
    matrix: Array
    duration: float
    measured: tuple[str, ...]

    @property
    def eigenvalues(self) -> Array:
        """In s, ascending."""
        values: Array = np.maximum(np.linalg.eigvalsh(self.matrix), 0.0)
        return values

    @property
    def condition(self) -> float:
        """Largest over smallest eigenvalue; infinite where something is not seen at all."""
        values = self.eigenvalues
        return float(values[-1] / values[0]) if values[0] > 1e-15 * values[-1] else float("inf")

    @property
    def weakest(self) -> str:
        """The direction that is seen least, in words."""
        return in_words(np.linalg.eigh(self.matrix)[1][:, 0], self.states)

    def __str__(self) -> str:
        seen = "not seen" if self.condition == float("inf") else "seen least"
        return (
            f"empirical Gramian over {self.duration:g} s from {' and '.join(self.measured)}: condition "
            f"{self.condition:.3g}, {seen}: {self.weakest}"
        )


def empirical_gramian(
    model: FlatModel,
    times: Array,
    *,
    inputs: Mapping[str, Drive] | None = None,
    start: Mapping[str, float] | None = None,
    measured: Sequence[str] = (),
    sizes: Mapping[str, float] | None = None,
    share: float = 0.01,
) -> EmpiricalGramian:
    """Return the empirical Gramian of a model along a motion.

    W = 1/(2c²)·Σ± ∫Δyᵢ±·Δyⱼ± dt, with the outputs' changes Δyᵢ± where state i starts c·Sᵢ higher or lower.
    For a linear model it is ∫e^(Aᵀt)CᵀCe^(At) dt. Source: Lall et al. 2002.

    Parameters
    ----------
    model
        Continuous; sharp laws are simulated as such.
    times
        Of the samples in s, ascending, shape (N,); the integral is taken over them.
    inputs, start
        Of the motion, as for :func:`~nlsdesign.simulation.simulate`.
    measured
        States, signals or outputs; by default the motion of the driven body.
    sizes
        Of states and measured variables by name; by default the largest value along the motion, or 1.
    share
        c, the share of its size by which the start of a state is moved.

    Raises
    ------
    UnknownNameError
        If something measured or an input or a state does not exist.
    ValueRangeError
        If the share is not positive.
    ConvergenceError
        If a run stops early.
    ArrangementError
        If nothing measured is named and the structure does not say which body is driven.
    """
    if not 0.0 < share < np.inf:
        raise ValueRangeError(f"share {share:g}", "must be positive")
    names = tuple(measured) or (measured_motion(model),)
    model = with_outputs(model, list(names))
    states, begin = tuple(v.name for v in model.states), dict(start or {})
    for name in sizes or {}:
        if name not in {*states, *names}:
            raise unknown_name("state or measured variable", name, {*states, *names})

    def run(moved: Mapping[str, float]) -> dict[str, Array]:
        trace = simulate(model, times, inputs=inputs, start={**begin, **moved}, tolerance=1e-11)
        return {name: trace[name] for name in (*names, *states)}

    motion = run({})
    largest = {name: float(np.max(np.abs(values))) or 1.0 for name, values in motion.items()}
    size = largest | dict(sizes or {})
    total = np.zeros((len(states), len(states)))
    for sign in (1.0, -1.0):
        changes = []
        for name in states:
            moved_run = run({name: float(motion[name][0]) + sign * share * size[name]})
            changes.append(np.array([(moved_run[n] - motion[n]) / size[n] for n in names]))
        products = np.einsum("irt,jrt->ijt", np.array(changes), np.array(changes))
        total += np.trapezoid(products, times, axis=-1) / (2.0 * share**2)
    return EmpiricalGramian(states, (total + total.T) / 2.0, float(times[-1] - times[0]), names)


Points = Callable[[Array], RestPoints]

Choice = Callable[[Array, Array], tuple[Indices, Indices]]

REFINED = 1e-9
"""Uncertainty in rad down to which angles are refined."""
_PARTS = 64
_NO_ARM = 1e-9
"""Lever arm in m that counts as none: a millionth of a millimetre."""


@dataclass(frozen=True, eq=False)
class RankDrop:
    """An angle, or a range of angles, at which something is not seen."""

    # first, last: in rad; equal for a single angle
    first: float
    last: float
    unseen: Unseen  # what is not seen there, with its eigenvalues; in the middle of a range
    # cause: what vanishes there, by name, where the structure says it: the lever arm of a cam; else empty
    cause: str = ""
    open_ended: bool = False  # whether a range goes on beyond the angles that were looked at

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
        # The rows of each unbroken run of true flags.
        groups = groupby(range(len(lost)), key=lambda row: bool(lost[row]))
        return [self._drop(float(each)) for each in singles] + [
            self._run(at, rows) for rows in [list(rows) for true, rows in groups if true]
        ]

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
        return low + share * (high - low)

    def _are_zeros(self, at: Array) -> Mask:
        """Tell at which angles the smallest singular value falls to nothing, and is not only low."""
        if not len(at):
            return np.zeros(0, dtype=bool)
        here, near = (self._numbers(self.points(each))[1] for each in (at, at + 1e4 * REFINED))
        return here <= np.maximum(self.view.tolerance, 1e-3 * near)

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


def _first_change(determinant: Array, _: Array) -> tuple[Indices, Indices]:
    """Return the part in which a sign changes first; a zero ends the search."""
    sign = np.sign(determinant)
    changes = sign[:, :-1] * sign[:, 1:] <= 0.0
    first = np.argmax(changes, axis=-1)
    rows = np.arange(len(sign))
    zero = sign[rows, first + 1] == 0.0
    return np.where(zero, first + 1, first), np.where(sign[rows, first] == 0.0, first, first + 1)


def _lowest(_: Array, smallest: Array) -> tuple[Indices, Indices]:
    """Return the two parts around the smallest value."""
    least = np.argmin(smallest, axis=-1)
    return np.maximum(least - 1, 0), np.minimum(least + 1, smallest.shape[-1] - 1)
