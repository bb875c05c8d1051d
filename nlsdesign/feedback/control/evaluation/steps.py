"""Step of the desired torque, and what one encoder count is worth in torque."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ....simulation.buffered import Translate, as_it_is
from ....simulation.sampled_batch import run_batch
from ..laws.largest_torque import check_torque
from ..loop.closed_loop import ClosedLoop
from .loop_verdict import LoopJudge, LoopVerdict, tangent_stiffness

Array = NDArray[np.float64]

_BEFORE = 0.5


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Answer of the torque to a step of the desired torque.

    Where the loop does not come to rest the numbers are not numbers.

    Parameters
    ----------
    begin, end
        Desired torque before and after the step, in N·m.
    time
        Since the step in s, shape (n,).
    torque
        In N·m, shape (n,).
    rise
        From a tenth to nine tenths of the step, in s.
    overshoot
        Beyond the end, as a share of the step, 1.
    settling
        Time in s after which the torque stays within a twentieth of the step; not a number if it does not.
    verdict
        On the second half of the run.
    """

    begin: float
    end: float
    time: Array
    torque: Array
    rise: float
    overshoot: float
    settling: float
    verdict: LoopVerdict


def step_response(
    loop: ClosedLoop, *, end: float, begin: float = 0.0, stop: float = 1.0, translate: Translate = as_it_is
) -> StepResponse:
    """Return the answer to a step of the desired torque.

    Parameters
    ----------
    loop
        Load fixed, or held by its inputs at zero.
    end, begin
        Desired torque after and before the step, in N·m; the loop has half a second to come to rest before.
    stop
        Time after the step in s.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ValueRangeError
        If there is no step, it is beyond the current limit, or the run is shorter than 0.1 s.
    """
    if begin == end or not stop >= 0.1:
        raise ValueRangeError(f"step from {begin:g} to {end:g} N·m in {stop:g} s", "needs a step and 0.1 s")
    check_torque(loop.plant, max(abs(begin), abs(end)))
    judge, step = LoopJudge(loop), loop.sample_time
    first, count = round(_BEFORE / step), round((_BEFORE + stop) / step)
    wanted = np.where(np.arange(count + 1) >= first, end, begin)
    batch = run_batch(
        loop.system([loop.desired]), (count - 1) * step, inputs={loop.desired: wanted}, keep=judge.keep,
        translate=translate,
    )  # fmt: skip
    late = {name: batch[name][0, (first + count) // 2 :] for name in judge.keep}
    verdict = judge.judged(late, cycles=0)
    time: Array = step * np.arange(float(count - first))
    torque = batch[loop.torque][0, first:]
    if not verdict.holds:
        return StepResponse(begin, end, time, torque, math.nan, math.nan, math.nan, verdict)
    share = (torque - begin) / (end - begin)
    reached = [np.flatnonzero(share >= level) for level in (0.1, 0.9)]
    rise = float(time[reached[1][0]] - time[reached[0][0]]) if len(reached[1]) else math.nan
    outside = np.flatnonzero(np.abs(share - 1.0) > 0.05)
    after = outside[-1] + 1 if len(outside) else 0
    settling = float(time[after]) if after < len(time) else math.nan
    return StepResponse(
        begin, end, time, torque, rise, max(0.0, float(np.max(share)) - 1.0), settling, verdict
    )


def torque_resolution(loop: ClosedLoop, angles: Sequence[float] | Array) -> Array:
    """Return the torque of one encoder count over the angle, k_t(θ)·count in N·m, shape (n,).

    The counts of all encoders between which the deflection is read add up; zero for readings without counts.

    Parameters
    ----------
    loop
        Closed loop.
    angles
        Of the driven body with the load at zero, shape (n,), in rad.
    """
    at = np.atleast_1d(np.asarray(angles, dtype=float))
    result: Array = np.abs(tangent_stiffness(loop.plant, at)) * LoopJudge(loop).count
    return result
