"""``nlsdesign observer`` and ``nlsdesign export``: observer, C code, FMUs, drawings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import ArrangementError
from .controller import export_controller
from .output import deck_option, measured_option, out_option, spring_option
from .units import Number

if TYPE_CHECKING:
    from ..model import FlatModel

_sample_time = click.option("--sample-time", type=Number("ms"), default="1 ms", show_default=True)


def observer_of(
    plant: FlatModel, sample_time: float, *, spring: str | None = None, measured: str | None = None
) -> FlatModel:
    """Return the observer of the torque of a series spring.

    Parameters
    ----------
    plant
        Flat model of an actuator.
    sample_time
        In s.
    spring
        Path of the spring; decided from the structure if it is left out.
    measured
        State that is measured; decided from the structure if it is left out.

    Raises
    ------
    ArrangementError
        If the model has no spring or no driven body, or the structure leaves open which is meant.
    """
    from ..model.roles import measured_motion, series_spring
    from ..observer import design_observer

    try:
        torque, measured = series_spring(plant, spring).effort, measured_motion(plant, measured)
    except ArrangementError as error:
        alone = "nlsdesign export fmu --plant-only writes the plant alone, with its C sources inside"
        raise ArrangementError(error.thing, error.rule, next_step=f"{error.next_step}; {alone}") from None
    return design_observer(plant, estimate=torque, measured=measured, sample_time=sample_time)


@click.command()
@deck_option
@_sample_time
@spring_option
@measured_option
@out_option("out/observer")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
def observer(deck_name: str, sample_time: float, out: Path, real: str, **roles: str | None) -> None:
    """Design the torque observer and write it as C with a self-test."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c
    from ..model import flatten

    model = observer_of(flatten(declare(load_deck(deck_name))), sample_time, **roles)
    source = export_c(model, out, real=real, name="observer")
    click.echo(str(model))
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")


@click.group()
def export() -> None:
    """Write C code or FMUs."""


export.add_command(export_controller)


@export.command("c")
@deck_option
@_sample_time
@spring_option
@measured_option
@out_option("out/c")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
def export_observer(deck_name: str, sample_time: float, out: Path, real: str, **roles: str | None) -> None:
    """Write the torque observer as C99."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c
    from ..model import flatten

    model = observer_of(flatten(declare(load_deck(deck_name))), sample_time, **roles)
    source = export_c(model, out, real=real, name="observer")
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")


@export.command("fmu")
@deck_option
@_sample_time
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
    **roles: str | None,
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
        models["observer"] = observer_of(plant, sample_time, **roles)
    chosen = list(platforms) or None
    written = [
        export_fmu(model, out / f"{name}.fmu", version=version, platforms=chosen)
        for name, model in models.items()
    ]
    click.echo(f"written: {', '.join(str(path) for path in written)}")
