"""A C program that feeds recorded inputs to the generated step and compares with the Python evaluation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...foundation.arrays import Array
from ...model.flat import FlatModel, Variable
from ..files import filled
from .c_text import Real
from .guarded_step import GuardedModel
from .structures import member_paths

SAMPLES = 120
DOUBLE_TOLERANCE = 1e-12
"""Largest difference relative to the largest size of each output, for double."""
FLOAT_TOLERANCE = 2e-4
"""The same for float: some 3000 times its rounding error of 6e-8. This covers the rounding of a few
hundred operations, accumulated by stable poles over some ten samples, and still reveals a wrong term."""


def sample_inputs(model: FlatModel, real: Real) -> Array:
    """Return an input sequence that sweeps each range, with NaN, infinities, excesses, a jump and a gap.

    A measured input moves over its usual range, and no faster than is believed.

    Parameters
    ----------
    model
        Discrete model.
    real
        Number type; the inputs are exact in it.

    Returns
    -------
    numpy.ndarray
        Shape (samples, inputs).
    """
    columns = np.zeros((SAMPLES, len(model.inputs)))
    for i, variable in enumerate(model.inputs):
        middle, half = _range(variable)
        columns[:, i] = middle + half * _wave(variable, half, float(model.sample_time or 0.0), i)
        for at, bad in ((50, math.nan), (60, math.inf), (70, -math.inf)):
            columns[at + i % 8, i] = bad
        if variable.maximum < math.inf:
            columns[80 + i % 8, i] = variable.maximum + 0.1 * half
        if variable.minimum > -math.inf:
            columns[90 + i % 8, i] = variable.minimum - 10.0 * half
        if variable.plausibility is not None:
            columns[100 + i % 8, i] += 0.5 * half
            columns[108 + i % 4 : 112 + i % 4, i] = math.nan
    return np.vectorize(real.round, otypes=[float])(columns) if columns.size else columns


def _wave(variable: Variable, half: float, sample_time: float, number: int) -> Array:
    """Return a motion within ±0.9; a measured one is slow enough to be believed."""
    slow, fast = 0.071 * (number + 1), 0.39
    k = np.arange(SAMPLES, dtype=float)
    if variable.plausibility is not None:
        k *= min(
            1.0, 0.5 * variable.plausibility.largest_rate * sample_time / (half * (0.6 * slow + 0.3 * fast))
        )
    return np.asarray(0.6 * np.sin(slow * k + number) + 0.3 * np.sin(fast * k + 2 * number))


def _range(variable: Variable) -> tuple[float, float]:
    if variable.plausibility is None and math.isfinite(variable.minimum) and math.isfinite(variable.maximum):
        return (variable.minimum + variable.maximum) / 2, (variable.maximum - variable.minimum) / 2
    return variable.start, variable.nominal


def selftest_source(model: FlatModel, name: str, real: Real) -> str:
    """Return the self-test; its ``main`` returns 0, or the number of the first sample that differs.

    Parameters
    ----------
    model
        Discrete model.
    name
        Prefix of all C names.
    real
        Number type.
    """
    inputs = sample_inputs(model, real)
    run = GuardedModel(model, real)
    results = [run.step(row) for row in inputs.tolist()]
    outputs = np.array([y for y, _ in results]).reshape(len(results), len(model.outputs))
    size = np.abs(outputs).max(axis=0, initial=0.0)
    relative = DOUBLE_TOLERANCE if real.name == "double" else FLOAT_TOLERANCE
    tolerance = [relative * float(v) + real.epsilon**2 for v in size]
    u, y = member_paths(model.inputs).values(), member_paths(model.outputs).values()
    values = {
        "name": name,
        "samples": str(len(results)),
        "given": number_rows("given", inputs.tolist(), real),
        "expected": number_rows("expected", outputs.tolist(), real),
        "tolerance": number_rows("tolerance", [tolerance], real),
        "status": ", ".join(f"0x{s:x}u" for _, s in results),
        "assignments": [f"inputs.{path} = given[k][{i}];" for i, path in enumerate(u)],
        "comparisons": [_comparison(real, path, i) for i, path in enumerate(y)],
    }
    return filled("controller_selftest.c", values)


def _comparison(real: Real, path: str, i: int) -> str:
    difference = f"{real.function('fabs')}(outputs.{path} - expected[k][{i}])"
    return f"differs |= !({difference} <= tolerance[0][{i}]);"


def number_rows(name: str, rows: Sequence[Sequence[float]], real: Real) -> list[str]:
    """Return the definition of a table of constants.

    Parameters
    ----------
    name
        Name of the array.
    rows
        Numbers, NaN too.
    real
        Number type.
    """
    width = len(rows[0]) if rows else 0
    if not width:
        return []
    lines = [f"static const {real.name} {name}[{len(rows)}][{width}] = {{"]
    lines += ["    {" + ", ".join(_number(v, real) for v in row) + "}," for row in rows]
    return [*lines, "};"]


def _number(value: float, real: Real) -> str:
    return f"({real.name})NAN" if math.isnan(value) else real.literal(value)
