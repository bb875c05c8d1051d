"""Lever arm of a made cam: a contour with errors, a cable of another thickness, an anchor elsewhere.

A made cam has a fixed support function p(φ). In the law of a two-sided cam the anchor shapes the drawing
only; once the cam is made, the direction φ of the cable at the angle θ follows from

    φ − asin(p̃(φ)/D̃) = θ,    h = p̃(φ),    p̃ = p + Δ,

with the anchor at the distance D̃ and the error Δ(φ) of the contour. Each point of the contour is named by
the angle u at which the cable should touch it, φ = u + asin(h₀(u)/D), so the declared law gives p = h₀(u)
exactly and without errors u = θ. A cable that lies free in its channel (p̃ < 0) has no lever arm. The
extension is the integral of the lever arm, δ = ∫₀^θ h. To first order, with f = √(D² − p²) − p' the free
length of the cable,

    ∂h/∂a = ψ·√(D² − p²)/f,   ∂δ/∂a = ∫₀^φ ψ dφ   for Δ = a·ψ,
    ∂h/∂D = −p·p'/(D·f),      ∂δ/∂D = √(D² − p²)/D − 1.

A contour that is hollow somewhere is treated as if the cable could follow it.

What rolls on a made edge is moved by the error ε(θ) along the normal at the contact, to first order

    Δδ = g·ε − (g·ε)(0),    Δh = d(g·ε)/dθ,    g = 1/cos α of a roller,    g = 2 of two cams cut alike,

with the pressure angle α; the pretension is set on the made part. So a slope of the edge makes the torque.
Source: Schneider 2014 (support function of a convex curve); virtual work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array, Indices
from ...foundation.errors import ConvergenceError
from ...foundation.symbolic import depends
from ...model import FlatModel
from ...model.structure import CamNames
from ..curves.target import Target
from ..statics.equilibrium import ElasticLaw, cam_function, elastic_law
from .causes import AnchorCause, Cause, LastingCause, NumberCause, ProfileCause, WaveCause

_RUN_OUT = 101
"""Nodes over the quarter turn beyond that, where the lever arm is held."""
_NODES = 1500
_NEAR_ZERO = 80
_BEYOND = 1.3
"""How far the contour is looked at, relative to the last angle: errors move the point of contact."""
_FINER = 16
_NEWTON_STEPS = 15
_STEPS = 75
_SETTLED = 1e-10
"""Angle in rad to which the point of contact is found."""
_CLEARANCE = 0.02
"""Least distance of an anchor beyond the farthest point of the cam, relative to its distance."""


@dataclass(frozen=True, eq=False)
class MadeCam:
    """The contour of a declared cam over the angle u at which the cable should touch each point."""

    angles: Array  # θ in rad, ascending from zero, shape (n,)
    anchor: float  # D in m; infinite for a cable that stays parallel
    table: scipy.interpolate.CubicHermiteSpline  # splines of the lever arm over u
    # profiles: for each cause of declared numbers of the cam the change of the lever arm per standard
    # deviation
    profiles: dict[str, scipy.interpolate.CubicHermiteSpline]
    extensions: Array  # δ at the angles without errors, shape (n,), in m

    @cached_property
    def lever_arms(self) -> Array:
        """H without errors at the angles, shape (n,), in m."""
        result: Array = self.table(self.angles)
        return result

    @cached_property
    def _directions(self) -> Array:
        return self.angles + np.arcsin(self.lever_arms / self.anchor)

    @cached_property
    def _slopes(self) -> Array:
        """P' without errors at the angles."""
        # Within the change of sides at angle zero the slope is none of the contour's.
        first = self.table(np.maximum(self.angles, self.angles[1]), 1)
        slopes: Array = first / (1.0 + first / np.sqrt(self.anchor**2 - self.lever_arms**2))
        return slopes

    @property
    def nearest_anchor(self) -> float:
        """Distance in m at which an anchor would nearly touch the cam."""
        if np.isinf(self.anchor):
            return 0.0
        return float(np.max(np.hypot(self.lever_arms, self._slopes))) * (1.0 + _CLEARANCE)

    def shape(self, cause: Cause) -> Callable[[Array, Array], Array] | None:
        """Return the error of the contour per standard deviation over u and φ; None for other causes."""
        if isinstance(cause, ProfileCause):
            profile = self.profiles[cause.name]
            return lambda u, _: profile(u)
        if isinstance(cause, WaveCause):
            rate, size = cause.order * np.pi / self._directions[-1], cause.deviation
            return lambda _, phi: size * np.cos(rate * phi) if rate else np.full_like(phi, size)
        return None

    def deviating(self, causes: Sequence[Cause], deviations: Array) -> tuple[Array, Array]:
        """Return lever arms and extensions of made cams.

        ``causes``: of any kind; those that are not of the cam are passed over. ``deviations``: in units of
        the standard deviations, shape (draws, causes). Result: each of shape (draws, n), in m.
        """
        draws = len(deviations)
        shapes = [
            (shape, deviations[:, k])
            for k, cause in enumerate(causes)
            if (shape := self.shape(cause)) is not None and np.any(deviations[:, k])
        ]
        anchor = np.maximum(self.distance(causes, deviations), self.nearest_anchor)
        if not shapes and np.all(anchor == self.anchor):
            return np.tile(self.lever_arms, (draws, 1)), np.tile(self.extensions, (draws, 1))
        arms = self._touched(anchor, shapes)
        change = arms - self.table(self._grid)
        steps = np.diff(self._grid) * (change[:, 1:] + change[:, :-1]) / 2
        longer = np.concatenate([np.zeros((draws, 1)), np.cumsum(steps, axis=1)], axis=1)
        return arms[:, self._kept], self.extensions + longer[:, self._kept]

    @cached_property
    def _grid(self) -> Array:
        """The angles, with finer ones where an error of the edge sets in, close to zero."""
        return np.concatenate([[0.0], self.angles[1] * np.geomspace(1e-4, 0.9, _FINER), self.angles[1:]])

    @property
    def _kept(self) -> Indices:
        return np.append(0, np.arange(_FINER + 1, _FINER + len(self.angles)))

    def distance(self, causes: Sequence[Cause], deviations: Array) -> Array:
        """Return the distance of the anchors of made springs, shape (draws,), in m."""
        moves = [c.deviation if isinstance(c, AnchorCause) else 0.0 for c in causes]
        result: Array = self.anchor + deviations @ np.array(moves)
        return result

    def _touched(self, anchors: Array, shapes: Sequence[tuple[Callable[..., Array], Array]]) -> Array:
        """Return the lever arms where the cables touch, for anchors of shape (draws,)."""
        count = len(self._grid)
        wanted = np.tile(self._grid, len(anchors))
        u, arms = wanted.copy(), np.zeros(wanted.size)
        low, high = np.zeros(wanted.size), np.full(wanted.size, self.table.x[-1])
        open_ones, residual = np.arange(wanted.size), np.zeros(0)
        for number in range(_STEPS):
            row, here = open_ones // count, u[open_ones]
            anchor, nominal = anchors[row], self.table(here)
            phi = here + np.arcsin(nominal / self.anchor)
            support = nominal + sum((size[row] * shape(here, phi) for shape, size in shapes), start=0.0)
            arm = np.maximum(support, 0.0)
            arms[open_ones] = arm
            residual = phi - np.arcsin(arm / anchor) - wanted[open_ones]
            unsettled = np.abs(residual) > _SETTLED
            if not np.any(unsettled):
                return arms.reshape(-1, count)
            # Newton's step without the slope of the errors; where that leaves the bracket or takes long, as
            # with an anchor that nearly touches a hollow cam, the middle of the bracket.
            near = 1.0 / np.sqrt(self.anchor**2 - nominal**2) - (support > 0.0) / np.sqrt(anchor**2 - arm**2)
            step = here - residual / np.maximum(1.0 + self.table(here, 1) * near, 0.2)
            low[open_ones] = np.where(residual <= 0.0, here, low[open_ones])
            high[open_ones] = np.where(residual >= 0.0, here, high[open_ones])
            first, last = low[open_ones], high[open_ones]
            newton = (step > first) & (step < last) & (number < _NEWTON_STEPS)
            u[open_ones] = np.where(newton, step, (first + last) / 2)
            open_ones = open_ones[unsettled]
        if np.max(np.abs(residual)) > 1e-6 * self.angles[-1]:
            raise ConvergenceError(
                "contact of cable and cam", "is not found for some errors of contour and anchor",
                next_step="state smaller spreads of contour and anchor",
            )  # fmt: skip
        return arms.reshape(-1, count)

    def sensitivity(self, cause: Cause) -> tuple[Array, Array]:
        """Return dh and dδ per standard deviation of a cause, to first order, shape (n,) each, in m.

        ``cause``: of any kind; one that is not of the cam changes nothing.
        """
        root = np.sqrt(self.anchor**2 - self.lever_arms**2)
        if isinstance(cause, AnchorCause):
            free = root - self._slopes
            arms = -self.lever_arms * self._slopes / (self.anchor * free)
            return cause.deviation * arms, cause.deviation * (root / self.anchor - 1.0)
        shape = self.shape(cause)
        if shape is None:
            return np.zeros_like(self.angles), np.zeros_like(self.angles)
        values = shape(self.angles, self._directions)
        steps = np.diff(self._directions) * (values[1:] + values[:-1]) / 2
        arms = values / (1.0 - self._slopes / root)
        return arms, np.concatenate([[0.0], np.cumsum(steps)])


@dataclass(frozen=True, eq=False)
class RolledCam(MadeCam):
    """The edge of a cam on which something rolls, over the angle."""

    reach: Array  # g at the angles, shape (n,)

    def deviating(self, causes: Sequence[Cause], deviations: Array) -> tuple[Array, Array]:
        """Return lever arms and extensions of made cams, to first order."""
        changes = np.array([self.sensitivity(cause) for cause in causes])
        return self.lever_arms + deviations @ changes[:, 0], self.extensions + deviations @ changes[:, 1]

    def sensitivity(self, cause: Cause) -> tuple[Array, Array]:
        """Return dh and dδ per standard deviation of a cause, shape (n,) each, in m."""
        if not isinstance(cause, WaveCause):
            return super().sensitivity(cause)
        turned = cause.order * np.pi / self.angles[-1]
        error, slope = np.cos(turned * self.angles), -turned * np.sin(turned * self.angles)
        way = cause.deviation * self.reach * error
        arms = cause.deviation * (np.gradient(self.reach, self.angles) * error + self.reach * slope)
        return arms, way - way[0]


def made_cam(law: ElasticLaw, cam: ca.Function, angles: Array, causes: Sequence[Cause]) -> MadeCam:
    """Return the contour of a declared cam.

    ``law``: behind the cam; only its names and numbers are used.
    """
    numbers, names = law.numbers, [v.name for v in law.parameters]
    anchored = law.cam.anchor_distance
    anchor = np.inf if anchored is None else float(numbers[names.index(anchored)])
    angle, parameters = ca.SX.sym("angle"), ca.SX.sym("parameters", len(names))
    arm, extension = cam.call([angle, parameters])
    profiles = [cause for cause in causes if isinstance(cause, ProfileCause)]
    rows = [arm]
    for cause in profiles:
        direction = np.zeros(len(names))
        for name, amount in cause.numbers:
            direction[names.index(name)] = amount
        rows.append(ca.jtimes(arm, parameters, ca.DM(direction)))
    columns = ca.vertcat(*rows)
    both = ca.Function("rows", [angle, parameters], [columns, ca.jacobian(columns, angle)])
    end = _BEYOND * float(angles[-1])
    near, along = np.geomspace(1e-7, end / _NODES, _NEAR_ZERO), np.linspace(0.0, end, _NODES)
    # An anchor that stands closer turns the cable farther around the cam, by a quarter turn at most.
    run_out = np.linspace(end, end + np.pi / 2, _RUN_OUT)
    nodes = np.unique(np.concatenate([[0.0], near, along, run_out]))
    values, slopes = (np.array(item, dtype=float) for item in both(nodes.reshape(1, -1), numbers))
    if anchored is not None and depends(arm, parameters[names.index(anchored)]):
        # Such a law holds for any contour: its lever arm has moved with the point of contact, Δ·√(D² − p²)/f.
        turning = 1.0 / (1.0 + slopes[0] / np.sqrt(anchor**2 - values[0] ** 2))
        values[1:] *= turning
        slopes[1:] = np.gradient(values[1:], nodes, axis=1)
    splines = [scipy.interpolate.CubicHermiteSpline(nodes, v, s) for v, s in zip(values, slopes, strict=True)]
    stretched = ca.Function("extension", [angle, parameters], [extension])(angles.reshape(1, -1), numbers)
    made = MadeCam(
        angles=angles,
        anchor=anchor,
        table=splines[0],
        profiles={cause.name: spline for cause, spline in zip(profiles, splines[1:], strict=True)},
        extensions=np.array(stretched, dtype=float).ravel(),
    )
    rolling = law.cam.rolling
    if rolling is None:
        return made
    centre = numbers[names.index(rolling.base)] + made.extensions
    tilts = splines[0](angles) / centre
    reach = np.full_like(angles, 2.0) if rolling.radius is None else np.hypot(1.0, tilts)
    return RolledCam(**vars(made), reach=reach)


def losses_of(causes: Sequence[Cause], angles: Array) -> Array:
    """Return the change of the torque per standard deviation of what time takes, shape (causes, angles)."""
    rows = [-np.array(c.loss) if isinstance(c, LastingCause) else 0.0 * angles for c in causes]
    return np.array(rows).reshape(len(causes), len(angles))


_LONG = 2000
"""Number of instructions of a law from which on it is not written out for each angle."""


@dataclass(frozen=True, eq=False)
class MadeSpring:
    """The springs that are made from one design, over angle and stroke.

    Columns are the angles, and where guides of the cable have friction the angles twice: pulling in, with
    T·e^(µφ), then letting out, with T·e^(−µφ).
    """

    cam: CamNames  # names around the cam
    causes: tuple[Cause, ...]  # what deviates, and what may be trimmed
    angles: Array  # θ in rad, ascending from zero, shape (n,)
    targets: Array  # torque that is asked for, shape (n,), in N·m
    importance: Array  # weight of the error that the target gives each angle, shape (n,)
    contour: MadeCam  # the made cam
    # force: casadi.Function (extension, moved numbers) -> force of one element
    force: ca.Function = field(repr=False)
    moved: tuple[str, ...]  # names of the moved numbers
    numbers: Array  # their values without deviations
    ranges: Array  # their least and largest values, shape (moved, 2)

    @property
    def rubs(self) -> bool:
        """Whether guides of the cable have friction."""
        return bool(self.cam.guides)

    @cached_property
    def wanted(self) -> Array:
        """Targets of all columns."""
        return np.tile(self.targets, 2) if self.rubs else self.targets

    @cached_property
    def weights(self) -> Array:
        """Weights of the columns in the mean over angle and stroke, as the target says; their sum is 1."""
        steps = np.diff(self.angles)
        weights = self.importance * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
        weights = weights / np.sum(weights)
        return np.tile(weights / 2, 2) if self.rubs else weights

    @cached_property
    def nominal(self) -> Array:
        """Torque without deviations, shape (columns,)."""
        result: Array = self.torques(np.zeros((1, len(self.causes))))[0]
        return result

    @cached_property
    def _forces(self) -> ca.Function:
        """The force at all angles, (extensions (n,), moved numbers) -> (n,)."""
        stretch, numbers = ca.MX.sym("stretch", len(self.angles)), ca.MX.sym("numbers", len(self.moved))
        mapped = self.force.map(len(self.angles))(stretch.T, numbers)
        forces = ca.Function("forces", [stretch, numbers], [mapped.T])
        return forces.expand() if self.force.n_instructions() < _LONG else forces

    @cached_property
    def _amounts(self) -> Array:
        """Change of each moved number per standard deviation of each cause, shape (causes, moved)."""
        amounts = np.zeros((len(self.causes), len(self.moved)))
        for k, cause in enumerate(self.causes):
            if isinstance(cause, NumberCause):
                for name, amount in cause.numbers:
                    amounts[k, self.moved.index(name)] += amount
        return amounts

    def rms(self, torques: Array) -> Array:
        """Return the root of the mean over angle and stroke of the squared error.

        ``torques``: shape (draws, columns), in N·m.
        """
        return np.sqrt((torques - self.wanted) ** 2 @ self.weights)

    def held(self, deviations: Array) -> int:
        """Return in how many draws a number had to be held at the end of its range.

        ``deviations``: in units of the standard deviations, shape (draws, causes).
        """
        free = self.numbers + deviations @ self._amounts
        outside = np.any((free < self.ranges[:, 0]) | (free > self.ranges[:, 1]), axis=1)
        near = self.contour.distance(self.causes, deviations) < self.contour.nearest_anchor
        return int(np.sum(outside | near))

    def torques(self, deviations: Array, touched: tuple[Array, Array] | None = None) -> Array:
        """Return the torque of made springs.

        ``deviations``: in units of the standard deviations, shape (draws, causes). Result: shape (draws,
        columns), in N·m.
        """
        arms, longer = touched or self.contour.deviating(self.causes, deviations)
        numbers = np.clip(self.numbers + deviations @ self._amounts, self.ranges[:, 0], self.ranges[:, 1])
        column = {name: numbers[:, k, None] for k, name in enumerate(self.moved)}
        stretch = column[self.cam.pretension] + longer
        forces = np.array(self._forces(np.maximum(stretch, 0.0).T, numbers.T), dtype=float).T
        # A slack cable does not push.
        torques = column[self.cam.elements] * arms * np.where(stretch >= 0.0, forces, 0.0)
        torques = torques + deviations @ losses_of(self.causes, self.angles)
        if not self.rubs:
            return torques
        exponent = self._exponent(numbers)[:, None]
        return np.concatenate([torques * np.exp(exponent), torques * np.exp(-exponent)], axis=1)

    def _exponent(self, numbers: Array) -> Array:
        """Return the sum of µφ of all guides, shape (draws,)."""
        total = np.zeros(len(numbers))
        for guide in self.cam.guides:
            total = total + np.prod(numbers[:, [self.moved.index(name) for name in guide]], axis=1)
        return total

    @cached_property
    def sensitivities(self) -> Array:
        """Change of the torque per standard deviation of each cause, to first order, (causes, columns)."""
        place = {name: k for k, name in enumerate(self.moved)}
        stretch, numbers = ca.SX.sym("stretch"), ca.SX.sym("numbers", len(self.moved))
        force = self.force.call([stretch, numbers])[0]
        slopes = ca.Function(
            "slopes", [stretch, numbers],
            [force, ca.jacobian(force, stretch), ca.jacobian(force, numbers).T],
        )  # fmt: skip
        pretension, elements = (self.numbers[place[n]] for n in (self.cam.pretension, self.cam.elements))
        arms = self.contour.lever_arms
        at = slopes((pretension + self.contour.extensions).reshape(1, -1), self.numbers)
        pull, stiffness = (np.array(item, dtype=float).ravel() for item in at[:2])
        by_number = np.array(at[2], dtype=float)
        by_number[place[self.cam.pretension]] += stiffness
        by_number[place[self.cam.elements]] += pull / elements
        rows = []
        losses = losses_of(self.causes, self.angles)
        for cause, amounts, loss in zip(self.causes, self._amounts, losses, strict=True):
            arm, longer = self.contour.sensitivity(cause)
            row = elements * (arm * pull + arms * (stiffness * longer + amounts @ by_number)) + loss
            rows.append(self._both_strokes(row, elements * arms * pull, amounts))
        return np.array(rows).reshape(len(self.causes), len(self.wanted))

    def _both_strokes(self, row: Array, torque: Array, amounts: Array) -> Array:
        if not self.rubs:
            return row
        numbers = self.numbers[None, :]
        exponent = float(self._exponent(numbers)[0])
        change = 0.0
        for guide in self.cam.guides:
            places = [self.moved.index(name) for name in guide]
            for k in places:
                others = np.prod([self.numbers[j] for j in places if j != k])
                change += float(amounts[k] * others)
        signs = np.array([[1.0], [-1.0]])
        return np.ravel(np.exp(signs * exponent) * (row + signs * change * torque))


def made_spring(
    model: FlatModel, spring: str | None, *, target: Target, causes: Sequence[Cause], angles: int
) -> MadeSpring:
    """Return the springs that are made from a model's numbers.

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    law = elastic_law(model, spring)
    cam, grid = law.cam, np.linspace(0.0, target.last_angle, angles)
    place = {v.name: k for k, v in enumerate(model.parameters)}
    named = [name for cause in causes if isinstance(cause, NumberCause) for name, _ in cause.numbers]
    guided = [name for guide in cam.guides for name in guide]
    moved = tuple(dict.fromkeys([cam.pretension, cam.elements, *guided, *named]))
    known = [model.parameters[place[name]] for name in moved]
    stretch, numbers = ca.SX.sym("stretch"), ca.SX.sym("numbers", len(moved))
    everything = ca.SX(law.numbers)
    for k, name in enumerate(moved):
        everything[place[name]] = numbers[k]
    force = law.function.call([stretch, everything])[0]
    ranges = np.array([(v.minimum, v.maximum) for v in known])
    ranges[moved.index(cam.pretension), 0] = -np.inf  # below zero the cable is slack
    return MadeSpring(
        cam=cam,
        causes=tuple(causes),
        angles=grid,
        targets=target.torque(grid),
        importance=target.weight(grid),
        contour=made_cam(law, cam_function(model, spring), grid, causes),
        force=ca.Function("force", [stretch, numbers], [force]),
        moved=moved,
        numbers=np.array([v.start for v in known]),
        ranges=ranges,
    )
