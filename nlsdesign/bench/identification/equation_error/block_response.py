"""The response of a block to a record, with exact derivatives with respect to parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array, Indices
from ....foundation.errors import ConvergenceError, MeasurementError, unknown_name
from ....foundation.symbolic import Expression, dependence
from ..filters import smoothed, without_rounding
from ..records.measurement import Record
from .batch import ChainFunction, ColumnFunction, PointFunction
from .block import Block, Drive
from .stepping import STIFF, BlockEquations, stages_of, step_functions

_PROBES = 50
"""Samples at which it is looked how fast a block is."""


class Response(NamedTuple):
    """Output over time, shape (n,), and its derivatives, shape (n, parameters)."""

    output: Array
    slope: Array


class Samples(NamedTuple):
    """What a record gives to a block, worked out once."""

    at: Array  # everything that neither states nor free parameters enter, at the samples
    # begin, end: the same at both ends of each step, with rates of the straight line in between
    begin: Array
    end: Array
    step: float  # time between samples in s


class _Walk(NamedTuple):
    """Functions of a step: tables over the parameters, the step, its slopes, and what carries these on.

    Only the states go through the chain of steps; the slopes of all steps are taken at once afterwards, and
    the derivatives of the states follow from them by products of small matrices. ``near`` holds the states of
    the stages that take their derivative from the start of the record; ``stiff`` tells whether there are
    short implicit steps, ``mean`` whether the mean output over these is taken.
    """

    tables: PointFunction
    step: ChainFunction
    slopes: ColumnFunction
    carried: ChainFunction
    near: list[list[int]]
    stiff: bool
    mean: bool
    instructions: int


class _Digest(NamedTuple):
    """What neither states nor free parameters enter, as functions of inputs and their rates: v."""

    whole: ca.Function
    late: Indices  # which of v come from an input that a free delay shifts
    of_late: ca.Function  # these alone


class DrivenBlock:
    """A block made ready for evaluation with some of its parameters free.

    ``free``: names of the parameters with respect to which derivatives are taken; those on which the output
    does not depend are left out, see :attr:`free`. ``records``: every record to which the block will be
    fitted: together, in whatever order, they decide which states move faster than the samples and take short
    implicit steps. Without records none do. ``values``: free parameters by name at which that is decided;
    those of the model by default. ``span``: time in s over which rates of measured signals are taken; between
    neighbours by default. ``straightened``: names of inputs whose noise the output rectifies: it is evaluated
    where they are smoothed over the span, and what is smoothed away counts with the slope of the output
    there.
    """

    def __init__(
        self,
        block: Block,
        free: Sequence[str],
        *,
        records: Sequence[Record],
        values: Mapping[str, float] | None = None,
        span: float = 0.0,
        straightened: Collection[str] = (),
    ) -> None:
        self.block = block
        self._span = span
        self.free = free_in(block, free)
        self._fixed = block.model.values
        # The places of some inputs, without those that come late: their slopes say how late.
        drives = block.drives
        kept = {name for name in straightened if name in drives and not drives[name].shifted_by}
        self._straightened = [i for i, v in enumerate(block.model.inputs) if v.name in kept]
        late = _late_drives(block, self.free)
        e, digest = _equations(block, self.free, late=late, straightened=self._straightened)
        self._equations, self._size, self._shifted = e, e.state.numel(), digest.late
        self._late = list(late.values())
        functions = (digest.whole, digest.of_late, *_output_functions(e))
        self._digest, self._digest_shifted, self._output, self._plain_output = map(ColumnFunction, functions)
        self._sloped = _sloped(block)
        self._walk: _Walk | None = None
        if self._size:
            self._stages = stages_of(e.derivative, e.state, e.digested)
            arguments = [e.state, e.digested, ca.vertcat(e.parameter, e.now)]
            slope = ca.jacobian(e.derivative, e.state)
            slope = ca.densify(slope)
            self._rate = PointFunction(ca.Function("rate", arguments, [ca.densify(e.derivative), slope]))
            self._steepness = ColumnFunction(ca.Function("steepness", arguments, [ca.vec(slope)]))
            self._walk = self._made_walk(records, {**self._fixed, **(values or {})})

    def samples(self, record: Record, values: Mapping[str, float], known: Samples | None = None) -> Samples:
        """Return the inputs of the block from a record.

        ``values``: free parameters by name; a late signal is advanced by what stands there. ``known``: those
        at other values, where there are any; what no free delay shifts is that of these.
        """
        inputs, rates = self._inputs(record, values, smooth=self.stiff)

        def digested(inputs: Array, rates: Array, before: Array | None) -> Array:
            """Return what neither states nor free parameters enter; what nothing shifts may be known."""
            if before is None:
                return self._digest(inputs.shape[1], [inputs, rates])
            result = before.copy()
            result[self._shifted] = self._digest_shifted(inputs.shape[1], [inputs, rates])
            return result

        at = digested(inputs, rates, known.at if known else None)
        corners = _corners(self.block, self._sloped, inputs, record.step)
        if corners is None:
            return Samples(at, at[:, :-1], at[:, 1:], record.step)
        begin = digested(corners[0], rates[:, :-1], known.begin if known else None)
        end = digested(corners[1], rates[:, 1:], known.end if known else None)
        return Samples(at, begin, end, record.step)

    def _inputs(self, record: Record, values: Mapping[str, float], *, smooth: bool) -> tuple[Array, Array]:
        """Return the inputs of the model, and the slopes by which late ones change with their delay.

        Where the model rectifies the noise of an input, that is smoothed, and what was taken away stands in
        the place of the slope.
        """
        model, n = self.block.model, len(record.trace)
        inputs = self.block.at_rest(n)
        rates = np.zeros_like(inputs)
        for i, variable in enumerate(model.inputs):
            drive = self.block.drives.get(variable.name)
            if drive is None:
                continue
            inputs[i] = record.derived(drive.signal, drive.order, self._span)
            # Whether the rate of a signal drives the block too.
            is_motion = any(d.signal == drive.signal and d.order == 1 for d in self.block.drives.values())
            if smooth and drive.order == 0 and is_motion:
                inputs[i] = without_rounding(inputs[i], record.step, self._span)
            if i in self._straightened:
                signal = record.at_samples(drive.signal) if drive.order else inputs[i]
                even = smoothed(signal, record.step, order=drive.order, span=self._span)
                inputs[i], rates[i] = even, inputs[i] - even
            if drive.shifted_by:
                now, since = {**self._fixed, **values}, record.trace.time - record.trace.time[0]
                delay = sum(now[n] for n in drive.late_by) + sum(now[n] for n in drive.stretched_by) * since
                # Read later by linear interpolation, with the slope of the line it is read from.
                time, signal = record.trace.time, inputs[i]
                before = np.clip(np.searchsorted(time, time + delay, side="right") - 1, 0, n - 1)
                rates[i] = np.append(np.diff(signal) / np.diff(time), 0.0)[before]
                inputs[i] = np.interp(time + delay, time, signal)
            if set(drive.stretched_by) & set(self._late):
                rates[i] = rates[i] * since  # what a change of the rate shifts grows with time
        return inputs, rates

    @property
    def needs_new_samples(self) -> bool:
        """Whether the samples depend on free parameters, that is, whether a free delay advances a signal."""
        return bool(self._late)

    @property
    def stiff(self) -> bool:
        """Whether some states move faster than the samples of some record, as contact does."""
        return self._walk is not None and self._walk.stiff

    @property
    def instructions(self) -> int:
        """How many operations one step with all its derivatives takes."""
        return self._walk.instructions if self._walk is not None else 0

    def respond(self, given: Samples, values: Mapping[str, float]) -> Response:
        """Return the output and its derivatives."""
        p = _vector(values, (*self.free, *self._late))
        n = given.at.shape[1]
        states, mean = (np.zeros((0, n)), None) if self._walk is None else self._states(self._walk, given, p)
        result = self._output(n, [states, given.at, p]) if mean is None else _centred(mean)
        _require_finite(self.block, result)
        # Where a state moves faster than the steps, as hysteresis that yields within a sample, it stays
        # bounded while its slopes grow from step to step, beyond all sense: by them a change of a number in
        # its last digit would change the output by more than all of it.
        largest, relative = np.max(np.abs(result[0])), np.abs(p[: len(self.free), None] * result[1:])
        if largest > 0.0 and np.max(relative, initial=0.0) * np.finfo(float).eps > largest:
            raise ConvergenceError(
                f"block '{self.block.name}'",
                "its response has no derivative: a state is faster than the samples",
                next_step="narrow the bounds of the parameters",
            )
        return Response(result[0], result[1:].T)

    def output(self, given: Samples, values: Mapping[str, float]) -> Array:
        """Return the output alone, shape (n,)."""
        p, n, size = _vector(values, (*self.free, *self._late)), given.at.shape[1], self._size
        path = np.zeros((0, n)) if self._walk is None else self._path(self._walk, given, p)[0]
        mean = self._walk is not None and self._walk.mean
        result = _centred(path[size:]) if mean else self._plain_output(n, [path[:size], given.at, p])
        _require_finite(self.block, result)
        only: Array = result[0]
        return only

    def _path(self, walk: _Walk, given: Samples, p: Array) -> tuple[Array, Array]:
        """Return the states, with the mean output over each step behind them, and the constants of a step."""
        begin, end = given.begin, given.end
        rest = _rest(self.block, self._rate, begin[:, 0], p)
        slope = self._rate(rest, begin.mean(axis=1), p)[1]
        near = [slope[np.ix_(g, g)].ravel(order="F") for g in walk.near]
        tables = walk.tables(p, given.step)[0].ravel(order="F")
        constant = np.concatenate([p, tables, *near, [given.step]])
        start = np.concatenate([rest, [0.0] * walk.mean])
        path: Array = np.column_stack([start, walk.step(begin.shape[1], [start, begin, end, constant])])
        return path, constant

    def _states(self, walk: _Walk, given: Samples, p: Array) -> tuple[Array, Array | None]:
        """Return states and sensitivities, and the mean output over each step where the walk takes it."""
        (path, constant), free = self._path(walk, given, p), len(self.free)
        (rows, steps), size = path[:, 1:].shape, self._size
        if not free:
            return path[:size], path[size:] if walk.mean else None
        # Column after column: by the states at the beginning of the step, and by the free parameters.
        by = walk.slopes(steps, [path[:, :-1], given.begin, given.end, constant]).reshape(
            size + free, rows, steps
        )
        both = np.concatenate([part.reshape(-1, steps) for part in (by[:size, :size], by[size:, :size])])
        none = np.zeros(size * free)
        slopes = np.column_stack([none, walk.carried(steps, [none, both])])
        states = np.concatenate([path[:size], slopes])
        if not walk.mean:
            return states, None
        before = slopes[:, :-1].reshape(free, size, steps)
        means = np.einsum("jk,pjk->pk", by[:size, size], before) + by[size:, size]
        return states, np.vstack([path[size], np.column_stack([np.zeros(free), means])])

    def _made_walk(self, records: Sequence[Record], values: Mapping[str, float]) -> _Walk:
        """Return the functions of a step, with short implicit steps for what is faster than a sample."""
        p = _vector(values, (*self.free, *self._late))
        stretches = np.zeros(len(self._stages))
        for record in () if all(stage.linear for stage in self._stages) else records:
            stretches = np.maximum(stretches, self._stretches(record, values, p))
        stiff = [
            not stage.linear and bool(size > STIFF)
            for stage, size in zip(self._stages, stretches, strict=True)
        ]
        # What jumps within a step is not seen at its ends; a balance of efforts counts the impulse.
        mean = any(stiff) and self.block.target is None
        functions, near = step_functions(self._equations, self._stages, stiff, mean=mean)
        tables, step, slopes, carried = functions
        instructions = sum(each.n_instructions() for each in (step, slopes, carried))
        return _Walk(
            PointFunction(tables), ChainFunction(step), ColumnFunction(slopes), ChainFunction(carried),
            near, any(stiff), mean, instructions,
        )  # fmt: skip

    def _stretches(self, record: Record, values: Mapping[str, float], p: Array) -> Array:
        """Return for each stage the largest norm of its derivative along a record, times the step."""
        inputs, rates = self._inputs(record, values, smooth=False)
        corners = _corners(self.block, self._sloped, inputs, record.step)
        left = (inputs if corners is None else corners[0])[:, : inputs.shape[1] - 1]
        every = slice(None, None, max(1, left.shape[1] // _PROBES))
        left, late = left[:, every], rates[:, : inputs.shape[1] - 1][:, every]
        probes = self._digest(left.shape[1], [left, late])
        rest, n = _rest(self.block, self._rate, probes[:, 0], p), self._size
        slopes = self._steepness(left.shape[1], [rest, probes, p]).T.reshape(-1, n, n)
        # Where there is no derivative there is no response either, and a fit is told so.
        slopes = slopes[np.isfinite(slopes).all(axis=(1, 2))]
        inside = [slopes[:, g.states][:, :, g.states] for g in self._stages]
        return record.step * np.array([np.linalg.norm(m, 2, axis=(1, 2)).max(initial=0.0) for m in inside])


def _vector(values: Mapping[str, float], names: Sequence[str]) -> Array:
    return np.array([values[name] for name in names])


def _require_finite(block: Block, response: Array) -> None:
    if not np.all(np.isfinite(response)):
        raise ConvergenceError(
            f"block '{block.name}'",
            "its response is not finite",
            next_step="narrow the bounds of the parameters",
        )


def _rest(block: Block, rate_at: PointFunction, begin: Array, p: Array) -> Array:
    """Return the state in which a block rests at the first sample, cold: bench records start at rest."""
    x = np.array([v.start for v in block.model.states])
    settled = np.array([v.name not in block.cold for v in block.model.states])
    for _ in range(3):
        rate, slope = rate_at(x, begin, p)
        if not (np.all(np.isfinite(rate)) and np.all(np.isfinite(slope))):
            raise ConvergenceError(f"block '{block.name}'", "has no state of rest at the first sample")
        free = slope * np.outer(settled, settled)
        later = x - (np.linalg.pinv(free, rcond=1e-9) @ (rate.ravel() * settled)).ravel()
        if np.array_equal(later, x):
            break  # it would stay there
        x = later
    return x


def _corners(block: Block, sloped: Sequence[int], inputs: Array, step: float) -> tuple[Array, Array] | None:
    """Return the inputs at both ends of every step, with rates of the line in between.

    Nothing is returned where no state is driven by a rate: then they are the inputs at the samples.
    """
    names, drives = [v.name for v in block.model.inputs], block.drives
    if not sloped:
        return None
    left, right = inputs[:, :-1].copy(), inputs[:, 1:].copy()
    for i in sloped:
        signal = drives[names[i]].signal
        value = names.index(next(n for n, d in drives.items() if d.signal == signal and d.order == 0))
        left[i] = right[i] = np.diff(inputs[value]) / step
    return left, right


def _sloped(block: Block) -> list[int]:
    """Return which inputs are rates of signals; none where no state is driven by one."""
    s, drives = block.model.symbols(), block.drives
    names = [v.name for v in block.model.inputs]
    sloped = [i for i, name in enumerate(names) if name in drives and drives[name].order == 1]
    moved = s.state.numel() and ca.depends_on(s.derivative, ca.vertcat(*[s.input[i] for i in sloped]))
    return sloped if moved else []


def _centred(mean: Array) -> Array:
    """Return means over the steps, of which the first column is void, as values at the samples."""
    steps = mean[:, 1:]
    result: Array = 0.5 * (
        np.concatenate([steps[:, :1], steps], axis=1) + np.concatenate([steps, steps[:, -1:]], axis=1)
    )
    return result


def free_in(block: Block, free: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters that the output depends on, directly, through the states, or as a delay."""
    s = block.model.symbols()
    names = [v.name for v in block.model.parameters]
    for name in free:
        if name not in names:
            raise unknown_name("parameter", name, names)
    together = ca.vertcat(s.output, s.derivative) if s.state.numel() else s.output
    late = {name for d in block.drives.values() for name in d.shifted_by}
    return tuple(n for n in free if n in late or ca.depends_on(together, s.parameter[names.index(n)]))


def _late_drives(block: Block, free: Sequence[str]) -> dict[Drive, str]:
    """Return the drives that a free delay shifts, with its name; of several delays records show the sum."""
    late = {}
    for drive in block.drives.values():
        names = [name for name in drive.shifted_by if name in free]
        if len(names) > 1:
            raise MeasurementError(
                f"signal '{drive.signal}'",
                f"is delayed by {' and by '.join(names)}, both free, which cannot be told apart",
                next_step="let one of them free, and give the other a number without a spread",
            )
        if names:
            late[drive] = names[0]
    return late


def _equations(
    block: Block, free: Sequence[str], *, late: Mapping[Drive, str], straightened: Sequence[int]
) -> tuple[BlockEquations, _Digest]:
    model, s = block.model, block.model.symbols()
    names = [v.name for v in model.parameters]
    place = [names.index(n) for n in free]
    rest = [i for i in range(len(names)) if i not in place]
    p = ca.SX(ca.vertcat(*[s.parameter[i] for i in place]))
    rates = ca.SX.sym("rate", s.input.shape)
    now, moved = ca.SX.sym("now", len(late)), list[Expression]()
    together = ca.vertcat(s.derivative, s.output) if s.state.numel() else s.output
    fixed = ca.vertcat(*[s.parameter[i] for i in rest])
    together = ca.substitute(together, fixed, ca.DM(np.array([model.parameters[i].start for i in rest])))
    for i, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is not None and drive in late:
            # The samples were advanced by the present delay; its derivative is that of the signal.
            k, moved = list(late).index(drive), [*moved, s.input[i], rates[i]]
            shift = (p[list(free).index(late[drive])] - now[k]) * rates[i]
            together = ca.substitute(together, s.input[i], s.input[i] + shift)
    if straightened:
        n = s.state.numel()
        seen = ca.vertcat(*[s.input[i] for i in straightened])
        left = ca.vertcat(*[rates[i] for i in straightened])
        straight = together[n:] + ca.jtimes(together[n:], seen, left)
        whole = ca.substitute(together[:n], seen, seen + left) if n else ca.SX(0, 1)
        together = ca.vertcat(whole, straight)
    given = ca.vertcat(s.input, rates)
    core, symbols, parts = ca.extract_parametric(together, given)
    core = ca.cse(core)
    # Inputs that stand alone, as a factor of a parameter, are not extracted: they pass as they are.
    bare = [given[i] for i in range(given.numel()) if ca.depends_on(core, given[i])]
    aliases = [ca.SX.sym(f"bare_{k}") for k in range(len(bare))]
    core = ca.substitute(core, ca.vertcat(*bare), ca.vertcat(*aliases)) if bare else core
    symbols, parts = [*symbols, *aliases], [*parts, *bare]
    column = ca.densify(ca.vertcat(*parts)) if parts else ca.SX(0, 1)
    shifted = np.flatnonzero(dependence(column, ca.vertcat(*moved)).any(axis=1))
    digest, digest_shifted = (
        ca.Function("digest", [s.input, rates], [each]) for each in (column, column[shifted.tolist()])
    )
    n = s.state.numel()
    digested = ca.SX(ca.vertcat(*symbols)) if symbols else ca.SX(0, 1)
    equations = BlockEquations(s.state, digested, p, now, core[:n], core[n:])
    return equations, _Digest(digest, shifted, digest_shifted)


def _output_functions(e: BlockEquations) -> tuple[ca.Function, ca.Function]:
    """Return the output with its derivatives from the states and theirs, and the output alone."""
    slope = ca.SX.sym("slope", e.state.numel(), e.parameter.numel())
    total = ca.jacobian(e.output, e.parameter) + ca.jacobian(e.output, e.state) @ slope
    column = ca.cse(ca.densify(ca.vertcat(e.output, ca.vec(total))))
    given = [e.digested, ca.vertcat(e.parameter, e.now)]
    return (
        ca.Function("output", [ca.vertcat(e.state, ca.vec(slope)), *given], [column]),
        ca.Function("output", [e.state, *given], [ca.densify(e.output)]),
    )
