"""``nlsdesign analyse angle``: poles, observability and further sensors over the cam angle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.quantity import typeset_unit
from ..foundation.text_files import make_folder
from .output import (
    deck_option,
    examples,
    json_option,
    measured_option,
    show_json,
    show_table,
    spring_option,
)
from .overwriting import out_option
from .range_remarks import check_angles, range_remarks, swept_angle, usual_last, warn
from .units import Number

if TYPE_CHECKING:
    from ..feedback.analysis import Chart, RankDrops, SensorRanking
    from ..model import FlatModel, Variable

_HEADINGS = {
    "observability.rank": "rank",
    "observability.condition": "condition",
    "gramian.condition": "Gramian\ncondition",
    "deviation.model": "torque\nfrom model",
    "deviation.best": "torque\nat best",
}


@click.command(
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
    """Poles sliding and stuck, exact angles that hide a state, and which sensor would help most."""
    import numpy as np

    from ..components.assembly.deck_writer import declare
    from ..feedback.analysis import Observability, Stability, View, over_angle, rank_drops
    from ..foundation.deck import load_deck
    from ..model import flatten
    from ..model.roles import series_spring
    from ..model.transform import with_outputs
    from ..presentation.figures import observability_over_angle, stability_over_angle, write_figures
    from ..presentation.report import write_analysis_report

    declared = declare(load_deck(deck_name))
    model = flatten(declared)
    torque, measured = series_spring(model, roles["spring"]).effort, swept_angle(model, roles["measured"])
    last = usual_last(model) if last is None else last
    check_angles(first, last)
    angles = np.linspace(first, last, count)
    ranking, unranked = _ranking(model, angles, measured, torque)
    views: list[View] = [Observability(measured=(measured,)), Stability(torque=torque)]
    if ranking is not None:
        views.append(_deviation(torque))
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


def _ranking(model: FlatModel, angles: Any, measured: str, torque: str) -> tuple[SensorRanking | None, str]:
    """Return the ranked sensors, or why there are none; the rest of the analysis does not need them."""
    from ..feedback.analysis import rank_sensors
    from ..foundation.errors import NlsError

    try:
        return rank_sensors(model, angles=angles, angle=measured, estimate=torque), ""
    except NlsError as error:  # a deck without a sensor of the angle is analysed all the same
        return None, str(error)


def _deviation(torque: str) -> Any:
    from ..feedback.analysis import EstimateDeviation

    return EstimateDeviation(estimate=torque)


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
    show_table(title, ("angle\n[deg]", *(_heading(v) for v in columns)), rows)


def _heading(variable: Variable) -> str:
    """Return the heading of a column: short words in lines of their own, and the unit."""
    words = _HEADINGS.get(variable.name) or variable.name.replace(".", "\n").replace("_", "\n")
    unit = typeset_unit(variable.unit)
    return words if unit in ("", "1") else f"{words}\n[{unit}]"
