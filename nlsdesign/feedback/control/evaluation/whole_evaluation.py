"""All that is asked of a torque loop in one go: responses, margins, impedance, coupling, limit cycles.

Frequencies side by side with one verdict share one sentence.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import NlsError
from ....foundation.text_files import write_table
from ....model import FlatModel
from ....model.roles import measured_motion, motor_of, series_spring
from ....model.transform import with_outputs
from ....simulation.buffered import Translate, as_it_is
from ...observer import CascadeGain, design_observer
from ..closed_loop import ClosedLoop, encoder_loop
from ..laws.known_drive import largest_torque, only_side
from ..laws.outer_laws import ScheduledTorque
from ..laws.torque_loop import torque_controller
from ..laws.velocity_loop import VelocityLoop
from .loop_verdict import LoopVerdict
from .margins import (
    CoupledStability,
    LoopMargins,
    OutputImpedance,
    coupled_stability,
    loop_margins,
    output_impedance,
)
from .onset import LimitCycleOnset, SaturationLine, onset_of_limit_cycling, saturation_line
from .responses import (
    HeldTorque,
    SineResponse,
    ZeroTorque,
    held_torque,
    sine_response,
    torque_resolution,
    zero_torque,
)
from .spread_margins import SpreadMargins, margins_alone, spread_margins

FREQUENCIES = (0.1, 11.0, 20)
"""First and last in Hz, and how many."""
BIAS = 1.25
"""Offset of a sine of torque over its amplitude, where the spring gives one sign only."""


@dataclass(frozen=True, eq=False)
class LoopEvaluation:
    """What a torque loop does, and where it stops to do it.

    Parameters
    ----------
    responses
        To sines of the desired torque, one for each amplitude.
    held
        The largest torque of each sine, held.
    onsets
        Gain at which limit cycling begins, for each of these torques; empty for a gain of zero.
    line
        Where the drive saturates.
    margins
        Over the angle, cut at the current and at the torque.
    impedance, coupled
        What a load feels, and on which loads the loop is stable.
    zero
        No torque wanted, load moved.
    resolution
        Torque of one count at the angles of the margins, in N·m.
    spread
        Margins of the gain over the spread of the deck, and whether machines settle after a kick.
    """

    responses: tuple[SineResponse, ...]
    held: HeldTorque
    onsets: tuple[LimitCycleOnset, ...]
    line: SaturationLine
    margins: tuple[LoopMargins, ...]
    impedance: OutputImpedance
    coupled: CoupledStability
    zero: ZeroTorque
    resolution: Array
    spread: SpreadMargins

    def findings(self) -> list[str]:
        """Return sentences on what does not hold; none if the loop is stable, with a margin."""
        result = []
        for response in self.responses:
            about = f" about {response.offset:g} N·m" if response.offset else ""
            for where, verdict in stretches(response.frequency.tolist(), response.verdicts):
                result.append(f"sine of ±{response.amplitude:g} N·m{about} at {where}: {verdict}")
        for torque, held in zip(self.held.torque, self.held.verdicts, strict=True):
            if not held.holds:
                result.append(f"{torque:g} N·m held: {held}")
        for where, verdict in stretches(self.zero.frequency.tolist(), self.zero.verdicts):
            result.append(f"no torque wanted, load moved at {where}: {verdict}")
        linear = self.margins[0].linear
        lost = np.degrees(linear.angles[linear.reached & ~linear.stable()])
        if len(lost):
            result.append(f"the linear loop is unstable from {lost[0]:.3g}° on, {linear.mode}")
        result += self.spread.findings()
        if result:
            result += [str(onset) for onset in self.onsets]
        return result

    @property
    def stable(self) -> bool:
        """Whether nothing was found that does not hold, too small a margin included."""
        return not self.findings()

    def content(self) -> dict[str, Any]:
        """Return all figures as JSON holds them, with their units in their names."""
        findings, linear, kicked = self.findings(), self.margins[0].linear, self.spread.kicked
        return {
            "stable": not findings,
            "findings": findings,
            "responses": [
                {
                    "amplitude_Nm": r.amplitude, "offset_Nm": r.offset, "frequency_Hz": _plain(r.frequency),
                    "magnitude_dB": _plain(r.decibel), "phase_deg": _plain(r.phase_degrees),
                    "saturated": _plain(r.saturated), "verdicts": [str(v) for v in r.verdicts],
                }
                for r in self.responses
            ],
            "onset": [
                {"gain": o.gain, "amplitude_Nm": o.amplitude, "value": json_number(o.value),
                 "linear": json_number(o.linear), "words": str(o)}
                for o in self.onsets
            ],
            "saturation_Nm": _plain(self.line.torque),
            "margins": [
                {"opening": m.opening, "gain_dB": _plain(m.gain), "phase_deg": _plain(m.phase),
                 "delay_s": _plain(m.delay)}
                for m in self.margins
            ],
            "margins_over_spread": {
                "gain": self.spread.gain, "value": self.spread.value,
                "declared_dB_deg": _plain(self.spread.least),
                "kept_by_95_percent_dB_deg": _plain(self.spread.spread),
                "value_with_6_dB_30_deg": json_number(self.spread.enough),
                "held_Nm": json_number(kicked.amplitude) if kicked else None,
                "settled_after_kick": json_number(kicked.held) if kicked else None,
                "limit_cycling_after_kick": json_number(self.spread.cycling),
            },
            "angle_rad": _plain(linear.angles), "mode": linear.mode,
            "resolution_Nm": _plain(self.resolution),
            "impedance": {"angle_rad": _plain(self.impedance.linear.angles),
                          "active_from_Hz": _plain(self.impedance.first_active())},
            "coupled": {"inertia_kgm2": _plain(self.coupled.inertias),
                        "stiffness_Nm_rad": _plain(self.coupled.stiffnesses),
                        "stable": self.coupled.stable.tolist()},
            "zero_torque": {"frequency_Hz": _plain(self.zero.frequency), "rms_Nm": _plain(self.zero.rms),
                            "energy_J": _plain(self.zero.energy)},
        }  # fmt: skip

    def write(self, folder: Path) -> list[Path]:
        """Write the responses as a table.

        Parameters
        ----------
        folder
            Where ``responses.csv`` is written.

        Returns
        -------
        list of pathlib.Path
            What was written.

        Raises
        ------
        ExportError
            If it cannot be written.
        """
        rows = [
            [*(f"{x + 0.0:.9g}" for x in (r.amplitude, r.offset, f, db, phase, d, v.saturated)), str(v)]
            for r in self.responses
            for f, db, phase, d, v in zip(
                r.frequency, r.decibel, r.phase_degrees, r.distortion, r.verdicts, strict=True
            )
        ]
        units = {"amplitude": "N*m", "offset": "N*m", "frequency": "Hz", "magnitude": "dB", "phase": "deg",
                 "distortion": "1", "saturated": "1"}  # fmt: skip
        heads = [*(f"{name} [{unit}]" for name, unit in units.items()), "verdict"]
        write_table(folder / "responses.csv", [heads, *rows])
        return [folder / "responses.csv"]


@dataclass(frozen=True, kw_only=True)
class LoopRange:
    """Over what a loop is evaluated.

    Parameters
    ----------
    last
        Angle to which margins and impedance are taken, in rad.
    amplitudes
        Of the desired torque in N·m; by default a fifth and three fifths of the largest torque, half of that
        for a spring of one sign.
    inertias
        Of a free load in kg·m²; by default from a tenth of the motor's to a thousand times.
    load_amplitude
        Of the load's angle in rad where no torque is wanted.
    """

    last: float
    amplitudes: tuple[float, ...] = ()
    inertias: tuple[float, ...] = ()
    load_amplitude: float = math.radians(10.0)


def evaluate_loop(
    fixed: ClosedLoop, moved: ClosedLoop, gain: str, over: LoopRange, *, translate: Translate = as_it_is
) -> LoopEvaluation:
    """Evaluate a torque loop with its load fixed and moved.

    Where the spring gives torque of one sign only, each sine swings about 1.25 amplitudes, and 2.25 are held.

    Parameters
    ----------
    fixed, moved
        The loop on a plant with its load fixed, and on one whose load is moved.
    gain
        Parameter of the controller whose onset of limit cycling is looked for.
    over
        Angles, torques and loads.
    translate
        Turns the equations into those that are run, such as :func:`~nlsdesign.export.quickest` gives.
    """
    reach, side, last = largest_torque(fixed.plant), only_side(fixed.plant), over.last
    shares = (0.1, 0.3) if side else (0.2, 0.6)
    amplitudes = over.amplitudes or [float(f"{share * reach:.2g}") for share in shares]
    largest = [a * (side * (1.0 + BIAS) or 1.0) for a in amplitudes]
    inertia = fixed.plant.values[motor_of(fixed.plant)[1].inertia]
    loads = np.array(over.inertias) if over.inertias else inertia * np.geomspace(0.1, 1e3, 13)
    frequencies, angles = np.geomspace(*FREQUENCIES), np.linspace(0.0, last, 41)
    responses = tuple(
        sine_response(
            fixed, amplitude=a, frequencies=frequencies, offset=side * BIAS * a, translate=translate
        )
        for a in amplitudes
    )
    held = held_torque(fixed, largest, translate=translate)
    value = fixed.controller.values[gain]
    onsets = tuple(
        onset_of_limit_cycling(
            fixed, gain, between=(0.1 * value, 5.0 * value), amplitude=a, translate=translate
        )
        for a in (largest if value > 0.0 else ())
    )
    speed = fixed.controller.values["controller.speed_limit"]
    line = saturation_line(fixed, frequencies, largest_angle=last, speed_limit=speed)
    margins = tuple(loop_margins(fixed, angles, opening=cut) for cut in (None, fixed.desired))
    coupled = coupled_stability(
        moved, angle=0.5 * last, inertias=np.sort(loads),
        stiffnesses=np.array([0.0, *np.geomspace(0.1, 1e3, 12)]),
    )  # fmt: skip
    zero = zero_torque(
        moved, amplitude=over.load_amplitude, frequencies=(0.5, 1.0, 2.0, 5.0, 9.0), translate=translate
    )
    return LoopEvaluation(
        responses, held, onsets, line, margins, output_impedance(moved, angles[::5]), coupled, zero,
        torque_resolution(fixed, angles), spread_margins(fixed, gain, last=last, translate=translate),
    )  # fmt: skip


def cascade_loops(
    fixed: FlatModel, moved: FlatModel, *, delay: int, sample_time: float, **law: Any
) -> tuple[ClosedLoop, ClosedLoop]:
    """Return the torque loop with its load fixed and with it moved; one observer and controller for both."""
    plants = [with_outputs(m, [measured_motion(m), series_spring(m).effort]) for m in (fixed, moved)]
    # What a corrected observer has learned depends on what went before, so a loop with it has no one figure.
    observer = design_observer(plants[0], sample_time=sample_time, gain=CascadeGain())
    controller = torque_controller(plants[0], sample_time=sample_time, **law)
    substeps = max(1, round(10 * sample_time / 1e-3))
    first, second = (
        encoder_loop(plant, observer=observer, controller=controller, delay=delay, substeps=substeps)
        for plant in plants
    )
    return first, second


SLOWER = (0.5, 0.25, 0.125)
"""Bandwidths of both loops that are tried where no gain of the outer one is low enough, as shares."""


def with_margin(
    plant: FlatModel, gain: str, *, last: float, given: bool, sample_time: float, **law: Any
) -> tuple[FlatModel, str]:
    """Return the controller of a plant and a sentence on its margins.

    The gain is lowered where it was not ``given`` and lacks them, and where none is low enough, as behind a
    delay, the velocity loop with it. ``last`` is the angle to which they are taken, ``law`` as for
    :func:`~nlsdesign.feedback.control.torque_controller`.
    """
    controller = torque_controller(plant, sample_time=sample_time, **law)
    try:
        loop, _ = cascade_loops(plant, plant, delay=1, sample_time=sample_time, **law)
        margins = margins_alone(loop, gain, last=last)
    except NlsError as error:  # not every machine has a cascade
        return controller, f"margins of {gain} are not judged: {error}"
    if margins.kept:
        return controller, margins.margins()
    (lacks,) = margins.findings()
    if math.isfinite(margins.enough) and not given:
        return controller.with_values({gain: margins.enough}), f"{lacks}, and is taken"
    outer, around = law.get("law"), law.get("velocity") or VelocityLoop()
    if given or around.bandwidth is not None or not isinstance(outer, ScheduledTorque):
        return controller, lacks
    for share in SLOWER:
        inner = replace(around, bandwidth=share * around.closes_at(sample_time))
        slow = replace(outer, bandwidth=share * outer.closes_at(sample_time))
        loop, _ = cascade_loops(
            plant, plant, delay=1, sample_time=sample_time, **law | {"law": slow, "velocity": inner}
        )
        margins = margins_alone(loop, gain, last=last)
        if margins.kept:
            closes = f"with a velocity loop of {inner.closes_at(sample_time):.3g} Hz"
            return loop.controller, f"{lacks}; {closes} {margins.margins()}, and is taken"
    return controller, lacks


def json_number(value: float) -> float | str | None:
    """Return a number that JSON can hold: nothing for what is none, a word for what is infinite."""
    if math.isnan(value):
        return None
    return value + 0.0 if math.isfinite(value) else "infinite" if value > 0.0 else "minus infinite"


def _plain(values: Any) -> list[float | str | None]:
    return [json_number(float(v)) for v in values]


def stretches(frequencies: Sequence[float], verdicts: Sequence[LoopVerdict]) -> Iterator[tuple[str, str]]:
    """Yield frequencies and what they have in common, for each stretch that does not hold."""
    pairs = zip(map(float, frequencies), verdicts, strict=True)
    for _, group in itertools.groupby(pairs, key=lambda pair: pair[1].state):
        members = list(group)
        if members[0][1].holds:
            continue
        where = _span(members[0][0], members[-1][0], "Hz")
        if len(members) > 1:
            where = f"{where} ({len(members)} of {len(frequencies)} frequencies)"
        yield where, _shared([verdict for _, verdict in members])


def _shared(verdicts: Sequence[LoopVerdict]) -> str:
    """Return what verdicts of one state say, with the ranges of their numbers."""
    if len(verdicts) == 1:
        return str(verdicts[0])
    text = verdicts[0].state
    if not math.isnan(verdicts[0].frequency):
        sizes, paces = [v.amplitude for v in verdicts], [v.frequency for v in verdicts]
        size, pace = _span(min(sizes), max(sizes), "N·m", form=".2g"), _span(min(paces), max(paces), "Hz")
        text += f" of ±{size} at {pace}, current up to {max(v.peak_current for v in verdicts):.3g} A"
    saturated = [100.0 * v.saturated for v in verdicts]
    if max(saturated):
        text += f", {_span(min(saturated), max(saturated), '%', form='.0f')} of the time at the current limit"
    return text


def _span(low: float, high: float, unit: str, *, form: str = ".3g") -> str:
    first, last = format(low, form), format(high, form)
    return f"{first} {unit}" if first == last else f"{first} to {last} {unit}"
