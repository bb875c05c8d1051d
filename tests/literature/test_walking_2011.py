"""The walking tables against numbers that Bovi et al. 2011 state apart from them, in "Parameters".

Mean and standard deviation over 124 strides of adults at natural speed. The curves are means over strides at
each instant, so peaks and works of the mean stride need not be the means of those of the strides.
"""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.design import walking_task

# joint: range of angle in degrees, positive peak of power in W/kg, positive and negative work in J/kg
PRINTED = {
    "hip": ((43.4119, 4.2279), (0.8842, 0.2880), (0.1706, 0.0898), (-0.1186, 0.0836)),
    "knee": ((61.3478, 5.1103), (0.5768, 0.4650), (0.0551, 0.0390), (-0.2065, 0.1055)),
    "ankle": ((34.3793, 7.9921), (3.5038, 0.9469), (0.3189, 0.1468), (-0.1219, 0.0613)),
}
STRIDE_TIME = 1.1007


@pytest.mark.parametrize("joint", PRINTED)
def test_range_power_and_work_are_those_printed(joint: str) -> None:
    task = walking_task(joint, body_mass=1.0)
    assert task.period == pytest.approx(STRIDE_TIME, abs=1e-4)
    time, angle, torque = (np.asarray(each) for each in (task.time, task.angle, task.torque))
    power = torque * np.gradient(angle, time)
    step = np.diff(time)
    mean = (power[1:] + power[:-1]) / 2.0
    ours = (
        np.degrees(np.ptp(angle)),
        np.max(power),
        np.sum(np.maximum(mean, 0.0) * step),
        np.sum(np.minimum(mean, 0.0) * step),
    )
    for value, (middle, deviation) in zip(ours, PRINTED[joint], strict=True):
        assert abs(value - middle) < deviation


def test_the_smooth_task_has_the_same_power() -> None:
    for joint, (_, (peak, deviation), _, _) in PRINTED.items():
        cycle = walking_task(joint, body_mass=1.0).sampled()
        assert abs(np.max(cycle.torque * cycle.speed) - peak) < deviation
