"""``nlsdesign export controller``: the torque controller as C code or FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .output import deck_option, out_option
from .units import Number

if TYPE_CHECKING:
    from ..model import FlatModel


@click.command("controller")
@deck_option
@click.option(
    "--law",
    type=click.Choice(["scheduled", "pid"]),
    default="scheduled",
    show_default=True,
    help="Speed by tangent stiffness, or a PID.",
)
@click.option(
    "--bandwidth", type=Number("Hz"), default=None, help="Of the scheduled law; by default 12 Hz at 1 kHz."
)
@click.option(
    "--velocity-bandwidth",
    type=Number("Hz"),
    default=None,
    help="Of the velocity loop inside; by default 45 Hz at 1 kHz.",
)
@click.option("--sample-time", type=Number("ms"), default="1 ms", show_default=True)
@out_option("out/controller")
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True)
@click.option("--fmu", is_flag=True, help="Write an FMU for co-simulation (FMI 3.0) beside the C code.")
def export_controller(
    deck_name: str,
    law: str,
    sample_time: float,
    out: Path,
    real: str,
    fmu: bool,
    **bandwidths: float | None,
) -> None:
    """Write the torque controller as C99 with a self-test."""
    from ..components.assembly.deck_writer import declare
    from ..control import largest_torque
    from ..deck import load_deck
    from ..export import export_c, export_fmu
    from ..model import flatten

    if law == "pid" and bandwidths["bandwidth"] is not None:
        raise click.BadParameter("a PID has gains and no bandwidth; leave it out, or take --law scheduled")
    plant = flatten(declare(load_deck(deck_name)))
    model = torque_law_of(plant, law=law, sample_time=sample_time, **bandwidths)
    most = largest_torque(plant)
    source = export_c(model, out, real=real, name="controller")
    written = [source.header, source.source, source.selftest]
    if fmu:
        written.append(export_fmu(model, out / "controller.fmu"))
    click.echo(str(model))
    click.echo(f"largest torque that the drive can hold: {most:.4g} N·m")
    click.echo(f"written: {', '.join(str(path) for path in written)}")


def torque_law_of(
    plant: FlatModel,
    *,
    law: str = "scheduled",
    sample_time: float,
    bandwidth: float | None = None,
    velocity_bandwidth: float | None = None,
) -> FlatModel:
    """Return the torque controller as commands write it.

    Parameters
    ----------
    plant
        On the bench.
    law
        ``"scheduled"`` or ``"pid"``.
    sample_time
        In s.
    bandwidth, velocity_bandwidth
        Of the scheduled law and of the velocity loop inside, in Hz.
    """
    from ..control import PidTorque, ScheduledTorque, VelocityLoop, torque_controller

    outer = ScheduledTorque(bandwidth=bandwidth) if law == "scheduled" else PidTorque()
    inner = VelocityLoop(bandwidth=velocity_bandwidth)
    return torque_controller(plant, law=outer, velocity=inner, sample_time=sample_time)
