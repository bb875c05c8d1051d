"""Reference results beside an FMU, in the files that the FMI cross-check asks for.

The results are those of the package's own simulation, not of the FMU: of a continuous model by
:func:`~nlsdesign.simulation.simulate`, of a sampled one by the model with the guards of its C code.
Source of the format: FMI cross-check rules 4.1, sections 9.1.4 and 10 (Modelica Association).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...model.flat import FlatModel
from ...simulation import simulate
from ..c.guarded_step import GuardedModel
from ..files import write_all
from .fmu_variables import layout

STEPS = 1000
MOST_VARIABLES = 10
RELATIVE_TOLERANCE = 1e-6
"""Of a comparison, relative to the range of a variable; the FMUs keep it with room to spare."""

_TOLERANCE = 1e-12  # of the simulation, so that its own error does not show


@dataclass(frozen=True, eq=False)
class ReferenceResults:
    """What an importer should find."""

    time: Array  # communication points in s, shape (n,)
    # input_names, inputs: inputs, held from each communication point to the next, shape (n, inputs)
    input_names: tuple[str, ...]
    inputs: Array
    # result_names, results: results at the communication points, shape (n, results)
    result_names: tuple[str, ...]
    results: Array


def reference_results(model: FlatModel, *, step: float | None = None) -> ReferenceResults:
    """Simulate a model over 1000 communication steps, without its FMU.

    Each input swings by a quarter of its typical size about its start value, the first with two periods, the
    next with three and so on; the motion of a body that is moved from outside fits its rate.

    ``step``: communication step in s; by default 1 ms, or the sample time, the only one for a discrete model.
    """
    length = step if step is not None else (model.sample_time or 1e-3)
    if not (math.isfinite(length) and length > 0.0):
        raise ValueRangeError(f"step={length}", "must be a positive number of seconds")
    if model.sample_time not in (None, length):
        raise ValueRangeError(
            f"step={length:g} s", f"must be the sample time {model.sample_time:g} s of the model"
        )
    shown = layout(model).model
    time = np.array([length * k for k in range(STEPS + 1)], dtype=np.float64)
    columns = {}
    for number, v in enumerate(shown.inputs):
        turn = 2.0 * math.pi * (2 + number) * time / time[-1]
        columns[v.name] = v.start + 0.25 * v.nominal * np.sin(turn)
    for body in shown.bodies:
        if body.prescribed and {body.motion, body.rate} <= columns.keys():
            speed = 4.0 * math.pi / time[-1]
            v = shown.variable(body.motion)
            columns[body.motion] = v.start + 0.125 * v.nominal * (1.0 - np.cos(speed * time))
            columns[body.rate] = 0.125 * v.nominal * speed * np.sin(speed * time)
    limited = [np.clip(columns[v.name], v.minimum, v.maximum) for v in shown.inputs]
    inputs = np.array(limited).reshape(len(shown.inputs), len(time)).T
    important = [v.name for v in shown.outputs]
    if shown.sample_time is None:
        important += [v.name for v in shown.states]
        important += [name for spring in shown.springs for name in (spring.effort, spring.motion)]
    names = tuple(dict.fromkeys(important))[:MOST_VARIABLES]
    if model.sample_time:
        # What is shown at communication points is the sample of the point before, at first the first.
        running, outputs = GuardedModel(shown), [v.name for v in shown.outputs]
        samples = [running.step(row)[0] for row in inputs[:-1].tolist()]
        places = [outputs.index(name) for name in names]
        results = np.array([samples[0], *samples], dtype=np.float64)[:, places]
    else:
        results = _continuous(shown, time, inputs, names)
    return ReferenceResults(time, tuple(v.name for v in model.inputs), inputs, names, results)


def write_reference(model: FlatModel, fmu: str | Path, *, step: float | None = None) -> tuple[Path, ...]:
    """Write ``<fmu>_ref.csv``, ``<fmu>_ref.opt`` and, for a model with inputs, ``<fmu>_in.csv``.

    Parameters
    ----------
    model
        The model of the FMU.
    fmu
        The FMU that the files stand beside; it is not read.
    step
        Communication step in s; 1 ms or the sample time by default.

    Returns
    -------
    tuple
        The files.

    Raises
    ------
    ValueRangeError
        If the step is not positive, or not the sample time of a discrete model.
    ConvergenceError
        If the model cannot be simulated.
    ExportError
        If the files cannot be written.

    Examples
    --------
    >>> write_reference(plant, "out/fmu/plant.fmu")  # doctest: +SKIP
    (PosixPath('out/fmu/plant_ref.csv'), ...)
    """
    reference = reference_results(model, step=step)
    place = Path(fmu)
    length = float(reference.time[1] - reference.time[0])
    options = {
        "StartTime": 0.0,
        "StopTime": float(reference.time[-1]),
        "StepSize": length,
        "RelTol": RELATIVE_TOLERANCE,
        "OutputIntervalLength": length,
    }
    texts = {
        place.with_name(f"{place.stem}_ref.csv"): _csv(
            reference.time, reference.result_names, reference.results
        ),
        place.with_name(f"{place.stem}_ref.opt"): "".join(f"{k}, {v!r}\n" for k, v in options.items()),
    }
    if reference.input_names:
        given = _csv(reference.time, reference.input_names, reference.inputs)
        texts[place.with_name(f"{place.stem}_in.csv")] = given
    write_all(texts)
    return tuple(texts)


def _continuous(model: FlatModel, time: Array, inputs: Array, names: Sequence[str]) -> Array:
    drives = {v.name: inputs[:, i] for i, v in enumerate(model.inputs)}
    trace = simulate(model, time, inputs=drives, hold=True, tolerance=_TOLERANCE)
    states = np.array([trace[v.name] for v in model.states]).reshape(len(model.states), len(time)).T
    # At a communication point an importer sees what belongs to the input before it.
    before = np.vstack([inputs[:1], inputs[:-1]])
    labels = [v.name for v in (*model.states, *model.outputs, *model.signals)]
    places = [labels.index(name) for name in names]
    parameters, rows = model.start(model.parameters), []
    for t, x, u in zip(time.tolist(), states, before, strict=True):
        _, y, s, _ = model.equations(t, x, u, parameters, [])
        rows.append(np.concatenate([x, np.array(y).ravel(), np.array(s).ravel()])[places])
    return np.array(rows)


def _csv(time: Array, names: Sequence[str], values: Array) -> str:
    head = ",".join(f'"{name}"' for name in ("time", *names))
    rows = [",".join(repr(x) for x in row) for row in np.column_stack([time, values]).tolist()]
    return "\n".join([head, *rows]) + "\n"
