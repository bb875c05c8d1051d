"""``nlsdesign analyse``: poles, observability and sensors over the angle, and the closed torque loop."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ValueRangeError
from ..foundation.quantity import typeset_unit
from ..foundation.text_files import make_folder
from .options import (
    LAWS,
    bandwidth_option,
    deck_option,
    json_option,
    law_of,
    machine_of,
    measured_option,
    spring_option,
)
from .output import examples, show_json, show_lines, show_table, warn
from .overwriting import out_option
from .typed_values import Number

if TYPE_CHECKING:
    from ..feedback.analysis import Chart, RankDrops, SensorRanking
    from ..feedback.control import LoopEvaluation
    from ..model import Variable

_MOST_ANGLE = 100.0
"""Angle in rad: contours end at one turn, springs without one at a few."""


class _OverAngleByDefault(click.Group):
    """A group in which options alone mean its first command."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the first command before options that stand alone."""
        if not args or (args[0].startswith("-") and args[0] not in self.get_help_option_names(ctx)):
            args = [next(iter(self.commands)), *args]
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, the default one first."""
        return list(self.commands)


@click.group(cls=_OverAngleByDefault)
def analyse() -> None:
    """Analyse a machine over its cam angle, or its torque loop. Without a command: as ``analyse angle``."""


def check_angles(first: float, last: float) -> None:
    """Refuse angles in the wrong order, and those that no spring is turned by."""
    if not last > first:
        raise ValueRangeError("--to", "must lie above --from", next_step="give the smaller angle as --from")
    for option, angle in (("--from", first), ("--to", last)):
        if abs(angle) > _MOST_ANGLE:
            raise ValueRangeError(
                f"{option} {math.degrees(angle):.4g}°", f"is more than {math.degrees(_MOST_ANGLE):.0f}°",
                next_step="stay within the contour, or within a few turns where there is none",
            )  # fmt: skip


_HEADINGS = {
    "observability.rank": "rank",
    "observability.condition": "condition",
    "gramian.condition": "Gramian\ncondition",
    "deviation.model": "torque\nfrom model",
    "deviation.best": "torque\nat best",
}


@analyse.command(
    "angle",
    epilog=examples(
        "nlsdesign analyse angle --deck austin2015_figure_consistent --to '45 deg' --count 10",
        "nlsdesign analyse --deck austin2015_figure_consistent --from '-20 deg' --to '20 deg' --json",
    ),
)
@deck_option
@click.option("--from", "first", type=Number("deg"), default="0 deg", show_default=True, help="First angle.")
@click.option("--to", "last", type=Number("deg"), default=None,
              help="Last angle; by default that of the contour, 50 deg at most.")  # fmt: skip
@click.option(
    "--count",
    type=click.IntRange(2, 100_000),
    default=26,
    show_default=True,
    help="Number of angles, at least 2.",
)
@measured_option
@spring_option
@out_option("out/analysis", writes=("over_angle.csv", "poles.svg", "observability.svg", "report.html"))
@json_option
def analyse_angle(
    deck_name: str,
    first: float,
    last: float | None,
    count: int,
    out: Path,
    as_json: bool,
    **roles: str | None,
) -> None:
    """Tell poles, hidden states and the best sensor over the angle. Poles are sliding and stuck."""
    import numpy as np

    from ..feedback.analysis import (
        EstimateDeviation,
        Observability,
        Stability,
        View,
        over_angle,
        rank_drops,
        rank_sensors,
    )
    from ..foundation.errors import NlsError
    from ..model import flatten, series_spring, with_outputs
    from ..presentation.figures import observability_over_angle, stability_over_angle, write_figures
    from ..presentation.report import write_analysis_report
    from ..regeneration import range_remarks, swept_angle, usual_last

    declared = machine_of(deck_name)
    model = flatten(declared)
    torque, measured = series_spring(model, roles["spring"]).effort, swept_angle(model, roles["measured"])
    last = usual_last(model) if last is None else last
    check_angles(first, last)
    angles = np.linspace(first, last, count)
    ranking, unranked = None, ""
    try:
        ranking = rank_sensors(model, angles=angles, angle=measured, estimate=torque)
    except NlsError as error:  # a deck without a sensor of the angle is analysed all the same
        unranked = str(error)
    views: list[View] = [Observability(measured=(measured,)), Stability(torque=torque)]
    if ranking is not None:
        views.append(EstimateDeviation(estimate=torque))
    drops = rank_drops(model, angles=angles, angle=measured)
    model = with_outputs(model, list(dict.fromkeys([measured, torque])))
    chart = over_angle(model, views, angles=angles, angle=measured)
    make_folder(out)
    chart.write_csv(out / "over_angle.csv")
    pictures = {
        "poles": stability_over_angle({model.name: chart}),
        "observability": observability_over_angle({model.name: chart}, drops={model.name: drops}),
    }
    files = [out / "over_angle.csv", *write_figures(out, pictures)]
    remarks = range_remarks(declared, first=first, last=last, measured=measured)
    warn(remarks)
    page = out / "report.html"
    files.append(write_analysis_report(page, chart, drops, model=model.name, ranking=ranking, files=files))
    if as_json:
        show_json(_as_json(chart, drops, ranking) | {"warnings": remarks, "file": files[0], "files": files})
        return
    _show(chart, drops, model.name)
    if ranking is not None:
        headings = [each.replace(" [", "\n[") for each in ranking.headings]
        show_table("Which sensor would help the torque most", headings, ranking.rows())
        click.echo("\n".join([ranking.condition, *(f"left out: {each}" for each in ranking.left_out)]))
    else:
        click.echo(f"sensors are not ranked: {unranked}")
    click.echo(f"written: {', '.join(map(str, files))}")


def _as_json(chart: Chart, drops: RankDrops, ranking: SensorRanking | None) -> dict[str, Any]:
    unseen = [
        {
            "first": drop.first,
            "last": drop.last,
            "direction": drop.unseen.words,
            "eigenvalues": [[value.real, value.imag] for value in drop.unseen.eigenvalues.tolist()],
            "detectable": drop.detectable,
            "cause": drop.cause,
        }
        for drop in drops.drops
    ]
    content: dict[str, Any] = {"angle": chart.at, **{v.name: chart[v.name] for v in chart.columns}}
    content["descriptions"] = {v.name: f"[{v.unit}] {v.description}" for v in chart.columns}
    content |= {"words": dict(chart.words), "unseen": unseen, "detectable": drops.detectable}
    content["verdict"] = drops.lines()
    if ranking is not None:
        rows = [dict(zip(ranking.headings, row, strict=True)) for row in ranking.rows()]
        content["sensors"] = {"rows": rows, "condition": ranking.condition, "left_out": ranking.left_out}
    return content


def _show(chart: Chart, drops: RankDrops, name: str) -> None:
    others = ("observability", "gramian", "deviation")
    modes = [v for v in chart.columns if _group(v) not in others]
    swings = {_group(v) for v in modes if v.name.endswith(".frequency") and chart[v.name].any()}
    modes = [v for v in modes if _group(v) in (*swings, "stiffness") or v.name.endswith(".decay")]
    seen = [v for v in chart.columns if v.name in _HEADINGS]
    _table(f"{name}: observability from {' and '.join(drops.measured)}", chart, seen)
    click.echo("\n".join(drops.lines()) + "\n")
    _table(f"{name}: poles by mode, and stiffness", chart, modes)
    for mode in dict.fromkeys(_group(v) for v in modes if _group(v) != "stiffness"):
        about = next(v.description for v in modes if v.name == f"{mode}.decay")
        click.echo(f"{mode.replace('_', ' ')}: {about.partition('(')[2].rpartition(')')[0]}")
    click.echo("")


def _group(variable: Variable) -> str:
    """Return what a column belongs to: the mode of the plant, or the view."""
    return variable.name.partition(".")[0]


def _table(title: str, chart: Chart, columns: list[Variable]) -> None:
    import numpy as np

    rows = [
        [f"{np.degrees(at):.2f}", *(f"{chart[v.name][i]:.4g}" for v in columns)]
        for i, at in enumerate(chart.at)
    ]
    headings = ["angle\n[deg]"]
    for variable in columns:  # short words in lines of their own, and the unit
        heading = _HEADINGS.get(variable.name) or variable.name.replace(".", "\n").replace("_", "\n")
        unit = typeset_unit(variable.unit)
        headings.append(heading if unit in ("", "1") else f"{heading}\n[{unit}]")
    show_table(title, headings, rows)


_GAINS = ("proportional", "integral", "derivative")
_FILES = ("responses.csv", "responses.svg", "impedance.svg", "margins.svg", "coupled_stability.svg")


@analyse.command(
    epilog=examples(
        "nlsdesign analyse loop --deck austin2015_figure_consistent",
        "nlsdesign analyse loop --deck austin2015_figure_consistent --proportional '32 rad/s/N/m'",
        "nlsdesign analyse loop --deck austin2015_figure_consistent "
        "--bandwidth '10 Hz' --amplitude '0.5 N*m' --json",
    )
)
@deck_option
@click.option("--law", type=click.Choice(list(LAWS)), default=None,
              help="As for export: speed by tangent stiffness, the default; a PID, the default where a gain "
              "of it is given; or reproduced, the PID of the studies.")  # fmt: skip
@bandwidth_option
@click.option("--proportional", type=Number("rad/s/N/m", above=0.0), default=None,
              help="Gain Kp of the torque loop; by default 12 Hz at 1 kHz where the spring is "
              "stiffest.")  # fmt: skip
@click.option("--integral", type=Number("rad/s^2/N/m"), default=None,
              help="Gain Ki of the torque loop; by default 3.125 1/s times Kp.")  # fmt: skip
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
    """Evaluate the closed torque loop. Responses, margins, impedance, coupled stability, limit cycles.

    The load is fixed for responses, moved for the impedance. Where the spring gives torque of one sign only,
    each sine of the torque swings about 1.25 amplitudes, and 2.25 are held. Exit status 1 if the loop
    limit-cycles or is unstable anywhere in the range that is looked at, with the gain where that begins, if
    a sine moves no torque, or if the gain has less than 6 dB and 30 degrees in 95 % of the spread of the
    deck, with the gain that has them. The observer is the cascade, with the numbers of the deck for the
    machine as well.
    """
    from ..components import with_moved_load
    from ..export import quickest
    from ..feedback.control import LoopRange, cascade_loops, evaluate_loop
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..presentation.figures import write_loop_figures
    from ..regeneration import range_remarks, usual_last

    if options["law"] is None:
        options["law"] = "scheduled" if all(options[name] is None for name in _GAINS) else "pid"
    law, declared = _law(options), machine_of(deck_name)
    fixed, moved = cascade_loops(
        flatten(declared), flatten(with_moved_load(declared)),
        delay=options["delay"], sample_time=options["sample_time"], **law,
    )  # fmt: skip
    if options["last"] is None:
        options["last"] = usual_last(fixed.plant)
    check_angles(0.0, options["last"])
    names = ("last", "amplitudes", "inertias", "load_amplitude")
    over = LoopRange(**{name: options[name] for name in names})
    with Steps().step("evaluation of the loop"):
        result = evaluate_loop(fixed, moved, LAWS[options["law"]], over, translate=quickest())
    files = [*write_loop_figures(result, out), *result.write(out)]
    remarks = range_remarks(declared, last=options["last"])
    warn(remarks)
    if as_json:
        show_json(result.content() | {"files": files, "warnings": remarks})
    else:
        _show_loop(result)
        for path in files:
            click.echo(f"written: {path}")
    ctx.exit(0 if result.stable else 1)


def _law(options: dict[str, Any]) -> dict[str, Any]:
    """Return what the controller is made of, as arguments of its function."""
    from ..feedback.control import PidTorque

    gains = {name: options[name] for name in _GAINS if options[name] is not None}
    if gains and options["law"] != "pid":
        own = "a --bandwidth" if options["law"] == "scheduled" else "gains of its own"
        raise click.BadParameter(f"the {options['law']} law has {own} and no --{next(iter(gains))}")
    chosen = law_of(options["law"], options["bandwidth"], None)
    return {"law": PidTorque(**gains)} if gains else chosen


def _show_loop(result: LoopEvaluation) -> None:
    import numpy as np

    from ..feedback.control import BIAS
    from ..presentation.figures import passivity_words

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
    for angle, first in zip(result.impedance.linear.angles, result.impedance.first_active(), strict=True):
        click.echo(f"impedance at {math.degrees(angle):.3g}°: {passivity_words(float(first))}")
    stable_loads = result.coupled.stable
    click.echo(
        f"coupled at {math.degrees(result.coupled.angle):.3g}°: stable on {int(np.sum(stable_loads))} of "
        f"{stable_loads.size} loads"
    )
    show_lines([*result.spread.words(), *(f"finding: {each}" for each in result.findings())])
    if result.stable:
        show_lines(result.onsets)


def _text(value: float) -> str:
    if math.isfinite(value):
        return f"{value + 0.0:.3g}"  # minus zero is zero
    return "–" if math.isnan(value) else "∞" if value > 0.0 else "−∞"
