"""``nlsdesign export``: C code and FMUs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .controller import export_controller
from .flash import flash_options, sized_observer
from .observer import real_option, sample_time_option
from .observer_kinds import kind_option, observer_of
from .output import deck_option, measured_option, out_option, spring_option


@click.group()
def export() -> None:
    """Write C code or FMUs."""


export.add_command(export_controller)


@export.command("c")
@deck_option
@kind_option
@sample_time_option
@spring_option
@measured_option
@out_option("out/c")
@real_option
@flash_options
def export_observer(deck_name: str, sample_time: float, out: Path, real: str, **options: Any) -> None:
    """Write the torque observer as C99; by default the one that is best over the spread of the deck."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c
    from ..model import flatten

    plant = flatten(declare(load_deck(deck_name)))
    sized = sized_observer(plant, sample_time, real=real, **options)
    model = sized.designed.model
    source = export_c(model, out, real=real, name="observer")
    for sentence in (model.description, *sized.sentences):
        click.echo(sentence)
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")


@export.command("fmu")
@deck_option
@kind_option
@sample_time_option
@spring_option
@measured_option
@out_option("out/fmu")
@click.option(
    "--version", type=click.Choice(["2.0", "3.0"]), default="3.0", show_default=True, help="FMI version."
)
@click.option(
    "--platform",
    "platforms",
    multiple=True,
    help="For instance x86_64-windows; this machine by default; repeatable.",
)
@click.option("--plant-only", is_flag=True, help="Write the plant alone; for a system without an observer.")
def export_fmus(
    deck_name: str,
    sample_time: float,
    out: Path,
    version: str,
    platforms: tuple[str, ...],
    plant_only: bool,
    **chosen: str | None,
) -> None:
    """Write plant and, for an actuator, its observer as co-simulation FMUs."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_fmu
    from ..model import flatten
    from ..model.roles import is_actuator

    plant = flatten(declare(load_deck(deck_name)))
    models = {"plant": plant}
    if is_actuator(plant) and not plant_only:
        # Before anything is written: not every system has an observer.
        models["observer"] = observer_of(plant, sample_time, **chosen)
    systems = list(platforms) or None
    written = [
        export_fmu(model, out / f"{name}.fmu", version=version, platforms=systems)
        for name, model in models.items()
    ]
    click.echo(f"written: {', '.join(str(path) for path in written)}")
