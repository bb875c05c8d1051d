"""``nlsdesign observer`` and ``nlsdesign export``: observer, C code, FMUs, drawings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import ArrangementError
from .output import deck_option, out_option
from .units import Number

if TYPE_CHECKING:
    from ..components import Assembly
    from ..model import FlatModel

_sample_time = click.option("--sample-time", type=Number("ms"), default="1 ms", show_default=True)


def is_actuator(assembly: Assembly) -> bool:
    """Tell whether an assembly has a motor and a spring, as a series elastic actuator does.

    Parameters
    ----------
    assembly
        Any.
    """
    return {"motor", "spring"} <= {name for name, _ in assembly.parts}


def observer_of(assembly: Assembly, sample_time: float) -> FlatModel:
    """Return the observer of the spring torque of an assembly.

    Parameters
    ----------
    assembly
        With parts ``motor`` and ``spring``.
    sample_time
        In s.

    Raises
    ------
    ArrangementError
        If the assembly is no actuator.
    """
    from ..model import flatten
    from ..observer import design_observer

    if not is_actuator(assembly):
        raise ArrangementError(
            f"deck '{assembly.name}'",
            "has no parts 'motor' and 'spring', so there is no spring torque to observe",
            next_step="nlsdesign export fmu writes the plant alone, with its C sources inside",
        )
    return design_observer(flatten(assembly), estimate="spring.torque", sample_time=sample_time)


@click.command()
@deck_option
@_sample_time
@out_option("out/observer")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
def observer(deck_name: str, sample_time: float, out: Path, real: str) -> None:
    """Design the torque observer and write it as C with a self-test."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c

    model = observer_of(declare(load_deck(deck_name)), sample_time)
    source = export_c(model, out, real=real, name="observer")
    click.echo(str(model))
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")


@click.group()
def export() -> None:
    """Write C code or FMUs."""


@export.command("c")
@deck_option
@_sample_time
@out_option("out/c")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
def export_observer(deck_name: str, sample_time: float, out: Path, real: str) -> None:
    """Write the torque observer as C99."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c

    source = export_c(
        observer_of(declare(load_deck(deck_name)), sample_time), out, real=real, name="observer"
    )
    click.echo(f"written: {source.header}, {source.source}, {source.selftest}")


@export.command("fmu")
@deck_option
@_sample_time
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
    deck_name: str, sample_time: float, out: Path, version: str, platforms: tuple[str, ...], plant_only: bool
) -> None:
    """Write plant and, for an actuator, its observer as co-simulation FMUs."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_fmu
    from ..model import flatten

    assembly = declare(load_deck(deck_name))
    models = {"plant": flatten(assembly)}
    if is_actuator(assembly) and not plant_only:
        # Before anything is written: not every system has an observer.
        models["observer"] = observer_of(assembly, sample_time)
    chosen = list(platforms) or None
    written = [
        export_fmu(model, out / f"{name}.fmu", version=version, platforms=chosen)
        for name, model in models.items()
    ]
    click.echo(f"written: {', '.join(str(path) for path in written)}")
