"""Sections on the torque loop: what the designed spring changes in it, and its co-simulation."""

from __future__ import annotations

import numpy as np

import nlsdesign as nls
from nlsdesign.presentation.report import FigureSection, FoldedSection, Section, TableSection

from .results import Results
from .torque_loop import Cosimulated
from .tracking import AMPLITUDE, PROPORTIONAL, SETTLED

_SHOWN = 45.0  # gain of the run that is drawn: with it the published actuator reaches its current limit


def loop_sections(results: Results) -> list[Section]:
    """Show the tracking error of the torque loop on both actuators; single runs folded."""
    runs = {name: each.loop.cosimulated for name, each in reversed(results.both.items())}
    last = next((name, run) for name, run in runs.items() if run is not None)
    more = (_table(results), _one_run(results), _cosimulated(*last))
    return [_errors(results), FoldedSection("More on tracking, and the co-simulation of the code", more)]


def _errors(results: Results) -> FigureSection:
    lines = {
        f"{name}, Kp {gain:g}": tuple(
            np.array([[r.frequency, r.relative_error] for r in each.following if r.proportional == gain]).T
        )
        for gain in PROPORTIONAL
        for name, each in reversed(results.both.items())
    }
    old, new = ([r.relative_error for r in each.following] for each in results.both.values())
    less = 100.0 * (1.0 - np.array(new) / np.array(old))
    less = less[np.isfinite(less)]
    figure = nls.figures.curves(
        {label: (x, y) for label, (x, y) in lines.items()},
        across="frequency in Hz",
        up="tracking error over wanted torque",
        words="Tracking error of the torque loop over frequency for both actuators and two gains; the "
        f"designed one has {less.min():.0f} to {less.max():.0f} % less.",
    )
    return FigureSection(
        "Tracking error over frequency",
        figure,
        caption=f"Sine of {AMPLITUDE} N·m wanted; rms error over rms of what is wanted, after {SETTLED:g} s.",
        means=f"The designed spring leaves {less.min():.0f} to {less.max():.0f} % less error: with "
        "pretension it is stiff at zero, where the published one is soft and the motor has far to go.",
        assumed="Load held; the observer knows every number exactly. Kp in rad/s per N·m.",
    )


def _table(results: Results) -> TableSection:
    rows = tuple(
        (
            name,
            each.proportional,
            each.frequency,
            f"{100 * each.relative_error:.1f} %" if each.verdict.holds else "none",
            f"{1e3 * each.estimate_error:.1f}" if each.verdict.holds else "none",
            f"{each.peak_current:.1f}",
            str(each.verdict),
        )
        for name, one in results.both.items()
        for each in one.following
    )
    limit = results.published.actuator.quantities()["motor.current_limit"]
    return TableSection(
        "Tracking of a sine",
        ("actuator", "Kp", "Hz", "error", "estimate, mN·m", "current, A", "verdict"),
        rows,
        caption="Rms torque error over what is wanted, rms error of the estimate, peak of the current. Where "
        f"the current reaches its limit of {limit.number:g} A the loop no longer does what its gains say.",
    )


def _one_run(results: Results) -> FigureSection:
    hertz = results.published.following[0].frequency
    drawn = {name: each.followed(_SHOWN, hertz) for name, each in reversed(results.both.items())}
    time = drawn["published"].run.time
    shown = (time >= SETTLED) & (time <= SETTLED + 0.5)
    lines = {name: each.run["plant.motor.current"][shown] for name, each in drawn.items()}
    peaks = ", ".join(f"{name} {drawn[name].peak_current:.0f} A" for name in results.both)
    return FigureSection(
        f"Motor current at Kp {_SHOWN:g} and {hertz:g} Hz",
        nls.figures.over_time(time[shown], lines, quantity="current", unit="A"),
        caption=f"Half a second. Largest: {peaks}.",
        means="The harder gain sets off a limit cycle with the published spring; with the designed one not "
        "at this frequency. The table above says where each holds.",
    )


def _cosimulated(name: str, run: Cosimulated) -> FigureSection:
    late = run.trace.time >= run.trace.time[-1] - 1.0
    loop = nls.figures.closed_loop_of(
        run.trace.at(run.trace.time[late]),
        desired="controller.spring.torque.desired",
        true="plant.spring.torque",
        estimated="observer.spring.torque",
        current="controller.motor.current",
    )
    difference = run.difference
    return FigureSection(
        f"Closed torque loop, {name}",
        nls.figures.closed_loop(loop, differences={"true torque": difference[late]}),
        caption="Plant, the generated observer and torque controller as FMUs, wired by name; exact numbers. "
        "0.8 N·m at 1 Hz, the last second; the controller has one sample to compute.",
        means=f"The same loop simulated in one piece differs by at most "
        f"{nls.figures.compact(float(np.max(np.abs(difference))), 2)} N·m.",
    )
