"""``nlsdesign export controller``: the torque controller as C code or FMU."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .output import deck_option, examples, json_option, show_written
from .overwriting import c_names, out_option
from .range_remarks import range_remarks, warn
from .units import Number

if TYPE_CHECKING:
    from ..model import FlatModel

F = TypeVar("F", bound=Callable[..., Any])

_LAW = click.option(
    "--law",
    type=click.Choice(["scheduled", "pid"]),
    default="scheduled",
    show_default=True,
    help="Of the controller: speed by tangent stiffness, or a PID.",
)
_BANDWIDTH = click.option(
    "--bandwidth",
    type=Number("Hz", above=0.0),
    default=None,
    help="Of the scheduled law; by default 12 Hz at 1 kHz.",
)
_VELOCITY_BANDWIDTH = click.option(
    "--velocity-bandwidth",
    type=Number("Hz", above=0.0),
    default=None,
    help="Of the velocity loop inside; by default 45 Hz at 1 kHz.",
)


def law_options(command: F) -> F:
    """Add the options that choose the law of a torque controller."""
    return _LAW(_BANDWIDTH(_VELOCITY_BANDWIDTH(command)))


def controller_of(
    plant: FlatModel,
    sample_time: float,
    *,
    law: str,
    bandwidth: float | None,
    velocity_bandwidth: float | None,
) -> FlatModel:
    """Return the torque controller that the options of a command ask for."""
    from ..feedback.control import PidTorque, ScheduledTorque, VelocityLoop, torque_controller

    if law == "pid" and bandwidth is not None:
        raise click.BadParameter("a PID has gains and no bandwidth; leave it out, or take --law scheduled")
    outer = ScheduledTorque(bandwidth=bandwidth) if law == "scheduled" else PidTorque()
    inner = VelocityLoop(bandwidth=velocity_bandwidth)
    return torque_controller(plant, law=outer, velocity=inner, sample_time=sample_time)


@click.command(
    "controller",
    epilog=examples(
        "nlsdesign export controller --deck austin2015_figure_consistent",
        "nlsdesign export controller --deck my.toml --law scheduled --bandwidth '8 Hz' --fmu",
    ),
)
@deck_option
@law_options
@click.option("--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
              help="Of what is computed in steps.")  # fmt: skip
@out_option(
    "out/controller",
    writes=lambda given: [*c_names("controller"), *(["controller.fmu"] if given["fmu"] else [])],
)
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True,
              help="Type of the numbers in C.")  # fmt: skip
@click.option("--fmu", is_flag=True, help="Write an FMU for co-simulation (FMI 3.0) beside the C code.")
@json_option
def export_controller(
    deck_name: str, sample_time: float, out: Path, real: str, fmu: bool, as_json: bool, **chosen: Any
) -> None:
    """Write the torque controller as C99 with a self-test."""
    from ..components.assembly.deck_writer import declare
    from ..export import export_c, export_fmu
    from ..feedback.control import largest_torque
    from ..foundation.deck import load_deck
    from ..model import flatten

    declared = declare(load_deck(deck_name))
    plant = flatten(declared)
    model = controller_of(plant, sample_time, **chosen)
    most = largest_torque(plant)
    source = export_c(model, out, real=real, name="controller")
    written = [source.header, source.source, source.selftest]
    if fmu:
        written.append(export_fmu(model, out / "controller.fmu"))
    sentences = (str(model), f"largest torque that the drive can hold: {most:.4g} N·m")
    remarks = range_remarks(declared)
    warn(remarks)
    show_written(as_json, sentences, written, largest_torque=most, warnings=remarks)
