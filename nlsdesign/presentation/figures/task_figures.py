"""A task and its spring: the torque curve, and the motor over a period with and without it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from ...design import MotorCycle, TaskCurve
from ...foundation.arrays import Array
from .number_text import significant
from .style import AFTER, BEFORE, DASHES, INK, MUTED, described, legend, panels, styled

_LABELS = ("rigid", "best linear spring", "this curve")
_DASHES = (DASHES[2], DASHES[1], DASHES[0])


@styled
def motor_over_task(curve: TaskCurve) -> Figure:
    """Draw torque, speed and power of the motor over a period: rigid, best linear spring, and the curve.

    Parameters
    ----------
    curve
        For a task.
    """
    rows: tuple[tuple[str, str, Callable[[MotorCycle], Array]], ...] = (
        ("Motor torque", "torque in N·m", lambda motor: motor.torque),
        ("Motor speed", "speed in rad/s", lambda motor: motor.speed),
        ("Power at the motor shaft", "power in W", lambda motor: motor.power),
    )
    cycles = (curve.rigid, curve.linear, curve.best)
    figure, axes = panels(3, height=6.6, sharex=True)
    for panel, (title, label, values) in zip(axes, rows, strict=True):
        panel.axhline(0.0, color=MUTED.light, linewidth=0.8)
        for tone, dash, name, motor in zip((INK, BEFORE, AFTER), _DASHES, _LABELS, cycles, strict=False):
            if motor is None:  # no linear spring keeps the limits
                continue
            time, shown = motor.cycle.time, values(motor)
            closed = np.append(time, motor.cycle.period), np.append(shown, shown[0])
            panel.plot(*closed, color=tone.light, linestyle=dash, label=name, linewidth=1.4)
        panel.set_title(title)
        panel.set_ylabel(label)
    legend(axes[0])
    axes[-1].set_xlabel("time in s")
    summary = "; ".join(
        f"{name}: {significant(motor.heat)} J of heat, {significant(motor.peak_power)} W at most"
        for name, motor in zip(_LABELS, cycles, strict=True)
        if motor is not None
    )
    return described(figure, f"Torque, speed and power of the motor over one period of the task. {summary}.")


@styled
def curve_of_task(curve: TaskCurve) -> Figure:
    """Draw the torque curve of a task with the best linear spring, both directions.

    Parameters
    ----------
    curve
        For a task.
    """
    figure, (axes,) = panels(1, height=3.4)
    angle = np.linspace(0.0, curve.target.last_angle, 300)
    opposite = curve.opposite or curve.target
    back = np.linspace(0.0, opposite.last_angle, 300)
    axes.axhline(0.0, color=MUTED.light, linewidth=0.8)
    axes.axvline(0.0, color=MUTED.light, linewidth=0.8)
    for sign, at, branch, label in ((1.0, angle, curve.target, "this curve"), (-1.0, back, opposite, None)):
        axes.plot(np.degrees(sign * at), sign * branch.torque(at), color=AFTER.light, label=label)
    beside = "no linear spring keeps the limits"
    if curve.linear is not None and curve.linear_stiffness is not None:
        line = np.array([np.min(curve.linear.cycle.torque), np.max(curve.linear.cycle.torque)])
        beside = f"best linear spring, {significant(curve.linear_stiffness)} N·m/rad"
        at = np.degrees(line / curve.linear_stiffness)
        axes.plot(at, line, color=BEFORE.light, linestyle=DASHES[1], linewidth=1.2, label=beside)
    axes.set_ylabel("torque in N·m")
    axes.set_xlabel("deflection in degrees")
    axes.set_title("Spring for the task")
    axes.margins(x=0.03)
    legend(axes)
    return described(
        figure,
        f"Torque of the spring over its deflection up to {np.degrees(curve.target.last_angle):.1f}° and "
        f"{curve.target.largest:.3g} N·m; beside it: {beside}.",
    )
