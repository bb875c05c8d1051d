"""``nlsdesign export modelica``: the equations of a plant as text."""

from __future__ import annotations

from pathlib import Path

import click

from .output import deck_option, examples, json_option, show_written
from .overwriting import out_file_option


@click.command(
    "modelica",
    epilog=examples(
        "nlsdesign export modelica --deck austin2015_figure_consistent --out plant.mo",
        "nlsdesign export modelica --deck own.toml --smooth --output motor.angle --out plant.mo",
    ),
)
@deck_option
@out_file_option(None, "File to write, NAME.mo.", ending=".mo")
@click.option("--smooth", is_flag=True, help="Round what is sharp: dry friction creeps, stops are soft.")
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="NAME",
    help="State or signal that becomes an output, in place of the readings of the sensors; repeatable.",
)
@json_option
def export_modelica_text(
    deck_name: str, out: Path, smooth: bool, outputs: tuple[str, ...], as_json: bool
) -> None:
    """Write the plant of a deck as one flat Modelica class, with units, values and sources.

    Names are those of the deck between quotation marks, such as 'motor.angle'.
    """
    from ..components import smoothed
    from ..components.assembly.deck_writer import declare
    from ..export import export_modelica
    from ..foundation.deck import load_deck
    from ..model import flatten

    assembly = declare(load_deck(deck_name))
    model = flatten(smoothed(assembly) if smooth else assembly, outputs=list(outputs) or None)
    show_written(as_json, (), [export_modelica(model, out)])
