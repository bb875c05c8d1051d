"""The sampled loop linearised over the angle: exact between the samples, with delay, observer and controller.

Plant: linearised at rest at each angle, in a stated mode of its dry friction, without the rounding of its
encoders, and taken exactly over one sample (the current held, prescribed motions linear). Blocks:
linearised at the state in which the loop rests at that angle, inside all limits. This is the loop for small
deviations around a held torque, between the counts. What it cannot show is in the simulated runs: limits,
counts, a gain that changes within a cycle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ....model.roles import series_spring
from ....simulation.sampled_batch import PLANT, SampledSystem
from ...observer.corrected.corrected_cascade import PREFIX
from ..closed_loop import ClosedLoop
from ..laws.law_writer import DESIRED
from .linear_parts import SLIDING, LinearPlant, block_at, linear_plant, with_fine_counts

Complex = NDArray[np.complex128]

_WITHOUT_ERROR = 6
"""Steps of the search for rest in which the torque that is estimated is the one that is wanted."""


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """x⁺ = A x + B v + B⁺ v⁺, y = C x + D v of the whole loop at many angles."""

    angles: Array  # of the spring in rad, shape (n,)
    torque: Array  # that the spring holds there, in N·m, shape (n,)
    # current: that holds it, in A, shape (n,); where it is beyond the limit of the controller the loop cannot
    # rest there, reached is false and poles and responses are not numbers
    current: Array
    # reached: whether the loop rests there inside all limits, shape (n,); false also where the controller was
    # only found inside a limit of its own, so that it does not hear what is wanted
    reached: Mask
    sample_time: float  # in s
    # states, inputs, outputs: full names
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    # a, b, b_next, c, d: shapes (n, states, states), (n, states, inputs), twice, (n, outputs, states), (n,
    # outputs, inputs)
    a: Array
    b: Array
    b_next: Array
    c: Array
    d: Array
    speed: float  # of the driven body, at which the slopes of the plant are taken

    @property
    def mode(self) -> str:
        """In which mode of its dry friction the plant is linearised, in words."""
        return f"sliding (slopes at {self.speed:g} rad/s)" if self.speed else "stuck (slopes at rest)"

    def poles(self) -> Complex:
        """Return the closed-loop poles s = ln(z)/T in 1/s, the slowest first, shape (n, states).

        A deadbeat mode (z = 0) is at minus infinity.
        """
        z = np.linalg.eigvals(self.a).astype(complex)
        zero = np.abs(z) < 1e-12
        s = np.where(zero, -math.inf, np.log(np.where(zero, 1.0, z)) / self.sample_time)
        order = np.argsort(-s.real, axis=1)
        result: Complex = np.take_along_axis(s, order, axis=1)
        result[~self.reached] = complex(math.nan, math.nan)
        return result

    def radius(self) -> Array:
        """Return the largest size of an eigenvalue per sample, shape (n,); the loop is stable below one."""
        result: Array = np.max(np.abs(np.linalg.eigvals(self.a)), axis=1)
        return np.where(self.reached, result, np.nan)

    def stable(self) -> Mask:
        """Return where the loop is stable, shape (n,)."""
        # A gain of zero leaves an integrator that nothing moves at exactly one.
        return self.radius() < 1.0 + 1e-9

    def response(self, output: str, given: str, frequencies: Sequence[float] | Array) -> Complex:
        """Return the ratio of an output to an input, shape (n, frequencies)."""
        if output not in self.outputs:
            raise unknown_name("output of the linear loop", output, self.outputs)
        if given not in self.inputs:
            raise unknown_name("input of the linear loop", given, self.inputs)
        row, column = self.outputs.index(output), self.inputs.index(given)
        z = np.exp(2j * math.pi * np.asarray(frequencies, dtype=float) * self.sample_time)
        reduced, turned = self._triangular
        right = np.swapaxes(turned.conj(), 1, 2) @ np.stack(
            [self.b[:, :, column], self.b_next[:, :, column]], axis=2
        )
        left = (self.c[:, row][:, None] @ turned)[:, 0]
        result = np.empty((len(self.angles), len(z)), dtype=complex)
        result[:] = self.d[:, row, column][:, None]
        x = np.zeros((len(self.angles), len(z), reduced.shape[1]), dtype=complex)
        driven = right[:, None, :, 0] + z[None, :, None] * right[:, None, :, 1]
        for i in reversed(range(reduced.shape[1])):
            inner = np.einsum("nk,nfk->nf", reduced[:, i, i + 1 :], x[:, :, i + 1 :])
            x[:, :, i] = (driven[:, :, i] + inner) / (z[None, :] - reduced[:, i, i][:, None])
        result += np.einsum("nk,nfk->nf", left, x)
        result[~self.reached] = complex(math.nan, math.nan)
        return result

    @cached_property
    def _triangular(self) -> tuple[Complex, Complex]:
        """Schur form of A: a response at many frequencies then takes back substitution only."""
        pairs = [scipy.linalg.schur(matrix, output="complex") for matrix in self.a]
        return np.array([t for t, _ in pairs]), np.array([q for _, q in pairs])


def linear_loop(
    loop: ClosedLoop,
    angles: Sequence[float] | Array,
    *,
    opened: Sequence[str] = (),
    speed: float = SLIDING,
    frozen_tables: bool = False,
) -> LinearLoop:
    """Linearise a closed loop at rest at many angles of its spring.

    ``opened``: inputs by full name at which the loop is cut open: the current of the plant, or an input of
    observer or controller. What would drive them is an output. The desired torque and the prescribed motions
    of the plant are inputs always. ``speed``: of the driven body, at which the slopes of the plant are taken;
    zero for a plant that is stuck in its dry friction. ``frozen_tables``: whether looked-up tables are held
    at the angle, where they follow it in the controller.
    """
    at = np.atleast_1d(np.asarray(angles, dtype=float))
    if not len(at):
        raise ValueRangeError("angles", "there are none")
    fine = replace(loop, plant=with_fine_counts(loop.plant), observer=with_fine_counts(loop.observer),
                   controller=with_fine_counts(loop.controller))  # fmt: skip
    system = fine.system([loop.desired])
    for name in opened:
        if name not in (*system.sources, f"{PLANT}.{system.driven}"):
            raise unknown_name("input of the loop", name, [*system.sources, f"{PLANT}.{system.driven}"])
    plant = plant_of(system, at, speed)
    return assembled(system, plant, at, cut=tuple(opened), frozen_tables=frozen_tables, speed=speed)


def plant_of(system: SampledSystem, angles: Array, speed: float) -> LinearPlant:
    """Return the plant of a system, linearised with all signals that are wired."""
    start = f"{PLANT}."
    wired = [s.removeprefix(start) for s in system.sources.values() if s.startswith(start)]
    spring = series_spring(system.plant)
    signals = [*wired, spring.effort, spring.motion]
    shown = tuple(name for name in dict.fromkeys(signals) if name != system.driven)
    return linear_plant(system.plant, tuple(angles), driven=str(system.driven), signals=shown, speed=speed)


def assembled(
    system: SampledSystem,
    plant: LinearPlant,
    angles: Array,
    *,
    cut: tuple[str, ...],
    frozen_tables: bool,
    speed: float,
) -> LinearLoop:
    """Return the whole loop of a linearised plant and the blocks of a system, at rest."""
    writer = _Assembler(system, plant, cut, frozen_tables=frozen_tables)
    writer.rest()
    return writer.loop(angles, speed)


def restless(system: SampledSystem) -> ConvergenceError:
    """Return the error of a loop whose observer learns."""
    return ConvergenceError(
        f"linear loop with {' and '.join(m.name for m in system.blocks.values())}",
        "no rest is found, for what the observer has learned depends on what went before",
        next_step="take a scheduled observer: design_observer(model, gain=CascadeGain())",
    )


class _Assembler:
    """Puts plant and blocks together by rows over all states and open inputs."""

    def __init__(
        self, system: SampledSystem, plant: LinearPlant, cut: tuple[str, ...], *, frozen_tables: bool
    ) -> None:
        self.system, self.plant, self.cut, self.frozen_tables = system, plant, cut, frozen_tables
        self.n = len(plant.drive)
        self.driven = f"{PLANT}.{system.driven}"
        prescribed = [f"{PLANT}.{name}" for name in plant.inputs[1:]]
        block_inputs = [name for name, source in system.sources.items() if source == name]
        self.inputs = tuple(dict.fromkeys([*prescribed, *block_inputs, *cut]))
        owners = {PLANT: plant.states} | {b: [v.name for v in m.states] for b, m in system.blocks.items()}
        waiting = [f"{self.driven}.waiting[{i + 1}]" for i in range(system.delay)]
        self.states = (*(f"{o}.{name}" for o, group in owners.items() for name in group), *waiting)
        self.first = {o: self.states.index(f"{o}.{g[0]}") if g else 0 for o, g in owners.items()}
        self.width = len(self.states) + len(self.inputs)
        self.state = {b: np.zeros((self.n, len(m.states))) for b, m in system.blocks.items()}
        for b, m in system.blocks.items():
            self.state[b][:] = m.start(m.states)
        torque = list(plant.signals).index(series_spring(system.plant).effort)
        self.torque = plant.values[:, torque]
        self.hears = np.ones(self.n, dtype=bool)
        self.open_values = {name: np.zeros(self.n) for name in self.inputs}
        for name in block_inputs:
            self.open_values[name] = self.torque.copy()

    def rest(self) -> None:
        """Find the states of the blocks, and the goals, at which the loop rests."""
        if any(v.name.startswith(f"{PREFIX}.") for m in self.system.blocks.values() for v in m.states):
            # What was learned stays whatever it is, so every value of it would be a rest.
            raise restless(self.system)
        goals = [n for n in self.inputs if n not in self.cut and not n.startswith(f"{PLANT}.")]
        columns = [len(self.states) + self.inputs.index(n) for n in goals]
        for b, m in self.system.blocks.items():
            columns = [*range(self.first[b], self.first[b] + len(m.states)), *columns]
        last = list(self.system.blocks)[-1]
        for k in range(12):
            if k < _WITHOUT_ERROR:
                self._wanted_as_estimated(goals)
            values, rows, following = self.evaluated(at_rest=True)
            residuals, slopes = [], []
            for b, m in self.system.blocks.items():
                own = np.zeros((self.n, len(m.states), self.width))
                first = self.first[b]
                own[:, np.arange(len(m.states)), first + np.arange(len(m.states))] = 1.0
                residuals.append(following[b][0] - self.state[b])
                slopes.append(following[b][1] - own)
            name = f"{last}.{self.system.blocks[last].outputs[0].name}"
            residuals.append((values[name] - self.plant.drive)[:, None])
            slopes.append(rows[name][:, None])
            residual, slope = np.concatenate(residuals, axis=1), np.concatenate(slopes, axis=1)[:, :, columns]
            try:
                step = -(np.linalg.pinv(slope) @ residual[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError as error:
                # Values ran away: a covariance that is a state has no rest like this.
                raise restless(self.system) from error
            for k, column in enumerate(columns):
                self._moved(column, step[:, k])
            if np.max(np.abs(step)) < 1e-9:
                break
        wanted = [column for column in columns if column >= len(self.states)]
        if wanted:
            _, rows, following = self.evaluated(at_rest=True)
            self.hears = self._passes(following[last][1], rows[name], last, wanted)

    def _wanted_as_estimated(self, goals: Sequence[str]) -> None:
        """Begin the search without an error of the torque: from a limit of the command no slope leads out."""
        values, _, _ = self.evaluated(at_rest=True)
        for goal in goals:
            compared = self.system.sources.get(goal.removesuffix(f".{DESIRED}"))
            if compared is not None:
                self.open_values[goal] = values[compared].copy()

    def _passes(self, after: Array, out: Array, block: str, wanted: list[int]) -> Mask:
        """Return where the command follows what is wanted at all; at a limit it has no slope, shape (n,)."""
        own = slice(self.first[block], self.first[block] + after.shape[1])
        moved = np.exp(0.1j) * np.eye(after.shape[1]) - after[:, :, own]
        through = out[:, None, own] @ np.linalg.solve(moved, after[:, :, wanted]) + out[:, None, wanted]
        size = np.max(np.abs(through), axis=(1, 2))
        passes: Mask = size > 1e-9 * np.max(size, initial=0.0)
        return passes

    def _moved(self, column: int, step: Array) -> None:
        if column >= len(self.states):
            self.open_values[self.inputs[column - len(self.states)]] += step
            return
        for b, m in self.system.blocks.items():
            if self.first[b] <= column < self.first[b] + len(m.states):
                self.state[b][:, column - self.first[b]] += step

    def evaluated(
        self, *, at_rest: bool
    ) -> tuple[dict[str, Array], dict[str, Array], dict[str, tuple[Array, Array]]]:
        """Return values and rows of all signals, and what the states of the blocks become."""
        values, rows = dict(self.open_values), {}
        for i, name in enumerate(self.inputs):
            rows[name] = np.zeros((self.n, self.width))
            if not (at_rest and name in self.cut):
                rows[name][:, len(self.states) + i] = 1.0
        values[self.driven] = self.plant.drive
        if self.driven not in self.cut:
            rows[self.driven] = np.zeros((self.n, self.width))
            if self.system.delay:
                rows[self.driven][:, len(self.states) - self.system.delay] = 1.0
        plant, states = self.plant, len(self.plant.states)
        given = np.stack([rows[f"{PLANT}.{name}"] for name in plant.inputs], axis=1)
        for i, name in enumerate(plant.signals):
            row = (plant.d[:, i][:, None] @ given)[:, 0]
            row[:, :states] += plant.c[:, i]
            full = f"{PLANT}.{name}"
            if full not in rows:
                values[full], rows[full] = plant.values[:, i], row
        following = self._pass(values, rows)
        if self.system.delay == 0 and self.driven not in self.cut:
            rows[self.driven] = rows[self._computed]
            following = self._pass(values, rows)
        return values, rows, following

    @property
    def _computed(self) -> str:
        last = list(self.system.blocks)[-1]
        return f"{last}.{self.system.blocks[last].outputs[0].name}"

    def _pass(self, values: dict[str, Array], rows: dict[str, Array]) -> dict[str, tuple[Array, Array]]:
        following = {}
        for b, model in self.system.blocks.items():
            names = [f"{b}.{v.name}" for v in model.inputs]
            sources = [name if name in self.cut else self.system.sources[name] for name in names]
            # A cut loop rests where the closed one does.
            resting = [values[self.system.sources[name]] for name in names]
            point = block_at(
                model, self.state[b], np.stack(resting, axis=1), frozen_tables=self.frozen_tables
            )
            given = np.stack([rows[source] for source in sources], axis=1)
            first, count = self.first[b], len(model.states)
            after, out = point.b @ given, point.d @ given
            after[:, :, first : first + count] += point.a
            out[:, :, first : first + count] += point.c
            for i, v in enumerate(model.outputs):
                values[f"{b}.{v.name}"], rows[f"{b}.{v.name}"] = point.output[:, i], out[:, i]
            following[b] = (point.following, after)
        return following

    def loop(self, angles: Array, speed: float) -> LinearLoop:
        """Return the whole."""
        step, states, n = self.system.sample_time, len(self.plant.states), self.n
        _, rows, following = self.evaluated(at_rest=False)
        phi, held, begin, end = self.plant.sampled(step)
        whole = np.zeros((n, len(self.states), self.width))
        whole[:, :states, :states] = phi
        whole[:, :states] += held @ rows[self.driven][:, None]
        after = np.zeros((n, len(self.states), len(self.inputs)))
        for i, name in enumerate(self.plant.inputs[1:]):
            column = self.inputs.index(f"{PLANT}.{name}")
            whole[:, :states, len(self.states) + column] += begin[:, :, i]
            after[:, :states, column] += end[:, :, i]
        for b, (_, row) in following.items():
            whole[:, self.first[b] : self.first[b] + row.shape[1]] = row
        for i in range(self.system.delay):
            place = len(self.states) - self.system.delay + i
            if i + 1 < self.system.delay:
                whole[:, place, place + 1] = 1.0
            else:
                whole[:, place] = rows[self._computed]
        outputs = tuple(name for name in rows if name not in self.inputs)
        shown = np.stack([rows[name] for name in outputs], axis=1)
        limit = self.system.blocks[list(self.system.blocks)[-1]].outputs[0].maximum
        reached = (np.abs(self.plant.drive) < limit) & self.hears
        return LinearLoop(
            angles, self.torque, self.plant.drive, reached, step, self.states, self.inputs, outputs,
            whole[:, :, : len(self.states)], whole[:, :, len(self.states) :], after,
            shown[:, :, : len(self.states)], shown[:, :, len(self.states) :], speed,
        )  # fmt: skip
