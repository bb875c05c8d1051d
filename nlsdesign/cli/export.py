"""``nlsdesign export``: C code and FMUs."""

from __future__ import annotations

from pathlib import Path

import click

from .controller import export_controller
from .export_fmu import export_fmus
from .observer import real_option, sample_time_option
from .observer_kinds import kind_option, observer_of
from .output import deck_option, measured_option, out_option, spring_option


@click.group()
def export() -> None:
    """Write C code or FMUs."""


export.add_command(export_controller)
export.add_command(export_fmus)


@export.command("c")
@deck_option
@kind_option
@sample_time_option
@spring_option
@measured_option
@out_option("out/c")
@real_option
def export_observer(deck_name: str, sample_time: float, out: Path, real: str, **chosen: str | None) -> None:
    """Write the torque observer as C99; by default the one that is best over the spread of the deck."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c
    from ..model import flatten

    model = observer_of(flatten(declare(load_deck(deck_name))), sample_time, **chosen)
    source = export_c(model, out, real=real, name="observer")
    click.echo(model.description)
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")
