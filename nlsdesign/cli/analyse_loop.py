"""``nlsdesign analyse loop``: what the torque loop of an actuator does, and where it stops doing it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .output import deck_option, examples, json_option, show_json, show_table
from .overwriting import out_option
from .range_remarks import check_angles, range_remarks, usual_last, warn
from .units import Number

if TYPE_CHECKING:
    from ..feedback.control import ClosedLoop, LoopEvaluation

GAINS = {"pid": "controller.proportional", "scheduled": "controller.bandwidth"}
"""Number of the controller whose onset of limit cycling is looked for, by law."""
_GAINS = ("proportional", "integral", "derivative")
_FILES = ("responses.csv", "responses.svg", "impedance.svg", "margins.svg", "coupled_stability.svg")


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
    limit-cycles or is unstable anywhere in the range that is looked at, with the gain where that begins, if
    a sine moves no torque, or if the gain has less than 6 dB and 30 degrees in 95 % of the spread of the
    deck, with the gain that has them. The observer is the cascade, with the numbers of the deck for the
    machine as well.
    """
    from ..export import quickest
    from ..feedback.control import LoopRange, evaluate_loop
    from ..foundation.progress import Steps

    fixed, moved = _loops(deck_name, _law(options), options["delay"], options["sample_time"])
    if options["last"] is None:
        options["last"] = usual_last(fixed.plant)
    check_angles(0.0, options["last"])
    names = ("last", "amplitudes", "inertias", "load_amplitude")
    over = LoopRange(**{name: options[name] for name in names})
    with Steps().step("evaluation of the loop"):
        result = evaluate_loop(fixed, moved, GAINS[options["law"]], over, translate=quickest())
    files = _written(result, out)
    remarks = _remarks(deck_name, options["last"])
    warn(remarks)
    if as_json:
        show_json(result.content() | {"files": files, "warnings": remarks})
    else:
        _shown(result)
        for path in files:
            click.echo(f"written: {path}")
    ctx.exit(0 if result.stable else 1)


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
    from ..components.assembly.changed_copies import with_moved_load
    from ..components.assembly.deck_writer import declare
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


def _written(result: LoopEvaluation, out: Path) -> list[Path]:
    from ..foundation.text_files import make_folder
    from ..presentation import figures

    make_folder(out)
    drawn = {
        "responses": figures.torque_responses(result.responses, result.line),
        "impedance": figures.impedance_over_frequency(result.impedance),
        "margins": figures.margins_over_angle(result.margins),
        "coupled_stability": figures.coupled_stability_map(result.coupled),
    }
    return [*figures.write_figures(out, drawn), *result.write(out)]


def _shown(result: LoopEvaluation) -> None:
    import numpy as np

    from ..feedback.control.evaluation.whole_evaluation import BIAS

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
        click.echo(f"the spring gives torque of one sign only: each sine swings about {BIAS:g} amplitudes")
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
    kicked = result.spread.kicked
    if kicked is not None:
        click.echo(f"after a kick at {abs(kicked.amplitude):.3g} N·m: {100 * kicked.held:.0f} % of "
                   f"{len(kicked.verdicts)} machines of the spread settle")  # fmt: skip
    for sentence in result.findings():
        click.echo(f"finding: {sentence}")
    if result.stable:
        for onset in result.onsets:
            click.echo(str(onset))


def _text(value: float) -> str:
    if math.isfinite(value):
        return f"{value + 0.0:.3g}"  # minus zero is zero
    return "–" if math.isnan(value) else "∞" if value > 0.0 else "−∞"
