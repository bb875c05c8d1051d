"""``nlsdesign export controller``: the torque controller as C code or FMU."""

from __future__ import annotations

from pathlib import Path

import click

from .output import deck_option, out_option
from .units import Number


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
    from ..control import PidTorque, ScheduledTorque, VelocityLoop, largest_torque, torque_controller
    from ..deck import load_deck
    from ..export import export_c, export_fmu
    from ..model import flatten

    bandwidth = bandwidths["bandwidth"]
    if law == "pid" and bandwidth is not None:
        raise click.BadParameter("a PID has gains and no bandwidth; leave it out, or take --law scheduled")
    plant = flatten(declare(load_deck(deck_name)))
    outer = ScheduledTorque(bandwidth=bandwidth) if law == "scheduled" else PidTorque()
    inner = VelocityLoop(bandwidth=bandwidths["velocity_bandwidth"])
    model = torque_controller(plant, law=outer, velocity=inner, sample_time=sample_time)
    most = largest_torque(plant)
    source = export_c(model, out, real=real, name="controller")
    written = [source.header, source.source, source.selftest]
    if fmu:
        written.append(export_fmu(model, out / "controller.fmu"))
    click.echo(str(model))
    click.echo(f"largest torque that the drive can hold: {most:.4g} N·m")
    click.echo(f"written: {', '.join(str(path) for path in written)}")
