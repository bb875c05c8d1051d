"""``nlsdesign analyse angle``: observability and stability over the cam angle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import UnitError
from ..quantity import typeset_unit
from ..writing import make_folder
from .output import (
    deck_option,
    json_option,
    measured_option,
    out_option,
    show_json,
    show_table,
    spring_option,
)
from .units import Number

if TYPE_CHECKING:
    from ..model import Variable


@click.command("angle")
@deck_option
@click.option("--to", "last", type=Number("deg"), default="50 deg", show_default=True, help="Last angle.")
@click.option("--count", type=int, default=26, show_default=True, help="Number of angles.")
@measured_option
@spring_option
@out_option("out/analysis")
@json_option
def analyse_angle(
    deck_name: str,
    last: float,
    count: int,
    measured: str | None,
    spring: str | None,
    out: Path,
    as_json: bool,
) -> None:
    """Rank and condition of observability, poles and stiffness, from zero to the last angle."""
    import numpy as np

    from ..analysis import Observability, Stability, over_angle
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..model import flatten
    from ..model.roles import measured_motion, series_spring
    from ..model.transform import with_outputs

    model = flatten(declare(load_deck(deck_name)))
    torque, measured = series_spring(model, spring).effort, measured_motion(model, measured)
    unit = model.variable(measured).unit
    if unit != "rad":
        raise UnitError(
            f"'{measured}'", f"is in {typeset_unit(unit) or '1'}; analyse goes over an angle",
            next_step="name the angle of a body that turns, with --measured",
        )  # fmt: skip
    model = with_outputs(model, list(dict.fromkeys([measured, torque])))
    views = [Observability(measured=(measured,)), Stability(torque=torque)]
    chart = over_angle(model, views, angles=np.linspace(0.0, last, count), angle=measured)
    make_folder(out)
    chart.write_csv(out / "over_angle.csv")
    names = [v.name for v in chart.columns]
    if as_json:
        show_json(
            {"angle": chart.at, **{name: chart[name] for name in names}, "file": out / "over_angle.csv"}
        )
        return
    rows = [
        [f"{np.degrees(at):.1f}", *(f"{v:.4g}" for v in row)]
        for at, row in zip(chart.at, chart.values, strict=True)
    ]
    headings = [with_unit_of(v) for v in chart.columns]
    show_table(f"{model.name} over {measured}", (f"{measured} [deg]", *headings), rows)
    click.echo(f"written: {out / 'over_angle.csv'}")


def with_unit_of(variable: Variable) -> str:
    """Return the heading of a column: name and unit.

    Parameters
    ----------
    variable
        Shown in the column.
    """
    return f"{variable.name} [{typeset_unit(variable.unit) or '1'}]"
