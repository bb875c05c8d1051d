"""``nlsdesign analyse loop``: what the torque loop of an actuator does, and where it stops doing it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .loop_findings import stretches
from .output import deck_option, examples, json_option, show_json, show_table
from .overwriting import out_option
from .range_remarks import check_angles, range_remarks, usual_last, warn
from .units import Number

if TYPE_CHECKING:
    from ..feedback.control import ClosedLoop, LimitCycleOnset, LoopMargins, SineResponse
    from ..feedback.control.evaluation.margins import CoupledStability, OutputImpedance
    from ..feedback.control.evaluation.onset import SaturationLine
    from ..feedback.control.evaluation.responses import HeldTorque, ZeroTorque

GAINS = {"pid": "controller.proportional", "scheduled": "controller.bandwidth"}
"""Number of the controller whose onset of limit cycling is looked for, by law."""
_GAINS = ("proportional", "integral", "derivative")
_FILES = ("responses.csv", "responses.svg", "impedance.svg", "margins.svg", "coupled_stability.svg")
_FREQUENCIES = (0.1, 11.0, 20)
_BIAS = 1.25
"""Offset of a sine of torque over its amplitude, where the spring gives one sign only."""


@dataclass(frozen=True)
class _Asked:
    """What is evaluated."""

    amplitudes: tuple[float, ...]
    last: float
    inertias: tuple[float, ...]
    load_amplitude: float
    gain: str


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """All results of the command."""

    asked: _Asked
    responses: tuple[SineResponse, ...]
    held: HeldTorque
    onsets: tuple[LimitCycleOnset, ...]
    line: SaturationLine
    margins: tuple[LoopMargins, ...]
    impedance: OutputImpedance
    coupled: CoupledStability
    zero: ZeroTorque
    resolution: Any

    @property
    def findings(self) -> list[str]:
        """Sentences on what does not hold; empty for a loop that is stable wherever it was looked at."""
        import numpy as np

        result = []
        for response in self.responses:
            for where, words in stretches(response.frequency.tolist(), response.verdicts):
                result.append(f"sine of {_sine(response)} at {where}: {words}")
        for torque, verdict in zip(self.held.torque, self.held.verdicts, strict=True):
            if not verdict.holds:
                result.append(f"{torque:g} N·m held: {verdict}")
        for where, words in stretches(self.zero.frequency.tolist(), self.zero.verdicts):
            result.append(f"no torque wanted, load moved at {where}: {words}")
        linear = self.margins[0].linear
        lost = np.degrees(linear.angles[linear.reached & ~linear.stable()])
        if len(lost):
            result.append(f"the linear loop is unstable from {lost[0]:.3g}° on, {linear.mode}")
        if result:
            result += [str(onset) for onset in self.onsets]
        return result


@click.command(
    epilog=examples(
        "nlsdesign analyse loop --deck austin2015_figure_consistent",
        "nlsdesign analyse loop --deck austin2015_figure_consistent --law scheduled "
        "--bandwidth '10 Hz' --amplitude '0.5 N*m' --json",
    )
)
@deck_option
@click.option("--law", type=click.Choice(list(GAINS)), default="pid", show_default=True,
              help="A PID, or speed by tangent stiffness.")  # fmt: skip
@click.option("--bandwidth", type=Number("Hz", above=0.0), default=None,
              help="Of the scheduled law; by default 12 Hz at 1 kHz.")  # fmt: skip
@click.option("--proportional", type=Number("rad/s/N/m", above=0.0), default=None,
              help="Gain Kp of the torque loop.")  # fmt: skip
@click.option("--integral", type=Number("rad/s^2/N/m"), default=None, help="Gain Ki of the torque loop.")
@click.option("--derivative", type=Number("rad/N/m"), default=None, help="Gain Kd of the torque loop.")
@click.option("--amplitude", "amplitudes", type=Number("N*m", above=0.0), multiple=True,
              help="Of the desired torque; several times for several. By default a fifth and three fifths of "
              "the largest torque, half of that for a spring of one sign.")  # fmt: skip
@click.option("--to", "last", type=Number("deg", above=0.0), default=None,
              help="Last angle; by default that of the contour, 50 deg at most.")  # fmt: skip
@click.option("--load-inertia", "inertias", type=Number("kg*m^2", above=0.0), multiple=True,
              help="Of a free load; several times for several. By default from a tenth of the motor's to a "
              "thousand times.")  # fmt: skip
@click.option("--load-amplitude", type=Number("deg"), default="10 deg", show_default=True,
              help="Of the load's angle where no torque is wanted.")  # fmt: skip
@click.option("--delay", type=click.IntRange(0, 100), default=1, show_default=True, help="In samples.")
@click.option("--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
              help="Of the controller.")  # fmt: skip
@out_option("out/loop", writes=_FILES)
@json_option
@click.pass_context
def loop(
    ctx: click.Context,
    /,
    deck_name: str,
    out: Path,
    as_json: bool,
    **options: Any,
) -> None:
    """Evaluate the closed torque loop: responses, margins, impedance, coupled stability, limit cycles.

    The load is fixed for responses, moved for the impedance. Where the spring gives torque of one sign only,
    each sine of the torque swings about 1.25 amplitudes, and 2.25 are held. Exit status 1 if the loop
    limit-cycles or is unstable anywhere in the range that is looked at, with the gain where that begins, or
    if a sine moves no torque. The observer is the cascade, with the numbers of the deck for the machine
    as well.
    """
    from ..foundation.progress import Steps

    fixed, moved = _loops(deck_name, _law(options), options["delay"], options["sample_time"])
    names = ("amplitudes", "last", "inertias", "load_amplitude")
    if options["last"] is None:
        options["last"] = usual_last(fixed.plant)
    check_angles(0.0, options["last"])
    asked = _Asked(**{name: options[name] for name in names}, gain=GAINS[options["law"]])
    with Steps().step("evaluation of the loop"):
        result = _evaluated(fixed, moved, asked)
    files = _written(result, out)
    remarks = _remarks(deck_name, asked.last)
    warn(remarks)
    if as_json:
        show_json(_content(result, files) | {"warnings": remarks})
    else:
        _shown(result)
        for path in files:
            click.echo(f"written: {path}")
    ctx.exit(1 if result.findings else 0)


def _remarks(deck_name: str, last: float) -> list[str]:
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck

    return range_remarks(declare(load_deck(deck_name)), last=last)


def _law(options: dict[str, Any]) -> dict[str, Any]:
    """Return what the controller is made of, as arguments of its function."""
    from ..feedback.control import ScheduledTorque, TorqueGains

    gains = {name: options[name] for name in _GAINS if options[name] is not None}
    if options["law"] == "scheduled":
        if gains:
            raise click.BadParameter(f"the scheduled law has a --bandwidth and no --{next(iter(gains))}")
        return {"law": ScheduledTorque(bandwidth=options["bandwidth"])}
    if options["bandwidth"] is not None:
        raise click.BadParameter("a PID has gains and no bandwidth; leave it out, or take --law scheduled")
    # Without gains the controller picks a velocity loop that the sample time carries.
    return {"gains": TorqueGains(**gains) if gains else None}


def _loops(
    deck_name: str, law: dict[str, Any], delay: int, sample_time: float
) -> tuple[ClosedLoop, ClosedLoop]:
    """Return the loop with the load fixed, and with the load moved; one observer and controller for both."""
    from ..components.assembly.deck_writer import declare
    from ..components.assembly.moved_load import with_moved_load
    from ..feedback.control import encoder_loop, torque_controller
    from ..feedback.observer import CascadeGain, design_observer
    from ..foundation.deck import load_deck
    from ..model import flatten
    from ..model.roles import measured_motion, series_spring
    from ..model.transform import with_outputs

    assembly = declare(load_deck(deck_name))
    plants = []
    for each in (assembly, with_moved_load(assembly)):
        whole = flatten(each)
        plants.append(with_outputs(whole, [measured_motion(whole), series_spring(whole).effort]))
    # What an adaptive observer has learned depends on what went before, so a loop with it has no one figure.
    observer = design_observer(plants[0], sample_time=sample_time, gain=CascadeGain())
    controller = torque_controller(plants[0], sample_time=sample_time, **law)
    substeps = max(1, round(10 * sample_time / 1e-3))
    fixed, moved = (
        encoder_loop(plant, observer=observer, controller=controller, delay=delay, substeps=substeps)
        for plant in plants
    )
    return fixed, moved


def _evaluated(fixed: ClosedLoop, moved: ClosedLoop, asked: _Asked) -> _Evaluation:
    import numpy as np

    from ..export import quickest
    from ..feedback import control as ctl
    from ..model.roles import motor_of

    translate = quickest()
    reach = ctl.largest_torque(fixed.plant)
    side = ctl.only_side(fixed.plant)
    shares = (0.1, 0.3) if side else (0.2, 0.6)
    amplitudes = asked.amplitudes or tuple(float(f"{share * reach:.2g}") for share in shares)
    largest = [a * (side * (1.0 + _BIAS) or 1.0) for a in amplitudes]
    inertia = fixed.plant.values[motor_of(fixed.plant)[1].inertia]
    inertias = np.array(asked.inertias) if asked.inertias else inertia * np.geomspace(0.1, 1e3, 13)
    frequencies = np.geomspace(*_FREQUENCIES)
    angles = np.linspace(0.0, asked.last, 41)
    responses = tuple(
        ctl.sine_response(
            fixed, amplitude=a, frequencies=frequencies, offset=side * _BIAS * a, translate=translate
        )
        for a in amplitudes
    )
    held = ctl.held_torque(fixed, largest, translate=translate)
    gain = fixed.controller.values[asked.gain]
    onsets = tuple(
        ctl.onset_of_limit_cycling(
            fixed, asked.gain, between=(0.1 * gain, 5.0 * gain), amplitude=a, translate=translate
        )
        for a in (largest if gain > 0.0 else ())
    )
    speed = fixed.controller.values["controller.speed_limit"]
    line = ctl.saturation_line(fixed, frequencies, largest_angle=asked.last, speed_limit=speed)
    margins = tuple(ctl.loop_margins(fixed, angles, opening=o) for o in (None, fixed.desired))
    coupled = ctl.coupled_stability(
        moved, angle=0.5 * asked.last, inertias=np.sort(inertias),
        stiffnesses=np.array([0.0, *np.geomspace(0.1, 1e3, 12)]),
    )  # fmt: skip
    zero = ctl.zero_torque(moved, amplitude=asked.load_amplitude, frequencies=(0.5, 1.0, 2.0, 5.0, 9.0),
                           translate=translate)  # fmt: skip
    return _Evaluation(
        replace(asked, amplitudes=amplitudes, inertias=tuple(inertias)), responses, held, onsets, line,
        margins, ctl.output_impedance(moved, angles[::5]), coupled, zero,
        ctl.torque_resolution(fixed, angles),
    )  # fmt: skip


def _written(result: _Evaluation, out: Path) -> list[Path]:
    from ..foundation.files import make_folder, write_table
    from ..presentation import figures

    make_folder(out)
    drawn = {
        "responses": figures.torque_responses(result.responses, result.line),
        "impedance": figures.impedance_over_frequency(result.impedance),
        "margins": figures.margins_over_angle(result.margins),
        "coupled_stability": figures.coupled_stability_map(result.coupled),
    }
    rows = [
        [*(f"{x + 0.0:.9g}" for x in (r.amplitude, r.offset, f, db, phase, d, v.saturated)), str(v)]
        for r in result.responses
        for f, db, phase, d, v in zip(
            r.frequency, r.decibel, r.phase_degrees, r.distortion, r.verdicts, strict=True
        )
    ]
    units = {"amplitude": "N*m", "offset": "N*m", "frequency": "Hz", "magnitude": "dB", "phase": "deg",
             "distortion": "1", "saturated": "1"}  # fmt: skip
    heads = [*(f"{name} [{unit}]" for name, unit in units.items()), "verdict"]
    write_table(out / "responses.csv", [heads, *rows])
    return [*figures.write_figures(out, drawn), out / "responses.csv"]


def _content(result: _Evaluation, files: list[Path]) -> dict[str, Any]:
    linear = result.margins[0].linear
    return {
        "stable": not result.findings,
        "findings": result.findings,
        "responses": [
            {
                "amplitude_Nm": r.amplitude, "offset_Nm": r.offset, "frequency_Hz": _plain(r.frequency),
                "magnitude_dB": _plain(r.decibel), "phase_deg": _plain(r.phase_degrees),
                "saturated": _plain(r.saturated), "verdicts": [str(v) for v in r.verdicts],
            }
            for r in result.responses
        ],
        "onset": [
            {"gain": o.gain, "amplitude_Nm": o.amplitude, "value": _number(o.value),
             "linear": _number(o.linear), "words": str(o)}
            for o in result.onsets
        ],
        "saturation_Nm": _plain(result.line.torque),
        "margins": [
            {"opening": m.opening, "gain_dB": _plain(m.gain), "phase_deg": _plain(m.phase),
             "delay_s": _plain(m.delay)}
            for m in result.margins
        ],
        "angle_rad": _plain(linear.angles), "mode": str(linear.mode),
        "resolution_Nm": _plain(result.resolution),
        "impedance": {"angle_rad": _plain(result.impedance.linear.angles),
                      "active_from_Hz": _plain(result.impedance.first_active())},
        "coupled": {"inertia_kgm2": _plain(result.coupled.inertias),
                    "stiffness_Nm_rad": _plain(result.coupled.stiffnesses),
                    "stable": result.coupled.stable.tolist()},
        "zero_torque": {"frequency_Hz": _plain(result.zero.frequency), "rms_Nm": _plain(result.zero.rms),
                        "energy_J": _plain(result.zero.energy)},
        "files": files,
    }  # fmt: skip


def _number(value: float) -> float | str | None:
    """Return a number that JSON can hold: nothing for what is none, a word for what is infinite."""
    if math.isnan(value):
        return None
    return value + 0.0 if math.isfinite(value) else "infinite" if value > 0.0 else "minus infinite"


def _plain(values: Any) -> list[float | str | None]:
    return [_number(float(v)) for v in values]


def _shown(result: _Evaluation) -> None:
    import numpy as np

    rows = [
        [
            f"{r.amplitude:g}",
            f"{r.offset:g}",
            f"{f:.3g}",
            _text(db),
            _text(phase),
            f"{100 * v.saturated:.0f}",
            str(v),
        ]
        for r in result.responses
        for f, db, phase, v in zip(r.frequency, r.decibel, r.phase_degrees, r.verdicts, strict=True)
    ]
    heads = ("± N·m", "about N·m", "Hz", "dB", "degrees", "% at limit", "verdict")
    show_table("Desired to actual torque, simulated with counts", heads, rows)
    if any(r.offset for r in result.responses):
        click.echo(f"the spring gives torque of one sign only: each sine swings about {_BIAS:g} amplitudes")
    linear, torque = result.margins[0].linear, result.margins[0].linear.torque
    table = []
    for k in range(0, len(linear.angles), 5):
        stable = "stable" if linear.stable()[k] else "unstable" if linear.reached[k] else "beyond the current"
        numbers = [_text(v) for m in result.margins for v in (m.gain[k], m.phase[k], 1e3 * m.delay[k])]
        table.append([f"{np.degrees(linear.angles[k]):.1f}", f"{torque[k]:.3g}", stable, *numbers,
                      f"{1e3 * result.resolution[k]:.2g}"])  # fmt: skip
    units = ("dB", "degrees", "ms")
    cut = [f"{u}, {place}" for place in ("current", "torque") for u in units]
    columns = ("degrees", "N·m", "linear loop", *cut, "mN·m per count")
    show_table(f"Margins over the angle, {linear.mode}", columns, table)
    moved = result.zero
    zero = [
        [f"{f:.3g}", _text(1e3 * t), _text(1e3 * e), str(v)]
        for f, t, e, v in zip(moved.frequency, moved.rms, moved.energy, moved.verdicts, strict=True)
    ]
    show_table("No torque wanted, load moved", ("Hz", "mN·m rms", "mJ lost per cycle", "verdict"), zero)
    from ..presentation.figures.loop_evaluation import passivity_words

    for angle, first in zip(result.impedance.linear.angles, result.impedance.first_active(), strict=True):
        click.echo(f"impedance at {math.degrees(angle):.3g}°: {passivity_words(float(first))}")
    stable_loads = result.coupled.stable
    click.echo(
        f"coupled at {math.degrees(result.coupled.angle):.3g}°: stable on {int(np.sum(stable_loads))} of "
        f"{stable_loads.size} loads"
    )
    for sentence in result.findings:
        click.echo(f"finding: {sentence}")
    if not result.findings:
        for onset in result.onsets:
            click.echo(str(onset))


def _sine(response: SineResponse) -> str:
    about = f" about {response.offset:g} N·m" if response.offset else ""
    return f"±{response.amplitude:g} N·m{about}"


def _text(value: float) -> str:
    if math.isfinite(value):
        return f"{value + 0.0:.3g}"  # minus zero is zero
    return "–" if math.isnan(value) else "∞" if value > 0.0 else "−∞"
