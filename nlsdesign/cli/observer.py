"""``nlsdesign observer``: the torque observer as C; sub-commands stand in modules of their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import ArrangementError
from .output import DECK_HELP, measured_option, out_option, spring_option
from .units import Number

if TYPE_CHECKING:
    from ..model import FlatModel

sample_time_option = click.option("--sample-time", type=Number("ms"), default="1 ms", show_default=True)
real_option = click.option(
    "--real", type=click.Choice(["double", "float"]), default="double", show_default=True
)


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


@click.group(invoke_without_command=True)
@click.pass_context
@click.option("--deck", "deck_name", metavar="DECK", help=DECK_HELP)
@sample_time_option
@spring_option
@measured_option
@out_option("out/observer")
@real_option
@click.option("--certificate", "certified", is_flag=True, help="Also write what is proved of it.")
@click.option("--decay", type=float, metavar="PER_SECOND", help="Design one certified gain with this decay.")
@click.option("--with-spread", is_flag=True, help="Certify for all parameters within their spread.")
def observer(
    context: click.Context,
    /,
    deck_name: str | None,
    sample_time: float,
    out: Path,
    real: str,
    decay: float | None,
    **options: Any,
) -> None:
    """Design the torque observer and write it as C with a self-test."""
    if context.invoked_subcommand is not None:
        _refuse_misplaced(context)
        return
    if deck_name is None:
        raise click.MissingParameter(ctx=context, param_type="option", param_hint="'--deck'")
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..export import export_c
    from ..model import flatten

    deck = load_deck(deck_name)
    plant = flatten(declare(deck))
    certified, with_spread = options.pop("certified"), options.pop("with_spread")
    if not certified:
        if decay is not None or with_spread:
            raise click.UsageError("--decay and --with-spread belong to --certificate", ctx=context)
        model = observer_of(plant, sample_time, **options)
        source = export_c(model, out, real=real, name="observer")
        click.echo(str(model))
        click.echo(f"written: {source.header}, {source.source}, {source.selftest}")
        return
    from .observer_certificate import ToProve, write_certified

    wanted = ToProve(decay, with_spread, real)
    write_certified(plant, deck, out, sample_time=sample_time, wanted=wanted, **options)


def _refuse_misplaced(context: click.Context) -> None:
    """Refuse options before the name of a sub-command, which would be read by nobody."""
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if source is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{parameter.opts[0]} stands before '{context.invoked_subcommand}'; "
                "options of a sub-command stand behind its name",
                ctx=context,
            )
