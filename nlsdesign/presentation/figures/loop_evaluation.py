"""Figures of a closed torque loop: responses, impedance, margins, coupled stability."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ...feedback.control import LoopEvaluation
from ...feedback.control.evaluation.margins import CoupledStability, LoopMargins, OutputImpedance
from ...feedback.control.evaluation.onset import SaturationLine
from ...feedback.control.evaluation.responses import SineResponse
from ...foundation.quantity import typeset_number
from ...foundation.text_files import make_folder
from .style import (
    DASHES,
    HOLDS,
    INK,
    LIMIT,
    MUTED,
    crosses,
    described,
    legend,
    log_axis,
    look,
    panels,
    styled,
    symmetric_log_axis,
)
from .svg import write_figures


@styled
def torque_responses(responses: Sequence[SineResponse], line: SaturationLine | None = None) -> Figure:
    """Draw magnitude and phase of desired to actual torque at several amplitudes.

    Frequencies at which the loop did not settle have no point on the curves; a cross at the lower edge of the
    upper panel marks each.

    Parameters
    ----------
    responses
        One per amplitude.
    line
        Largest torque over frequency, as a third panel with the amplitudes in it.
    """
    count = 3 if line is not None else 2
    figure, axes = panels(count, height=1.4 + 1.7 * count, sharex=True)
    words = []
    for number, response in enumerate(responses):
        tone, dash, point = look(number)
        label = f"{typeset_number(response.amplitude)} N·m"
        for panel, values in ((axes[0], response.decibel), (axes[1], response.phase_degrees)):
            panel.plot(response.frequency, values, color=tone, linestyle=dash, marker=point, label=label)
        lost = [f for f, v in zip(response.frequency, response.verdicts, strict=True) if not v.holds]
        if lost:
            crosses(axes[0], lost, 0.04 + 0.07 * number, tone)
        words.append(_response_words(label, response, lost))
        if line is not None:
            axes[2].axhline(response.amplitude, color=tone, linestyle=dash, linewidth=1.0)
    axes[0].set(title="Desired to actual torque (✕: no settled answer)", ylabel="magnitude in dB")
    axes[1].set_ylabel("phase in degrees")
    if line is not None:
        axes[2].plot(
            line.frequency, line.torque, color=INK.light, label="largest torque of a sine of the angle"
        )
        axes[2].set_ylabel("torque in N·m")
        axes[2].set_ylim(bottom=0.0)
        legend(axes[2])
    log_axis(axes[-1], abscissa=True)
    axes[-1].set_xlabel("frequency in Hz")
    legend(axes[0])
    return described(figure, f"Response of the torque loop. {' '.join(words)}")


@styled
def impedance_over_frequency(result: OutputImpedance) -> Figure:
    """Draw size of the dynamic stiffness and real part of the output impedance at each angle.

    Parameters
    ----------
    result
        Up to nine of its angles are drawn.
    """
    figure, (upper, lower) = panels(2, height=4.8, sharex=True)
    chosen = np.unique(np.linspace(0, len(result.linear.angles) - 1, 6).round().astype(int))
    stiffness, first = result.dynamic_stiffness, result.first_active()
    words = []
    for number, k in enumerate(chosen):
        tone, dash, _ = look(number)
        label = f"{np.degrees(result.linear.angles[k]):.0f}°"
        if not np.any(np.isfinite(result.impedance[k])):
            words.append(f"{label}: the loop is unstable.")
            continue
        upper.plot(result.frequency, np.abs(stiffness[k]), color=tone, linestyle=dash, label=label)
        lower.plot(result.frequency, result.impedance[k].real, color=tone, linestyle=dash)
        words.append(f"{label}: {passivity_words(float(first[k]))}.")
    upper.set_title("Torque that a moved load feels per angle")
    if upper.lines:
        log_axis(upper)
    upper.set_ylabel("|jω·Z| in N·m/rad")
    lower.axhline(0.0, color=INK.light, linewidth=0.9, linestyle=DASHES[1])
    symmetric_log_axis(lower, 1e-3)
    lower.set(title="Real part of the impedance (passive above the dashed line)", ylabel="Re Z in N·m·s/rad")
    log_axis(lower, abscissa=True)
    lower.set_xlabel("frequency in Hz")
    legend(upper, columns=6)
    return described(figure, f"Output impedance, loop {result.linear.mode}. {' '.join(words)}")


@styled
def margins_over_angle(result: Sequence[LoopMargins]) -> Figure:
    """Draw gain, phase and delay margin over the angle; nothing where the loop is unstable.

    Parameters
    ----------
    result
        One per opening of the loop.
    """
    figure, axes = panels(1, 3, height=3.4)
    words = []
    for number, margins in enumerate(result):
        tone, dash, _ = look(number)
        degrees = np.degrees(margins.linear.angles)
        for panel, values in zip(axes, (margins.gain, margins.phase, 1e3 * margins.delay), strict=True):
            panel.plot(degrees, values, color=tone, linestyle=dash, label=f"at {margins.opening}")
        good = np.isfinite(margins.gain)
        least = typeset_number(float(margins.gain[good].min())) if np.any(good) else ""
        words.append(
            f"Cut at {margins.opening}: least gain margin {least} dB, "
            f"unstable at {int(np.sum(~margins.linear.stable()))} of {len(degrees)} angles."
            if least else f"Cut at {margins.opening}: unstable at all angles."
        )  # fmt: skip
    for panel, title in zip(
        axes, ("gain margin in dB", "phase margin in degrees", "delay margin in ms"), strict=True
    ):
        panel.set(xlabel="angle in degrees", ylabel=title)
        panel.set_ylim(bottom=0.0)
    symmetric_log_axis(axes[2], 1.0)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=2)
    return described(figure, f"Margins over the angle, plant {result[0].linear.mode}. {' '.join(words)}")


@styled
def coupled_stability_map(result: CoupledStability) -> Figure:
    """Draw on which loads the loop is stable; their inertias and stiffnesses ascend."""
    figure, (axes,) = panels(1, height=3.6)
    stable = result.stable
    masses, springs = np.meshgrid(result.inertias, result.stiffnesses, indexing="ij")
    for mask, tone, marker, label in (
        (stable, HOLDS.light, "o", "stable"),
        (~stable & np.isfinite(result.radius), LIMIT.light, "x", "unstable"),
        (~np.isfinite(result.radius), MUTED.light, "_", "angle cannot be held"),
    ):
        if np.any(mask):
            axes.plot(masses[mask], springs[mask], color=tone, marker=marker, linestyle="none", label=label)
    log_axis(axes, abscissa=True)
    positive = result.stiffnesses[result.stiffnesses > 0.0]
    symmetric_log_axis(axes, float(positive[0]) if len(positive) else 1.0)
    axes.margins(0.05)
    axes.set(
        title=f"Coupled stability at {np.degrees(result.angle):.0f}°",
        xlabel="inertia of the load in kg·m²",
        ylabel="stiffness to the frame in N·m/rad",
    )
    legend(axes)
    share = f"{int(np.sum(stable))} of {stable.size}"
    return described(figure, f"Coupled stability of the torque loop: stable on {share} loads.")


def passivity_words(first: float) -> str:
    """Return in words from which frequency on a loop is active."""
    if np.isnan(first):
        return "unstable, so it has no impedance"
    return f"active from {typeset_number(first)} Hz on" if np.isfinite(first) else "passive"


def _response_words(label: str, response: SineResponse, lost: Sequence[float]) -> str:
    good = np.isfinite(response.decibel)
    if not np.any(good):
        return f"{label}: settles at no frequency."
    low, high = (typeset_number(float(end(response.decibel[good]))) for end in (np.min, np.max))
    tail = f"; does not settle at {len(lost)} frequencies" if lost else ""
    return f"{label}: {low} to {high} dB{tail}."


def write_loop_figures(result: LoopEvaluation, folder: Path) -> list[Path]:
    """Write what is drawn of an evaluated torque loop as SVG files."""
    make_folder(folder)
    drawn = {
        "responses": torque_responses(result.responses, result.line),
        "impedance": impedance_over_frequency(result.impedance),
        "margins": margins_over_angle(result.margins),
        "coupled_stability": coupled_stability_map(result.coupled),
    }
    return write_figures(folder, drawn)
