"""``nlsdesign design``: a cam, and rubber with it, for a target torque curve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .output import deck_option, json_option, out_option, show_json, show_table, spring_option
from .units import Number


@click.command()
@deck_option
@click.option("--maximum", type=Number("N*m"), required=True, help='Torque at the end, for instance "5 N·m".')
@click.option("--angle", type=Number("deg"), required=True, help='Angle at the end, for instance "53 deg".')
@click.option(
    "--shape", type=float, default=1.0, show_default=True, help="Exponent c of the target in 1/rad."
)
@click.option(
    "--free",
    multiple=True,
    help="Quantity that may change, e.g. spring.cam.contour; by default the contour alone; repeatable.",
)
@spring_option
@click.option(
    "--minimum-radius",
    type=Number("mm"),
    default="1 mm",
    show_default=True,
    help="Smallest radius of curvature.",
)
@click.option(
    "--maximum-radius", type=Number("mm"), default="20 mm", show_default=True, help="Largest cam radius."
)
@click.option(
    "--maximum-strain", type=Number("1"), default="1", show_default=True, help="Largest strain of the rubber."
)
@out_option("out/design")
@json_option
def design(deck_name: str, out: Path, as_json: bool, **given: Any) -> None:
    """Design the cam for tau(angle) = maximum * (exp(c angle) - 1) / (exp(c end) - 1)."""
    from ..components.assembly.deck_writer import declare, write_deck
    from ..deck import load_deck
    from ..design import (
        ExponentialTorque,
        Limit,
        MaximumCamRadius,
        MaximumStrain,
        MinimumRadiusOfCurvature,
        design_cam,
        write_drawings,
    )
    from ..progress import Steps
    from ..writing import make_folder

    keep: list[Limit] = [
        MinimumRadiusOfCurvature(given["minimum_radius"]),
        MaximumCamRadius(given["maximum_radius"]),
        MaximumStrain(given["maximum_strain"]),
    ]
    target = ExponentialTorque(maximum=given["maximum"], angle=given["angle"], shape=given["shape"])
    with Steps().step("design"):
        designed = design_cam(
            declare(load_deck(deck_name)),
            target=target,
            free=list(given["free"]) or None,
            spring=given["spring"],
            keep=keep,
        )
    make_folder(out)
    write_deck(designed.actuator, out / "model.toml")
    files = [
        out / "model.toml",
        *write_drawings(out, designed.contour, note=f"design {designed.fingerprint}"),
    ]
    if as_json:
        values = {n: q.value for n, q in designed.values.items()}
        show_json({"torque_error_rms": designed.rms, "values": values,
                   "active_limits": designed.active_limits, "files": files})  # fmt: skip
        return
    show_table(
        "Design", ("what", "value"), [*designed.rows(), *(("limit", str(state)) for state in designed.limits)]
    )
    click.echo("written: " + ", ".join(str(path) for path in files))
