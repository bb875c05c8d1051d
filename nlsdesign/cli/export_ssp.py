"""``nlsdesign export ssp``: FMUs and their wires as one archive of the SSP standard."""

from __future__ import annotations

from pathlib import Path

import click

from .cosimulate import WIRE_HELP, pairs, read_wire
from .output import examples, json_option, show_written
from .overwriting import out_file_option


@click.command(
    "ssp",
    epilog=examples(
        "nlsdesign export ssp --fmu plant=out/fmu/plant.fmu --fmu observer=out/fmu/observer.fmu "
        "--wire observer.motor_encoder.reading=plant.motor_encoder.reading --out out/system.ssp"
    ),
)
@click.option("--fmu", "fmus", multiple=True, required=True, metavar="INSTANCE=FILE", help="Repeatable.")
@click.option("--wire", "wires", multiple=True, metavar="TO=FROM[*GAIN][@DELAY]", help=WIRE_HELP)
@click.option("--set", "parameters", multiple=True, metavar="PARAMETER=NUMBER", help="Repeatable.")
@click.option("--order", multiple=True, metavar="INSTANCE", help="As for 'cosimulate'; repeatable.")
@click.option(
    "--input", "inputs", multiple=True, metavar="INPUT", help="Becomes an input of the system; repeatable."
)
@click.option("--version", type=click.Choice(["1.0", "2.0"]), default="1.0", show_default=True,
              help="Of the standard.")  # fmt: skip
@out_file_option(None, "File to write, NAME.ssp.", ending=".ssp")
@json_option
def export_ssp(version: str, out: Path, as_json: bool, **given: tuple[str, ...]) -> None:
    """Write FMUs and their wires as one SSP archive, which other tools and 'cosimulate --system' run."""
    from ..export import write_ssp

    written = write_ssp(
        out,
        fmus=pairs("--fmu", given["fmus"], Path),
        wires=pairs("--wire", given["wires"], read_wire),
        parameters=pairs("--set", given["parameters"], float),
        order=given["order"],
        inputs=given["inputs"],
        version=version,
    )
    for note in written.notes:
        click.echo(f"an annotation, which other tools may ignore: {note}", err=True)
    show_written(as_json, (), [written.path], annotations=list(written.notes))
