"""Typical sizes of the variables of an FMU, which importers scale and set absolute tolerances with.

The rule, first what holds:

1. a size that the model states (other than the 1 that stands for none);
2. the largest magnitude of a finite range;
3. of the motion of a body: where it brings the cam of a spring to the end of its contour; of the current of
   a motor: its limit; of a motion without cam: where spring or weight balance the largest drive; of another
   force or torque on a body: the largest of a spring;
4. of the speed of a body with such a motion: what its largest acceleration gives over it, √(a·q);
5. of an inner state of a spring: its largest signal of the same unit there;
6. of what is computed: its largest magnitude at 64 points within the sizes of states and inputs; of a sampled
   model in 400 samples of slow motion;
7. the largest of the same unit, and else 1.

Sizes of rules 4 to 6 are rounded to two digits; none is 0, and none is not finite.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...foundation.arrays import Array
from ...model.flat import FlatModel, Variable
from ...simulation.buffered import Buffered

Sizes = dict[str, float]


def typical_sizes(model: FlatModel) -> Sizes:
    """Return the typical size of each variable but the parameters, ``der(name)`` for derivatives, in SI."""
    sizes = {v.name: size for v in (*model.states, *model.inputs) if (size := _stated(v))}
    if model.sample_time is None:
        _of_machine(model, sizes)
        points = _points(model, sizes)
    else:
        points = _motion(model, sizes)
    for name, size in _largest(model, points).items():
        sizes.setdefault(name, _rounded(size))
    named = (*model.states, *model.inputs, *model.outputs, *model.signals)
    sizes |= {v.name: size for v in named if (size := _stated(v))}
    of_unit: dict[str, float] = {}
    for v in named:
        of_unit[v.unit] = max(of_unit.get(v.unit, 0.0), sizes.get(v.name, 0.0))
    return {v.name: sizes.get(v.name) or of_unit[v.unit] or 1.0 for v in named} | {
        rate: sizes.get(rate) or 1.0 for rate in (f"der({v.name})" for v in model.states)
    }


def with_sizes(variables: Sequence[Variable], sizes: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return variables with these typical sizes."""
    return tuple(replace(v, nominal=sizes[v.name]) for v in variables)


def _stated(v: Variable) -> float:
    """Return the stated size or that of the range, 0 where there is neither."""
    if v.nominal != 1.0 and math.isfinite(v.nominal) and v.nominal != 0.0:
        return abs(v.nominal)
    return max((abs(limit) for limit in (v.minimum, v.maximum) if math.isfinite(limit)), default=0.0)


def _of_machine(model: FlatModel, sizes: Sizes) -> None:
    """Add the sizes that follow from bodies, motors and springs."""
    values = model.values
    ends = {cam.angle: values[cam.last_angle] for s in model.springs for cam in s.cams if cam.last_angle}
    for body in model.bodies if ends else ():
        one = _largest(model, _points(model, {body.motion: 1.0}, only=[body.motion]))
        sizes.setdefault(body.motion, max((end / one[n] for n, end in ends.items() if n in one), default=1.0))
    units = {v.name: v.unit for v in model.inputs}
    for body in model.bodies:
        motor = body.motor
        if motor and units.get(motor.command or "") == "A" and values.get(motor.current_limit):
            sizes.setdefault(str(motor.command), values[motor.current_limit])
    _of_balances(model, sizes)
    motions = [body.motion for body in model.bodies]
    rest = _largest(model, _points(model, sizes, only=[*motions, *units]))
    efforts = [rest.get(spring.effort, 0.0) for spring in model.springs]
    for body in model.bodies:
        for drive in body.drives:
            placed = body.motion in sizes and units[drive] == body.domain.effort_unit
            if placed and max(efforts, default=0.0) > 0.0:
                sizes.setdefault(drive, _rounded(max(efforts)))
    rest = _largest(model, _points(model, sizes, only=[*motions, *units]))
    for body in model.bodies:
        # An importer takes absolute tolerances from sizes: nothing is made up of a motion that is not known.
        speed = math.sqrt(rest.get(f"der({body.rate})", 0.0) * sizes.get(body.motion, 0.0))
        if speed > 0.0:
            sizes.setdefault(body.rate, _rounded(speed))
    state_units = {v.name: v.unit for v in model.states}
    known = {v.name: v.unit for v in (*model.signals, *model.outputs, *model.states)}
    for spring in model.springs:
        for state in spring.states:
            # The motions and efforts in a spring, and strains and forces of its pieces.
            names = [spring.motion, spring.effort]
            for cam in spring.cams:
                names += [cam.angle, cam.torque, cam.extension, cam.force]
                names += [name for piece in cam.specimens for name in (piece.strain, piece.force)]
            alike = [n for n in names if known.get(n) == state_units.get(state)]
            size = max((rest.get(name, 0.0) for name in alike), default=0.0)
            if size > 0.0:
                sizes.setdefault(state, _rounded(size))


def _of_balances(model: FlatModel, sizes: Sizes) -> None:
    """Add the motions at which springs or weights balance the largest drive."""
    for body in model.bodies:
        drives = [drive for drive in body.drives if drive in sizes]
        if body.motion in sizes or not drives:
            continue
        driven = _largest(model, _points(model, sizes, only=drives)).get(f"der({body.rate})", 0.0)
        held = _largest(model, _points(model, {body.motion: 1.0}, only=[body.motion]))
        if driven > 0.0 and held.get(f"der({body.rate})", 0.0) > 0.0:
            sizes[body.motion] = _rounded(driven / held[f"der({body.rate})"])


_Point = tuple[Array, Array]


def _points(
    model: FlatModel, sizes: Mapping[str, float], *, only: Iterable[str] | None = None
) -> list[_Point]:
    """Return states and inputs at corners of the box of their sizes and within it; the others stay at 0."""
    variables = (*model.states, *model.inputs)
    moved = {v.name for v in variables} if only is None else set(only)
    box = np.array([sizes.get(v.name, 1.0) if v.name in moved else 0.0 for v in variables])
    generator = np.random.default_rng(3)
    shares = generator.uniform(-1.0, 1.0, (64, len(variables)))
    shares[::2] = np.sign(shares[::2])
    return [(row[: len(model.states)], row[len(model.states) :]) for row in shares * box]


def _motion(model: FlatModel, sizes: Mapping[str, float]) -> list[_Point]:
    """Return states and inputs of 400 samples in which each input swings once or twice within its size."""
    box = np.array([sizes.get(v.name, 1.0) for v in model.inputs])
    state, points = model.start(model.states), []
    given = [np.zeros(model.equations.size1_in(i)) for i in range(5)]
    given[3] = model.start(model.parameters)
    step = Buffered(model.equations, given)
    rows = np.array(model.equations.sparsity_out(0).row(), dtype=np.intp)
    for k in range(400):
        swing = [math.sin(2.0 * math.pi * k * (1 + i % 2) / 400.0) for i in range(len(box))]
        inputs = box * np.array(swing)
        points.append((state, inputs))
        given[1][:], given[2][:] = state, inputs
        given[4][:] = model.look_up(state.tolist(), inputs.tolist())
        step.evaluate()
        state = np.zeros(len(state))
        state[rows] = step.results[0]
        if not np.all(np.isfinite(state)):
            break
    return points


def _largest(model: FlatModel, points: Sequence[_Point]) -> Sizes:
    """Return the largest finite magnitude of each computed variable that is not 0 everywhere."""
    x, u = (np.array(rows).T for rows in zip(*points, strict=True))
    w = np.array([model.look_up(at.tolist(), given.tolist()) for at, given in points]).T
    every = model.equations.map("every", "serial", len(points), [0, 3], [])
    results = every(0.0, x, u, model.start(model.parameters), w)
    f, y, s, _ = (np.array(each, dtype=float) for each in results)
    rows = np.vstack([f, y, s, x] if model.sample_time is not None else [f, y, s])
    names = [f"der({v.name})" for v in model.states] + [v.name for v in (*model.outputs, *model.signals)]
    names += [v.name for v in model.states] if model.sample_time is not None else []
    values = np.abs(rows)
    values[~np.isfinite(values)] = 0.0
    return {name: size for name, size in zip(names, values.max(axis=1).tolist(), strict=True) if size > 0.0}


def _rounded(size: float) -> float:
    return float(f"{size:.1e}") or 1.0
